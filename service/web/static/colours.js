// The colours of the style sheet, for what is drawn by scripts.

const dark = matchMedia("(prefers-color-scheme: dark)");
const probe = document.body.appendChild(document.createElement("i"));
probe.hidden = true;

// As an element sees it, since a variable itself still holds both the light and the dark colour.
export function colour(name) {
  probe.style.color = `var(--${name})`;
  return getComputedStyle(probe).color;
}

export function onThemeChange(draw) {
  dark.addEventListener("change", draw);
  document.addEventListener("theme", draw);
}

// From small to large; told apart on light and on dark ground.
const STOPS = [
  [59, 111, 212],
  [47, 166, 184],
  [88, 184, 106],
  [217, 177, 59],
  [224, 102, 47],
  [184, 36, 60],
];

export function shade(share) {
  const at = Math.min(Math.max(share, 0), 1) * (STOPS.length - 1);
  const low = Math.min(Math.floor(at), STOPS.length - 2);
  const mixed = STOPS[low].map((part, i) => part + (at - low) * (STOPS[low + 1][i] - part));
  return `rgb(${mixed.map(Math.round).join(" ")})`;
}
