// Drawing on canvas: two charts for every output, and the tape. Plain lines, redrawn whole; colours come from the page.

const ROUND_DEGREES = [0.1, 0.2, 0.5, 1, 2, 5, 10, 15, 30, 45, 90, 180, 360];

// A round step that gives about three lines on either side of zero.
function roundStep(most, look) {
  const least = most / 3;
  const degrees = look.unit === "°" && ROUND_DEGREES.find((step) => step >= least);
  if (degrees) return degrees;
  const power = 10 ** Math.floor(Math.log10(least));
  return [1, 2, 5, 10].map((one) => one * power).find((step) => step >= least);
}

export const OUTPUT_COLOURS = 6, RUN_COLOURS = 4;

export function colours() {
  const style = getComputedStyle(document.body);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  const names = ["ink", "dim", "line", "card", "estimate", "tube", "error", "reference", "bad", "minus"];
  const several = (name, length) => Array.from({ length }, (_, place) => of(`${name}-${place}`));
  return { outputs: several("output", OUTPUT_COLOURS), runs: several("run", RUN_COLOURS), ...Object.fromEntries(names.map((n) => [n, of(n)])) };
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

// A chart's frame: horizontal lines at round values, and functions from values to pixels. `span` is from, to and, of a
// recording, the cursor, in s; its times then stand below.
function frame(canvas, height, span, largest, look, ink) {
  const [context, width] = fitted(canvas, height);
  const left = 46, step = roundStep(largest, look), high = Math.ceil(largest / step) * step, low = -high;
  const digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9)), foot = span.cursor === null ? 8 : 20;
  const x = (time) => left + (width - left - 4) * (time - span.from) / (span.to - span.from || 1);
  const y = (value) => 8 + (height - 8 - foot) * (high - value) / (high - low);
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.lineWidth = 1;
  context.fillStyle = ink.dim;
  context.strokeStyle = ink.line;
  for (let line = Math.round(low / step); line * step <= high * 1.0001; line++) {
    const value = line * step;
    stroke(context, left, y(value), width, y(value));
    context.fillText(`${value.toFixed(digits).replace("-", "\u2212")}${look.unit === "°" ? "°" : ""}`, left - 6, y(value));
  }
  if (span.cursor !== null) times(context, span, x, height, width);
  context.save();
  context.beginPath();
  context.rect(left, 0, width - left, height);
  context.clip();
  if (span.cursor !== null) {
    context.strokeStyle = ink.ink;
    stroke(context, x(span.cursor), 0, x(span.cursor), height - foot + 4);
  }
  return { context, x, y };
}

function stroke(context, fromX, fromY, toX, toY) {
  context.beginPath();
  context.moveTo(fromX, fromY);
  context.lineTo(toX, toY);
  context.stroke();
}

function times(context, span, x, height, width) {
  const least = (span.to - span.from) / 6, power = 10 ** Math.floor(Math.log10(least));
  const step = [1, 2, 5, 10].map((one) => one * power).find((one) => one >= least);
  const digits = Math.max(0, Math.ceil(-Math.log10(step) - 1e-9));
  for (let mark = Math.ceil(span.from / step - 1e-9); mark * step <= span.to; mark++) {
    const place = x(mark * step);
    if (place < width - 22) context.fillText(`${(mark * step).toFixed(digits)} s`, place + 14, height - 7);
  }
}

// The time at a place of a chart, counted in pixels from its left side; null beside the curves.
export function timeAt(canvas, place, span) {
  const share = (place - 46) / (canvas.clientWidth - 50);
  return share < 0 || share > 1 ? null : span.from + share * (span.to - span.from);
}

function line(chart, rows, value, colour, width, { stepped = false, dash = [] } = {}) {
  const { context, x, y } = chart;
  context.strokeStyle = colour;
  context.lineWidth = width;
  context.setLineDash(dash);
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
  context.setLineDash([]);
}

function band(chart, rows, upper, lower, colour) {
  const { context, x, y } = chart, known = rows.filter((row) => upper(row) !== null);
  if (known.length < 2) return;
  context.fillStyle = colour;
  context.beginPath();
  for (const row of known) context.lineTo(x(row[0]), y(upper(row)));
  for (let index = known.length - 1; index >= 0; index--) context.lineTo(x(known[index][0]), y(lower(known[index])));
  context.fill();
}

// What a row [time, values, estimates, ranges] says of one output, as it is shown; null where that is not known.
function readers(place, look) {
  const at = (index) => (row) => (row[index][place] === null || row[index][place] === undefined ? null : row[index][place] * look.factor);
  const [value, estimate, range] = [at(1), at(2), at(3)];
  const sum = (one, other, sign) => (row) => (one(row) === null || other(row) === null ? null : one(row) + sign * other(row));
  return { value, estimate, range, reference: at(1), error: sum(value, estimate, -1), upper: sum(estimate, range, 1), lower: sum(estimate, range, -1) };
}

// flights: `points` as above, `decisions` as [time, set-points], each with one entry per output
export function drawOutput(canvas, height, span, flights, place, look, ink) {
  const { value, estimate, reference, upper, lower } = readers(place, look), overlaid = flights.length > 1;
  let most = look.unit === "°" ? 2 : 1e-6;
  for (const { points, decisions } of flights) {
    for (const row of points) most = Math.max(most, Math.abs(value(row)) * 1.05, Math.abs(estimate(row)));
    for (const row of decisions) most = Math.max(most, Math.abs(reference(row)) * 1.05);
  }
  const chart = frame(canvas, height, span, most, look, ink);
  flights.forEach(({ points, decisions }, run) => {
    const [own, other] = overlaid ? [ink.runs[run], ink.runs[run]] : [ink.ink, ink.estimate];
    if (!overlaid) band(chart, points, upper, lower, ink.tube);
    line(chart, decisions, reference, ink.reference, 1.5, { stepped: true });
    line(chart, points, estimate, other, overlaid ? 1.2 : 3, { dash: overlaid ? [5, 4] : [] });
    line(chart, points, value, own, overlaid ? 1.6 : 1.2);
  });
  chart.context.restore();
}

export function drawError(canvas, height, span, flights, place, look, ink) {
  const { error, range } = readers(place, look), overlaid = flights.length > 1, below = (row) => (range(row) === null ? null : -range(row));
  let most = look.unit === "°" ? 0.5 : 1e-9;
  for (const { points } of flights) for (const row of points) most = Math.max(most, overlaid ? 0 : range(row), Math.abs(error(row)));
  const chart = frame(canvas, height, span, most, look, ink);
  flights.forEach(({ points }, run) => {
    if (!overlaid) {
      band(chart, points, range, below, ink.tube);
      line(chart, points, range, ink.estimate, 1);
      line(chart, points, below, ink.estimate, 1);
    }
    line(chart, points, error, overlaid ? ink.runs[run] : ink.error, overlaid ? 1.4 : 1.8);
  });
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
