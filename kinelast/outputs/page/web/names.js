// Names in the picture: on no link, on no other name, within the frame, and on no support or guide if there is room.
// Points come before links where there is no room for all names.
function nameAll(i) {
  const place = ({ link, point }) => at(drawnPlace(link, point, i, view.factor));
  const points = parts.points.map((each) => ({ text: each.text, spots: around(place(each), 0.9 * stage.unit) }));
  const links = parts.labels.filter(({ text }) => text).map(({ k, text }) => ({ text, spots: besideLink(k, i) }));
  placeNames([...points, ...links], linesDrawn(i), [stage.width, stage.height], linesUnder(i));
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

// The links as they are drawn: lines on the screen.
function linesDrawn(i) {
  const parts = [0, 0.25, 0.5, 0.75, 1];
  const beams = model.beams.map((_, k) => parts.map((part) => at(drawnOnBeam(k, part, i, view.factor))));
  const plates = bareLinks.map((k) => ring(k, i, view.factor).map(at));
  const outlines = [...beams, ...plates.map((corners) => [...corners, corners[0]])];
  return outlines.flatMap((places) => places.slice(1).map((to, n) => [places[n], to]));
}

// The supports and guides as they are drawn.
function linesUnder(i) {
  const frame = frameAt(i);
  return parts.marks.filter(({ mark }) => isUnder(mark)).flatMap(({ mark }) => markLines(markAttributes(mark, frame)));
}

// Names: {text, spots}. One without a free place is left out.
function placeNames(names, lines, size, avoided) {
  for (const { text } of names) text.wide ??= text.getComputedTextLength() + 2;
  const boxes = freeBoxes(names.map(({ text, spots }) => ({ wide: text.wide, spots })), lines, size, avoided);
  names.forEach(({ text }, k) => {
    const box = boxes[k];
    text.setAttribute("display", box ? "inline" : "none");
    if (!box) return;
    text.setAttribute("x", box[0]);
    text.setAttribute("y", box[3] - BELOW);
  });
}
