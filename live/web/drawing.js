// Draws the grid, and the mechanism with its symbols, motion, deflection and stress.
import { inCylinder, isMiddle, loop } from "./links.js";
import { around, BELOW, besideLine, placedBoxes } from "./placing.js";
import { isUnder, markAttributes, markLines } from "./symbols.js";
import { drawnNow, enlarged, gridStep, pairAt, pointAt, pointNow, quantity, toPlane, toScreen, view } from "./view.js";

// Layers of the drawing, from back to front.
const svg = document.getElementById("svg"), NS = "http://www.w3.org/2000/svg";
const NAMES = "grid trace paths under chosen drawn rigid last bent symbols names sizes guides pins";
const layers = Object.fromEntries(
  NAMES.split(" ").map((name) => {
    const layer = document.createElementNS(NS, "g");
    layer.setAttribute("class", name === "grid" ? "grid" : "");
    layer.id = `layer-${name}`;
    svg.append(layer);
    return [name, layer];
  }),
);

// Draws the elements of a layer. Existing elements with the same tag are reused: only changed attributes are updated.
function fill(name, marks) {
  const layer = layers[name];
  while (layer.childNodes.length > marks.length) layer.lastChild.remove();
  marks.forEach(([tag, attributes, words], k) => {
    let node = layer.children[k];
    if (!node || node.tagName !== tag) {
      const fresh = document.createElementNS(NS, tag);
      if (node) node.replaceWith(fresh);
      else layer.append(fresh);
      node = fresh;
    }
    for (const attribute of [...node.attributes]) {
      if (!(attribute.name in attributes)) node.removeAttribute(attribute.name);
    }
    for (const [key, value] of Object.entries(attributes)) {
      if (node.getAttribute(key) !== String(value)) node.setAttribute(key, value);
    }
    if (words !== undefined && node.textContent !== words) node.textContent = words;
  });
}

const STOPS = [[33, 102, 172], [217, 183, 74], [178, 24, 43]]; // colours of the smallest, middle and largest stress

const colour = (share) => {
  const t = Math.max(0, Math.min(1, share)) * 2, k = Math.min(1, Math.floor(t));
  return `rgb(${STOPS[k].map((c, i) => Math.round(c + (STOPS[k + 1][i] - c) * (t - k))).join(",")})`;
};

const LETTER = 7.2, NAME_AWAY = 10, SIZE_AWAY = 13; // [pixels] letter width, distances of names and dimensions
const inPixels = ([x, y]) => `${x.toFixed(1)},${y.toFixed(1)}`;
const px = (place) => inPixels(toScreen(place));
const linkPath = (link, place) =>
  loop(link).map((ends) => ends.map(place)).filter((ends) => ends.every(Boolean)).map(([a, b]) => `M${px(a)}L${px(b)}`)
    .join("");

export function drawGrid() {
  const step = gridStep(40), [left, top] = toPlane([0, 0]), [right, bottom] = toPlane([view.width, view.height]);
  let lines = "", axes = "";
  for (let k = Math.ceil(left / step); k * step < right; k++) {
    const [x] = toScreen([k * step, 0]);
    const mark = `M${x.toFixed(1)},0V${view.height}`;
    if (k) lines += mark;
    else axes += mark;
  }
  for (let k = Math.ceil(bottom / step); k * step < top; k++) {
    const [, y] = toScreen([0, k * step]);
    const mark = `M0,${y.toFixed(1)}H${view.width}`;
    if (k) lines += mark;
    else axes += mark;
  }
  fill("grid", [["path", { d: lines || "M0,0" }], ["path", { d: axes || "M0,0", class: "axis" }], ["text", {
    x: view.width - 8,
    y: view.height - 8,
    "text-anchor": "end",
  }, `grid ${quantity(step, "m")}`]]);
  const { trace } = view;
  if (!trace) return fill("trace", []);
  const [x, y] = toScreen([trace.left, trace.bottom]), width = trace.width * view.scale, height = width * trace.ratio;
  fill("trace", [["image", {
    href: trace.address,
    x,
    y: y - height,
    width,
    height,
    opacity: trace.opacity,
    preserveAspectRatio: "none",
  }]]);
}

