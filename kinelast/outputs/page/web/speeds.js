// Answer as a function of the drive speed, on request.
function speedsSection() {
  const { speeds, limits } = { ...summary, ...summary.acceptance };
  if (!speeds) return;
  const { between } = speeds,
    grid = h("div", { class: "charts" }),
    [scale, unitShown] = scaleOf(1, speeds.unit),
    xs = between.speed.map((speed) => speed * scale),
    rpm = speeds.unit === "rad/s" && unitShown !== "rpm" ? 30 / Math.PI : 1;
  const words = (speed) => quantity(speed, speeds.unit) + (rpm === 1 ? "" : ` (${number(speed * rpm, 3)} rpm)`),
    lists = (all) => all.join(", "),
    highest = speeds.highest_within_limits;
  const notes = {
    ranges: speeds.unstable_ranges.map((range) => range.map((speed) => speed * scale)),
    lines: speeds.limit && highest ? [[highest * scale, `limits hold up to ${number(highest * scale)}`]] : [],
    peaks: speeds.peaks.filter(({ resonance }) => resonance).map((
      { speed, resonance },
    ) => [speed * scale, resonance.met ? `${resonance.harmonic}×${resonance.mode}` : `mode ${resonance.mode}`]),
  };
  section(
    "speeds",
    "Speeds",
    `Against the speed of the drive${highest ? `: limits hold up to ${words(highest)}` : ""}`,
    soft(
      "Largest values along each link over the cycle, with and without vibration (quasi-static). 5×2 at a peak: the 5th " +
        "harmonic of the cycle meets the 2nd natural mode. Mode 2: the 2nd natural mode vibrates, but no harmonic " +
        "of the cycle has its frequency. Click a name to hide its curve.",
    ),
    grid,
  );
  for (const field of ["chord", "w", "mises"]) {
    const { name, unit } = FIELDS[field];
    if (!model.beams.some(({ label }) => speeds.values[field][label].some((value) => value))) continue;
    const curves = model.beams.flatMap(({ label }, beam) => {
      const still = (k) => onLine(between.speed[k], speeds.speed, speeds.without_vibration[field][label]),
        shown = 2 * beam < MOST_CURVES;
      const found = curve(beamName(label), (k) => between.values[field][label][k] ?? NaN, beamColour(beam));
      return [{ ...found, shown }, { ...curve(`${beamName(label)}, quasi-static`, still), shown }];
    });
    const xLabel = `speed of the drive [${unitWords(unitShown)}]`;
    chart(grid, `Largest ${name} against the speed`, unit, curves, { xs, notes, log: true, xLabel });
  }
  const sentences = [];
  if (highest !== null) {
    sentences.push(
      highest
        ? `All limits hold up to ${words(highest)}${
          speeds.limit ? `; ${speeds.limit.words}` : ", the highest requested speed"
        }.`
        : `${
          speeds.verdicts[0] === "too close to decide" ? "The limits are too close to decide" : "The limits do not hold"
        } at the lowest speed.`,
    );
  } else if (!limits.length) sentences.push("No limits are set, so there is no limit speed.");
  const critical = Object.entries(speeds.critical).map(([multiple, [low, high]]) =>
    `${multiple} times the speed at ${number(low * scale)} to ${number(high * scale)} ${unitWords(unitShown)}`
  );
  if (critical.length) {
    sentences.push(`The lowest natural frequency, which varies over the cycle, is met by ${lists(critical)}.`);
  }
  for (const [low, high] of speeds.unstable_ranges) {
    sentences.push(`No steady state from ${words(low)} to ${words(high)}: vibration grows.`);
  }
  if (!speeds.unstable_ranges.length) sentences.push("A steady state exists at every speed.");
  sentences.push(
    ...speeds.words.filter((line) => line.includes("large displacement")).map((line) =>
      `${line[0].toUpperCase()}${line.slice(1)}.`
    ),
  );
  $("speeds").append(h("p", {}, sentences.join(" ")), soft("All values are in speeds.csv."));
}

// Value at x on the line through values at rising places.
function onLine(x, places, values) {
  const after = Math.min(Math.max(places.findIndex((place) => place >= x), 1), places.length - 1),
    share = (x - places[after - 1]) / (places[after] - places[after - 1]);
  return (values[after - 1] ?? NaN) * (1 - share) + (values[after] ?? NaN) * share;
}
