// The form that starts a base calibration: its names are places in the request.

import { post } from "./api.js";
import { tell } from "./form.js";
import { ready } from "./ready.js";

const form = document.getElementById("new-base-calibration");

function requestOf() {
  const body = {};
  for (const input of form.querySelectorAll("input, select")) {
    const path = input.name.split(".");
    const last = path.pop();
    let place = body;
    path.forEach((name, step) => {
      const next = step + 1 < path.length ? path[step + 1] : last;
      place = place[name] ??= /^\d+$/.test(next) ? [] : {};
    });
    place[last] = input.type === "number" ? input.valueAsNumber : input.value.trim();
  }
  return body;
}

form.addEventListener("submit", async (event) => {
  event.preventDefault();
  tell(form, "", "");
  try {
    const made = await post("/api/v1/base-calibrations", { json: requestOf() });
    location.assign(`/base-calibrations/${made.id}`);
  } catch (refusal) {
    tell(form, refusal.message, "bad");
  }
});
ready();
