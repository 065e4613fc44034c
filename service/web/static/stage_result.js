// What the touches say: the transform with its uncertainty, what is open, what is faulty.

import { say } from "./words.js";

const NAMES = ["x", "y", "z", "yaw", "pitch", "roll"];

export function showAssessment(place, calibration) {
  place.replaceChildren();
  const found = calibration.assessment;
  if (!found) {
    paragraph(place, calibration.no_answer || say("stage_too_few"), calibration.no_answer ? "notice bad" : "quiet");
    return;
  }
  place.append(transformTable(found));
  paragraph(
    place,
    say("stage_residual", { residual: found.residual_rms_mm.toFixed(4), p: found.p_value.toFixed(3) }),
    "quiet",
  );
  for (const entry of found.undetermined) {
    paragraph(place, say("stage_direction", { direction: entry.direction, fix: entry.fixed_by }), "notice caution");
  }
  for (const fault of found.faults) {
    const words = {
      fault: fault.meaning,
      touches: fault.touches.join(", "),
      probability: (100 * fault.probability).toFixed(0),
    };
    const text = fault.touches.length ? say("stage_fault_touches", words) : say("stage_fault", words);
    paragraph(place, text, "notice bad");
  }
  const hidden = found.sensor_corrections.filter((entry) => entry.hidden);
  if (hidden.length) {
    const names = hidden.map((entry) => entry.meaning).join("; ");
    paragraph(place, say("stage_hidden", { names }), "quiet");
  }
}

function transformTable(found) {
  const values = [...found.transform.xyz_mm, ...found.transform.ypr_deg];
  const rows = NAMES.map((name, index) => {
    const std = found.std[index];
    const unit = index < 3 ? "mm" : "°";
    return [name, values[index].toFixed(4), std === null ? say("stage_open") : std.toFixed(4), unit];
  });
  const heads = [say("stage_quantity"), say("column_value"), say("column_std"), say("column_unit")];
  return table("figures", heads, rows, [1, 2]);
}

export function table(name, heads, rows, numbers) {
  const made = document.createElement("table");
  made.className = name;
  const head = made.createTHead().insertRow();
  heads.forEach((text, column) => {
    const cell = document.createElement("th");
    cell.scope = "col";
    cell.textContent = text;
    if (numbers.includes(column)) cell.className = "number";
    head.append(cell);
  });
  const body = made.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    row.forEach((text, column) => {
      const cell = line.insertCell();
      if (numbers.includes(column)) cell.className = "number";
      if (text instanceof Node) cell.append(text);
      else cell.textContent = text;
    });
  }
  return made;
}

function paragraph(place, text, name) {
  const made = document.createElement("p");
  made.className = `so-far-line ${name}`;
  made.textContent = text;
  place.append(made);
}
