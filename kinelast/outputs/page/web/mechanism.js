// The moving mechanism with deflected links, symbols, diagrams, paths, reactions and names.
const NARROW = 480, LEAST_TALL = 180, CONTROLS = 64, TILES = 300; // pixels: of the picture, and for what is below it
const ARROW_SHARE = 0.16;
const stage = { svg: null, scale: 1, left: 0, top: 0, width: 0, height: 0, unit: 10 };
/** @type {Record<string, any>} */
let parts;

const at = (/** @type {number[]} */ [x, y]) => [stage.left + stage.scale * x, stage.top - stage.scale * y];
const line = (places) => {
  let text = "", pen = "M";
  for (const place of places) {
    const [x, y] = at(place);
    if (!isFinite(x + y)) {
      pen = "M";
      continue;
    }
    text += `${pen}${x.toFixed(2)} ${y.toFixed(2)}`;
    pen = "L";
  }
  return text;
};
const closedLine = (places) => {
  const open = line(places);
  return open && places.length > 1 ? `${open}Z` : "";
};

// The whole mechanism is visible at once. It uses the height of the first screen that other elements leave free.
const twoColumns = () => matchMedia("(min-width: 68rem)").matches;
const roomBelow = (holder) => window.innerHeight - (holder.getBoundingClientRect().top + window.scrollY);

function layOut(holder) {
  const width = Math.max(280, holder.clientWidth);
  const [low, high] = corners, wide = high[0] - low[0], tall = high[1] - low[1];
  const edge = Math.min(36, 0.09 * width),
    most = Math.max(LEAST_TALL, roomBelow(holder) - (twoColumns() ? CONTROLS : TILES));
  const scale = Math.min((width - 2 * edge) / Math.max(wide, 1e-12), (most - 2 * edge) / Math.max(tall, 1e-12));
  const height = Math.max(LEAST_TALL, scale * tall + 2 * edge);
  const left = width / 2 - (scale * (low[0] + high[0])) / 2, top = height / 2 + (scale * (low[1] + high[1])) / 2;
  Object.assign(stage, { scale, left, top, width, height, unit: Math.max(5, Math.min(10, width / 90)) });
  stage.svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
  stage.svg.setAttribute("height", height);
  build();
  update(instant.position);
}

function build() {
  parts = {
    paths: s("g.paths"),
    ground: s("g"),
    rigid: s("g.rigid"),
    diagrams: s("g"),
    links: s("g"),
    joints: s("g"),
    arrows: s("g"),
    names: s("g.names"),
    dot: s("circle", { r: 4, class: "dot", visibility: "hidden" }),
  };
  const title = `The mechanism: ${model.links.slice(1).map((link) => link.name).join(", ")}`;
  stage.svg.replaceChildren(s("title", { id: "mechanism-words" }, title), ...Object.values(parts), scaleBar());
  for (const { link, point } of movingPoints) {
    const places = Array.from({ length: N }, (_, i) => placeOf(link, localOf(link, point), i));
    places.push(isClosed ? places[0] : [NaN, NaN]);
    parts.paths.append(s("path", { d: line(places) }));
  }
  buildLinks();
  parts.marks = model.marks.map((mark) => {
    const path = s("path", { "fill-rule": "evenodd", "data-link": mark.stroke === "link" ? mark.at.link : null });
    return { mark, path: parts[isUnder(mark) ? "ground" : "joints"].appendChild(path) };
  });
  // An undeformed roller touches its cam.
  parts.rollers = parts.marks.filter(({ mark }) => mark.kind === "roller")
    .map(({ mark }) => ({ mark, path: parts.rigid.appendChild(s("path")) }));
  buildNames();
  parts.forces = model.joints.map((joint) => ({ joint, arrow: parts.arrows.appendChild(s("path.force")) }));
  parts.first = firstSpot();
  if (parts.first) {
    parts.ring = s("circle.first", { r: 1.1 * stage.unit }, s("title", parts.first.words));
    parts.names.parentNode.insertBefore(parts.ring, parts.dot);
  }
  parts.curves = [...view.fields].map((field) =>
    model.beams.map(() => parts.diagrams.appendChild(s("path", { class: `diagram f-${field}` })))
  );
}

