// Parallel coordinates: one axis per column, one line per design. Dragging along an axis selects a range of values.
const PARALLEL_TALL = 330, HEAD = 52, FOOT = 26, SIDE = 66, WIDEST = 12, WHILE_DRAGGING = 1500;

function parallelSection() {
  if (axes.length < 2) return;
  const shown = axes.length <= WIDEST
    ? axes
    : [...data.numbers.slice(0, WIDEST - Math.min(data.figures.length, WIDEST / 2)), ...data.figures].slice(0, WIDEST);
  const part = section(
    "ranges",
    "Ranges",
    "All numbers and figures side by side",
    soft(
      "Every line is a design, through its value on every axis; grey designs break a limit. Drag along an axis to keep the designs " +
        "within that range, everywhere on this page; or type the range.",
      shown.length < axes.length ? ` ${shown.length} of ${axes.length} columns are drawn.` : "",
    ),
  );
  const holder = h("div.stage.plane"),
    spans = Object.fromEntries(shown.map((name) => [name, spanOf(name)]));
  const counted = h("span.soft"),
    from = h("input", { id: "range-from", type: "number", step: "any" }),
    to = h("input", { id: "range-to", type: "number", step: "any" });
  const which = choice("range-of", () => fill(), shown.map((name) => option(name, axisWords(name))));
  const typed = () => {
    const f = scaleFor[which.value][0],
      [low, high] = [from, to].map((each) => (each.value === "" ? NaN : Number(each.value) / f));
    set(which.value, [isNaN(low) ? -Infinity : low, isNaN(high) ? Infinity : high]);
  };
  from.addEventListener("change", typed);
  to.addEventListener("change", typed);
  part.append(
    h("div.sideways", holder),
    bar(
      labelled("Keep those with", which),
      labelled("from", from),
      labelled("to", to),
      button("All again", () => {
        state.within = {};
        fill();
        tell("brush");
      }, { id: "all-again" }),
      counted,
    ),
  );
  let made, dragging = null;
  holder.style.minWidth = `${Math.max(300, 78 * shown.length)}px`;

  const x = (n) => SIDE + (n * (made.width - 2 * SIDE)) / (shown.length - 1);
  const y = (name, value) => {
    const [low, high] = spans[name];
    return PARALLEL_TALL - FOOT - ((value - low) / (high - low)) * (PARALLEL_TALL - FOOT - HEAD);
  };
  const valueAt = (name, py) => {
    const [low, high] = spans[name];
    return low + ((PARALLEL_TALL - FOOT - py) / (PARALLEL_TALL - FOOT - HEAD)) * (high - low);
  };

  function fill() {
    const range = state.within[which.value], f = scaleFor[which.value][0];
    [from, to].forEach((each, n) => {
      each.value = range && isFinite(range[n]) ? Number((range[n] * f).toPrecision(5)) : "";
    });
  }
  function set(name, range) {
    if (range && (isFinite(range[0]) || isFinite(range[1]))) state.within[name] = range;
    else delete state.within[name];
    fill();
    tell("brush");
  }

  function through(pen, k) {
    let going = false;
    pen.beginPath();
    shown.forEach((name, n) => {
      const value = columnOf(name)[k];
      if (!isFinite(value)) {
        going = false;
        return;
      }
      if (going) pen.lineTo(x(n), y(name, value));
      else pen.moveTo(x(n), y(name, value));
      going = true;
    });
    pen.stroke();
  }

  function draw() {
    if (!made) return;
    const pen = made.pen(made.canvas), paint = colours(), kept = brokenFirst(every.filter(inside));
    made.clear(made.canvas);
    pen.lineWidth = 1;
    pen.globalAlpha = Math.max(0.05, Math.min(0.7, 60 / Math.max(1, kept.length)));
    const stride = dragging ? Math.max(1, Math.ceil(kept.length / WHILE_DRAGGING)) : 1;
    for (let n = 0; n < kept.length; n += stride) {
      pen.strokeStyle = paint(kept[n]);
      through(pen, kept[n]);
    }
    pen.globalAlpha = 1;
    pen.font = "12px system-ui, sans-serif";
    pen.textAlign = "center";
    shown.forEach((name, n) => {
      const f = scaleFor[name][0],
        [low, high] = spans[name],
        range = state.within[name],
        side = n === 0 ? "left" : n === shown.length - 1 ? "right" : "center";
      pen.strokeStyle = variable("--ink");
      line(pen, x(n), HEAD, x(n), PARALLEL_TALL - FOOT);
      if (range) {
        const [top, foot] = [
          Math.max(HEAD, y(name, Math.min(high, range[1]))),
          Math.min(PARALLEL_TALL - FOOT, y(name, Math.max(low, range[0]))),
        ];
        pen.fillStyle = variable("--amber");
        pen.globalAlpha = 0.45;
        pen.fillRect(x(n) - 7, top, 14, Math.max(2, foot - top));
        pen.globalAlpha = 1;
      }
      const edge = side === "left" ? 6 : side === "right" ? made.width - 6 : x(n);
      pen.textAlign = side;
      pen.fillStyle = data.figures.includes(name) ? variable("--ink") : variable("--soft");
      pen.fillText(
        short(pen, axisWords(name), (made.width - 2 * SIDE) / (shown.length - 1) - 6),
        edge,
        n % 2 ? 13 : 29,
      );
      pen.textAlign = "center";
      pen.fillStyle = variable("--soft");
      pen.fillText(number(high * f, 3), x(n), HEAD - 6);
      pen.fillText(number(low * f, 3), x(n), PARALLEL_TALL - FOOT + 15);
    });
    counted.textContent = kept.length < COUNT ? `${kept.length} of ${COUNT} designs are within.` : "";
    made.canvas.setAttribute(
      "aria-label",
      `${COUNT} designs along ${shown.length} axes: ${shown.join(", ")}; ${kept.length} are drawn`,
    );
    mark();
  }

  function short(pen, words, room) {
    if (pen.measureText(words).width <= 1.9 * room) return words;
    let kept = words;
    while (kept.length > 3 && pen.measureText(`…${kept}`).width > 1.9 * room) kept = kept.slice(1);
    return `…${kept}`;
  }

  function mark() {
    const pen = made.markPen();
    for (const [k, name, wide] of [[bestPlace, "--red", 2], [state.chosen, "--ink", 2.4]]) {
      if (k !== null) {
        pen.strokeStyle = variable(name);
        pen.lineWidth = wide;
        through(pen, k);
      }
    }
  }

  const spot = (event) => {
    const box = made.canvas.getBoundingClientRect();
    return [event.clientX - box.left, Math.max(HEAD, Math.min(PARALLEL_TALL - FOOT, event.clientY - box.top))];
  };
  made = canvasIn(holder, PARALLEL_TALL, draw, "");
  made.canvas.addEventListener("pointerdown", (event) => {
    const [px, py] = spot(event), n = shown.findIndex((_, k) => Math.abs(x(k) - px) < 18);
    if (n < 0) return;
    dragging = { name: shown[n], from: valueAt(shown[n], py), moved: false };
    which.value = shown[n];
    made.canvas.setPointerCapture(event.pointerId);
  });
  made.canvas.addEventListener("pointermove", (event) => {
    const [px, py] = spot(event);
    made.canvas.style.cursor = shown.some((_, k) => Math.abs(x(k) - px) < 18) ? "ns-resize" : "default";
    if (!dragging) return;
    const to = valueAt(dragging.name, py);
    dragging.moved = true;
    state.within[dragging.name] = [Math.min(dragging.from, to), Math.max(dragging.from, to)];
    if (!dragging.waiting) {
      dragging.waiting = requestAnimationFrame(() => {
        if (dragging) dragging.waiting = null;
        draw();
      });
    }
  });
  const end = () => {
    if (!dragging) return;
    const { name, moved } = dragging;
    dragging = null;
    set(name, moved ? state.within[name] : null);
  };
  made.canvas.addEventListener("pointerup", end);
  made.canvas.addEventListener("pointercancel", end);
  for (const what of ["change", "brush"]) listeners[what].push(draw);
  listeners.choice.push(mark);
  fill();
  made.fit();
}
