// Tools on the drawing. They convert events of the pointer and keys to edits of the scene.
import { draw, drawGrid } from "./drawing.js";
import { linkUnder, nearestPosition, pointUnder } from "./links.js";
import { direction, joint, near, onGrid, onLink, picked, placed, shareOf, snapped } from "./places.js";
import { fillToolbar, showTool, TOOLS } from "./toolbar.js";
import { drawnNow, gridStep, handle, pointNow, quantity, toPlane, toScreen, view } from "./view.js";
import { $ } from "./state.js";
const svg = $("svg");
/** @type {any} */
let gesture = null;
let tool = "move", clicks = [], driver = null, actions = null, visited = -1;

export function begin(given) {
  actions = given;
  fillToolbar(take, actions);
  take("move");
  svg.addEventListener("pointerdown", down);
  svg.addEventListener("pointermove", moved);
  svg.addEventListener("pointerup", up);
  svg.addEventListener("pointercancel", cancel);
  svg.addEventListener("touchstart", (event) => {
    if (gesture && gesture.kind !== "pan") event.preventDefault();
  }, { passive: false });
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey && document.activeElement !== svg) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 400), at(event));
  }, { passive: false });
  svg.addEventListener("keydown", keys);
}

export function take(name) {
  tool = name;
  clear();
  showTool(name);
}

function clear() {
  [clicks, driver, visited] = [[], null, -1];
  Object.assign(view, { preview: null, guides: [] });
  draw();
}

const at = (event) => {
  const box = svg.getBoundingClientRect();
  return [event.clientX - box.left, event.clientY - box.top];
};

export function zoom(factor, around = [view.width / 2, view.height / 2]) {
  const before = toPlane(around);
  view.scale = Math.max(1e-3, Math.min(1e7, view.scale * factor));
  const after = toPlane(around);
  view.x += before[0] - after[0];
  view.y += before[1] - after[1];
  drawGrid();
  draw();
}

function down(event) {
  if (event.button > 0 || !view.sheet) return;
  view.cursor = null;
  svg.setPointerCapture?.(event.pointerId);
  pressed(at(event), event.pointerType === "touch", event.pointerId);
}

function pressed(screen, touch, id) {
  const point = pointUnder(screen, touch ? 26 : 15), link = linkUnder(screen, touch ? 18 : 11);
  gesture = { id, from: screen, last: screen, moved: false };
  if (tool === "move") {
    if (point) {
      // use the deflected or the rigid position of the point, whichever is nearer
      const [rigid, drawn] = [pointNow(point), drawnNow(point)].map(toScreen),
        away = (p) => Math.hypot(p[0] - screen[0], p[1] - screen[1]);
      Object.assign(gesture, {
        kind: "point",
        point,
        off: away(drawn) < away(rigid) ? drawn.map((value, k) => value - rigid[k]) : [0, 0],
      });
      actions.choose("point", point);
    } else if (link) {
      gesture.kind = "link";
      gesture.link = link;
      actions.choose(...(link.cylinder ? ["cylinder", link.cylinder] : ["link", link.link]));
    } else gesture.kind = "pan";
  } else if (tool === "link" || tool === "spring" || tool === "cylinder" || tool === "load") {
    gesture.kind = "line";
    if (!clicks.length) {
      const first = joint(screen);
      if (tool !== "load" || typeof first === "string") clicks = [first];
    } else gesture.second = true;
  } else if (tool === "slot" && point) {
    Object.assign(gesture, { kind: "slot", point, on: linkUnder(screen, 11, point)?.link });
  } else if (tool === "trace" && link?.link) {
    Object.assign(gesture, { kind: "trace", link });
    actions.position(0);
  } else gesture.kind = "click";
}

