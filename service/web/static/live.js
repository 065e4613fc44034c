// What a person sees of a campaign while it runs: arm, reading, sensors, residuals so far.

import { get } from "./api.js";
import { ArmWalk } from "./arm_walk.js";
import { colour } from "./colours.js";
import { jointOf } from "./joint_words.js";
import { axis, drawAlways } from "./plot.js";
import { Space } from "./space.js";
import { say } from "./words.js";

const REST_MS = 700;
const STEPS = [0.2, 0.4, 0.6, 0.8, 1];

export class LiveView {
  #seen = null;
  #tips = null;
  #done = new Set();
  #busy = false;
  #again = false;
  #ended = false;
  #plotly = null;
  #drawResiduals = null;
  #followed = false;
  #steps = [];
  #walk = new ArmWalk((frame) => this.#space.show({ arm: this.#steps[frame] }));
  #space = null;
  #prepared = null;

  constructor(section, number) {
    this.section = section;
    this.number = number;
  }

  use(plotly) {
    this.#plotly = plotly;
    if (this.#seen?.residuals) this.#showResiduals();
  }

  // What came of the campaign takes the place of what it does.
  end() {
    this.section.hidden = true;
    this.#ended = true;
    this.#walk.stop();
  }

  add(reading) {
    this.#done.add(reading.pose);
    this.#look();
  }

  // Where the arm was seen a moment ago: it is drawn on its way there from where it is drawn now.
  async follow({ columns, joints, arm_mm: arm }) {
    if (this.#ended) return;
    this.#followed = true;
    this.section.hidden = false;
    showJoints(columns, joints);
    try {
      await this.#prepare(arm);
    } catch {
      // The service is away for a moment; the next one asks again.
      return;
    }
    this.#space.cover(arm);
    const from = this.#steps.at(-1) ?? arm;
    this.#steps = STEPS.map((share) => between(from, arm, share));
    this.#walk.go(0, this.#steps.length - 1);
    this.section.dataset.arms = Number(this.section.dataset.arms ?? 0) + 1;
  }

  // A campaign that is opened late brings many readings at once, and a busy one many a second.
  async #look() {
    this.#again = true;
    if (this.#busy) return;
    this.#busy = true;
    while (this.#again) {
      this.#again = false;
      try {
        this.#show(await get(`/parts/campaigns/${this.number}/live`));
      } catch {
        // The service is away for a moment; the next reading looks again.
      }
      await new Promise((resolve) => setTimeout(resolve, REST_MS));
    }
    this.#busy = false;
  }

  async #show(live) {
    if (!live || this.#ended) return;
    this.section.hidden = false;
    this.#seen = live;
    document.getElementById("live-nothing").hidden = true;
    document.getElementById("live-health").hidden = false;
    showPosition(live.position_mm);
    if (!this.#followed) showJoints(live.columns, live.joints);
    showSensors(live.sensors);
    if (live.residuals) this.#showResiduals();
    await this.#prepare(live.arm_mm);
    await this.#fetchLaterTips();
    this.#showTips();
    // Where it was read; by now it may be on its way again.
    if (!this.#followed) {
      this.#space.cover(live.arm_mm);
      this.#space.show({ arm: live.arm_mm });
    }
    this.section.dataset.pose = [...this.#done].at(-1);
  }

  #prepare(arm) {
    this.#prepared ??= this.#makeSpace(arm).catch((error) => {
      this.#prepared = null;
      throw error;
    });
    return this.#prepared;
  }

  async #makeSpace(arm) {
    await this.#fetchTips();
    this.#space = new Space(document.getElementById("live-space"), { label: say("live_picture") });
    this.#space.frame([...this.#tips.mm, ...arm]);
    this.#space.cover(arm);
    this.#showTips();
  }

  async #fetchTips() {
    this.#tips = await get(`/parts/campaigns/${this.number}/tips`);
  }

  // A further round of a follow-up has poses of its own.
  async #fetchLaterTips() {
    const known = new Set(this.#tips.pose);
    if (this.#tips.all || [...this.#done].every((pose) => known.has(pose))) return;
    await this.#fetchTips();
    this.#space.cover(this.#tips.mm);
    // Of a long plan the service tells the first part only; asking again brings nothing.
    this.#tips.all = this.#tips.pose.length === known.size;
  }

  #showTips() {
    const dots = this.#tips.mm.map((at, i) => ({
      at,
      text: say("live_tip", { pose: this.#tips.pose[i] }),
      paint: this.#done.has(this.#tips.pose[i]) ? "series-before" : "series-fit",
      open: !this.#done.has(this.#tips.pose[i]),
    }));
    this.#space.show({ dots });
    this.section.dataset.tips = dots.length;
  }

  #showResiduals() {
    const { identified } = this.#seen.residuals;
    const note = document.getElementById("live-residuals-note");
    note.textContent = say(identified ? "live_residuals_identified" : "live_residuals_nominal");
    if (!this.#plotly) return;
    const place = document.getElementById("live-residuals");
    place.hidden = false;
    const figure = () => residualFigure(this.#seen.residuals);
    this.#drawResiduals ??= drawAlways(this.#plotly, place, figure);
    this.#drawResiduals();
  }
}

function showPosition(position) {
  const place = document.getElementById("live-position");
  place.replaceChildren(
    ...["x", "y", "z"].flatMap((name, i) => {
      const value = element("dd", position[i].toFixed(3).replace("-", "\u2212"), "value");
      return [element("dt", name), value, element("dd", "mm", "unit")];
    }),
  );
}

function showJoints(columns, joints) {
  document.getElementById("live-joints").textContent = columns
    .map((name, i) => jointOf(name, joints[i]))
    .join("   ");
}

function between(from, to, share) {
  return to.map((point, i) => point.map((part, axis) => from[i][axis] + share * (part - from[i][axis])));
}

function showSensors({ spread_mm: spread, allowed_mm: allowed, shots, visits_again: again, ...more }) {
  const scatter = { shots, spread: spread.toFixed(4), allowed: allowed.toFixed(3) };
  const lines = [
    shots > 1
      ? [say("live_spread", scatter), spread > allowed / 2 ? "caution" : "good"]
      : [say("live_one_shot"), ""],
    again
      ? [say("live_tried_again", { count: again }), "caution"]
      : [say("live_first_try"), "good"],
  ];
  if (more.temperature_degc !== null) {
    const temperature = more.temperature_degc.toFixed(1);
    lines.push([say("live_temperature", { temperature }), "good"]);
  }
  const place = document.getElementById("live-sensors");
  place.replaceChildren(...lines.map(([text, tone]) => element("li", text, tone)));
}

function residualFigure({ pose, mm, identified }) {
  const paint = identified ? "series-held-out" : "series-before";
  return {
    traces: [
      {
        x: pose.map((_, i) => i + 1),
        y: mm,
        text: pose.map((number) => say("live_tip", { pose: number })),
        type: "bar",
        textposition: "none",
        marker: { color: colour(paint) },
        hovertemplate: "%{text}<br>%{y:.3f} mm<extra></extra>",
      },
    ],
    layout: {
      xaxis: axis(say("column_readings"), { showgrid: false, dtick: pose.length > 25 ? undefined : 1 }),
      yaxis: axis(say("axis_residual"), { rangemode: "tozero" }),
      margin: { l: 64, r: 16, t: 10, b: 46 },
    },
  };
}

function element(tag, text, name = "") {
  const made = document.createElement(tag);
  made.textContent = text;
  made.className = name;
  return made;
}
