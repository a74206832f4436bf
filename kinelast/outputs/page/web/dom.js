// Creates elements from data. Text is always inserted as text, never as markup.
/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

// Both create an element from its tag and classes, such as "p.soft", optional attributes, and children.
const h = (name, ...given) => filled(document.createElement(name.split(".")[0]), name, given);
const s = (name, ...given) => filled(document.createElementNS(SVG, name.split(".")[0]), name, given);

function filled(element, name, given) {
  const [attributes, ...children] = given[0]?.constructor === Object ? given : [{}, ...given];
  put(element, { class: name.split(".").slice(1).join(" ") || null, ...attributes });
  element.append(...children.flat(9).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}

function put(element, attributes) {
  for (const [name, value] of Object.entries(attributes)) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
}

const button = (words, onclick, attributes = {}) => h("button", { type: "button", ...attributes, onclick }, words);
// A select element with its label. The options are created by `option` and may be grouped.
const choice = (id, change, ...options) =>
  h("select", { id, onchange: (event) => change(event.target.value) }, options);
const option = (value, words = value, selected = false) => h("option", { value, selected }, words);
const labelled = (words, field) => [h("label", { for: field.id }, words), field];
const bar = (...children) => h("div.bar", children);

// A table that scrolls horizontally if it is too wide.
function wide(caption, heads, body, name = "table") {
  const whole = h(name, h("caption", caption), heads ? h("thead", h("tr", heads)) : null, body);
  return h("div.wide", { tabindex: 0, role: "region", "aria-label": caption }, whole);
}
// Headings that sort the rows when clicked. The current sort column is marked.
const sortingHead = (words, numeric, sort, title = null) =>
  h("th", { scope: "col", class: numeric ? "figure" : null, "aria-sort": "none" }, button(words, sort, { title }));
function markSorted(heads, by, falling) {
  heads.forEach((head, k) => head.setAttribute("aria-sort", k !== by ? "none" : falling ? "descending" : "ascending"));
}

// Bars for rows {name, size, words}, with lengths relative to the largest.
function strips(rows, least = 1e-300) {
  const most = Math.max(...rows.map(({ size }) => Math.abs(size)), least);
  const strip = (size) => h("i", { style: `width:${(100 * Math.abs(size)) / most}%`, class: size < 0 ? "less" : "" });
  return h(
    "ul",
    rows.map(({ name, size, words }) =>
      h("li", h("span", name), h("span.strip", { "aria-hidden": "true" }, strip(size)), h("span", words))
    ),
  );
}

const several = (count, word) => `${count} ${word}${count === 1 ? "" : "s"}`;
const largestOf = (values) => values.reduce((most, value) => Math.max(most, Math.abs(value) || 0), 0);

function download(name, type, content) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

const partSections = []; // of parts of a machine: each part's script adds its own

function section(id, short, heading, ...children) {
  $("contents").append(h("li", h("a", { href: `#${id}` }, short)));
  const part = h(
    "section",
    { id, "aria-labelledby": `${id}-heading` },
    h("h2", { id: `${id}-heading` }, heading),
    children,
  );
  $("main").append(part);
  return part;
}

// Names are shortened only if there is not enough space.
const short = (name) => (name.length > 24 ? `${name.slice(0, 23)}…` : name);
const long = (words) => (/\S{25}/.test(words) ? "long" : null);

const hint = (...words) => h("p.soft.hint", words); // what to do here: not on paper
const soft = (...words) => h("p.soft", words);
const jargon = (word, means) => h("abbr", { title: means, tabindex: 0 }, word);
const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
