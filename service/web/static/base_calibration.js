// The page of one base calibration: the next touch, the sensors live, the touches, the result.

import { get, newKey, post } from "./api.js";
import { confirmed } from "./confirm.js";
import { ready } from "./ready.js";
import { drawStage } from "./stage_picture.js";
import { showAssessment, table } from "./stage_result.js";
import { say } from "./words.js";

const LOOK_MS = 700;
const place = (id) => document.getElementById(id);
const number = place("base-calibration").dataset.number;
const address = `/api/v1/base-calibrations/${number}`;
let calibration = null;
let looking = null;

async function refresh() {
  calibration = await get(address);
  const touching = calibration.state === "touching";
  const badge = place("state");
  badge.className = `badge ${touching ? "running" : "finished"}`;
  badge.textContent = say(`stage_state_${calibration.state}`);
  place("procedure").hidden = !touching;
  place("finish").hidden = !calibration.may_finish;
  showNext(calibration.next_touch);
  drawStage(place("picture"), calibration);
  showAssessment(place("so-far"), calibration);
  showTouches(touching);
  if (touching) looking ??= setInterval(look, LOOK_MS);
  else await showVersion();
}

function showNext(next) {
  place("next-words").textContent = next
    ? say("stage_next_touch", {
        robot: say(`stage_robot_${next.robot}`),
        cup: say(`stage_cup_${next.cup}`),
        step: say(`stage_step_${next.step}`),
      })
    : say("stage_no_next");
  place("next-why").textContent = next?.why ?? "";
  place("next-set").hidden = !next;
  const dials = place("next-dials");
  dials.replaceChildren();
  if (!next) return;
  pair(dials, "slide", `${next.slide_mm.toFixed(0)} mm`);
  if (next.rod_angle_deg !== null) pair(dials, "rod_angle", `${next.rod_angle_deg.toFixed(0)}°`);
  if (next.rod_length_mm !== null) pair(dials, "rod_length", `${next.rod_length_mm.toFixed(0)} mm`);
  place("take-robot").value = next.robot;
  place("take-cup").value = next.cup;
}

function pair(list, part, value) {
  const name = document.createElement("dt");
  name.textContent = say(`stage_part_${part}`);
  const shown = document.createElement("dd");
  shown.textContent = value;
  list.append(name, shown);
}

async function look() {
  if (document.hidden) return;
  let found;
  try {
    found = await get(`${address}/sensors`);
  } catch {
    place("sensors").classList.add("stale");
    return;
  }
  place("sensors").classList.remove("stale");
  for (const view of found.sensors) showSensor(view);
}

function showSensor(view) {
  const row = document.querySelector(`[data-sensor="${view.sensor}"]`);
  const digits = view.unit === "mm" ? 3 : 4;
  const unit = view.unit === "mm" ? "mm" : "°";
  const [value, lamp, note] = [".sensor-value", ".lamp", ".sensor-note"].map((name) =>
    row.querySelector(name),
  );
  value.textContent = view.mean === null ? "–" : `${view.mean.toFixed(digits)} ${unit}`;
  lamp.className = `lamp ${view.steady ? "steady" : "unsteady"}`;
  lamp.textContent = view.steady ? say("stage_steady") : say("stage_unsteady");
  const spread = { unit, spread: view.spread?.toFixed(4), allowed: view.allowed_spread.toFixed(4) };
  const measured = view.spread === null ? say("stage_waiting") : say("stage_spread", spread);
  note.textContent = view.problem || measured;
}

