// The state of the page, and its fields.
/** @type {(id: string) => any} */
export const $ = (id) => document.getElementById(id);
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
// Fields of a value, beside the text of the scene; and whether one holds letters that are not in the scene yet.
export const isField = ({ tagName, type, id }) =>
  (tagName === "INPUT" && ["text", "number"].includes(type)) || (tagName === "TEXTAREA" && id !== "text");
export const typed = (field) => isField(field) && field.value !== field.defaultValue;
export const hold = (field, value) => Object.assign(field, { defaultValue: value, value });
