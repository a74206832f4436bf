// The answer on top: acceptable or not, how far to trust it, and the figures that a reader looks for first.
const LIMIT_WORDS = { deflection: "deflection", chord: "deflection from chord", safety: "safety against yield", output: "error of the output" };
const TRUST_WORDS = { good: "All figures are reliable", caution: "Use with caution", poor: "Not reliable" };
const CHORD = "the straight line through the link's own displaced ends: what is left is bending alone";

function agreement({ largest, momentum }) {
  const kept = Object.values(momentum).filter((balance) => balance.compared).map((balance) => balance.largest);
  const words = kept.length ? [`momentum of all masses to ${number(Math.max(...kept), 2)}`] : [];
  return (largest === null ? words : [`largest difference ${number(largest, 2)} of the maximum`, ...words]).join("; ");
}

// The first screen: the verdict, the mechanism, the figures that decide; the other figures stand behind them.
const DECIDING = 4;

function answerSection() {
  const part = section("answer", "Answer", "The answer", h("div", { class: "verdicts" }, acceptance(), trustLine()));
  const mechanism = mechanismSection(), [first, others] = [tiles().slice(0, DECIDING), tiles().slice(DECIDING)];
  $("main").append(
    h("div", { class: "front" }, part, h("div", { class: "tiles deciding" }, first), mechanism,
      h("div", { class: "tiles others" }, others)),
    document.querySelector("nav"),
  );
  view.fit();
  limitsSection();
  breaksFirst();
  handoutOnPaper();
}

// The limits of the worst outcome.
function decidingLimits() {
  if (summary.buckles) return [];
  const { verdict, limits } = summary.acceptance, worst = { "not acceptable": "not kept" }[verdict] ?? verdict;
  return limits.filter((limit) => limit.outcome === worst);
}
const mostUsed = (limits) => limits.reduce((a, b) => ((b.used ?? 0) > (a.used ?? 0) ? b : a), limits[0]);

const FEW_LIMITS = 2; // that the verdict names
function fewWords(limits) {
  const more = limits.length - FEW_LIMITS;
  const named = limits.slice(0, more > 0 ? FEW_LIMITS : limits.length).map(limitWords).join("; ");
  return more > 0 ? `${named}; and ${more} more` : named;
}

function acceptance() {
  const { verdict, passed, limits, problem } = summary.acceptance, deciding = decidingLimits();
  const nearest = mostUsed(limits);
  const weak = deciding.length ? "" : yielding();
  const level = passed === false || weak ? "poor" : passed ? "good" : verdict ? "caution" : "open";
  const words = passed ? `Acceptable: ${limits.length === 1 ? "the limit of the scene is" : `all ${limits.length} limits of the scene are`} kept${limits.length > 1 ? `; the nearest: ${limitWords(nearest)}` : ""}.${weak && ` But ${weak}`}` : weak ? weak : verdict ? `${verdict[0].toUpperCase()}${verdict.slice(1)}: ${[fewWords(deciding), problem].filter(Boolean).join(": ")}.` : "No limits are set.";
  const note = !verdict && !weak ? h("span", { class: "soft" }, " A scene may set them under [limits], and the answer will be yes or no.") : null;
  return h("div", { class: `verdict ${level}`, id: "acceptance" }, h("p", {}, h("b", {}, words), note));
}

function limitsSection() {
  const { limits } = summary.acceptance;
  if (!limits.length) return;
  const nearestFirst = [...limits].sort((a, b) => (b.used ?? Infinity) - (a.used ?? Infinity));
  section("limits", "Limits", "Limits of the scene", longTable(nearestFirst, [
    { name: "Limit", text: (each) => limitName(each) + (each.on ? (LIMIT_WORDS[each.kind] ? ` of ${each.on}` : ` (${each.on})`) : "") },
    { name: "allowed", text: (each) => `${each.least ? "at least" : "at most"} ${figureAngle(each.limit)}` },
    { name: "used", means: "share of the limit that is used up: the figure over what is allowed, or what is asked over the figure", of: (each) => each.used ?? NaN, words: (each) => (each.used === null ? "–" : `${number(100 * each.used, 3)} %`), worst: true },
    { name: "found", text: foundWords },
    { name: "where", text: (each) => [each.found.label, atWords(each.found)].filter(Boolean).join(", ") },
    { name: "kept", text: (each) => ({ kept: "yes", "not kept": "no" }[each.outcome] ?? each.outcome) },
  ], "Each with what was found"));
}

const limitName = (each) => LIMIT_WORDS[each.kind] ?? each.name;

