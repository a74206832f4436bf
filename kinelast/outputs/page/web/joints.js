// Reserves, life of the links, and joints with bearings, pins and eyes.
const MODES = {
  yield: "yield",
  endurance: "endurance",
  buckling: "buckling",
  deflection: "deflection",
  chord: "deflection from chord",
  life: "life",
  "limit speed": "limit speed",
};
const MOST = 1000; // largest printed reserve
const reserveWords = (
  reserve,
) => (reserve ? (reserve.value > MOST ? `more than ${MOST}` : number(reserve.value, 3) + errorWords(reserve)) : "");

// Place of a failure: label of the beam, position along it (missing for a whole beam), and instant.
function spotOf(mode, reserve) {
  const { label } = reserve,
    known = {
      yield: () => summary.strength[label]?.safety_factor,
      deflection: () => summary.peaks[label]?.w,
      chord: () => summary.peaks[label]?.chord,
      endurance: () => summary.life?.links[label],
      life: () => summary.life?.links[label],
    };
  return { label, along: known[mode]?.()?.along ?? null, at: reserve };
}

// Place of the first failure of the machine; null if there is none, or for a whole beam.
function firstSpot() {
  const row = summary.breaks_first?.[0],
    spot = row && spotOf(row.governs, row.reserve),
    beam = spot?.along ? summary.links.findIndex((each) => each.label === spot.label) : -1;
  return beam < 0 ? null : {
    beam,
    part: spot.along.value / summary.links[beam].length.value,
    words: `breaks first: ${row.link} by ${MODES[row.governs]}, reserve ${reserveWords(row.reserve)}`,
  };
}

function breaksFirst() {
  const rows = summary.breaks_first;
  if (!rows.length) return;
  const modes = Object.keys(MODES).filter((mode) => rows.some((row) => row.reserves[mode]));
  section(
    "breaks-first",
    "Reserves",
    "What breaks first",
    soft(
      "Reserve: load factor until a link yields, breaks, buckles or exceeds its limit. Below 1 it has " +
        "failed. The red ring on the mechanism marks the first failure.",
    ),
    longTable(rows, [
      { name: "Link", text: (row) => row.link },
      { name: "governs", text: (row) => MODES[row.governs] },
      { name: "reserve", of: (row) => row.reserve.value, words: (row) => reserveWords(row.reserve), worst: "least" },
      { name: "where", text: (row) => whereWords(spotOf(row.governs, row.reserve)) },
      ...modes.map((mode) => ({
        name: MODES[mode],
        of: (row) => row.reserves[mode]?.value ?? NaN,
        words: (row) => reserveWords(row.reserves[mode]),
      })),
    ], "Reserves of the links"),
  );
}

const whereWords = ({ label, along, at }) =>
  [label, placeWords(label, { along }), at.drive ? atWords(at) : ""].filter(Boolean).join(", ");

const lifeWords = (
  figure,
) => (figure.value === null
  ? "endless"
  : (figure.unit === "s" ? `${number(figure.value / 3600)} h` : figureWords(figure)) + errorWords(figure));

function lifeSection() {
  const { life } = summary;
  if (!life) return;
  const rows = Object.entries(life.links).map(([label, row]) => ({ label, ...row }));
  section(
    "life",
    "Life",
    "Life",
    soft(
      `Safety against endurance by the ${life.criterion[0].toUpperCase()}${
        life.criterion.slice(1)
      } criterion, for the largest cycle of the normal stress in either fibre, including notches. A cycle ` +
        "is a run of the scene. Below the endurance limit the life is endless.",
    ),
    table(rows, [
      { name: "Link", text: (each) => each.label },
      {
        name: "safety against endurance",
        of: (each) => value(each.endurance),
        words: (each) => number(value(each.endurance), 3) + errorWords(each.endurance),
        worst: "least",
      },
      { name: "where", text: (each) => `${placeWords(each.label, each)}, ${each.fibre} fibre` },
      { name: "amplitude", unit: "Pa", of: (each) => value(each.amplitude) },
      { name: "mean", unit: "Pa", of: (each) => value(each.mean) },
      {
        name: "endurance limit",
        means: "of the part, its factors of surface, size and reliability in it",
        unit: "Pa",
        of: (each) => value(each.endurance_limit),
      },
      { name: "runs", text: (each) => (each.endless ? "endless" : lifeWords(each.cycles)) },
      { name: "life", text: (each) => (each.endless ? "endless" : lifeWords(each.life)) },
    ], "Life of the links"),
  );
}

