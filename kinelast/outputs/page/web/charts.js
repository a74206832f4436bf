// Curves drawn by uPlot, with hover, zoom, selection and download. All charts show the same instant.
const charts = [];
const CHART_HEIGHT = 210, MOST_CURVES = 6, LABEL_WIDTH = 88, LETTER_WIDTH = 6;
const DASHES = [[], [6, 3], [1.5, 2.5], [11, 3, 2, 3], [16, 4], [9, 2, 2, 2, 2, 2]];
const dashOf = (curve) => DASHES[curve.dash % DASHES.length];
const ANGLES = [1, 2, 5, 10, 15, 30, 45, 60, 90, 180, 360, 720];
const turned = (degrees) => number(((degrees % 360) + 360) % 360); // as everywhere on the page, within a turn
const colour = (k) => variable(`--l${k % LINK_COLOURS}`);

// The positions in the order of the axis, with null where positions in between were omitted.
const order = (() => {
  const every = Array.from({ length: N }, (_, i) => i), time = row("time");
  const steps = every.slice(1).map((i) => time[i] - time[i - 1]),
    usual = [...steps].sort((a, b) => a - b)[steps.length >> 1];
  const apart = (i) => model.left_out > 0 && i > 0 && steps[i - 1] > 1.5 * usual;
  const found = every.flatMap((i) => (apart(i) ? [null, i] : [i]));
  return axis.falling ? found.reverse() : found;
})();
const orderOf = new Map(order.map((i, k) => [i, k]));
const abscissae = order.map((
  i,
  k,
) => (i === null ? (axis.values[order[k - 1]] + axis.values[order[k + 1]]) / 2 : axis.values[i]));
const shownAt = (i) => i !== null && counted(i);

// Assigns styles to curves. Curves that are shown initially have different colours or dashes. Curves are shown
// initially if they are marked so, otherwise the largest ones. A curve has the colour of its link if that is unused.
function styled(curves, sizes) {
  const ranked = curves.map((_, k) => k).sort((a, b) => sizes[b] - sizes[a]);
  const first = curves.some((curve) => curve.shown)
    ? ranked.filter((k) => curves[k].shown)
    : ranked.slice(0, MOST_CURVES);
  const shown = new Set(first), taken = new Set(), styles = [];
  const inOrder = [...curves.keys()].sort((a, b) => Number(shown.has(b)) - Number(shown.has(a)) || a - b);
  for (const [dash, k] of inOrder.entries()) {
    const wanted = curves[k].colour ?? k,
      any = Array.from({ length: LINK_COLOURS }, (_, n) => (wanted + n) % LINK_COLOURS);
    const colour = any.find((each) => !taken.has(each)) ?? any[0];
    taken.add(colour);
    styles[k] = { ...curves[k], colour, dash, shown: shown.has(k) };
  }
  return styles;
}

