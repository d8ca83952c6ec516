// Drawing on canvas: two charts and the tape. Plain lines, redrawn whole; colours come from the page.

const SPAN_S = 30;
const DEGREES = 180 / Math.PI;

export function colours() {
  const style = getComputedStyle(document.body);
  const of = (name) => style.getPropertyValue(`--${name}`).trim();
  return Object.fromEntries(
    ["ink", "dim", "line", "card", "estimate", "tube", "error", "reference", "bad", "minus"].map((n) => [n, of(n)]));
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
function frame(canvas, height, now, low, high, step, ink) {
  const [context, width] = fitted(canvas, height);
  const left = 38;
  const x = (time) => left + (width - left - 4) * (1 - (now - time) / SPAN_S);
  const y = (value) => 6 + (height - 12) * (high - value) / (high - low);
  context.textAlign = "right";
  context.textBaseline = "middle";
  context.lineWidth = 1;
  for (let value = Math.ceil(low / step) * step; value <= high; value += step) {
    context.strokeStyle = ink.line;
    context.beginPath();
    context.moveTo(left, y(value));
    context.lineTo(width, y(value));
    context.stroke();
    context.fillStyle = ink.dim;
    context.fillText(`${Math.round(value * 10) / 10}°`, left - 6, y(value));
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

// rows: [time, true, estimate, range]; decisions: [time, set-point]
export function drawPitch(canvas, now, rows, decisions, ink) {
  let most = 30;
  for (const row of rows) most = Math.max(most, Math.abs(row[1]) * DEGREES);
  for (const row of decisions) most = Math.max(most, Math.abs(row[1] || 0) * DEGREES);
  most = Math.ceil((most + 5) / 30) * 30;
  const chart = frame(canvas, 210, now, -most, most, most > 60 ? 45 : 15, ink);
  band(chart, rows, (row) => (row[2] + row[3]) * DEGREES, (row) => (row[2] - row[3]) * DEGREES, ink.tube);
  line(chart, decisions, (row) => (row[1] === null ? null : row[1] * DEGREES), ink.reference, 1.5, true);
  line(chart, rows, (row) => row[2] * DEGREES, ink.estimate, 3);
  line(chart, rows, (row) => row[1] * DEGREES, ink.ink, 1.2);
  chart.context.restore();
}

export function drawError(canvas, now, rows, ink) {
  let most = 4;
  for (const row of rows) most = Math.max(most, row[3] * DEGREES, Math.abs(row[1] - row[2]) * DEGREES);
  const step = most > 40 ? 30 : most > 12 ? 10 : most > 5 ? 5 : 2;
  most = Math.ceil(most / step) * step;
  const chart = frame(canvas, 120, now, -most, most, step, ink);
  band(chart, rows, (row) => row[3] * DEGREES, (row) => -row[3] * DEGREES, ink.tube);
  line(chart, rows, (row) => row[3] * DEGREES, ink.estimate, 1);
  line(chart, rows, (row) => -row[3] * DEGREES, ink.estimate, 1);
  line(chart, rows, (row) => (row[1] - row[2]) * DEGREES, ink.error, 1.8);
  chart.context.restore();
}

const same = (one, other) => one && other && one.length === other.length && one.every((v, i) => v === other[i]);

// samples: [number, sent, taken, own digest, other digest], oldest first. The newest is at the right.
export function drawTape(canvas, samples, ink) {
  const height = 46;
  const [context, width] = fitted(canvas, height);
  const cell = 18;
  const count = Math.min(samples.length, Math.floor(width / cell));
  for (let index = 0; index < count; index++) {
    const [, sent, taken] = samples[samples.length - 1 - index];
    const left = width - (index + 1) * cell;
    if (taken === null) {
      context.strokeStyle = ink.bad;
      context.lineWidth = 1.8;
      context.strokeRect(left + 3.5, height / 2 - 5.5, cell - 7, 11);
      continue;
    }
    const flipped = sent !== null && !same(sent, taken);
    const share = taken.reduce((sum, value) => sum + value, 0) / taken.length;
    context.fillStyle = flipped ? ink.error : share >= 0 ? ink.estimate : ink.minus;
    const size = Math.max(4, Math.min(1, Math.abs(share)) * (height / 2 - 5));
    context.fillRect(left + 2.5, share >= 0 ? height / 2 - 1 - size : height / 2 + 1, cell - 5, size);
  }
  context.fillStyle = ink.line;
  context.fillRect(0, height / 2 - 0.5, width, 1);
}
