// How far a campaign is: bar, words, and which of its buttons may be used.

import { say } from "./words.js";

const badge = document.getElementById("state");
const bar = document.getElementById("bar");
const count = document.getElementById("count");
const phase = document.getElementById("phase");
const remaining = document.getElementById("remaining");
const reason = document.getElementById("reason");
const controls = document.getElementById("controls");

export const ENDED = ["finished", "aborted", "failed"];

export function showProgress(campaign, latest) {
  badge.className = `badge ${campaign.state}`;
  badge.textContent = say(`state_${campaign.state}`);
  bar.max = campaign.total;
  bar.value = campaign.done;
  count.textContent = say("progress_readings", campaign);
  phase.textContent = phaseOf(campaign, latest);
  remaining.textContent = remainingOf(campaign);
  reason.textContent = campaign.reason;
  reason.className = `notice ${campaign.state === "failed" ? "bad" : "caution"}`;
  reason.hidden = !campaign.reason;
  controls.hidden = ENDED.includes(campaign.state);
  for (const button of controls.querySelectorAll("button")) {
    button.disabled = !button.dataset.in.split(" ").includes(campaign.state);
  }
}

function phaseOf(campaign, latest) {
  if (campaign.state === "finished") return say("phase_finished");
  if (campaign.state !== "running" && campaign.state !== "queued") return "";
  if (campaign.done === campaign.total) return say("phase_computing");
  if (campaign.state === "queued") return campaign.reason ? "" : say("phase_queued");
  if (!latest) return say("phase_planning");
  return say(campaign.repeats > 1 ? "phase_repeating" : "phase_measuring", latest);
}

function remainingOf(campaign) {
  if (campaign.state !== "running" || campaign.done === campaign.total) return "";
  if (campaign.remaining_s === null) return say("remaining_unknown");
  const whole = Math.ceil(campaign.remaining_s);
  const [minutes, seconds] = [Math.floor(whole / 60), whole % 60];
  const time = minutes ? say("minutes_seconds", { minutes, seconds }) : say("seconds", { seconds });
  return say("remaining", { time });
}
