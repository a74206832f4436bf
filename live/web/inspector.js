// The input fields of the selected link or drive, and its entries in the file.
import { quantity, view } from "./view.js";
import { edit } from "./requests.js";
import { $, hold, labelled, make, options, state } from "./state.js";
import { placeOfChosen, tableAt } from "./parts.js";

export function inspect() {
  listEntries();
  const box = $("inspector"), held = [...box.querySelectorAll("input, select")].indexOf(document.activeElement);
  box.replaceChildren();
  fillInspector(box);
  // keep the focus on the same field
  if (held >= 0) /** @type {NodeListOf<HTMLElement>} */ (box.querySelectorAll("input, select"))[held]?.focus();
}
function fillInspector(box) {
  const { chosen, sheet } = view;
  const link = chosen?.kind === "link" && sheet.links.find(({ name }) => name === chosen.name);
  $("delete").disabled = !chosen;
  if (chosen?.kind === "drive") return inspectDrive(Number(chosen.name), box);
  if (!link || link.name === "ground") return;
  for (const key of ["section", "material"]) {
    const onchange = () => edit({ do: "put", path: ["links", link.name, key], value: input.value });
    const input = hold(make("input", { size: key === "section" ? 12 : 9, onchange }), link[key] ?? "");
    input.setAttribute("list", `${key}s`);
    box.append(labelled(key === "section" ? "Section " : "Material ", input));
  }
}

// Shows the motion of a drive: a constant speed, or a curve with a travel, a duration, and optionally a return stroke.
const CONSTANT = "constant speed", SPLINE = "spline through points";
const opposite = (by) => (String(by).startsWith("-") ? String(by).slice(1) : `-${by}`);
function inspectDrive(at, box) {
  const { law, speed, slider, effort, motion } = view.sheet.drives[at], [first, second] = law ?? [];
  if (
    effort !== undefined ||
    (law &&
      (law.length > 2 || !state.motions.includes(first.curve) || typeof first.by !== "string" ||
        (second &&
          (second.curve !== first.curve || second.duration !== first.duration ||
            String(second.by) !== opposite(first.by)))))
  ) {
    box.append("Motion: as the text says");
    return;
  }
  const curve = make("select", {}, ...options(state.motions)),
    field = (value, size) => hold(make("input", { size }), value);
  curve.value = motion ? SPLINE : law ? first.curve : CONSTANT;
  if (motion || box.dataset.spline === String(at)) return inspectSpline(at, box, curve);
  const rate = field(speed ?? (slider ? "0.1 m/s" : "60 rpm"), 8),
    by = field(first?.by ?? (slider ? "50 mm" : "90 deg"), 7),
    time = field(first?.duration ?? "1 s", 6),
    back = make("input", { type: "checkbox", checked: !law || Boolean(second) });
  const tell = () => {
    const motion = { speed: rate.value, by: by.value, duration: time.value, back: back.checked };
    edit({ do: "law", drive: at, curve: curve.value, ...motion });
  };
  for (const each of [rate, by, time, back]) each.onchange = tell;
  curve.onchange = () => {
    if (curve.value !== SPLINE) return tell();
    box.dataset.spline = at;
    inspect();
  };
  box.append(
    labelled("Motion ", curve),
    ...(law ? [labelled("By ", by), labelled("In ", time), labelled("And back ", back)] : [labelled("Speed ", rate)]),
    peakWords(at),
  );
}
// Shows the times and coordinates of a spline as CSV text. The user can change the text or load a file.
function inspectSpline(at, box, curve) {
  const { motion, slider } = view.sheet.drives[at],
    area = hold(
      make("textarea", { className: "points", rows: 5 }),
      Array.isArray(motion)
        ? motion.map((row) => row.join(", ")).join("\n")
        : `time [s], ${slider ? "way [mm]" : "angle [deg]"}\n0, 0\n0.25, 30\n0.5, 0\n0.75, -30\n1, 0`,
    ),
    file = make("input", { type: "file", accept: ".csv,text/csv,text/plain" });
  const tell = () => edit({ do: "law", drive: at, curve: SPLINE, points: area.value });
  curve.value = SPLINE;
  const beside = typeof motion === "string";
  curve.onchange = () => {
    delete box.dataset.spline;
    const usual = slider ? { speed: "0.1 m/s", by: "50 mm" } : { speed: "60 rpm", by: "90 deg" };
    if (curve.value !== SPLINE) {
      edit({ do: "law", drive: at, curve: curve.value, ...usual, duration: "1 s", back: true });
    }
  };
  area.onchange = tell;
  file.onchange = async () => {
    if (file.files[0]) {
      area.value = await file.files[0].text();
      tell();
    }
  };
  box.append(
    labelled("Motion ", curve),
    ...(beside ? [`in ${motion}, beside the scene`] : [labelled("Times and coordinates ", area)]),
    labelled(beside ? "or here, of a CSV file " : "or of a CSV file ", file),
    peakWords(at),
  );
  if (!motion) {
    delete box.dataset.spline;
    tell();
  }
}
// Returns the largest rate, acceleration and jerk of the law of a drive in words.
function peakWords(at) {
  const { peaks, unit } = view.picture?.drives[at] ?? {}, words = make("span", { className: "soft" });
  if (peaks) {
    words.textContent = `up to ${quantity(peaks[0], `${unit}/s`)}, ${quantity(peaks[1], `${unit}/s²`)}, jerk ${
      peaks[2] === null ? "infinite: the acceleration steps" : quantity(peaks[2], `${unit}/s³`)
    }`;
  }
  return words;
}

// Returns a value as written in the file.
const written = (
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
// Lists the keys of the selected part in the file, followed by the keys that can be added.
function listEntries() {
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
