// The drawing: parts as the text draws them, and the mechanism as it moves, bends and is stressed.
import { isUnder, markAttributes } from "./symbols.js";
/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
const svg = $("svg"), NS = "http://www.w3.org/2000/svg", STOPS = [[33, 102, 172], [217, 183, 74], [178, 24, 43]];
/** @type {Record<string, any>} */
export const view = {
  x: 0,
  y: 0,
  scale: 400,
  factor: 1,
  most: 0,
  position: 0,
  sheet: null,
  picture: null,
  stale: false,
  chosen: null,
  preview: null,
  guides: [],
  cursor: null,
  paths: true,
  sizes: false,
  trace: null,
  width: 1,
  height: 1,
};

// The stage's size, read once: reading it while marks change would lay the page out anew each time.
export function measure() {
  [view.width, view.height] = [svg.clientWidth || 1, svg.clientHeight || 1];
}
measure();

export function quantity(value, unit, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (unit === "rad") return `${Number(((value * 180) / Math.PI).toPrecision(digits + 1))}°`;
  if (unit === "1" || unit === "") return String(Number(value.toPrecision(digits)));
  const told = view.picture?.units[unit]; // the scene's own unit
  if (told) return `${Number((value * told[0]).toPrecision(digits))} ${told[1]}`;
  const prefixes = unit === "m"
    ? [[1, "m"], [1e-3, "mm"], [1e-6, "µm"]]
    : /^(N|Pa|W|N m)$/.test(unit)
    ? [[1e9, `G${unit}`], [1e6, `M${unit}`], [1e3, `k${unit}`], [1, unit], [1e-3, `m${unit}`]]
    : [[1, unit]];
  const [factor, name] = prefixes.find(([each]) => (Math.abs(value) || 1) >= 0.9995 * each) ?? prefixes.at(-1);
  return `${Number((value / factor).toPrecision(digits))} ${name}`;
}

/** @type {(place: number[]) => [number, number]} */
export const toScreen = (
  [x, y],
) => [view.width / 2 + (x - view.x) * view.scale, view.height / 2 - (y - view.y) * view.scale];
/** @type {(place: number[]) => [number, number]} */
export const toPlane = (
  [x, y],
) => [view.x + (x - view.width / 2) / view.scale, view.y - (y - view.height / 2) / view.scale];

// Grid steps are 1, 2 or 5 times a power of ten, and no closer than some pixels.
export function gridStep(least = 12) {
  const raw = least / view.scale, power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5, 10].find((each) => each * power >= raw));
}

// A point where it can be taken: at the start of the motion, or as drawn where nothing moves.
export function handle(name) {
  const { picture, sheet, stale } = view, at = picture && !stale ? picture.points.indexOf(name) : -1;
  return at < 0 ? sheet?.points[name] ?? null : pointAt(at, 0);
}
function pointAt(at, position) {
  const { values, shape } = view.picture.arrays.points, k = 2 * (at * shape[1] + position);
  return [values[k], values[k + 1]];
}
export const pointNow = (name) => {
  const at = view.picture?.points.indexOf(name) ?? -1;
  return at < 0 ? view.sheet?.points[name] ?? null : pointAt(at, view.position);
};

export function fit() {
  const places = Object.values(view.sheet?.points ?? {});
  if (view.picture) places.push(...view.picture.extent);
  if (!places.length) {
    Object.assign(view, { x: 0.2, y: 0.1, scale: view.width / 0.7 });
    return;
  }
  const span = (k) => [Math.min(...places.map((p) => p[k])), Math.max(...places.map((p) => p[k]))],
    [[l, r], [b, t]] = [span(0), span(1)];
  Object.assign(view, {
    x: (l + r) / 2,
    y: (b + t) / 2,
    scale: Math.min((view.width - 90) / Math.max(r - l, 1e-3), (view.height - 90) / Math.max(t - b, 1e-3)),
  });
}

// The factor by which displacements are drawn, and the stress of the last colour: kept while something is dragged.
export function rescale() {
  const { picture } = view;
  if (!picture?.arrays.bent) return;
  let largest = 0, most = 0, extent = 0;
  const { bent, stress, points } = picture.arrays;
  for (const value of bent.values) if (Math.abs(value) > largest) largest = Math.abs(value);
  for (const value of stress.values) if (value > most) most = value;
  for (const value of points.values) {
    if (Math.abs(value - points.values[0]) > extent) extent = Math.abs(value - points.values[0]);
  }
  view.most = most;
  if (!largest) {
    view.factor = 1;
    return;
  }
  const raw = (0.06 * extent) / largest, power = 10 ** Math.floor(Math.log10(raw));
  view.factor = Math.max(1, power * [5, 2, 1].find((each) => each * power <= raw));
}

