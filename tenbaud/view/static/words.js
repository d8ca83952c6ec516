// Words and figures: the light, the numbers, the events, and what is announced to a screen reader.

import { make, plant } from "./plant.js";
import { quantity, shown } from "./units.js";

const STALE_MS = 1500, BROKEN_SHOWN_MS = 2500;
const SIGNS = { waiting: "M12 7v6M12 16.5v.5", silent: "M7 12h10", lockstep: "M7 12.5l3.5 3.5L17 8.5",
  broken: "M8 8l8 8M16 8l-8 8", rejoining: "M16.5 9a5.5 5.5 0 1 0 .8 5M17 5.5V9.4h-3.8" };

export function set(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

// What there is of every output: `each` gives the value of the one at a place.
const ofOutputs = (each, digits) => plant.outputs.map((one, place) => quantity(each(place), shown(one.unit), digits)).join(", ");

const isSilent = (flight) => !flight.recorded && performance.now() - flight.heardAt > STALE_MS;

function state(flight) {
  const head = flight.heads.transmitter;
  if (flight.missing) return ["waiting", "Not compared", flight.missing];
  if (!head) return ["waiting", "Waiting", "for a transmitter"];
  if (isSilent(flight) && head.phase !== "ended") return ["silent", "Unknown", "no data from this flight"];
  const broken = flight.broken ? `the codecs differ after sample ${flight.broken.sample}` : "";
  const compared = head.narrow ? confirmed(head.narrow) : `${head.counts.digest_checks} digests compared, ${head.counts.desyncs} differed`;
  if (flight.now - flight.brokenAt < BROKEN_SHOWN_MS) return ["broken", "Lockstep broken", broken];
  if (head.phase === "rejoining") return ["rejoining", "Resynchronising", `epoch ${head.epoch} is over; bits count again once both ends have a common state`];
  if (head.phase === "ended") return ["waiting", "The flight is over", compared];
  const sample = flight.lastCompared();
  if (!sample) return ["waiting", "Waiting", head.narrow ? compared : "for the first digests"];
  if (!sample[3].endsWith(sample[4])) return ["broken", "Lockstep broken", broken];
  return ["lockstep", head.paused ? "In lockstep, paused" : "In lockstep", flight.repaired || compared];
}

// Of the narrow downlink, which brings no digests.
function confirmed({ confirmed_to: first, hash_symbols: bits }) {
  return `${first ? `confirmed up to sample ${first - 1}` : "no sample is confirmed"}${bits === null ? "" : `; ${bits} hash bits agreed`}`;
}

// The receiver's digest: of the compact downlink, the last digits that came.
function lastDigits(sample) {
  const [own, other] = sample?.slice(3) || [];
  return own && other && other.length < own.length ? `…${other}` : other;
}

function showLight(flight) {
  const [name, title, text] = state(flight), light = flight.at("light");
  if (light.dataset.state !== name) {
    light.dataset.state = name;
    flight.at("light-sign").setAttribute("d", SIGNS[name]);
  }
  set(flight.at("light-title"), title);
  set(flight.at("light-text"), text);
  const sample = flight.lastCompared() || [...flight.samples.values()].at(-1), broken = name === "broken" && flight.broken;
  set(flight.at("digest-up"), (broken ? broken.transmitter_digest : sample?.[3]) || "–");
  set(flight.at("digest-down"), (broken ? broken.receiver_digest : lastDigits(sample)) || "–");
  return flight.name ? `${flight.name}: ${title}` : title;
}

const trimmed = (value, digits) => value.toFixed(digits).replace(/\.?0+$/, "");

function showFigures(flight) {
  const { transmitter: up, receiver: down } = flight.heads, { point } = flight, show = (id, text) => set(flight.at(id), text);
  if (up) {
    show("f-time", `${up.time_s.toFixed(1)} s`);
    show("f-late", up.lateness ? `${up.lateness.p99_ms.toFixed(2)} ms` : up.clock === "virtual" ? "none: virtual clock" : "–");
    show("f-guard", up.guard || "–");
    show("f-rejoins", `${up.counts.desyncs}, ${up.counts.rejoins}`);
    show("tape-text", `of the uplink, one every ${trimmed(up.symbol_period_s, 3)} s of flight, as the receiver consumes them`);
    flight.at("gap-box").hidden = up.gap_to_floor === undefined || up.gap_to_floor === null;
    if (!flight.at("gap-box").hidden) show("f-gap", `${up.gap_to_floor.toFixed(2)} ×`);
    showNarrow(flight, up.narrow);
    const learned = Object.entries(up.learned || {});
    flight.at("learned-box").hidden = !learned.length;
    show("f-learned", learned.map(learnedText).join(", "));
    const baud = down && down.baud_measured !== null ? down.baud_measured.toFixed(2) : "–";
    show("f-baud", `${baud} of ${trimmed(up.baud_configured, 2)}`);
  } else if (down) show("f-time", `${down.time_s.toFixed(1)} s`);
  const counts = (up || down)?.counts;
  if (counts) show("f-erasures", String(counts.erasures));
  if (point && plant) {
    const less = (one, other) => (one === null || other === null || other === undefined ? null : one - other);
    show("value", plant.outputs.length > 1 ? "" : ofOutputs((place) => point[1][place]));
    show("f-error", ofOutputs((place) => less(point[1][place], point[2][place]), 2));
    show("f-range", ofOutputs((place) => point[3][place] ?? null, 2).replaceAll("+", ""));
  }
}

function showNarrow(flight, narrow) {
  for (const id of ["confirmed-box", "copies-box", "down-box"]) flight.at(id).hidden = !narrow;
  flight.at("law-note").hidden = !narrow?.is_mirrored;
  if (!narrow) return;
  const { sample, confirmed_to: first, size, rest, baud_measured: baud, baud_configured: most } = narrow;
  set(flight.at("f-confirmed"), first ? `sample ${first - 1}, ${Math.max(0, sample - first + 1)} behind` : "none");
  set(flight.at("f-copies"), `${size}, ${rest.toExponential(0)}`);
  set(flight.at("f-down"), `${baud === null ? "–" : baud.toFixed(2)} of ${trimmed(most, 2)}`);
}

function learnedText([name, [error, sd]]) {
  const words = name.replaceAll("_", " ");
  if (name.endsWith("_force")) return `${words} ${error.toFixed(3)} (${sd.toFixed(3)})`;
  return `${words} ${(100 * error).toFixed(1)} % (${(100 * sd).toFixed(1)})`;
}

// What was flown, in one line.
function nameOf(flight) {
  const up = flight.heads.transmitter;
  if (flight.recorded || !up) return flight.name;
  return `${up.preset}, ${up.clock} clock${up.paused ? ", paused" : up.pace ? `, ${up.pace} × real time` : ""}${up.impairments ? `, line impaired: ${up.impairments}` : ""}`;
}

// `jump`: what a click on an event does with its time; none: events are no buttons.
function showEvents(flights, jump) {
  const rows = flights.flatMap((flight) => flight.events.map(({ role, time_s: time, kind, text }) =>
    [flights.length > 1 ? flight.place : null, role, time, kind === "desync" || kind === "refused", text]));
  if (flights.length > 1) rows.sort((one, other) => other[2] - one[2]);
  const list = document.getElementById("events"), key = JSON.stringify(rows);
  if (list.dataset.key === key || (!rows.length && !list.dataset.key)) return;
  list.dataset.key = key;
  list.replaceChildren(...(rows.length ? rows : [[null, "", null, false, "None yet."]]).map(([run, role, time, bad, text]) => {
    const item = make("li", bad ? "bad" : ""), inside = jump && time !== null ? make("button", "event") : item;
    if (inside !== item) {
      inside.type = "button";
      inside.addEventListener("click", () => jump(time));
      item.append(inside);
    }
    if (run !== null) inside.append(make("i", `key square run-${run}`));
    inside.append(make("time", "", time === null ? "" : `${Math.max(0, time).toFixed(1)} s`), make("span", "", role), text);
    return item;
  }));
}

export function showText(flights, banner, jump) {
  const titles = flights.map((flight) => { showFigures(flight); return showLight(flight); });
  set(document.getElementById("flight"), flights.map(nameOf).join(" and "));
  showEvents(flights, jump);
  showBanner(banner);
  // Changes of state alone are announced: not the seconds in a text, nor counts.
  set(document.getElementById("announcement"), [banner.state, ...titles].filter(Boolean).join(". "));
}

function showBanner({ text, state: name }) {
  const banner = document.getElementById("banner"), parts = [text].flat(), key = parts.join("");
  if (banner.dataset.text !== key) {
    banner.dataset.text = key;
    // Every second part is a command.
    banner.replaceChildren(...parts.map((part, place) => (place % 2 ? make("code", "", part) : part)));
  }
  banner.hidden = !key;
  document.body.classList.toggle("silent", name === "No data");
}

// What the banner of a live flight says, and its state in a word or two.
export function liveBanner(flight, connected) {
  const ever = flight.heardAt > 0, ended = Object.values(flight.heads).some((head) => head.phase === "ended");
  if (!connected && ever && ended) return { text: "The flight is over, and the page's server has stopped.", state: "The server has stopped" };
  if (!connected && ever) return { text: "The page's server does not answer. Retrying every second. If it was restarted, open the address that it printed.", state: "No data" };
  if (!connected) return { text: "Connecting to the page's server.", state: "" };
  if (!ever) return { text: ["No flight found. Start one with ", "tenbaud demo --view", ", or with ", "tenbaud receive", " and ", "tenbaud transmit", ", or give ", "tenbaud view", " the folder of a run."], state: "No flight found" };
  if (ended) return { text: "The flight is over. The page shows its last state.", state: "" };
  if (isSilent(flight)) return { text: `No data for ${((performance.now() - flight.heardAt) / 1000).toFixed(0)} s: the page shows old values.`, state: "No data" };
  return { text: "", state: "" };
}
