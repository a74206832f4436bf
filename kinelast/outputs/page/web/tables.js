// Tables that sort by any column, with one unit per column and a mark on the worst row.

// Columns: {name, unit, means, figure: row -> figure or of: row -> number, words: row -> text, text: row -> text,
// worst, wraps: break lines at plain spaces only}
const unbroken = (words) => words.replaceAll(" ", "\u00a0");
function table(rows, columns, caption) {
  const shown = columns.map((given) => {
    const column = given.figure ? { ...given, of: (each) => value(given.figure(each)) } : given;
    if (!column.of) return { ...column, head: column.name, cell: column.text };
    const known = rows.map(column.of).filter((value) => value !== null && value !== undefined && isFinite(value));
    const [factor, unit] = scaleOf(largestOf(known), column.unit ?? "1");
    const cell = column.words ??
      ((
        each,
      ) => (column.none && !isFinite(valueOf(column, each))
        ? column.none
        : number(valueOf(column, each) * factor, column.digits ?? 4) + unreliableMark(column.figure?.(each))));
    return { ...column, unitShown: unitWords(unit), cell };
  });
  const body = h("tbody");
  const heads = shown.map(({ name, means, of, unitShown }, k) =>
    sortingHead([name, unitShown ? h("small", ` [${unitShown}]`) : null], of, () => sort(k), means)
  );
  const made = rows.map((each) => ({
    each,
    line: h(
      "tr",
      shown.map((column, k) => {
        const words = column.cell(each);
        return k === 0
          ? h("th", { scope: "row", class: long(words) }, words)
          : h("td", { class: column.of ? "figure" : long(words) ?? (column.wraps ? "wraps" : null) }, words);
      }),
    ),
  }));
  const worst = shown.find((column) => column.worst);
  if (worst && rows.length > 1) {
    const rank = (each) => (worst.worst === "least" ? -1 : 1) * Math.abs(valueOf(worst, each));
    const ranked = made.filter(({ each }) => isFinite(rank(each)) && valueOf(worst, each) !== 0).sort((a, b) =>
      rank(b.each) - rank(a.each)
    );
    if (ranked.length) {
      ranked[0].line.classList.add("worst");
      ranked[0].line.firstChild.append(h("span.mark", ` ${worst.worst === "least" ? "least" : "most"}`));
    }
  }
  let order = null;
  function sort(k) {
    const column = shown[k];
    const descending = order && order[0] === k ? !order[1] : Boolean(column.of);
    order = [k, descending];
    const key = column.of
      ? (each) => (column.signed ? valueOf(column, each) : Math.abs(valueOf(column, each)))
      : (each) => String(column.cell(each));
    made.sort((a, b) => {
      const one = key(a.each), other = key(b.each);
      const way = typeof one === "string"
        ? one.localeCompare(other, undefined, { numeric: true })
        : (isNaN(one) ? -Infinity : one) - (isNaN(other) ? -Infinity : other);
      return descending ? -way : way;
    });
    body.replaceChildren(...made.map(({ line }) => line));
    markSorted(heads, k, descending);
  }
  body.append(...made.map(({ line }) => line));
  return wide(caption, heads, body);
}

const FIRST_ROWS = 8;

// The first rows as a table, the others in one that is folded.
function longTable(rows, columns, caption) {
  const others = rows.slice(FIRST_ROWS);
  if (!others.length) return table(rows, columns, caption);
  const unmarked = columns.map((column) => ({ ...column, worst: undefined }));
  const rest = table(others, unmarked, `${caption}: the others`);
  const folded = h("details", h("summary", `${others.length} more`), rest);
  return [table(rows.slice(0, FIRST_ROWS), columns, caption), folded];
}

function valueOf(column, each) {
  const value = column.of(each);
  return value === null || value === undefined ? NaN : value;
}
const value = (figure) => (figure ? figure.value : null);
