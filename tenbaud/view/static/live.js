// A live flight: board messages as they come, and the sliders that follow what the flight does.

import { Flight } from "./flight.js";
import { liveBanner } from "./words.js";

const SPAN_S = 30, BUSY_MS = 1500, ANSWER_MS = 10_000;

// Board messages of the page's server; `heard` takes one, `connected` whether the server is there.
function served(heard, connected) {
  const address = new URL("stream", location.href);
  address.protocol = location.protocol === "https:" ? "wss:" : "ws:";
  const socket = new WebSocket(address);
  socket.onopen = () => connected(true);
  socket.onmessage = (event) => heard(JSON.parse(event.data));
  socket.onclose = () => { connected(false); setTimeout(() => served(heard, connected), 1000); };
}

// `listen` and `banner` are those of the page's server, or of a flight that comes from elsewhere.
export function live(news, listen = served, banner = liveBanner) {
  const flight = new Flight();
  let isConnected = false;
  listen((message) => { flight.take(message); news(); }, (now) => { isConnected = now; news(); });

  return {
    flights: [flight],
    banner: () => banner(flight, isConnected),
    span() {
      const to = flight.forget();
      return { from: to - SPAN_S, to, cursor: null, words: "last 30 s of flight" };
    },
    shown: () => followFlight(flight),
  };
}

// ---- sliders: plain ones of the browser, marked with `data-unit`

function showSlider(input) {
  const value = Number(input.value), text = `${value < 0 ? "−" : ""}${Math.abs(value)}${input.dataset.unit}`;
  input.setAttribute("aria-valuetext", text);
  input.parentNode.querySelector(".slider-value").textContent = text;
}

document.addEventListener("input", ({ target }) => {
  if (!target.dataset.unit && target.dataset.unit !== "") return;
  target.dataset.movedMs = performance.now();
  delete target.dataset.present;
  showSlider(target);
});

// Sliders show what the flight does at present, unless a visitor moves them just now.
function followFlight(flight) {
  const set_points = flight.decision?.[1] || [];
  for (const input of document.querySelectorAll(".slider input")) {
    const { output, factor, movedMs, present } = input.dataset;
    const value = output === undefined ? present : set_points[output] === null ? undefined : set_points[output] / factor;
    if (value === undefined || Number.isNaN(value) || input.matches(":active")) continue;
    // One with the focus waits for the flight to reach its value; a limit may keep it from that.
    const waits = input.matches(":focus") && Math.abs(value - input.value) > input.step / 2;
    if (performance.now() - (movedMs || -1e9) < (waits ? ANSWER_MS : BUSY_MS)) continue;
    input.value = value;
    showSlider(input);
  }
}