export function draw() {
  const { sheet, picture, stale } = view;
  if (!sheet) return;
  const i = Math.min(view.position, (picture?.positions ?? 1) - 1), live = picture && !stale;
  const place = (name) => (live ? drawnNow(name) : sheet.points[name]);
  const inBeams = new Set(live ? picture.beams.map(({ link }) => link) : []);
  const moving = sheet.links.filter(({ name }) => name !== "ground" && !inCylinder(name));
  const cylinder = view.chosen?.kind === "cylinder" ? sheet.cylinders[view.chosen.name] : null;
  const chosen = view.chosen?.kind === "link"
    ? sheet.links.find(({ name }) => name === view.chosen.name)
    : cylinder && { points: [cylinder.from, cylinder.to], beams: [] };
  fill("chosen", chosen ? [["path", { class: "chosen", d: linkPath(chosen, place) || "M0,0" }]] : []);
  fill(
    "drawn",
    moving.filter(({ name }) => !inBeams.has(name)).flatMap((link) => {
      const ring = link.points.length > 2 ? link.points.map(place).filter(Boolean) : [];
      return [...(ring.length ? [["path", { class: "plate", d: `M${ring.map(px).join("L")}Z` }]] : []), ["path", {
        class: "drawn",
        d: linkPath(link, place) || "M0,0",
      }]];
    }),
  );
  fill(
    "paths",
    view.paths && picture
      ? picture.points.map((_, at) => {
        const { shape } = picture.arrays.points, count = shape[1];
        if (count < 2 || isMiddle(picture.points[at])) return null;
        const [a, b] = [pointAt(at, 0), pointAt(at, count >> 1)];
        if (
          Math.hypot(a[0] - b[0], a[1] - b[1]) * view.scale < 1 &&
          Math.hypot(a[0] - pointAt(at, count >> 2)[0], a[1] - pointAt(at, count >> 2)[1]) * view.scale < 1
        ) return null;
        let d = "";
        for (let k = 0; k < count; k++) d += `${k ? "L" : "M"}${px(pointAt(at, k))}`;
        return ["path", { class: stale ? "path stale" : "path", d: picture.turn && picture.closes.all ? `${d}Z` : d }];
      }).filter(Boolean)
      : [],
  );
  const rigid = [], bent = [], last = [], lines = [];
  for (const link of moving) {
    for (const ends of loop(link)) {
      const line = ends.map(place);
      if (line.every(Boolean)) lines.push(line.map(toScreen));
    }
  }
  if (picture?.arrays.bent) {
    const { ends, bent: moved, stress } = picture.arrays, count = ends.shape[2], stations = moved.shape[2];
    const end = (beam, which, k) => {
      const at = 2 * ((beam * 2 + which) * count + k);
      return [ends.values[at], ends.values[at + 1]];
    };
    picture.beams.forEach((_, beam) => {
      const [a, b] = [end(beam, 0, i), end(beam, 1, i)];
      lines.push([toScreen(a), toScreen(b)]);
      rigid.push(["path", { class: stale ? "bar0 stale" : "bar0", d: `M${px(a)}L${px(b)}` }]);
      if (!picture.closes.all) {
        last.push(["path", { class: "last", d: `M${px(end(beam, 0, count - 1))}L${px(end(beam, 1, count - 1))}` }]);
      }
      let from = null;
      for (let s = 0; s < stations; s++) {
        const at = (beam * count + i) * stations + s, xi = s / (stations - 1);
        const to = toScreen([0, 1].map((c) => a[c] + (b[c] - a[c]) * xi + view.factor * moved.values[2 * at + c]));
        if (from && to.every(Number.isFinite)) {
          lines.push([from, to]);
          const size = (stress.values[at] + stress.values[at - 1]) / 2;
          bent.push(["path", {
            class: stale ? "bent stale" : "bent",
            d: `M${inPixels(from)}L${inPixels(to)}`,
            stroke: Number.isFinite(size) && view.most ? colour(size / view.most) : "var(--accent)",
          }]);
        }
        from = to;
      }
    });
  }
  fill("rigid", rigid);
  fill("bent", bent);
  fill("last", last);
  const thin = symbols(sheet, place, live, picture, i);
  fillWords(sheet, place, lines, thin, live ? pointNow : place);
  fill("guides", [
    ...view.guides.map((d) => ["path", { class: "guide", d }]),
    ...(view.preview ? [["path", { class: "preview", d: `M${view.preview.map(px).join("L")}` }]] : []),
    ...(view.cursor ? [["path", { class: "cursor", d: crosshair(toScreen(view.cursor)) }]] : []),
  ]);
}