function buildLinks() {
  parts.beams = model.beams.map((beam, k) => {
    const style = `stroke:${linkColour(beam.link)};fill:none`;
    return {
      rigid: parts.rigid.appendChild(s("path")),
      line: parts.links.appendChild(s("path.link", { style, "data-beam": k })),
    };
  });
  parts.bare = bareLinks.map((k) => {
    const shape = model.outlines[model.links[k].name] ? "outline" : "plate";
    const style = `stroke:${linkColour(k)};fill:${linkColour(k)}`;
    return {
      k,
      rigid: parts.rigid.appendChild(s("path")),
      line: parts.links.appendChild(s("path", { class: `link ${shape}`, style, "data-link": k })),
    };
  });
}

function buildNames() {
  parts.leaders = parts.names.appendChild(s("path.leader"));
  const fixed = Object.keys(model.links[GROUND].points).map((point) => ({ link: GROUND, point }));
  parts.points = [...movingPoints, ...fixed].map((each) => ({
    ...each,
    text: parts.names.appendChild(s("text", short(each.point))),
  }));
  parts.labels = model.links.slice(1).map((link, n) => {
    const style = `fill:${linkColour(n + 1)}`;
    return {
      k: n + 1,
      text: link.name.includes(" ") ? null : parts.names.appendChild(s("text.linkname", { style }, short(link.name))),
    }; // a slot's block has no name
  });
}

// A scale bar, and the factor by which displacements are enlarged.
function scaleBar() {
  const [per] = scaleOf(1, "m"), length = roundDown((per * Math.min(0.22 * stage.width, 200)) / stage.scale) / per;
  const x = 12, y = stage.height - 10, line = `M${x} ${y - 5}v5h${length * stage.scale}v-5`;
  const enlarged = view.factor === 1 ? "at true size" : view.factor ? `drawn × ${number(view.factor)}` : "not drawn";
  const words = `${quantity(length, "m")}${
    suited
      ? `; displacements ${enlarged}${view.factor && view.rigid && stage.width > NARROW ? " (thin: rigid links)" : ""}`
      : ""
  }`;
  const arrows = view.reactions && largestForce ? `arrows: up to ${quantity(largestForce, "N")}` : null;
  return s(
    "g.scale",
    s("path", { d: line }),
    s("text", { x: x + length * stage.scale + 6, y }, words),
    arrows ? s("text", { x, y: y - 16 }, arrows) : null,
  );
}

function update(i) {
  const { factor, names, paths, reactions } = view,
    shown = { paths, rigid: view.rigid && factor > 0, names, arrows: reactions };
  for (const [part, seen] of Object.entries(shown)) parts[part].setAttribute("visibility", seen ? "visible" : "hidden");
  model.beams.forEach((_, k) => {
    const places = Array.from({ length: STATIONS + 1 }, (_, n) => drawnOnBeam(k, n / STATIONS, i, factor));
    parts.beams[k].line.setAttribute("d", line(places));
    parts.beams[k].line.classList.toggle("chosen", view.selected === k);
    if (view.rigid) parts.beams[k].rigid.setAttribute("d", line([drawnOnBeam(k, 0, i, 0), drawnOnBeam(k, 1, i, 0)]));
  });
  if (parts.first) {
    const [x, y] = at(drawnOnBeam(parts.first.beam, parts.first.part, i, factor));
    moveCircle(parts.ring, [x, y]);
    parts.ring.setAttribute("visibility", view.spot && isFinite(x + y) ? "visible" : "hidden");
  }
  for (const { k, rigid, line: path } of parts.bare) {
    path.setAttribute("d", closedLine(ring(k, i, factor)));
    rigid.setAttribute("d", closedLine(ring(k, i, 0)));
  }
  const frame = frameAt(i);
  for (const each of parts.marks) put(each.path, each.drawn = markAttributes(each.mark, frame));
  for (const each of parts.rollers) {
    const { d, transform } = markAttributes(each.mark, frameAt(i, 0));
    put(each.path, each.drawn = { d, transform });
  }
  if (names) nameAll(i);
  if (reactions) { for (const [k, each] of parts.forces.entries()) drawForce(k, each, i); }
  [...view.fields].forEach((field, n) => model.beams.forEach((_, k) => drawDiagram(field, k, parts.curves[n][k], i)));
}

