// Studies of designs: sensitivities, ranges under tolerances, best design.
function studiesSections() {
  if (summary.sensitivities) sensitivitiesSection(summary.sensitivities);
  if (summary.tolerances) tolerancesSection(summary.tolerances);
  if (summary.optimum) optimumSection(summary.optimum);
}

// Bars for a selectable figure, with rows {name, size, words}.
function chosenBars(id, figures, rowsOf) {
  const bars = h("div.shares"),
    pick = choice(id, () => draw(), figures.map(({ name }, k) => option(k, name)));
  function draw() {
    const rows = rowsOf(figures[pick.value]).sort((a, b) => Math.abs(b.size) - Math.abs(a.size));
    bars.replaceChildren(strips(rows.slice(0, 20)));
  }
  draw();
  return [bar(labelled("Figure", pick)), bars];
}

function sensitivitiesSection({ numbers, figures }) {
  const rowsOf = ({ slopes, value, unit }) =>
    slopes.map((each, k) => ({
      name: `${numbers[k].step.words} more ${numbers[k].path}`,
      size: each.change ?? 0,
      words: `${each.change > 0 ? "+" : ""}${sized(each.change, unit)}${
        value ? ` (${number((100 * each.change) / value, 3)} %)` : ""
      }${each.kink ? " (kink)" : ""}`,
    })).filter(({ size }) => Math.abs(size) > 5e-6 * Math.abs(value));
  section(
    "sensitivities",
    "Sensitivities",
    "What a figure depends on",
    soft(
      "Change of the quasi-static figure if a number of the file grows by a millimetre, a degree, its " +
        "tolerance, or 1 %, with the other numbers fixed; orange: decrease. At a kink, two places have the " +
        "same largest value, and the slopes on both sides differ. Derivatives and their errors are in " +
        "sensitivities.csv.",
    ),
    chosenBars("sensitivity-of", figures, rowsOf),
  );
}

const sentence = (words) => `${words[0].toUpperCase()}${words.slice(1)}.`;
function withError({ in_full: value, error, unit }) {
  if (value === null) return "";
  return sized(value, unit) + errorWords({ value, error, unit, unreliable: error > UNRELIABLE * Math.abs(value) });
}
// Angles in degrees.
const sized = (value, unit) => figureAngle({ value, unit });

function tolerancesSection({ designs, numbers, figures, theory, limits_kept: kept, words }) {
  const known = figures.filter(({ value, sampled }) => value !== null && sampled.low !== null),
    scattered = numbers.map(({ path, plus_minus, unit, distribution }) =>
      `${path} ± ${sized(plus_minus, unit)}${distribution === "normal" ? " (normal)" : ""}`
    );
  const wide = ({ first_order: { deviation } }) => (deviation === null ? null : 3 * deviation);
  const columns = [
    { name: "figure", text: ({ name }) => name },
    ...(/** @type {[string, any][]} */ ([
      ["nominal", ({ value }) => value],
      ["2.5 %", ({ sampled }) => sampled.low],
      ["median", ({ sampled }) => sampled.median],
      ["97.5 %", ({ sampled }) => sampled.high],
      ["largest", ({ sampled }) => sampled.largest],
    ])).map(([name, of]) => ({ name, of, words: (each) => sized(of(each), each.unit) })),
    {
      name: "in full",
      means: `nominal scene by its own theory with error: ${theory}`,
      of: ({ in_full: full }) => full,
      words: withError,
    },
    {
      name: "± to first order",
      means: "three standard deviations, by the slopes of the nominal design",
      of: wide,
      words: (each) => (wide(each) === null ? number(null) : sized(wide(each), each.unit)),
    },
  ];
  const shares = ({ shares: all }) =>
    all.map((each) => ({
      name: each.path,
      size: each.together ?? each.first_order ?? 0,
      words: `${number(100 * (each.together ?? each.first_order), 3)} %`,
    })).filter(({ size }) => size > 0.001);
  const output = known.some(({ name }) => name === "geometric_error")
    ? soft(
      "geometric_error: output error of rigid links against nominal ones; output_error: error by " +
        "deflection; whole_error: both together. All are the largest over the cycle.",
    )
    : null;
  section(
    "tolerances",
    "Tolerances",
    "Ranges under the tolerances",
    soft(`Quasi-static figures of ${designs} designs with ${scattered.join(", ")}.`),
    kept ? h("p", sentence(words.at(-1))) : null,
    output,
    table(known, columns, "Figures under tolerances"),
    h("h3", "Causes of the scatter"),
    chosenBars("tolerance-of", known, shares),
    soft("All values are in tolerances.csv."),
  );
}

function optimumSection({ words, variables, limits }) {
  const bound = ({ bound: size, kind, unit }) => `${kind === "most" ? "≤" : "≥"} ${sized(size, unit)}`;
  const changed = table(variables, [
    { name: "number", text: ({ path }) => path },
    ...[["before", "before"], ["best", "value"], ["lower bound", "low"], ["upper bound", "high"]].map((
      [name, key],
    ) => ({ name, of: (row) => row[key], words: (row) => sized(row[key], row.unit) })),
    { name: "at bound", text: ({ at_bound: end }) => end ?? "" },
  ], "Numbers of the best design");
  const kept = limits.length
    ? table(limits, [
      { name: "limit", text: (row) => `${row.figure} ${bound(row)}` },
      { name: "before", of: ({ before }) => before, words: ({ before, unit }) => sized(before, unit) },
      { name: "best", of: ({ value: found }) => found, words: ({ value: found, unit }) => sized(found, unit) },
      {
        name: "in full",
        means: "by the full answer, with its error",
        of: ({ in_full: full }) => full,
        words: withError,
      },
      { name: "outcome", text: ({ outcome }) => outcome },
      { name: "active", text: ({ active }) => (active ? "yes" : "") },
      {
        name: "relaxed by 1 %",
        means: "gain of the goal in per cent",
        of: ({ multiplier }) => multiplier,
        words: ({ multiplier }) => `${number(multiplier, 3)} %`,
      },
    ], "Limits")
    : null;
  section(
    "optimum",
    "Optimum",
    "The best design",
    h("ul", words.map((each) => h("li", each))),
    changed,
    kept,
    soft(
      "The best design is the scene optimum.toml, and this report is about it. The search is quasi-static; " +
        "\u201cin full\u201d is the answer with vibration and errors. \u201cBefore\u201d is the original " +
        "scene, which summary.json, sensitivities and tolerances describe.",
    ),
  );
}
