// Finished flights: the page asks for moments and plays them, at any speed.

import { timeAt } from "./draw.js";
import { Flight } from "./flight.js";

const PAGE_S = 5, CARDS = ["lock", "pictures", "tapes", "numbers"];

// Copies every instrument for a further flight, with ids of its own.
function copyCards(place, name) {
  for (const stack of CARDS.map((one) => document.querySelector(`.stack.${one}`))) {
    const copy = stack.querySelector(".card").cloneNode(true);
    for (const element of [copy, ...copy.querySelectorAll("[id], [aria-describedby]")]) {
      if (element.id) element.id += `@${place}`;
      const tip = element.getAttribute("aria-describedby");
      if (tip) element.setAttribute("aria-describedby", `${tip}@${place}`);
    }
    copy.setAttribute("aria-label", `${copy.getAttribute("aria-label")}, ${name}`);
    stack.append(copy);
  }
}

function nameCards(flights) {
  document.body.classList.add("overlaid");
  for (const { place, name } of flights) {
    if (place) copyCards(place, name);
    for (const id of ["light", "outputs", "tape", "figures"]) {
      const suffix = place ? `@${place}` : "", title = document.getElementById(`${id}${suffix}`).closest(".card").querySelector(".run-name");
      const square = document.createElement("i");
      square.className = `key square run-${place}`;
      title.replaceChildren(square, name);
    }
  }
}

export function replay(news) {
  const at = (id) => document.getElementById(id);
  const cursor = at("cursor"), speed = at("speed"), span = at("span"), play = at("play");
  const flights = [new Flight(0, "", true)];
  let known = { duration_s: 0, step_s: 1, notes: [], events_s: [] };
  let timeS = 0, socket = null, connected = false, waiting = false, stale = true, windowOf = "", playing = 0, playedAt = 0;

  // ---- questions and answers: one at a time, so that a slow browser gets fewer of them

  function listen() {
    const address = new URL("stream", location.href);
    address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
    socket = new WebSocket(address);
    socket.onopen = () => { connected = true; waiting = false; windowOf = ""; };
    socket.onmessage = ({ data }) => take(JSON.parse(data));
    socket.onclose = () => { connected = false; pause(); setTimeout(listen, 1000); };
  }

  function take(message) {
    if (message.recorded) begin(message.recorded);
    else {
      waiting = false;
      message.runs.forEach((run, place) => flights[place].take(run));
      news();
    }
    if (stale) ask();
  }

  function begin(recorded) {
    const isNew = !known.duration_s;
    known = recorded;
    known.flights.forEach(({ name, missing }, place) => {
      flights[place] ||= new Flight(place, name, true);
      Object.assign(flights[place], { name, missing });
    });
    if (isNew && flights.length > 1) nameCards(flights);
    cursor.max = Math.round(known.duration_s / known.step_s);
    for (const option of span.options) option.hidden = option.value !== "" && Number(option.value) >= known.duration_s;
    // At its end: every figure is that of the whole flight, and Play begins anew.
    go(isNew ? known.duration_s : timeS);
  }

  function shownSpan() {
    const width = Number(span.value) || known.duration_s;
    const from = Math.max(0, Math.min(timeS - width / 2, known.duration_s - width));
    return { from, to: from + width, cursor: timeS, words: span.value ? `${width} s of ${known.duration_s.toFixed(0)} s` : "the whole flight" };
  }

  function ask() {
    stale = true;
    if (!connected || waiting || !known.duration_s) return;
    const { from, to } = shownSpan(), wanted = `${from} ${to}`;
    socket.send(JSON.stringify(wanted === windowOf ? { at_s: timeS } : { at_s: timeS, from_s: from, to_s: to }));
    [windowOf, stale, waiting] = [wanted, false, true];
  }

  // ---- the cursor

  function go(toS) {
    timeS = Math.max(0, Math.min(known.duration_s, toS));
    const text = `${timeS.toFixed(known.step_s < 0.1 ? 2 : 1)} s of ${known.duration_s.toFixed(1)} s`;
    cursor.value = Math.round(timeS / known.step_s);
    cursor.setAttribute("aria-valuetext", text);
    at("cursor-text").textContent = text;
    ask();
    news();
  }
  const jump = (toS) => { pause(); go(toS); };
  // To a bit, counted from the one at the cursor.
  const step = (bits) => jump((Math.round(timeS / known.step_s) + bits) * known.step_s);

  function event(way) {
    const found = known.events_s.filter((one) => (way > 0 ? one > timeS + 1e-6 : one < timeS - 1e-6));
    if (found.length) jump(way > 0 ? found[0] : found.at(-1));
  }

  // ---- playing

  function pause() {
    cancelAnimationFrame(playing);
    playing = 0;
    play.textContent = "Play";
  }

  function start() {
    if (timeS >= known.duration_s) go(0);
    playedAt = performance.now();
    playing = requestAnimationFrame(tick);
    play.textContent = "Pause";
  }

  function tick(now) {
    const passedS = Math.max(0, now - playedAt) / 1000 * Math.max(Number(speed.min), Number(speed.value) || 1);
    playedAt = now;
    playing = requestAnimationFrame(tick);
    go(timeS + passedS);
    if (timeS >= known.duration_s) pause();
  }

  const toggle = () => (playing ? pause() : start());

  function setSpeed(value) {
    speed.value = value;
    for (const button of at("speeds").children) button.setAttribute("aria-pressed", String(Number(button.dataset.speed) === Number(value)));
  }

  play.addEventListener("click", toggle);
  cursor.addEventListener("input", () => jump(Number(cursor.value) * known.step_s));
  speed.addEventListener("input", () => setSpeed(speed.value));
  at("speeds").addEventListener("click", ({ target }) => target.dataset.speed && setSpeed(target.dataset.speed));
  span.addEventListener("change", () => { ask(); news(); });
  at("before").addEventListener("click", () => event(-1));
  at("after").addEventListener("click", () => event(1));
  at("curves").addEventListener("click", ({ target, offsetX }) => {
    const found = target.tagName === "CANVAS" ? timeAt(target, offsetX, shownSpan()) : null;
    if (found !== null) jump(found);
  });

  const KEYS = { ArrowLeft: () => step(-1), ArrowDown: () => step(-1), ArrowRight: () => step(1), ArrowUp: () => step(1), Home: () => jump(0), End: () => jump(known.duration_s), PageUp: () => jump(timeS + PAGE_S), PageDown: () => jump(timeS - PAGE_S), " ": toggle };
  addEventListener("keydown", (key) => {
    const { target } = key, pressed = target.matches("button") && target !== play && key.key === " ";
    if (pressed || target.matches("select, input:not(#cursor), ol") || key.ctrlKey || key.altKey || key.metaKey || !KEYS[key.key]) return;
    key.preventDefault();
    KEYS[key.key]();
  });
  // A button acts on Space when the key is released.
  addEventListener("keyup", (key) => { if (key.key === " " && key.target === play) key.preventDefault(); });

  setSpeed(1);
  listen();

  return {
    flights,
    jump,
    banner() {
      if (!connected) return { text: known.duration_s ? "The page's server does not answer. Retrying every second. If it was restarted, open the address that it printed." : "Connecting to the page's server.", state: known.duration_s ? "No data" : "" };
      return { text: known.notes.join(". "), state: playing ? "Playing" : "" };
    },
    span: shownSpan,
    shown() {},
  };
}
