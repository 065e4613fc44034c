// The form of a campaign: checked against the cell as it is filled in, its plan previewed.

import { get } from "./api.js";
import { checkFields, tellField } from "./form_check.js";
import { PlanPreview } from "./plan_preview.js";
import { say } from "./words.js";

const PAUSE_MS = 500;
const CHECKED = ["cell", "kind", "poses"];

export function guide(form) {
  const preview = new PlanPreview();
  const field = (name) => form.elements.namedItem(name);
  const seed = field("seed");
  let waiting = 0;
  let asked = "";

  async function check() {
    const [cell, kind, poses] = CHECKED.map((name) => field(name).value);
    if (!cell || !kind || !CHECKED.every((name) => field(name).validity.valid)) {
      preview.hide();
      return;
    }
    asked = `/parts/cells/${cell}/check?kind=${kind}&poses=${poses}`;
    const notes = await checked(asked);
    if (!notes) return;
    for (const name of CHECKED) {
      const own = notes.filter((note) => note.field === name);
      const sentence = own.map((note) => say(note.key, note.values)).join(" ");
      tellField(field(name), sentence, own[0]?.tone ?? "");
    }
    if (kind !== "calibrate" || notes.some((note) => note.tone === "bad")) return preview.hide();
    const wish = { cell, poses, seed: seed.value || newSeed() };
    await preview.ask(wish, (taken) => (seed.value = taken));
  }

  async function checked(wish) {
    try {
      const notes = await get(wish);
      return wish === asked ? notes : null;
    } catch {
      // The service is away for a moment; starting tells that in words.
      return null;
    }
  }

  function soon() {
    clearTimeout(waiting);
    waiting = setTimeout(check, PAUSE_MS);
  }

  checkFields(form);
  form.addEventListener("input", soon);
  soon();
  return soon;
}

function newSeed() {
  return crypto.getRandomValues(new Uint32Array(1))[0] >>> 1;
}
