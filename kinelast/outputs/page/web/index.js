// The table of a batch, with one row per scene. It can be sorted and filtered, and links to the pages of the scenes.
const STEP = 300;
const { head: ownHead, rows: ownRows, reports, seconds } = JSON.parse($("rows").textContent);
// The computing time is shown before the message of a scene, if any scene was computed in this run.
const timed = Object.keys(seconds).length > 0,
  beforeLast = (row, more) => [...row.slice(0, -1), more, row[row.length - 1]];
const head = timed ? beforeLast(ownHead, "took [s]") : ownHead;
const rows = timed ? ownRows.map((row) => beforeLast(row, row[0] in seconds ? String(seconds[row[0]]) : "")) : ownRows;
const linked = new Set(reports);
const columns = head.map((name) => {
  const [, words, unit] = name.match(/^(.*?)(?: \[(.*)\])?$/), numeric = unit !== undefined;
  return {
    words: `${words.replace(/_/g, " ")}${unit === "rad" ? ", angle" : ""}`,
    unit: unit === "1" ? "" : unit,
    numeric,
  };
});
// One column shows the result of a scene: that it failed, or its verdict and reliability. Empty parts are omitted.
const HIDDEN = ["state", "status", "grade"],
  [stateAt, verdictAt, gradeAt] = ["state", "verdict", "grade"].map((name) => head.indexOf(name));
const wentWords = (cells) => (cells[stateAt] === "failed" ? "failed" : cells[verdictAt] || "no limits");
const message = head.length - 1, first = ["scene", "verdict", "message", "decides", "used [1]"], last = ["took [s]"];
const rank = (k) => (first.includes(head[k]) ? first.indexOf(head[k]) - first.length : last.indexOf(head[k]) + 1);
const said = head.map((_, k) => k).sort((a, b) => rank(a) - rank(b)).filter((k) =>
  !HIDDEN.includes(head[k]) && (k === 0 || k === verdictAt || rows.some((cells) => cells[k] !== ""))
);
const figures = said.filter((k) => k > 0 && k !== verdictAt && k !== message && !last.includes(head[k])),
  bare = (cells) => figures.every((k) => cells[k] === "");
const order = said.filter((k) =>
  k !== message || !figures.length || rows.some((cells) => cells[message] !== "" && !bare(cells))
);
const state = { by: 0, falling: false, shown: STEP, words: "" };
const numberIn = (cell) => (cell === "" ? NaN : Number(cell));

function matching() {
  const wanted = state.words.toLowerCase().split(/\s+/).filter(Boolean);
  const found = rows.filter((cells) => {
    const text = cells.join(" ").toLowerCase();
    return wanted.every((word) => text.includes(word));
  });
  const { by, falling } = state, way = falling ? -1 : 1;
  const size = (cells) => {
    const value = Math.abs(numberIn(cells[by]));
    return isNaN(value) ? -Infinity : value;
  };
  return found.sort((a, b) =>
    way * (columns[by].numeric ? size(a) - size(b) : a[by].localeCompare(b[by], undefined, { numeric: true }))
  );
}

function cellOf(cells, k) {
  const { numeric, unit } = columns[k], text = cells[k];
  if (k === 0 && linked.has(text)) {
    return h("a", { href: `${text.split("/").map(encodeURIComponent).join("/")}/report.html` }, text);
  }
  if (k === verdictAt) return wentOf(cells);
  if (head[k] === "used [1]") return text === "" ? "" : `${number(100 * numberIn(text), 3)} %`;
  if (numeric && unit === "rad" && text !== "") return `${number((numberIn(text) * 180) / Math.PI)}°`;
  if (numeric) return text === "" ? "" : unit ? quantity(numberIn(text), unit) : number(numberIn(text));
  const level =
    { failed: "poor", poor: "poor", differs: "poor", caution: "caution", good: "good", agrees: "good" }[text];
  return level ? h("span", { class: level }, text) : text;
}

function wentOf(cells) {
  const words = wentWords(cells),
    level = { failed: "poor", acceptable: "good", "not acceptable": "poor", "no limits": "open" }[words] ?? "caution";
  const grade = cells[gradeAt] && cells[gradeAt] !== "good"
    ? h("span", { class: cells[gradeAt] }, `, figures: ${cells[gradeAt]}`)
    : null;
  return [h("span", { class: level }, words), grade];
}

const body = h("tbody"),
  heads = columns.map(({ words, numeric }, k) => sortingHead(words, numeric, () => sort(k)));
const more = button("Show more", () => {
  state.shown += 10 * STEP;
  draw();
});

function sort(k) {
  state.falling = state.by === k ? !state.falling : columns[k].numeric;
  state.by = k;
  draw();
}

// A scene without figures has its message instead.
function lineOf(cells) {
  const sentence = figures.length > 0 && cells[message] !== "" && bare(cells),
    kept = sentence ? order.filter((k) => k !== message && !figures.includes(k)) : order;
  const line = kept.map((
    k,
  ) => (k === 0
    ? h("th", { scope: "row", class: long(cells[k]) }, cellOf(cells, k))
    : h("td", { class: columns[k].numeric ? "figure" : k === message ? "message" : long(cells[k]) }, cellOf(cells, k)))
  );
  if (sentence) line.splice(2, 0, h("td.message", { colspan: order.length - kept.length }, cells[message]));
  return h("tr", { class: cells[1] === "failed" ? "worst" : null }, line);
}

function draw() {
  const found = matching(), shown = found.slice(0, state.shown);
  body.replaceChildren(...shown.map(lineOf));
  markSorted(heads, state.by, state.falling);
  more.hidden = shown.length === found.length;
  const count = (what) => rows.filter((cells) => cells[1] === what).length;
  $("about").textContent = `${several(rows.length, "scene")}: ${
    ["done", "failed", "skipped"].map((what) => `${count(what)} ${what}`).join(", ")
  }; ${found.length} match, ${shown.length} shown.`;
}

$("filter").addEventListener("input", () => {
  state.words = $("filter").value;
  state.shown = STEP;
  draw();
});
$("main").append(wide("Scenes", order.map((k) => heads[k]), body), more);
theme();
draw();
document.body.dataset.ready = "yes";
