// Places for words among lines and other words on the screen, for report and editor.
export const ABOVE = 11, BELOW = 3; // pixels that letters take above and below their foot
const FREE = 1; // pixels from a line to a word, at least
const SIDES = [[1, -1], [-1, -1], [1, 1], [-1, 1], [1.2, 0], [-1.2, 0], [0, -1.2], [0, 1.2]];
const NEAR = [1, 2, 3], FAR = [4.5, 6]; // distances of words from their place; far words have a leader line
const CROSSING = 10, OVERLAP = 1e4; // costs of a crossed line and of other words, in pixels of a hidden line

// Spots around a place: x, y of a name's foot, 1 where it begins there, -1 where it ends, 0 where that is its middle,
// and the place itself if it is far.
export function around(/** @type {number[]} */ [x, y], far, distances = [...NEAR, ...FAR]) {
  return distances.flatMap((away) =>
    SIDES.map(([dx, dy]) => {
      const height = dy > 0 ? ABOVE : dy < 0 ? 0 : ABOVE / 2;
      return [x + dx * away * far, y + dy * away * far + height, Math.sign(dx), away > NEAR.at(-1) ? [x, y] : null];
    })
  );
}

/**
 * Boxes for words {wide, spots}: each takes the first spot that is free, or hides as little as possible. Words that
 * would lie on others, or outside, have none. A box has its leader line as its fifth entry.
 * @param {any[]} lines [from, to, half width]; a wide line costs more
 */
export function placedBoxes(words, lines, [width, height]) {
  const taken = [], drawn = [...lines];
  const cost = (/** @type {any[]} */ [left, top, right, foot]) =>
    left < 0 || top < 0 || right > width || foot > height
      ? Infinity
      : drawn.reduce((sum, line) => sum + line[2] * hidden(line, [left, top, right, foot]), 0) +
        OVERLAP * taken.filter((other) => overlap(other, [left, top, right, foot])).length;
  return words.map(({ wide, spots }) => {
    let best, least = OVERLAP;
    for (const spot of spots) {
      const box = boxAt(spot, wide), here = cost(box);
      if (here < least) [best, least] = [box, here];
      if (here === 0) break;
    }
    if (best) taken.push(best);
    if (best?.[4]) drawn.push([...best[4], FREE]);
    return best;
  });
}

// The box of words at a spot: left, top, right, bottom, and the leader line to a far spot.
function boxAt([x, y, lean, from], wide) {
  const left = x - ((1 - lean) / 2) * wide, box = [left, y - ABOVE, left + wide, y + BELOW];
  const end = from && from.map((place, k) => Math.min(Math.max(place, box[k]), box[k + 2]));
  return [...box, from && [from, end]];
}

const SHARES_OF_LINE = [0.5, 0.35, 0.65, 0.2, 0.8], SIDES_OF_LINE = [[1, -1], [1.9, -1.9], [2.8, -2.8]];
// Spots for words beside a line: near it before far, at its middle before its ends. `at`: a place on it by its part.
export function besideLine(at, direction, far) {
  const near = SIDES_OF_LINE.flatMap((sides) =>
    SHARES_OF_LINE.flatMap((part) => sides.map((side) => aside(at(part), direction, side * far)))
  );
  return [...near, ...around(at(0.5), far, FAR)];
}

// A spot at a distance across a direction from a place; words lean away from it.
function aside(/** @type {number[]} */ [x, y], /** @type {number[]} */ [dx, dy], far) {
  const level = Math.abs(dy) < 0.15, across = -far * dy;
  return [x + across, y + far * dx + 4, level ? 0 : Math.sign(across)];
}

const overlap = (/** @type {any[]} */ a, /** @type {any[]} */ b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// Cost of a line that a box hides [pixels]: its length within the box's width and height, and a crossing.
function hidden([[x0, y0], [x1, y1], half], /** @type {any[]} */ [left, top, right, foot]) {
  let first = 0, last = 1;
  for (const [from, way, low, high] of [[x0, x1 - x0, left, right], [y0, y1 - y0, top, foot]]) {
    if (way === 0 && (from < low - half || from > high + half)) return 0;
    if (way === 0) continue;
    const [one, other] = [(low - half - from) / way, (high + half - from) / way];
    first = Math.max(first, Math.min(one, other));
    last = Math.min(last, Math.max(one, other));
  }
  return first < last ? CROSSING + (last - first) * Math.hypot(x1 - x0, y1 - y0) : 0;
}
