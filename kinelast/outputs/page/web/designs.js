// Builds the page of many designs from its data.
function aboutDesigns() {
  const { numbers } = data;
  const words = [`${several(data.of, "design")} of ${several(numbers.length, "number")}: ${numbers.join(", ")}`];
  words.push(data.failed ? `; ${data.failed} ha${data.failed === 1 ? "s" : "ve"} no figures` : "");
  words.push(
    COUNT < data.of
      ? `. This page holds ${COUNT} of them: the fronts of its figures, the best, and a random part of the others`
      : "",
  );
  $("about").textContent = `${words.join("")}.`;
}

[state.x, state.y] = data.axes;
addEventListener("beforeprint", () => (state.printing = true));
addEventListener("afterprint", () => (state.printing = false));
theme(() => tell("change"));
aboutDesigns();
const scatter = scatterSection();
parallelSection();
chosenSection();
tableSection();
if (bestPlace !== null) choose(bestPlace);
window.kinelast = { data, state, choose, scatter, inside, columnOf, frontOf };
document.body.dataset.ready = "yes";
