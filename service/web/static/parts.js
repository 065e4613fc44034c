// Parts of a page that the service renders anew.

import { leaveForLogin } from "./api.js";

// As the page itself came: nothing of it has changed yet when the first script looks.
const shown = new WeakMap(
  Array.from(document.querySelectorAll("[data-part]"), (part) => [part, part.innerHTML]),
);

export async function refresh(part) {
  const answer = await fetch(part.dataset.part);
  if (answer.status === 401) {
    leaveForLogin();
    return;
  }
  if (!answer.ok) throw new Error(`${part.dataset.part}: status ${answer.status}`);
  const text = asHeld(await answer.text());
  if (text === shown.get(part)) return;
  const focused = part.contains(document.activeElement) ? document.activeElement.id : "";
  shown.set(part, text);
  part.innerHTML = text;
  if (focused) document.getElementById(focused)?.focus();
  part.dispatchEvent(new Event("refreshed"));
}

// What the browser makes of a text: it writes some characters otherwise.
function asHeld(text) {
  const made = document.createElement("template");
  made.innerHTML = text;
  return made.innerHTML;
}

export function keepFresh(part, seconds) {
  setInterval(async () => {
    if (document.hidden) return;
    try {
      await refresh(part);
      part.classList.remove("stale");
    } catch {
      // The service is away for a moment; what is shown is old until it comes back.
      part.classList.add("stale");
    }
  }, 1000 * seconds);
}
