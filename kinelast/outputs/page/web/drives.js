// Efforts, powers and energies of the drives, motors and cylinders, and motion of the output.
const rpmWords = (figure) => (figure.value === null ? "–" : `${number((figure.value * 30) / Math.PI)} rpm`);
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
    grid = h("div", { class: "charts" });
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
        {
          name: "Cylinder of",
          text: (each) => each.name,
        },
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
  const jerk = (
    { drive: { law } },
  ) => (law.jumps.length
    ? `infinite: the acceleration jumps at ${law.jumps.slice(0, 3).map((each) => figureWords(each)).join(", ")}${
      law.jumps.length > 3 ? ` and ${law.jumps.length - 3} more` : ""
    }`
    : figureWords(law.jerk));
  return rows.length
    ? table(rows, [
      { name: "Drive", text: (each) => each.name },
      { name: "greatest speed", text: ({ drive }) => speedWords(drive.law.speed) },
      { name: "greatest acceleration", text: ({ drive }) => figureWords(drive.law.acceleration) },
      { name: "greatest jerk", means: "rate of the acceleration, which excites shocks", text: jerk },
    ], "Laws of the drives")
    : null;
}

function motorTable(motored) {
  const rows = motored.map(({ name, drive }) => ({ name, drive: drive.motor }));
  const beside = (name, key, bound, words = figureWords) => ({
    name,
    text: ({ drive }) => {
      const allowed = drive.given[bound];
      return words(drive[key]) + errorWords(drive[key]) +
        (allowed === null || allowed === undefined ? "" : ` of ${words({ value: allowed, unit: drive[key].unit })}`);
    },
  });
  const ratio = (name, key, means) => ({ name, means, text: ({ drive }) => `${figureWords(drive[key])}` });
  return table(rows, [
    { name: "Motor of", text: (each) => each.name },
    beside("torque, root mean square", "motor_rms", "rated_torque"),
    beside("largest torque", "motor_torque", "peak_torque"),
    beside("mean speed", "motor_mean_speed", "rated_speed", rpmWords),
    beside("largest speed", "motor_speed", "top_speed", rpmWords),
    beside("load's inertia over its own", "inertia_ratio", "inertia_ratio"),
    { name: "gear ratio", text: ({ drive }) => number(drive.given.gear_ratio) },
    ratio(
      "ratio of least torque",
      "least_ratio",
      "for which the root mean square of the torque is least, as far as the motor's speed allows",
    ),
    ratio("ratio that matches inertias", "matched_ratio", "root of the load's mean inertia over the motor's"),
  ], "Motors");
}

function outputTable() {
  const moves = summary.output?.motion;
  if (!moves) return null;
  const { stroke, swing, time_ratio: ratio, advantage, turns } = moves;
  return table([summary.output], [
    { name: "Output", text: (each) => each.name },
    stroke ? { name: "stroke", text: () => figureWords(stroke) } : { name: "swing", text: () => figureAngle(swing) },
    {
      name: "turns back",
      means: "output at rest: dead points for a drive at the output",
      text: () =>
        turns.flatMap(({ drive }) =>
          Object.entries(drive).map(([name, at]) => `${name} ${coordinateWords(at.value, at.unit)}`)
        ).join("; ") || "nowhere",
    },
    {
      name: "time ratio",
      means: "the longer over the shorter of both ways",
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

// Torque over speed at all positions, and the quadrants of the motor: rated, and the most that is there at a speed.
function cloud(grid, name, given, speeds, torques) {
  const turns = (value) => (value * 30) / Math.PI,
    known = speeds.length ? Array.from(speeds, (_, i) => i).filter((i) => isFinite(torques[i]) && counted(i)) : [];
  const widest = Math.max(given.top_speed ?? 0, given.rated_speed ?? 0, ...known.map((i) => 1.1 * Math.abs(speeds[i])));
  const most = (x) =>
    Math.min(
      given.peak_torque ?? Infinity,
      given.stall_torque && given.top_speed
        ? given.stall_torque * Math.max(0, 1 - Math.abs(x) / given.top_speed)
        : Infinity,
    );
  const rated = (
    x,
  ) => (given.rated_torque && Math.abs(x) <= (given.rated_speed ?? given.top_speed ?? Infinity)
    ? given.rated_torque
    : NaN);
  const lines = Array.from({ length: 201 }, (_, k) => ({ x: ((k - 100) / 100) * widest, line: true }));
  /** @type {{ x: number, y?: number, line?: boolean }[]} */
  const all = [...lines, ...known.map((i) => ({ x: speeds[i], y: torques[i] }))].sort((one, other) => one.x - other.x);
  const only = (of) =>
    all.map((each) => {
      const value = each.line ? of(each.x) : NaN;
      return isFinite(value) ? value : null;
    });
  const data = [
    all.map(({ x }) => turns(x)),
    all.map(({ y }) => y ?? null),
    only(rated),
    only((x) => -rated(x)),
    only(most),
    only((x) => -most(x)),
  ];
  const figure = h("figure", { class: "chart", "aria-label": `Torque over speed of the motor of ${name}` }),
    canvas = h("div", { class: "plot" });
  figure.append(
    h("figcaption", {}, h("h3", {}, `Motor of ${name}: torque over speed`)),
    soft(
      "Dots: all positions of the run. Inner lines: rated torque up to the rated speed. Outer lines: " +
        "largest available torque.",
    ),
    canvas,
  );
  grid.append(figure);
  const made = {
    heading: name,
    follow: () => {},
    tell: () => {},
    remove: () => {
      made.plot?.destroy();
      charts.splice(charts.indexOf(made), 1);
      figure.remove();
    },
  };
  made.resize = () => made.plot?.setSize({ width: Math.max(240, canvas.clientWidth), height: CHART_HEIGHT + 60 });
  made.build = () => {
    made.plot?.destroy();
    const ink = variable("--soft"),
      axes = {
        stroke: ink,
        font: "11px system-ui, sans-serif",
        labelFont: "11px system-ui, sans-serif",
        grid: { stroke: variable("--rule"), width: 1 },
        ticks: { show: false },
      };
    const edge = (stroke, dash) => ({ stroke, width: 1.4, dash, spanGaps: true, points: { show: false } });
    made.plot = new uPlot(
      {
        width: Math.max(240, canvas.clientWidth),
        height: CHART_HEIGHT + 60,
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false } },
        axes: [{ ...axes, size: 34, label: "speed [rpm]", labelSize: 16 }, {
          ...axes,
          size: 58,
          label: "[N·m]",
          labelSize: 16,
        }],
        series: [
          {},
          { stroke: colour(0), paths: () => null, points: { show: true, size: 4, fill: colour(0) } },
          edge(variable("--ink"), [5, 4]),
          edge(variable("--ink"), [5, 4]),
          edge(variable("--red"), []),
          edge(variable("--red"), []),
        ],
      },
      data,
      canvas,
    );
    canvas.querySelector("canvas").setAttribute("aria-hidden", "true");
  };
  charts.push(made);
  made.build();
}