function moved(event) {
  const screen = at(event);
  if (gesture && gesture.id !== event.pointerId) return;
  if (gesture && event.pointerType === "mouse" && !event.buttons) return up(event); // button released elsewhere
  if (clicks.length && (!gesture || gesture.kind === "line" || tool === "plate")) {
    view.preview = [...clicks.map(placed), placed(tool === "load" ? toPlane(screen) : joint(screen))];
    draw();
  }
  if (!gesture) {
    svg.style.cursor = pointUnder(screen) || linkUnder(screen) ? "pointer" : tool === "move" ? "grab" : "crosshair";
    return;
  }
  if (!gesture.moved && Math.hypot(screen[0] - gesture.from[0], screen[1] - gesture.from[1]) < 4) return;
  const first = !gesture.moved;
  gesture.moved = true;
  if (gesture.kind === "point") {
    if (first) actions.grab();
    const to = snapped(screen.map((value, k) => value - gesture.off[k]), gesture.point);
    actions.drag({ do: "move", point: gesture.point, to }, event.timeStamp);
  } else if (gesture.kind === "slot") {
    const from = pointNow(gesture.point), [c, s] = direction(gesture.point, screen), reach = 60 / view.scale;
    view.preview = [-1, 1].map((way) => [from[0] + way * reach * c, from[1] + way * reach * s]);
    draw();
  } else if (gesture.kind === "trace") {
    view.preview = [onLink(gesture.link), placed(picked(screen))];
    draw();
  } else if (gesture.kind === "link") actions.position(nearestPosition(gesture.link, toPlane(screen)));
  else if (gesture.kind === "pan") {
    view.x -= (screen[0] - gesture.last[0]) / view.scale;
    view.y += (screen[1] - gesture.last[1]) / view.scale;
    drawGrid();
    draw();
  }
  gesture.last = screen;
}

function up(event) {
  const done = gesture;
  gesture = null;
  if (done && done.id === event.pointerId) released(done, at(event));
}

function released(done, screen) {
  view.guides = [];
  if (done.kind === "trace") view.preview = null;
  if (done.kind === "point") { if (done.moved) actions.drop(); }
  else if (done.kind === "pan" && !done.moved) actions.choose(null);
  else if (done.kind === "line") line(done, screen);
  else if (done.kind === "slot") {
    view.preview = null;
    actions.edit({
      do: "slot",
      point: done.point,
      ...(done.on && { on: done.on }),
      ...(done.moved && { direction: direction(done.point, screen) }),
    });
  } else if (done.kind === "trace") {
    actions.edit({
      do: "trace",
      link: done.link.link,
      ...(done.moved ? { at: picked(screen) } : { between: done.link.ends, share: shareOf(done.link) }),
    });
  } else if (done.kind === "click") click(screen);
  draw();
}

function cancel() {
  if (gesture?.kind === "point" && gesture.moved) actions.drop();
  gesture = null;
  clear();
}

function line(done, screen) {
  if (!clicks.length || (!done.moved && !done.second)) return; // this was the first of two clicks
  const first = clicks[0], last = tool === "load" ? toPlane(screen) : joint(screen);
  clear();
  if (tool === "load") {
    const from = toScreen(pointNow(first));
    return actions.edit({
      do: "load",
      point: first,
      force: [Math.round(screen[0] - from[0]), Math.round(from[1] - screen[1])],
    });
  }
  if (JSON.stringify(first) === JSON.stringify(last)) return;
  if (tool === "cylinder") return actions.edit({ do: "cylinder", from: first, to: last });
  if (tool === "spring") return actions.edit({ do: "spring", from: first, to: last });
  actions.edit({ do: "link", points: [first, last], section: $("section").value, material: $("material").value });
}

function click(screen) {
  if (tool === "plate") {
    const next = joint(screen), ends = clicks.length > 2 && near(clicks[0], screen);
    if (ends) return plate(true);
    clicks.push(next);
    view.preview = clicks.map(placed);
    return;
  }
  if (tool === "drive") {
    const slides = pointUnder(screen),
      link = linkUnder(screen, 16),
      slot = Object.values(view.sheet.slots).some(({ point }) => point === slides);
    if (slot) actions.edit({ do: "drive", point: slides });
    else if (link?.link) actions.edit({ do: "drive", link: link.link });
    return;
  }
  if (tool === "gear") {
    const slides = pointUnder(screen),
      rack = Object.values(view.sheet.slots).some(({ point }) => point === slides),
      link = rack ? { point: slides } : linkUnder(screen, 16)?.link;
    if (!link) return;
    if (driver === null) {
      driver = link;
      actions.choose(...(rack ? ["point", slides] : ["link", link]));
    } else {
      const first = driver;
      driver = null;
      actions.edit({ do: "gear", driver: first, follower: link });
    }
    return;
  }
  const point = pointUnder(screen);
  if (point) actions.edit({ do: tool, point });
  else if (tool === "fix") actions.edit({ do: "point", at: snapped(screen), fixed: true });
}

