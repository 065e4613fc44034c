// What a calibration found, as pictures: parameters with their intervals, errors over the workspace.

import { colour } from "./colours.js";
import { axis, drawAlways } from "./plot.js";
import { Space } from "./space.js";
import { say } from "./words.js";

const SYMBOLS = { theta: "θ", alpha: "α", beta: "β" };
const NARROW = 1.96;

// Change of every parameter with its 95 % interval, lengths and angles on scales of their own.
export async function drawIntervals(plotly, place, identification) {
  const rows = identification.parameters.filter((row) => row.status === "identified");
  const series = (unit, paint, axes) => {
    const own = rows.filter((row) => row.unit === unit);
    return {
      x: own.map(nameOf),
      y: own.map((row) => row.identified - row.nominal),
      error_y: { type: "data", array: own.map((row) => NARROW * row.std), thickness: 2, width: 5 },
      type: "scatter",
      mode: "markers",
      marker: { color: colour(paint), size: 7 },
      showlegend: false,
      hovertemplate: "%{x}: %{y:.4f} ± %{error_y.array:.4f}<extra></extra>",
      ...axes,
    };
  };
  await drawAlways(plotly, place, () => ({
    traces: [
      series("mm", "series-fit", {}),
      series("deg", "series-held-out", { xaxis: "x2", yaxis: "y2" }),
    ],
    layout: {
      xaxis: axis("", { domain: [0, 0.45], showgrid: false }),
      yaxis: axis(say("axis_change_mm"), { zeroline: true, zerolinecolor: colour("quiet") }),
      xaxis2: axis("", { domain: [0.55, 1], anchor: "y2", showgrid: false }),
      yaxis2: axis(say("axis_change_deg"), {
        anchor: "x2",
        zeroline: true,
        zerolinecolor: colour("quiet"),
      }),
      margin: { l: 64, r: 16, t: 10, b: 40 },
    },
  }))();
}

function nameOf({ name }) {
  const [letter, joint] = name.split("_");
  // Not <sub>: plotly.js would style it in a way that the pages' policy forbids.
  const below = Array.from(joint, (digit) => String.fromCodePoint(0x2080 + Number(digit)));
  return (SYMBOLS[letter] ?? letter) + below.join("");
}

// Where the robot is still off, where the target was measured. Rows of lengths alone have no place.
export function mapResiduals(place, identification, measurements) {
  const rows = identification.residual_rows;
  const points = rows.line
    .map((line, i) => ({ row: measurements.rows[line - 2], mm: rows.after_mm[i], i }))
    .filter(({ row }) => row && Number.isFinite(row.x_mm));
  if (!points.length) return false;
  const most = Math.max(...points.map(({ mm }) => mm));
  const centre = mean(points.map(({ row }) => [row.x_mm, row.y_mm, row.z_mm]));
  draw(place, "residual_map", most, points.map(({ row, mm, i }) => ({
    at: [row.x_mm, row.y_mm, row.z_mm].map((value, axis) => value - centre[axis]),
    text: say("map_residual", { pose: rows.pose[i], mm: mm.toFixed(3) }),
    share: mm / most,
    size: rows.held_out[i] ? 7 : 5,
  })));
  return true;
}

// How sure the tool is, cube by cube of the workspace.
export function mapUncertainty(place, workspace) {
  const most = Math.max(...workspace.cubes.map((cube) => cube.U95_max_mm));
  const low = Math.min(...workspace.cubes.map((cube) => cube.U95_mean_mm));
  draw(place, "uncertainty_map", most, workspace.cubes.map((cube) => ({
    at: cube.centre_mm,
    text: say("map_uncertainty", {
      mm: cube.U95_mean_mm.toFixed(3),
      most: cube.U95_max_mm.toFixed(3),
    }),
    share: (cube.U95_mean_mm - low) / (most - low || 1),
    size: 6,
  })), low);
}

function draw(place, key, most, dots, low = 0) {
  const space = new Space(place, { label: say(`${key}_picture`) });
  space.frame(dots.map((dot) => dot.at));
  const legend = { low: low.toFixed(3), high: most.toFixed(3), title: say(`${key}_legend`) };
  space.show({ dots, legend, ground: Math.min(...dots.map((dot) => dot.at[2])) });
  place.dataset.dots = dots.length;
}

function mean(points) {
  return [0, 1, 2].map((axis) => points.reduce((sum, p) => sum + p[axis], 0) / points.length);
}
