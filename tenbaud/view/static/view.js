// The page's own script: takes the stream in, keeps the last thirty seconds, and draws them.

import { colours, drawError, drawOutput, drawTape, OUTPUT_COLOURS, shown } from "./draw.js";
import { pose } from "./pose.js";

const KEPT_S = 32, SAMPLES_KEPT = 160, EVENTS_SHOWN = 7, STALE_MS = 1500, BROKEN_SHOWN_MS = 2500, TEXT_MS = 200;
const DEGREES = 180 / Math.PI;
const SIGNS = { waiting: "M12 7v6M12 16.5v.5", silent: "M7 12h10", lockstep: "M7 12.5l3.5 3.5L17 8.5",
  broken: "M8 8l8 8M16 8l-8 8", rejoining: "M16.5 9a5.5 5.5 0 1 0 .8 5M17 5.5V9.4h-3.8" };

const at = (id) => document.getElementById(id);
const memory = { heads: {}, points: [], decisions: [], samples: new Map(), events: [] };
let ink = colours();
let connected = false, heardAt = 0, everHeard = false, brokenAt = -1e9, broken = null, repaired = "", asked = false, dirty = true, tapeDirty = true;

// ---- the stream

function listen() {
  const address = new URL("stream", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  const socket = new WebSocket(address);
  socket.onopen = () => { connected = true; dirty = true; };
  socket.onmessage = (event) => take(JSON.parse(event.data));
  socket.onclose = () => { connected = false; dirty = true; setTimeout(listen, 1000); };
}

function take(news) {
  if (!news.heads) return;
  const live = Object.keys(news.heads).length > 0;
  if (news.reset) {
    Object.assign(memory, { heads: {}, points: [], decisions: [], events: [] });
    memory.samples.clear();
    repaired = ""; brokenAt = -1e9; broken = null;
  }
  Object.assign(memory.heads, news.heads);
  memory.points.push(...news.points);
  memory.decisions.push(...news.decisions);
  for (const sample of news.samples) memory.samples.set(sample[0], sample);
  while (memory.samples.size > SAMPLES_KEPT) memory.samples.delete(memory.samples.keys().next().value);
  tapeDirty ||= news.samples.length > 0 || Boolean(news.reset);
  for (const event of news.events) happened(event, news.reset);
  if (live) { heardAt = performance.now(); everHeard = true; }
  dirty = true;
  if (!asked) { asked = true; requestAnimationFrame(draw); }
}

function happened(event, old) {
  const { role, kind } = event;
  if (role === "transmitter" && kind === "desync") {
    if (!old) brokenAt = performance.now();
    broken = event;
    repaired = "";
  }
  if (role === "transmitter" && kind === "rejoin" && broken) {
    repaired = `broken after sample ${broken.sample}, at ${broken.time_s.toFixed(1)} s; equal again from sample ${event.sample}`;
  }
  // Left out: what the tape shows, what passes by itself, and what the other end has reported already.
  if (kind === "erased" || kind === "late_symbol" || event.state === "holding") return;
  if (role === "receiver" && ["desync", "rejoin", "ended"].includes(kind)) return;
  const last = memory.events[0];
  if (last && same(last, event)) return;
  memory.events.unshift(event);
  memory.events.length = Math.min(memory.events.length, EVENTS_SHOWN);
}

// Repetitions of one event differ in their time and sample alone.
function same(one, other) {
  const names = new Set([...Object.keys(one), ...Object.keys(other)]);
  return [...names].every((name) => ["time_s", "sample", "text"].includes(name) || one[name] === other[name]);
}

// ---- the plant: what it is called, and its picture

let plant = null, picture = "";
const largest = { outputs: [], inputs: [] };

function make(tag, name = "", text = "") {
  const element = document.createElement(tag);
  element.className = name;
  element.textContent = text;
  return element;
}

// A square in the colour of the bits that are about an output.
function key(place) {
  const element = make("i", "key square");
  element.style.background = `var(--output-${place % OUTPUT_COLOURS})`;
  return element;
}

const words = (one) => one.name.replaceAll("_", " ");
const title = (one) => words(one).replace(/^./, (letter) => letter.toUpperCase());

// Builds what depends on the plant, once for each: charts, the picture, bars.
function become(told) {
  if (!told || JSON.stringify(told) === JSON.stringify(plant)) return;
  plant = told;
  const several = plant.outputs.length > 1;
  at("curves").replaceChildren(...plant.outputs.flatMap((one, place) => {
    const look = shown(one.unit), unit = look.words ? `${look.words}, ` : "";
    return [["value", title(one), `${unit}last 30 s of flight`], ["error", several ? `${title(one)}, estimation error` : "Estimation error", `${unit}within the range ± M`]]
      .flatMap(([kind, name, small]) => {
        const heading = make("h2", "", `${name} `), canvas = make("canvas");
        if (several) heading.prepend(key(place));
        heading.append(make("small", "", small));
        canvas.id = `${kind}-${place}`;
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `${name} over time`);
        return [heading, canvas];
      });
  }));
  // A plant without a picture has bars; so have several outputs, for their values.
  const id = plant.picture.replaceAll(" ", "-");
  picture = (id && (at(`${id}-${plant.outputs.length}`) || at(id))) || "";
  for (const one of document.querySelectorAll(".plant")) one.toggleAttribute("hidden", one !== picture);
  if (picture.id === "helicopter") drawScale();
  for (const text of picture ? picture.querySelectorAll("[data-name]") : []) text.textContent = words(plant.outputs[text.dataset.name]);
  largest.outputs = plant.outputs.map(spread);
  largest.inputs = plant.inputs.map(spread);
  at("outputs").replaceChildren(...(picture && !several ? [] : plant.outputs.flatMap((one) => gauge(one, ["reference", "estimate", "body"]))));
  at("inputs").replaceChildren(...plant.inputs.flatMap((one) => gauge(one, ["bar"])));
  at("bit-keys").replaceChildren(...(several ? plant.outputs.flatMap((one, place) => [key(place), make("span")])
    : [make("i", "key plus-key"), "up ", make("i", "key minus-key"), "down"]));
  set("value-name", several ? "value" : plant.outputs[0] ? words(plant.outputs[0]) : "");
}

