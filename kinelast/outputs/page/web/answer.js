// First screen: verdict, reliability, and the main figures.
const LIMIT_WORDS = {
  deflection: "deflection",
  chord: "deflection from chord",
  safety: "safety against yield",
  output: "error of the output",
};
const TRUST_WORDS = { good: "All figures are reliable", caution: "Use with caution", poor: "Not reliable" };
const CHORD = "the straight line through the displaced ends of the link: pure bending";

function agreement({ largest, momentum }) {
  const kept = Object.values(momentum).filter((balance) => balance.compared).map((balance) => balance.largest);
  const words = kept.length ? [`momentum of all masses to ${number(Math.max(...kept), 2)}`] : [];
  return (largest === null ? words : [`largest difference ${number(largest, 2)} of the maximum`, ...words]).join("; ");
}

// First screen: verdict, mechanism and deciding figures, then the other figures.
const DECIDING = 4;

function answerSection() {
  const part = section("answer", "Answer", "The answer", h("div", { class: "verdicts" }, acceptance(), trustLine()));
  const mechanism = mechanismSection(), [first, others] = [tiles().slice(0, DECIDING), tiles().slice(DECIDING)];
  $("main").append(
    h(
      "div",
      { class: "front" },
      part,
      h("div", { class: "tiles deciding" }, first),
      mechanism,
      h("div", { class: "tiles others" }, others),
    ),
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
    : h("span", { class: "soft" }, yields ? " No limits are set." : " Set them under [limits] for a verdict.");
  return h(
    "div",
    { class: `verdict ${level}`, id: "acceptance" },
    h("p", {}, h("b", {}, words.map(sentence).join(" ")), note),
  );
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
      { name: "allowed", text: (each) => `${each.least ? "at least" : "at most"} ${figureAngle(each.limit)}` },
      {
        name: "used",
        means: "figure over its upper limit, or lower limit over the figure",
        of: (each) => each.used ?? NaN,
        words: (each) => (each.used === null ? "–" : `${number(100 * each.used, 3)} %`),
        worst: true,
      },
      { name: "found", text: foundWords },
      { name: "where", text: (each) => [each.found.label, atWords(each.found)].filter(Boolean).join(", ") },
      { name: "kept", text: (each) => ({ kept: "yes", "not kept": "no" }[each.outcome] ?? each.outcome) },
    ], "Limits and figures"),
  );
}

const limitName = (each) => LIMIT_WORDS[each.kind] ?? each.name;

function foundWords(each) {
  const { kind, found } = each, { start, end } = summary.run;
  if (found.endless) {
    return kind === "settling"
      ? `not settled within the ${quantity(end.value - start.value, "s")} computed`
      : "endless";
  }
  return besideWords(each) + errorWords(each.outcome === "kept" ? { ...found, unreliable: false } : found);
}

// A time has the unit of its limit.
function besideWords({ found, limit }) {
  if (limit.unit !== "s" || found.value === null) return figureAngle(found);
  const [factor, unit] = scaleOf(limit.value, "s");
  return `${number(found.value * factor)} ${unit}`;
}

// Angles in degrees.
const figureAngle = (
  figure,
  digits = 4,
) => (figure.unit === "rad" && figure.value !== null
  ? `${number((figure.value * 180) / Math.PI, digits)}°`
  : figureWords(figure, digits));

function leastSafe() {
  const rows = Object.entries(summary.strength).filter(([, row]) => row.safety_factor.value !== null);
  const [label, row] = rows.sort((a, b) => a[1].safety_factor.value - b[1].safety_factor.value)[0] ?? [];
  return row && [summary.links.find((each) => each.label === label).member, row];
}

// Reliability of the figures. "Reliable" never stands above a doubtful figure or a link that yields.
function trustLine() {
  const { level, reasons } = summary.reliability,
    { one_position: single } = summary.run,
    doubted = doubtedFigures().join(", ");
  const [words, shown] = summary.buckles
    ? ["Only figures of the rigid motion are shown", "caution"]
    : level !== "good"
    ? [`${TRUST_WORDS[level]}: ${reasons.join(", ")}${doubted && `; unreliable: ${doubted}`}`, level]
    : summary.yields
    ? [`The figures assume elastic links${doubted && `; unreliable: ${doubted}`}`, "caution"]
    : single
    ? [`The figures hold at one position only${doubted && `; unreliable: ${doubted}`}`, "caution"]
    : doubted
    ? [`All figures are reliable except ${doubted}`, "caution"]
    : [TRUST_WORDS.good, level];
  return h(
    "div",
    { class: `verdict ${shown}`, id: "trusted" },
    h("p", {}, h("b", {}, `${words}.`), " ", h("a", { href: "#trust" }, "Why?")),
  );
}

