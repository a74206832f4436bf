// A graph of one figure over the positions, beside the drawing; and lists that can be searched.
import { quantity, view } from "./view.js";
/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
const SHORT = 12; // entries of a list that needs no search
const HEIGHT = 100, EDGE = 6, NONE = "none";

// The name of the figure that is drawn; empty where none is.
export const figure = () => ($("figure").value === NONE ? "" : $("figure").value);

export function listFigures() {
  const names = (view.picture?.columns ?? []).map(({ name }) => name), before = figure();
  if (names.length < 2 || names.length + 1 === $("figure").options.length) return; // of a drag there is one
  $("figure").replaceChildren(new Option(NONE, NONE), ...names.map((name) => new Option(name, name)));
  $("figure").value = names.includes(before) ? before : NONE;
}

export function drawGraph() {
  const { picture } = view, at = picture?.columns?.findIndex(({ name }) => name === figure()) ?? -1;
  $("graph").toggleAttribute("hidden", at < 0); // a drawing has no property of this name
  $("graphed").hidden = at < 0;
  if (at < 0) return;
  const { values, shape: [, count] } = picture.arrays.columns, { unit } = picture.columns[at];
  const course = Array.from(values.subarray(at * count, (at + 1) * count)), known = course.filter(Number.isFinite);
  const least = Math.min(...known), most = Math.max(...known), width = view.width;
  const x = (k) => EDGE + ((width - 2 * EDGE) * k) / Math.max(1, count - 1);
  const y = (value) => HEIGHT - EDGE - ((HEIGHT - 2 * EDGE) * (value - least)) / (most - least || 1);
  const line = course.map((value, k) => (Number.isFinite(value) ? `${x(k).toFixed(1)},${y(value).toFixed(1)}` : " "));
  const now = Math.min(view.position, count - 1);
  $("graph").setAttribute("viewBox", `0 0 ${width} ${HEIGHT}`);
  $("curve").setAttribute("d", line.join("L").split(/L? L?/).filter(Boolean).map((part) => `M${part}`).join(""));
  $("zero").setAttribute("d", least <= 0 && most >= 0 ? `M0,${y(0).toFixed(1)}H${width}` : "M0,0");
  $("now").setAttribute("d", `M${x(now).toFixed(1)},0V${HEIGHT}`);
  const range = `from ${quantity(least, unit)} to ${quantity(most, unit)}`;
  $("graphed").textContent = `${quantity(course[now], unit)} here; ${range}`;
}

// A field beside a long list: what is typed there is found among its entries and the words on them.
export function searchable(list, words) {
  const known = Object.assign(document.createElement("datalist"), { id: `${list.id}-known` });
  const field = Object.assign(document.createElement("input"), { type: "search", placeholder: "search", hidden: true });
  const options = () => [...list.options].filter(({ value }) => value);
  const has = (sought, ...where) =>
    options().find((each) => where.some((key) => each[key].toLowerCase().includes(sought)));
  field.className = "search";
  field.setAttribute("list", known.id);
  field.setAttribute("aria-label", `Search in the list ${words}`);
  field.onfocus = () => known.replaceChildren(...options().map(({ text, title }) => new Option(title || text, text)));
  field.onchange = () => {
    const sought = field.value.trim().toLowerCase();
    const found = options().find(({ text }) => text.toLowerCase() === sought) ?? has(sought, "text") ??
      has(sought, "title");
    field.value = "";
    if (!sought || !found) return;
    list.value = found.value;
    list.dispatchEvent(new Event("change"));
  };
  new MutationObserver(() => {
    field.hidden = list.options.length <= SHORT;
  }).observe(list, { childList: true });
  field.hidden = list.options.length <= SHORT;
  list.closest("label").after(field, known);
}
