// A joint reading as a person reads it.

// `j2_deg` and 12.5 as `j2 12.5°`, which no line breaks.
export function jointOf(column, value) {
  const [name, unit] = column.split("_");
  const shown = value.toFixed(1).replace("-", "\u2212");
  return `${name}\u00a0${shown}${unit === "deg" ? "°" : "\u202fmm"}`;
}