const FEW_DOUBTED = 2; // figures that the line names
function doubtedFigures() {
  const of = (on) => (on ? ` of ${on}` : ""),
    unjudged = summary.acceptance.limits.filter((limit) =>
      limit.outcome === "cannot be judged" && !summary.run.one_position && !summary.yields
    );
  const large = summary.reliability.unreliable.map((each) =>
    `${each.name}${of(each.on)}${each.share === null ? "" : ` (± ${share(each.share)})`}`
  );
  const all = [
      ...new Set([...unjudged.map((limit) => limitName(limit) + of(limit.found.label || limit.on)), ...large]),
    ],
    more = all.length - FEW_DOUBTED;
  return more > 0 ? [...all.slice(0, FEW_DOUBTED), `${more} more`] : all;
}

function tile(heading, figure, words, { level = "", means = null, at = null } = {}) {
  const go = at && atWords(at)
    ? h("button", {
      type: "button",
      class: "go",
      "aria-label": `show ${heading}`,
      onclick: () => {
        stop();
        showPosition(positionOf(at));
        $("stage").scrollIntoView({ block: "nearest" });
      },
    }, "show")
    : null;
  const [value, error] = figure.split(" ±");
  return h(
    "div",
    { class: "tile" },
    h("h3", {}, means ? jargon(heading, means) : heading),
    h("b", { class: level }, h("span", { class: "value" }, value), error ? h("small", {}, ` ±${error}`) : null),
    h("span", {}, words, " ", go),
  );
}

function placeWords(label, figure) {
  const link = summary.links.find((each) => each.label === label);
  if (!figure?.along || figure.along.value === null || !link) return "";
  const way = figure.along.value / link.length.value;
  return way < 5e-4
    ? `at ${link.from}`
    : way > 1 - 5e-4
    ? `at ${link.to}`
    : `${figureWords(figure.along, 3)} from ${link.from}`;
}

// Error as a suffix of its figure, relative, or absolute if it exceeds the figure. As kinelast/outputs/words.py does
// it.
/** @param {any} figure */
function errorWords(figure) {
  const { value, unit, error, error_unknown: unknown, error_measured: measured, unreliable } = figure ?? {};
  if (error === null && unknown && value !== null) return " (error unknown)";
  if (value === null || value === undefined) return "";
  const size = error
    ? ` ± ${error <= Math.abs(value) ? errorShare(error / Math.abs(value)) : figureAngle({ value: error, unit }, 2)}${
      measured ? " measured" : ""
    }`
    : "";
  return size + unreliableMark({ unreliable });
}

const share = (part) => `${number(100 * part, 2)} %`;
const errorShare = (part) => (part < 1e-4 ? "< 0.01 %" : share(part)); // LEAST_TOLD of kinelast/scene/numbers.py

