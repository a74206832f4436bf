// The mechanism, moving: links as they bend, diagrams on them, paths, reactions; to drag, hover and click.
const NARROW = 480, LEAST_TALL = 180, CONTROLS = 64, TILES = 300; // pixels: of the picture, and kept for what stands below it
const STATIONS = 24, DIAGRAM_SHARE = 0.11, DEFORMED_SHARE = 0.06, ARROW_SHARE = 0.16, REACH = 14;
const view = {
  factor: 1,
  fields: new Set(),
  names: true,
  paths: true,
  reactions: false,
  rigid: true,
  spot: true,
  selected: null,
  redraw: () => {},
};

// Gears: the wheels by their pitch circles, and what a belt ties, or teeth that are not told, by the line of centres.
const wheels = model.gears.flat().filter(({ point, radius }, k, all) =>
  radius !== null && point !== null && all.findIndex((each) => each.point === point && each.radius === radius) === k
);
const belts = model.gears.filter((ends) => ends.every(({ point, radius }) => point !== null && radius === null));

// Cams in their own axes, y downwards as on the screen: a disc, or a ring or groove within a rim.
const outlineOf = (places, scale = 1) =>
  `${
    places.map((
      [x, y],
      k,
    ) => (isFinite(x + y) ? `${k && isFinite(places[k - 1][0]) ? "L" : "M"}${scale * x} ${-scale * y}` : "")).join("")
  }Z`;
const camReach = ({ flanks, pitch }) => Math.max(...[...flanks, pitch].flat().map(size).filter(isFinite), 1e-12);
const camRim = (cam) => (cam.outer.includes(true) ? 1.12 : 1) * camReach(cam);
const camBody = (cam, scale = 1) => {
  const rim = scale * camRim(cam), ring = `M${rim} 0A${rim} ${rim} 0 1 0 ${-rim} 0A${rim} ${rim} 0 1 0 ${rim} 0Z`;
  return (cam.outer.includes(true) ? ring : "") + cam.flanks.map((flank) => outlineOf(flank, scale)).join("");
};
const camTurned = (k, i, /** @type {number[]} */ [px, py] = [0, 0]) => {
  const [x, y] = vector("cam_turn", k, i);
  return `matrix(${x} ${-y} ${y} ${x} ${px} ${py})`;
};

const corners = (() => {
  const low = [Infinity, Infinity], high = [-Infinity, -Infinity];
  const reach = (/** @type {number[]} */ [x, y]) => {
    if (!isFinite(x + y)) return;
    low[0] = Math.min(low[0], x);
    low[1] = Math.min(low[1], y);
    high[0] = Math.max(high[0], x);
    high[1] = Math.max(high[1], y);
  };
  Object.values(model.links[GROUND].points).forEach(reach);
  for (const { link, point } of movingPoints) for (let i = 0; i < N; i++) reach(placeOf(link, localOf(link, point), i));
  for (const { link, point, radius } of wheels) {
    for (let i = 0; i < N; i++) {
      for (const side of [-radius, radius]) reach(plus(placeOf(link, localOf(link, point), i), [side, side]));
    }
  }
  for (const cam of model.cams) for (const side of [-1, 1]) reach(plus(cam.centre, scaled(side * camRim(cam), [1, 1])));
  if (!isFinite(low[0])) return [[-0.5, -0.5], [0.5, 0.5]];
  if (low[0] === high[0] && low[1] === high[1]) return [plus(low, [-0.5, -0.5]), plus(high, [0.5, 0.5])];
  // Room for diagrams, and for what is displaced out of the way.
  const room = (model.beams.length ? DIAGRAM_SHARE : 0.02) * Math.max(high[0] - low[0], high[1] - low[1]);
  return [plus(low, [-room, -room]), plus(high, [room, room])];
})();
const extent = Math.max(corners[1][0] - corners[0][0], corners[1][1] - corners[0][1]) /
  (1 + 2 * (model.beams.length ? DIAGRAM_SHARE : 0.02));

