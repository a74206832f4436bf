// Tables of the figures in the summary, and of the inputs from which they were computed.
const anyBetween = (figures) => figures.some((each) => each.between_positions);
const where = (name, of) => ({ name, text: (each) => atWords(of(each)) });

function extremesSection() {
  const rows = Object.entries(summary.peaks).map(([label, peaks]) => ({ label, peaks }));
  if (!rows.length) return;
  const searched = summary.made_from.options.refine || anyBetween(rows.flatMap(({ peaks }) => Object.values(peaks)));
  const columns = (field) => {
    const { name, symbol, unit, means } = FIELDS[field];
    return {
      name: field === "chord" ? name : `${symbol.replace("_v", "ᵥ")}, ${name}`,
      means,
      unit,
      figure: (each) => each.peaks[field],
      signed: false,
    };
  };
  const link = { name: "Link", text: (each) => beamName(each.label) };
  const placed = (label, peak) => `${unbroken(placeWords(label, peak))}, ${unbroken(atWords(peak))}`;
  const place = (field) => ({
    name: "where",
    wraps: true,
    text: ({ label, peaks }) => (peaks[field].value ? placed(label, peaks[field]) : ""),
  });
  const pairs = (fields) => fields.flatMap((field, k) => [{ ...columns(field), worst: k === 0 }, place(field)]);
  section(
    "extremes",
    "Extremes",
    "Largest values over the cycle",
    soft(
      "Value of largest magnitude along each link, ",
      searched ? "searched between the positions too" : "at the positions of the run",
      ". “where” gives the point, or the distance from the first point of the link, and the drive's " +
        "coordinate. Displacements are relative to the rigid position; the ",
      jargon("chord", CHORD),
      " is the line through the ends of a link. Click a heading to sort.",
    ),
    table(rows, [link, ...pairs(["w", "chord", "u", "phi"])], "Displacements"),
    table(rows, [link, ...pairs(["M", "N", "V"])], "Section forces"),
    summary.stressed
      ? table(rows, [link, ...pairs(["mises", "normal", "shear"])], "Stresses")
      : soft(stressed ? "No stresses: all positions are singular." : "No stresses: the sections have no dimensions."),
  );
}

function strengthSection() {
  const rows = Object.entries(summary.strength).map(([label, row]) => ({ label, ...row }));
  if (!rows.length) return;
  section(
    "strength",
    "Strength",
    "Strength and buckling",
    soft(
      "Safety: yield stress over the largest von Mises stress. Stress range: largest swing of the normal " +
        "stress at one place over the cycle. Load / critical: 100 % buckles; its error is relative to the " +
        "largest ratio of all links. Slenderness: length over radius of gyration.",
    ),
    table(rows, [
      { name: "Link", text: (each) => beamName(each.label) },
      { name: "safety", figure: (each) => each.safety_factor, digits: 3, worst: "least" },
      { name: "yield stress", unit: "Pa", of: (each) => value(each.yield_stress), digits: 3 },
      { name: "stress range", unit: "Pa", of: (each) => value(each.stress_range) },
      {
        name: "where",
        text: ({ label, stress_range: range }) =>
          range.value ? `${placeWords(label, range)}, ${range.fibre} fibre` : "",
      },
      {
        name: "load / critical [%]",
        of: (each) => 100 * (value(each.buckling) ?? NaN),
        words: (each) => number(100 * (value(each.buckling) ?? NaN), 2) + unreliableMark(each.buckling),
      },
      where("at", (each) => each.buckling),
      { name: "slenderness", of: (each) => value(each.slenderness), digits: 3 },
    ], "Strength of the links"),
  );
}

