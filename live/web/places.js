// Positions that a tool snaps to: points, positions on links and grid positions.
import { linkUnder, pointUnder } from "./links.js";
import { gridStep, handle, pointNow, toPlane, toScreen, view } from "./view.js";
import { $ } from "./state.js";

// Returns a position in the plane, aligned with another point or snapped to the grid.
export function snapped(screen, except) {
  let [x, y] = toPlane(screen);
  view.guides = [];
  if (view.exact) return [x, y].map((value) => Number(value.toPrecision(9)));
  if (!$("snap").checked) return [x, y];
  const step = gridStep(6), round = (value) => Math.round(value / step) * step, near = 7 / view.scale;
  let [fromX, fromY] = [null, null];
  for (const name of Object.keys(view.sheet?.points ?? {})) {
    const place = name === except ? null : handle(name);
    if (!place) continue;
    if (Math.abs(place[0] - x) < near && (!fromX || Math.abs(place[0] - x) < Math.abs(fromX[0] - x))) fromX = place;
    if (Math.abs(place[1] - y) < near && (!fromY || Math.abs(place[1] - y) < Math.abs(fromY[1] - y))) fromY = place;
  }
  [x, y] = [fromX ? fromX[0] : round(x), fromY ? fromY[1] : round(y)];
  const here = toScreen([x, y]);
  for (const from of [fromX, fromY]) {
    if (from) {
      const there = toScreen(from);
      view.guides.push(`M${there}L${here}`);
    }
  }
  return [x, y].map((value) => Number(value.toPrecision(9)));
}

// Returns the name of the point under the pointer. If there is no point, returns a position. Edits accept both.
export const picked = (screen) => pointUnder(screen) ?? snapped(screen);
const JOINED = 8, MIDDLE = 0.06; // largest distances: from a link [pixels]; from the middle of a line / its length
// Returns the end of a new link: a point, a position on a link (a new point of the link), or a free position.
export function joint(screen) {
  const point = pointUnder(screen), on = point ? null : linkUnder(screen, JOINED);
  if (!on?.link) return point ?? snapped(screen);
  view.guides = [];
  return { link: on.link, between: on.ends, share: shareOf(on) };
}
// Returns the fraction of a line at which a new point is added: the middle, or the nearest crossing with a grid line.
export function shareOf({ ends, t }) {
  if (view.exact) return t;
  if (!$("snap").checked) return Number(t.toFixed(3));
  if (Math.abs(t - 0.5) < MIDDLE) return 0.5;
  const [a, b] = ends.map(handle), k = Math.abs(b[0] - a[0]) < Math.abs(b[1] - a[1]) ? 1 : 0, step = gridStep(6);
  const share = (Math.round((a[k] + t * (b[k] - a[k])) / step) * step - a[k]) / (b[k] - a[k]);
  return share > 0 && share < 1 ? Number(share.toPrecision(12)) : t;
}
export const placed = (each) =>
  typeof each === "string" ? pointNow(each) : each.link ? onLink({ ends: each.between, t: each.share }) : each;

// Returns the direction from a point to a screen position. If snapping is on, its angle is a multiple of 5 degrees.
export function direction(point, screen) {
  const from = toScreen(pointNow(point)),
    step = Math.PI / 36,
    raw = Math.atan2(from[1] - screen[1], screen[0] - from[0]),
    angle = $("snap").checked ? Math.round(raw / step) * step : raw;
  return [Math.cos(angle), Math.sin(angle)];
}

// Returns the position at the fraction `t` of the line between two points.
export function onLink({ ends, t }) {
  const [a, b] = ends.map((name) => pointNow(name));
  return [0, 1].map((k) => Number((a[k] + (b[k] - a[k]) * t).toPrecision(6)));
}

export const near = (each, screen) => {
  const p = toScreen(placed(each));
  return Math.hypot(p[0] - screen[0], p[1] - screen[1]) < 14;
};

export const onGrid = (place) =>
  place.map((value) => Number((Math.round(value / gridStep(6)) * gridStep(6)).toPrecision(9)));
