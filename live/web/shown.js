// Shows the drawing, its graph and the figures at a position, and plays the motion through all positions.
import { draw, drawGrid } from "./drawing.js";
import { quantity, view } from "./view.js";
import { drawGraph, listFigures } from "./graph.js";
import { $, make, state } from "./state.js";

const FIRST_LIMITS = 5; // number of limits above the figures; the others are below

const stopWords = (words) =>
  `${words[0].toUpperCase()}${
    words.slice(1)
  }. Dashed: the last position in reach. The figures cover the positions up to it.`;

export function show() {
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
  else if (stale) $("closes").textContent = "This text gives no working mechanism. The last working one is shown pale.";
  if (!picture) {
    $("tiles").replaceChildren();
    $("theory").textContent = "";
    $("colours").textContent = "";
    return;
  }
  $("theory").textContent = theoryWords(picture);
  const most = `${quantity(view.most, "Pa")}, displacements × ${view.factor}`;
  $("colours").replaceChildren(...(view.most ? ["von Mises stress 0", make("i"), most] : []));
  const limits = picture.limits.map(limitTile); // the server sorts them: most used first
  $("tiles").replaceChildren(
    ...limits.slice(0, FIRST_LIMITS),
    ...picture.figures.map(figureTile),
    ...limits.slice(FIRST_LIMITS),
  );
}

export const tile = (kind, name, value, more) =>
  make("div", { className: `tile ${kind}` }, name, make("b", {}, value), more);
const NO_ERROR = 1e-6; // smaller relative errors are not shown
const LEAST_SHARE = 1e-4; // smaller relative errors are shown as "< 0.01 %"
/** Returns the error in per cent. If the error exceeds the value, returns the error with its unit. */
export function errorWords(value, error, unit) {
  const share = error / Math.abs(value);
  if (error === null || error <= NO_ERROR * Math.abs(value)) return "";
  if (share > 1) return `± ${quantity(error, unit, 2)}`;
  return share < LEAST_SHARE ? "± < 0.01 %" : `± ${Number((100 * share).toPrecision(2))} %`;
}
const figureTile = ({ key, name, value, unit, on, error }) => {
  const more = [errorWords(value, error, unit), on ?? ""].filter(Boolean).join(", ");
  const box = tile("", name, quantity(value, unit), more);
  Object.assign(box.dataset, { figure: key, value });
  return box;
};
const limitTile = ({ name, on, bound, value, unit, kept, outcome }) =>
  tile(
    kept ? "kept" : "broken",
    `limit: ${name}${on ? ` of ${on}` : ""}`,
    outcome ?? (kept ? "kept" : "not kept"),
    `${quantity(value, unit)}, allowed ${quantity(bound, unit)}`,
  );

export function instant() {
  const { picture, position } = view, { time, drive, effort } = picture.arrays, count = picture.positions;
  const drives = picture.drives.map(({ name, unit, effort: of }, k) =>
    `${name} ${quantity(drive.values[k * count + position], unit)}, ${
      quantity(effort.values[k * count + position], of)
    }`
  );
  return [quantity(time.values[position], "s"), ...drives].join("; ");
}

export function position(k) {
  const count = view.picture?.positions ?? 1;
  view.position = view.picture?.turn ? ((k % count) + count) % count : Math.max(0, Math.min(count - 1, k));
  $("position").value = view.position;
  $("instant").textContent = view.picture ? instant() : "";
  draw();
  drawGraph();
}

export function play(on = state.playing === null) {
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

export const theoryWords = ({ theory, quick, error, problem }) =>
  `${theory}${
    quick
      ? ` (quick: ${view.picture.positions} positions, error unknown)`
      : error !== null && error !== undefined
      ? `, within ${Number((100 * error).toPrecision(2))} %`
      : problem
      ? `, error unknown: ${problem}`
      : ""
  }`;
