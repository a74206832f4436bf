// Results as a function of the drive speed, if requested.
const LIMITED = { chord: "chord", w: "deflection", mises: "stress" }; // kinds of limits of the fields
function speedsSection() {
  const { speeds, limits } = { ...summary, ...summary.acceptance };
  if (!speeds) return;
  const { between } = speeds,
    grid = h("div.charts"),
    [scale, unitShown] = scaleOf(1, speeds.unit),
    xs = between.speed.map((speed) => speed * scale),
    rpm = speeds.unit === "rad/s" && unitShown !== "rpm" ? 30 / Math.PI : 1;
  const words = (speed) => quantity(speed, speeds.unit) + (rpm === 1 ? "" : ` (${number(speed * rpm, 3)} rpm)`),
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
      const still = (k) => valueAt(between.speed[k], speeds.speed, speeds.without_vibration[field][label]),
        shown = 2 * beam < MOST_CURVES;
      const found = curve(beamName(label), (k) => between.values[field][label][k] ?? NaN, beamColour(beam));
      return [{ ...found, shown }, { ...curve(`${beamName(label)}, quasi-static`, still), shown }];
    });
    const xLabel = `speed of the drive [${unitWords(unitShown)}]`;
    const bounds = limits.filter(({ kind }) => LIMITED[field] === kind).map(({ limit, on }) => [
      limit.value,
      `limit${on ? ` of ${on}` : ""}`,
    ]);
    chart(grid, `Largest ${name} against the speed`, unit, curves, {
      xs,
      notes: { ...notes, bounds },
      log: true,
      xLabel,
    });
  }
  const sentences = speeds.words.map((line) => `${line[0].toUpperCase()}${line.slice(1)}.`);
  const critical = Object.entries(speeds.critical).map(([multiple, [low, high]]) =>
    `${multiple} times the speed at ${number(low * scale)} to ${number(high * scale)} ${unitWords(unitShown)}`
  );
  if (critical.length) {
    sentences.push(`The lowest natural frequency, which varies over the cycle, is met by ${critical.join(", ")}.`);
  }
  if (!speeds.unstable_ranges.length) sentences.push("A steady state exists at every speed.");
  $("speeds").append(h("p", sentences.join(" ")), soft("All values are in speeds.csv."));
}

// Interpolates at x between values at increasing abscissas by a power of x, or linearly if a value is not positive.
function valueAt(x, places, values) {
  const found = places.findIndex((place) => place >= x),
    after = found < 0 ? places.length - 1 : Math.max(found, 1),
    [from, to] = [places[after - 1], places[after]],
    [low, high] = [values[after - 1] ?? NaN, values[after] ?? NaN];
  if (low > 0 && high > 0) return low * (x / from) ** (Math.log(high / low) / Math.log(to / from));
  return low + ((high - low) * (x - from)) / (to - from);
}
