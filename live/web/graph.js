// The graph of a figure (e.g. a force) over the positions, and lists with a search field.
import { quantity, view } from "./view.js";
import { $, make, options } from "./state.js";
const SHORT = 12; // a list with more entries has a search field
const HEIGHT = 140, TOP = 22, BOTTOM = 22, RIGHT = 8, LETTER = 7, NONE = "none"; // pixels

// The name of the figure in the graph; empty if there is no graph.
export const figure = () => ($("figure").value === NONE ? "" : $("figure").value);

export function listFigures() {
  const names = (view.picture?.columns ?? []).map(({ name }) => name), before = figure();
  if (names.length < 2 || names.length + 1 === $("figure").options.length) return; // a drag: one column
  $("figure").replaceChildren(new Option(NONE, NONE), ...options(names));
  $("figure").value = names.includes(before) ? before : NONE;
}

export function drawGraph() {
  const { picture } = view, at = picture?.columns?.findIndex(({ name }) => name === figure()) ?? -1;
  $("graph").toggleAttribute("hidden", at < 0); // an SVG element has no property `hidden`
  $("graphed").hidden = at < 0;
  if (at < 0) return;
  const { values, shape: [, count] } = picture.arrays.columns, { unit } = picture.columns[at];
  const course = Array.from(values.subarray(at * count, (at + 1) * count)), known = course.filter(Number.isFinite);
  const least = Math.min(...known), most = Math.max(...known), width = view.width;
  const numbers = [quantity(most, unit), quantity(least, unit)];
  const left = 12 + LETTER * Math.max(...numbers.map(({ length }) => length)), foot = HEIGHT - BOTTOM;
  const x = (k) => left + ((width - RIGHT - left) * k) / Math.max(1, count - 1);
  const y = (value) => foot - ((foot - TOP) * (value - least)) / (most - least || 1);
  const line = course.map((value, k) => (Number.isFinite(value) ? `${x(k).toFixed(1)},${y(value).toFixed(1)}` : " "));
  const now = Math.min(view.position, count - 1);
  $("graph").setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  $("curve").setAttribute("d", line.join("L").split(/L? L?/).filter(Boolean).map((part) => `M${part}`).join(""));
  $("zero").setAttribute("d", least <= 0 && most >= 0 ? `M${left},${y(0).toFixed(1)}H${x(count - 1)}` : "M0,0");
  $("frame").setAttribute("d", `M${left},${TOP}V${foot}H${x(count - 1)}`);
  $("now").setAttribute("d", `M${x(now).toFixed(1)},${TOP}V${foot}`);
  const { values: time } = picture.arrays.time, below = HEIGHT - 6, ends = [time[0], time[count - 1]];
  write("most", numbers[0], left - 6, TOP + 5, "end");
  write("least", numbers[1], left - 6, foot, "end");
  write("named", figure(), left, 14, "start");
  write("from", quantity(ends[0], "s"), left, below, "start");
  write("span", "time", (left + width) / 2, below, "middle");
  write("to", quantity(ends[1], "s"), width - RIGHT, below, "end");
  const range = `from ${quantity(least, unit)} to ${quantity(most, unit)}`;
  $("graphed").textContent = `${quantity(course[now], unit)} here; ${range}`;
}

function write(id, words, x, y, anchor) {
  $(id).textContent = words;
  for (const [key, value] of Object.entries({ x, y, "text-anchor": anchor })) $(id).setAttribute(key, value);
}

// Adds a search field to a list. It finds text in the entries and their descriptions, and is hidden for a short list.
export function searchable(list, words) {
  const known = make("datalist", { id: `${list.id}-known` });
  const field = make("input", { type: "search", placeholder: "search", hidden: true, className: "search" });
  const entries = () => [...list.options].filter(({ value }) => value);
  const has = (sought, ...where) =>
    entries().find((each) => where.some((key) => each[key].toLowerCase().includes(sought)));
  field.setAttribute("list", known.id);
  field.setAttribute("aria-label", `Search in the list ${words}`);
  field.onfocus = () => known.replaceChildren(...entries().map(({ text, title }) => new Option(title || text, text)));
  field.onchange = () => {
    const sought = field.value.trim().toLowerCase();
    const found = entries().find(({ text }) => text.toLowerCase() === sought) ?? has(sought, "text") ??
      has(sought, "title");
    field.value = "";
    field.placeholder = sought && !found ? "no match" : "search";
    field.ariaInvalid = String(Boolean(sought && !found));
    if (!sought || !found) return;
    list.value = found.value;
    list.dispatchEvent(new Event("change"));
  };
  const hide = () => (field.hidden = list.options.length <= SHORT);
  new MutationObserver(hide).observe(list, { childList: true });
  hide();
  list.closest("label").after(field, known);
}
