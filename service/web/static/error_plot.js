// The errors before and after, pose by pose, as points on a logarithmic scale.

import { colour } from "./colours.js";
import { axis, drawAlways } from "./plot.js";
import { say } from "./words.js";

// plotly.js would label the steps between powers of ten with a lone 2 or 5.
const TICKS = [-4, -3, -2, -1, 0, 1, 2].flatMap((power) =>
  [1, 2, 5].map((step) => Number(`${step}e${power}`)),
);

export async function drawResiduals(plotly, place, identification) {
  const rows = identification.residual_rows;
  const all = rows.pose.map((_, row) => row);
  const fitted = all.filter((row) => !rows.held_out[row] && !rows.rejected[row]);
  const rejected = all.filter((row) => rows.rejected[row]);
  const heldOut = all.filter((row) => rows.held_out[row]);
  const series = (chosen, values) => ({
    x: chosen.map((row) => rows.pose[row]),
    y: chosen.map((row) => values[row]),
    text: chosen.map((row) => say("hover_row", { pose: rows.pose[row], line: rows.line[row] })),
  });
  await drawAlways(plotly, place, () => ({
    traces: [
      points(series(all, rows.before_mm), "series_before", "series-before", "circle-open"),
      points(series(fitted, rows.after_mm), "series_fit", "series-fit", "circle"),
      points(series(heldOut, rows.after_mm), "series_held_out", "series-held-out", "diamond"),
      points(series(rejected, rows.after_mm), "series_rejected", "bad", "x"),
    ].filter((trace) => trace.x.length),
    layout: layout("axis_pose", "axis_residual"),
  }))();
}

export async function drawVerification(plotly, place, verification) {
  const series = (errors) => ({ x: errors.map((_, target) => target), y: errors });
  const { before, after } = verification;
  await drawAlways(plotly, place, () => ({
    traces: [
      points(series(before.errors_mm), "series_nominal", "series-before", "circle-open"),
      points(series(after.errors_mm), "series_compensated", "series-held-out", "diamond"),
    ],
    layout: layout("axis_target", "axis_error"),
  }))();
}

function points(series, name, paint, symbol) {
  const many = series.x.length > 300;
  return {
    ...series,
    type: "scatter",
    mode: "markers",
    name: say(name),
    marker: { color: colour(paint), symbol, size: many ? 5 : 9, opacity: many ? 0.6 : 1 },
    hovertemplate: `${series.text ? "%{text}<br>" : "%{x}<br>"}%{y:.4f} mm<extra>${say(name)}</extra>`,
  };
}

function layout(x, y) {
  return {
    xaxis: axis(say(x), { showgrid: false }),
    yaxis: axis(say(y), { type: "log", tickvals: TICKS, ticktext: TICKS.map(String) }),
  };
}