// Draws the names of points and the dimensions of links. Text does not cover links or other text. If there is enough
// space, text does not cover symbols either. The text of the selected link or point is always drawn.
function fillWords(sheet, place, links, thin, rigid) {
  const word = (words, spots, always) => ({ words, spots, always, wide: LETTER * words.length + 2 });
  const { chosen, preview } = view, isChosen = (point) => chosen?.kind === "point" && chosen.name === point;
  const pins = sheet.pins.map(({ at: { point } }) => point).filter(place);
  const names = pins.map((point) => word(point, around(toScreen(place(point)), NAME_AWAY), isChosen(point)));
  const ofLine = ([[x0, y0], [x1, y1]]) => {
    const [dx, dy] = [x1 - x0, y1 - y0], long = Math.hypot(dx, dy) || 1;
    return besideLine((part) => [x0 + part * dx, y0 + part * dy], [dx / long, dy / long], SIZE_AWAY);
  };
  const all = [
    ...names,
    ...sizes(sheet, place, rigid).map(([line, words]) => word(words, ofLine(line), chosen || preview)),
  ];
  const boxes = placedBoxes(all, links, thin, [view.width, view.height]);
  const texts = boxes.map((box, k) => {
    const place = box ? { x: box[0].toFixed(1), y: (box[3] - BELOW).toFixed(1) } : { display: "none" };
    return ["text", { class: k < names.length ? "name" : "size", ...place }, all[k].words];
  });
  const leaders = boxes.map((box) => (box?.[4] ? `M${box[4].map(inPixels).join("L")}` : "")).join("");
  fill("names", texts.slice(0, names.length));
  fill("sizes", [...texts.slice(names.length), ["path", { class: "leader", d: leaders || "M0,0" }]]);
}

// Returns lines and their dimensions (length and angle): of the selected link, of the links at the selected point, or
// of all links if the user has switched dimensions on. The part that is being drawn also has dimensions.
function sizes(sheet, place, rigid) {
  const { chosen, preview } = view;
  const wished = ({ name, points }) =>
    view.sizes || (chosen?.kind === "link" && chosen.name === name) ||
    (chosen?.kind === "point" && points.includes(chosen.name));
  const links = sheet.links.filter((link) => link.name !== "ground" && !inCylinder(link.name) && wished(link));
  const lines = links.flatMap((link) => loop(link).map((ends) => [ends.map(place), ends.map(rigid)]));
  if (preview?.length > 1) lines.push([preview.slice(-2), preview.slice(-2)]);
  return lines.filter(([ends]) => ends.every(Boolean)).map(([ends, [a, b]]) => {
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]];
    const words = `${quantity(Math.hypot(dx, dy), "m", 4)}, ${quantity(Math.atan2(dy, dx), "rad", 3)}`;
    return [ends.map(toScreen), words];
  });
}

const crosshair = (/** @type {number[]} */ [x, y]) => `M${x - 22},${y}h16m12,0h16M${x},${y - 22}v16m0,12v16`;

const NEAR_UNIT = 8.5; // [pixels] symbol size

// Draws the marks of the moving scene. If the scene cannot move, draws the marks as in the tables. Returns the lines of
// all marks.
function symbols(sheet, place, live, picture, i) {
  const local = ({ link, local: [x, y] }) => {
    const [ox, oy] = pairAt("origin", link, i),
      [c, s] = pairAt("direction", link, i),
      [u, v] = pairAt("shift", link, i);
    const arm = [c * x - s * y, s * x + c * y],
      { values, shape } = picture.arrays.angle,
      turn = values[link * shape[1] + i];
    return enlarged([ox + arm[0], oy + arm[1]], [u - turn * arm[1], v + turn * arm[0]]);
  };
  const way = ({ x_axis: number, axis }) => {
    if (live && number !== null) return pairAt("x_axis", number, i);
    if (!axis) return [1, 0];
    const [c, s] = live ? pairAt("direction", axis.link, i) : [1, 0], [x, y] = axis.way;
    return [c * x - s * y, s * x + c * y];
  };
  const frame = {
    scale: view.scale,
    unit: NEAR_UNIT,
    at: (spot) => {
      const spotPlace = spot.point ? place(spot.point) : local(spot);
      return spotPlace && toScreen(spotPlace);
    },
    way,
    mirrored: (drive) => live && picture.arrays.rate.values[drive * picture.positions + i] < 0,
    colour: () => "var(--ink)",
  };
  const path = (mark, more = {}) => ["path", { ...markAttributes(mark, frame), ...more }];
  const marks = [...(live ? picture.marks : sheet.marks ?? []), ...sheet.discs];
  const under = marks.filter(isUnder).map((mark) => path(mark));
  const over = marks.filter((mark) => !isUnder(mark)).map((mark) => path(mark));
  fill("under", under);
  fill("symbols", over);
  const pins = sheet.pins.filter(({ at }) => place(at.point)),
    chosen = view.chosen?.kind === "point" && view.chosen.name;
  const points = pins.map((mark) => {
    const name = mark.at.point, kind = `mark ${mark.kind}${mark.kind === "pin" ? "" : " pin"}`;
    return path(mark, { "data-point": name, class: name === chosen ? `${kind} picked` : kind });
  });
  fill("pins", points);
  return [...under, ...over, ...points].flatMap(([, attributes]) => markLines(attributes));
}
