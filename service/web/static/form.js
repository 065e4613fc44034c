// A form that talks to the REST interface: what was typed stays, a refusal is shown beside it.

import { newKey, post } from "./api.js";
import { keepDraft } from "./draft.js";
import { say } from "./words.js";

export function enhance(form, done) {
  const forget = keepDraft(form);
  let latest = { text: "", key: "" };

  form.addEventListener("submit", async (event) => {
    event.preventDefault();
    const request = requestOf(form);
    // The same request sent again after a lost answer must not act twice: it keeps its key.
    const text = request.file ? fileMark(request.file) : JSON.stringify(request.json);
    if (text !== latest.text) latest = { text, key: newKey() };
    const release = engage(form);
    try {
      const answer = await post(form.dataset.action, { ...request, key: latest.key });
      latest = { text: "", key: "" };
      forget();
      await done(answer);
    } catch (refusal) {
      tell(form, refusal.message, "bad");
    } finally {
      release();
    }
  });
}

export function tell(form, sentence, tone) {
  const notice = form.querySelector(".notice");
  notice.textContent = sentence;
  notice.className = `notice ${tone}`;
  notice.hidden = !sentence;
}

function requestOf(form) {
  const chosen = form.querySelector('input[type="file"]');
  return chosen ? { file: chosen.files[0] } : { json: jsonOf(form) };
}

function jsonOf(form) {
  const json = {};
  for (const input of form.querySelectorAll("input, select")) {
    if (input.dataset.optional && !input.value) continue;
    const path = input.name.split(".");
    const last = path.pop();
    const place = path.reduce((node, name) => (node[name] ??= {}), json);
    place[last] = valueOf(input);
  }
  return json;
}

function valueOf(input) {
  if (input.dataset.nullable && !input.value) return null;
  if (input.type === "number" || input.dataset.numeric) return Number(input.value);
  return input.type === "password" ? input.value : input.value.trim();
}

function fileMark(file) {
  return `${file.name} ${file.size} ${file.lastModified}`;
}

function engage(form) {
  const button = form.querySelector('button[type="submit"]');
  const label = button.textContent;
  tell(form, "", "");
  button.disabled = true;
  button.textContent = say("working");
  return () => {
    button.disabled = false;
    button.textContent = label;
  };
}
