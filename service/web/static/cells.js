// The buttons of a cell: arm, disarm, test the connection.

import { post } from "./api.js";
import { confirmed } from "./confirm.js";
import { refresh } from "./parts.js";
import { say } from "./words.js";

const ACTIONS = { arm, disarm, check };

// What was told of each cell. It outlives the card, which the service renders anew.
const notices = new Map();

export function watchCells(part) {
  part.addEventListener("click", async (event) => {
    const button = event.target.closest("button[data-do]");
    if (!button) return;
    const { cell } = button.closest("[data-cell]").dataset;
    button.disabled = true;
    try {
      await ACTIONS[button.dataset.do](cell, part);
    } catch (refusal) {
      tell(cell, part, "bad", refusal.message);
    } finally {
      button.disabled = false;
      // A button that is disabled or replaced loses the focus, and the keyboard its place.
      if (document.activeElement === document.body) document.getElementById(button.id)?.focus();
    }
  });
  part.addEventListener("refreshed", () => showNotices(part));
}

async function arm(cell, part) {
  const question = say("arm_question", { cell });
  if (!(await confirmed(question, say("arm_warning"), say("arm_confirm")))) return;
  await post(`/api/v1/cells/${cell}/arm`);
  notices.delete(cell);
  await refresh(part);
}

async function disarm(cell, part) {
  await post(`/api/v1/cells/${cell}/disarm`);
  notices.delete(cell);
  await refresh(part);
}

async function check(cell, part) {
  tell(cell, part, "", say("checking"));
  const found = await post(`/api/v1/cells/${cell}/check`);
  const devices = [
    [say("robot"), found.robot],
    [say("tracker"), found.tracker],
    [say("temperature_probe"), found.temperature_probe],
    ...Object.entries(found.stage_sensors),
  ];
  const list = document.createElement("ul");
  list.className = "health";
  list.append(...devices.filter(([, answer]) => answer).map(deviceLine));
  tell(cell, part, found.ok ? "good" : "bad", list);
}

function deviceLine([device, { ok, detail }]) {
  const line = document.createElement("li");
  line.className = ok ? "good" : "bad";
  line.textContent = say(ok ? "check_good" : "check_fault", { device, detail });
  return line;
}

function tell(cell, part, tone, content) {
  const notice = document.createElement("div");
  notice.setAttribute("role", "status");
  notice.className = `notice ${tone}`;
  notice.append(content);
  notices.get(cell)?.remove();
  notices.set(cell, notice);
  showNotices(part);
}

function showNotices(part) {
  for (const card of part.querySelectorAll("[data-cell]")) {
    const notice = notices.get(card.dataset.cell);
    if (notice) card.append(notice);
  }
}
