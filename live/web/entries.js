// Shows the entries of the selected part in the file, and the entries that can be added.
import { view } from "./view.js";
import { edit } from "./requests.js";
import { $, hold, state } from "./state.js";
import { placeOfChosen, tableAt } from "./parts.js";

// The entries of the selected part in the file, followed by those that can be added.
export const written = (
  value,
) => (typeof value === "string"
  ? value
  : Array.isArray(value)
  ? `[${value.map((each) => (typeof each === "string" ? JSON.stringify(each) : written(each))).join(", ")}]`
  : value && typeof value === "object"
  ? `{${
    Object.entries(value).map(([key, each]) =>
      `${/^[\w-]+$/.test(key) ? key : JSON.stringify(key)} = ${
        typeof each === "string" ? JSON.stringify(each) : written(each)
      }`
    ).join(", ")
  }}`
  : String(value ?? ""));
export function listEntries() {
  const list = $("key"),
    before = list.value,
    [path, kind] = placeOfChosen(),
    found = tableAt(path),
    table = path.length && found && typeof found === "object" && !Array.isArray(found) ? found : {},
    known = path.length ? state.keys[kind] ?? [] : [],
    more = known.filter(([key]) => !(key in table));
  list.replaceChildren(
    ...Object.keys(table).map((key) => new Option(key, key)),
    ...more.map(([key]) => new Option(`+ ${key}`, key)),
  );
  for (const option of list.options) option.title = known.find(([key]) => key === option.value)?.[1] ?? "";
  list.disabled = $("entry").disabled = !list.options.length;
  if ([...list.options].some(({ value }) => value === before)) list.value = before;
  showEntry();
}
export function showEntry() {
  const [path, kind] = placeOfChosen(), key = $("key").value;
  hold($("entry"), key ? written(tableAt([...path, key])) : "");
  $("words").textContent = (key && state.keys[kind]?.find(([each]) => each === key)?.[1]) || "";
}
export function enter() {
  const [path] = placeOfChosen(), key = $("key").value;
  if (key && path.length) edit({ do: "entry", path: [...path, key], value: $("entry").value });
}