// The largest displacement of any point or beam, and the round factor that makes it well seen.
function roundDown(value) {
  const power = Math.pow(10, Math.floor(Math.log10(value)));
  return [5, 2, 1].map((step) => step * power).find((each) => each <= value * (1 + 1e-9)) ?? power;
}
const suited = (() => {
  let largest = Math.max(...["u", "w"].map((field) => (model.beams.length ? scaleOfField(field) : 0)), 0);
  for (const { link, point } of movingPoints) {
    for (let i = 0; i < N; i++) {
      if (counted(i)) largest = Math.max(largest, size(displacementOf(link, point, i)) || 0);
    }
  }
  return largest > 1e-12 * extent ? roundDown((DEFORMED_SHARE * extent) / largest) : 0;
})();
view.factor = suited && Math.max(1, suited); // the first picture shows how it deflects, if that is known

const largestForce = (() => {
  let largest = 0;
  for (let k = 0; k < model.joints.length; k++) {
    for (let i = 0; i < N; i++) if (counted(i)) largest = Math.max(largest, size(vector("force", k, i)) || 0);
  }
  return largest;
})();

// Beams that carry a field's diagram, all other links by the outline of their points.
const bareLinks = model.links.map((_, k) => k).filter((k) =>
  k > GROUND && !model.beams.some((beam) => beam.link === k)
);

