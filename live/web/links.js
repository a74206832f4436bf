// Links and cylinders of the drawing, and the search for points and links at a screen position.
import { drawnNow, pointAt, pointNow, toScreen, view } from "./view.js";

export const loop = (
  link,
) => (link.beams.length ? link.beams : link.points.slice(1).map((end, k) => [link.points[k], end]));
// A cylinder is one part in the drawing. The barrel, the rod and the middle point cannot be selected separately.
export const inCylinder = (link) => Object.values(view.sheet.cylinders).some(({ links }) => links.includes(link));
export const isMiddle = (point) => Object.values(view.sheet.cylinders).some(({ middle }) => middle === point);

// Returns the point nearest to a screen position, or null if no point is within `reach` pixels. Both the rigid and the
// deflected position of each point count. `linkUnder` does the same for links.
export function pointUnder(/** @type {number[]} */ [x, y], reach = 15) {
  let best = null, least = reach;
  for (const name of Object.keys(view.sheet?.points ?? {})) {
    if (isMiddle(name)) continue;
    for (const place of [pointNow(name), drawnNow(name)]) {
      const p = place && toScreen(place), away = p ? Math.hypot(p[0] - x, p[1] - y) : Infinity;
      if (away < least) [best, least] = [name, away];
    }
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
    for (const [ends, where] of loop(link).flatMap((ends) => [[ends, pointNow], [ends, drawnNow]])) {
      const [a, b] = ends.map(where).map((p) => p && toScreen(p));
      if (!a || !b) continue;
      const [dx, dy] = [b[0] - a[0], b[1] - a[1]],
        t = Math.max(0, Math.min(1, ((x - a[0]) * dx + (y - a[1]) * dy) / (dx * dx + dy * dy || 1))),
        away = Math.hypot(a[0] + t * dx - x, a[1] + t * dy - y);
      if (away < least) [best, least] = [{ link: link.name, cylinder: link.cylinder, ends, t }, away];
    }
  }
  return best;
}

// Returns the index of the position of the cycle at which a point of a link is nearest to `place`.
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
