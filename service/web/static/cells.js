// The buttons of a cell: arm, disarm, test the connection.

import { post } from "./api.js";
import { confirmed } from "./confirm.js";
import { refresh } from "./parts.js";
import { say } from "./words.js";

const ACTIONS = { arm, disarm, check };

export function watchCells(part) {
  part.addEventListener("click", async (event) => {
    const button = event.target.closest("button[data-do]");
    if (!button) return;
    const card = button.closest("[data-cell]");
    button.disabled = true;
    try {
      await ACTIONS[button.dataset.do](card.dataset.cell, card, part);
    } catch (refusal) {
      note(card, refusal.message, "bad");
    } finally {
      button.disabled = false;
    }
  });
}

async function arm(cell, card, part) {
  const question = say("arm_question", { cell });
  if (!(await confirmed(question, say("arm_warning"), say("arm_confirm")))) return;
  await post(`/api/v1/cells/${cell}/arm`);
  await refresh(part);
}

async function disarm(cell, card, part) {
  await post(`/api/v1/cells/${cell}/disarm`);
  await refresh(part);
}

async function check(cell, card) {
  note(card, say("checking"), "");
  const found = await post(`/api/v1/cells/${cell}/check`);
  const words = { robot: found.robot.detail, tracker: found.tracker.detail };
  note(card, say("check_good", words), found.ok ? "good" : "bad");
}

function note(card, sentence, tone) {
  let place = card.querySelector(".notice");
  if (!place) {
    place = document.createElement("p");
    place.setAttribute("role", "status");
    card.append(place);
  }
  place.className = `notice ${tone}`;
  place.textContent = sentence;
}
