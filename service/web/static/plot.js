// plotly.js: loaded when the first plot is drawn, without the button that uploads to Plotly's cloud.

import { colour, onThemeChange } from "./colours.js";

const CONFIG = {
  displaylogo: false,
  displayModeBar: "hover",
  modeBarButtonsToRemove: ["sendChartToCloud", "select2d", "lasso2d", "autoScale2d"],
  plotlyServerURL: "",
  responsive: true,
};

let loading;

export function loadPlotly(address) {
  loading ??= new Promise((resolve, reject) => {
    const script = document.createElement("script");
    script.src = address;
    script.onload = () => resolve(window.Plotly);
    script.onerror = () => reject(new Error(address));
    document.head.append(script);
  });
  return loading;
}

// Draws, and draws again in other colours when the day ends. `figure` makes traces and layout.
export function drawAlways(plotly, place, figure) {
  const draw = () => {
    const { traces, layout } = figure();
    return plotly.react(place, traces, themed(layout), CONFIG);
  };
  onThemeChange(draw);
  return draw;
}

export function axis(title, more = {}) {
  return {
    title: { text: title, standoff: 12 },
    gridcolor: colour("line"),
    linecolor: colour("line"),
    zeroline: false,
    ...more,
  };
}

function themed(layout) {
  return {
    paper_bgcolor: "transparent",
    plot_bgcolor: "transparent",
    font: { family: getComputedStyle(document.body).fontFamily, size: 13, color: colour("text") },
    margin: { l: 64, r: 16, t: 36, b: 52 },
    legend: { orientation: "h", x: 0, y: 1.02, yanchor: "bottom" },
    hoverlabel: { bgcolor: colour("surface"), font: { color: colour("text") } },
    modebar: { bgcolor: "transparent", color: colour("quiet"), activecolor: colour("accent") },
    ...layout,
  };
}