// Tiles in this order: limit, stress and safety, output, drive, others.
function tiles() {
  const { largest_chord: bent, largest_deflection: moved, output, drives, shaking, vibration, check, theory } = summary;
  const { nonlinear_check: nonlinear } = summary;
  const where = (figure) =>
    [figure.member ?? figure.label, placeWords(figure.label, figure), atWords(figure)].filter(Boolean).join(", ");
  const driven = Object.entries(drives).map(([name, drive]) => driveTile(name, drive));
  const shown = [decidingTile(), stressTile(where)];
  if (output && suited) {
    const kind = { point: "point", slide: "slide of", angle: "angle of" }[output.kind];
    const words = `${kind} ${output.name}, ${atWords(output)}${output.guessed ? "; chosen automatically" : ""}`;
    const means = `distance or angle between the output of the elastic links and that of rigid links${
      output.guessed ? "; output under [run] chooses another output" : ""
    }`;
    shown.push(tile("Error of the output", figureAngle(output) + errorWords(output), words, { means, at: output }));
  }
  shown.push(...driven.slice(0, 1));
  if (bent) {
    shown.push(
      tile("Bends most", quantity(Math.abs(bent.value), bent.unit) + errorWords(bent), where(bent), {
        means: `largest deflection from ${CHORD}`,
        at: bent,
      }),
    );
  }
  if (moved) {
    shown.push(
      tile("Displaced most", quantity(Math.abs(moved.value), moved.unit) + errorWords(moved), where(moved), {
        means: "largest deflection from the position of a rigid link, also by the deflection of other links",
        at: moved,
      }),
    );
  }
  shown.push(...driven.slice(1, 2));
  shown.push(
    tile("Shaking force", figureWords(shaking.force) + errorWords(shaking.force), atWords(shaking.force), {
      means: "resultant force of the mechanism on the ground",
      at: shaking.force,
    }),
  );
  const lowest = vibration?.natural[0]?.lowest;
  if (lowest) {
    const ratio = vibration.drive_to_lowest.value;
    shown.push(
      tile(
        "Lowest natural frequency",
        `${number(lowest.value / (2 * Math.PI))} Hz`,
        [ratio ? `${number(1 / ratio, 3)} times the drive's speed` : "", atWords(lowest)].filter(Boolean).join(", "),
        { at: lowest },
      ),
    );
  }
  if (theory.error !== null) {
    const vibrates = theory.name === "quasi-static" || theory.without_vibration === null
      ? ""
      : `; vibration changes the figures by up to ${share(theory.without_vibration)}`;
    shown.push(
      tile(
        "Accuracy",
        `± ${errorShare(theory.error)}`,
        `${summary.links.length ? `${theory.name} theory` : "rigid links"}${
          theory.figure ? `; largest error: ${theory.figure}` : ""
        }${vibrates}`,
        {
          level: theory.error > summary.limits.vibration.beyond
            ? "poor"
            : theory.error > (theory.accuracy ?? theory.expected)
            ? "caution"
            : "good",
          means: "largest error among the main figures: deflection, stress, output, and the figures of limits",
        },
      ),
    );
  }
  if (nonlinear) {
    const [value, note, level] = nonlinear.problem
      ? ["cannot be made", nonlinear.problem, "caution"]
      : nonlinear.cannot_tell
      ? ["cannot tell", "the stated error is larger than the answer", "caution"]
      : nonlinear.too_close_to_decide
      ? [
        "too close to decide",
        `difference ${share(nonlinear.largest)}, stated error ${share(nonlinear.estimate)}, error of the check up to ${
          share(nonlinear.own_errors.mesh + nonlinear.own_errors.step)
        }`,
        "caution",
      ]
      : nonlinear.passed === false
      ? ["differs", `difference ${share(nonlinear.largest)}, stated error ${share(nonlinear.estimate)}`, "poor"]
      : [
        `${share(nonlinear.largest)} apart`,
        `finite elements with vibration and large displacements, ${nonlinear.elements} per beam`,
        "good",
      ];
    shown.push(
      tile("Nonlinear check", value, note, {
        level,
        means: "the whole mechanism solved again by an independent method",
      }),
    );
  }
  const nothing = check && check.passed === null;
  shown.push(
    tile(
      "Finite element check",
      !check ? "not made" : nothing ? "nothing to compare" : check.passed ? "agrees" : "differs",
      !check ? "run with --check" : nothing ? "" : agreement(check),
      {
        level: !check || nothing ? "open" : check.passed ? "good" : "poor",
        means: "the deflection solved again by independent finite elements",
      },
    ),
  );
  return shown.filter(Boolean);
}

// The deciding limit and its used share. Without limits: the link with the smallest reserve.
function decidingTile() {
  const { limits } = summary.acceptance,
    limit = summary.buckles ? null : mostUsed(decidingLimits()) ?? mostUsed(limits),
    [first] = summary.breaks_first;
  if (limit) {
    const { found, least, on, used, outcome } = limit, of = found.label || on;
    const level = { kept: "good", "not kept": "poor" }[outcome] ?? "caution";
    const words = [`${least ? "minimum" : "limit"} ${figureAngle(limit.limit)}`, of, found.drive ? atWords(found) : ""];
    const share = used === null ? null : h("b", {}, `${number(100 * used, 3)} % used`);
    return tile(
      `${outcome === "kept" ? "Closest to its limit" : "Deciding limit"}: ${limitName(limit)}`,
      foundWords(limit),
      [share, share ? "; " : "", words.filter(Boolean).join(", ")],
      { level, at: found.drive ? found : null },
    );
  }
  if (!first) return null;
  const { link, governs, reserve } = first,
    level = reserve.value < 1 ? "poor" : reserve.value < 1.5 ? "caution" : "good";
  const means = "factor by which the load may grow until the first link yields, breaks, buckles or exceeds its limit";
  const where = whereWords(spotOf(governs, reserve));
  return tile(`Breaks first: ${link}`, `reserve ${reserveWords(reserve)}`, `${MODES[governs]}, ${where}`, {
    level,
    means,
  });
}

