// Starts the page of the live editor and connects the events of its controls.
import * as talk from "./talk.js";
import * as text from "./text.js";
import * as tools from "./tools.js";
import { draw, drawGrid } from "./drawing.js";
import { fit, measure, view } from "./view.js";
import { add, ADDED, choose, chooseNew, copy, listParts, remove } from "./choosing.js";
import { download, save, watch } from "./file.js";
import { drawGraph, searchable } from "./graph.js";
import { replaceBy, takeFragment, wireShare } from "./handing.js";
import { enter, showEntry } from "./inspector.js";
import { hush, keepInBrowser, KEY, notice } from "./notices.js";
import { drag, drop, grab, listNumbers, number, showNumber, slide } from "./numbers.js";
import { BESIDE, PATHS } from "./parts.js";
import { ask, changed, edit, listeners, settle } from "./requests.js";
import { play, position, show } from "./shown.js";
import { $, isField, options, state, typed } from "./state.js";

listeners.answered = (answer, job) => {
  if (answer.numbers) listNumbers();
  if (!job.drag) listParts();
};
listeners.edited = chooseNew;

async function start() {
  const reply = await talk.scene();
  if (reply.problem) return notice(reply.problem);
  const { digest, path, name, shipped, opens, keys, motions, parts = {} } = reply;
  Object.assign(state, { digest, path, name, shipped, opens, keys, motions, parts });
  state.saved = digest === "missing" ? null : reply.text;
  try {
    localStorage.setItem("live path", location.pathname);
  } catch { /* the browser does not allow storage */ }
  $("name").textContent = name;
  $("name").title = path ?? "";
  for (const [kind, words] of Object.entries(parts)) {
    const stem = kind.replace(/s$/, "");
    ADDED.push([kind, words]);
    BESIDE.push(stem);
    PATHS[stem] = kind;
  }
  $("add").append(...ADDED.map(([kind, words]) => new Option(words, kind)));
  for (const kind of ["sections", "materials"]) $(kind).replaceChildren(...reply[kind].map((name) => new Option(name)));
  $("begin").append(...options(Object.keys(shipped)));
  const copies = { copy: () => copy(false), mirror: () => copy(true) };
  tools.begin({ choose, grab, drag, drop, edit, remove, delete: remove, position, play, ...copies });
  text.begin(reply.text);
  let kept = null;
  try {
    kept = localStorage.getItem(KEY());
  } catch { /* the browser does not allow storage */ }
  await ask({ text: reply.text, numbers: true });
  const last = view.sheet?.links.findLast(({ section }) => section);
  if (last) $("section").value = last.section; // new links get the section and material of the last link
  if (last?.material) $("material").value = last.material;
  if (view.sheet?.empty) tools.take("link");
  fit();
  show();
  settle(50);
  if (kept !== null && kept !== reply.text) {
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
    if (now) edit({ do: "set", path: now.path, value: $("value").value }).then(showNumber);
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
        "No server any more: the command has ended, or this computer slept. The text is kept in this " +
          "browser; start the command again with the same file, or download it.",
        false,
        ["Download", download],
      );}
  });
  document.addEventListener("keydown", (event) => {
    if (event.target === document.body) tools.keys(event); // the keys of tools work if no element has the focus
    if (!(event.ctrlKey || event.metaKey)) return;
    const act = { s: save, z: () => travel(event.shiftKey ? text.redo() : text.undo()), y: () => travel(text.redo()) };
    const key = event.key.toLowerCase(), field = /** @type {any} */ (event.target);
    if (!act[key]) return;
    event.preventDefault();
    if (key !== "s" && typed(field)) field.value = field.defaultValue;
    else act[key]();
  });
  // If a field contains the value of the scene again, it has not changed: no other listener gets the event.
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

function travel(whole) {
  if (whole !== null) changed(whole);
}
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
