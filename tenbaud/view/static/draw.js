// Drawing on canvas: two charts for every output, and the tape. Plain lines, redrawn whole; colours come from the page.

const SPAN_S = 30;
const DEGREES = 180 / Math.PI;
const ROUND_DEGREES = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180, 360];

// How values of a unit are shown: angles in degrees, everything else as it is.
export function shown(unit) {
  return unit === "rad" ? { factor: DEGREES, unit: "°", words: "degrees" }
    : { factor: 1, unit: unit ? ` ${unit}` : "", words: unit };
}

// A round step that gives about three lines on either side of zero.
function roundStep(most, look) {
  const least = most / 3;
  const degrees = look.unit === "°" && ROUND_DEGREES.find((step) => step >= least);
  if (degrees) return degrees;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((one) => one * power).find((step) => step >= least);
}

export const OUTPUT_COLOURS = 6;

export function colours() {
  const style = getComputedStyle(document.body);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["ink", "dim", "line", "card", "estimate", "tube", "error", "reference", "bad", "minus"];
  const outputs = Array.from({ length: OUTPUT_COLOURS }, (_, place) => of(`output-${place}`));
  return { outputs, ...Object.fromEntries(names.map((n) => [n, of(n)])) };
}

// Return a context whose unit is one CSS pixel; the bitmap follows the element's size.
function fitted(canvas, height) {
  const width = canvas.clientWidth;
  const scale = Math.min(window.devicePixelRatio || 1, 2);
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.style.height = `${height}px`;
    canvas.width = Math.round(width * scale);
    canvas.height = Math.round(height * scale);
  }
  const context = canvas.getContext("2d");
  context.setTransform(scale, 0, 0, scale, 0, 0);
  context.clearRect(0, 0, width, height);
  context.font = "12px system-ui, sans-serif";
  context.lineJoin = "round";
  return [context, width];
}

// A chart's frame: horizontal lines at round values, and functions from values to pixels.
function frame(canvas, height, now, largest, look, ink) {
  const [context, width] = fitted(canvas, height);
  const left = 46, step = roundStep(largest, look), high = Math.ceil(largest / step) * step, low = -high;
  const digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  const x = (time) => left + (width - left - 4) * (1 - (now - time) / SPAN_S);
  const y = (value) => 8 + (height - 16) * (high - value) / (high - low);
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.lineWidth = 1;
  for (let line = Math.round(low / step); line * step <= high * 1.0001; line++) {
    const value = line * step;
    context.strokeStyle = ink.line;
    context.beginPath();
    context.moveTo(left, y(value));
    context.lineTo(width, y(value));
    context.stroke();
    context.fillStyle = ink.dim;
    context.fillText(`${value.toFixed(digits).replace("-", "\u2212")}${look.unit === "°" ? "°" : ""}`, left - 6, y(value));
  }
  context.beginPath();
  context.rect(left, 0, width - left, height);
  context.save();
  context.clip();
  return { context, x, y };
}

function line(chart, rows, value, colour, width, stepped = false) {
  const { context, x, y } = chart;
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.beginPath();
  let last = null;
  for (const row of rows) {
    const now = value(row);
    if (now === null) { last = null; continue; }
    if (last === null) context.moveTo(x(row[0]), y(now));
    else {
      if (stepped) context.lineTo(x(row[0]), y(last));
      context.lineTo(x(row[0]), y(now));
    }
    last = now;
  }
  context.stroke();
}

function band(chart, rows, upper, lower, colour) {
  if (rows.length < 2) return;
  const { context, x, y } = chart;
  context.fillStyle = colour;
  context.beginPath();
  for (const row of rows) context.lineTo(x(row[0]), y(upper(row)));
  for (let index = rows.length - 1; index >= 0; index--) context.lineTo(x(rows[index][0]), y(lower(rows[index])));
  context.fill();
}

// rows: [time, values, estimates, ranges], decisions: [time, set-points], each with one entry per output
export function drawOutput(canvas, height, now, rows, decisions, place, look, ink) {
  const at = (index) => (row) => (row[index][place] === null || row[index][place] === undefined ? null : row[index][place] * look.factor);
  const value = at(1), estimate = at(2), range = at(3), reference = at(1);
  let most = look.unit === "°" ? 2 : 1e-6;
  for (const row of rows) most = Math.max(most, Math.abs(value(row)) * 1.05);
  for (const row of decisions) most = Math.max(most, Math.abs(reference(row) || 0) * 1.05);
  const chart = frame(canvas, height, now, most, look, ink);
  band(chart, rows, (row) => estimate(row) + range(row), (row) => estimate(row) - range(row), ink.tube);
  line(chart, decisions, reference, ink.reference, 1.5, true);
  line(chart, rows, estimate, ink.estimate, 3);
  line(chart, rows, value, ink.ink, 1.2);
  chart.context.restore();
}

export function drawError(canvas, height, now, rows, place, look, ink) {
  const error = (row) => (row[1][place] - row[2][place]) * look.factor, range = (row) => (row[3][place] ?? 0) * look.factor;
  let most = look.unit === "°" ? 0.5 : 1e-9;
  for (const row of rows) most = Math.max(most, range(row), Math.abs(error(row)));
  const chart = frame(canvas, height, now, most, look, ink);
  band(chart, rows, range, (row) => -range(row), ink.tube);
  line(chart, rows, range, ink.estimate, 1);
  line(chart, rows, (row) => -range(row), ink.estimate, 1);
  line(chart, rows, error, ink.error, 1.8);
  chart.context.restore();
}

const same = (one, other) => one && other && one.length === other.length && one.every((v, i) => v === other[i]);

// samples: [number, sent, taken, own digest, other digest, about], oldest first. The newest is at the right.
// Of several outputs each symbol is a bar in the colour of the one that it was about.
export function drawTape(canvas, samples, ink, several) {
  const height = 46;
  const [context, width] = fitted(canvas, height);
  const cell = 18;
  const count = Math.min(samples.length, Math.floor(width / cell));
  for (let index = 0; index < count; index++) {
    const [, sent, taken, , , about] = samples[samples.length - 1 - index];
    const left = width - (index + 1) * cell;
    if (taken === null) {
      context.strokeStyle = ink.bad;
      context.lineWidth = 1.8;
      context.strokeRect(left + 3.5, height / 2 - 5.5, cell - 7, 11);
      continue;
    }
    const flipped = sent !== null && !same(sent, taken);
    const share = taken.reduce((sum, value) => sum + value, 0) / taken.length;
    // What the newest bits were about comes with the sensor's next message.
    const colour = (place) => (about ? ink.outputs[about[place] % OUTPUT_COLOURS] : ink.dim);
    const bars = several ? taken.map((value, place) => [value, colour(place)]) : [[share, share >= 0 ? ink.estimate : ink.minus]];
    const wide = (cell - 5) / bars.length;
    bars.forEach(([value, own], place) => {
      context.fillStyle = flipped ? ink.error : own;
      const size = Math.max(4, Math.min(1, Math.abs(value)) * (height / 2 - 5));
      context.fillRect(left + 2.5 + place * wide, value >= 0 ? height / 2 - 1 - size : height / 2 + 1, wide, size);
    });
  }
  context.fillStyle = ink.line;
  context.fillRect(0, height / 2 - 0.5, width, 1);
}
