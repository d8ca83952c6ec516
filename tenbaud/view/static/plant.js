// The plant: what it is called, its picture, its bars and the frames of its curves.

import { OUTPUT_COLOURS } from "./draw.js";
import { pose } from "./pose.js";
import { degrees, quantity, shown, words } from "./units.js";

export let plant = null;

export function make(tag, name = "", text = "") {
  const element = document.createElement(tag);
  element.className = name;
  element.textContent = text;
  return element;
}

// A square in the colour of the bits that are about an output, or of a run.
export function square(colour) {
  const element = make("i", "key square");
  element.style.background = `var(--${colour})`;
  return element;
}
const key = (place) => square(`output-${place % OUTPUT_COLOURS}`);
const title = (one) => words(one).replace(/^./, (letter) => letter.toUpperCase());

// Builds what depends on the plant, once for each: charts, the pictures, bars.
export function become(flights) {
  const found = flights.map((flight) => flight.plant).find(Boolean);
  if (!found || JSON.stringify(found) === JSON.stringify(plant)) return;
  plant = found;
  const several = plant.outputs.length > 1;
  const curves = document.getElementById("curves");
  curves.classList.toggle("several", several);
  curves.replaceChildren(...plant.outputs.flatMap((one, place) => {
    const unit = shown(one.unit).words;
    return [["value", title(one)], ["error", several ? `${title(one)}, error of the codec` : "Error of the codec"]]
      .map(([kind, name]) => {
        const chart = make("div"), heading = make("h2", "", `${name} `), canvas = make("canvas");
        if (several) heading.prepend(key(place));
        const small = make("small", "", unit);
        if (kind === "value") small.append(unit ? ", " : "", make("span", "span"));
        heading.append(small);
        canvas.id = `${kind}-${place}`;
        canvas.setAttribute("role", "img");
        canvas.setAttribute("aria-label", `${name} over time`);
        chart.append(heading, canvas);
        return chart;
      });
  }));
  showLegend(flights);
  for (const flight of flights) build(flight, several, flights);
}

// What the lines of the curves are; of several runs, each has a colour.
function showLegend(flights) {
  const entry = (mark, text) => [make("i", `key ${mark}-key`), document.createTextNode(text)];
  const legend = document.getElementById("curves-legend");
  const [first] = plant.outputs, value = plant.outputs.length === 1 ? words(first) : "value";
  if (flights.length === 1) {
    legend.replaceChildren(...entry("body", value), ...entry("estimate", "estimate"), ...entry("reference", "set-point"), ...entry("tube", "range ± M"), ...entry("error", "error of the codec"));
    return;
  }
  const runs = flights.flatMap((flight) => [square(`run-${flight.place}`), make("b", "", flight.name)]);
  legend.replaceChildren(...runs, ...entry("body", value), ...entry("dashed", "estimate"), ...entry("reference", "set-point"));
}

// Flights in the same curves have the same outputs; inputs and picture are each flight's own.
const plantOf = (flight) => flight.plant || plant;
// One without a picture takes that of the first flight, which turns by the same outputs.
const pictureOf = (flight) => plantOf(flight).picture || plant.picture;

function build(flight, several, flights) {
  const own = plantOf(flight), id = pictureOf(flight).replaceAll(" ", "-");
  const picture = (id && (flight.at(`${id}-${plant.outputs.length}`) || flight.at(id))) || null;
  flight.picture = picture;
  for (const one of flight.at("outputs").parentNode.querySelectorAll(".plant")) one.toggleAttribute("hidden", one !== picture);
  if (id === "helicopter" && !several) drawScale(picture);
  for (const text of picture ? picture.querySelectorAll("[data-name]") : []) text.textContent = words(plant.outputs[text.dataset.name]);
  // Bars of the same signal have the same scale in every flight.
  const widest = (kind) => own[kind].map((one) => Math.max(...flights.flatMap((other) => plantOf(other)[kind])
    .filter(({ name, unit }) => name === one.name && unit === one.unit).map(spread)));
  flight.largest = { outputs: widest("outputs"), inputs: widest("inputs") };
  // A plant without a picture has bars; so have several outputs, for their values.
  flight.at("outputs").replaceChildren(...(picture && !several ? [] : plant.outputs.flatMap((one) => gauge(one, ["reference", "estimate", "body"]))));
  flight.at("inputs").replaceChildren(...own.inputs.flatMap((one) => gauge(one, ["bar"])));
  flight.at("bit-keys").replaceChildren(...(several ? plant.outputs.flatMap((one, place) => [key(place), make("span")])
    : [make("i", "key plus-key"), "sign + ", make("i", "key minus-key"), "sign −"]));
  flight.at("value-name").textContent = several ? "value" : plant.outputs[0] ? words(plant.outputs[0]) : "";
}