// Curves: {name, values: i -> number, colour}. Values are in SI units and drawn with a prefix suitable for the largest.
function chart(holder, heading, unit, asked, options = {}) {
  const valueAt = (values) => (i) => (shownAt(i) ? values(i) : NaN);
  const rowOf = ({ values }) => (options.xs ? xs.map((_, k) => values(k)) : order.map(valueAt(values)));
  const xs = options.xs ?? abscissae,
    sizeOf = (curve) => largestOf(rowOf(curve));
  const curves = styled(asked, asked.map(sizeOf)), read = () => curves.map(rowOf);
  const xLabel = options.xLabel ?? axis.label;
  const longest = LETTER_WIDTH * Math.max(...curves.map(({ name }) => name.length)) + 10;
  const nameWidth = () => Math.max(LABEL_WIDTH, Math.min(longest, 0.3 * canvas.clientWidth));
  const made = { heading, unit, xs, xLabel, cycle: !options.xs, hidden: new Set(), live: options.live };
  curves.forEach((curve, k) => curve.shown || made.hidden.add(k));
  const figure = h("figure.chart", {
    "aria-label": `${heading}: curves of ${curves.map((curve) => curve.name).join(", ")}`,
  });
  const canvas = h("div.plot"), legend = h("div.legend");
  figure.append(
    h(
      "figcaption",
      h("h3", heading),
      h(
        "span.downloads",
        ["PNG", "SVG", "CSV"].map((kind) =>
          button(kind, () => SAVES[kind](made), { "aria-label": `${heading} as ${kind}` })
        ),
      ),
    ),
    legend,
    canvas,
  );
  holder.append(figure);
  const clean = (rows, factor) =>
    rows.map((values) =>
      values.map((value) => (isFinite(value) && (value > 0 || !options.log) ? value * factor : null))
    );
  const marks = curves.map((curve, k) => {
    const words = h("output", { "aria-live": "off" });
    const dash = {
      "stroke-width": 2.4,
      stroke: `var(--l${curve.colour})`,
      "stroke-dasharray": dashOf(curve).join(" "),
    };
    const line = s("line", { x1: 0, x2: 26, y1: 4, y2: 4, ...dash });
    const swatch = s("svg", { viewBox: "0 0 26 8", "aria-hidden": "true" }, line);
    const name = button([swatch, curve.name, " ", words], () => {
      made.hidden[made.hidden.has(k) ? "delete" : "add"](k);
      name.setAttribute("aria-pressed", String(!made.hidden.has(k)));
      made.plot.setSeries(k + 1, { show: !made.hidden.has(k) });
    }, { "aria-pressed": String(curve.shown) });
    return { name, words };
  });
  legend.append(...marks.map(({ name }) => name));
  const left = made.hidden.size,
    words = `${curves.length - left} of ${curves.length} drawn, the largest; a name adds its curve`;
  if (left) legend.append(h("span.soft.left-out", words));
  const at = h("div.now");

  made.tell = (index) => {
    const plot = made.plot, shown = plot?.cursor.idx ?? index;
    marks.forEach(({ words }, k) => {
      words.textContent = shown === null || shown === undefined
        ? ""
        : quantity(worthy(made.rows[k][shown] ?? NaN), unit);
    });
  };
  // Values that are round-off compared with the other curves are set to zero.
  const worthy = (value) => (Math.abs(value) <= 1e-12 * made.greatest ? 0 : value);
  made.follow = (i) => {
    if (!made.plot) return;
    if (made.live) {
      made.rows = read();
      made.plot.setData([xs, ...clean(made.rows, made.factor)], false);
      return made.tell(null);
    }
    if (!made.cycle) return made.tell(null);
    mark();
    made.tell(orderOf.get(i));
  };
  // The line at the current instant. It is redrawn with the curves, unless the instant is outside the zoomed range.
  function mark() {
    if (!made.plot || !made.cycle) return;
    const x = made.plot.valToPos(xs[orderOf.get(instant.position)], "x");
    at.style.transform = `translateX(${x}px)`;
    at.hidden = !(x >= -1 && x <= made.plot.over.clientWidth + 1);
  }
  // Annotations of curves: shaded ranges of x, named dashed lines at x and dotted lines at y, and names of peaks. Names
  // do not overlap.
  function annotate(plot) {
    const { ranges = [], lines = [], bounds = [], peaks = [] } = options.notes ?? {},
      pen = plot.ctx,
      { left, top, width, height } = plot.bbox,
      one = devicePixelRatio || 1;
    const at = (x) => plot.valToPos(x, "x", true), within = (x) => x >= left - 1 && x <= left + width + 1;
    pen.save();
    pen.beginPath();
    pen.rect(left, top, width, height);
    pen.clip();
    for (const [low, high] of ranges) {
      pen.globalAlpha = 0.18;
      pen.fillStyle = variable("--red");
      pen.fillRect(at(low), top, Math.max(at(high) - at(low), one), height);
      pen.globalAlpha = 1;
    }
    pen.font = `${11 * one}px system-ui, sans-serif`;
    pen.fillStyle = pen.strokeStyle = variable("--ink");
    for (const [x, words] of lines) {
      pen.setLineDash([5 * one, 4 * one]);
      pen.beginPath();
      pen.moveTo(at(x), top);
      pen.lineTo(at(x), top + height);
      pen.stroke();
      const [before, after] = [at(x) - left - 4 * one, left + width - at(x) - 4 * one];
      const right = pen.measureText(words).width < after || after > before;
      pen.textAlign = right ? "left" : "right";
      wrapped(words, right ? after : before, pen).forEach((part, k) =>
        pen.fillText(part, at(x) + (right ? 4 : -4) * one, top + 12 * one * (k + 1))
      );
    }
    pen.setLineDash([2 * one, 3 * one]);
    pen.textAlign = "left";
    for (const [value, words] of bounds) {
      const y = plot.valToPos(value * made.factor, "y", true);
      pen.beginPath();
      pen.moveTo(left, y);
      pen.lineTo(left + width, y);
      pen.stroke();
      pen.fillText(words, left + 4 * one, y - 4 * one);
    }
    pen.textAlign = "center";
    const taken = [],
      heights = (x) =>
        made.rows.map((row, k) => (made.hidden.has(k) ? NaN : row[plot.valToIdx(x)] * made.factor)).filter(isFinite);
    for (
      const { x, words, y } of peaks.map(([x, words]) => ({ x, words, y: Math.max(...heights(x)) })).sort((
        one,
        other,
      ) => other.y - one.y)
    ) {
      const place = at(x), room = pen.measureText(words).width + 6 * one;
      if (!within(place) || !isFinite(y) || taken.some((other) => Math.abs(other - place) < room)) continue;
      taken.push(place);
      pen.fillText(words, place, Math.max(plot.valToPos(y, "y", true) - 4 * one, top + 24 * one));
    }
    pen.restore();
  }
  // The names of all curves at their ends, in the colours of the curves, without overlap.
  function nameCurves(plot) {
    const pen = plot.ctx, { left, top, width, height } = plot.bbox, one = devicePixelRatio || 1, apart = 12 * one;
    if (curves.length < 2) return;
    const last = (row) => row.findLast((value) => isFinite(value));
    const ends = curves.flatMap((
      curve,
      k,
    ) => (made.hidden.has(k) || last(made.rows[k]) === undefined
      ? []
      : [{ k, name: curve.name, y: plot.valToPos(last(made.rows[k]) * made.factor, "y", true) }])
    );
    const letters = Math.floor((nameWidth() - 5) / LETTER_WIDTH);
    const names = spread(ends.sort((a, b) => a.y - b.y), apart, top, top + height);
    pen.save();
    pen.font = `${11 * one}px system-ui, sans-serif`;
    pen.textAlign = "left";
    for (const { k, name, y } of names) {
      pen.fillStyle = made.colours[k];
      pen.fillText(
        name.length > letters ? `${name.slice(0, letters - 1)}…` : name,
        left + width + 5 * one,
        y + 4 * one,
      );
    }
    pen.restore();
  }
  made.build = () => {
    const seen = made.plot?.scales.x,
      part = seen && (seen.min > xs[0] || seen.max < xs[xs.length - 1]) ? { min: seen.min, max: seen.max } : null;
    made.plot?.destroy();
    made.rows = read();
    made.greatest = largestOf(made.rows.flat());
    const largest = options.largest ?? made.greatest;
    [made.factor, made.prefixed] = scaleOf(largest, unit);
    made.colours = curves.map((curve, k) => colour(curve.colour));
    made.curves = curves;
    const steps = axis.angular && made.cycle ? { incrs: ANGLES, values: (_, marks) => marks.map(turned) } : {};
    const bound = options.largest
      ? { range: [-1.05 * largest * made.factor || -1, 1.05 * largest * made.factor || 1] }
      : {};
    made.plot = new uPlot(
      {
        ...made.size(),
        legend: { show: false },
        scales: { x: { time: false }, y: options.log ? { distr: 3 } : bound },
        axes: axesOf({ ...steps, label: xLabel }, {
          label: `[${unitWords(made.prefixed) || "1"}]`,
          values: (_, ticks) => ticks.map((tick) => (tick === null ? "" : number(tick, 5))),
        }),
        series: [
          {},
          ...curves.map((curve, k) => ({
            label: curve.name,
            stroke: made.colours[k],
            width: 1.6,
            dash: dashOf(curve),
            points: { show: xs.length < 3 },
            show: !made.hidden.has(k),
          })),
        ],
        cursor: { sync: made.cycle ? { key: "cycle" } : undefined, drag: { x: true, y: false }, points: { size: 6 } },
        padding: [null, curves.length > 1 ? nameWidth() : null, null, null],
        hooks: {
          draw: [mark, annotate, nameCurves],
          setCursor: [() => made.tell(made.cycle ? orderOf.get(instant.position) : null)],
        },
      },
      [xs, ...clean(made.rows, made.factor)],
      canvas,
    );
    if (part) made.plot.setScale("x", part); // what was zoomed into stays, in the other colours and on paper
    canvas.querySelector("canvas").setAttribute("aria-hidden", "true");
    if (made.cycle) {
      made.plot.over.append(at);
      let pressed = 0;
      made.plot.over.addEventListener("mousedown", (event) => (pressed = event.clientX));
      made.plot.over.addEventListener("click", (event) => {
        if (
          Math.abs(event.clientX - pressed) < 4 && made.plot.cursor.idx !== null && order[made.plot.cursor.idx] !== null
        ) {
          stop();
          showPosition(order[made.plot.cursor.idx]);
        }
      });
    }
    made.follow(instant.position);
  };
  framed(made, figure, canvas, CHART_HEIGHT);
  new ResizeObserver(() => {
    made.resize();
    made.follow(instant.position);
  }).observe(canvas);
  return made;
}

