// The text next to the drawing: line numbers, marks of mistakes and changed lines, and undo for all changes.
import { $, make } from "./state.js";
const area = $("text"), gutter = $("gutter"), marks = $("marks");
const LONG = 1e6; // if there are more pairs of lines to compare, all these lines count as changed
let LINE = 19, room = 400;
let past = [], future = [], current = "", mistakes = [], changed = [];

export const text = () => current;

// Reads the line height and the height of the text field. They are stored, because reading them at each change is slow.
export function measure() {
  LINE = parseFloat(getComputedStyle(area).lineHeight);
  room = area.clientHeight;
}

export function begin(whole) {
  [past, future] = [[], []];
  show(whole);
}

// Shows another text. If `mark`, also marks the lines that have changed. `keep` stores the previous text for undo.
export function show(whole, mark = false) {
  if (mark) changed = differing(current, whole);
  else changed = [];
  current = whole;
  if (area.value !== whole) {
    const { scrollTop, selectionStart } = area;
    area.value = whole;
    area.selectionStart = area.selectionEnd = Math.min(selectionStart, whole.length);
    area.scrollTop = scrollTop;
  }
  if (changed.length) reveal(changed[0]);
  draw();
}

export function keep(before) {
  if (before === current) return;
  if (past.at(-1) !== before) past.push(before);
  if (past.length > 300) past.shift();
  future = [];
  buttons();
}

export function undo() {
  return step(past, future);
}
export function redo() {
  return step(future, past);
}
function step(from, to) {
  finish();
  if (!from.length) return null;
  to.push(current);
  show(from.pop(), true);
  buttons();
  return current;
}
function buttons() {
  $("undo").disabled = !past.length;
  $("redo").disabled = !future.length;
}

export function tellMistakes(found) { // an entry with `next` is no mistake: it suggests the next step
  if (!found.length && !mistakes.length) return;
  mistakes = found;
  $("mistakes").replaceChildren(...found.map(({ line, message, next }) => {
    const onclick = () => {
      goTo(line);
      area.focus();
    };
    const item = make("li", {}, ...(line ? [make("button", { onclick }, `line ${line}`)] : []), message);
    item.classList.toggle("next", Boolean(next));
    return item;
  }));
  area.setAttribute("aria-invalid", String(found.some(({ next }) => !next)));
  draw();
}

export function goTo(line) {
  const at = current.split("\n").slice(0, line - 1).join("\n").length + Number(line > 1);
  area.setSelectionRange(at, at);
  reveal(line - 1);
}

function reveal(row) {
  const top = row * LINE, height = room;
  if (top < area.scrollTop || top > area.scrollTop + height - 3 * LINE) area.scrollTop = Math.max(0, top - height / 3);
}

// Returns the indices of the lines of `after` that are new, by the longest common subsequence of lines.
function differing(before, after) {
  const [old, now] = [before.split("\n"), after.split("\n")];
  let first = 0, last = 0;
  while (first < now.length && now[first] === old[first]) first++;
  while (last < now.length - first && last < old.length - first && now.at(-1 - last) === old.at(-1 - last)) last++;
  const [m, n] = [old.length - last - first, now.length - last - first], rows = [];
  if (m * n > LONG) return Array.from({ length: n }, (_, k) => first + k);
  const common = Array.from({ length: m + 1 }, () => new Uint16Array(n + 1)); // number of common lines after (i, k)
  const alike = (i, k) => old[first + i] === now[first + k];
  for (let i = m - 1; i >= 0; i--) {
    for (let k = n - 1; k >= 0; k--) {
      common[i][k] = alike(i, k) ? common[i + 1][k + 1] + 1 : Math.max(common[i + 1][k], common[i][k + 1]);
    }
  }
  for (let i = 0, k = 0; k < n;) {
    if (i < m && alike(i, k)) [i, k] = [i + 1, k + 1];
    else if (i < m && common[i + 1][k] >= common[i][k + 1]) i++;
    else rows.push(first + k++);
  }
  return rows;
}

function draw() {
  const count = current.split("\n").length, wrong = new Set(mistakes.map(({ line }) => line));
  const html = Array.from({ length: count }, (_, k) => (wrong.has(k + 1) ? `<b>${k + 1}</b>` : k + 1)).join("\n");
  if (gutter.dataset.html !== html) {
    gutter.innerHTML = html + "\n\n\n";
    gutter.dataset.html = html;
  }
  const rows = [
    ...mistakes.filter(({ line }) => line).map(({ line }) => [line - 1, ""]),
    ...changed.map((row) => [row, "changed"]),
  ];
  marks.replaceChildren(...rows.map(([row, kind]) => {
    const mark = document.createElement("div");
    mark.className = kind;
    mark.style.top = `${6 + row * LINE - area.scrollTop}px`;
    return mark;
  }));
  gutter.scrollTop = area.scrollTop;
}

// Typing without a pause is one undo step. Undo and redo also end the step.
let before = null, timer = 0;
function finish() {
  clearTimeout(timer);
  if (before !== null) keep(before);
  before = null;
}

export function onInput(listener) {
  area.addEventListener("scroll", draw);
  area.addEventListener("input", () => {
    before ??= current;
    changed = [];
    current = area.value;
    draw();
    clearTimeout(timer);
    timer = setTimeout(finish, 500);
    listener();
  });
}
buttons();
