// The plan of a campaign before it starts: every pose of the arm, one chosen, the way played.

import { get } from "./api.js";
import { ArmWalk } from "./arm_walk.js";
import { jointOf } from "./joint_words.js";
import { Space } from "./space.js";
import { say } from "./words.js";

const section = document.getElementById("plan");
const slider = document.getElementById("plan-pose");
const play = document.getElementById("plan-play");
const text = document.getElementById("plan-text");
const joints = document.getElementById("plan-joints");

export class PlanPreview {
  #plan = null;
  #asked = null;
  #walk = new ArmWalk((frame) => this.#draw(frame));
  #space = null;

  constructor() {
    slider.addEventListener("input", () => this.#choose(slider.valueAsNumber - 1));
    play.addEventListener("click", () => this.#toggle());
  }

  // Plans for these wishes; `taken` is told the seed that makes the campaign drive this very plan.
  async ask({ cell, poses, seed }, taken) {
    const wish = `/parts/cells/${cell}/plan?poses=${poses}&seed=${seed}`;
    if (wish === this.#asked) return;
    this.#asked = wish;
    section.hidden = false;
    section.setAttribute("aria-busy", "true");
    this.#stop();
    text.textContent = say("plan_working");
    try {
      const plan = await get(wish);
      if (wish !== this.#asked) return;
      taken(plan.seed);
      this.#show(plan);
    } catch (refusal) {
      if (wish === this.#asked) this.#refuse(refusal.message);
    }
  }

  hide() {
    this.#asked = null;
    this.#stop();
    section.hidden = true;
  }

  #refuse(sentence) {
    this.#plan = null;
    section.removeAttribute("aria-busy");
    section.classList.add("empty");
    text.textContent = sentence;
  }

  #show(plan) {
    this.#plan = plan;
    section.classList.remove("empty");
    section.removeAttribute("aria-busy");
    section.dataset.poses = plan.joints.length;
    this.#space ??= new Space(document.getElementById("plan-space"), {
      label: say("plan_picture"),
      onPick: (pose) => this.#choose(pose),
    });
    this.#space.frame(plan.arms_mm.flat());
    slider.max = plan.joints.length;
    slider.value = 1;
    this.#draw(0);
  }

  #choose(pose) {
    if (!this.#plan) return;
    this.#stop();
    const from = this.#frame ?? 0;
    const to = pose * this.#plan.frames_a_move;
    // Only the neighbouring move is played; a far one would take long and tell nothing.
    const near = Math.abs(to - from) <= this.#plan.frames_a_move;
    this.#walk.go(near ? from : to, to);
  }

  #toggle() {
    if (this.#walk.playing) return this.#stop();
    const last = this.#plan.arms_mm.length - 1;
    play.textContent = say("plan_stop");
    this.#walk.go(this.#frame === last ? 0 : this.#frame, last, () => this.#stop());
  }

  #stop() {
    this.#walk.stop();
    play.textContent = say("plan_play");
  }

  #frame = 0;

  #draw(frame) {
    const { arms_mm: arms, frames_a_move: steps, joints: poses, columns } = this.#plan;
    this.#frame = frame;
    const pose = Math.round(frame / steps);
    const dots = poses.map((_, index) => ({
      at: arms[index * steps].at(-1),
      text: poseWords(index, poses.length),
      paint: index === pose ? "series-held-out" : index < pose ? "series-before" : "series-fit",
      size: index === pose ? 6 : 4,
    }));
    this.#space.show({ arm: arms[frame], dots });
    slider.value = pose + 1;
    text.textContent = poseWords(pose, poses.length);
    joints.textContent = columns.map((name, i) => jointOf(name, poses[pose][i])).join("   ");
  }
}

// Poses are numbered from 0, as in measurements.csv.
function poseWords(pose, total) {
  return say("plan_pose", { pose, number: pose + 1, total });
}
