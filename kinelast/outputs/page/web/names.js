// Names in the picture: on no link, on no other name, and within the frame.
const ABOVE = 11, BELOW = 3; // pixels that letters take above and below their foot
const SIDES = [[1, -1], [-1, -1], [1, 1], [-1, 1], [1.2, 0], [-1.2, 0], [0, -1.2], [0, 1.2]];

// Points come before links where there is no room for all names.
function nameAll(i) {
  const place = ({ link, point }) => at(drawnPlace(link, point, i, view.factor));
  const points = parts.points.map((each) => ({ text: each.text, spots: around(place(each), 0.9 * stage.unit) }));
  const links = parts.labels.filter(({ text }) => text).map(({ k, text }) => ({ text, spots: besideLink(k, i) }));
  placeNames([...points, ...links], linesDrawn(i), [stage.width, stage.height]);
}

// Beside the middle of a link's beam and then nearer to its ends; around the middle of a link without beams.
function besideLink(k, i) {
  const beam = model.beams.findIndex((each) => each.link === k);
  if (beam < 0) {
    const places = Object.keys(model.links[k].points).map((point) => drawnPlace(k, point, i, view.factor));
    return around(at(scaled(1 / places.length, places.reduce(plus))), 1.3 * stage.unit);
  }
  const [dx, dy] = beamDirection(beam, i), level = Math.abs(dy) < 0.15;
  return [0.5, 0.35, 0.65, 0.2, 0.8].flatMap((part) =>
    [-1.3, 1.3, -2.4, 2.4].map((far) => {
      const [x, y] = at(drawnOnBeam(beam, part, i, view.factor)), aside = -far * dy * stage.unit;
      return [x + aside, y - far * dx * stage.unit + 4, level ? 0 : Math.sign(aside)];
    })
  );
}

// The links as they are drawn: lines on the screen.
function linesDrawn(i) {
  const parts = [0, 0.25, 0.5, 0.75, 1];
  const beams = model.beams.map((_, k) => parts.map((part) => at(drawnOnBeam(k, part, i, view.factor))));
  const plates = bareLinks.map((k) => ring(k, i, view.factor).map(at));
  const outlines = [...beams, ...plates.map((corners) => [...corners, corners[0]])];
  return outlines.flatMap((places) => places.slice(1).map((to, n) => [places[n], to]));
}

// Places around another: x, y of a name's foot, and 1 where it begins there, -1 where it ends, 0 where that is its
// middle.
function around(/** @type {number[]} */ [x, y], far) {
  return [far, 2 * far, 3 * far].flatMap((away) =>
    SIDES.map(([dx, dy]) => [x + dx * away, y + dy * away + (dy > 0 ? ABOVE : dy < 0 ? 0 : ABOVE / 2), Math.sign(dx)])
  );
}

// Names: {text, spots}. Each takes the first of its places that is free; where none is it is left out.
function placeNames(names, lines, [width, height]) {
  const taken = [];
  const isFree = (box) =>
    box[0] >= 0 && box[1] >= 0 && box[2] <= width && box[3] <= height &&
    !taken.some((other) => overlap(other, box)) && !lines.some((line) => crosses(line, box));
  for (const { text, spots } of names) {
    const wide = (text.wide ??= text.getComputedTextLength() + 2);
    const boxes = spots.filter(([x, y]) => isFinite(x + y)).map(([x, y, lean]) => {
      const left = x - ((1 - lean) / 2) * wide;
      return [left, y - ABOVE, left + wide, y + BELOW];
    });
    const box = boxes.find(isFree);
    text.setAttribute("display", box ? "inline" : "none");
    if (!box) continue;
    taken.push(box);
    text.setAttribute("x", box[0]);
    text.setAttribute("y", box[3] - BELOW);
  }
}

const overlap = (a, b) => a[0] < b[2] && b[0] < a[2] && a[1] < b[3] && b[1] < a[3];

// Whether a line passes through a box: its parts within the box's width and within its height have some in common.
function crosses([[x0, y0], [x1, y1]], [left, top, right, foot]) {
  let first = 0, last = 1;
  for (const [from, way, low, high] of [[x0, x1 - x0, left, right], [y0, y1 - y0, top, foot]]) {
    if (way === 0 && (from < low || from > high)) return false;
    if (way === 0) continue;
    const [one, other] = [(low - from) / way, (high - from) / way];
    first = Math.max(first, Math.min(one, other));
    last = Math.min(last, Math.max(one, other));
  }
  return first < last;
}
