// The state of the page, and functions for its fields.
/** @type {(id: string) => any} */
export const $ = (id) => document.getElementById(id);
/** @type {(tag: string, properties?: any, ...children: any[]) => any} */
export const make = (tag, properties = {}, ...children) => {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
};
export const labelled = (words, field) => make("label", {}, words, field);
export const options = (names) => names.map((name) => new Option(name, name));
export const state = {
  digest: "",
  saved: "",
  path: null,
  name: "",
  numbers: [],
  dragging: null,
  playing: null,
  latencies: [],
  drawing: [],
  whole: 0,
  queue: Promise.resolve(),
  shipped: {},
  tables: {},
  keys: {},
  motions: [],
};
// `isField`: whether an element is an input field (the text of the scene does not count). `typed`: whether a field
// contains a value that is not in the scene yet.
export const isField = ({ tagName, type, id }) =>
  (tagName === "INPUT" && ["text", "number"].includes(type)) || (tagName === "TEXTAREA" && id !== "text");
export const typed = (field) => isField(field) && field.value !== field.defaultValue;
export const hold = (field, value) => Object.assign(field, { defaultValue: value, value });