// Common code of all charts for resizing, removal and registration. `build` draws the chart.
function framed(made, figure, canvas, height) {
  made.size = () => ({ width: Math.max(240, canvas.clientWidth), height });
  made.resize = () => made.plot?.setSize(made.size());
  made.remove = () => {
    made.plot?.destroy();
    charts.splice(charts.indexOf(made), 1);
    figure.remove();
  };
  made.figure = figure;
  charts.push(made);
  made.build();
}

function axesOf(x, y) {
  const font = "11px system-ui, sans-serif", grid = { stroke: variable("--rule"), width: 1 };
  const both = { stroke: variable("--soft"), font, labelFont: font, grid, ticks: { show: false }, labelSize: 16 };
  return [{ ...both, size: 34, ...x }, { ...both, size: 58, ...y }];
}

follow((i) => charts.forEach((made) => made.follow(i)));
const restyle = () => charts.forEach((made) => made.build());

// Break text into lines that fit into the given width, if every word fits.
function wrapped(words, room, pen) {
  const lines = [];
  for (const word of words.split(" ")) {
    const longer = lines.length ? `${lines[lines.length - 1]} ${word}` : "";
    if (longer && pen.measureText(longer).width < room) lines[lines.length - 1] = longer;
    else lines.push(word);
  }
  return lines;
}

// Sorted heights, moved as little as possible so that they keep a distance between two bounds. If there is not enough
// space, only the first ones are returned.
function spread(found, apart, low, high) {
  const kept = found.slice(0, Math.floor((high - low) / apart) + 1);
  kept.forEach((each, k) => {
    each.y = Math.max(each.y, k ? kept[k - 1].y + apart : low);
  });
  for (let k = kept.length - 1; k >= 0; k--) {
    kept[k].y = Math.min(kept[k].y, k < kept.length - 1 ? kept[k + 1].y - apart : high);
  }
  return kept;
}
