// Places the names in the picture within the frame. They do not cover links or other names, nor symbols if possible.
// If there is not enough space for all names, points have priority over links.
function nameAll(i) {
  const place = ({ link, point }) => at(drawnPlace(link, point, i, view.factor));
  const points = parts.points.map((each) => ({ text: each.text, spots: around(place(each), 0.9 * stage.unit) }));
  const links = parts.labels.filter(({ text }) => text).map(({ k, text }) => ({ text, spots: besideLink(k, i) }));
  placeNames([...points, ...links], linesOfLinks(i, view.factor), thinLines(i));
}

// Candidates next to the middle of a link's beam, then nearer to its ends; around the middle of a link without beams.
function besideLink(k, i) {
  const beam = model.beams.findIndex((each) => each.link === k);
  if (beam < 0) {
    const places = Object.keys(model.links[k].points).map((point) => drawnPlace(k, point, i, view.factor));
    return around(at(scaled(1 / places.length, places.reduce(plus))), 1.3 * stage.unit);
  }
  const [dx, dy] = beamDirection(beam, i);
  return besideLine((part) => at(drawnOnBeam(beam, part, i, view.factor)), [dx, -dy], 1.3 * stage.unit);
}

// Undeformed links, symbols and the ring, as lines on the screen.
function thinLines(i) {
  const { factor, rigid, spot } = view;
  const ringed = parts.first && spot
    ? circleLines(at(drawnOnBeam(parts.first.beam, parts.first.part, i, factor)), 1.1 * stage.unit)
    : [];
  return [
    ...(rigid && factor > 0 ? linesOfLinks(i, 0) : []),
    ...parts.marks.flatMap(({ drawn }) => markLines(drawn)),
    ...ringed,
  ];
}

function linesOfLinks(i, factor) {
  const shares = factor ? [0, 0.25, 0.5, 0.75, 1] : [0, 1];
  const beams = model.beams.map((_, k) => shares.map((share) => at(drawnOnBeam(k, share, i, factor))));
  const plates = bareLinks.map((k) => ring(k, i, factor).map(at));
  const outlines = [...beams, ...plates.map((corners) => [...corners, corners[0]])];
  return outlines.flatMap((places) => places.slice(1).map((to, n) => [places[n], to]));
}

// Names: {text, spots}. A name without a free spot is omitted.
function placeNames(names, links, thin) {
  for (const { text } of names) text.wide ??= text.getComputedTextLength() + 2;
  const words = names.map(({ text, spots }) => ({ wide: text.wide, spots }));
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