function vibrationSection() {
  const { vibration } = summary;
  if (!vibration?.natural.length) return;
  const rows = vibration.natural.map((mode, k) => ({ ...mode, k: k + 1 })),
    hertz = (figure) => (figure.value === null ? NaN : figure.value / (2 * Math.PI));
  const { load, drive_speed: speed, drive_to_lowest: ratio } = vibration;
  section(
    "vibration",
    "Frequencies",
    "Natural frequencies",
    soft(
      `Mechanism with locked drives, at ${several(vibration.positions, "position")} of the cycle. The minimum of ` +
        "the first mode is searched with finer steps.",
    ),
    table(rows, [
      { name: "Mode", text: (each) => String(each.k) },
      {
        name: "lowest [Hz]",
        of: (each) => hertz(each.lowest),
        words: (each) => number(hertz(each.lowest)) + errorWords(each.lowest),
      },
      where("at", (each) => each.lowest),
      { name: "highest [Hz]", of: (each) => hertz(each.highest) },
      where("at", (each) => each.highest),
    ], "Modes"),
    h(
      "p",
      speed.value
        ? `The drive turns at ${number(speed.value / (2 * Math.PI), 3)} Hz, ${number(ratio.value, 2)} of the lowest. `
        : "",
      load?.harmonic
        ? `Its loads strain the links in harmonics up to ${load.harmonic}, ${
          number(load.frequency.value / (2 * Math.PI), 3)
        } Hz, ${number(load.to_lowest.value, 2)} of the lowest. `
        : "",
    ),
  );
}

function errorsSection() {
  if (!suited) return;
  const points = Object.entries(summary.points).map(([name, row]) => ({ name, ...row })),
    links = Object.entries(summary.angle_errors).map(([name, error]) => ({ name, error }));
  function part(name, key, worst) {
    const figure = (each) => each[key];
    return [{ name, unit: "m", figure, worst }, where("at", figure)];
  }
  section(
    "errors",
    "Output",
    "Error of the output",
    soft(
      "Difference from rigid links. Points: displacement, and its parts off the path (left positive) and " +
        "along it (ahead positive). Links: angle, at the point with the largest error.",
    ),
    table(points, [
      { name: "Point", text: (each) => each.name },
      ...part("displacement", "displacement", true),
      ...part("off its path", "off_path"),
      ...part("along its path", "along_path"),
    ], "Displacement of the points"),
    table(links, [
      { name: "Link", text: (each) => each.name },
      { name: "error of its angle", unit: "rad", figure: (each) => each.error, worst: true },
      { name: "at point", text: (each) => (each.error.value ? each.error.point : "") },
      where("at", (each) => each.error),
    ], "Error of the links' angles"),
  );
}

function forcesSection() {
  section(
    "forces",
    "Joints",
    "Joints",
    soft(
      anyBetween([...summary.joints.map(({ force }) => force), ...Object.values(summary.shaking)])
        ? "At the positions of the run, and between them if the value is larger there."
        : summary.made_from.options.refine
        ? "At the positions of the run: joint forces and shaking loads are not searched between them."
        : "At the positions of the run.",
    ),
    table(summary.joints, [
      { name: "Joint", text: (each) => each.joint },
      { name: "on link", text: (each) => each.on },
      { name: "largest force", unit: "N", figure: (each) => each.force, worst: true },
      where("at", (each) => each.force),
    ], "Joint forces"),
    table(Object.entries(summary.shaking).map(([name, found]) => ({ name, found })), [
      { name: "On the ground", text: (each) => `shaking ${each.name}` },
      { name: "largest", text: (each) => figureWords(each.found) + errorWords(each.found) },
      where("at", (each) => each.found),
    ], "On the ground"),
  );
}

function registerSection() {
  const rows = Object.values(summary.figures).filter((each) => each.value !== null);
  section(
    "register",
    "All figures",
    "All figures",
    soft(
      "Figures of summary.json, sweeps and optima: the largest over the cycle, or the smallest if smaller is worse.",
    ),
    h(
      "details",
      h("summary", `${rows.length} figures`),
      table(rows, [
        { name: "Figure", text: (each) => each.name },
        { name: "value", text: (each) => figureAngle(each) + errorWords(each) },
        { name: "on", text: (each) => beamName(each.on) ?? "" },
        { name: "at", text: (each) => (each.drive ? atWords(each) : "") },
      ], "Figures"),
    ),
  );
}

function checkSection() {
  const { check, links } = summary;
  if (!check || !links.length) return;
  const rows = Object.entries(check.differences).map(([label, row]) => ({ label, ...row }));
  section(
    "check",
    "Check",
    "Finite elements",
    soft(
      `${check.elements} elements a beam; largest difference from the closed form at any node and ` +
        "position, relative to the field's maximum over the cycle.",
    ),
    table(rows, [
      { name: "Link", text: (each) => beamName(each.label) },
      ...["N", "V", "M", "u", "w", "phi"].map((field) => ({
        name: FIELDS[field].symbol,
        of: (each) => each[field],
        words: (each) => number(each[field], 2),
      })),
    ], "Differences"),
  );
}

