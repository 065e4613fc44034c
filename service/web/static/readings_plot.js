// Where the target was measured, from above and from the side, as the readings come.

import { colour } from "./colours.js";
import { axis, drawAlways } from "./plot.js";
import { say } from "./words.js";

const PAINTS = {
  calibrate: "series-fit",
  follow_up: "series-fit",
  health: "series-fit",
  nominal: "series-before",
  compensated: "series-held-out",
};
const REDRAW_MS = 400;

export class ReadingsPlot {
  #readings = [];
  #draw = null;
  #waiting = false;

  constructor(place) {
    this.place = place;
  }

  add(reading) {
    this.#readings.push(reading);
    this.#redrawSoon();
  }

  use(plotly) {
    this.#draw = drawAlways(plotly, this.place, () => this.#figure());
    this.#redrawSoon();
  }

  // A campaign that is opened late brings all its readings at once: they make one drawing.
  #redrawSoon() {
    if (this.#waiting || !this.#draw || !this.#readings.length) return;
    this.#waiting = true;
    setTimeout(async () => {
      this.#waiting = false;
      await this.#draw();
    }, REDRAW_MS);
  }

  #figure() {
    const purposes = Object.keys(PAINTS).filter((purpose) =>
      this.#readings.some((reading) => reading.purpose === purpose),
    );
    const views = [
      { vertical: "y_mm", axes: {} },
      { vertical: "z_mm", axes: { xaxis: "x2", yaxis: "y2" } },
    ];
    const traces = views.flatMap((view, index) => [
      ...purposes.map((purpose) => this.#points(purpose, view, index === 0)),
      this.#latest(view, index === 0),
    ]);
    return { traces, layout: layout() };
  }

  #points(purpose, view, named) {
    const chosen = this.#readings.filter((reading) => reading.purpose === purpose);
    return {
      ...coordinates(chosen, view),
      name: say(`purpose_${purpose}`),
      legendgroup: purpose,
      showlegend: named,
      marker: { color: colour(PAINTS[purpose]), size: 6 },
    };
  }

  #latest(view, named) {
    return {
      ...coordinates(this.#readings.slice(-1), view),
      name: say("latest"),
      legendgroup: "latest",
      showlegend: named,
      marker: { color: colour("text"), symbol: "circle-open", size: 14, line: { width: 2 } },
    };
  }
}

function coordinates(readings, view) {
  return {
    x: readings.map((reading) => reading.x_mm),
    y: readings.map((reading) => reading[view.vertical]),
    text: readings.map((reading) => say("pose_label", reading)),
    hovertemplate: "%{text}<br>%{x:.2f}, %{y:.2f} mm<extra></extra>",
    type: "scatter",
    mode: "markers",
    ...view.axes,
  };
}

function layout() {
  const title = (key, domain) => ({
    text: say(key),
    x: (domain[0] + domain[1]) / 2,
    y: 1.02,
    xref: "paper",
    yref: "paper",
    yanchor: "bottom",
    showarrow: false,
    font: { color: colour("quiet") },
  });
  const [left, right] = [[0, 0.46], [0.56, 1]];
  return {
    xaxis: axis(say("axis_x"), { domain: left }),
    yaxis: axis(say("axis_y"), { scaleanchor: "x" }),
    xaxis2: axis(say("axis_x"), { domain: right, anchor: "y2" }),
    yaxis2: axis(say("axis_z"), { scaleanchor: "x2", anchor: "x2" }),
    margin: { l: 64, r: 16, t: 64, b: 52 },
    legend: { orientation: "h", x: 0, y: 1.14, yanchor: "bottom" },
    annotations: [title("top_view", left), title("side_view", right)],
  };
}
