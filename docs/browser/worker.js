// Python in a worker: it flies both ends at the pace that the page asks for, so that the page stays responsive.

import { loadPyodide } from "./pyodide/pyodide.mjs";

const PERIOD_MS = 50, BUDGET_S = 0.04, LAG_S = 0.5, SPEED_MS = 2000, FOR_EVER_S = 1e9;

let make = null, flight = null, pace = 1, paused = false, isNew = true, anchor = null, marks = [];

async function bytes(name) {
  const answer = await fetch(name);
  if (!answer.ok) throw new Error(`${name} is missing: ${answer.status} ${answer.statusText}`);
  return new Uint8Array(await answer.arrayBuffer());
}

async function load() {
  const indexURL = new URL("pyodide/", import.meta.url).href;
  const [python, heart, parts] = await Promise.all([loadPyodide({ indexURL }), bytes("heart.zip"), bytes("parts.pickle")]);
  postMessage({ loading: "Python is here; loading the two ends." });
  python.unpackArchive(heart, "zip", { extractDir: "/heart" });
  python.runPython("import sys; sys.path.insert(0, '/heart')");
  const { BrowserFlight } = python.pyimport("docs.browser.flight");
  const data = python.toPy(parts);
  make = () => BrowserFlight(data);
  begin();
  fly();
}

function begin() {
  flight?.destroy();
  flight = make();
  [isNew, anchor, marks, paused] = [true, null, [], false];
}

// How many seconds were flown in each of the last seconds.
function speed(now, reached) {
  marks.push([now, reached]);
  while (now - marks[0][0] > SPEED_MS) marks.shift();
  const [since, from] = marks[0];
  return now > since ? (reached - from) / ((now - since) / 1000) : 0;
}

function fly() {
  const now = performance.now();
  let flown = 0;
  if (!paused) {
    anchor ||= [now, flight.advance(0, 0)];
    const until = pace === null ? FOR_EVER_S : anchor[1] + (now - anchor[0]) / 1000 * pace;
    const reached = flight.advance(until, BUDGET_S);
    // A pace that this machine cannot keep is not made up for.
    if (pace !== null && until - reached > LAG_S * pace) anchor = [now, reached];
    flown = speed(now, reached);
  } else marks = [];
  postMessage({ news: flight.news(pace, paused), isNew, speed: flown, paused, pace });
  isNew = false;
  setTimeout(guarded, Math.max(0, PERIOD_MS - (performance.now() - now)), fly);
}

const ACTS = {
  pace: ({ value }) => { [pace, anchor, marks] = [value, null, []]; },
  pause: () => { [paused, anchor] = [!paused, null]; },
  set_point: ({ value }) => flight.steer(value),
  impair: ({ text }) => flight.impair(text),
  corrupt: ({ end }) => flight.corrupt(end),
  symbols: () => {
    const file = flight.symbols_file();
    postMessage({ symbols: file.toJs() });
    file.destroy();
  },
  again: begin,
};

function guarded(act, ...given) {
  try { act(...given); } catch (error) { postMessage({ error: String(error.message || error) }); }
}

onmessage = ({ data }) => { if (flight) guarded(ACTS[data.kind], data); };

load().catch((error) => postMessage({ error: String(error.message || error) }));