function inputsSection() {
  const { inputs, links, rigid_links: rigid } = summary, rows = [];
  const say = (name, ...words) => rows.push(h("tr", h("th", { scope: "row" }, name), h("td", words)));
  say("Run", runWords());
  for (const [name, { speed, steady }] of Object.entries(inputs.drives)) {
    say(
      `Speed of ${name}`,
      figureWords(speed),
      speed.unit === "rad/s" && speed.value !== null && !chosenUnits["rad/s"]
        ? ` = ${number((speed.value * 30) / Math.PI)} rpm`
        : "",
      steady ? "" : " at most",
    );
  }
  const { x, y } = inputs.gravity;
  say("Gravity", x.value || y.value ? `${figureWords(x)} in x, ${figureWords(y)} in y` : "none");
  for (const load of inputs.loads) {
    say(
      `${load.kind}${load.link ? ` on ${load.link}` : ""}${load.place ? `, ${load.place}` : ""}`,
      load.sizes.map((each) => figureWords(each)).join(", "),
      load.towards ? ` towards ${coordinateWords(load.towards.value, "rad")}` : "",
      load.varies ? ", times its table" : "",
      load.resists ? `, resists the motion ${load.resists}` : "",
    );
  }
  if (!inputs.loads.length) say("Loads", "only weight and inertia");
  for (const lump of inputs.point_masses) {
    say(
      `Mass on ${lump.link} ${
        lump.offset ? `(${lump.offset.map((each) => figureWords(each)).join(", ")}) in its axes from` : "at"
      } ${lump.point}`,
      figureWords(lump.mass),
    );
  }
  for (const [name, stuff] of Object.entries(inputs.materials)) {
    say(
      `Material ${name}`,
      `E ${figureWords(stuff.E)}, ${number(stuff.density.value, 6)} kg/m³`,
      stuff.yield.value === null ? "" : `, yields at ${figureWords(stuff.yield)}`,
    );
  }
  for (const [name, made] of Object.entries(inputs.sections)) {
    say(
      `Section ${name}`,
      `A ${figureWords(made.area)}, I ${figureWords(made.inertia)}`,
      made.fibre.value === null ? "" : `, outermost fibre at ${figureWords(made.fibre)}`,
    );
  }
  if (links.length) {
    say(
      "Theory of beams",
      inputs.theory === "Timoshenko" ? "Timoshenko: shear deformation counts" : "Euler-Bernoulli: no shear deformation",
    );
  }
  section(
    "inputs",
    "Inputs",
    "Inputs of the computation",
    h(
      "div.wide",
      { tabindex: 0, role: "region", "aria-label": "Inputs" },
      h("table.inputs", h("caption", "Speeds, loads, materials"), h("tbody", rows)),
    ),
    links.length
      ? table(links, [
        { name: "Link", text: (each) => beamName(each.label) },
        { name: "from – to", text: (each) => `${each.from} – ${each.to}` },
        { name: "section", text: (each) => each.section ?? "" },
        { name: "material", text: (each) => each.material ?? "" },
        { name: "length", unit: "m", of: (each) => value(each.length) },
        { name: "mass", unit: "kg", of: (each) => value(each.mass) },
        { name: "EA", unit: "N", means: "rigidity against stretching", of: (each) => value(each.EA), none: "rigid" },
        { name: "EI", unit: "N m^2", means: "rigidity against bending", of: (each) => value(each.EI), none: "rigid" },
      ], "Links")
      : null,
    rigid.length ? soft(`Rigid: ${rigid.join(", ")}.`) : null,
    sceneText ? h("details", h("summary", "Text of the scene"), h("pre", { tabindex: 0 }, sceneText)) : null,
  );
}

function footer() {
  const { made_from: made, kinelast, versions, scene } = summary, written = new Date(document.lastModified);
  $("foot").append(
    `kinelast ${kinelast}`,
    versions ? `, ${Object.entries(versions).map(([name, version]) => `${name} ${version}`).join(", ")}` : "",
    `; scene “${scene.name}”`,
    made.sha256 ? `, SHA-256 ${made.sha256}` : "",
    `; this file is of ${
      isNaN(written.getTime()) ? "an unknown date" : written.toLocaleString()
    }. All figures with their units are in summary.json, those of every position in positions.csv. ` +
      "Curves by uPlot (MIT licence, © Leon Sorokin).",
  );
}
