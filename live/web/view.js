// The scale of the view, and conversions between positions on the screen and in the plane.
const svg = document.getElementById("svg");
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
  exact: false, // whether positions are used without snapping
  width: 1,
  height: 1,
};

const MARGIN = 90; // [pixels] total free space on both sides of the mechanism, for names and symbols

// The size of the drawing area. It is read once, because reading it while marks change would force a new layout.
export function measure() {
  [view.width, view.height] = [svg.clientWidth || 1, svg.clientHeight || 1];
}
measure();

export function quantity(value, unit, digits = 3) {
  if (value === null || value === undefined || !Number.isFinite(value)) return "–";
  if (unit === "rad") return `${Number(((value * 180) / Math.PI).toPrecision(digits + 1))}°`;
  if (unit === "1" || unit === "") return String(Number(value.toPrecision(digits)));
  const shown = view.picture?.units[unit]; // the unit that the scene uses for such values
  if (shown) return `${Number((value * shown[0]).toPrecision(digits))} ${shown[1]}`;
  const prefixes = unit === "m"
    ? [[1, "m"], [1e-3, "mm"], [1e-6, "µm"], [1e-9, "nm"]]
    : unit === "s"
    ? [[3600, "h"], [1, "s"], [1e-3, "ms"]]
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

// Returns the grid step: 1, 2 or 5 times a power of ten, and at least `least` pixels.
export function gridStep(least = 12) {
  const raw = least / view.scale, power = 10 ** Math.floor(Math.log10(raw));
  return power * ([1, 2, 5, 10].find((each) => each * power >= raw));
}

// Returns the position at which a point can be dragged: its position at the start of the motion. If the scene cannot
// move, returns the drawn position.
export function handle(name) {
  const { picture, sheet, stale } = view, at = picture && !stale ? picture.points.indexOf(name) : -1;
  return at < 0 ? sheet?.points[name] ?? null : pointAt(at, 0);
}
export function pairAt(array, at, position) {
  const { values, shape } = view.picture.arrays[array], k = 2 * (at * shape[1] + position);
  return [values[k], values[k + 1]];
}
export const pointAt = (at, position) => pairAt("points", at, position);
const indexOf = (name) => view.picture?.points.indexOf(name) ?? -1;
export const pointNow = (name) => {
  const at = indexOf(name);
  return at < 0 ? view.sheet?.points[name] ?? null : pointAt(at, view.position);
};
export const enlarged = (place, by) => place.map((value, k) => value + (view.factor * by[k] || 0));
// Returns the position in the plane at which a point is drawn: the rigid position plus the enlarged displacement.
export const drawnNow = (name) => {
  const at = indexOf(name), place = pointNow(name);
  return at < 0 ? place : enlarged(place, pairAt("moved", at, view.position));
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
  const foot = document.querySelector(".hint").clientHeight, tall = view.height - foot - MARGIN;
  const scale = Math.min((view.width - MARGIN) / Math.max(r - l, 1e-3), tall / Math.max(t - b, 1e-3));
  Object.assign(view, { x: (l + r) / 2, y: (b + t) / 2 - foot / (2 * scale), scale });
}

// Sets the scale factor of displacements and the stress of the last colour. They do not change during a drag.
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
