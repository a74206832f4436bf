// Free places for words among lines and other words on the screen, for report and editor.
export const ABOVE = 11, BELOW = 3; // pixels that letters take above and below their foot
const LINE_HALF = 3; // pixels from the middle of a link to a word, at least
const SIDES = [[1, -1], [-1, -1], [1, 1], [-1, 1], [1.2, 0], [-1.2, 0], [0, -1.2], [0, 1.2]];

// Places around another: x, y of a name's foot, and 1 where it begins there, -1 where it ends, 0 where that is its
// middle.
export function around(/** @type {number[]} */ [x, y], far) {
  return [far, 2 * far, 3 * far].flatMap((away) =>
    SIDES.map(([dx, dy]) => [x + dx * away, y + dy * away + (dy > 0 ? ABOVE : dy < 0 ? 0 : ABOVE / 2), Math.sign(dx)])
  );
}

// Boxes for words, {wide, spots}: each takes the first of its spots that is free, or none. Free spots off the avoided
// lines come first.
export function freeBoxes(words, lines, [width, height], avoided = []) {
  const taken = [];
  const isFree = (box) =>
    box[0] >= 0 && box[1] >= 0 && box[2] <= width && box[3] <= height &&
    !taken.some((other) => overlap(other, box)) && !lines.some((line) => crosses(line, box, LINE_HALF));
  return words.map(({ wide, spots }) => {
    const free = spots.filter(([x, y]) => isFinite(x + y)).map((spot) => boxAt(spot, wide)).filter(isFree);
    const box = free.find((each) => !avoided.some((line) => crosses(line, each))) ?? free[0];
    if (box) taken.push(box);
    return box;
  });
}

// The box of words at a spot: left, top, right, bottom.
export function boxAt(/** @type {number[]} */ [x, y, lean], wide) {
  const left = x - ((1 - lean) / 2) * wide;
  return [left, y - ABOVE, left + wide, y + BELOW];
}

const SHARES_OF_LINE = [0.5, 0.35, 0.65, 0.2, 0.8], SIDES_OF_LINE = [[1, -1], [1.9, -1.9], [2.8, -2.8]];
// Spots for words beside a line: near it before far, at its middle before its ends. `at`: a place on it by its part.
export function besideLine(at, direction, far) {
  return SIDES_OF_LINE.flatMap((sides) =>
    SHARES_OF_LINE.flatMap((part) => sides.map((side) => aside(at(part), direction, side * far)))
  );
}

// A spot at a distance across a direction from a place; words lean away from it.
export function aside(/** @type {number[]} */ [x, y], /** @type {number[]} */ [dx, dy], far) {
  const level = Math.abs(dy) < 0.15, across = -far * dy;
  return [x + across, y + far * dx + 4, level ? 0 : Math.sign(across)];
}

const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// Whether a line passes through a box, widened by a margin: its parts within the box's width and within its height
// have some in common.
function crosses([[x0, y0], [x1, y1]], [left, top, right, foot], margin = 0) {
  let first = 0, last = 1;
  for (const [from, way, low, high] of [[x0, x1 - x0, left, right], [y0, y1 - y0, top, foot]]) {
    if (way === 0 && (from < low - margin || from > high + margin)) return false;
    if (way === 0) continue;
    const [one, other] = [(low - margin - from) / way, (high + margin - from) / way];
    first = Math.max(first, Math.min(one, other));
    last = Math.min(last, Math.max(one, other));
  }
  return first < last;
}