function limitWords(each) {
  const { least, on, limit, found } = each;
  const of = found.label || on, name = `${limitName(each)}${of ? ` of ${of}` : ""}`;
  if (found.value === null && !found.endless) return `${name} cannot be judged: there is no figure`;
  return `${name} is ${foundWords(each)}, ${least ? "at least" : "at most"} ${figureAngle(limit)} allowed`;
}

function foundWords(each) {
  const { kind, found } = each, { start, end } = summary.run;
  if (found.endless) return kind === "settling" ? `not settled within the ${quantity(end.value - start.value, "s")} computed` : "endless";
  return besideWords(each) + errorWords(found);
}

// A time is told in the unit of its limit.
function besideWords({ found, limit }) {
  if (limit.unit !== "s" || found.value === null) return figureAngle(found);
  const [factor, unit] = scaleOf(limit.value, "s");
  return `${number(found.value * factor)} ${unit}`;
}

// Angles as degrees where a reader compares them.
const figureAngle = (figure, digits = 4) => (figure.unit === "rad" && figure.value !== null ? `${number((figure.value * 180) / Math.PI, digits)}°` : figureWords(figure, digits));

function leastSafe() {
  const rows = Object.entries(summary.strength).filter(([, row]) => row.safety_factor.value !== null);
  const [label, row] = rows.sort((a, b) => a[1].safety_factor.value - b[1].safety_factor.value)[0] ?? [];
  return row && [summary.links.find((each) => each.label === label).member, row];
}

function yielding() {
  const least = leastSafe();
  return least && least[1].safety_factor.value < 1 ? `${least[0]} yields: safety ${number(least[1].safety_factor.value, 3)}.` : "";
}

// How far to trust the figures; "reliable" never stands beside a figure that is in doubt, or a link that yields.
function trustLine() {
  const { level, reasons } = summary.reliability, doubted = doubtedFigures().join(", ");
  const besides = doubted && `; unreliable: ${doubted}`;
  const [words, shown] = level !== "good" ? [`${TRUST_WORDS[level]}: ${reasons.join(", ")}${besides}`, level]
    : yielding() ? [`Reliable only below yield: every link is taken as elastic${besides}`, "caution"]
    : doubted ? [`Reliable except: ${doubted}`, "caution"]
    : [TRUST_WORDS.good, level];
  return h("div", { class: `verdict ${shown}`, id: "trusted" }, h("p", {}, h("b", {}, `${words}.`), " ", h("a", { href: "#trust" }, "Why?")));
}

const FEW_DOUBTED = 2; // that the line names
function doubtedFigures() {
  const of = (on) => (on ? ` of ${on}` : ""), unjudged = summary.acceptance.limits.filter((limit) => limit.outcome === "cannot be judged");
  const large = summary.reliability.unreliable.map((each) => `${each.name} (${each.on ? `${each.on}: ` : ""}± ${share(each.share)})`);
  const all = [...unjudged.map((limit) => limitName(limit) + of(limit.found.label || limit.on)), ...large], more = all.length - FEW_DOUBTED;
  return more > 0 ? [...all.slice(0, FEW_DOUBTED), `${more} more`] : all;
}

function tile(heading, figure, words, { level = "", means = null, at = null } = {}) {
  const go = at && at.value !== null ? h("button", { type: "button", class: "go", "aria-label": `show ${heading}`, onclick: () => { stop(); showPosition(positionOf(at)); $("stage").scrollIntoView({ block: "nearest" }); } }, "show") : null;
  const [value, error] = figure.split(" ±");
  return h("div", { class: "tile" }, h("h3", {}, means ? jargon(heading, means) : heading), h("b", { class: level }, h("span", { class: "value" }, value), error ? h("small", {}, ` ±${error}`) : null), h("span", {}, words, " ", go));
}

function placeWords(label, figure) {
  const link = summary.links.find((each) => each.label === label);
  if (!figure?.along || figure.along.value === null || !link) return "";
  const way = figure.along.value / link.length.value;
  return way < 5e-4 ? `at ${link.from}` : way > 1 - 5e-4 ? `at ${link.to}` : `${figureWords(figure.along, 3)} from ${link.from}`;
}

const ROUND_OFF = 1e-12; // share below which an error is not told

// The error of a figure behind it, as a share of it.
function errorWords(figure) {
  if (figure?.error === undefined || figure.error === 0 || figure.value === null || !figure.value || Math.abs(figure.error / figure.value) < ROUND_OFF) return "";
  return figure.error === null ? (figure.error_unknown ? " (error unknown)" : "") : ` ± ${errorShare(Math.abs(figure.error / figure.value))}${figure.error_measured ? " measured" : ""}${Math.abs(figure.error / figure.value) > UNRELIABLE ? " (unreliable)" : ""}`;
}

