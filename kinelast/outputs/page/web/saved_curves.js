// Saves the curves of a chart as CSV, PNG or SVG.
const SAVES = {
  CSV(made) {
    const cell = (words) => `"${String(words).replace(/"/g, '""')}"`;
    const heads = [made.xLabel, ...made.curves.map((curve) => `${curve.name} [${made.unit}]`)].map(cell).join(",");
    const lines = made.xs.map((x, k) => [x, ...made.rows.map((row) => (isFinite(row[k]) ? row[k] : ""))].join(","));
    download(`${fileName(made.heading)}.csv`, "text/csv", [heads, ...lines].join("\n") + "\n");
  },
  PNG(made) {
    // The heading and the names are above the curves, with as many names on a line as fit.
    const from = made.plot.ctx.canvas,
      one = devicePixelRatio || 1,
      font = `${13 * one}px system-ui, sans-serif`,
      to = h("canvas"),
      pen = to.getContext("2d");
    pen.font = font;
    let x = 10 * one, y = 44 * one;
    const names = made.curves.flatMap((curve, k) => {
      if (made.hidden.has(k)) return [];
      const wide = pen.measureText(curve.name).width + 44 * one;
      if (x > 10 * one && x + wide > from.width) {
        x = 10 * one;
        y += 18 * one;
      }
      x += wide;
      return [{ k, name: curve.name, x: x - wide, y }];
    });
    to.width = from.width;
    to.height = from.height + y + 8 * one;
    pen.fillStyle = variable("--paper");
    pen.fillRect(0, 0, to.width, to.height);
    pen.drawImage(from, 0, y + 8 * one);
    pen.fillStyle = variable("--ink");
    pen.font = `600 ${font}`;
    pen.fillText(made.heading, 10 * one, 20 * one);
    pen.font = font;
    pen.lineWidth = 2 * one;
    for (const { k, name, x, y } of names) {
      pen.fillText(name, x + 30 * one, y);
      pen.strokeStyle = made.colours[k];
      pen.setLineDash(dashOf(made.curves[k]).map((long) => long * one));
      pen.stroke(new Path2D(`M${x} ${y - 4 * one}h${24 * one}`));
    }
    to.toBlob((blob) => download(`${fileName(made.heading)}.png`, "image/png", blob));
  },
  SVG(made) {
    const wide = 900, tall = 300, left = 70, foot = 250, head = 40, right = 700;
    const rows = made.rows.filter((_, k) => !made.hidden.has(k)).flat().filter(isFinite).map((value) =>
      value * made.factor
    );
    const low = rows.reduce((a, b) => Math.min(a, b), 0),
      high = rows.reduce((a, b) => Math.max(a, b), low < 0 ? 0 : 1e-300),
      [first, last] = [made.xs[0], made.xs[made.xs.length - 1]];
    const x = (value) => left + ((right - left) * (value - first)) / (last - first || 1),
      y = (value) => foot - ((foot - head) * (value * made.factor - low)) / (high - low);
    const step = ANGLES.find((each) => each >= (last - first) / 9) ?? 360, angles = made.cycle && axis.angular;
    const marks = angles
      ? Array.from(
        { length: Math.floor(last / step) - Math.ceil(first / step) + 1 },
        (_, k) => (Math.ceil(first / step) + k) * step,
      )
      : ticks(first, last, 8);
    const dash = (k) => dashOf(made.curves[k]).join(" "),
      mark = (from, to, more) => s("line", { x1: from[0], y1: from[1], x2: to[0], y2: to[1], stroke: "#888", ...more });
    const path = (row) =>
      made.xs.map((
        value,
        k,
      ) => (isFinite(row[k])
        ? `${k && isFinite(row[k - 1]) ? "L" : "M"}${x(value).toFixed(2)} ${y(row[k]).toFixed(2)}`
        : "")
      ).join("");
    const words = (at, text, anchor = "middle") =>
      s("text", { x: at[0], y: at[1], "text-anchor": anchor, "font-size": 12, "font-family": "sans-serif" }, text);
    const picture = s(
      "svg",
      { xmlns: SVG, viewBox: `0 0 ${wide} ${tall}`, width: wide, height: tall },
      words([left, 20], `${made.heading} [${unitWords(made.prefixed)}]`, "start"),
      s("path", { d: `M${left} ${head}V${foot}H${right}M${left} ${y(0)}H${right}`, fill: "none", stroke: "#888" }),
      ticks(low, high, 6).map((value) => [
        mark([left - 4, y(value / made.factor)], [left, y(value / made.factor)]),
        words([left - 7, y(value / made.factor) + 4], number(value), "end"),
      ]),
      marks.map((value) => [
        mark([x(value), foot], [x(value), foot + 4]),
        words([x(value), foot + 17], angles ? turned(value) : number(value)),
      ]),
      words([(left + right) / 2, foot + 34], made.xLabel),
      made.rows.map((row, k) =>
        made.hidden.has(k) ? null : s("path", {
          d: path(row),
          fill: "none",
          stroke: made.colours[k],
          "stroke-width": 1.6,
          "stroke-dasharray": dash(k),
        }, s("title", made.curves[k].name))
      ),
      made.rows.map((_, k) => k).filter((k) => !made.hidden.has(k)).map((k, n) => [
        mark([right + 12, head + 18 * n], [right + 36, head + 18 * n], {
          stroke: made.colours[k],
          "stroke-width": 1.6,
          "stroke-dasharray": dash(k),
        }),
        words([right + 42, head + 18 * n + 4], short(made.curves[k].name), "start"),
      ]),
    );
    downloadSvg(made.heading, picture);
  },
};
