// Places labels among lines and other labels on the screen, for the report and the editor.
export const ABOVE = 11, BELOW = 3; // pixels that letters take above and below their foot
const LINK_HALF = 3, THIN_HALF = 1; // pixels from the middle of a line to a word, at least
const SIDES = [[1, -1], [-1, -1], [1, 1], [-1, 1], [1.2, 0], [-1.2, 0], [0, -1.2], [0, 1.2]];
const NEAR = [1, 2, 3], FAR = [4.5, 6]; // distances of words from their place; far words have a leader line
const CROSSING = 10, COVER = 1e4; // costs of a crossed thin line and of a covered link or word [pixels]
const CLOSE = 16, CLEARER = 4; // pixels: a word without a leader line is so close to its link, and so much farther from others
const NEARER = 5; // pixels by which a name of a point without a leader line is nearer to its point than to others
const FEET = [0.1, 0.3, 0.5, 0.7, 0.9]; // positions along a line at which a leader line may end

// Spots around a point: x and y of the label's baseline, its alignment (1: begins there, -1: ends there, 0: centred),
// and the point itself if it is far away.
export function around(/** @type {number[]} */ [x, y], far, distances = [...NEAR, ...FAR]) {
  return distances.flatMap((away) =>
    SIDES.map(([dx, dy]) => {
      const height = dy > 0 ? ABOVE : dy < 0 ? 0 : ABOVE / 2;
      return [x + dx * away * far, y + dy * away * far + height, Math.sign(dx), away > NEAR.at(-1) ? [x, y] : null];
    })
  );
}

/**
 * Boxes for words {wide, spots, always, own, others, point, rivals}: each takes its first free spot, or the one that
 * hides the least of thin lines. A word without a spot off links and other words has no box, unless it is always drawn.
 * No box is outside. A box has its leader line as its fifth entry. `own` are the lines that a word names, and `others`
 * the lines with which it must not be confused: if the word is not clearly closest to its own lines, it has a leader
 * line. For a word that names a point, `point` and `rivals` have the same meaning.
 */
export function placedBoxes(words, links, thin, [width, height]) {
  const taken = [];
  const drawn = [...links.map((line) => withBounds(line, LINK_HALF, COVER)), ...thin.map(thinLine)];
  return words.map(({ wide, spots, always, own, others, point, rivals }) => {
    const feet = own && feetOn(own, others);
    let best, least = always ? Infinity : COVER;
    for (const spot of spots) {
      let box = boxAt(spot, wide);
      if (!(box[0] >= 0 && box[1] >= 0 && box[2] <= width && box[3] <= height)) continue; // also if not a number
      let cost = costOf(box, taken, drawn, least);
      if (cost >= least) continue;
      if (own) box = withLeader(box, own, others, feet);
      if (point) box = withLeaderToPoint(box, point, rivals);
      if (box[4]) cost += costOfLeader(box[4], taken);
      if (cost < least) [best, least] = [box, cost];
      if (cost === 0) break;
    }
    if (best) taken.push(best);
    if (best?.[4]) drawn.push(thinLine(best[4]));
    return best;
  });
}

// Cost of a box [pixels of a hidden thin line]; the sum ends as soon as it reaches the limit.
function costOf(/** @type {any[]} */ box, taken, drawn, limit) {
  let sum = 0;
  for (const other of taken) if (overlap(other, box)) sum += COVER;
  for (const line of drawn) {
    if (sum >= limit) return sum;
    if (overlap(line.bounds, box)) sum += line.weight * hidden(line, box);
  }
  return sum;
}

function costOfLeader(line, taken) {
  const leader = thinLine(line);
  return CROSSING + COVER * taken.filter((other) => hidden(leader, other)).length;
}

const thinLine = (line) => withBounds(line, THIN_HALF, 1);

function withBounds([[x0, y0], [x1, y1]], half, weight) {
  const bounds = [Math.min(x0, x1) - half, Math.min(y0, y1) - half, Math.max(x0, x1) + half, Math.max(y0, y1) + half];
  return { from: [x0, y0], way: [x1 - x0, y1 - y0], half, weight, bounds };
}

// The box of a label at a spot: left, top, right, bottom, and the leader line if the spot is far away.
function boxAt([x, y, lean, from], wide) {
  const left = x - ((1 - lean) / 2) * wide, box = [left, y - ABOVE, left + wide, y + BELOW];
  return [...box, from && leaderTo(from, box)];
}