function plate(closed) {
  const points = clicks;
  clear();
  if (points.length > 1) {
    actions.edit({ do: "link", points, closed, section: $("section").value, material: $("material").value });
  }
}

// --- keyboard control: arrow keys move a cursor, N moves it to the next part, and Enter clicks at the cursor

// Returns the names and positions of the parts that a tool can select. The position of a link is its midpoint.
function targets() {
  const { sheet } = view, ofLinks = ["drive", "gear", "trace"].includes(tool);
  const points = Object.keys(sheet.points).map((name) => [`point ${name}`, pointNow(name)]);
  const middle = ({ points: ends, beams }) => {
    const [a, b] = (beams[0] ?? ends).slice(0, 2).map((name) => pointNow(name));
    return a && b && [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
  };
  const links = ofLinks || tool === "move"
    ? sheet.links.filter(({ name }) => name !== "ground").map((link) => [`link ${link.name}`, middle(link)])
    : [];
  return (ofLinks ? [...links, ...points] : [...points, ...links]).filter(([, place]) =>
    place && place.every(Number.isFinite)
  );
}

function put(place, words) {
  view.cursor = place;
  const screen = toScreen(place),
    [x, y] = [0, 1].map((
      k,
    ) => (screen[k] < 20
      ? screen[k] - 60
      : screen[k] > [view.width, view.height][k] - 20
      ? screen[k] - [view.width, view.height][k] + 60
      : 0)
    );
  if (x || y) {
    view.x += x / view.scale;
    view.y -= y / view.scale;
    drawGrid();
  } // the view follows the cursor
  if (clicks.length) view.preview = [...clicks.map(placed), place];
  draw();
  const under = pointUnder(toScreen(place)), link = under ? null : linkUnder(toScreen(place))?.link;
  $("where").textContent = words ??
    [
      `${quantity(place[0], "m", 6)}, ${quantity(place[1], "m", 6)}`,
      under ? `point ${under}` : link ? `link ${link}` : "",
    ].filter(Boolean).join(": ");
}

function next(back) {
  const known = targets();
  if (!known.length) return put(view.cursor ?? onGrid([view.x, view.y]), "no point yet");
  visited = (visited + (back ? -1 : 1) + (back && visited < 0 ? 1 : 0) + known.length) % known.length;
  put(known[visited][1], known[visited][0]);
}

function press() {
  if (!view.cursor) return put(onGrid([view.x, view.y]));
  const screen = toScreen(view.cursor), last = clicks.at(-1), again = tool === "plate" && last && near(last, screen);
  if (again) return plate(false);
  view.exact = true;
  pressed(screen, false, "keys");
  const done = gesture;
  gesture = null;
  released(done, screen);
  view.exact = false;
  put(view.cursor, clicks.length ? "first taken: go to the next, and Enter" : undefined);
}

export function keys(event) {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const named = TOOLS.find(([, , key]) => key === event.key.toLowerCase()),
    arrow = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key];
  if (named) take(named[0]);
  else if (event.key === "Escape") {
    view.cursor = null;
    $("where").textContent = "";
    take("move");
  } else if (event.key === "Enter" && tool === "plate" && !view.cursor) plate(false);
  else if (event.key === "Enter") press();
  else if (event.key.toLowerCase() === "n") next(event.shiftKey);
  else if (event.key === "Delete" || event.key === "Backspace") actions.remove();
  else if (event.key === " ") actions.play();
  else if (event.key === "+" || event.key === "=") zoom(1.25);
  else if (event.key === "-") zoom(0.8);
  else if (arrow && tool !== "move") {
    const step = gridStep(6) * (event.shiftKey ? 10 : 1), here = view.cursor ?? onGrid([view.x, view.y]);
    put(onGrid(here.map((value, k) => value + step * arrow[k])));
  } else if (arrow && view.chosen?.kind === "point") {
    const step = gridStep(6) * (event.shiftKey ? 10 : 1), here = handle(view.chosen.name);
    actions.edit({
      do: "move",
      point: view.chosen.name,
      to: here.map((value, k) => Number((value + step * arrow[k]).toPrecision(9))),
    });
  } else if (arrow) actions.position(view.position + (arrow[0] || -arrow[1]));
  else return;
  event.preventDefault();
}
