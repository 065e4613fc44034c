// The page's code has taken over its forms: before that the browser would send them by itself, with
// what was typed in the address.

export function ready() {
  for (const button of document.querySelectorAll("button[data-waits]")) button.disabled = false;
  document.documentElement.dataset.ready = "yes";
}