const spread = (one) => (one.low !== null && one.high !== null ? Math.max(Math.abs(one.low), Math.abs(one.high)) : 1e-9);

function gauge(one, marks) {
  const track = make("span", "gauge");
  track.append(make("i", "middle"), ...marks.map((mark) => make("i", mark)));
  return [make("b", "", words(one)), track, make("output")];
}

// Where a value stands on a track, in percent, and the largest seen as its end.
function placed(most, place, value) {
  most[place] = Math.max(most[place], Math.abs(value));
  return 50 + 50 * Math.max(-1, Math.min(1, value / most[place]));
}

function drawGauges(id, most, signals, each) {
  const rows = at(id).children;
  for (let place = 0; place * 3 < rows.length; place++) {
    const [, track, text] = [0, 1, 2].map((part) => rows[place * 3 + part]);
    for (const [mark, value] of Object.entries(each(place))) {
      const element = track.querySelector(`.${mark}`);
      element.hidden = value === null || value === undefined;
      if (element.hidden) continue;
      const left = placed(most, place, value);
      if (mark === "bar") { element.style.left = `${Math.min(left, 50)}%`; element.style.width = `${Math.abs(left - 50)}%`; }
      else element.style.left = `${left}%`;
      if (mark === "bar" || mark === "body") text.textContent = quantity(value, shown(signals[place].unit));
    }
  }
}