function moveCircle(circle, /** @type {number[]} */ [x, y]) {
  circle.setAttribute("cx", x || 0);
  circle.setAttribute("cy", y || 0);
}

// The positions and axes of marks at a position of the mechanism.
const frameAt = (i, factor = view.factor) => ({
  scale: stage.scale,
  unit: stage.unit,
  colour: linkColour,
  mirrored: (drive) => has("drive_rate") && row("drive_rate", drive)[i] < 0,
  at: ({ link, point, local }) => at(point ? drawnPlace(link, point, i, factor) : drawnCorner(link, local, i, factor)),
  way: (mark) => {
    if (mark.x_axis !== null) return vector("x_axis", mark.x_axis, i);
    return mark.axis ? armOf(mark.axis.link, mark.axis.way, i) : [1, 0];
  },
});

// Corners of a link without beams.
function ring(k, i, f) {
  const outline = model.outlines[model.links[k].name];
  return outline
    ? outline.map((corner) => drawnCorner(k, corner, i, f))
    : Object.keys(model.links[k].points).map((point) => drawnPlace(k, point, i, f));
}

function drawnCorner(link, corner, i, f) {
  const place = placeOf(link, corner, i);
  if (!f || link === GROUND) return place;
  const angle = row("angle", link - 1)[i], [x, y] = armOf(link, corner, i);
  return plus(place, scaled(f, plus(vector("shift", link - 1, i), [-angle * y, angle * x])));
}

function drawForce(k, { joint, arrow }, i) {
  const force = vector("force", k, i), length = largestForce ? (ARROW_SHARE * extent * stage.scale) / largestForce : 0;
  const [x, y] = at(drawnPlace(joint.link, joint.point, i, view.factor)),
    dx = length * force[0],
    dy = -length * force[1],
    long = Math.hypot(dx, dy);
  if (!(long > 1.5)) return arrow.setAttribute("d", "");
  const [ex, ey] = [dx / long, dy / long], barb = Math.min(8, 0.4 * long), tip = [x + dx, y + dy];
  const wing = (q) => `${tip[0] - barb * ex + q * barb * -ey} ${tip[1] - barb * ey + q * barb * ex}`;
  arrow.setAttribute("d", `M${x} ${y}L${tip}M${wing(0.5)}L${tip}L${wing(-0.5)}`);
}

function drawDiagram(field, beam, path, i) {
  const largest = scaleOfField(field),
    high = largest ? (DIAGRAM_SHARE * extent) / largest : 0,
    way = beamDirection(beam, i),
    across = [-way[1], way[0]];
  const feet = [], tops = [];
  for (let n = 0; n <= STATIONS; n++) {
    const foot = drawnOnBeam(beam, n / STATIONS, i, view.factor);
    feet.push(foot);
    tops.push(plus(foot, scaled(high * FIELDS[field].value(beam, i, n / STATIONS), across)));
  }
  path.setAttribute("d", closedLine([...feet, ...tops.reverse()]));
}

function drawMechanism(holder, tip) {
  stage.svg = s("svg", { role: "img", "aria-labelledby": "mechanism-words", tabindex: 0, class: "mechanism" });
  holder.append(stage.svg);
  const hover = listenTo(holder, tip);
  view.redraw = () => {
    build();
    update(instant.position);
  };
  view.svg = () => stage.svg;
  view.fit = () => layOut(holder);
  new ResizeObserver(() => {
    if (Math.abs(holder.clientWidth - stage.width) > 2) layOut(holder);
  }).observe(holder);
  layOut(holder);
  follow((i) => {
    update(i);
    hover();
  });
}
