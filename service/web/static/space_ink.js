// How things in space are drawn: ground, axes, the arm with its shadow, a legend, a tag.

import { colour, shade } from "./colours.js";

const GRID = [100, 200, 250, 500, 1000, 2000];
const BASE_PX = 34;
const TIP_SHARE = 0.4;

export function drawGround(ink, at, camera, ground) {
  const reach = camera.radius * 1.1;
  const step = GRID.find((size) => reach / size <= 5) ?? GRID.at(-1);
  const count = Math.ceil(reach / step);
  ink.strokeStyle = colour("line");
  ink.lineWidth = 1;
  for (let i = -count; i <= count; i++) {
    line(ink, at, [i * step, -count * step, ground], [i * step, count * step, ground]);
    line(ink, at, [-count * step, i * step, ground], [count * step, i * step, ground]);
  }
}

export function drawAxes(ink, at, length) {
  const paints = ["bad", "good", "accent"];
  ["x", "y", "z"].forEach((name, axis) => {
    const end = [0, 1, 2].map((i) => (i === axis ? length : 0));
    ink.strokeStyle = ink.fillStyle = colour(paints[axis]);
    ink.lineWidth = 2;
    line(ink, at, [0, 0, 0], end);
    const [x, y] = at(end.map((value) => value * 1.15));
    ink.fillText(name, x - 3, y + 4);
  });
}

export function drawArm(ink, at, points, scale, ground) {
  const wide = Math.min(Math.max(BASE_PX * Math.sqrt(scale * 2), 8), 26);
  const widthOf = (i) => wide * (1 - ((1 - TIP_SHARE) * i) / (points.length - 1));
  ink.lineCap = ink.lineJoin = "round";
  ink.globalAlpha = 0.14;
  stroke(ink, points.map(([x, y]) => at([x, y, ground])), colour("text"), wide * 0.5);
  ink.globalAlpha = 1;
  const flat = points.map(at);
  const links = flat.slice(1).map((end, i) => ({ start: flat[i], end, width: widthOf(i) }));
  links.sort((one, other) => one.start[2] + one.end[2] - other.start[2] - other.end[2]);
  for (const { start, end, width } of links) {
    stroke(ink, [start, end], colour("arm-edge"), width + 3);
    stroke(ink, [start, end], colour("arm"), width);
  }
  flat.slice(1, -1).forEach(([x, y], i) => circle(ink, x, y, widthOf(i + 1) * 0.28, "arm-edge"));
  const [x, y] = flat.at(-1);
  circle(ink, x, y, 5, "series-held-out");
}

export function drawLegend(ink, { low, high, title }, height) {
  const [left, top, width] = [12, height - 30, 130];
  for (let i = 0; i < width; i++) {
    ink.fillStyle = shade(i / width);
    ink.fillRect(left + i, top, 1.5, 8);
  }
  ink.fillStyle = colour("quiet");
  ink.fillText(title, left, top - 6);
  ink.fillText(low, left, top + 21);
  ink.fillText(high, left + width - ink.measureText(high).width, top + 21);
}

export function drawTag(ink, text, x, y, width) {
  const wide = ink.measureText(text).width + 14;
  const left = Math.min(Math.max(x + 10, 2), width - wide - 2);
  ink.fillStyle = colour("surface");
  ink.strokeStyle = colour("quiet");
  ink.lineWidth = 1;
  ink.beginPath();
  ink.roundRect(left, y - 30, wide, 22, 5);
  ink.fill();
  ink.stroke();
  ink.fillStyle = colour("text");
  ink.fillText(text, left + 7, y - 15);
}

function line(ink, at, from, to) {
  ink.beginPath();
  ink.moveTo(...at(from).slice(0, 2));
  ink.lineTo(...at(to).slice(0, 2));
  ink.stroke();
}

function stroke(ink, points, paint, width) {
  ink.strokeStyle = paint;
  ink.lineWidth = width;
  ink.beginPath();
  points.forEach(([x, y], i) => (i ? ink.lineTo(x, y) : ink.moveTo(x, y)));
  ink.stroke();
}

function circle(ink, x, y, radius, paint) {
  ink.beginPath();
  ink.arc(x, y, Math.max(radius, 2), 0, 2 * Math.PI);
  ink.fillStyle = colour(paint);
  ink.fill();
}