// Turns every part of the picture: `data-turn` has the place of its output and its centre, `data-pose` lines in space.
function turn(values) {
  for (const part of picture.querySelectorAll("[data-turn]")) {
    const [place, ...centre] = JSON.parse(part.dataset.turn), angle = values[part.classList[0]][place] ?? null;
    part.style.display = angle === null ? "none" : "";
    if (angle !== null) part.setAttribute("transform", `rotate(${(-angle * DEGREES).toFixed(2)} ${centre.join(" ")})`);
  }
  for (const part of picture.querySelectorAll("[data-pose]")) {
    const angles = values[part.parentNode.classList[0]];
    // An axis without a set-point is shown level.
    if (angles.length) part.setAttribute("d", pose(part.dataset.pose, [0, 1, 2].map((place) => angles[place] ?? 0)));
  }
}

function drawPicture() {
  const point = memory.points.at(-1), decision = memory.decisions.at(-1), applied = memory.heads.transmitter?.applied;
  if (!point || !plant) return;
  const references = decision ? decision[1] : [];
  if (picture) turn({ body: point[1], estimate: point[2], reference: references });
  if (at("outputs").children.length) {
    for (const [, values] of memory.points) values.forEach((value, place) => placed(largest.outputs, place, value));
    drawGauges("outputs", largest.outputs, plant.outputs, (place) => ({ body: point[1][place], estimate: point[2][place], reference: references[place] }));
  }
  if (!applied) return;
  drawGauges("inputs", largest.inputs, plant.inputs, (place) => ({ bar: applied[place] }));
  if (picture.id === "helicopter" && applied.length === 2) {
    // The front rotor lifts the front: it is drawn at the right, where the nose is.
    const arrow = (x, volt) => (Math.abs(volt) > 0.05 ? `M${x} 98v${(-volt * 6).toFixed(1)}` : "");
    at("thrust-front").setAttribute("d", arrow(254, applied[0]));
    at("thrust-rear").setAttribute("d", arrow(66, applied[1]));
  }
}

function drawScale() {
  const parts = [];
  for (const degrees of [-90, -45, 0, 45, 90]) {
    const a = -degrees / DEGREES, cos = Math.cos(a), sin = Math.sin(a);
    parts.push(`<path d="M${160 + 112 * cos} ${122 + 112 * sin}L${160 + 119 * cos} ${122 + 119 * sin}"/>`);
    if (degrees > -90) parts.push(`<text x="${160 + 146 * cos}" y="${126 + 148 * sin}">${degrees}°</text>`);
  }
  picture.querySelector(".scale").innerHTML = parts.join("");
}

// ---- words and figures

function set(id, text) {
  const element = at(id);
  if (element.textContent !== text) element.textContent = text;
}

// A value with its unit: angles to a tenth of a degree, others to three figures.
function quantity(value, look, digits = 1) {
  const size = Math.abs(value * look.factor);
  return `${value < 0 ? "−" : "+"}${look.unit === "°" ? size.toFixed(digits) : size.toPrecision(3)}${look.unit}`;
}

// What there is of every output: `each` gives the value of the one at a place.
const ofOutputs = (each, digits) => plant.outputs.map((one, place) => quantity(each(place), shown(one.unit), digits)).join(", ");

function state(now) {
  const head = memory.heads.transmitter;
  if (!head) return ["waiting", "Waiting", "for a sensor node"];
  const silent = now - heardAt > STALE_MS;
  if (silent && head.phase !== "ended") return ["silent", "Unknown", "no data from this flight"];
  if (now - brokenAt < BROKEN_SHOWN_MS) return ["broken", "Lockstep broken", brokenText()];
  if (head.phase === "rejoining") return ["rejoining", "Resynchronising", `epoch ${head.epoch} is over; bits count again once both ends have a common state`];
  if (head.phase === "ended") return ["waiting", "The flight is over", `${head.counts.digest_checks} digests compared, ${head.counts.desyncs} differed`];
  const sample = lastCompared();
  if (!sample) return ["waiting", "Waiting", "for the first digests"];
  if (sample[3] !== sample[4]) return ["broken", "Lockstep broken", brokenText()];
  const text = repaired || `${head.counts.digest_checks} digests compared, ${head.counts.desyncs} differed`;
  return ["lockstep", "In lockstep", text];
}

