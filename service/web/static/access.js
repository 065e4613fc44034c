// Users and keys: make them, end them. What is shown once stays until the page is left.

import { post } from "./api.js";
import { confirmed } from "./confirm.js";
import { enhance } from "./form.js";
import { ready } from "./ready.js";
import { say } from "./words.js";

const made = document.getElementById("made");

function show(sentence, tone) {
  made.textContent = sentence;
  made.className = `notice ${tone}`;
  made.hidden = false;
  made.scrollIntoView({ block: "nearest" });
}

async function giveLink(name) {
  const link = await post(`/api/v1/users/${name}/link`);
  show(say("link_made", { name, link: new URL(link.path, location.href).href }), "good");
}

const ACTIONS = {
  link: ({ user }) => giveLink(user),
  disable: async ({ user }) => {
    const question = say("disable_question", { name: user });
    if (!(await confirmed(question, say("disable_warning"), say("disable_user")))) return;
    await post(`/api/v1/users/${user}/disable`);
    location.reload();
  },
  revoke: async ({ key, name }) => {
    const question = say("revoke_question", { name });
    if (!(await confirmed(question, say("revoke_warning"), say("revoke_key")))) return;
    await post(`/api/v1/keys/${key}/revoke`);
    location.reload();
  },
};

document.getElementById("access").addEventListener("click", async (event) => {
  const button = event.target.closest("button[data-do]");
  if (!button) return;
  try {
    await ACTIONS[button.dataset.do](button.closest("tr").dataset);
  } catch (refusal) {
    show(refusal.message, "bad");
  }
});

enhance(document.getElementById("new-user"), (user) => giveLink(user.name));
enhance(document.getElementById("new-key"), (key) => {
  show(say("key_made", { name: key.name, key: key.key }), "good");
});
ready();