// Points of lines at which a leader line may end: not close to other lines, if possible.
function feetOn(own, others) {
  const feet = own.flatMap(([[x, y], [u, v]]) => FEET.map((part) => [x + part * (u - x), y + part * (v - y)]));
  const apart = (foot) => others.every((line) => distance(foot, nearestOn(line, foot)) > CLEARER);
  const clear = feet.filter(apart);
  return clear.length ? clear : feet;
}

// The box with a leader line to the nearest foot, unless the box is clearly closest to its own lines.
function withLeader(/** @type {any[]} */ box, own, others, feet) {
  const far = Math.min(...own.map((line) => gap(box, line)));
  if (far <= CLOSE && others.every((line) => gap(box, line) >= far + CLEARER)) return [...box.slice(0, 4), null];
  const lengths = feet.map((foot) => away(box, foot)), foot = feet[lengths.indexOf(Math.min(...lengths))];
  return [...box.slice(0, 4), leaderTo(foot, box)];
}

// The box with a leader line to its point, unless the box is clearly nearer to this point than to the others.
function withLeaderToPoint(/** @type {any[]} */ box, point, rivals) {
  const far = away(box, point) + NEARER;
  return box[4] || rivals.every((other) => away(box, other) >= far) ? box : [...box.slice(0, 4), leaderTo(point, box)];
}

// Ends of a leader line from a foot to the edge of a box.
const leaderTo = (/** @type {number[]} */ foot, /** @type {any[]} */ box) => [
  foot,
  foot.map((place, k) => Math.min(Math.max(place, box[k]), box[k + 2])),
];

const distance = (/** @type {number[]} */ [x, y], /** @type {number[]} */ [u, v]) => Math.hypot(u - x, v - y);

// Distance of a point from a box.
const away = (box, /** @type {number[]} */ [x, y]) =>
  Math.hypot(Math.max(box[0] - x, 0, x - box[2]), Math.max(box[1] - y, 0, y - box[3]));

// Distance of a line from a box.
function gap(box, line) {
  if (hidden(thinLine(line), box)) return 0;
  const corners = [[box[0], box[1]], [box[2], box[1]], [box[2], box[3]], [box[0], box[3]]];
  const across = corners.map((corner) => distance(corner, nearestOn(line, corner)));
  return Math.min(...across, ...line.map((end) => away(box, end)));
}

// The point of a line that is nearest to a place.
function nearestOn([[x0, y0], [x1, y1]], /** @type {number[]} */ [x, y]) {
  const [dx, dy] = [x1 - x0, y1 - y0], square = dx * dx + dy * dy;
  const part = square ? Math.min(Math.max(((x - x0) * dx + (y - y0) * dy) / square, 0), 1) : 0;
  return [x0 + part * dx, y0 + part * dy];
}

const SHARES_OF_LINE = [0.5, 0.35, 0.65, 0.2, 0.8], SIDES_OF_LINE = [[1, -1], [1.9, -1.9], [2.8, -2.8]];
// Spots next to a line, ordered by distance from the line and from its middle. `at` is a fraction of the line.
export function besideLine(at, direction, far) {
  const near = SIDES_OF_LINE.flatMap((sides) =>
    SHARES_OF_LINE.flatMap((part) => sides.map((side) => aside(at(part), direction, side * far)))
  );
  return [...near, ...around(at(0.5), far, FAR)];
}

// A spot at a distance from a point, perpendicular to a direction. The label is aligned away from the point.
function aside(/** @type {number[]} */ [x, y], /** @type {number[]} */ [dx, dy], far) {
  const level = Math.abs(dy) < 0.15, across = -far * dy;
  return [x + across, y + far * dx + 4, level ? 0 : Math.sign(across)];
}

const overlap = (/** @type {any[]} */ a, /** @type {any[]} */ b) =>
  a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// Cost of a line that a box hides [pixels]: its length within the box's width and height, and a crossing.
function hidden({ from, way, half }, /** @type {any[]} */ box) {
  let first = 0, last = 1;
  for (const k of [0, 1]) {
    const low = box[k] - half - from[k], high = box[k + 2] + half - from[k];
    if (way[k] === 0 && (low > 0 || high < 0)) return 0;
    if (way[k] === 0) continue;
    first = Math.max(first, Math.min(low / way[k], high / way[k]));
    last = Math.min(last, Math.max(low / way[k], high / way[k]));
  }
  return first < last ? CROSSING + (last - first) * Math.hypot(...way) : 0;
}
