// The stage from above, in its own frame: the guide from left to right, the rod beside it.

const SPACE = "http://www.w3.org/2000/svg";
const WIDTH = 600;
const HEIGHT = 260;
const MARGIN = 40;

export function drawStage(svg, calibration) {
  const stage = calibration.settings.stage;
  const [from, to] = stage.slide_range_mm;
  const longest = stage.rod_length_range_mm[1];
  const left = from - longest;
  const scale = Math.min(
    (WIDTH - 2 * MARGIN) / (to - left),
    (HEIGHT - 2 * MARGIN) / (2 * longest),
  );
  const x = (value) => MARGIN + (value - left) * scale;
  const y = (value) => HEIGHT / 2 - value * scale;
  svg.replaceChildren();
  line(svg, "guide", x(from), y(0), x(to), y(0));
  const next = calibration.next_touch;
  const last = calibration.touches.at(-1);
  if (next) rod(svg, x, y, next.slide_mm, next, last);
  for (const touch of calibration.touches) {
    if (touch.voided) continue;
    const [u, w] = cupOf(touch);
    dot(svg, touch.robot, x(u), y(w), 6);
    label(svg, touch.number, x(u) + 9, y(w) - 7);
  }
  if (next) {
    const [u, w] = cupOf(next);
    dot(svg, "wanted", x(u), y(w), 12);
  }
}

function rod(svg, x, y, slide, next, last) {
  const angle = next.rod_angle_deg ?? last?.rod_angle_deg ?? 0;
  const length = next.rod_length_mm ?? last?.rod_length_mm ?? 0;
  const [u, w] = cupOf({ cup: "rod", slide_mm: slide, rod_angle_deg: angle, rod_length_mm: length });
  line(svg, "rod", x(slide), y(0), x(u), y(w));
  dot(svg, "cup", x(slide), y(0), 7);
  dot(svg, "cup", x(u), y(w), 7);
}

function cupOf(touch) {
  if (touch.cup === "slide") return [touch.slide_mm, 0];
  const angle = (touch.rod_angle_deg * Math.PI) / 180;
  const length = touch.rod_length_mm;
  return [touch.slide_mm - length * Math.cos(angle), length * Math.sin(angle)];
}

function line(svg, name, x1, y1, x2, y2) {
  add(svg, "line", { class: name, x1, y1, x2, y2 });
}

function dot(svg, name, cx, cy, r) {
  add(svg, "circle", { class: name, cx, cy, r });
}

function label(svg, text, x, y) {
  add(svg, "text", { x, y }).textContent = text;
}

function add(svg, kind, attributes) {
  const element = document.createElementNS(SPACE, kind);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  svg.append(element);
  return element;
}
