// The parts of the scene by kind and name, and their tables in the file.
import { view } from "./view.js";
import { state } from "./state.js";

export const PATHS = {
  point: "points",
  link: "links",
  slot: "slots",
  slider: "sliders",
  mass: "masses",
  spring: "springs",
  load: "loads",
  drive: "drives",
  gear: "gears",
  cylinder: "cylinders",
  weld: "welds",
  section: "sections",
  material: "materials",
  motor: "motors",
  joint: "joints",
  bearing: "bearings",
  cam: "cams",
};
// Parts that are not drawn: kinds of parts with names, and tables that occur only once.
export const BESIDE = ["section", "material", "motor", "joint", "bearing", "cam"],
  TABLES = ["run", "limits", "fatigue", "sweep", "tolerances", "sensitivities", "optimize"];
export const tableAt = (path) => path.reduce((table, key) => table?.[key], state.tables);
// Returns the path of the table of the selected part in the file, and the kind of this table.
export function placeOfChosen() {
  const { chosen } = view;
  if (!chosen) return [[], "scene"];
  const kind = PATHS[chosen.kind] ?? chosen.name;
  return [
    chosen.kind === "table" ? [chosen.name] : [kind, NUMBERED[chosen.kind] ? Number(chosen.name) : chosen.name],
    kind,
  ];
}
export const NUMBERED = { spring: "springs", load: "loads", drive: "drives", gear: "gears" };
export const parts = () => {
  const { sheet } = view;
  if (!sheet) return [];
  const of = (kind, names) => names.map((name) => ({ kind, name }));
  return [
    ...of("point", Object.keys(sheet.points)),
    ...of("link", sheet.links.map(({ name }) => name)),
    ...of("slot", Object.keys(sheet.slots)).map((
      part,
    ) => (sheet.sliders.includes(part.name) ? { ...part, kind: "slider" } : part)),
    ...of("weld", sheet.welds),
    ...of("mass", Object.keys(sheet.masses)),
    ...of("spring", Object.keys(sheet.springs)),
    ...of("load", Object.keys(sheet.loads)),
    ...of("drive", Object.keys(sheet.drives)),
    ...of("cylinder", Object.keys(sheet.cylinders)),
    ...of("gear", Object.keys(sheet.gears)),
    ...BESIDE.flatMap((kind) => of(kind, Object.keys(tableAt([PATHS[kind]]) ?? {}))),
    ...TABLES.filter((name) => tableAt([name])).map((name) => ({ kind: "table", name })),
  ];
};
export const partName = ({ kind, name }) => {
  const entry = NUMBERED[kind] && view.sheet[NUMBERED[kind]][name];
  return `${kind} ${
    entry
      ? `${Number(name) + 1}: ${entry.joints?.join(", ") ?? entry.link ?? entry.slider ?? ""}${
        entry.point ? ` at ${entry.point}` : ""
      }`
      : name
  }`;
};