function jointsSection() {
  const rows = summary.joints.map((joint, k) => ({ ...joint, k })).filter((joint) => joint.figures);
  if (!rows.length) return;
  const figures = (each) =>
    Object.entries(each.figures).filter(([, figure]) => figure.value !== null).map(([key, figure]) => ({
      joint: each.joint,
      name: summary.figures[key].name,
      figure,
    }));
  const rings = (each) =>
    [["child", each.on], ["parent", each.parent]].map(([side, link]) =>
      `${link}: ${
        Math.abs(each.force_turns[side].value) < 0.5
          ? "stays"
          : `goes round ${number(Math.abs(each.force_turns[side].value), 2)} times`
      }`
    ).join("; ");
  const effects = ["clearance_worst", "clearance_pressed"].filter((key) => summary.figures[key]).map((key) =>
    `${summary.figures[key].name} ${figureAngle(summary.figures[key])}`
  );
  section(
    "bearings",
    "Bearings",
    "Bearings, pins and eyes",
    soft("Mean forces are averages over the angle."),
    table(rows, [
      { name: "Joint", text: (each) => `${each.joint} on ${each.on}` },
      { name: "largest force", unit: "N", of: (each) => value(each.force), worst: true },
      {
        name: "mean force",
        means: "cubic, over the angle that the joint passes: the steady force of the same life of a ball bearing",
        unit: "N",
        of: (each) => (each.figures.joint_mean_force ? value(each.figures.joint_mean_force) : NaN),
      },
      {
        name: "motion",
        text: (
          each,
        ) => (each.figures.joint_swing ? `${each.sense}, ${figureAngle(each.figures.joint_swing)}` : each.sense),
      },
      {
        name: "fastest",
        text: (
          each,
        ) => (each.figures.joint_rate
          ? rpmWords({ ...each.figures.joint_rate, value: Math.abs(each.figures.joint_rate.value) })
          : figureWords(each.figures.bearing_speed)),
      },
      {
        name: "direction of the force",
        means: "in the axes of each link: a ring with a fixed direction has a point load, a ring with a rotating " +
          "direction needs a tight fit",
        text: rings,
      },
      { name: "contact lost at", wraps: true, text: (each) => contactWords(each.contact_lost) },
    ], "Joints with parts"),
    table(rows.flatMap(figures), [{ name: "Joint", text: (each) => each.joint }, {
      name: "Figure",
      text: (each) => each.name,
    }, {
      name: "value",
      text: (
        each,
      ) => (each.figure.unit === "s" ? lifeWords(each.figure) : figureAngle(each.figure) + errorWords(each.figure)),
    }, { name: "at", text: (each) => (each.figure.drive ? atWords(each.figure) : "") }], "Figures of the joints"),
    effects.length ? h("p", {}, `${effects.join("; ")}.`) : null,
    h("div", { class: "polars" }, rows.flatMap((each) => [each.on, each.parent].map((link) => polar(each, link)))),
  );
}

// Of many instants the first, the last and how many.
function contactWords(lost) {
  const words = lost.map((at) =>
    Object.entries(at.drive).map(([name, drive]) => `${name} ${coordinateWords(drive.value, drive.unit)}`).join(", ")
  );
  return words.length > 4 ? `${words.length} positions, from ${words[0]} to ${words.at(-1)}` : words.join("; ");
}

// Hodograph of the force on a link in that link's axes, x' to the right: the tip of the force over the cycle.
function polar(joint, name) {
  const link = model.links.findIndex((each) => each.name === name), sign = name === joint.on ? 1 : -1, tips = [];
  for (let i = 0; i < N; i++) {
    const [x, y] = vector("force", joint.k, i), [dx, dy] = link === GROUND ? [1, 0] : vector("direction", link - 1, i);
    tips.push(counted(i) ? [sign * (dx * x + dy * y), sign * (dx * y - dy * x)] : [NaN, NaN]);
  }
  const most = Math.max(...tips.map(([x, y]) => Math.hypot(x, y)).filter(isFinite), 1e-300),
    R = 88,
    at = (/** @type {number[]} */ [x, y]) => [(R * x) / most, (-R * y) / most];
  let path = "", pen = "M";
  for (const tip of tips) {
    const [x, y] = at(tip);
    if (!isFinite(x + y)) {
      pen = "M";
      continue;
    }
    path += `${pen}${x.toFixed(1)} ${y.toFixed(1)}`;
    pen = "L";
  }
  const svg = s("svg", {
    viewBox: "-100 -100 200 200",
    role: "img",
    "aria-label": `Polar diagram of the force on ${name} at ${joint.joint}`,
    class: "polar",
  });
  svg.append(
    s("circle", { r: R, class: "rim" }),
    s("circle", { r: R / 2, class: "rim" }),
    s("path", { d: `M${-R} 0H${R}M0 ${-R}V${R}`, class: "rim" }),
    s("path", { d: path, class: "tip" }),
  );
  return h(
    "figure",
    { class: "chart" },
    h("figcaption", {}, `Force on ${name} at ${joint.joint}, in its axes; rim ${quantity(most, "N", 3)}`),
    svg,
  );
}