const colour = (share) => {
  const t = Math.max(0, Math.min(1, share)) * 2, k = Math.min(1, Math.floor(t));
  return `rgb(${STOPS[k].map((c, i) => Math.round(c + (STOPS[k + 1][i] - c) * (t - k))).join(",")})`;
};

const px = (place) => {
  const [x, y] = toScreen(place);
  return `${x.toFixed(1)},${y.toFixed(1)}`;
};
const layers = Object.fromEntries(
  [
    "grid",
    "trace",
    "paths",
    "under",
    "chosen",
    "drawn",
    "rigid",
    "last",
    "bent",
    "symbols",
    "names",
    "sizes",
    "guides",
    "pins",
  ]
    .map((name) => {
      const layer = document.createElementNS(NS, "g");
      layer.setAttribute("class", name === "grid" ? "grid" : "");
      layer.id = `layer-${name}`;
      svg.append(layer);
      return [name, layer];
    }),
);

// A layer's marks, made of as many elements as before where that is so: only attributes change while something moves.
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

const loop = (link) => (link.beams.length ? link.beams : link.points.slice(1).map((end, k) => [link.points[k], end]));
const linkPath = (link, place) =>
  loop(link).map((ends) => ends.map(place)).filter((ends) => ends.every(Boolean)).map(([a, b]) => `M${px(a)}L${px(b)}`)
    .join("");