function showTouches(touching) {
  const box = place("touches");
  if (!calibration.touches.length) {
    box.textContent = say("stage_no_touches");
    return;
  }
  const rows = calibration.touches.map((touch) => [
    touch.number,
    say(`stage_robot_${touch.robot}`),
    say(`stage_cup_${touch.cup}`),
    touch.slide_mm.toFixed(3),
    touch.cup === "rod" ? touch.rod_angle_deg.toFixed(4) : "",
    touch.cup === "rod" ? touch.rod_length_mm.toFixed(4) : "",
    touch.taken.slice(11, 19),
    touch.voided ? say("stage_voided", { reason: touch.void_reason }) : voidButton(touch, touching),
  ]);
  const heads = [
    say("stage_column_number"),
    say("stage_robot"),
    say("stage_cup"),
    `${say("stage_part_slide")} [mm]`,
    `${say("stage_part_rod_angle")} [°]`,
    `${say("stage_part_rod_length")} [mm]`,
    say("stage_column_taken"),
    "",
  ];
  const made = table("list", heads, rows, [3, 4, 5]);
  calibration.touches.forEach((touch, index) => {
    const row = made.tBodies[0].rows[index];
    row.lastElementChild.className = "remark";
    if (touch.voided) row.className = "voided";
  });
  box.replaceChildren(made);
}

function voidButton(touch, touching) {
  if (!touching) return "";
  const button = document.createElement("button");
  button.type = "button";
  button.textContent = say("stage_void");
  button.addEventListener("click", () => askVoid(touch.number));
  return button;
}

function askVoid(touch) {
  const dialog = place("void");
  place("void-question").textContent = say("stage_void_question", { number: touch });
  place("void-reason").value = "";
  dialog.returnValue = "cancel";
  dialog.showModal();
  dialog.addEventListener(
    "close",
    () => {
      if (dialog.returnValue !== "yes") return;
      const json = { reason: place("void-reason").value };
      act(() => post(`${address}/touches/${touch}/void`, { json }));
    },
    { once: true },
  );
}

async function showVersion() {
  clearInterval(looking);
  const path = `/api/v1/base-transforms/${calibration.name}`;
  const made = await get(`${path}?version=${calibration.version}`);
  const words = { version: made.version, name: made.name, state: say(`stage_${made.state}`) };
  note(say("stage_version", words), made.state === "released" ? "good" : "");
  place("download").hidden = false;
  place("release-box").hidden = made.state !== "candidate";
}

function note(text, tone) {
  const notice = place("notice");
  notice.textContent = text;
  notice.className = `notice ${tone}`;
  notice.hidden = !text;
}

async function act(work) {
  try {
    const text = await work();
    if (typeof text === "string") note(text, "good");
    place("next-words").textContent = say("stage_computing");
    await refresh();
  } catch (refusal) {
    note(refusal.message, "bad");
  }
}

// The same touch sent again after a lost answer must not count twice: it keeps its key.
let latest = { text: "", key: "" };

place("take").addEventListener("submit", async (event) => {
  event.preventDefault();
  const button = place("take-button");
  button.disabled = true;
  note(say("stage_taking"), "");
  await act(async () => {
    const json = {
      robot: place("take-robot").value,
      cup: place("take-cup").value,
      stage_moved: place("take-moved").checked,
    };
    const text = JSON.stringify(json);
    if (text !== latest.text) latest = { text, key: newKey() };
    const touch = await post(`${address}/touches`, { json, key: latest.key });
    latest = { text: "", key: "" };
    place("take-moved").checked = false;
    return say("stage_taken", touch);
  });
  button.disabled = false;
});

place("finish").addEventListener("click", async () => {
  const sure = await confirmed(
    say("stage_finish_question"),
    say("stage_finish_warning"),
    say("stage_finish"),
  );
  if (sure) await act(() => post(`${address}/finish`));
});

place("release").addEventListener("click", async () => {
  const version = calibration.version;
  const question = say("stage_release_question", { version });
  if (!(await confirmed(question, say("stage_release_warning"), say("stage_release")))) return;
  const json = { reason: place("release-reason").value };
  await act(async () => {
    await post(`/api/v1/base-transforms/${calibration.name}/${version}/release`, { json });
  });
});

await act(() => null);
ready();
