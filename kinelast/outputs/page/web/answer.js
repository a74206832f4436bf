// First screen: verdict, reliability, and the main figures.
const LIMIT_WORDS = {
  deflection: "deflection",
  chord: "deflection from chord",
  safety: "safety against yield",
  output: "error of the output",
};

function agreement({ largest, momentum }) {
  const kept = Object.values(momentum).filter((balance) => balance.compared).map((balance) => balance.largest);
  const words = kept.length ? [`momentum of all masses to ${number(Math.max(...kept), 2)}`] : [];
  return (largest === null ? words : [`largest difference ${number(largest, 2)} of the maximum`, ...words]).join("; ");
}

// First screen: verdict, mechanism and deciding figures, then the other figures.
const DECIDING = 4;

function answerSection() {
  const part = section("answer", "Answer", "The answer", h("div.verdicts", acceptance(), trustLine()));
  const mechanism = mechanismSection(), [first, others] = [tiles().slice(0, DECIDING), tiles().slice(DECIDING)];
  $("main").append(
    h("div.front", part, h("div.tiles.deciding", first), mechanism, h("div.tiles.others", others)),
    document.querySelector("nav"),
  );
  view.fit();
  limitsSection();
  breaksFirst();
  handoutOnPaper();
}

// Limits with the worst outcome.
function decidingLimits() {
  if (summary.buckles) return [];
  const { verdict, limits } = summary.acceptance, worst = { "not acceptable": "not kept" }[verdict] ?? verdict;
  return limits.filter((limit) => limit.outcome === worst);
}
const mostUsed = (limits) => limits.reduce((a, b) => ((b.used ?? 0) > (a.used ?? 0) ? b : a), limits[0]);

function acceptance() {
  const { passed } = summary.acceptance, judged = summary.acceptance.verdict !== "", { yields } = summary;
  const level = passed === false || yields ? "poor" : passed ? "good" : judged ? "caution" : "open";
  const words = yields && !judged ? [yields] : yields && !verdict.includes(yields) ? [verdict, yields] : [verdict];
  const note = judged
    ? null
    : h("span.soft", yields ? " No limits are set." : " Set them under [limits] for a verdict.");
  return h("div", { class: `verdict ${level}`, id: "acceptance" }, h("p", h("b", words.map(sentence).join(" ")), note));
}

function limitsSection() {
  const limits = summary.acceptance.limits.filter(({ found }) => !summary.buckles || found.value !== null);
  if (!limits.length) return;
  const nearestFirst = [...limits].sort((a, b) => (b.used ?? Infinity) - (a.used ?? Infinity));
  section(
    "limits",
    "Limits",
    "Limits of the scene",
    longTable(nearestFirst, [
      {
        name: "Limit",
        text: (each) =>
          limitName(each) + (each.on ? (LIMIT_WORDS[each.kind] ? ` of ${each.on}` : ` (${each.on})`) : ""),
      },
      { name: "allowed", text: allowedWords },
      {
        name: "used",
        means: "figure over its upper limit, or lower limit over the figure",
        of: (each) => each.used ?? NaN,
        words: (each) => (each.used === null ? "–" : `${number(100 * each.used, 3)} %`),
        worst: true,
      },
      { name: "found", text: foundWords },
      { name: "where", text: (each) => [memberOf(each.found.label), atWords(each.found)].filter(Boolean).join(", ") },
      {
        name: "kept",
        text: (each) => ({ kept: "yes", "not kept": "no" }[each.outcome] ??
          [each.outcome, each.problem].filter(Boolean).join(": ")),
      },
    ], "Limits and figures"),
  );
}

const allowedWords = ({ least, limit }) => `${least ? "at least" : "at most"} ${figureAngle(limit)}`;
const limitName = (each) => LIMIT_WORDS[each.kind] ?? each.name;

function foundWords(each) {
  const { found } = each, key = each.figure ?? each.kind, { start, end } = summary.run;
  if (found.endless) {
    return key === "settling" ? `not settled within the run of ${quantity(end.value - start.value, "s")}` : "endless";
  }
  const error = errorWords(found);
  return besideWords(each) + (each.outcome === "kept" ? error.replace(" (unreliable)", "") : error);
}

// A time has the unit of its limit.
function besideWords({ found, limit }) {
  if (limit.unit !== "s" || found.value === null) return figureAngle(found);
  const [factor, unit] = scaleOf(limit.value, "s");
  return `${number(found.value * factor)} ${unit}`;
}

// Reliability of the figures.
function trustLine() {
  const [words, level] = trusted;
  return h(
    "div",
    { class: `verdict ${level}`, id: "trusted" },
    h("p", h("b", sentence(words)), " ", h("a", { href: "#trust" }, "Why?")),
  );
}

const PAPER_LETTERS = 125; // letters in a line of the print
// Assumptions and checks, shown only in print.
function handoutOnPaper() {
  if (!handout) return;
  const { assumptions, checked } = handout, lines = assumptions.map((words) => Math.ceil(words.length / PAPER_LETTERS));
  const rows = lines.reduce((all, one) => all + one, (summary.acceptance.limits ?? []).length);
  document.documentElement.style.setProperty("--paper-rows", String(rows)); // the picture takes the remaining height
  const list = h("ul", assumptions.map((words) => h("li", words)));
  $("main").append(h("div.paper.handout", h("h2", "Assumptions"), list, h("h2", "Checked"), h("p", checked)));
}

// Share of each link and joint in the error of the output.
function contributions() {
  const { output } = summary;
  if (!output?.shares?.length || !output.value) return;
  const ranked = [...output.shares].sort((a, b) => Math.abs(b.value) - Math.abs(a.value)),
    rows = ranked.filter((each) => Math.abs(each.value) > 1e-6 * Math.abs(output.value)),
    idle = ranked.filter((each) => !rows.includes(each));
  const sense = Math.sign(output.value);
  const bars = rows.map((each) => ({
    name: each.link,
    size: sense * each.value,
    words: `${figureAngle(each, 3)} (${number((100 * each.value) / output.value, 3)} %)`,
  }));
  const part = section(
    "causes",
    "Causes",
    "Links and joints that cause the error of the output",
    soft(
      `At the moment of the largest error${
        summary.theory.name !== "quasi-static" ? ", including forces of vibration" : ""
      }: contribution of the flexibility of each link and joint. The contributions add up to the total; a negative ` +
        "one offsets others." +
        (ranked.some(({ link }) => link === "others")
          ? " “others” are effects of no single link or joint: rotated links, thermal strain, gaps in joints."
          : ""),
    ),
    strips(bars),
    idle.length ? soft(`No contribution: ${idle.map((each) => each.link).join(", ")}.`) : null,
  );
  part.classList.add("shares");
}

function trustSection() {
  section(
    "trust",
    "Trust",
    "Can it be trusted?",
    soft(
      "Effects that the theory neglects, with their size in this scene. The verdict on the machine is at " +
        "the top of the page.",
    ),
    h(
      "ul.trust",
      summary.trust.map((finding) =>
        h(
          "li",
          h("span", { class: `level ${finding.level}` }, finding.level),
          h("p", h("b", `${finding.heading}. `), finding.text),
        )
      ),
    ),
    h(
      "p.soft",
      jargon(
        "Condition number",
        "growth of round-off at a position: 1 at best; 15 minus its power of ten digits are certain",
      ),
      ": how close a position is to a singular one, where the mechanism jams or changes its assembly. ",
    ),
    h("h3", "Not computed"),
    h("p", `${summary.not_computed.join("; ")}. Drives follow their coordinates exactly.`),
  );
}
