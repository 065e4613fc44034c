// Requests to the service. A refusal carries the one sentence that the service gave.

import { say } from "./words.js";

// Here a 401 says that the password or the link was wrong.
const LOGINS = ["/api/v1/login", "/api/v1/welcome"];

export class Refusal extends Error {}

export function newKey() {
  // Not crypto.randomUUID: it is missing where a page comes over plain HTTP from another host.
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  return Array.from(bytes, (byte) => byte.toString(16).padStart(2, "0")).join("");
}

export function get(address) {
  return send(address, { headers: { Accept: "application/json" } });
}

export function post(address, { json, file, key = newKey() } = {}) {
  const headers = { "Idempotency-Key": key, ...ownPage() };
  if (json) headers["Content-Type"] = "application/json";
  if (file) headers["Content-Type"] = "application/zip";
  return send(address, { method: "POST", headers, body: json ? JSON.stringify(json) : file });
}

// The service takes changes from its own pages alone: they know this token, other sites do not.
export function ownPage() {
  const token = document.querySelector('meta[name="csrf-token"]').content;
  return token ? { "X-CSRF-Token": token } : {};
}

// The way on where a login has ended; once is enough, each further one would begin the way anew.
let leaving = false;

export function leaveForLogin() {
  if (leaving) return;
  leaving = true;
  location.assign(`/login?next=${encodeURIComponent(location.pathname + location.search)}`);
}

async function send(address, options) {
  const answer = await reach(address, options);
  if (answer.ok) return answer.json();
  if (answer.status === 401 && !LOGINS.includes(address)) {
    leaveForLogin();
    // The page is being left: nobody is to read anything of the refusal.
    return new Promise(() => {});
  }
  const told = answer.headers.get("content-type")?.startsWith("application/problem+json");
  throw new Refusal(
    told ? (await answer.json()).detail : say("answer_unclear", { status: answer.status }),
  );
}

async function reach(address, options) {
  try {
    return await fetch(address, options);
  } catch (error) {
    throw new Refusal(say("no_answer"), { cause: error });
  }
}
