// Names in the picture: on no other name and within the frame, and if there is room on nothing that is drawn.
// Points come before links where there is no room for all names.
const LINK_HALF = 3; // pixels from the middle of a link to a word, at least
function nameAll(i) {
  const place = ({ link, point }) => at(drawnPlace(link, point, i, view.factor));
  const points = parts.points.map((each) => ({ text: each.text, spots: around(place(each), 0.9 * stage.unit) }));
  const links = parts.labels.filter(({ text }) => text).map(({ k, text }) => ({ text, spots: besideLink(k, i) }));
  placeNames([...points, ...links], linesDrawn(i));
}

// Beside the middle of a link's beam and then nearer to its ends; around the middle of a link without beams.
function besideLink(k, i) {
  const beam = model.beams.findIndex((each) => each.link === k);
  if (beam < 0) {
    const places = Object.keys(model.links[k].points).map((point) => drawnPlace(k, point, i, view.factor));
    return around(at(scaled(1 / places.length, places.reduce(plus))), 1.3 * stage.unit);
  }
  const [dx, dy] = beamDirection(beam, i);
  return besideLine((part) => at(drawnOnBeam(beam, part, i, view.factor)), [dx, -dy], 1.3 * stage.unit);
}

// All that is drawn, as lines on the screen: links, undeformed links, symbols and the ring.
function linesDrawn(i) {
  const { factor, rigid, spot } = view;
  const ringed = parts.first && spot
    ? circleLines(at(drawnOnBeam(parts.first.beam, parts.first.part, i, factor)), 1.1 * stage.unit)
    : [];
  const thin = [
    ...(rigid && factor > 0 ? linesOfLinks(i, 0) : []),
    ...parts.marks.flatMap(({ drawn }) => markLines(drawn)),
    ...ringed,
  ];
  return [...linesOfLinks(i, factor).map((line) => [...line, LINK_HALF]), ...thin.map((line) => [...line, 1])];
}

function linesOfLinks(i, factor) {
  const shares = factor ? [0, 0.25, 0.5, 0.75, 1] : [0, 1];
  const beams = model.beams.map((_, k) => shares.map((share) => at(drawnOnBeam(k, share, i, factor))));
  const plates = bareLinks.map((k) => ring(k, i, factor).map(at));
  const outlines = [...beams, ...plates.map((corners) => [...corners, corners[0]])];
  return outlines.flatMap((places) => places.slice(1).map((to, n) => [places[n], to]));
}

// Names: {text, spots}. One without a free place is left out.
function placeNames(names, lines) {
  for (const { text } of names) text.wide ??= text.getComputedTextLength() + 2;
  const words = names.map(({ text, spots }) => ({ wide: text.wide, spots }));
  const boxes = placedBoxes(words, lines, [stage.width, stage.height]);
  names.forEach(({ text }, k) => {
    const box = boxes[k];
    text.setAttribute("display", box ? "inline" : "none");
    if (!box) return;
    text.setAttribute("x", box[0]);
    text.setAttribute("y", box[3] - BELOW);
  });
  parts.leaders.setAttribute("d", boxes.map((box) => (box?.[4] ? `M${box[4].join("L")}` : "")).join(""));
}
