// How values are shown: angles in degrees whatever their unit, everything else in its own unit.

const IN_DEGREES = { rad: 180 / Math.PI, mrad: 0.18 / Math.PI, deg: 1, "°": 1 };

export function shown(unit) {
  const factor = IN_DEGREES[unit];
  return factor ? { factor, unit: "°", words: "degrees" } : { factor: 1, unit: unit ? ` ${unit}` : "", words: unit };
}

// An output that turns a part of a picture, in degrees; one without a unit of angle counts as radians.
export const degrees = (value, unit) => value * (IN_DEGREES[unit] ?? IN_DEGREES.rad);

// A value with its unit: angles to a tenth of a degree, others to three figures.
export function quantity(value, look, digits = 1) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const size = Math.abs(value * look.factor);
  return `${value < 0 ? "−" : "+"}${look.unit === "°" ? size.toFixed(digits) : size.toPrecision(3)}${look.unit}`;
}

export const words = (one) => one.name.replaceAll("_", " ");
