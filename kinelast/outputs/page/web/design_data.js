// The designs: their numbers and figures, the better direction of each, the selection, and the listeners.
const data = JSON.parse($("designs").textContent);
const COUNT = data.count;
Object.assign(chosenUnits, data.shown_in);
const arrays = unpacked(data.arrays, COUNT);
const columnOf = (name) => arrays[name].values;
const designOf = (k) => columnOf("#design")[k];
const reasonOf = (k) => data.reasons[columnOf("#reason")[k]];
const every = Array.from({ length: COUNT }, (_, k) => k);
const axes = [...data.numbers, ...data.figures];

// Angles are in degrees; other quantities have a prefix suitable for the largest value.
const scaleFor = Object.fromEntries(axes.map((name) => {
  const unit = data.units[name];
  if (unit === "rad") return [name, [180 / Math.PI, "deg"]];
  return [name, scaleOf(largestOf(columnOf(name)), unit)];
}));
const valueWords = (name, k, digits = 4) => number(columnOf(name)[k] * scaleFor[name][0], digits);
const unitOf = (name) => unitWords(scaleFor[name][1]);
const axisWords = (name) => `${name}${unitOf(name) ? ` [${unitOf(name)}]` : ""}`;

const state = {
  x: null,
  y: null,
  colour: "",
  greater: new Set(data.greater),
  within: {},
  chosen: null,
  hovered: null,
  printing: false,
};
const listeners = { change: [], choice: [], brush: [] };
const tell = (what) => listeners[what].forEach((listener) => listener());

const bestPlace = data.best === null ? null : every.find((k) => designOf(k) === data.best) ?? null;

function inside(k) {
  for (const [name, [low, high]] of Object.entries(state.within)) {
    const value = columnOf(name)[k];
    if (!(value >= low && value <= high)) return false;
  }
  return true;
}
const known = (...names) => every.filter((k) => names.every((name) => isFinite(columnOf(name)[k])));

// Pareto front of two figures, in the order of the first.
function frontOf(x, y, among) {
  const way = (name) => (state.greater.has(name) ? -1 : 1),
    [a, b] = [way(x), way(y)],
    [one, other] = [columnOf(x), columnOf(y)];
  const sorted = [...among].sort((k, m) => a * (one[k] - one[m]) || b * (other[k] - other[m])), found = [];
  let least = Infinity;
  for (const k of sorted) {
    if (b * other[k] < least) {
      least = b * other[k];
      found.push(k);
    }
  }
  return found;
}

function choose(k) {
  state.chosen = k;
  tell("choice");
}

// Colour scale from low to high values.
const RAMP = [[68, 1, 84], [59, 82, 139], [33, 145, 140], [94, 201, 98], [223, 197, 30]];
function ramp(part) {
  const place = Math.max(0, Math.min(1, part)) * (RAMP.length - 1),
    low = Math.min(RAMP.length - 2, Math.floor(place)),
    way = place - low;
  return `rgb(${RAMP[low].map((one, k) => Math.round(one + way * (RAMP[low + 1][k] - one))).join(",")})`;
}
function spanOf(name, among = known(name)) {
  let low = Infinity, high = -Infinity;
  const values = columnOf(name);
  for (const k of among) {
    if (values[k] < low) low = values[k];
    if (values[k] > high) high = values[k];
  }
  if (!(high >= low)) return [0, 1];
  const room = high > low ? 0 : Math.abs(high) * 0.05 || 0.5;
  return [low - room, high + room];
}
// True if a design's full answer breaks a limit, or its quasi-static figures if it has no full answer.
function breaks(k) {
  const answer = data.answered[String(designOf(k))];
  if (answer?.verdict) return answer.verdict === "not acceptable";
  return data.figures.includes("limits_kept") && columnOf("limits_kept")[k] === 0;
}
const brokenFirst = (some) => [...some.filter(breaks), ...some.filter((k) => !breaks(k))];
const BREAKS = "#9aa3ad"; // grey
function colours() {
  const name = state.colour;
  if (!name) return (k) => (breaks(k) ? BREAKS : variable("--accent"));
  const [low, high] = spanOf(name), values = columnOf(name);
  const paint = (value) => (isFinite(value) ? ramp((value - low) / (high - low)) : variable("--soft"));
  return (k) => (breaks(k) ? BREAKS : paint(values[k]));
}

// A canvas with the width of its container and the resolution of the screen, which is redrawn when its size changes.
function canvasIn(holder, height, draw, words) {
  const canvas = h("canvas.drawn", { role: "img", "aria-label": words, tabindex: 0 }),
    above = h("canvas.drawn.above", { "aria-hidden": "true" });
  holder.append(canvas, above);
  const made = { canvas, above, width: 0, height };
  made.pen = (which) => which.getContext("2d");
  made.fit = () => {
    const ratio = window.devicePixelRatio || 1;
    made.width = Math.max(260, holder.clientWidth);
    for (const each of [canvas, above]) {
      each.width = Math.round(made.width * ratio);
      each.height = Math.round(height * ratio);
      each.style.height = `${height}px`;
      each.style.width = `${made.width}px`;
      made.pen(each).setTransform(ratio, 0, 0, ratio, 0, 0);
    }
    draw();
  };
  // Marks are above the picture on the screen, but part of it in print, where layers are not transparent.
  made.markPen = () => {
    if (state.printing) return made.pen(canvas);
    made.clear(above);
    return made.pen(above);
  };
  made.clear = (which) => made.pen(which).clearRect(0, 0, made.width, height);
  new ResizeObserver(() => {
    if (Math.abs(Math.max(260, holder.clientWidth) - made.width) > 1) made.fit();
  }).observe(holder);
  return made;
}
