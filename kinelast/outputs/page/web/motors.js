// Motors: their table, and torque over speed.
const rpmWords = (figure) => (figure.value === null ? "–" : `${number((figure.value * 30) / Math.PI)} rpm`);

function motorTable(motored) {
  const rows = motored.map(({ name, drive }) => ({ name, drive: drive.motor }));
  const beside = (name, key, bound, words = figureWords) => ({
    name,
    wraps: true,
    text: ({ drive }) => {
      const limit = drive.given[bound] ?? null;
      const parts = [words(drive[key]), errorWords(drive[key]).trim()];
      if (limit !== null) parts.push(`of ${words({ value: limit, unit: drive[key].unit })}`);
      return parts.filter(Boolean).map(unbroken).join(" ");
    },
  });
  const ratio = (name, key, means) => ({ name, means, text: ({ drive }) => `${figureWords(drive[key])}` });
  return table(rows, [
    { name: "Motor of", text: (each) => each.name },
    beside("torque, root mean square", "motor_rms", "rated_torque"),
    beside("largest torque", "motor_torque", "peak_torque"),
    beside("mean speed", "motor_mean_speed", "rated_speed", rpmWords),
    beside("largest speed", "motor_speed", "top_speed", rpmWords),
    beside("largest inertia of the load over its own", "inertia_ratio", "inertia_ratio"),
    { name: "gear ratio", text: ({ drive }) => number(drive.given.gear_ratio) },
    ratio(
      "ratio of least torque",
      "least_ratio",
      "for which the root mean square of the torque is least, as far as the motor's speed allows",
    ),
    ratio(
      "ratio that matches the mean inertia",
      "matched_ratio",
      "square root of the mean load inertia over that of motor and gearbox. The inertia ratio uses the largest load " +
        "inertia instead, because its limit must hold at every position",
    ),
  ], "Motors");
}

// Torque over speed at all positions, with the quadrants of the motor: rated torque, and largest torque at each speed.
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
  const fastest = given.rated_speed ?? given.top_speed ?? Infinity;
  const rated = (x) => (given.rated_torque && Math.abs(x) <= fastest ? given.rated_torque : NaN);
  const [least, largest] = [-1, 1].map((way) =>
    known.some((i) => way * speeds[i] > 0) || !known.length ? way * widest : 0
  );
  const lines = Array.from({ length: 201 }, (_, k) => ({ x: least + (k / 200) * (largest - least), line: true }));
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
  const figure = h("figure.chart", { "aria-label": `Torque over speed of the motor of ${name}` }),
    canvas = h("div.plot");
  figure.append(
    h("figcaption", h("h3", `Motor of ${name}: torque over speed`)),
    soft(
      "Dots: all positions of the run. Inner lines: rated torque up to the rated speed. Outer lines: " +
        "largest available torque.",
    ),
    canvas,
  );
  grid.append(figure);
  const made = { heading: name, follow: () => {}, tell: () => {} };
  made.build = () => {
    made.plot?.destroy();
    const edge = (stroke, dash) => ({ stroke, width: 1.4, dash, spanGaps: true, points: { show: false } });
    made.plot = new uPlot(
      {
        ...made.size(),
        legend: { show: false },
        cursor: { show: false },
        scales: { x: { time: false } },
        axes: axesOf({ label: "speed [rpm]" }, { label: "[N·m]" }),
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
  framed(made, figure, canvas, CHART_HEIGHT + 60);
}
