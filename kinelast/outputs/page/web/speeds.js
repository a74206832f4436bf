// How the answer goes with the speed of the drive, where that was asked for.
function speedsSection() {
  const { speeds, limits } = { ...summary, ...summary.acceptance };
  if (!speeds) return;
  const grid = h("div", { class: "charts" }), xs = speeds.speed, rpm = speeds.unit === "rad/s" ? 30 / Math.PI : 1;
  const words = (speed) => `${number(speed)} ${unitWords(speeds.unit)}${rpm === 1 ? "" : ` (${number(speed * rpm, 3)} rpm)`}`, lists = (all) => all.join(", ");
  section("speeds", "Speeds", "Against the speed of the drive", soft("Largest values along each link over the cycle; the second, dashed curve of a link is that without vibration. Click a name to switch its curve off."), grid);
  for (const field of ["chord", "w", "mises"]) {
    const { name, unit } = FIELDS[field];
    if (!model.beams.some(({ label }) => speeds.values[field][label].some((value) => value))) continue;
    const curves = model.beams.flatMap(({ label }, beam) => [["", "values", 0], [" without vibration", "without_vibration", 1]].map(([more, way, dash]) => curve(`${label}${more}`, (k) => speeds[way][field][label][k] ?? NaN, beamStyle[beam][0], dash)));
    const most = Math.min(curves.length, 2 * Math.floor(MOST_CURVES / 2)), shown = curves.length > most ? curves.slice(0, most) : curves;
    chart(grid, `Largest ${name} against the speed${shown.length < curves.length ? ` (${shown.length / 2} of ${curves.length / 2} links)` : ""}`, unit, shown, { xs, xLabel: `speed of the drive [${unitWords(speeds.unit)}]` });
  }
  const told = [];
  if (speeds.highest_within_limits !== null) told.push(speeds.highest_within_limits ? `All limits hold up to ${words(speeds.highest_within_limits)}.` : "The limits do not hold at the lowest speed.");
  else if (!limits.length) told.push("No limits are set, so no highest speed can be told.");
  const critical = Object.entries(speeds.critical).map(([multiple, [low, high]]) => `${multiple} times the speed at ${number(low)} to ${number(high)} ${unitWords(speeds.unit)}`);
  if (critical.length) told.push(`The lowest natural frequency is met by ${lists(critical)}: it changes over the cycle.`);
  told.push(speeds.unstable.length ? `No steady state at ${speeds.unstable.length} of ${xs.length} speeds, from ${words(speeds.unstable[0])}.` : "A steady state comes about at every speed.");
  $("speeds").append(h("p", {}, told.join(" ")), soft("All values are in speeds.csv."));
}
