// The diagnosis of a campaign: shown when it is there, and its follow-up started from here.

import { post } from "./api.js";
import { confirmed } from "./confirm.js";
import { refresh } from "./parts.js";
import { say } from "./words.js";

const ROUNDS = 3;

export async function showDiagnosis(part) {
  await refresh(part);
  part.querySelector("#follow-up")?.addEventListener("click", followUp);
}

async function followUp(event) {
  const { cell, campaign } = event.currentTarget.dataset;
  const refusal = document.getElementById("follow-up-refusal");
  refusal.hidden = true;
  const payload = document.getElementById("follow-up-payload_kg");
  if (payload && !payload.reportValidity()) return;
  const question = say("arm_question", { cell });
  if (!(await confirmed(question, say("follow_up_warning"), say("follow_up_confirm")))) return;
  try {
    await post(`/api/v1/cells/${cell}/arm`);
    const wanted = { cell, kind: "follow_up", follows: Number(campaign), rounds: ROUNDS };
    if (payload?.value) wanted.payload_kg = Number(payload.value);
    const started = await post("/api/v1/campaigns", { json: wanted });
    location.assign(`/campaigns/${started.id}`);
  } catch (error) {
    refusal.textContent = error.message;
    refusal.hidden = false;
  }
}
