// Chooses, adds, copies and removes parts.
import { draw } from "./drawing.js";
import { fit, toScreen, view } from "./view.js";
import { inspect } from "./inspector.js";
import { listNumbers, number } from "./numbers.js";
import { BESIDE, NUMBERED, partName, parts, placeOfChosen, tableAt, TABLES } from "./parts.js";
import { edit } from "./requests.js";
import { show } from "./shown.js";
import { $, state } from "./state.js";

export function listParts() {
  const known = parts();
  if (view.chosen && !known.some(({ kind, name }) => kind === view.chosen.kind && name === view.chosen.name)) {
    view.chosen = null;
  }
  $("chosen").replaceChildren(
    new Option("none", ""),
    ...known.map((part) => new Option(partName(part), `${part.kind} ${part.name}`)),
  );
  $("chosen").value = view.chosen ? `${view.chosen.kind} ${view.chosen.name}` : "";
  inspect();
}

export function choose(kind, name) {
  view.chosen = kind ? { kind, name } : null;
  $("chosen").value = kind ? `${kind} ${name}` : "";
  inspect();
  listNumbers(false);
  draw();
}

export function chooseNew(change) {
  const kind =
    { link: "link", load: "load", spring: "spring", drive: "drive", gear: "gear", cylinder: "cylinder" }[change?.do];
  if (!kind) return;
  const last = kind === "cylinder"
    ? Object.keys(view.sheet?.cylinders ?? {}).at(-1)
    : kind === "link"
    ? view.sheet?.links.at(-1)?.name
    : String((view.sheet?.[NUMBERED[kind]].length ?? 0) - 1);
  if (last && last !== "-1") choose(kind, last);
}

// The tables without a symbol that can be added: keys, and names in the menu.
export const ADDED = [
  ["sections", "section"],
  ["materials", "material"],
  ["motors", "motor of the drive"],
  ["joints", "joint that rubs, gives way, or does not fit"],
  ["bearings", "bearing"],
  ["cams", "cam under the point"],
  ["limits", "limits"],
  ["sweep", "sweep of the number"],
  ["tolerances", "tolerance of the number"],
  ["optimize", "optimum by the number"],
  ["sensitivities", "sensitivities"],
  ["fatigue", "fatigue"],
];
export function add(kind) {
  const { chosen } = view, now = number(), stem = kind.replace(/s$/, "");
  const of =
    (chosen?.kind === "link" && /sections|materials/.test(kind)) || (chosen?.kind === "drive" && kind === "motors") ||
      (chosen && kind in state.parts)
      ? placeOfChosen()[0]
      : null;
  const name = /joints|bearings|cams/.test(kind) && ["point", "slot", "slider"].includes(chosen?.kind)
    ? chosen.name
    : undefined;
  const before = new Set(Object.keys(tableAt([kind]) ?? {}));
  edit({
    do: "table",
    kind,
    ...(name && { name }),
    ...(of && { of }),
    ...(now && { number: now.path, low: now.low, high: now.high, unit: now.unit }),
  }).then(() => {
    const fresh = Object.keys(tableAt([kind]) ?? {}).find((each) => !before.has(each));
    if (BESIDE.includes(stem) && fresh) choose(stem, fresh);
    else if (TABLES.includes(kind) && tableAt([kind])) choose("table", kind);
  });
}

export function remove() {
  const { chosen } = view;
  if (chosen) {
    view.chosen = null;
    edit({ do: "remove", ...chosen });
  }
}

export function copy(mirror) {
  const { kind, name } = view.chosen ?? {}, of = { link: "link", point: "about" }[kind];
  edit({ do: "copy", mirror, ...(of && { [of]: name }) }).then(() => {
    if (!allSeen()) {
      fit();
      show();
    }
  });
}

const allSeen = () =>
  Object.values(view.sheet.points).map(toScreen).every(([x, y]) => x > 0 && y > 0 && x < view.width && y < view.height);
