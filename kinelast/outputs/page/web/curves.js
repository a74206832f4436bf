// Charts over the cycle: extremes, forces, efforts, errors of the output, kinematics.
const curve = (name, values, colour) => ({ name, values, colour });
const beamColour = (beam) => model.beams[beam].link - 1;

function curvesSection() {
  const grid = h("div.charts");
  section(
    "curves",
    "Curves",
    "Over the cycle",
    hint(
      "Hover for values, drag sideways to zoom, double-click for all, click to go to that instant; click a " +
        "name to show or hide its curve. The line marks the shown instant.",
    ),
    grid,
  );
  for (const field of summary.buckles ? [] : ["w", "chord", "mises", "M"]) {
    if (!has(`extreme.${field}`) || (field === "mises" && !stressed)) continue;
    const own = model.beams.map(({ label }, beam) =>
      curve(beamName(label), (i) => Math.abs(row(`extreme.${field}`, beam)[i]), beamColour(beam))
    );
    add(grid, `Largest ${FIELDS[field].name} along each link`, FIELDS[field].unit, own);
  }
  outputCurve(grid);
  const units = [...new Set(model.drives.map((drive) => drive.effort))];
  for (const unit of units) {
    add(
      grid,
      unit === "N m" ? "Drive moment" : "Drive force",
      unit,
      model.drives.map((drive, k) => [drive, k]).filter(([drive]) => drive.effort === unit).map(([drive, k]) =>
        curve(drive.name, (i) => row("effort", k)[i])
      ),
    );
  }
  add(
    grid,
    "Power of the drives",
    "W",
    model.drives.map((drive, k) => curve(drive.name, (i) => row("effort", k)[i] * row("drive_rate", k)[i])),
  );
  add(
    grid,
    "Joint forces",
    "N",
    model.joints.map((joint, k) => curve(`${joint.name} on ${joint.on}`, (i) => size(vector("force", k, i)))),
  );
  const shaking = (i) => vector("ground_force", 0, i);
  add(grid, "Shaking force on the ground", "N", [
    curve("size", (i) => size(shaking(i)), 0),
    curve("x", (i) => shaking(i)[0], 1),
    curve("y", (i) => shaking(i)[1], 2),
  ]);
  add(grid, "Shaking moment on the ground", "N m", [curve("about the origin", (i) => row("ground_moment")[i], 0)]);
  if (suited) {
    add(
      grid,
      "Displacement of the points",
      "m",
      movingPoints.map(({ link, point }) => curve(point, (i) => size(displacementOf(link, point, i)))),
    );
  }
}

function add(grid, heading, unit, curves) {
  if (curves.length) chart(grid, heading, unit, curves);
}

function outputCurve(grid) {
  const output = summary.output;
  if (!output || summary.buckles) return;
  const found = outputOf(output);
  if (found) {
    add(
      grid,
      `Error of the output: ${output.kind === "angle" ? "angle of " : "point "}${output.name}`,
      output.unit,
      found,
    );
  }
}

function outputOf(output) {
  if (output.kind === "angle") {
    const link = model.links.findIndex((each) => each.name === output.name);
    return link > GROUND && output.point ? [curve("turned by", (i) => turnOf(link, output.point, i), 0)] : null;
  }
  const moving = movingPoints.find((each) => each.point === output.name);
  if (!moving) return null;
  const seen = (i) => {
    const velocity = velocityOf(moving.link, localOf(moving.link, moving.point), i), speed = size(velocity);
    return times(displacementOf(moving.link, moving.point, i), [velocity[0] / speed, -velocity[1] / speed]);
  };
  return [
    curve("size", (i) => size(displacementOf(moving.link, moving.point, i)), 0),
    curve("along its path, ahead", (i) => seen(i)[0], 1),
    curve("off its path, to the left", (i) => seen(i)[1], 2),
  ];
}

// Positions, velocities, accelerations of any point; angles and their rates of any link.
function kinematicsSection() {
  const grid = h("div.charts");
  let shown = [];
  const pick = choice(
    "kinematics-of",
    () => draw(),
    h("optgroup", { label: "points" }, movingPoints.map(({ point }, k) => option(`point ${k}`, point))),
    h("optgroup", { label: "links" }, model.links.map((link, k) => (k ? option(`link ${k}`, link.name) : null))),
  );
  section("kinematics", "Kinematics", "Kinematics", bar(labelled("Of", pick)), grid);
  const draw = () => {
    shown.forEach((made) => made.remove());
    const [kind, number] = pick.value.split(" "), at = Number(number), before = charts.length;
    if (kind === "point") pointCurves(grid, movingPoints[at]);
    else linkCurves(grid, at);
    shown = charts.slice(before);
  };
  draw();
}