function brokenText() {
  return broken ? `the codecs differ after sample ${broken.sample}` : "";
}

function lastCompared() {
  let found = null;
  for (const sample of memory.samples.values()) if (sample[3] && sample[4] && (!found || sample[0] > found[0])) found = sample;
  return found;
}

function showLight(now) {
  const [name, title, text] = state(now);
  const light = at("light");
  if (light.dataset.state !== name) {
    light.dataset.state = name;
    at("light-sign").setAttribute("d", SIGNS[name]);
  }
  set("light-title", title);
  set("light-text", text);
  if (name === "broken") {
    if (broken) { set("digest-up", broken.transmitter_digest); set("digest-down", broken.receiver_digest); return; }
  }
  const sample = lastCompared();
  set("digest-up", sample ? sample[3] : "–");
  set("digest-down", sample ? sample[4] : "–");
}

function showText(now) {
  const up = memory.heads.transmitter, down = memory.heads.receiver, point = memory.points.at(-1);
  showLight(now);
  showBanner(now);
  if (up) {
    set("flight", `${up.preset}, ${up.clock} clock${up.paused ? ", paused" : up.pace ? `, ${up.pace} × real time` : ""}${up.impairments ? `, line impaired: ${up.impairments}` : ""}`);
    set("f-time", `${up.time_s.toFixed(1)} s`);
    set("f-late", up.lateness ? `${up.lateness.p99_ms.toFixed(2)} ms` : "virtual");
    set("f-guard", up.guard);
    set("f-rejoins", `${up.counts.desyncs}, ${up.counts.rejoins}`);
    set("tape-text", `one every ${up.symbol_period_s.toFixed(3).replace(/0+$/, "").replace(/\.$/, "")} s of flight, as the controller consumes them`);
    at("gap-box").hidden = up.gap_to_floor === undefined || up.gap_to_floor === null;
    if (!at("gap-box").hidden) set("f-gap", `${up.gap_to_floor.toFixed(2)} ×`);
    const learned = Object.entries(up.learned || {});
    at("learned-box").hidden = !learned.length;
    set("f-learned", learned.map(learnedText).join(", "));
    const baud = down && down.baud_measured !== null ? down.baud_measured.toFixed(2) : "–";
    set("f-baud", `${baud} of ${up.baud_configured}`);
  }
  const counts = (up || down)?.counts;
  if (counts) set("f-erasures", String(counts.erasures));
  if (point && plant) {
    set("value", plant.outputs.length > 1 ? "" : ofOutputs((place) => point[1][place]));
    set("f-error", ofOutputs((place) => point[1][place] - point[2][place], 2));
    set("f-range", ofOutputs((place) => point[3][place] ?? 0, 2).replaceAll("+", ""));
  }
  const rows = memory.events.map(({ role, time_s: time, kind, text }) =>
    [role === "transmitter" ? "sensor" : "controller", time, kind === "desync" || kind === "refused", text]);
  const key = JSON.stringify(rows);
  if (rows.length && at("events").dataset.key !== key) {
    at("events").dataset.key = key;
    at("events").replaceChildren(...rows.map(([who, time, bad, text]) => {
      const [item, when, source] = ["li", "time", "span"].map((name) => document.createElement(name));
      when.textContent = `${Math.max(0, time).toFixed(1)} s`;
      source.textContent = who;
      item.append(when, source, text);
      if (bad) item.className = "bad";
      return item;
    }));
  }
}

function showBanner(now) {
  const ended = Object.values(memory.heads).some((head) => head.phase === "ended");
  let text = "";
  if (!connected && everHeard) text = ended ? "The flight is over, and the page's server has stopped." : "The page's server does not answer. Retrying every second. If it was restarted, open the address that it printed.";
  else if (!connected) text = "Connecting to the page's server.";
  else if (!everHeard) text = "No flight found. Start one with <code>tenbaud demo --view</code>, or with <code>tenbaud receive</code> and <code>tenbaud transmit</code>.";
  else if (ended) text = "The flight is over. The page shows its last state.";
  else if (now - heardAt > STALE_MS) text = `No data for ${((now - heardAt) / 1000).toFixed(0)} s: the page shows old values.`;
  const banner = at("banner");
  if (banner.innerHTML !== text) banner.innerHTML = text;
  banner.hidden = !text;
  document.body.classList.toggle("silent", Boolean(text) && everHeard && !ended);
}

