// Tiles of the main figures.
const MOST_DRIVES = 3; // largest number of drives with a tile, those with the largest peak power
const CHORD = "the straight line through the displaced ends of the link: pure bending";

// Tiles in this order: limit, stress and safety, output, drive, others.
function tiles() {
  const { largest_chord: bent, largest_deflection: moved, output, drives, shaking, vibration, check, theory } = summary;
  const { nonlinear_check: nonlinear } = summary;
  const where = (figure) =>
    [memberOf(figure.label), placeWords(figure.label, figure), atWords(figure)].filter(Boolean).join(", ");
  const peakPower = ([, { power }]) => Math.abs(power?.value ?? 0);
  const [mainDrive, ...otherDrives] = Object.entries(drives).sort((one, other) => peakPower(other) - peakPower(one))
    .slice(0, MOST_DRIVES)
    .map(([name, drive]) => driveTile(name, drive));
  const shown = [decidingTile(), limitSpeedTile(), stressTile(where)];
  if (output && suited) {
    const kind = { point: "point", slide: "slide of", angle: "angle of" }[output.kind];
    const at = output.point ? ` at ${output.point}` : "";
    const place = [`${kind} ${output.name}${at}`, atWords(output)].filter(Boolean).join(", ");
    const lags = (output.lags ?? []).map((lag) => ({ ...lag, value: Math.abs(lag.value) }));
    const lagging = lags.map((lag) => figureAngle(lag)).join(", ");
    const play = summary.figures.clearance_worst;
    const words = `${place}${output.guessed ? "; chosen automatically" : ""}${
      lagging ? `; the drive lags behind its cam by ${lagging}, not included` : ""
    }${play?.value ? `; clearance of the joints adds up to ${figureAngle(play)}, not included` : ""}`;
    const means =
      `distance or angle between the output of the elastic links and that of rigid links with the same drive motion${
        output.guessed ? "; output under [run] chooses another output" : ""
      }`;
    shown.push(
      ...(lags.length && Math.abs(output.value) <= (output.error ?? 0)
        ? lags.map((lag) => lagTile(lag, output, place))
        : [figureTile("Error of the output", output, words, means)]),
    );
  }
  shown.push(mainDrive);
  const size = (figure) => ({ ...figure, value: Math.abs(figure.value) });
  if (bent) {
    const rivals = possiblyLarger(bent);
    const words = [where(bent), rivals.length ? `within the errors, ${rivals.join(", ")} may bend as much` : ""];
    const text = words.filter(Boolean).join("; ");
    shown.push(figureTile("Bends most", size(bent), text, `largest deflection from ${CHORD}`));
  }
  if (moved) {
    const means = "largest displacement across a link from its place with rigid links, also by other links";
    shown.push(figureTile("Displaced most across a link", size(moved), where(moved), means));
  }
  shown.push(...otherDrives);
  const { force } = shaking;
  shown.push(figureTile("Shaking force", force, atWords(force), "resultant force of the mechanism on the ground"));
  const lowest = vibration?.natural[0]?.lowest;
  if (lowest) {
    const ratio = vibration.drive_to_lowest.value;
    const held = Object.values(summary.cams ?? {}).map(({ drive, follower }) =>
      `for a machine in which ${drive} is held; the cam holds ${follower} instead, which may lower it`
    );
    shown.push(
      tile(
        "Lowest natural frequency",
        `${number(lowest.value / (2 * Math.PI))} Hz${errorWords(lowest)}`,
        [ratio ? `${number(1 / ratio, 3)} times the drive's speed` : "", atWords(lowest), ...held]
          .filter(Boolean).join(", "),
        { at: lowest, means: "of the elastic links, while each drive follows its motion law exactly" },
      ),
    );
  }
  if (theory.error !== null) {
    const jumps = summary.trust.some(({ heading }) => heading === "Jumps") ? " (it is excited by jumps)" : "";
    const vibrates = theory.name === "quasi-static" || theory.without_vibration === null
      ? ""
      : `; without vibration${jumps} and large displacement, the main deflections, stresses and forces would differ by ` +
        `up to ${share(theory.without_vibration)} of the values shown`;
    shown.push(
      tile(
        summary.links.length
          ? `Accuracy of largest deflection and stress, output${summary.acceptance.limits.length ? ", limits" : ""}`
          : "Accuracy of the main figures",
        `± ${errorShare(theory.error)}`,
        `${summary.links.length ? `${theory.name} theory` : "rigid links"}${
          theory.figure ? `; largest error: ${theory.figure}` : ""
        }${
          theory.near_zero.length ? `; larger relative errors of small figures: ${theory.near_zero.join(", ")}` : ""
        }${vibrates}`,
        {
          level: theory.error > summary.limits.vibration.beyond
            ? "poor"
            : theory.error > (theory.accuracy ?? theory.expected) || theory.reached === false
            ? "caution"
            : "good",
          means: "largest error among the main figures: largest deflection and stress, output, and figures with " +
            "limits, except load ratios far below their limits",
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

// Other members whose largest bending deflection may exceed the given one, because of the errors of both.
function possiblyLarger(bent) {
  const least = Math.abs(bent.value) - (bent.error ?? 0);
  const possible = Object.entries(summary.peaks).filter(([, { chord }]) =>
    chord && Math.abs(chord.value) + (chord.error ?? 0) > least
  );
  return [...new Set(possible.map(([label]) => memberOf(label)))].filter((name) => name !== memberOf(bent.label));
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
    if (used !== null && first && first.figure !== limit.kind && first.reserve.value < 0.999 / used) {
      words.push(`smallest reserve: ${itemWords(first)}, ${first.name}, ${reserveWords(first)}`);
    }
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
  const { reserve } = first,
    missing = unjudgedFailures(),
    level = reserve.value < 1 ? "poor" : reserve.value < 1.5 ? "caution" : missing.includes("yield") ? "open" : "good";
  const means = "factor by which the loads may grow until a link yields, breaks or buckles";
  return tile(
    `Smallest reserve: ${first.item}`,
    `reserve ${reserveWords(first).replace("more than", ">")}`,
    [
      [first.name, whereWords(spotOf(first))].filter(Boolean).join(", "),
      missing.length ? `not judged: ${missing.join(", ")}` : "",
    ].filter(Boolean).join("; "),
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
      `least safety ${number(safety.value, 4)}${errorWords(safety)}`,
      `: ${least[0]}, yield ${figureWords(least[1].yield_stress, 3)}`,
    ]
    : ["safety not known", `: add the yield stress, yield = "… MPa", under [materials.${material}]`];
  const means = "largest von Mises stress, and smallest ratio of yield stress to stress";
  return tile("Stress and safety", figureWords(strained) + errorWords(strained), [
    `${where(strained)}; `,
    h("b", { class: level }, words[0]),
    words[1],
  ], { means, at: strained });
}

// The output has no error except that its drive lags behind a cam.
function lagTile(lag, output, place) {
  const rest = `error of the output apart from this lag: ${figureAngle(output)}${errorWords(output)}, ${place}`;
  const means = "caused by the bending of the links between the cam and the drive";
  return figureTile("Lag of the drive behind its cam", lag, `${atWords(lag)}; ${rest}`, means);
}

function driveTile(name, { effort, rms, power }) {
  const words = [
    atWords(effort),
    rms && `rms ${figureWords(rms)}${unreliableMark(rms)}`,
    power &&
    `${power.value < 0 ? "peak power (braking)" : "peak power"} ${figureWords(power)}${unreliableMark(power)}${
      power.value ? ` at ${atWords(power)}` : ""
    }`,
  ];
  return figureTile(`Drive of ${name}`, effort, words.filter(Boolean).join("; "));
}

function leastSafe() {
  const rows = Object.entries(summary.strength).filter(([, row]) => row.safety_factor.value !== null);
  const [label, row] = rows.sort((a, b) => a[1].safety_factor.value - b[1].safety_factor.value)[0] ?? [];
  return row && [memberOf(label), row];
}

// Tile of a figure, or null if the figure is zero within its error.
function figureTile(heading, figure, words, means = null) {
  if (figure.error > Math.abs(figure.value) && !figure.unreliable) return null;
  return tile(heading, figureAngle(figure) + errorWords(figure), words, { means, at: figure });
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