function pointCurves(grid, { link, point }) {
  const local = localOf(link, point);
  for (
    const [heading, unit, of]
      of /** @type {[string, string, any][]} */ ([["Position", "m", placeOf], ["Velocity", "m/s", velocityOf], [
        "Acceleration",
        "m/s^2",
        accelerationOf,
      ]])
  ) {
    const sizes = heading === "Position" ? [] : [curve("size", (i) => size(of(link, local, i)), 2)];
    add(grid, `${heading} of ${point}`, unit, [
      curve("x", (i) => of(link, local, i)[0], 0),
      curve("y", (i) => of(link, local, i)[1], 1),
      ...sizes,
    ]);
  }
}

function linkCurves(grid, link) {
  const name = model.links[link].name, turned = [];
  for (let i = 0; i < N; i++) {
    const angle = (angleOf(link, i) * 180) / Math.PI;
    const last = i ? turned[i - 1] : NaN;
    turned.push(isFinite(last) ? angle + 360 * Math.round((last - angle) / 360) : angle);
  }
  add(grid, `Angle of ${name}`, "deg", [curve("from the x axis", (i) => turned[i], 0)]);
  add(grid, `Angular velocity of ${name}`, "rad/s", [
    curve("counter-clockwise", (i) => row("angular_velocity", link - 1)[i], 0),
  ]);
  add(grid, `Angular acceleration of ${name}`, "rad/s^2", [
    curve("counter-clockwise", (i) => row("angular_acceleration", link - 1)[i], 0),
  ]);
}

// Fields of the selected link: along the link at the current instant, and the largest values over the cycle.
const beamPanel = { charts: [], grid: null };

function beamSection() {
  if (!model.beams.length) return;
  beamPanel.grid = h("div.charts");
  const names = model.beams.map(({ label }, k) => option(k, beamName(label)));
  beamPanel.pick = choice("beam", (beam) => chooseBeam(Number(beam)), names);
  section(
    "link",
    "One link",
    "One link",
    soft(
      "Fields chosen above: along the link at the shown instant (left), and largest along the link over " +
        "the cycle (right).",
    ),
    bar(labelled("Link", beamPanel.pick)),
    beamPanel.grid,
  );
  const labels = model.beams.map(({ label }) => label);
  chooseBeam(Math.max(0, labels.indexOf((summary.largest_chord ?? summary.largest_deflection)?.label)));
}

function chooseBeam(beam) {
  view.selected = beam;
  if (beamPanel.pick) beamPanel.pick.value = beam;
  showBeam();
  view.redraw();
}

function showBeam() {
  if (!beamPanel.grid || view.selected === null) return;
  beamPanel.charts.forEach((made) => made.remove());
  const beam = view.selected,
    before = charts.length,
    { length, start, end } = model.beams[beam],
    fine = 40,
    label = beamName(model.beams[beam].label);
  const [factor, unit] = scaleOf(length, "m"),
    xs = Array.from({ length: fine + 1 }, (_, k) => (factor * length * k) / fine);
  for (const field of view.fields.size ? view.fields : [FIRST_FIELD]) {
    const { name, unit: own, value } = FIELDS[field], colour = beamColour(beam);
    let most = 0;
    for (let i = 0; i < N; i++) {
      for (let k = 0; counted(i) && k <= fine; k += 2) most = Math.max(most, Math.abs(value(beam, i, k / fine)) || 0);
    }
    chart(beamPanel.grid, `${label}: ${name} along it`, own, [
      curve(`${start} to ${end}`, (k) => value(beam, instant.position, k / fine), colour),
    ], { xs, xLabel: `from ${short(start)} to ${short(end)} [${unit}]`, live: true, largest: most });
    const over = (i) => {
      let found = 0;
      for (let k = 0; k <= fine; k++) {
        const here = value(beam, i, k / fine);
        if (!(Math.abs(here) <= Math.abs(found))) found = here;
      }
      return found;
    };
    chart(beamPanel.grid, `${label}: largest ${name} along it`, own, [
      curve(label, has(`extreme.${field}`) ? (i) => row(`extreme.${field}`, beam)[i] : over, colour),
    ]);
  }
  beamPanel.charts = charts.slice(before);
}
