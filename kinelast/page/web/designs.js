// From the data to the page of many designs.
function theme() {
  const dark = matchMedia("(prefers-color-scheme: dark)"), root = document.documentElement;
  const set = (name) => { root.dataset.theme = name; tell("change"); };
  root.dataset.theme = dark.matches ? "dark" : "light";
  $("tools").append(h("button", { type: "button", id: "theme", "aria-label": "dark or light page", onclick: () => set(root.dataset.theme === "dark" ? "light" : "dark") }, "◐"));
  dark.addEventListener("change", () => set(dark.matches ? "dark" : "light"));
  let before = null;
  addEventListener("beforeprint", () => { before = root.dataset.theme; state.printing = true; set("light"); });
  addEventListener("afterprint", () => { state.printing = false; set(before ?? "light"); before = null; });
}

function aboutDesigns() {
  const words = [`${data.of} designs of ${data.numbers.length} number${data.numbers.length === 1 ? "" : "s"}: ${data.numbers.join(", ")}`];
  words.push(data.failed ? `; ${data.failed} have no figures` : "");
  words.push(COUNT < data.of ? `. This page holds ${COUNT} of them: the fronts of its figures, the best, and a random part of the others` : "");
  $("about").textContent = `${words.join("")}.`;
}

[state.x, state.y] = data.axes;
theme();
aboutDesigns();
const scatter = scatterSection();
parallelSection();
chosenSection();
sensitivitySection();
tableSection();
if (bestPlace !== null) choose(bestPlace);
window.kinelast = { data, state, choose, scatter, inside, columnOf, frontOf };
document.body.dataset.ready = "yes";
