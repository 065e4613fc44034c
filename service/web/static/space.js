// An arm and points in space on a canvas: turned by mouse, touch or the arrow keys.
//
// Not plotly's 3D: it needs WebGL, takes more than a second to start without a graphics card, and
// no key moves it (docs/decisions.md).

import { Camera } from "./camera.js";
import { colour, onThemeChange, shade } from "./colours.js";
import { drawArm, drawAxes, drawGround, drawLegend, drawTag } from "./space_ink.js";

const REACH_PX = 14;

export class Space {
  #camera = new Camera();
  #scene = { arm: null, dots: [], legend: null, ground: 0 };
  #pointed = -1;
  #dragged = null;
  #waiting = false;

  constructor(place, { label, onPick = () => {} }) {
    this.canvas = document.createElement("canvas");
    this.canvas.tabIndex = 0;
    this.canvas.setAttribute("role", "img");
    this.canvas.setAttribute("aria-label", label);
    place.replaceChildren(this.canvas);
    this.onPick = onPick;
    this.#listen();
    new ResizeObserver(() => this.draw()).observe(this.canvas);
    onThemeChange(() => this.draw());
  }

  // What the camera keeps in view until told otherwise.
  frame(points) {
    this.#camera.frame(points);
    this.draw();
  }

  // Besides, what has come there since.
  cover(points) {
    this.#camera.cover(points);
    this.draw();
  }

  // arm: points; dots: {at, text, paint or share, size, open}; legend: {low, high, title}
  show(scene) {
    Object.assign(this.#scene, scene);
    this.draw();
  }

  draw() {
    if (this.#waiting) return;
    this.#waiting = true;
    requestAnimationFrame(() => {
      this.#waiting = false;
      this.#paint();
    });
  }

  #paint() {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    if (!width) return;
    const fine = window.devicePixelRatio || 1;
    this.canvas.width = width * fine;
    this.canvas.height = height * fine;
    const ink = this.canvas.getContext("2d");
    ink.scale(fine, fine);
    ink.font = `12px ${getComputedStyle(this.canvas).fontFamily}`;
    const at = (point) => this.#camera.project(point, width, height);
    const { arm, dots, legend, ground } = this.#scene;
    const scale = this.#camera.scale(width, height);
    drawGround(ink, at, this.#camera, ground);
    drawAxes(ink, at, this.#camera.radius * 0.22);
    const placed = this.#placed(at);
    const inFront = arm ? at(arm[Math.floor(arm.length / 2)])[2] : -Infinity;
    for (const dot of placed) if (dot.near < inFront) this.#dot(ink, dot);
    if (arm) drawArm(ink, at, arm, scale, ground);
    for (const dot of placed) if (dot.near >= inFront) this.#dot(ink, dot);
    if (legend) drawLegend(ink, legend, height);
    if (this.#pointed >= 0 && this.#pointed < dots.length) {
      const [x, y] = at(dots[this.#pointed].at);
      drawTag(ink, dots[this.#pointed].text, x, y, width);
    }
  }

  #placed(at) {
    return this.#scene.dots
      .map((dot) => {
        const [x, y, near] = at(dot.at);
        return { ...dot, x, y, near };
      })
      .sort((one, other) => one.near - other.near);
  }

  #dot(ink, { x, y, size = 4, open, paint, share }) {
    ink.beginPath();
    ink.arc(x, y, size, 0, 2 * Math.PI);
    const own = share === undefined ? colour(paint) : shade(share);
    ink.fillStyle = open ? colour("surface") : own;
    ink.strokeStyle = open ? own : colour("surface");
    ink.lineWidth = open ? 2 : 1;
    ink.fill();
    ink.stroke();
  }

  #listen() {
    const { canvas } = this;
    canvas.addEventListener("keydown", (event) => {
      if (event.ctrlKey || event.metaKey || !this.#camera.press(event.key)) return;
      event.preventDefault();
      this.draw();
    });
    canvas.addEventListener("pointerdown", (event) => {
      canvas.setPointerCapture(event.pointerId);
      this.#dragged = { x: event.clientX, y: event.clientY, far: 0 };
    });
    canvas.addEventListener("pointermove", (event) => this.#moved(event));
    canvas.addEventListener("pointerup", () => {
      const still = this.#dragged && this.#dragged.far < 4;
      this.#dragged = null;
      if (still && this.#pointed >= 0) this.onPick(this.#pointed);
    });
    canvas.addEventListener("pointercancel", () => (this.#dragged = null));
    canvas.addEventListener("pointerleave", () => this.#point(-1));
  }

  #moved(event) {
    const { clientX: x, clientY: y } = event;
    if (this.#dragged) {
      this.#camera.turn(-(x - this.#dragged.x) / 160, (y - this.#dragged.y) / 160);
      const far = this.#dragged.far + Math.hypot(x - this.#dragged.x, y - this.#dragged.y);
      this.#dragged = { x, y, far };
      this.draw();
      return;
    }
    const box = this.canvas.getBoundingClientRect();
    this.#point(this.#nearest(x - box.left, y - box.top));
  }

  #point(index) {
    if (index === this.#pointed) return;
    this.#pointed = index;
    this.draw();
  }

  #nearest(x, y) {
    const { clientWidth: width, clientHeight: height } = this.canvas;
    let [best, reach] = [-1, REACH_PX];
    this.#scene.dots.forEach((dot, index) => {
      const [dx, dy] = this.#camera.project(dot.at, width, height);
      const gap = Math.hypot(dx - x, dy - y);
      if (gap < reach) [best, reach] = [index, gap];
    });
    return best;
  }
}
