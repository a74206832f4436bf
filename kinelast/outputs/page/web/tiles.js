// Tiles of the main figures.
const CHORD = "the straight line through the displaced ends of the link: pure bending";

// Tiles in this order: limit, stress and safety, output, drive, others.
function tiles() {
  const { largest_chord: bent, largest_deflection: moved, output, drives, shaking, vibration, check, theory } = summary;
  const { nonlinear_check: nonlinear } = summary;
  const where = (figure) =>
    [memberOf(figure.label), placeWords(figure.label, figure), atWords(figure)].filter(Boolean).join(", ");
  const driven = Object.entries(drives).map(([name, drive]) => driveTile(name, drive));
  const shown = [decidingTile(), limitSpeedTile(), stressTile(where)];
  if (output && suited) {
    const kind = { point: "point", slide: "slide of", angle: "angle of" }[output.kind];
    const place = [`${kind} ${output.name}`, atWords(output)].filter(Boolean).join(", ");
    const lags = (output.lags ?? []).map((lag) => figureAngle({ ...lag, value: Math.abs(lag.value) })).join(", ");
    const words = `${place}${output.guessed ? "; chosen automatically" : ""}${
      lags ? `; the drive lags behind its cam by ${lags}, not included` : ""
    }`;
    const means =
      `distance or angle between the output of the elastic links and that of rigid links with the same drive motion${
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
      tile(
        "Displaced most across a link",
        quantity(Math.abs(moved.value), moved.unit) + errorWords(moved),
        where(moved),
        { means: "largest displacement across a link from its place with rigid links, also by other links", at: moved },
      ),
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
        `${number(lowest.value / (2 * Math.PI))} Hz${errorWords(lowest)}`,
        [ratio ? `${number(1 / ratio, 3)} times the drive's speed` : "", atWords(lowest)].filter(Boolean).join(", "),
        { at: lowest },
      ),
    );
  }
  if (theory.error !== null) {
    const vibrates = theory.name === "quasi-static" || theory.without_vibration === null
      ? ""
      : `; vibration changes the main deflections, stresses and forces by up to ${share(theory.without_vibration)}`;
    shown.push(
      tile(
        "Accuracy of deflection, stress, output and limits",
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
    const { found, least, on, used, outcome } = limit, of = memberOf(found.label) || on;
    const level = { kept: "good", "not kept": "poor" }[outcome] ?? "caution";
    const words = [`${least ? "minimum" : "limit"} ${figureAngle(limit.limit)}`, of, found.drive ? atWords(found) : ""];
    const share = used === null ? null : h("b", `${number(100 * used, 3)} % used`);
    return tile(
      `${outcome === "kept" ? "Closest to its limit" : "Deciding limit"}: ${limitName(limit)}`,
      foundWords(limit),
      [
        share,
        share ? "; " : "",
        outcome === "cannot be judged" ? `${outcome}; ` : "",
        words.filter(Boolean).join(", "),
      ],
      { level, at: found.drive ? found : null },
    );
  }
  if (!first) return null;
  const { link, governs, reserve } = first,
    level = reserve.value < 1 ? "poor" : reserve.value < 1.5 ? "caution" : "good";
  const means = "factor by which the load may grow until the first link yields, breaks, buckles or exceeds its limit";
  const where = whereWords(spotOf(governs, reserve));
  return tile(
    `Breaks first: ${link}`,
    `reserve ${reserveWords(reserve).replace("more than", ">")}`,
    [modeName(governs), where].filter(Boolean).join(", "),
    { level, means },
  );
}

// Limit speed of a study of speeds.
function limitSpeedTile() {
  const { highest_within_limits: highest = null, outcome, unit } = summary.speeds ?? {};
  if (highest === null) return null;
  const means = "highest speed of the drive up to which all limits hold and no link yields";
  return tile("Limit speed", highest ? quantity(highest, unit) : "none", outcome, {
    level: highest ? "" : "poor",
    means,
  });
}

function stressTile(where) {
  const { largest_stress: strained } = summary, least = leastSafe();
  if (!strained) return null;
  const [material = "NAME"] = Object.keys(summary.inputs.materials), safety = least?.[1].safety_factor;
  const limit = summary.acceptance.limits.find(({ kind }) => kind === "safety");
  const byValue = !least ? "open" : safety.value < 1 ? "poor" : safety.value < 1.5 ? "caution" : "good";
  const level = limit ? { kept: "good", "not kept": "poor" }[limit.outcome] ?? "caution" : byValue;
  const words = least
    ? [
      `least safety ${number(safety.value, 3)}${errorWords(safety)}`,
      `: ${least[0]}, yield ${figureWords(least[1].yield_stress, 3)}`,
    ]
    : ["safety not known", `: add a yield stress, as in yield = "355 MPa" under [materials.${material}]`];
  const means = "largest von Mises stress, and smallest ratio of yield stress to stress";
  return tile("Stress and safety", figureWords(strained) + errorWords(strained), [
    `${where(strained)}; `,
    h("b", { class: level }, words[0]),
    words[1],
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

function leastSafe() {
  const rows = Object.entries(summary.strength).filter(([, row]) => row.safety_factor.value !== null);
  const [label, row] = rows.sort((a, b) => a[1].safety_factor.value - b[1].safety_factor.value)[0] ?? [];
  return row && [memberOf(label), row];
}

function tile(heading, figure, words, { level = "", means = null, at = null } = {}) {
  const go = at && atWords(at)
    ? button("show", () => {
      stop();
      showPosition(positionOf(at));
      $("stage").scrollIntoView({ block: "nearest" });
    }, { class: "go", "aria-label": `show ${heading}` })
    : null;
  const [value, error] = figure.split(" ±");
  return h(
    "div.tile",
    h("h3", means ? jargon(heading, means) : heading),
    h("b", { class: level }, h("span.value", value), error ? h("small", ` ±${error}`) : null),
    h("span", words, " ", go),
  );
}

// Name of a beam in sentences: its member, a straight run of beams. Other labels are returned as they are.
const memberOf = (label) => summary.links.find((each) => each.label === label)?.member ?? label;

// Name of a beam in tables and choices. Other labels are returned as they are.
const beamName = (label) => summary.links.find((each) => each.label === label)?.name ?? label;

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