function drawMechanism(holder, tip) {
  const svg = s("svg", { role: "img", "aria-labelledby": "mechanism-words", tabindex: 0, class: "mechanism" });
  holder.append(svg);
  let scale = 1, left = 0, top = 0, width = 0, height = 0, unit = 10;
  /** @type {Record<string, any>} */
  let parts;
  const at = (/** @type {number[]} */ [x, y]) => [left + scale * x, top - scale * y];
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

  // The whole mechanism is seen at once: of the first screen it takes what the verdict above and what stands below leave.
  const twoColumns = () => matchMedia("(min-width: 68rem)").matches;
  const roomBelow = () => window.innerHeight - (holder.getBoundingClientRect().top + window.scrollY);

  function layOut() {
    width = Math.max(280, holder.clientWidth);
    const [low, high] = corners, wide = high[0] - low[0], tall = high[1] - low[1];
    const room = Math.min(36, 0.09 * width),
      most = Math.max(LEAST_TALL, roomBelow() - (twoColumns() ? CONTROLS : TILES));
    scale = Math.min((width - 2 * room) / Math.max(wide, 1e-12), (most - 2 * room) / Math.max(tall, 1e-12));
    height = Math.max(LEAST_TALL, scale * tall + 2 * room);
    left = width / 2 - (scale * (low[0] + high[0])) / 2;
    top = height / 2 + (scale * (low[1] + high[1])) / 2;
    unit = Math.max(5, Math.min(10, width / 90));
    svg.setAttribute("viewBox", `0 0 ${width} ${height}`);
    svg.setAttribute("height", height);
    build();
    update(instant.position);
  }

  function build() {
    parts = {
      paths: s("g", { class: "paths" }),
      ground: s("g"),
      rigid: s("g", { class: "rigid" }),
      diagrams: s("g"),
      links: s("g"),
      joints: s("g"),
      arrows: s("g"),
      names: s("g", { class: "names" }),
      dot: s("circle", { r: 4, class: "dot", visibility: "hidden" }),
    };
    svg.replaceChildren(
      s(
        "title",
        { id: "mechanism-words" },
        `The mechanism: ${model.links.slice(1).map((link) => link.name).join(", ")}`,
      ),
      ...Object.values(parts),
      scaleBar(),
    );
    for (const { link, point } of movingPoints) {
      const places = Array.from({ length: N }, (_, i) => placeOf(link, localOf(link, point), i));
      places.push(closed() ? places[0] : [NaN, NaN]);
      parts.paths.append(s("path", { d: line(places) }));
    }
    for (const [point, place] of Object.entries(model.links[GROUND].points)) parts.ground.append(support(place, point));
    parts.beams = model.beams.map((beam, k) => ({
      rigid: parts.rigid.appendChild(s("path")),
      line: parts.links.appendChild(
        s("path", { class: "link", style: `stroke:${linkColour(beam.link)};fill:none`, "data-beam": k }),
      ),
    }));
    parts.bare = bareLinks.map((k) => {
      const shape = model.outlines[model.links[k].name] ? "outline" : "plate";
      return {
        k,
        rigid: parts.rigid.appendChild(s("path")),
        line: parts.links.appendChild(
          s("path", { class: `link ${shape}`, style: `stroke:${linkColour(k)};fill:${linkColour(k)}`, "data-link": k }),
        ),
      };
    });
    parts.sliders = model.sliders.map((slider) => ({
      slider,
      rail: parts.ground.appendChild(s("path", { class: "rail" })),
      block: parts.joints.appendChild(
        s("rect", {
          class: "block",
          width: 3.4 * unit,
          height: 2.1 * unit,
          x: -1.7 * unit,
          y: -1.05 * unit,
          style: `stroke:${linkColour(slider.link)}`,
          "data-link": slider.link,
        }),
      ),
    }));
    for (const { slider, rail } of parts.sliders) if (slider.on === GROUND) drawRails(slider, rail);
    parts.cams = model.cams.map((cam) => ({
      cam,
      body: parts.ground.appendChild(s("path", { class: "cambody", "fill-rule": "evenodd", d: camBody(cam, scale) })),
      roller: cam.roller && cam.radius
        ? parts.joints.appendChild(
          s("circle", { class: "camroller", r: scale * cam.radius, style: `stroke:${linkColour(cam.link)}` }),
        )
        : null,
    }));
    parts.wheels = wheels.map((wheel) => ({
      wheel,
      line: parts.rigid.parentNode.insertBefore(
        s("path", { class: "wheel", style: `stroke:${linkColour(wheel.link)}` }),
        parts.links,
      ),
    }));
    parts.belts = belts.map((ends) => ({ ends, line: parts.joints.appendChild(s("path", { class: "belt" })) }));
    parts.strokes = model.strokes.map((stroke) => ({
      stroke,
      line: parts.joints.appendChild(s("path", { class: "stroke" })),
    }));
    parts.springs = model.springs.map((spring) => ({
      spring,
      line: parts.joints.appendChild(s("path", { class: "spring" })),
    }));
    parts.pins = pins().map((pin) => ({
      ...pin,
      circle: parts.joints.appendChild(
        s("circle", {
          class: pin.welded ? "weld" : pin.joint ? "pin" : "spot",
          r: pin.joint && !pin.welded ? 0.55 * unit : 0.32 * unit,
        }),
      ),
    }));
    parts.drives = model.drives.map((drive) => ({
      drive,
      mark: parts.joints.appendChild(s("path", { class: "drive" })),
    }));
    parts.points = [
      ...movingPoints,
      ...Object.keys(model.links[GROUND].points).map((point) => ({ link: GROUND, point })),
    ].map((each) => ({ ...each, text: parts.names.appendChild(s("text", {}, short(each.point))) }));
    parts.labels = model.links.map((link, k) => ({
      k,
      text: k
        ? parts.names.appendChild(s("text", { class: "linkname", style: `fill:${linkColour(k)}` }, short(link.name)))
        : null,
    }));
    parts.forces = model.joints.map((joint) => ({
      joint,
      arrow: parts.arrows.appendChild(s("path", { class: "force" })),
    }));
    parts.first = firstSpot();
    if (parts.first) {
      parts.names.parentNode.insertBefore(
        parts.ring = s("circle", { class: "first", r: 1.1 * unit }, s("title", {}, parts.first.words)),
        parts.dot,
      );
    }
    parts.curves = [...view.fields].map((field) =>
      model.beams.map(() => parts.diagrams.appendChild(s("path", { class: `diagram f-${field}` })))
    );
  }

  // The hatched rails of the ground, as long as the block's way.
  function drawRails(slider, rail) {
    const [dx, dy] = slider.direction, u = unit, slides = [];
    for (let i = 0; i < N; i++) {
      const [x, y] = placeOf(slider.link, localOf(slider.link, slider.point), i);
      if (isFinite(x + y)) slides.push((x - slider.origin[0]) * dx + (y - slider.origin[1]) * dy);
    }
    const low = slides.reduce((a, b) => Math.min(a, b), Infinity),
      high = slides.reduce((a, b) => Math.max(a, b), -Infinity);
    if (!(high >= low)) return;
    const [x, y] = at(plus(slider.origin, scaled((low + high) / 2, slider.direction))),
      half = (scale * (high - low)) / 2 + 3 * u;
    const strokes = Math.max(3, Math.round((2 * half) / (2 * u))),
      hatch = (side) =>
        `M${-half} ${side * 1.35 * u}h${2 * half}` +
        Array.from({ length: strokes }, (_, k) =>
          `M${-half + ((k + 0.6) * 2 * half) / strokes} ${side * 1.35 * u}l${-0.6 * u} ${side * 0.7 * u}`).join("");
    rail.setAttribute("d", hatch(1) + hatch(-1));
    rail.setAttribute("transform", `translate(${x} ${y}) rotate(${(-Math.atan2(dy, dx) * 180) / Math.PI})`);
  }

  const closed = () => {
    const one = movingPoints[0];
    if (!one || N < 3) return false;
    const place = (i) => placeOf(one.link, localOf(one.link, one.point), i);
    const [first, second, last] = [place(0), place(1), place(N - 1)];
    return Math.hypot(first[0] - last[0], first[1] - last[1]) <
      1.6 * Math.hypot(first[0] - second[0], first[1] - second[1]);
  };

  function pins() {
    const owners = new Map();
    model.links.forEach((link, k) =>
      Object.keys(link.points).forEach((point) => owners.set(point, [...(owners.get(point) ?? []), k]))
    );
    const blocks = new Set(model.sliders.map((slider) => slider.point));
    return [...owners].filter(([point, links]) => !(links.length === 1 && (links[0] === GROUND || blocks.has(point))))
      .map(([point, links]) => ({
        point,
        link: links.find((k) => k > GROUND) ?? GROUND,
        joint: links.length > 1,
        welded: model.welds.includes(point),
        grounded: links.includes(GROUND),
      }));
  }

  function support(place, point) {
    const used = model.links.some((link, k) => k > GROUND && point in link.points);
    const [x, y] = at(place), u = unit;
    if (!used) return s("circle", { class: "spot", cx: x, cy: y, r: 0.32 * u });
    const strokes = [-2, -1, 0, 1, 2].map((k) => `M${x + k * 0.8 * u} ${y + 2 * u}l${-0.6 * u} ${0.75 * u}`).join("");
    return s(
      "g",
      { class: "support" },
      s("path", { d: `M${x} ${y}l${-1.3 * u} ${2 * u}h${2.6 * u}z` }),
      s("path", { d: `M${x - 2.1 * u} ${y + 2 * u}h${4.2 * u}${strokes}` }),
    );
  }

  // A length, and how much larger than they are the displacements are drawn.
  function scaleBar() {
    const [per] = scaleOf(1, "m"), length = roundDown((per * Math.min(0.22 * width, 200)) / scale) / per;
    const x = 12, y = height - 10, line = `M${x} ${y - 5}v5h${length * scale}v-5`;
    const enlarged = view.factor === 1 ? "at true size" : view.factor ? `drawn × ${number(view.factor)}` : "not drawn";
    const words = `${quantity(length, "m")}${
      suited
        ? `; displacements ${enlarged}${view.factor && view.rigid && width > NARROW ? " (thin: rigid links)" : ""}`
        : ""
    }`;
    const arrows = view.reactions && largestForce ? `arrows: up to ${quantity(largestForce, "N")}` : null;
    return s(
      "g",
      { class: "scale" },
      s("path", { d: line }),
      s("text", { x: x + length * scale + 6, y }, words),
      arrows ? s("text", { x, y: y - 16 }, arrows) : null,
    );
  }

  function update(i) {
    const factor = view.factor;
    for (const part of ["paths", "rigid", "names", "arrows"]) {
      parts[part].setAttribute(
        "visibility",
        ({ paths: view.paths, rigid: view.rigid && factor > 0, names: view.names, arrows: view.reactions })[part]
          ? "visible"
          : "hidden",
      );
    }
    model.beams.forEach((beam, k) => {
      const places = [];
      for (let n = 0; n <= STATIONS; n++) places.push(drawnOnBeam(k, n / STATIONS, i, factor));
      parts.beams[k].line.setAttribute("d", line(places));
      parts.beams[k].line.classList.toggle("chosen", view.selected === k);
      if (view.rigid) parts.beams[k].rigid.setAttribute("d", line([drawnOnBeam(k, 0, i, 0), drawnOnBeam(k, 1, i, 0)]));
    });
    if (parts.first) {
      const [x, y] = at(drawnOnBeam(parts.first.beam, parts.first.part, i, factor));
      parts.ring.setAttribute("cx", x || 0);
      parts.ring.setAttribute("cy", y || 0);
      parts.ring.setAttribute("visibility", view.spot && isFinite(x + y) ? "visible" : "hidden");
    }
    for (const { k, rigid, line: path } of parts.bare) {
      path.setAttribute("d", closedLine(ring(k, i, factor)));
      rigid.setAttribute("d", closedLine(ring(k, i, 0)));
    }
    for (const { slider, rail, block } of parts.sliders) drawSlider(slider, rail, block, i);
    for (const { point, link, circle } of parts.pins) {
      const [x, y] = at(drawnPlace(link, point, i, factor));
      circle.setAttribute("cx", x || 0);
      circle.setAttribute("cy", y || 0);
    }
    for (const each of parts.drives) drawDrive(each, i);
    for (const { wheel, line: path } of parts.wheels) drawWheel(wheel, path, i);
    parts.cams.forEach(({ cam, body, roller }, k) => {
      body.setAttribute("transform", camTurned(k, i, at(cam.centre)));
      if (roller) {
        const [x, y] = at(placeOf(cam.link, cam.roller, i));
        roller.setAttribute("cx", x || 0);
        roller.setAttribute("cy", y || 0);
      }
    });
    for (const { ends, line: path } of parts.belts) {
      path.setAttribute(
        "d",
        line(ends.map(({ link, point }) => drawnPlace(link, point, i, factor))),
      );
    }
    for (const { stroke, line: path } of parts.strokes) {
      path.setAttribute(
        "d",
        line(stroke.points.map((point) => drawnCorner(stroke.link, point, i, factor))),
      );
    }
    for (const { spring, line: path } of parts.springs) drawSpring(spring, path, i);
    if (view.names) nameAll(i);
    if (view.reactions) { for (const [k, each] of parts.forces.entries()) drawForce(k, each, i); }
    [...view.fields].forEach((field, n) => model.beams.forEach((_, k) => drawDiagram(field, k, parts.curves[n][k], i)));
  }

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

  function drawSlider(slider, rail, block, i) {
    const place = drawnPlace(slider.link, slider.point, i, view.factor),
      way = armOf(slider.on, slider.direction, i),
      [x, y] = at(place);
    const turned = (-Math.atan2(way[1], way[0]) * 180) / Math.PI, u = unit;
    if (!isFinite(x + y)) return;
    block.setAttribute("transform", `translate(${x} ${y}) rotate(${turned})`);
    if (slider.on === GROUND) return;
    rail.setAttribute("d", `M${-6 * u} 0h${12 * u}`);
    rail.setAttribute("transform", `translate(${x} ${y}) rotate(${turned})`);
  }

  function drawDrive({ drive, mark }, i) {
    const u = unit;
    if (drive.link !== null) {
      const [x, y] = at(drawnPlace(drive.link, drive.at, i, view.factor)), r = 2.3 * u;
      const sense = has("drive_rate") && row("drive_rate", model.drives.indexOf(drive))[i] < 0 ? -1 : 1;
      const turn = (angle) => [x + r * Math.cos(angle), y - r * Math.sin(angle)];
      const [a, b] = sense > 0 ? [-0.4, 3.7] : [3.6, -0.5], [x0, y0] = turn(a), [x1, y1] = turn(b);
      const head = b + (sense > 0 ? -0.35 : 0.35),
        out = [1.28 * r, 0.72 * r].map((q) => [x + q * Math.cos(head), y - q * Math.sin(head)]);
      mark.setAttribute(
        "d",
        isFinite(x + y)
          ? `M${x0} ${y0}A${r} ${r} 0 1 ${sense > 0 ? 0 : 1} ${x1} ${y1}M${out[0]}L${x1} ${y1}L${out[1]}`
          : "",
      );
      return;
    }
    const slider = model.sliders.find((each) => each.name === drive.slider),
      way = armOf(slider.on, slider.direction, i);
    const [x, y] = at(drawnPlace(slider.link, slider.point, i, view.factor)),
      d = [way[0], -way[1]],
      n = [way[1], way[0]];
    const tip = [x + 5.4 * u * d[0], y + 5.4 * u * d[1]];
    const wing = (q) => `${tip[0] - u * d[0] + q * n[0]} ${tip[1] - u * d[1] + q * n[1]}`;
    mark.setAttribute(
      "d",
      isFinite(x + y)
        ? `M${x + 2 * u * d[0]} ${y + 2 * u * d[1]}L${tip}M${wing(0.6 * u)}L${tip}L${wing(-0.6 * u)}`
        : "",
    );
  }

  // A pitch circle with a spoke that turns with its link.
  function drawWheel({ link, point, radius }, path, i) {
    const [x, y] = at(drawnPlace(link, point, i, view.factor)), r = scale * radius, [dx, dy] = armOf(link, [r, 0], i);
    path.setAttribute(
      "d",
      isFinite(x + y)
        ? `M${x - r} ${y}a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0M${x} ${y}l${dx} ${-dy}`
        : "",
    );
  }

  // A zigzag between two points, or a spiral about a pin.
  function drawSpring({ link, point, on, anchor }, path, i) {
    const u = unit, [x, y] = at(drawnPlace(link, point, i, view.factor));
    if (anchor === null) {
      const spiral = Array.from(
        { length: 41 },
        (_, k) => [x + (0.8 + k * 0.055) * u * Math.cos(k * 0.35), y - (0.8 + k * 0.055) * u * Math.sin(k * 0.35)],
      );
      return path.setAttribute("d", isFinite(x + y) ? `M${spiral.join("L")}` : "");
    }
    const [ex, ey] = at(drawnPlace(on, anchor, i, view.factor)),
      long = Math.hypot(ex - x, ey - y) || 1,
      [ax, ay] = [(ex - x) / long, (ey - y) / long];
    const turns = 9,
      plain = Math.min(0.18 * long, 2 * u),
      spot = (along, across) => `${x + along * ax - across * ay} ${y + along * ay + across * ax}`;
    const zigzag = Array.from(
      { length: turns * 2 - 1 },
      (_, k) => spot(plain + ((k + 0.5) * (long - 2 * plain)) / (turns * 2 - 1), (k % 2 ? -0.75 : 0.75) * u),
    );
    path.setAttribute(
      "d",
      isFinite(x + y + ex + ey)
        ? `M${spot(0, 0)}L${spot(plain, 0)}L${zigzag.join("L")}L${spot(long - plain, 0)}L${spot(long, 0)}`
        : "",
    );
  }

  function drawForce(k, { joint, arrow }, i) {
    const force = vector("force", k, i), length = largestForce ? (ARROW_SHARE * extent * scale) / largestForce : 0;
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

  // Points come before links where there is no room for all names.
  function nameAll(i) {
    const place = ({ link, point }) => at(drawnPlace(link, point, i, view.factor));
    const points = parts.points.map((each) => ({ text: each.text, spots: around(place(each), 0.9 * unit) }));
    const links = parts.labels.filter(({ text }) => text).map(({ k, text }) => ({ text, spots: besideLink(k, i) }));
    placeNames([...points, ...links], linesDrawn(i), [width, height]);
  }

  // Beside the middle of a link's beam and then nearer to its ends; around the middle of a link without beams.
  function besideLink(k, i) {
    const beam = model.beams.findIndex((each) => each.link === k);
    if (beam < 0) {
      const places = Object.keys(model.links[k].points).map((point) => drawnPlace(k, point, i, view.factor));
      return around(at(scaled(1 / places.length, places.reduce(plus))), 1.3 * unit);
    }
    const [dx, dy] = beamDirection(beam, i), level = Math.abs(dy) < 0.15;
    return [0.5, 0.35, 0.65, 0.2, 0.8].flatMap((part) =>
      [-1.3, 1.3, -2.4, 2.4].map((far) => {
        const [x, y] = at(drawnOnBeam(beam, part, i, view.factor)), aside = -far * dy * unit;
        return [x + aside, y - far * dx * unit + 4, level ? 0 : Math.sign(aside)];
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

  // How far a place on the screen is from the way between two others, and at which part of it.
  function beside(x, y, from, to) {
    const dx = to[0] - from[0],
      dy = to[1] - from[1],
      t = Math.max(0, Math.min(1, ((x - from[0]) * dx + (y - from[1]) * dy) / (dx * dx + dy * dy || 1)));
    return [Math.hypot(x - from[0] - t * dx, y - from[1] - t * dy), t];
  }

  // What is under the pointer: the nearest beam within reach and where along it.
  function under(x, y) {
    let best = null, nearest = REACH;
    model.beams.forEach((_, beam) => {
      let from = at(drawnOnBeam(beam, 0, instant.position, view.factor));
      for (let n = 0; n < STATIONS; n++) {
        const to = at(drawnOnBeam(beam, (n + 1) / STATIONS, instant.position, view.factor)),
          [distance, t] = beside(x, y, from, to);
        if (distance < nearest) {
          nearest = distance;
          best = { beam, xi: (n + t) / STATIONS, link: model.beams[beam].link };
        }
        from = to;
      }
    });
    return best;
  }

  // A link without beams: what is pointed at, or the nearest edge within reach.
  function bareUnder(event, x, y) {
    const owner = event.target.getAttribute?.("data-link") ?? null;
    if (owner !== null) return Number(owner);
    let best = null, nearest = REACH;
    for (const k of bareLinks) {
      const places = ring(k, instant.position, view.factor).map(at);
      places.forEach((from, n) => {
        const [distance] = beside(x, y, from, places[(n + 1) % places.length]);
        if (distance < nearest) {
          nearest = distance;
          best = k;
        }
      });
    }
    return best;
  }

  const pointer = (event) => {
    const box = svg.getBoundingClientRect();
    return [((event.clientX - box.left) * width) / box.width, ((event.clientY - box.top) * height) / box.height];
  };

  let grabbed = null, last = null;
  function grab(event) {
    hover(event);
    const [x, y] = pointer(event), found = under(x, y), link = found?.link ?? bareUnder(event, x, y);
    if (link === null) return;
    const world = [(x - left) / scale, (top - y) / scale],
      i = instant.position,
      [ox, oy] = placeOf(link, [0, 0], i),
      [dx, dy] = vector("direction", link - 1, i);
    const local = times([world[0] - ox, world[1] - oy], [dx, -dy]);
    const place = found ? (k) => drawnOnBeam(found.beam, found.xi, k, view.factor) : (k) => placeOf(link, local, k);
    grabbed = { place, beam: found?.beam ?? null, x: event.clientX, y: event.clientY, moved: false };
    stop();
    svg.setPointerCapture(event.pointerId);
    event.preventDefault();
    svg.focus({ preventScroll: true });
  }

  // The neighbouring instant at which the place that was grabbed comes nearest to the pointer.
  function drag(event) {
    if (Math.hypot(event.clientX - grabbed.x, event.clientY - grabbed.y) > 3) {
      grabbed.moved = true;
      leave();
    }
    if (!grabbed.moved) return;
    const [x, y] = pointer(event),
      world = [(x - left) / scale, (top - y) / scale],
      far = Math.max(2, Math.floor(N / 5));
    let best = instant.position, nearest = Infinity;
    for (let step = -far; step <= far; step++) {
      const i = closed() ? (((instant.position + step) % N) + N) % N : instant.position + step;
      if (i < 0 || i >= N) continue;
      const [px, py] = grabbed.place(i),
        distance = Math.hypot(px - world[0], py - world[1]) + (1e-4 * extent * Math.abs(step)) / N;
      if (distance < nearest) {
        nearest = distance;
        best = i;
      }
    }
    showPosition(best);
  }

  function hover(event) {
    if (grabbed) return drag(event);
    last = event;
    const [x, y] = pointer(event), found = under(x, y);
    svg.style.cursor = found || bareUnder(event, x, y) !== null ? "grab" : "default";
    if (!found) return hide();
    const [px, py] = at(drawnOnBeam(found.beam, found.xi, instant.position, view.factor));
    parts.dot.setAttribute("cx", px);
    parts.dot.setAttribute("cy", py);
    parts.dot.setAttribute("visibility", "visible");
    const { label, length } = model.beams[found.beam],
      fields = new Set([...view.fields, "w", "chord", "M", ...(stressed ? ["mises"] : [])]);
    tip.replaceChildren(
      h("b", {}, label),
      ` ${quantity(found.xi * length, "m", 3)} along it`,
      h(
        "dl",
        {},
        [...fields].map((
          field,
        ) => [
          h("dt", {}, FIELDS[field].name),
          h("dd", {}, quantity(FIELDS[field].value(found.beam, instant.position, found.xi), FIELDS[field].unit)),
        ]),
      ),
    );
    const box = holder.getBoundingClientRect(), wide = 250;
    tip.style.left = `${Math.max(0, Math.min(event.clientX - box.left + 16, box.width - wide))}px`;
    tip.hidden = false;
    // Below the pointer, or above it where it would be cut off.
    const down = event.clientY - box.top, room = box.height - tip.offsetHeight;
    tip.style.top = `${
      down + 16 <= room ? down + 16 : Math.max(0, down - 16 > tip.offsetHeight ? down - 16 - tip.offsetHeight : room)
    }px`;
  }

  function leave() {
    last = null;
    hide();
  }

  function hide() {
    tip.hidden = true;
    parts.dot.setAttribute("visibility", "hidden");
  }

  function release() {
    if (grabbed && !grabbed.moved && grabbed.beam !== null) {
      unfold("link");
      chooseBeam(grabbed.beam);
    }
    grabbed = null;
  }

  svg.addEventListener("pointerdown", grab);
  svg.addEventListener("pointermove", hover);
  svg.addEventListener("pointerup", release);
  svg.addEventListener("pointercancel", () => (grabbed = null));
  svg.addEventListener("pointerleave", leave);
  // A finger that takes a link drags it; one beside it scrolls the page.
  svg.addEventListener("touchstart", (event) => {
    if (grabbed) event.preventDefault();
  }, { passive: false });
  view.redraw = () => {
    build();
    update(instant.position);
  };
  view.svg = () => svg;
  view.fit = layOut;
  new ResizeObserver(() => {
    if (Math.abs(holder.clientWidth - width) > 2) layOut();
  }).observe(holder);
  layOut();
  follow((i) => {
    update(i);
    if (last && !grabbed) hover(last);
  });
}