const share = (part) => `${number(100 * part, 2)} %`;
const UNRELIABLE = 0.25; // of kinelast/scene/numbers.py
const errorShare = (part) => (part < 1e-4 ? "< 0.01 %" : share(part));  // LEAST_TOLD of kinelast/scene/numbers.py

// The figures that decide, in their order: the limit, stress and safety, the output, the drive; then the others.
function tiles() {
  const { largest_chord: bent, largest_deflection: moved, output, drives, shaking, vibration, check, theory } = summary;
  const { nonlinear_check: nonlinear } = summary;
  const where = (figure) => [figure.member ?? figure.label, placeWords(figure.label, figure), atWords(figure)].filter(Boolean).join(", ");
  const driven = Object.entries(drives).map(([name, drive]) => driveTile(name, drive));
  const shown = [decidingTile(), stressTile(where)];
  if (output && suited) {
    const kind = { point: "point", slide: "slide of", angle: "angle of" }[output.kind];
    const words = `${kind} ${output.name}${output.guessed ? " (guessed: [run] output names it)" : ""}, ${atWords(output)}`;
    const means = "how far the elastic mechanism puts its output from where rigid links would";
    shown.push(tile("Error of the output", figureAngle(output) + errorWords(output), words, { means, at: output }));
  }
  shown.push(...driven.slice(0, 1));
  if (bent) shown.push(tile("Bends most", quantity(Math.abs(bent.value), bent.unit) + errorWords(bent), where(bent), { means: `largest deflection from ${CHORD}`, at: bent }));
  if (moved) shown.push(tile("Displaced most", quantity(Math.abs(moved.value), moved.unit) + errorWords(moved), where(moved), { means: "largest deflection from where a rigid link would be, whatever carries it there", at: moved }));
  shown.push(...driven.slice(1, 2));
  shown.push(tile("Shaking force", figureWords(shaking.force) + errorWords(shaking.force), atWords(shaking.force), { means: "what the moving mechanism does to its ground", at: shaking.force }));
  const lowest = vibration?.natural[0]?.lowest;
  if (lowest) {
    const ratio = vibration.drive_to_lowest.value;
    shown.push(tile("Lowest natural frequency", `${number(lowest.value / (2 * Math.PI))} Hz`, [ratio ? `${number(1 / ratio, 3)} times the drive's speed` : "", atWords(lowest)].filter(Boolean).join(", "), { at: lowest }));
  }
  if (theory.error !== null) {
    const besides = theory.name === "quasi-static" || theory.without_vibration === null ? "" : `without vibration ${share(theory.without_vibration)} off`;
    shown.push(tile("How far off", `within ${share(Math.max(theory.error, 1e-4))}`, [theory.name, theory.figure ? `worst is the ${theory.figure}` : "", besides].filter(Boolean).join(", "), { level: theory.error > summary.limits.vibration.beyond ? "poor" : theory.error > (theory.accuracy ?? theory.expected) ? "caution" : "good", means: "error of the worst of the figures that are read: the largest deflection and stress, the output, and what limits judge" }));
  }
  if (nonlinear) {
    const [value, note, level] = nonlinear.problem ? ["cannot be made", nonlinear.problem, "caution"]
      : nonlinear.cannot_tell ? ["cannot tell", "the stated error is larger than the answer", "caution"]
      : nonlinear.too_close_to_decide ? ["too close to decide", `${share(nonlinear.largest)} apart where ${share(nonlinear.estimate)} is said; the check itself may be ${share(nonlinear.own_errors.mesh + nonlinear.own_errors.step)} off`, "caution"]
      : nonlinear.passed === false ? ["differs", `${share(nonlinear.largest)} apart where ${share(nonlinear.estimate)} is said`, "poor"]
      : [`${share(nonlinear.largest)} apart`, `finite elements that vibrate and move as far as they will, ${nonlinear.elements} a beam`, "good"];
    shown.push(tile("Nonlinear check", value, note, { level, means: "the whole mechanism solved once more from its geometry and masses alone" }));
  }
  const nothing = check && check.passed === null;
  shown.push(tile("Finite element check", !check ? "not made" : nothing ? "nothing to compare" : check.passed ? "agrees" : "differs", !check ? "ask for it by --check" : nothing ? "" : agreement(check), { level: !check || nothing ? "open" : check.passed ? "good" : "poor", means: "the same question answered by an independent program" }));
  return shown.filter(Boolean);
}

