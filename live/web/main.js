// The page of the live editor: what is asked of the server, when, and what of its answers is shown where.
import * as text from "./text.js";
import * as talk from "./talk.js";
import { drawGraph, figure, listFigures, searchable } from "./graph.js";
import * as share from "./share.js";
import * as tools from "./tools.js";
import { draw, drawGrid, fit, measure, quantity, rescale, toScreen, view } from "./drawing.js";
/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
const state = {
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
const KEY = () => `live ${state.path ?? state.name}`;

// --- answers

function ask(job) {
  return new Promise((resolve) =>
    talk.quick({
      ...job,
      done: (answer) => {
        take(answer, job);
        resolve(answer);
      },
      failed: (words) => {
        if (words) notice(words);
        resolve(null);
      },
    })
  );
}

function take(answer, job) {
  if (answer.refused) notice(answer.refused, true);
  else if (!job.drag) hush();
  const began = performance.now();
  if (!job.typed) text.show(answer.text, Boolean(job.edits?.length));
  text.tellMistakes(answer.mistakes);
  if (answer.sheet) {
    view.sheet = answer.sheet;
    state.tables = answer.sheet.tables ?? state.tables;
  }
  $("empty").hidden = !view.sheet?.empty;
  if (view.sheet?.empty) view.picture = null;
  if (answer.picture) {
    view.picture = answer.picture;
    view.stale = false;
  } else view.stale = Boolean(view.picture);
  if (answer.numbers) {
    state.numbers = answer.numbers;
    listNumbers();
  }
  if (!job.drag) {
    if (answer.picture) rescale();
    listParts();
  }
  if (view.picture) view.position = Math.min(view.position, view.picture.positions - 1);
  show();
  keepInBrowser();
  if (job.stamp) state.drawing.push(performance.now() - began);
  if (job.stamp) {
    requestAnimationFrame(() => {
      const channel = new MessageChannel();
      channel.port1.onmessage = () => state.latencies.push(performance.now() - job.stamp);
      channel.port2.postMessage(0);
    });
  }
}

// Everything but a drag: edits one after the other, each of the text that the one before left; then the whole answer.
function edit(...edits) {
  return (state.queue = state.queue.then(async () => {
    const before = text.text(), answer = await ask({ text: before, edits, numbers: true });
    if (answer && !answer.refused) {
      text.keep(before);
      chooseNew(edits.at(-1));
      settle();
    }
  }));
}

function changed(whole, typed = false) {
  return ask({ text: whole, numbers: true, typed }).then((answer) => answer && settle());
}

let timer = 0;
function settle(wait = 150) {
  clearTimeout(timer);
  $("report").hidden = true;
  $("line").textContent = "";
  timer = setTimeout(() => {
    if (!view.picture || view.stale || !view.picture.closes.all) return;
    $("theory").textContent = `${theoryWords(view.picture)}; the whole answer is on its way …`;
    const asked = text.text();
    talk.full(asked, (answer) => {
      if (asked !== text.text()) return;
      if (!answer.picture) {
        $("theory").textContent = theoryWords(view.picture);
        $("line").textContent = answer.mistakes.map(({ message }) => message).join("; ");
        return;
      }
      const { position, picture } = view;
      view.picture = answer.picture;
      view.position = Math.round((position / Math.max(1, picture.positions)) * answer.picture.positions);
      rescale();
      show();
      $("line").textContent = answer.line;
      $("report").href = `report/${answer.report}`;
      $("report").hidden = !answer.report;
      state.whole++;
    });
  }, wait);
}

const theoryWords = ({ theory, quick, error, problem }) =>
  `${theory}${
    quick
      ? ` (quick: ${view.picture.positions} positions, error not told)`
      : error !== null && error !== undefined
      ? `, within ${Number((100 * error).toPrecision(2))} %`
      : problem
      ? `, error unknown: ${problem}`
      : ""
  }`;

// --- what is shown

const stopWords = (words) =>
  `${words[0].toUpperCase()}${words.slice(1)}. Dashed: the last position that closes; figures are of those up to it.`;

function show() {
  const { picture, stale } = view;
  drawGrid();
  draw();
  listFigures();
  drawGraph();
  const bar = $("position");
  bar.max = Math.max(0, (picture?.positions ?? 1) - 1);
  bar.value = view.position;
  $("instant").textContent = picture ? instant() : "";
  const notClosing = picture && !stale && !picture.closes.all;
  const buckles = picture && !stale && picture.buckles;
  $("closes").hidden = !(notClosing || stale || buckles);
  if (buckles) $("closes").textContent = `Not acceptable: ${buckles}.`;
  else if (notClosing) $("closes").textContent = stopWords(picture.closes.words);
  else if (stale) $("closes").textContent = "The text does not move as it stands: pale is the last mechanism that did.";
  if (!picture) {
    $("tiles").replaceChildren();
    $("theory").textContent = "";
    $("colours").textContent = "";
    return;
  }
  $("theory").textContent = theoryWords(picture);
  $("colours").replaceChildren(
    ...(view.most
      ? [
        "von Mises stress 0",
        document.createElement("i"),
        `${quantity(view.most, "Pa")}, displacements × ${view.factor}`,
      ]
      : []),
  );
  $("tiles").replaceChildren(...picture.limits.map(limitTile), ...picture.figures.map(figureTile));
}

function tile(kind, name, value, more) {
  const box = document.createElement("div"), figure = document.createElement("b");
  box.className = `tile ${kind}`;
  figure.textContent = value;
  box.append(name, figure, more);
  return box;
}
const NO_ERROR = 1e-6; // of a value, an error that is not told
const figureTile = ({ key, name, value, unit, on, error }) => {
  const box = tile(
    "",
    name,
    quantity(value, unit),
    [error === null || error <= NO_ERROR * Math.abs(value) ? "" : `± ${quantity(error, unit, 2)}`, on ?? ""].filter(
      Boolean,
    ).join(", "),
  );
  box.dataset.figure = key;
  box.dataset.value = value;
  return box;
};
const limitTile = ({ name, on, bound, value, unit, kept, outcome }) =>
  tile(
    kept ? "kept" : "broken",
    `limit: ${name}${on ? ` of ${on}` : ""}`,
    outcome ?? (kept ? "kept" : "not kept"),
    `${quantity(value, unit)}, allowed ${quantity(bound, unit)}`,
  );

function instant() {
  const { picture, position } = view, { time, drive, effort } = picture.arrays, count = picture.positions;
  const drives = picture.drives.map(({ name, unit, effort: of }, k) =>
    `${name} ${quantity(drive.values[k * count + position], unit)}, ${
      quantity(effort.values[k * count + position], of)
    }`
  );
  return [quantity(time.values[position], "s"), ...drives].join("; ");
}

function position(k) {
  const count = view.picture?.positions ?? 1;
  view.position = view.picture?.turn ? ((k % count) + count) % count : Math.max(0, Math.min(count - 1, k));
  $("position").value = view.position;
  $("instant").textContent = view.picture ? instant() : "";
  draw();
  drawGraph();
}

function play(on = state.playing === null) {
  clearInterval(state.playing);
  state.playing = on && view.picture
    ? setInterval(
      () => position(view.picture.turn || view.position + 1 < view.picture.positions ? view.position + 1 : 0),
      2500 / view.picture.positions,
    )
    : null;
  $("play").textContent = state.playing === null ? "Play" : "Pause";
  $("play").setAttribute("aria-pressed", String(state.playing !== null));
}

// --- chosen part and its numbers

const parts = () => {
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
// Tables that are not drawn: by names, and alone.
const BESIDE = ["section", "material", "motor", "joint", "bearing", "cam"],
  TABLES = ["run", "limits", "fatigue", "sweep", "tolerances", "sensitivities", "optimize"];
const tableAt = (path) => path.reduce((table, key) => table?.[key], state.tables);
// The path of the chosen part's table in the file, and the kind of table that it is.
function placeOfChosen() {
  const { chosen } = view;
  if (!chosen) return [[], "scene"];
  const kind = PATHS[chosen.kind] ?? chosen.name;
  return [
    chosen.kind === "table" ? [chosen.name] : [kind, NUMBERED[chosen.kind] ? Number(chosen.name) : chosen.name],
    kind,
  ];
}
const NUMBERED = { spring: "springs", load: "loads", drive: "drives", gear: "gears" };
const partName = ({ kind, name }) => {
  const entry = NUMBERED[kind] && view.sheet[NUMBERED[kind]][name];
  return `${kind} ${
    entry
      ? `${Number(name) + 1}: ${entry.joints?.join(", ") ?? entry.link ?? entry.slider ?? ""}${
        entry.point ? ` at ${entry.point}` : ""
      }`
      : name
  }`;
};

function listParts() {
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

function choose(kind, name) {
  view.chosen = kind ? { kind, name } : null;
  $("chosen").value = kind ? `${kind} ${name}` : "";
  inspect();
  listNumbers();
  draw();
}

function chooseNew(change) {
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

// Entries of the chosen part as the file has them, and those that it may have besides.
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
function showEntry() {
  const [path, kind] = placeOfChosen(), key = $("key").value;
  hold($("entry"), key ? written(tableAt([...path, key])) : "");
  $("words").textContent = (key && state.keys[kind]?.find(([each]) => each === key)?.[1]) || "";
}
function enter() {
  const [path] = placeOfChosen(), key = $("key").value;
  if (key && path.length) edit({ do: "entry", path: [...path, key], value: $("entry").value });
}
// Tables that can be added: of the chosen link, drive or point, or of the number.
const ADDED = [
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
function add(kind) {
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

function inspect() {
  listEntries();
  const box = $("inspector"), held = [...box.querySelectorAll("input, select")].indexOf(document.activeElement);
  box.replaceChildren();
  fillInspector(box);
  if (held >= 0) /** @type {NodeListOf<HTMLElement>} */ (box.querySelectorAll("input, select"))[held]?.focus(); // who goes from field to field goes on
}
function fillInspector(box) {
  const { chosen, sheet } = view;
  const link = chosen?.kind === "link" && sheet.links.find(({ name }) => name === chosen.name);
  $("delete").disabled = !chosen;
  if (chosen?.kind === "drive") return inspectDrive(Number(chosen.name), box);
  if (!link || link.name === "ground") return;
  for (const key of ["section", "material"]) {
    const label = document.createElement("label"), input = document.createElement("input");
    input.setAttribute("list", `${key}s`);
    hold(input, link[key] ?? "");
    input.size = key === "section" ? 12 : 9;
    input.onchange = () => edit({ do: "put", path: ["links", link.name, key], value: input.value });
    label.append(key === "section" ? "Section " : "Material ", input);
    box.append(label);
  }
}

// The motion of a drive: constant speed, or one curve over some way in some time, and back where that is wished.
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
  const curve = document.createElement("select"),
    field = (value, size) => Object.assign(hold(document.createElement("input"), value), { size }),
    labelled = (words, input) => {
      const label = document.createElement("label");
      label.append(words, input);
      return label;
    };
  curve.append(...state.motions.map((name) => new Option(name, name)));
  curve.value = motion ? SPLINE : law ? first.curve : CONSTANT;
  if (motion || box.dataset.spline === String(at)) return inspectSpline(at, box, curve, labelled);
  const rate = field(speed ?? (slider ? "0.1 m/s" : "60 rpm"), 8),
    by = field(first?.by ?? (slider ? "50 mm" : "90 deg"), 7),
    time = field(first?.duration ?? "1 s", 6),
    back = Object.assign(document.createElement("input"), { type: "checkbox", checked: !law || Boolean(second) });
  const tell = () =>
    edit({
      do: "law",
      drive: at,
      curve: curve.value,
      speed: rate.value,
      by: by.value,
      duration: time.value,
      back: back.checked,
    });
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
// Times and coordinates as a CSV file has them: typed, or taken from one.
function inspectSpline(at, box, curve, labelled) {
  const { motion, slider } = view.sheet.drives[at],
    area = hold(
      Object.assign(document.createElement("textarea"), { className: "points", rows: 5 }),
      Array.isArray(motion)
        ? motion.map((row) => row.join(", ")).join("\n")
        : `time [s], ${slider ? "way [mm]" : "angle [deg]"}\n0, 0\n0.25, 30\n0.5, 0\n0.75, -30\n1, 0`,
    ),
    file = Object.assign(document.createElement("input"), { type: "file", accept: ".csv,text/csv,text/plain" });
  const tell = () => edit({ do: "law", drive: at, curve: SPLINE, points: area.value });
  curve.value = SPLINE;
  const beside = typeof motion === "string";
  curve.onchange = () => {
    delete box.dataset.spline;
    if (curve.value !== SPLINE) {
      edit({
        do: "law",
        drive: at,
        curve: curve.value,
        speed: slider ? "0.1 m/s" : "60 rpm",
        by: slider ? "50 mm" : "90 deg",
        duration: "1 s",
        back: true,
      });
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
// The greatest rate, acceleration and jerk of a drive's law.
function peakWords(at) {
  const { peaks, unit } = view.picture?.drives[at] ?? {}, words = document.createElement("span");
  words.className = "soft";
  if (peaks) {
    words.textContent = `up to ${quantity(peaks[0], `${unit}/s`)}, ${quantity(peaks[1], `${unit}/s²`)}, jerk ${
      peaks[2] === null ? "infinite: the acceleration steps" : quantity(peaks[2], `${unit}/s³`)
    }`;
  }
  return words;
}

const PATHS = {
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
function listNumbers() {
  const list = $("number"),
    before = list.value,
    { chosen } = view,
    entry = chosen && NUMBERED[chosen.kind] && view.sheet[NUMBERED[chosen.kind]][chosen.name];
  const link = chosen?.kind === "link" && view.sheet.links.find(({ name }) => name === chosen.name);
  const heads = !chosen ? [] : [
    chosen.kind === "table" ? chosen.name : `${PATHS[chosen.kind]}.${entry ? entry.link ?? entry.slider : chosen.name}`,
    entry && `${PATHS[chosen.kind]}[${Number(chosen.name) + 1}]`,
    link?.section && `sections.${link.section}`,
    link?.material && `materials.${link.material}`,
  ].filter(Boolean);
  const first = ({ path }) =>
    heads.some((head) => path === head || path.startsWith(`${head}.`) || path.startsWith(`${head}[`));
  const sorted = [...state.numbers.filter(first), ...state.numbers.filter((each) => !first(each))];
  list.replaceChildren(...sorted.map(({ path }) => new Option(path, path)));
  if (!chosen && sorted.some(({ path }) => path === before)) list.value = before;
  if (state.held) list.value = state.held;
  showNumber();
}
const number = () => state.numbers.find(({ path }) => path === $("number").value);
function showNumber() {
  const now = number(), slider = $("slider");
  slider.disabled = !now;
  if (!now) {
    hold($("value"), "");
    return;
  }
  if (!state.dragging) {
    slider.value = now.high > now.low ? Math.round((1000 * (now.value - now.low)) / (now.high - now.low)) : 500;
  }
  hold($("value"), quantity(now.value, now.unit, 5));
}
function slide() {
  const now = state.range;
  if (!now) return;
  const raw = now.low + ((now.high - now.low) * $("slider").value) / 1000,
    value = now.whole ? Math.round(raw) : Number(raw.toPrecision(4));
  hold($("value"), quantity(value, now.unit, 5));
  drag({ do: "set", path: now.path, value });
}

// --- dragging: the text that was there when it began, and one edit of it

function grab() {
  play(false);
  state.dragging = text.text();
  if (view.position) position(0);
}
function drag(change, stamp) {
  if (state.dragging !== null) ask({ text: state.dragging, edits: [change], drag: true, graph: figure(), stamp });
}
function drop() {
  const before = state.dragging;
  state.dragging = null;
  const wait =
    () => (talk.quiet()
      ? (text.keep(before), state.held = $("number").value, changed(text.text()).then(() => (state.held = null)))
      : setTimeout(wait, 5));
  wait();
}

function remove() {
  const { chosen } = view;
  if (chosen) {
    view.chosen = null;
    edit({ do: "remove", ...chosen });
  }
}

function copy(mirror) {
  const { kind, name } = view.chosen ?? {}, of = { link: "link", point: "about" }[kind];
  edit({ do: "copy", mirror, ...(of && { [of]: name }) }).then(() => {
    if (!allSeen()) {
      fit();
      show();
    }
  });
}

function travel(whole) {
  if (whole !== null) changed(whole);
}

const allSeen = () =>
  Object.values(view.sheet.points).map(toScreen).every(([x, y]) => x > 0 && y > 0 && x < view.width && y < view.height);

// --- the file

function notice(words, passing = false, ...buttons) {
  const box = $("notice");
  box.replaceChildren(
    words,
    ...buttons.map(([label, act]) =>
      Object.assign(document.createElement("button"), {
        textContent: label,
        onclick: () => {
          hush(true);
          act();
        },
      })
    ),
  );
  box.hidden = false;
  box.dataset.passing = String(passing);
}
function hush(all = false) {
  if (all || $("notice").dataset.passing === "true") $("notice").hidden = true;
}

function keepInBrowser() {
  const dirty = text.text() !== state.saved;
  $("saved").textContent = !talk.reached
    ? "no server any more"
    : state.path === null
    ? "no file: download to keep"
    : dirty
    ? "not saved"
    : "saved";
  document.title = `${dirty ? "● " : ""}${state.name}`;
  try {
    if (dirty) localStorage.setItem(KEY(), text.text());
    else localStorage.removeItem(KEY());
  } catch { /* a browser that keeps nothing */ }
}

async function save() {
  const whole = text.text();
  if (state.path === null) return download();
  try {
    const told = await talk.save(whole, state.digest);
    if (!told.ok) {
      return notice(told.problem, false, ["Take the file's text", () => follow(true)], ["Download mine", download]);
    }
    Object.assign(state, { digest: told.digest, saved: whole });
    hush(true);
    keepInBrowser();
  } catch {
    keepInBrowser();
  }
}

function download() {
  const link = Object.assign(document.createElement("a"), {
    href: URL.createObjectURL(new Blob([text.text()], { type: "text/plain" })),
    download: `${state.name}.toml`,
  });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 1000);
}

// --- a scene handed on

async function copyLink() {
  const link = state.opens + (await share.fragment(text.text()));
  const told = "opens in an editor: with deflection-report --live by a click, in any other by pasting it on its page";
  try {
    await navigator.clipboard.writeText(link);
    notice(`The link is copied. It ${told}.`, true);
  } catch {
    const field = Object.assign(document.createElement("input"), {
      type: "text",
      value: link,
      readOnly: true,
      size: 30,
    });
    field.setAttribute("aria-label", "Link to this scene");
    notice(`Copy this link. It ${told}. `, true);
    $("notice").append(field);
    field.select();
  }
}

// A scene that comes from outside is taken at once where nothing is drawn, else when it is asked for.
async function offer(found) {
  try {
    const whole = await found, before = text.text();
    if (whole === null || whole === before) return;
    const get = () => replaceBy(whole, before);
    if (view.sheet?.empty) return await get();
    notice("A scene was handed to this page.", false, ["Take it", get], ["Leave it", () => hush(true)]);
  } catch (error) {
    notice(`No scene could be read there: ${error.message}.`, true);
  }
}
async function replaceBy(whole, before = text.text()) {
  Object.assign(view, { picture: null, position: 0 });
  await changed(whole);
  text.keep(before);
  fit();
  show();
}
function takeFragment() {
  if (!location.hash) return;
  const { hash, pathname } = location;
  history.replaceState(null, "", pathname);
  offer(share.linked(hash));
}
function wireShare() {
  $("share").onclick = copyLink;
  window.addEventListener("hashchange", takeFragment);
  document.addEventListener("paste", (event) => {
    const link = event.clipboardData?.getData("text") ?? "";
    if (!link.includes("#scene=")) return;
    event.preventDefault();
    offer(share.linked(link));
  });
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    const file = event.dataTransfer?.files[0];
    if (!file) return;
    event.preventDefault();
    offer(file.text().then((content) => share.carried(content, file.name)));
  });
}

// The file's text as it is now: taken where nothing here would be lost, or where that is asked for.
async function follow(forced = false) {
  const told = await talk.scene();
  if (told.problem) return notice(told.problem);
  const before = text.text(), mine = before !== state.saved;
  if (told.digest === "missing" && state.digest !== "missing") {
    state.saved = null;
    keepInBrowser();
    return notice("The file is gone from the disk; its text is still here, and Save writes it again.");
  }
  if (mine && !forced && told.text !== before) {
    return notice("The file has changed on disk, and the text here is not saved.", false, [
      "Take the file's text",
      () => follow(true),
    ], ["Keep mine", () => hush(true)]);
  }
  Object.assign(state, { digest: told.digest, saved: told.text });
  if (told.text === before) return keepInBrowser();
  await changed(told.text);
  text.keep(before);
  hush(true);
}

async function watch() {
  try {
    const { digest } = await talk.state();
    if (digest !== state.digest && digest !== state.told && state.dragging === null) {
      state.told = digest;
      await follow();
    }
  } catch { /* told by onReach */ }
  setTimeout(watch, window.kernel ? 5000 : 1000);
}

// --- beginning

async function start() {
  const told = await talk.scene();
  if (told.problem) return notice(told.problem);
  Object.assign(state, {
    digest: told.digest,
    saved: told.digest === "missing" ? null : told.text,
    path: told.path,
    name: told.name,
    shipped: told.shipped,
    opens: told.opens,
  });
  try {
    localStorage.setItem("live path", location.pathname);
  } catch { /* a browser that keeps nothing */ }
  $("name").textContent = told.name;
  $("name").title = told.path ?? "";
  Object.assign(state, { keys: told.keys, motions: told.motions, parts: told.parts ?? {} });
  for (const [kind, words] of Object.entries(told.parts ?? {})) {
    const stem = kind.replace(/s$/, "");
    ADDED.push([kind, words]);
    BESIDE.push(stem);
    PATHS[stem] = kind;
  }
  $("add").append(...ADDED.map(([kind, words]) => new Option(words, kind)));
  for (const kind of ["sections", "materials"]) $(kind).replaceChildren(...told[kind].map((name) => new Option(name)));
  $("begin").append(...Object.keys(told.shipped).map((name) => new Option(name, name)));
  tools.begin({
    choose,
    grab,
    drag,
    drop,
    edit,
    remove,
    delete: remove,
    copy: () => copy(false),
    mirror: () => copy(true),
    position,
    play,
  });
  text.begin(told.text);
  let kept = null;
  try {
    kept = localStorage.getItem(KEY());
  } catch { /* a browser that keeps nothing */ }
  await ask({ text: told.text, numbers: true });
  if (view.sheet?.empty) tools.take("link");
  fit();
  show();
  settle(50);
  if (kept !== null && kept !== told.text) {
    notice("This browser has kept a text that was not saved.", false, ["Take it", () => {
      const before = text.text();
      changed(kept).then(() => text.keep(before));
    }], ["Forget it", keepInBrowser]);
  }
  wire();
  takeFragment();
  watch();
  document.body.dataset.ready = "yes";
}

function wire() {
  text.onInput(() => changed(text.text(), true));
  $("undo").onclick = () => travel(text.undo());
  $("redo").onclick = () => travel(text.redo());
  $("save").onclick = save;
  $("report").onclick = (event) => {
    if (window.kernel) {
      event.preventDefault();
      talk.report($("report").getAttribute("href")).then((address) => window.open(address, "_blank"));
    }
  };
  $("download").onclick = download;
  $("play").onclick = () => play();
  $("position").oninput = () => {
    play(false);
    position(Number($("position").value));
  };
  $("fit").onclick = () => {
    fit();
    show();
  };
  $("in").onclick = () => tools.zoom(1.25);
  $("out").onclick = () => tools.zoom(0.8);
  $("paths").onchange = () => {
    view.paths = $("paths").checked;
    draw();
  };
  $("chosen").onchange = () => choose(...($("chosen").value ? $("chosen").value.split(" ") : [null]));
  $("key").onchange = showEntry;
  $("entry").onchange = enter;
  $("add").onchange = () => {
    const kind = $("add").value;
    $("add").value = "";
    if (kind) add(kind);
  };
  $("number").onchange = () => {
    showNumber();
    if (number()?.line) text.goTo(number().line);
  };
  $("slider").oninput = () => {
    if (state.dragging === null) {
      state.dragging = text.text();
      state.range = number();
    }
    slide();
  };
  $("value").onchange = () => {
    const now = number();
    if (!now) return;
    state.held = now.path;
    edit({ do: "set", path: now.path, value: $("value").value }).then(() => {
      state.held = null;
      showNumber();
    });
  };
  $("slider").onchange = () => {
    if (state.dragging !== null) drop();
  };
  $("begin").onchange = () => {
    const whole = state.shipped[$("begin").value];
    $("begin").value = "";
    if (whole !== undefined) replaceBy(whole);
  };
  wireShare();
  const lists = { begin: "Begin with", chosen: "Chosen", key: "Entry", number: "Number", figure: "Graph" };
  for (const [id, words] of Object.entries(lists)) searchable($(id), words);
  $("figure").onchange = () => drawGraph();
  $("sizes").onchange = () => {
    view.sizes = $("sizes").checked;
    draw();
  };
  for (const id of ["tracewidth", "traceleft", "tracebottom", "tracefaint"]) $(id).oninput = trace;
  $("picture").onchange = () => {
    const [file] = $("picture").files;
    if (!file) return;
    const image = new Image();
    image.onload = () => {
      view.trace = { address: image.src, ratio: image.naturalHeight / image.naturalWidth };
      trace();
    };
    image.src = URL.createObjectURL(file);
  };
  talk.onReach((reached) => {
    keepInBrowser();
    if (reached) hush(true);
    else {notice(
        "No server any more: the command has ended, or this computer slept. The text is kept in this browser; start the command again with the same file, or download it.",
        false,
        ["Download", download],
      );}
  });
  document.addEventListener("keydown", (event) => {
    if (event.target === document.body) tools.keys(event); // without a click
    if (!(event.ctrlKey || event.metaKey)) return;
    const act = { s: save, z: () => travel(event.shiftKey ? text.redo() : text.undo()), y: () => travel(text.redo()) };
    const key = event.key.toLowerCase(), field = /** @type {any} */ (event.target);
    if (!act[key]) return;
    event.preventDefault();
    if (key !== "s" && typed(field)) field.value = field.defaultValue;
    else act[key]();
  });
  // A value that is again what it was is none that was typed.
  document.addEventListener("change", (event) => {
    const field = /** @type {any} */ (event.target);
    if (isField(field) && !typed(field)) event.stopPropagation();
  }, true);
  new ResizeObserver(() => {
    measure();
    text.measure();
    show();
  }).observe($("svg"));
}
// Fields of a value, beside the text of the scene; and whether one holds letters that are not in the scene yet.
const isField = ({ tagName, type, id }) =>
  (tagName === "INPUT" && ["text", "number"].includes(type)) || (tagName === "TEXTAREA" && id !== "text");
const typed = (field) => isField(field) && field.value !== field.defaultValue;
const hold = (field, value) => Object.assign(field, { defaultValue: value, value });
function trace() {
  if (!view.trace) return;
  Object.assign(view.trace, {
    width: Number($("tracewidth").value) || 1,
    left: Number($("traceleft").value),
    bottom: Number($("tracebottom").value),
    opacity: 1 - Number($("tracefaint").value),
  });
  drawGrid();
}
window.live = { state, view, edit, text: text.text };
start();
