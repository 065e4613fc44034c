// Plays the arms of a path one after the other.

const FRAME_MS = 40;

export class ArmWalk {
  #timer = 0;

  constructor(show) {
    this.show = show;
  }

  get playing() {
    return this.#timer !== 0;
  }

  // From one frame to another; a second walk ends the first. `done` where it was not ended.
  go(from, to, done = () => {}) {
    this.stop();
    if (matchMedia("(prefers-reduced-motion: reduce)").matches) from = to;
    let frame = from;
    const step = () => {
      this.show(frame);
      if (frame !== to) {
        frame += Math.sign(to - from);
        return;
      }
      this.stop();
      done();
    };
    this.#timer = setInterval(step, FRAME_MS);
    step();
  }

  stop() {
    clearInterval(this.#timer);
    this.#timer = 0;
  }
}