// ---- drawing, at the stream's pace and never faster

function forget() {
  const now = memory.points.at(-1)?.[0] ?? 0;
  for (const rows of [memory.points, memory.decisions]) {
    let old = 0;
    while (old < rows.length && rows[old][0] < now - KEPT_S) old++;
    if (old > 20) rows.splice(0, old);
  }
  return now;
}

// Which share of the bits on the tape is about each output.
function nameBits(about) {
  at("bit-keys").querySelectorAll("span").forEach((text, place) => {
    const share = about.filter((one) => one === place).length / (about.length || 1);
    text.textContent = `${words(plant.outputs[place])} ${Math.round(100 * share)} %`;
  });
}

function draw() {
  asked = false;
  if (!dirty || document.hidden) return;
  dirty = false;
  const time = forget();
  become((memory.heads.transmitter || memory.heads.receiver)?.plant);
  drawPicture();
  const [high, low] = plant?.outputs.length > 1 ? [150, 90] : [210, 120];
  (plant?.outputs || []).forEach((one, place) => {
    const look = shown(one.unit);
    drawOutput(at(`value-${place}`), high, time, memory.points, memory.decisions, place, look, ink);
    drawError(at(`error-${place}`), low, time, memory.points, place, look, ink);
  });
  // The tape changes with the bits, half as often as the curves.
  if (tapeDirty) {
    const samples = [...memory.samples.values()].sort((a, b) => a[0] - b[0]), several = plant?.outputs.length > 1;
    drawTape(at("tape"), samples, ink, several);
    if (several) nameBits(samples.flatMap((sample) => sample[5] || []));
  }
  tapeDirty = false;
}

// ---- colours: the system's, or the visitor's own

const CHOICES = ["system", "dark", "light"];
const system = matchMedia("(prefers-color-scheme: dark)");
let choice = "system";
try { choice = localStorage.getItem("tenbaud-colours") || "system"; } catch { /* private mode */ }

function paint() {
  const dark = choice === "dark" || (choice === "system" && system.matches);
  document.body.classList.toggle("body--dark", dark);
  document.body.classList.toggle("body--light", !dark);
  set("theme", `Colours: ${choice}`);
  at("theme").setAttribute("aria-label", `Colours: ${choice}. Press to change`);
  ink = colours();
  dirty = tapeDirty = true;
}

at("theme").addEventListener("click", () => {
  choice = CHOICES[(CHOICES.indexOf(choice) + 1) % CHOICES.length];
  try { localStorage.setItem("tenbaud-colours", choice); } catch { /* private mode */ }
  paint();
});
system.addEventListener("change", paint);
addEventListener("resize", () => { dirty = tapeDirty = true; });

// NiceGUI sets its own idea of the colours when it has loaded; ours are put back.
new MutationObserver(() => {
  const dark = choice === "dark" || (choice === "system" && system.matches);
  if (document.body.classList.contains("body--dark") !== dark) paint();
}).observe(document.body, { attributes: true, attributeFilter: ["class"] });

paint();
listen();
// Figures five times a second: what changes faster cannot be read. It also draws without new data.
setInterval(() => { showText(performance.now()); draw(); }, TEXT_MS);
showText(0);
draw();

function learnedText([name, [error, sd]]) {
  const words = name.replaceAll("_", " ");
  if (name.endsWith("_force")) return `${words} ${error.toFixed(3)} (${sd.toFixed(3)})`;
  return `${words} ${(100 * error).toFixed(1)} % (${(100 * sd).toFixed(1)})`;
}
