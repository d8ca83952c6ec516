// Colours: the system's, or the visitor's own.

const CHOICES = ["system", "dark", "light"];
const system = matchMedia("(prefers-color-scheme: dark)");
let choice = "system";
try { choice = localStorage.getItem("tenbaud-colours") || "system"; } catch { /* private mode */ }

// Calls `painted` now and whenever the colours change.
export function theme(painted) {
  const button = document.getElementById("theme");
  const isDark = () => choice === "dark" || (choice === "system" && system.matches);

  function paint() {
    document.body.classList.toggle("body--dark", isDark());
    document.body.classList.toggle("body--light", !isDark());
    button.textContent = `Colours: ${choice}`;
    button.setAttribute("aria-label", `Colours: ${choice}. Press to change`);
    painted();
  }

  button.addEventListener("click", () => {
    choice = CHOICES[(CHOICES.indexOf(choice) + 1) % CHOICES.length];
    try { localStorage.setItem("tenbaud-colours", choice); } catch { /* private mode */ }
    paint();
  });
  system.addEventListener("change", paint);
  // NiceGUI sets its own idea of the colours when it has loaded; ours are put back.
  new MutationObserver(() => {
    if (document.body.classList.contains("body--dark") !== isDark()) paint();
  }).observe(document.body, { attributes: true, attributeFilter: ["class"] });
  paint();
}
