// A sortable table of the designs, and the details of the selected design.
const ROWS = 50;

function tableSection() {
  const order = { by: data.best === null ? "" : data.figures[0] ?? "", falling: false }, body = h("tbody");
  const full = Object.keys(data.answered).length > 0,
    heads = ["", ...axes].map((name) => {
      const unit = name && unitOf(name) ? h("small", ` [${unitOf(name)}]`) : null;
      return sortingHead([name || "design", unit], name, () => sort(name));
    });
  const any = data.reasons.some(Boolean),
    more = button("Show more", () => {
      shown *= 5;
      draw();
    }),
    counted = soft("");
  let shown = ROWS;
  section(
    "designs-table",
    "Table",
    "All designs",
    counted,
    wide("Designs", [
      heads[0],
      full ? h("th", { scope: "col" }, "answered") : null,
      heads.slice(1),
      any ? h("th", { scope: "col" }, "why there are no figures") : null,
    ], body),
    more,
  );
  function sort(name) {
    order.falling = order.by === name ? !order.falling : state.greater.has(name);
    order.by = name;
    draw();
  }
  function draw() {
    const kept = every.filter(inside),
      values = order.by ? columnOf(order.by) : columnOf("#design"),
      way = order.falling ? -1 : 1;
    const size = (k) => (isFinite(values[k]) ? way * values[k] : Infinity);
    kept.sort((a, b) => size(a) - size(b) || a - b);
    body.replaceChildren(
      ...kept.slice(0, shown).map((k) =>
        h(
          "tr",
          { class: k === state.chosen ? "worst" : null, "data-design": designOf(k) },
          h(
            "th",
            { scope: "row" },
            button(designOf(k), () => choose(k), { class: "pick", "aria-label": `choose design ${designOf(k)}` }),
            k === bestPlace ? h("span.mark", " best") : null,
          ),
          full ? h("td", answerWords(k)) : null,
          axes.map((name) => h("td.figure", valueWords(name, k))),
          any ? h("td.message", reasonOf(k)) : null,
        )
      ),
    );
    markSorted(heads, ["", ...axes].indexOf(order.by), order.falling);
    more.hidden = kept.length <= shown;
    counted.textContent = `${several(kept.length, "design")}${
      kept.length < COUNT ? " within the ranges chosen above" : ""
    }, ${Math.min(shown, kept.length)} shown. Click a heading to sort, a number to choose the design.${
      full
        ? " Figures are quasi-static; of a design that is answered in full, by the theory named, they stand " +
          "under \u201cThe design chosen\u201d."
        : ""
    }`;
  }
  for (const what of ["change", "brush", "choice"]) listeners[what].push(draw);
  draw();
}

// The details of a design: its numbers as lines of the scene, and its figures compared with those of the best design.
function chosenSection() {
  const holder = h("div", { "aria-live": "polite" });
  section("chosen", "One design", "The design chosen", holder);
  function draw() {
    const k = state.chosen;
    if (k === null) {
      holder.replaceChildren(soft("None: click a dot, or a number in the table."));
      return;
    }
    const address = data.pages[String(designOf(k))],
      reason = reasonOf(k),
      beside = bestPlace !== null && bestPlace !== k ? bestPlace : null;
    const rows = data.figures.map((name) =>
      h(
        "tr",
        h("th", { scope: "row" }, name),
        h("td.figure", valueWords(name, k, 6)),
        beside === null ? null : h("td.figure", valueWords(name, beside, 6)),
        h("td", unitOf(name)),
      )
    );
    const answer = data.answered[String(designOf(k))], inFull = (name) => fullWords(name, answer.figures[name]);
    if (answer) {
      rows.forEach((row, n) => row.insertBefore(h("td.figure", inFull(data.figures[n])), row.children[2]));
    }
    const heads = [
      "figure",
      answer ? "quasi-static" : "here",
      ...(answer ? ["in full"] : []),
      ...(beside === null ? [] : ["the best"]),
      "unit",
    ];
    const lines = data.numbers.map((name) => `${name} = ${numberText(name, k)}`);
    holder.replaceChildren(
      h(
        "p",
        h("b", `Design ${designOf(k)}`),
        k === bestPlace ? ", the best" : "",
        address ? h("span", ": ", h("a", { href: address }, "its page"), ", with vibration where that counts") : "",
      ),
      answer ? h("p", `Answered in full: ${answerWords(k)}`) : "",
      reason ? h("p.verdict.poor", reason) : "",
      address || !data.figures.some((name) => isFinite(columnOf(name)[k])) ? "" : commandsOf(designOf(k)),
      h("h3", "Its numbers in the scene"),
      h("pre", { tabindex: 0, id: "lines" }, lines.join("\n")),
      button("Copy", () => navigator.clipboard?.writeText(lines.join("\n"))),
      wide(
        "Its figures",
        heads.map((words, n) => h("th", { scope: "col", class: n && words !== "unit" ? "figure" : null }, words)),
        h("tbody", rows),
      ),
    );
  }
  listeners.choice.push(draw);
  draw();
}

// The theory by which a design was computed, and the verdict.
function answerWords(k) {
  const answer = data.answered[String(designOf(k))];
  return answer ? [answer.theory, answer.verdict].filter(Boolean).join(", ") : reasonOf(k) ? "" : "quasi-static";
}
function fullWords(name, counted) {
  if (!counted) return name.startsWith("limits_") ? "" : "the same";
  if (counted.value === null) return "";
  const [factor] = scaleFor[name],
    error = counted.error === null || !counted.value
      ? ""
      : ` ± ${number(100 * counted.error / Math.abs(counted.value), 2)} %`;
  return `${number(counted.value * factor, 6)}${error}`;
}

// The command that creates the page of a design, if it does not exist here.
function commandsOf(design) {
  if (!data.scene) return "";
  const quoted = (word) => (/^[\w./-]+$/.test(word) ? word : `'${word.replaceAll("'", "'\\''")}'`),
    file = `${data.scene.replace(/\.toml$/, "")}_design_${design}.toml`;
  const lines = [
    `deflection-report ${quoted(data.scene)} --design ${design} -o .`,
    `deflection-report ${quoted(file)} ${data.options}`.trim(),
  ];
  return h("div", h("h3", "Its page is made by"), h("pre", { tabindex: 0, id: "commands" }, lines.join("\n")));
}

// In the units of the file.
function numberText(name, k) {
  const [factor, unit] = data.shown_in[data.units[name]] ?? [1, data.units[name]],
    value = Number((columnOf(name)[k] * factor).toPrecision(12));
  return unit === "1" || unit === "" ? `${value}` : `"${value} ${unit}"`;
}
