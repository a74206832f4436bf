// Pointer events on the mechanism: links can be dragged, and beams can be hovered and selected.
const REACH = 14; // [pixels] to a link from the pointer

// The distance of a screen position from the segment between two others, and the fraction of the nearest point on it.
function beside(x, y, from, to) {
  const dx = to[0] - from[0],
    dy = to[1] - from[1],
    t = Math.max(0, Math.min(1, ((x - from[0]) * dx + (y - from[1]) * dy) / (dx * dx + dy * dy || 1)));
  return [Math.hypot(x - from[0] - t * dx, y - from[1] - t * dy), t];
}

// The nearest beam within reach of the pointer, and the location along the beam.
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

// A link without beams: the one under the pointer, or the one with the nearest edge within reach.
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

// Listen to the pointer. The returned function repeats the last search after the mechanism has moved.
function listenTo(holder, tip) {
  const svg = stage.svg;
  const pointer = (event) => {
    const box = svg.getBoundingClientRect();
    return [
      ((event.clientX - box.left) * stage.width) / box.width,
      ((event.clientY - box.top) * stage.height) / box.height,
    ];
  };

  let grabbed = null, last = null;
  function grab(event) {
    hover(event);
    const [x, y] = pointer(event), found = under(x, y), link = found?.link ?? bareUnder(event, x, y);
    if (link === null) return;
    const world = [(x - stage.left) / stage.scale, (stage.top - y) / stage.scale],
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

  // The neighbouring instant at which the grabbed point is nearest to the pointer.
  function drag(event) {
    if (Math.hypot(event.clientX - grabbed.x, event.clientY - grabbed.y) > 3) {
      grabbed.moved = true;
      leave();
    }
    if (!grabbed.moved) return;
    const [x, y] = pointer(event),
      world = [(x - stage.left) / stage.scale, (stage.top - y) / stage.scale],
      far = Math.max(2, Math.floor(N / 5));
    let best = instant.position, nearest = Infinity;
    for (let step = -far; step <= far; step++) {
      const i = isClosed ? (((instant.position + step) % N) + N) % N : instant.position + step;
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
      h("b", label),
      ` ${quantity(found.xi * length, "m", 3)} along it`,
      h(
        "dl",
        [...fields].map((field) => [
          h("dt", FIELDS[field].name),
          h("dd", quantity(FIELDS[field].value(found.beam, instant.position, found.xi), FIELDS[field].unit)),
        ]),
      ),
    );
    const box = holder.getBoundingClientRect(), wide = 250;
    tip.style.left = `${Math.max(0, Math.min(event.clientX - box.left + 16, box.width - wide))}px`;
    tip.hidden = false;
    // Below the pointer, or above it if it would be cut off.
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
  // A touch on a link drags the link; a touch elsewhere scrolls the page.
  svg.addEventListener("touchstart", (event) => {
    if (grabbed) event.preventDefault();
  }, { passive: false });
  return () => {
    if (last && !grabbed) hover(last);
  };
}