const spread = (one) => (one.low !== null && one.high !== null ? Math.max(Math.abs(one.low), Math.abs(one.high)) : 1e-9);

function gauge(one, marks) {
  const track = make("span", "gauge");
  track.append(make("i", "middle"), ...marks.map((mark) => make("i", mark)));
  return [make("b", "", words(one)), track, make("span", "amount")];
}

// Where a value stands on a track, in percent, and the largest seen as its end.
function placed(most, place, value) {
  most[place] = Math.max(most[place], Math.abs(value));
  return 50 + 50 * Math.max(-1, Math.min(1, value / most[place]));
}

function drawGauges(flight, id, signals, each) {
  const rows = flight.at(id).children, most = flight.largest[id];
  for (let place = 0; place * 3 < rows.length; place++) {
    const [, track, text] = [0, 1, 2].map((part) => rows[place * 3 + part]);
    for (const [mark, value] of Object.entries(each(place))) {
      const element = track.querySelector(`.${mark}`);
      element.hidden = value === null || value === undefined;
      if (mark === "bar" || mark === "body") text.textContent = quantity(value, shown(signals[place].unit));
      if (element.hidden) continue;
      const left = placed(most, place, value);
      if (mark === "bar") { element.style.left = `${Math.min(left, 50)}%`; element.style.width = `${Math.abs(left - 50)}%`; }
      else element.style.left = `${left}%`;
    }
  }
}

// Turns every part of a picture: `data-turn` has the place of its output and its centre, `data-pose` lines in space.
function turn(picture, values) {
  const angle = (of, place) => (of[place] === null || of[place] === undefined ? null : degrees(of[place], plant.outputs[place].unit));
  for (const part of picture.querySelectorAll("[data-turn]")) {
    const [place, ...centre] = JSON.parse(part.dataset.turn), turned = angle(values[part.classList[0]], place);
    part.style.display = turned === null ? "none" : "";
    if (turned !== null) part.setAttribute("transform", `rotate(${(-turned).toFixed(2)} ${centre.join(" ")})`);
  }
  for (const part of picture.querySelectorAll("[data-pose]")) {
    const angles = values[part.parentNode.classList[0]];
    // An axis without a set-point is shown level.
    if (angles.length) part.setAttribute("d", pose(part.dataset.pose, [0, 1, 2].map((place) => (angle(angles, place) ?? 0) * Math.PI / 180)));
  }
}

export function drawPicture(flight) {
  const { point, decision, picture } = flight, applied = flight.heads.transmitter?.applied;
  if (!point || !plant) return;
  const references = decision ? decision[1] : [];
  if (picture) turn(picture, { body: point[1], estimate: point[2], reference: references });
  if (flight.at("outputs").children.length) {
    for (const [, values] of flight.points) values.forEach((value, place) => placed(flight.largest.outputs, place, value));
    drawGauges(flight, "outputs", plant.outputs, (place) => ({ body: point[1][place], estimate: point[2][place], reference: references[place] }));
  }
  if (!applied) return;
  drawGauges(flight, "inputs", plantOf(flight).inputs, (place) => ({ bar: applied[place] }));
  if (picture && pictureOf(flight) === "helicopter" && plant.outputs.length === 1 && applied.length === 2) {
    // The front rotor lifts the front: it is drawn at the right, where the nose is.
    const arrow = (x, volt) => (Math.abs(volt) > 0.05 ? `M${x} 98v${(-volt * 6).toFixed(1)}` : "");
    flight.at("thrust-front").setAttribute("d", arrow(254, applied[0]));
    flight.at("thrust-rear").setAttribute("d", arrow(66, applied[1]));
  }
}

function drawScale(picture) {
  const parts = [];
  for (const angle of [-90, -45, 0, 45, 90]) {
    const a = -angle * Math.PI / 180, cos = Math.cos(a), sin = Math.sin(a);
    parts.push(`<path d="M${160 + 112 * cos} ${122 + 112 * sin}L${160 + 119 * cos} ${122 + 119 * sin}"/>`);
    parts.push(`<text x="${160 + 146 * cos}" y="${126 + 148 * sin}">${angle < 0 ? "−" : ""}${Math.abs(angle)}°</text>`);
  }
  picture.querySelector(".scale").innerHTML = parts.join("");
}

// Which share of the bits on the tape is about each output.
export function nameBits(flight, about) {
  flight.at("bit-keys").querySelectorAll("span").forEach((text, place) => {
    const share = about.filter((one) => one === place).length / (about.length || 1);
    text.textContent = `${words(plant.outputs[place])} ${Math.round(100 * share)} %`;
  });
}
