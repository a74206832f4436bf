// Elements made of data: text is always text, never markup.
/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
const SVG = "http://www.w3.org/2000/svg";

function put(element, attributes, children) {
  for (const [name, value] of Object.entries(attributes ?? {})) {
    if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else if (value === true) element.setAttribute(name, "");
    else if (value !== false && value !== null && value !== undefined) element.setAttribute(name, value);
  }
  element.append(...children.flat(9).filter((child) => child !== null && child !== undefined && child !== false));
  return element;
}
const h = (tag, attributes, ...children) => put(document.createElement(tag), attributes, children);
const s = (tag, attributes, ...children) => put(document.createElementNS(SVG, tag), attributes, children);

function download(name, type, content) {
  const address = URL.createObjectURL(content instanceof Blob ? content : new Blob([content], { type }));
  h("a", { href: address, download: name }).click();
  setTimeout(() => URL.revokeObjectURL(address), 1000);
}

const partSections = []; // of parts of a machine: each part's script adds its own

function section(id, short, heading, ...children) {
  $("contents").append(h("li", {}, h("a", { href: `#${id}` }, short)));
  const part = h(
    "section",
    { id, "aria-labelledby": `${id}-heading` },
    h("h2", { id: `${id}-heading` }, heading),
    children,
  );
  $("main").append(part);
  return part;
}

// Names as long as they are, but where there is no room.
const short = (name) => (name.length > 24 ? `${name.slice(0, 23)}…` : name);
const long = (words) => (/\S{25}/.test(words) ? "long" : null);

const hint = (...words) => h("p", { class: "soft hint" }, words); // what to do here: not on paper
const soft = (...words) => h("p", { class: "soft" }, words);
const jargon = (word, means) => h("abbr", { title: means, tabindex: 0 }, word);
const variable = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();
