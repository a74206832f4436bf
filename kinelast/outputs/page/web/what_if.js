// A slider over the one number that a sweep varied, which shows the figures of the computed designs.
const WHAT_IF_CHARTS = 4;
function whatIfSection() {
  const given = summary.what_if;
  if (!given) return;
  const { path, unit, values, here, reasons, figures } = given,
    known = figures.filter(({ values: column }) => column.some((value) => value !== null));
  const words = h("output", { for: "what-if-value" }),
    why = h("p.soft", { role: "status" }),
    cells = known.map(() => [h("td"), h("td")]);
  const slider = h("input", {
    type: "range",
    id: "what-if-value",
    min: 0,
    max: values.length - 1,
    step: 1,
    value: here,
    oninput: () => show(Number(slider.value)),
  });
  function share(value, own) {
    if (value === null || !own) return "";
    return `${value >= own ? "+" : "−"}${number(100 * Math.abs(value / own - 1), 3)} %`;
  }
  function show(k) {
    words.textContent = sized(values[k], unit);
    slider.setAttribute("aria-valuetext", words.textContent);
    why.textContent = k === here ? "This report's own design." : reasons[k] && `No figures: ${reasons[k]}.`;
    known.forEach(({ values: column, unit: of }, row) => {
      cells[row][0].textContent = sized(column[k], of);
      cells[row][1].textContent = share(column[k], column[here]);
    });
  }
  const rows = known.map(({ name, values: column, unit: of }, row) =>
    h("tr", h("th", { scope: "row" }, name), h("td", sized(column[here], of)), cells[row])
  );
  const heads = ["figure", "in this report's design", "there", "change"].map((head) => h("th", { scope: "col" }, head));
  const grid = h("div.charts");
  section(
    "what-if",
    "What if",
    `What if: ${path}`,
    soft(
      `Quasi-static figures of the ${values.length} designs of the sweep, as in designs.csv. The report ` +
        "itself uses the scene's own theory.",
    ),
    h("div.bar", h("label", { for: "what-if-value" }, path), slider, words),
    why,
    h(
      "div.wide",
      { tabindex: 0, role: "region", "aria-label": "Figures along the sweep" },
      h("table", h("thead", h("tr", heads)), h("tbody", rows)),
    ),
    grid,
  );
  show(here);
  const [factor, prefixed] = unit === "rad" ? [180 / Math.PI, "deg"] : scaleOf(Math.max(...values.map(Math.abs)), unit),
    xs = values.map((value) => value * factor);
  for (const { name, unit: of, values: column } of known.slice(0, WHAT_IF_CHARTS)) {
    chart(grid, `${name} against ${path}`, of, [curve(name, (k) => column[k] ?? NaN, 0)], {
      xs,
      notes: { lines: [[xs[here], "this report"]] },
      xLabel: `${path} [${unitWords(prefixed) || "1"}]`,
    });
  }
}
