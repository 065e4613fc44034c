// The page of one campaign: follow it, steer it, show what came of it.

import { get, post } from "./api.js";
import { watchCells } from "./cells.js";
import { confirmed } from "./confirm.js";
import { showDiagnosis } from "./diagnosis.js";
import { drawResiduals, drawVerification } from "./error_plot.js";
import { followEvents } from "./events.js";
import { LiveView } from "./live.js";
import { refresh } from "./parts.js";
import { loadPlotly } from "./plot.js";
import { ENDED, showProgress } from "./progress.js";
import { ReadingsPlot } from "./readings_plot.js";
import { ready } from "./ready.js";
import { drawIntervals, mapResiduals, mapUncertainty } from "./result_maps.js";
import { say } from "./words.js";

const page = document.getElementById("campaign");
const address = `/api/v1/campaigns/${page.dataset.campaign}`;
const cell = document.getElementById("cell");
const connection = document.getElementById("connection");
const refusal = document.getElementById("refusal");
const result = document.getElementById("result");
const diagnosis = document.getElementById("diagnosis");
const readings = document.getElementById("readings");
const plot = new ReadingsPlot(document.getElementById("readings-plot"));
const live = cell && new LiveView(document.getElementById("live"), page.dataset.campaign);

const skipped = document.getElementById("skipped");

let latest = null;
let skippedShown = 0;

const ACTIONS = {
  pause: () => post(`${address}/pause`),
  resume: () => post(`${address}/resume`),
  skip: () => post(`${address}/resume`, { json: { skip_pose: true } }),
  abort: async () => {
    const sure = await confirmed(say("abort_question"), say("abort_warning"), say("abort_confirm"));
    if (sure) await post(`${address}/abort`);
  },
};

document.getElementById("controls").addEventListener("click", async (event) => {
  const button = event.target.closest("button[data-do]");
  if (!button) return;
  refusal.hidden = true;
  try {
    await ACTIONS[button.dataset.do]();
  } catch (error) {
    refusal.textContent = error.message;
    refusal.hidden = false;
  }
});

const stop = followEvents(
  address,
  {
    reading: (reading) => {
      latest = reading;
      readings.hidden = false;
      plot.add(reading);
      live?.add(reading);
    },
    arm: (arm) => live?.follow(arm),
    progress: (campaign) => {
      showProgress(campaign, latest);
      showSkipped(campaign.skipped);
      // Whoever resumes a campaign arms the cell first, and can do both here.
      if (cell) showCell(campaign.state === "paused");
      if (ENDED.includes(campaign.state)) {
        stop();
        showResult(campaign);
      }
    },
  },
  (there) => (connection.hidden = there),
);

async function showSkipped(count) {
  if (count === skippedShown) return;
  skippedShown = count;
  await refresh(skipped);
}

async function showCell(wanted) {
  if (wanted && cell.hidden) await refresh(cell);
  cell.hidden = !wanted;
}

async function showResult(campaign) {
  await refresh(result);
  if (diagnosis) await showDiagnosis(diagnosis);
  if (campaign.state !== "finished") return;
  live?.end();
  document.getElementById("result-downloads").hidden = false;
  const place = result.querySelector("[data-plot]");
  if (!place) return;
  const kind = place.dataset.plot === "verification" ? "verification" : "identification";
  const draw = kind === "verification" ? drawVerification : drawResiduals;
  const found = await get(`${address}/${kind}`);
  if (kind === "identification") await showMaps(found);
  await withPlotly(place, (plotly) => draw(plotly, place, found));
  place.dataset.drawn = "yes";
}

async function showMaps(identification) {
  const measured = await get(`${address}/measurements`);
  const drawn = mapResiduals(result.querySelector("[data-map=residuals]"), identification, measured);
  document.getElementById("residual-map").hidden = !drawn;
  const uncertainty = result.querySelector("[data-map=uncertainty]");
  if (uncertainty) mapUncertainty(uncertainty, (await get(`${address}/uncertainty`)).workspace);
  const intervals = result.querySelector("[data-intervals]");
  await withPlotly(intervals, (plotly) => drawIntervals(plotly, intervals, identification));
}

async function withPlotly(place, use) {
  let plotly;
  try {
    plotly = await loadPlotly(page.dataset.plotly);
  } catch {
    place.textContent = say("plot_failed");
    return;
  }
  await use(plotly);
}

if (cell) watchCells(cell);
ready();
await withPlotly(document.getElementById("readings-plot"), (plotly) => {
  plot.use(plotly);
  live?.use(plotly);
});
