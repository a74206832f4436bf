// Places labels among lines and other labels on the screen, for the report and the editor.
export const ABOVE = 11, BELOW = 3; // pixels that letters take above and below their foot
const LINK_HALF = 3, THIN_HALF = 1; // pixels from the middle of a line to a word, at least
const SIDES = [[1, -1], [-1, -1], [1, 1], [-1, 1], [1.2, 0], [-1.2, 0], [0, -1.2], [0, 1.2]];
const NEAR = [1, 2, 3], FAR = [4.5, 6]; // distances of words from their place; far words have a leader line
const CROSSING = 10, COVER = 1e4; // costs of a crossed thin line and of a covered link or word [pixels]

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
 * Boxes for words {wide, spots, always}: each takes its first free spot, or the one that hides the least of thin lines.
 * A word without a spot off links and other words has no box, unless it is always drawn. No box is outside. A box has
 * its leader line as its fifth entry.
 */
export function placedBoxes(words, links, thin, [width, height]) {
  const taken = [];
  const drawn = [...links.map((line) => withBounds(line, LINK_HALF, COVER)), ...thin.map(thinLine)];
  return words.map(({ wide, spots, always }) => {
    let best, least = always ? Infinity : COVER;
    for (const spot of spots) {
      const box = boxAt(spot, wide);
      if (!(box[0] >= 0 && box[1] >= 0 && box[2] <= width && box[3] <= height)) continue; // also if not a number
      const cost = costOf(box, taken, drawn, least);
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
  const leader = box[4] && thinLine(box[4]);
  for (const other of taken) if (overlap(other, box) || (leader && hidden(leader, other))) sum += COVER;
  for (const line of drawn) {
    if (sum >= limit) return sum;
    if (overlap(line.bounds, box)) sum += line.weight * hidden(line, box);
  }
  return sum;
}

const thinLine = (line) => withBounds(line, THIN_HALF, 1);

function withBounds([[x0, y0], [x1, y1]], half, weight) {
  const bounds = [Math.min(x0, x1) - half, Math.min(y0, y1) - half, Math.max(x0, x1) + half, Math.max(y0, y1) + half];
  return { from: [x0, y0], way: [x1 - x0, y1 - y0], half, weight, bounds };
}

// The box of a label at a spot: left, top, right, bottom, and the leader line if the spot is far away.
function boxAt([x, y, lean, from], wide) {
  const left = x - ((1 - lean) / 2) * wide, box = [left, y - ABOVE, left + wide, y + BELOW];
  const end = from && from.map((place, k) => Math.min(Math.max(place, box[k]), box[k + 2]));
  return [...box, from && [from, end]];
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
