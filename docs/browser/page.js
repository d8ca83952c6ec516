// The page: the live page's instruments, fed by the worker, and the controls of the flight.

import { live } from "./view/live.js";
import { show } from "./view/show.js";

const worker = new Worker(new URL("worker.js", import.meta.url), { type: "module" });
const at = (id) => document.getElementById(id);
const send = (kind, more = {}) => worker.postMessage({ kind, ...more });
let loading = "Loading Python for the browser, 14 MB the first time.", failed = "";

function listen(heard, connected) {
  worker.onerror = ({ message }) => { failed = message || "the worker could not be started"; connected(false); };
  worker.onmessage = ({ data }) => {
    if (data.news) {
      const news = JSON.parse(data.news);
      if (data.isNew) enable();
      heard(data.isNew ? { reset: true, ...news } : news);
      follow(data);
    }
    if (data.loading) loading = data.loading;
    if (data.symbols) save(data.symbols);
    if (data.error) failed = data.error.trim().split("\n").at(-1);
    connected(!failed);
  };
}

function banner(flight) {
  if (failed) return { text: `The flight stopped: ${failed}. Reload the page to start another.`, state: "The flight stopped" };
  if (!flight.heardAt) return { text: loading, state: "" };
  if (flight.heads.transmitter?.phase === "ended") return { text: "The flight is over. “Start again” begins another.", state: "" };
  return { text: "", state: "" };
}

show((news) => live(news, listen, banner));

// ---- controls

function enable() {
  for (const panel of document.querySelectorAll("fieldset")) panel.disabled = false;
}

function follow({ speed, paused, pace }) {
  at("pause").textContent = paused ? "Resume" : "Pause";
  at("speed").textContent = paused ? "paused" : `now ${speed < 10 ? speed.toFixed(1) : speed.toFixed(0)} × real time`;
  document.body.dataset.speed = speed;
  for (const button of at("paces").children) button.setAttribute("aria-pressed", String(button.dataset.pace === String(pace)));
}

function impair() {
  const parts = [["loss", at("loss")], ["flip", at("flip")]].filter(([, input]) => input.value > 0);
  send("impair", { text: parts.map(([name, input]) => `up:${name}=${input.value / 100}`).join(",") });
}

// The script of the live page shows the value beside a slider that has moved.
function repair() {
  for (const input of [at("loss"), at("flip")]) {
    input.value = 0;
    input.dispatchEvent(new Event("input", { bubbles: true }));
  }
}

function save(symbols) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([symbols], { type: "application/octet-stream" }));
  link.download = "flight.symbols";
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10_000);
}

at("set-point").addEventListener("change", ({ target }) => send("set_point", { value: target.value * target.dataset.factor }));
at("follow").addEventListener("click", () => send("set_point", { value: null }));
at("pause").addEventListener("click", () => send("pause"));
at("paces").addEventListener("click", ({ target: { dataset } }) => {
  if (dataset.pace) send("pace", { value: dataset.pace === "null" ? null : Number(dataset.pace) });
});
for (const id of ["loss", "flip"]) at(id).addEventListener("change", impair);
at("repair").addEventListener("click", () => { repair(); impair(); });
for (const end of ["transmitter", "receiver"]) at(`corrupt-${end}`).addEventListener("click", () => send("corrupt", { end }));
at("download").addEventListener("click", () => send("symbols"));
at("again").addEventListener("click", () => { repair(); send("again"); });
