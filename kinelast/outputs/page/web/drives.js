// Efforts, powers and energies of the drives, and motion of the output.
const speedWords = (figure) => (figure.unit === "rad/s" ? rpmWords(figure) : figureWords(figure));

function drivesSection() {
  const rows = Object.entries(summary.drives).map(([name, drive]) => ({ name, drive }));
  const column = (name, key, means, words = figureWords) => ({
    name,
    means,
    wraps: true,
    text: (
      each,
    ) => (each.drive[key]
      ? unbroken(words(each.drive[key]) + errorWords(each.drive[key])).replace("\u00a0(", " (")
      : ""),
  });
  const motored = rows.filter(({ drive }) => drive.motor),
    pressed = rows.filter(({ drive }) => drive.cylinder),
    grid = h("div.charts");
  section(
    "drives",
    "Drives",
    "Efforts and power of the drives",
    soft("Effort along the coordinate, including the motor's inertia. Averages are over the time of the run."),
    table(rows, [
      { name: "Drive", text: (each) => each.name },
      column("largest effort", "effort"),
      where("at", (each) => each.drive.effort),
      column("root mean square", "rms", "of the effort, which heats a motor"),
      column("mean", "mean"),
      column("speed", "speed", "", speedWords),
      column("largest power", "power"),
      column("mean power", "mean_power"),
    ], "Drives"),
    table(rows, [
      { name: "Drive", text: (each) => each.name },
      column("energy taken", "energy_taken", "into the mechanism in a run"),
      column("given back", "energy_given"),
      column("reduced inertia", "load_inertia", "of all links at this drive, the largest over the cycle"),
      column("energy that swings", "energy_fluctuation", "that a flywheel at this drive would take up"),
      column("flywheel", "flywheel", "inertia that keeps the speed as even as the scene asks"),
    ], "Energy of the drives"),
    lawTable(rows.filter(({ drive }) => drive.law)),
    motored.length ? motorTable(motored) : null,
    pressed.length
      ? table(pressed.map(({ name, drive }) => ({ name, drive: drive.cylinder })), [
        { name: "Cylinder of", text: (each) => each.name },
        column("pressure", "pressure"),
        column("flow", "flow"),
        column("buckling safety of the rod", "rod_buckling"),
      ], "Cylinders")
      : null,
    outputTable(),
    balanceTable(),
    grid,
  );
  motored.forEach(({ name, drive }, k) =>
    cloud(grid, name, drive.motor.given, row("motor_speed", k), row("motor_torque", k))
  );
}

// Peaks of the laws that drives follow.
function lawTable(rows) {
  function jerk({ drive: { law: { jerk, jumps } } }) {
    if (!jumps.length) return figureWords(jerk);
    const more = jumps.length > 3 ? ` and ${jumps.length - 3} more` : "";
    return `infinite: the acceleration jumps at ${
      jumps.slice(0, 3).map((each) => figureWords(each)).join(", ")
    }${more}`;
  }
  return rows.length
    ? table(rows, [
      { name: "Drive", text: (each) => each.name },
      { name: "greatest speed", text: ({ drive }) => speedWords(drive.law.speed) },
      { name: "greatest acceleration", text: ({ drive }) => figureWords(drive.law.acceleration) },
      { name: "greatest jerk", means: "rate of the acceleration, which excites shocks", text: jerk },
    ], "Laws of the drives")
    : null;
}

function outputTable() {
  const moves = summary.output?.motion;
  if (!moves) return null;
  const { stroke, swing, time_ratio: ratio, advantage, turns } = moves;
  return table([summary.output], [
    { name: "Output", text: (each) => each.name },
    stroke ? { name: "stroke", text: () => figureWords(stroke) } : { name: "swing", text: () => figureAngle(swing) },
    {
      name: "rests while the drive moves",
      means: "positions that are dead points for a drive at the output",
      text: () => turns.map(whenWords).join("; ") || "nowhere",
    },
    {
      name: "time ratio",
      means: "duration of the longer over that of the shorter of both ways, without rests",
      text: () => (ratio.value === null ? "–" : number(ratio.value)),
    },
    {
      name: "least mechanical advantage",
      means: "force or moment of the output over the effort of the drive, friction left out",
      text: () => (advantage ? `${figureWords(advantage)}, ${atWords(advantage)}` : "–"),
    },
    {
      name: "least transmission angle",
      text: () => (summary.figures.transmission_angle?.value ? figureAngle(summary.figures.transmission_angle) : "–"),
    },
  ], "Motion of the output");
}

// Counterweights and springs, on request.
function balanceTable() {
  const names = {
    shaking_force: "shaking force",
    shaking_moment: "remaining shaking moment",
    weight: "torque due to gravity",
    drive_effort: "effort of the drive",
  };
  const parts = { moment: "counterweight", disc: "disc", stiffness: "spring" };
  const words = (part) => {
    const kind = Object.keys(parts).find((key) => part[key]);
    const at = part.mass
      ? ` ${coordinateWords(part.direction.value, "rad")} from its axis: ${figureWords(part.mass)} at ${
        figureWords(part.radius)
      }`
      : part.angle
      ? `, slack at ${coordinateWords(part.angle.value, "rad")}`
      : "";
    return `${parts[kind]} of ${figureWords(part[kind])} on ${part.link} about ${part.pin}${at}`;
  };
  const rows = Object.entries(summary.balance ?? {}).filter(([key, each]) => names[key] && each.before.value);
  return rows.length
    ? table(rows.map(([key, each]) => ({ key, ...each })), [
      { name: "Balanced", text: (each) => names[each.key] },
      { name: "by", text: (each) => each.parts.map(words).join("; ") },
      { name: "before", text: (each) => figureWords(each.before) },
      { name: "after", text: (each) => figureWords(each.after) },
      { name: "remaining mean square", text: (each) => share(each.left) },
    ], "Balancing")
    : null;
}