// The limit that decides and how much of it is used; where none is set, the link with the least reserve.
function decidingTile() {
  const { limits } = summary.acceptance, limit = summary.buckles ? null : mostUsed(decidingLimits()) ?? mostUsed(limits), [first] = summary.breaks_first;
  if (limit) {
    const { found, least, on, used, outcome } = limit, of = found.label || on;
    const level = { kept: "good", "not kept": "poor" }[outcome] ?? "caution";
    const words = [`${least ? "at least" : "at most"} ${figureAngle(limit.limit)} allowed`, of, found.drive ? atWords(found) : ""];
    const share = used === null ? null : h("b", {}, `${number(100 * used, 3)} % used`);
    return tile(`Decides: ${limitName(limit)}`, foundWords(limit), [share, share ? "; " : "", words.filter(Boolean).join(", ")], { level, at: found.drive ? found : null });
  }
  if (!first) return null;
  const { link, governs, reserve } = first, level = reserve.value < 1 ? "poor" : reserve.value < 1.5 ? "caution" : "good";
  const means = "the factor that is left until the first link yields, breaks, buckles or passes its limit";
  const where = whereWords(spotOf(governs, reserve));
  return tile(`Breaks first: ${link}`, `reserve ${reserveWords(reserve)}`, `${MODES[governs]}, ${where}`, { level, means });
}

function stressTile(where) {
  const { largest_stress: strained } = summary, least = leastSafe();
  if (!strained) return null;
  const [material = "NAME"] = Object.keys(summary.inputs.materials), safety = least?.[1].safety_factor;
  const level = !least ? "open" : safety.value < 1 ? "poor" : safety.value < 1.5 ? "caution" : "good";
  const words = least
    ? [`safety ${number(safety.value, 3)}${errorWords(safety)}`, ` (${least[0]}, yield stress ${figureWords(least[1].yield_stress, 3)}); `]
    : ["safety not known", `: no material tells its yield stress, as in yield = "355 MPa" under [materials.${material}]; `];
  const means = "von Mises stress, and the yield stress over it where that is least";
  return tile("Stress and safety", figureWords(strained) + errorWords(strained), [h("b", { class: level }, words[0]), words[1], where(strained)], { means, at: strained });
}

function driveTile(name, { effort, rms, power }) {
  const words = [rms ? `rms ${figureWords(rms)}` : "", power ? `peak power ${figureWords({ ...power, value: power.value && Math.abs(power.value) })}` : "", atWords(effort)];
  return tile(`Drive of ${name}`, figureWords(effort) + errorWords(effort), words.filter(Boolean).join(", "), { at: effort });
}

// On paper alone, for who gets one page: what was assumed, and how it was checked.
function handoutOnPaper() {
  if (!handout) return;
  const { assumptions, checked } = handout;
  const list = h("ul", {}, assumptions.map((words) => h("li", {}, words)));
  $("main").append(h("div", { class: "paper handout" }, h("h2", {}, "Assumptions"), list, h("h2", {}, "Checked"), h("p", {}, checked)));
}

// How much of the output's error every link causes.
function contributions() {
  const { output } = summary;
  if (!output?.shares?.length || !output.value) return;
  const ranked = [...output.shares].sort((a, b) => Math.abs(b.value) - Math.abs(a.value)), rows = ranked.filter((each) => Math.abs(each.value) > 1e-6 * Math.abs(output.value)), idle = ranked.filter((each) => !rows.includes(each));
  const most = Math.max(...rows.map((each) => Math.abs(each.value)), 1e-300);
  const part = section("causes", "Causes", "Who causes the error of the output", soft(`At the instant where it is largest${summary.theory.name !== "quasi-static" ? ", under the forces there, those of the vibration among them" : ""}: what every link's own giving way adds; together they are the whole. A negative part makes up for others.`),
    h("ul", {}, rows.map((each) => h("li", {}, h("span", {}, each.link), h("span", { class: "strip", "aria-hidden": "true" }, h("i", { style: `width:${(100 * Math.abs(each.value)) / most}%`, class: each.value * output.value < 0 ? "less" : "" })), h("span", {}, `${figureAngle(each, 3)} (${number((100 * each.value) / output.value, 3)} %)`)))), idle.length ? soft(`Nothing by ${idle.map((each) => each.link).join(", ")}.`) : null);
  part.classList.add("shares");
}

function trustSection() {
  section("trust", "Trust", "Can it be trusted?", soft("What the theory leaves out, sized for this scene. Whether the machine is good enough is another question, answered on top."),
    h("ul", { class: "trust" }, summary.trust.map((finding) => h("li", {}, h("span", { class: `level ${finding.level}` }, finding.level), h("p", {}, h("b", {}, `${finding.heading}. `), finding.text)))),
    h("p", { class: "soft" }, jargon("Condition number", "by how much round-off grows at a position: 1 at best; about 15 minus its power of ten digits are left"), " tells how near a position is to a singular one, where the mechanism jams or loses its way. "),
    h("h3", {}, "What was not computed"), h("p", {}, `${summary.not_computed.join("; ")}. The drives hold their coordinates exactly.`));
}