function stressTile(where) {
  const { largest_stress: strained } = summary, least = leastSafe();
  if (!strained) return null;
  const [material = "NAME"] = Object.keys(summary.inputs.materials), safety = least?.[1].safety_factor;
  const level = !least ? "open" : safety.value < 1 ? "poor" : safety.value < 1.5 ? "caution" : "good";
  const words = least
    ? [
      `safety ${number(safety.value, 3)}${errorWords(safety)}`,
      ` (${least[0]}, yield stress ${figureWords(least[1].yield_stress, 3)}); `,
    ]
    : ["safety not known", `: add a yield stress, as in yield = "355 MPa" under [materials.${material}]; `];
  const means = "largest von Mises stress, and smallest ratio of yield stress to stress";
  return tile("Stress and safety", figureWords(strained) + errorWords(strained), [
    h("b", { class: level }, words[0]),
    words[1],
    where(strained),
  ], { means, at: strained });
}

function driveTile(name, { effort, rms, power }) {
  const words = [
    atWords(effort),
    rms && `rms ${figureWords(rms)}${unreliableMark(rms)}`,
    power && `peak power ${figureWords(power)}${unreliableMark(power)}${power.value ? ` at ${atWords(power)}` : ""}`,
  ];
  return tile(`Drive of ${name}`, figureWords(effort) + errorWords(effort), words.filter(Boolean).join("; "), {
    at: effort,
  });
}

// Assumptions and checks, shown only in print.
function handoutOnPaper() {
  if (!handout) return;
  const { assumptions, checked } = handout;
  const list = h("ul", {}, assumptions.map((words) => h("li", {}, words)));
  $("main").append(
    h("div", { class: "paper handout" }, h("h2", {}, "Assumptions"), list, h("h2", {}, "Checked"), h("p", {}, checked)),
  );
}

// Share of each link in the error of the output.
function contributions() {
  const { output } = summary;
  if (!output?.shares?.length || !output.value) return;
  const ranked = [...output.shares].sort((a, b) => Math.abs(b.value) - Math.abs(a.value)),
    rows = ranked.filter((each) => Math.abs(each.value) > 1e-6 * Math.abs(output.value)),
    idle = ranked.filter((each) => !rows.includes(each));
  const most = Math.max(...rows.map((each) => Math.abs(each.value)), 1e-300);
  const part = section(
    "causes",
    "Causes",
    "Links that cause the error of the output",
    soft(
      `At the moment of the largest error${
        summary.theory.name !== "quasi-static" ? ", including forces of vibration" : ""
      }: contribution of each link's own flexibility. The contributions add up to the total; a negative ` +
        "one offsets others.",
    ),
    h(
      "ul",
      {},
      rows.map((each) =>
        h(
          "li",
          {},
          h("span", {}, each.link),
          h(
            "span",
            { class: "strip", "aria-hidden": "true" },
            h("i", {
              style: `width:${(100 * Math.abs(each.value)) / most}%`,
              class: each.value * output.value < 0 ? "less" : "",
            }),
          ),
          h("span", {}, `${figureAngle(each, 3)} (${number((100 * each.value) / output.value, 3)} %)`),
        )
      ),
    ),
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
      "ul",
      { class: "trust" },
      summary.trust.map((finding) =>
        h(
          "li",
          {},
          h("span", { class: `level ${finding.level}` }, finding.level),
          h("p", {}, h("b", {}, `${finding.heading}. `), finding.text),
        )
      ),
    ),
    h(
      "p",
      { class: "soft" },
      jargon(
        "Condition number",
        "growth of round-off at a position: 1 at best; 15 minus its power of ten digits are certain",
      ),
      ": how close a position is to a singular one, where the mechanism jams or changes its assembly. ",
    ),
    h("h3", {}, "Not computed"),
    h("p", {}, `${summary.not_computed.join("; ")}. Drives follow their coordinates exactly.`),
  );
}
