// What a campaign tells while it runs, for as long as the page is open.
//
// A browser comes back by itself when a connection breaks, but never after an answer that is no
// stream: one refusal by a service that just starts would be the end.

import { get } from "./api.js";

const AGAIN_MS = 3000;

// `heard` has a function for each kind of event. Returns what ends it.
export function followEvents(campaign, heard, connected) {
  let source = null;
  let seen = 0;

  function open() {
    source = new EventSource(`${campaign}/events?last_event_id=${seen}`);
    source.addEventListener("open", () => connected(true));
    source.addEventListener("error", () => {
      connected(false);
      if (source.readyState === EventSource.CLOSED) setTimeout(openAgain, AGAIN_MS);
    });
    for (const [kind, hear] of Object.entries(heard)) {
      source.addEventListener(kind, (event) => {
        seen = event.lastEventId || seen;
        hear(JSON.parse(event.data));
      });
    }
  }

  // The stream does not say why it was refused; a request does, and leads to the login.
  async function openAgain() {
    try {
      await get(campaign);
    } catch {
      setTimeout(openAgain, AGAIN_MS);
      return;
    }
    open();
  }

  open();
  return () => source.close();
}
