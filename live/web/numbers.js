// The numbers of the scene: a list, a slider and a field that change them. Also the edits during a drag.
import * as talk from "./talk.js";
import * as text from "./text.js";
import { quantity, view } from "./view.js";
import { figure } from "./graph.js";
import { NUMBERED, PATHS } from "./parts.js";
import { ask, changed } from "./requests.js";
import { play, position } from "./shown.js";
import { $, hold, options, state } from "./state.js";

// Lists the numbers, with the numbers of the selected part first. If `stays`, the selected number stays selected.
export function listNumbers(stays = true) {
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
  list.replaceChildren(...options(sorted.map(({ path }) => path)));
  if ((stays || !chosen) && sorted.some(({ path }) => path === before)) list.value = before;
  showNumber();
}
export const number = () => state.numbers.find(({ path }) => path === $("number").value);
export function showNumber() {
  const now = number(), slider = $("slider");
  slider.disabled = !now;
  if (!now) {
    hold($("value"), "");
    slider.value = 500;
    return;
  }
  if (!state.dragging) {
    slider.value = now.high > now.low ? Math.round((1000 * (now.value - now.low)) / (now.high - now.low)) : 500;
  }
  hold($("value"), quantity(now.value, now.unit, 5));
}
export function slide() {
  const now = state.range;
  if (!now) return;
  const raw = now.low + ((now.high - now.low) * $("slider").value) / 1000,
    value = now.whole ? Math.round(raw) : Number(raw.toPrecision(4));
  hold($("value"), quantity(value, now.unit, 5));
  drag({ do: "set", path: now.path, value });
}

// A drag: `grab` stores the text, `drag` requests the answer for an edit of this text, `drop` ends the drag.
export function grab() {
  play(false);
  state.dragging = text.text();
  if (view.position) position(0);
}
export function drag(change, stamp) {
  if (state.dragging !== null) ask({ text: state.dragging, edits: [change], drag: true, graph: figure(), stamp });
}
export function drop() {
  const before = state.dragging;
  state.dragging = null;
  const wait = () => (talk.quiet() ? (text.keep(before), changed(text.text())) : setTimeout(wait, 5));
  wait();
}