// A cylinder is drawn as one: its barrel, its rod and the point that fixes the line between them are no parts to take.
const inCylinder = (link) => Object.values(view.sheet.cylinders).some(({ links }) => links.includes(link));
const isMiddle = (point) => Object.values(view.sheet.cylinders).some(({ middle }) => middle === point);
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
  const place = (name) => (live ? pointNow(name) : sheet.points[name]);
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
  const rigid = [], bent = [], last = [];
  if (picture?.arrays.bent) {
    const { ends, bent: moved, stress } = picture.arrays, count = ends.shape[2], stations = moved.shape[2];
    const end = (beam, which, k) => {
      const at = 2 * ((beam * 2 + which) * count + k);
      return [ends.values[at], ends.values[at + 1]];
    };
    picture.beams.forEach((_, beam) => {
      const [a, b] = [end(beam, 0, i), end(beam, 1, i)];
      rigid.push(["path", { class: stale ? "bar0 stale" : "bar0", d: `M${px(a)}L${px(b)}` }]);
      if (!picture.closes.all) {
        last.push(["path", { class: "last", d: `M${px(end(beam, 0, count - 1))}L${px(end(beam, 1, count - 1))}` }]);
      }
      let from = null;
      for (let s = 0; s < stations; s++) {
        const at = (beam * count + i) * stations + s, xi = s / (stations - 1);
        const to = px([0, 1].map((c) => a[c] + (b[c] - a[c]) * xi + view.factor * moved.values[2 * at + c]));
        if (from && !to.includes("NaN")) {
          const size = (stress.values[at] + stress.values[at - 1]) / 2;
          bent.push(["path", {
            class: stale ? "bent stale" : "bent",
            d: `M${from}L${to}`,
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
  symbols(sheet, place, live, picture, i);
  fill("sizes", sizes(sheet, place));
  fill("guides", [
    ...view.guides.map((d) => ["path", { class: "guide", d }]),
    ...(view.preview ? [["path", { class: "preview", d: `M${view.preview.map(px).join("L")}` }]] : []),
    ...(view.cursor ? [["path", { class: "cursor", d: crosshair(toScreen(view.cursor)) }]] : []),
  ]);
}

// Lengths and angles: of the chosen link, of the links at the chosen point, of all where wished; and of what is drawn.
function sizes(sheet, place) {
  const { chosen, preview } = view;
  const wished = ({ name, points }) =>
    view.sizes || (chosen?.kind === "link" && chosen.name === name) ||
    (chosen?.kind === "point" && points.includes(chosen.name));
  const links = sheet.links.filter((link) => link.name !== "ground" && !inCylinder(link.name) && wished(link));
  const lines = links.flatMap((link) => loop(link).map((ends) => ends.map(place)));
  if (preview?.length > 1) lines.push(preview.slice(-2));
  return lines.filter(([a, b]) => a && b).map(([a, b]) => {
    const [dx, dy] = [b[0] - a[0], b[1] - a[1]], [x, y] = toScreen([(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]);
    const words = `${quantity(Math.hypot(dx, dy), "m", 4)}, ${quantity(Math.atan2(dy, dx), "rad", 3)}`;
    return ["text", { class: "size", x: x.toFixed(1), y: (y - 8).toFixed(1), "text-anchor": "middle" }, words];
  });
}

const crosshair = (/** @type {number[]} */ [x, y]) => `M${x - 22},${y}h16m12,0h16M${x},${y - 22}v16m0,12v16`;

const NEAR_UNIT = 8.5; // [pixels] size of a symbol
const pair = (name, k, i) => {
  const { values, shape } = view.picture.arrays[name], n = 2 * (k * shape[1] + i);
  return [values[n], values[n + 1]];
};

// Marks of the moving scene, or of its tables as long as it does not move.
function symbols(sheet, place, live, picture, i) {
  const local = ({ link, local: [x, y] }) => {
    const [ox, oy] = pair("origin", link, i), [c, s] = pair("direction", link, i);
    return [ox + c * x - s * y, oy + s * x + c * y];
  };
  const way = ({ spin, axis }) => {
    if (live && spin !== null) return pair("spin", spin, i);
    if (!axis) return [1, 0];
    const [c, s] = live ? pair("direction", axis.link, i) : [1, 0], [x, y] = axis.way;
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
  fill("under", marks.filter(isUnder).map((mark) => path(mark)));
  fill("symbols", marks.filter((mark) => !isUnder(mark)).map((mark) => path(mark)));
  const pins = sheet.pins.filter(({ at }) => place(at.point)),
    chosen = view.chosen?.kind === "point" && view.chosen.name;
  fill(
    "pins",
    pins.map((mark) => {
      const name = mark.at.point, kind = `mark ${mark.kind}${mark.kind === "pin" ? "" : " pin"}`;
      return path(mark, { "data-point": name, class: name === chosen ? `${kind} picked` : kind });
    }),
  );
  fill(
    "names",
    pins.map(({ at: { point } }) => {
      const [x, y] = toScreen(place(point));
      return ["text", { x: x + 10, y: y - 9 }, point];
    }),
  );
}

// The nearest point or link to a place on the screen, within some pixels.
export function pointUnder(/** @type {number[]} */ [x, y], reach = 15) {
  let best = null, least = reach;
  for (const name of Object.keys(view.sheet?.points ?? {})) {
    const place = isMiddle(name) ? null : pointNow(name),
      p = place && toScreen(place),
      away = p ? Math.hypot(p[0] - x, p[1] - y) : Infinity;
    if (away < least) [best, least] = [name, away];
  }
  return best;
}
export function linkUnder(/** @type {number[]} */ [x, y], reach = 11, without = null) {
  let best = null, least = reach;
  const cylinders = Object.entries(view.sheet?.cylinders ?? {}).map(([name, { from, to }]) => ({
    cylinder: name,
    points: [from, to],
    beams: [],
  }));
  for (const link of [...(view.sheet?.links ?? []), ...cylinders]) {
    if (link.name === "ground" || inCylinder(link.name) || link.points.includes(without)) continue;
    for (const ends of loop(link)) {
      const [a, b] = ends.map((name) => pointNow(name)).map((p) => p && toScreen(p));
      if (!a || !b) continue;
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]],
        t = Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1))),
        away = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
      if (away < least) [best, least] = [{ link: link.name, cylinder: link.cylinder, ends, t }, away];
    }
  }
  return best;
}

// The position in which a place on a link is nearest to a place in the plane.
export function nearestPosition({ ends, t }, place) {
  const { picture } = view, [a, b] = ends.map((name) => picture?.points.indexOf(name) ?? -1);
  if (a < 0 || b < 0) return view.position;
  let best = view.position, least = Infinity;
  for (let k = 0; k < picture.positions; k++) {
    const [p, q] = [pointAt(a, k), pointAt(b, k)],
      away = Math.hypot(p[0] + (q[0] - p[0]) * t - place[0], p[1] + (q[1] - p[1]) * t - place[1]) +
        1e-9 * Math.abs(k - view.position);
    if (away < least) [best, least] = [k, away];
  }
  return best;
}
