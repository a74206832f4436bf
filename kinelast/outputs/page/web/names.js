const SAME_PLACE = 2; // pixels: names of points that are closer to each other cannot be distinguished
const LEAST_LONG = 3; // length of a line that gets a name beside it / symbol size

// Places the names in the picture within the frame. They do not cover links or other names, nor symbols if possible.
// If there is not enough space for all names, points have priority over links. A leader line connects a name with its
// link or point unless the name is clearly next to it.
function nameAll(i) {
  const places = parts.points.map(({ link, point }) => at(drawnPlace(link, point, i, view.factor)));
  const points = parts.points.map(({ text }, n) => {
    const point = places[n], spots = around(point, 0.9 * stage.unit);
    return { text, spots, point, rivals: places.filter((each) => distance(each, point) > SAME_PLACE) };
  });
  const drawn = model.links.map((_, k) =>
    [...linesOfLink(k, i, view.factor), ...linesOfSymbols(k)].filter((line) => line.flat().every(isFinite))
  ); // no lines at singular positions
  const links = parts.labels.filter(({ text }) => text).map(({ k, text }) => {
    const own = drawn[k].length ? drawn[k] : null, others = drawn.flatMap((lines, n) => (n === k ? [] : lines));
    return { text, spots: besideLink(k, i, drawn[k]), own, others };
  });
  placeNames([...points, ...links], linesOfLinks(i, view.factor), thinLines(i));
}

// Lines of the symbols that represent a link, such as those of the rod of a cylinder.
const linesOfSymbols = (k) =>
  parts.marks.filter(({ mark }) => mark.shows === k).flatMap(({ drawn }) => markLines(drawn));

// Candidates next to the middle of a link's beam, then nearer to its ends. For a link without beams: next to its longest
// line, or around its middle if all lines are short.
function besideLink(k, i, lines) {
  const beam = model.beams.findIndex((each) => each.link === k), far = 1.3 * stage.unit;
  if (beam >= 0) {
    const [dx, dy] = beamDirection(beam, i);
    return besideLine((part) => at(drawnOnBeam(beam, part, i, view.factor)), [dx, -dy], far);
  }
  const longs = lines.map(([from, to]) => Math.hypot(to[0] - from[0], to[1] - from[1])), long = Math.max(...longs);
  if (long > LEAST_LONG * stage.unit) {
    const [[x, y], [u, v]] = lines[longs.indexOf(long)], [dx, dy] = [u - x, v - y];
    return besideLine((part) => [x + part * dx, y + part * dy], [dx / long, dy / long], far);
  }
  const places = Object.keys(model.links[k].points).map((point) => drawnPlace(k, point, i, view.factor));
  return around(at(scaled(1 / places.length, places.reduce(plus))), far);
}

// Undeformed links, symbols and the ring, as lines on the screen.
function thinLines(i) {
  const { factor, rigid, spot } = view;
  const ringed = parts.first && spot
    ? circleLines(at(drawnOnBeam(parts.first.beam, parts.first.part, i, factor)), 1.1 * stage.unit)
    : [];
  return [
    ...(rigid && factor > 0 ? [...linesOfLinks(i, 0), ...parts.rollers.flatMap(({ drawn }) => markLines(drawn))] : []),
    ...parts.marks.flatMap(({ drawn }) => markLines(drawn)),
    ...ringed,
  ];
}

const linesOfLinks = (i, factor) => model.links.flatMap((_, k) => linesOfLink(k, i, factor));

function linesOfLink(k, i, factor) {
  const shares = factor ? [0, 0.25, 0.5, 0.75, 1] : [0, 1], beams = [...model.beams.keys()];
  const outlines = beams.filter((beam) => model.beams[beam].link === k)
    .map((beam) => shares.map((share) => at(drawnOnBeam(beam, share, i, factor))));
  if (bareLinks.includes(k)) {
    const corners = ring(k, i, factor).map(at);
    outlines.push([...corners, corners[0]]);
  }
  return outlines.flatMap((places) => places.slice(1).map((to, n) => [places[n], to]));
}

// Names: {text, spots}. A name without a free spot is omitted.
function placeNames(names, links, thin) {
  for (const { text } of names) text.wide ??= text.getComputedTextLength() + 2;
  const words = names.map(({ text, ...rest }) => ({ wide: text.wide, ...rest }));
  const boxes = placedBoxes(words, links, thin, [stage.width, stage.height]);
  names.forEach(({ text }, k) => {
    const box = boxes[k];
    text.setAttribute("display", box ? "inline" : "none");
    if (!box) return;
    text.setAttribute("x", box[0]);
    text.setAttribute("y", box[3] - BELOW);
  });
  parts.leaders.setAttribute("d", boxes.map((box) => (box?.[4] ? `M${box[4].join("L")}` : "")).join(""));
}
