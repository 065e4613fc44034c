// A camera that looks at the middle of things from a distance, without perspective.

const TURN = Math.PI / 24;
// The picture is lower than wide: of what lies within this share of the radius, nothing is ever out
// of it, however it is turned.
const IN_VIEW = 0.8;
const KEYS = {
  ArrowLeft: (camera) => camera.turn(TURN, 0),
  ArrowRight: (camera) => camera.turn(-TURN, 0),
  ArrowUp: (camera) => camera.turn(0, TURN),
  ArrowDown: (camera) => camera.turn(0, -TURN),
  "+": (camera) => camera.magnify(1.2),
  "-": (camera) => camera.magnify(1 / 1.2),
  0: (camera) => camera.reset(),
};

export class Camera {
  constructor() {
    this.reset();
    this.centre = [0, 0, 0];
    this.radius = 1;
  }

  reset() {
    this.azimuth = -0.9;
    this.elevation = 0.42;
    this.zoom = 1;
  }

  // From points, the middle of their box and how far they reach from it.
  frame(points) {
    const low = [0, 1, 2].map((axis) => Math.min(...points.map((point) => point[axis])));
    const high = [0, 1, 2].map((axis) => Math.max(...points.map((point) => point[axis])));
    this.centre = low.map((value, axis) => (value + high[axis]) / 2);
    this.radius = Math.max(...points.map((point) => this.#reach(point))) || 1;
  }

  // Steps back where a point would be out of view, and never comes nearer again by itself.
  cover(points) {
    const reach = Math.max(...points.map((point) => this.#reach(point)));
    this.radius = Math.max(this.radius, reach / IN_VIEW);
  }

  #reach(point) {
    return Math.hypot(...point.map((value, axis) => value - this.centre[axis]));
  }

  turn(azimuth, elevation) {
    this.azimuth += azimuth;
    this.elevation = Math.min(Math.max(this.elevation + elevation, -0.2), Math.PI / 2);
  }

  magnify(factor) {
    this.zoom = Math.min(Math.max(this.zoom * factor, 0.5), 6);
  }

  // Whether the key moved the camera.
  press(key) {
    KEYS[key]?.(this);
    return key in KEYS;
  }

  scale(width, height) {
    return (this.zoom * Math.min(width, 1.25 * height)) / (2.05 * this.radius);
  }

  // Across, down [pixel], and how near [the points' unit].
  project(point, width, height) {
    const [x, y, z] = point.map((value, axis) => value - this.centre[axis]);
    const [ca, sa] = [Math.cos(this.azimuth), Math.sin(this.azimuth)];
    const [ce, se] = [Math.cos(this.elevation), Math.sin(this.elevation)];
    const scale = this.scale(width, height);
    return [
      width / 2 + scale * (y * ca - x * sa),
      height / 2 + scale * (se * (x * ca + y * sa) - ce * z),
      ce * (x * ca + y * sa) + se * z,
    ];
  }
}
