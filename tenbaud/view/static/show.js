// Draws a flight, whatever its source: a running one, recordings, or one within the page.

import { colours, drawError, drawOutput, drawTape } from "./draw.js";
import { become, drawPicture, nameBits, plant } from "./plant.js";
import { theme } from "./theme.js";
import { shown } from "./units.js";
import { set, showText } from "./words.js";

const TEXT_MS = 200;

// `begin` gets the function that says that there is news, and returns the source.
export function show(begin) {
  let ink = colours(), asked = false, dirty = true, begun = false;

  // Drawing at the pace of the source and never faster.
  function news() {
    dirty = true;
    if (asked) return;
    asked = true;
    requestAnimationFrame(draw);
  }

  const source = begin(news);

  function draw() {
    asked = false;
    if (!dirty || document.hidden) return;
    dirty = false;
    const { flights } = source, span = source.span();
    become(flights);
    if (!plant) return;
    for (const text of document.querySelectorAll("#curves .span")) set(text, span.words);
    const several = plant.outputs.length > 1, [high, low] = several ? [130, 130] : flights.length > 1 ? [300, 200] : [210, 120];
    plant.outputs.forEach((one, place) => {
      const look = shown(one.unit), canvas = (kind) => document.getElementById(`${kind}-${place}`);
      drawOutput(canvas("value"), high, span, flights, place, look, ink);
      drawError(canvas("error"), low, span, flights, place, look, ink);
    });
    for (const flight of flights) {
      drawPicture(flight);
      // The tape changes with the bits, half as often as the curves.
      if (!flight.tapeDirty) continue;
      const samples = [...flight.samples.values()].sort((a, b) => a[0] - b[0]);
      drawTape(flight.at("tape"), samples, ink, several);
      if (several) nameBits(flight, samples.flatMap((sample) => sample[5] || []));
      flight.tapeDirty = false;
    }
    source.shown();
    if (!begun) {
      begun = true;
      text();
    }
  }

  function anew() {
    for (const flight of source.flights) flight.tapeDirty = true;
    news();
  }

  theme(() => { ink = colours(); anew(); });
  addEventListener("resize", anew);
  // Explanations go away on Escape, as those of a browser do.
  addEventListener("keydown", ({ key }) => { if (key === "Escape") document.activeElement?.closest(".tipped") && document.activeElement.blur(); });

  // Figures five times a second: what changes faster cannot be read. It also draws without new data.
  function text() {
    showText(source.flights, source.banner(), source.jump);
    draw();
  }
  setInterval(text, TEXT_MS);
  text();
}
