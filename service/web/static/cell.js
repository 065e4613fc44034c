// A cell's page: release and roll back its parameters, and the trend of its health.

import { get, post } from "./api.js";
import { colour } from "./colours.js";
import { confirmed } from "./confirm.js";
import { axis, drawAlways, loadPlotly } from "./plot.js";
import { ready } from "./ready.js";
import { say } from "./words.js";

const LEAST_HOURS = 24;
const HOUR_MS = 3_600_000;

const page = document.getElementById("cell-page");
const { cell } = page.dataset;
const decision = document.getElementById("decision");

document.getElementById("versions")?.addEventListener("click", async (event) => {
  const button = event.target.closest("button[data-do]");
  if (!button) return;
  const { version } = button.closest("tr").dataset;
  const step = button.dataset.do;
  const question = say(`${step}_question`, { version, cell });
  if (!(await confirmed(question, say(`${step}_warning`), say(step)))) return;
  const json = { reason: document.getElementById("reason").value.trim() };
  try {
    await post(`/api/v1/cells/${cell}/parameters/${version}/${step}`, { json });
    location.reload();
  } catch (refusal) {
    decision.textContent = refusal.message;
    decision.className = "notice bad";
    decision.hidden = false;
  }
});

async function showHealth() {
  const { checks } = await get(`/api/v1/cells/${cell}/health`);
  if (!checks.length) return;
  document.getElementById("health-note").textContent = say("health_trend_note");
  const latest = document.getElementById("health-latest");
  const [newest] = checks;
  latest.replaceChildren(say(verdict(newest)), ...(newest.alarm ? [advice(newest)] : []));
  latest.className = `notice ${newest.alarm ? "bad" : newest.trend_alarm ? "caution" : "good"}`;
  latest.hidden = false;
  const place = document.getElementById("health-plot");
  place.hidden = false;
  const plotly = await loadPlotly(page.dataset.plotly);
  await drawAlways(plotly, place, () => trend([...checks].reverse()))();
  place.dataset.drawn = "yes";
}

function verdict(check) {
  return check.alarm ? "health_alarm" : check.trend_alarm ? "health_drifts" : "health_good";
}

// The numerics give it in English, whatever the page speaks.
function advice(check) {
  const sentence = document.createElement("span");
  sentence.lang = "en";
  sentence.textContent = check.advice;
  return sentence;
}

// Chi-square against its limit, so that checks of different size stand on one scale.
function trend(checks) {
  const at = checks.map((check) => check.at);
  const paint = (check) => colour(check.alarm ? "bad" : check.trend_alarm ? "caution" : "good");
  return {
    traces: [
      {
        x: at,
        y: checks.map((check) => check.chi_square / check.chi_square_limit),
        text: checks.map((check) => say("campaign_title", { id: check.campaign })),
        mode: "lines+markers",
        line: { color: colour("series-before"), width: 1 },
        marker: { color: checks.map(paint), size: 10 },
        hovertemplate: "%{text}<br>%{x}<br>%{y:.2f}<extra></extra>",
      },
    ],
    layout: {
      xaxis: axis("", { showgrid: false, range: timeRange(at) }),
      yaxis: axis(say("axis_health"), { rangemode: "tozero" }),
      shapes: [
        {
          type: "line",
          xref: "paper",
          x0: 0,
          x1: 1,
          y0: 1,
          y1: 1,
          line: { color: colour("bad"), dash: "dash", width: 2 },
        },
      ],
      margin: { l: 64, r: 16, t: 10, b: 40 },
    },
  };
}

// A single check, or two in one hour, would stand on an axis of milliseconds.
function timeRange(at) {
  const times = at.map((moment) => Date.parse(moment));
  const [first, last] = [Math.min(...times), Math.max(...times)];
  const span = Math.max(1.1 * (last - first), LEAST_HOURS * HOUR_MS);
  const middle = (first + last) / 2;
  return [middle - span / 2, middle + span / 2].map((time) => new Date(time).toISOString());
}

ready();
await showHealth();
