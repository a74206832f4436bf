// Joints with bearings, pins and eyes: figures, forces in link axes, and loss of contact.
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
        text: ({ sense, figures: { joint_swing: swing } }) => sense + (swing ? `, ${figureAngle(swing)}` : ""),
      },
      {
        name: "fastest",
        text: ({ figures: { joint_rate: rate, bearing_speed: speed } }) =>
          rate ? rpmWords({ ...rate, value: Math.abs(rate.value) }) : figureWords(speed),
      },
      {
        name: "direction of the force",
        means: "in the axes of each link: a ring with a fixed direction has a point load, a ring with a rotating " +
          "direction needs a tight fit",
        text: rings,
      },
      { name: "contact lost at", wraps: true, text: (each) => contactWords(each.contact_lost) },
    ], "Joints with parts"),
    table(rows.flatMap(figures), [
      { name: "Joint", text: (each) => each.joint },
      { name: "Figure", text: (each) => each.name },
      {
        name: "value",
        text: ({ figure }) => figure.unit === "s" ? lifeWords(figure) : figureAngle(figure) + errorWords(figure),
      },
      { name: "at", text: (each) => (each.figure.drive ? atWords(each.figure) : "") },
    ], "Figures of the joints"),
    effects.length ? h("p", `${effects.join("; ")}.`) : null,
    h("div.polars", rows.flatMap((each) => [each.on, each.parent].map((link) => polar(each, link)))),
  );
}

// The first and the last of many instants, and their number.
function contactWords(lost) {
  const words = lost.map(whenWords);
  return words.length > 4 ? `${words.length} positions, from ${words[0]} to ${words.at(-1)}` : words.join("; ");
}

// Hodograph of the force on a link, i.e. the tip of the force vector over the cycle, in link axes with x' to the right.
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
    "figure.chart",
    h("figcaption", `Force on ${name} at ${joint.joint}, in its axes; rim ${quantity(most, "N", 3)}`),
    svg,
  );
}

partSections.push(jointsSection);
