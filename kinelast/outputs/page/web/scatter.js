// A scatter plot of two columns, with a dot for each design and a line for the Pareto front.
const LEFT = 74, BOTTOM = 46, TOP = 14, RIGHT = 16, TALL = 440, NEAR = 12;

function scatterSection() {
  const part = section(
    "tradeoff",
    "Trade-off",
    "One against the other",
    soft(
      "Every dot is a design. On the front, the line, none is better in one of both without being worse in " +
        "the other. Hover for its values, click to choose it; ← and → go along the front.",
    ),
  );
  const holder = h("div.stage.plane"),
    counted = h("p.soft", { id: "front-words", "aria-live": "polite" });
  const set = (key) => (value) => {
    state[key] = value;
    tell("change");
  };
  const names = (key, label) =>
    h("optgroup", { label }, data[label].map((name) => option(name, name, state[key] === name)));
  const pick = (id, words, key) => labelled(words, choice(id, set(key), names(key, "figures"), names(key, "numbers")));
  const colour = choice("colour", set("colour"), option("", "nothing"), axes.map((name) => option(name)));
  const better = h("span.bar");
  part.append(
    bar(pick("across", "Across", "x"), pick("up", "Up", "y"), labelled("Colour by", colour)),
    better,
    holder,
    counted,
  );

  let spans, front = [], among = [], made;
  const across = (value) => LEFT + ((value - spans[0][0]) / (spans[0][1] - spans[0][0])) * (made.width - LEFT - RIGHT);
  const up = (value) => TALL - BOTTOM - ((value - spans[1][0]) / (spans[1][1] - spans[1][0])) * (TALL - BOTTOM - TOP);
  const at = (k) => [across(columnOf(state.x)[k]), up(columnOf(state.y)[k])];

  function widened(/** @type {number[]} */ [low, high]) {
    const room = 0.03 * (high - low);
    return [low - room, high + room];
  }

  function draw() {
    if (!made) return;
    const all = known(state.x, state.y), pen = made.pen(made.canvas), paint = colours();
    spans = [widened(spanOf(state.x, all)), widened(spanOf(state.y, all))];
    among = all.filter(inside);
    front = state.x === state.y ? [] : frontOf(state.x, state.y, among);
    made.clear(made.canvas);
    frame(pen);
    const size = COUNT > 3000 ? 3 : 5;
    pen.globalAlpha = COUNT > 500 ? 0.55 : 0.85;
    for (const k of brokenFirst(among)) {
      const [x, y] = at(k);
      pen.fillStyle = paint(k);
      pen.fillRect(x - size / 2, y - size / 2, size, size);
    }
    pen.globalAlpha = 1;
    pen.strokeStyle = variable("--amber");
    pen.lineWidth = 1.8;
    pen.beginPath();
    front.forEach((k, n) => {
      const [x, y] = at(k);
      if (n) pen.lineTo(x, y);
      else pen.moveTo(x, y);
    });
    pen.stroke();
    for (const k of front) ring(pen, at(k), 3.6);
    if (bestPlace !== null && isFinite(columnOf(state.x)[bestPlace] + columnOf(state.y)[bestPlace])) {
      star(pen, at(bestPlace));
    }
    if (state.colour) legend(pen);
    const left = COUNT - all.length;
    counted.textContent = `${several(among.length, "design")} drawn${
      left ? `, ${left} without these figures left out` : ""
    }${
      among.length < all.length ? `, ${all.length - among.length} outside the ranges chosen below` : ""
    }; ${front.length} on the front${bestPlace === null ? "" : "; the star is the best"}${
      among.some(breaks) ? "; grey designs break a limit" : ""
    }.`;
    made.canvas.setAttribute(
      "aria-label",
      `${axisWords(state.y)} against ${axisWords(state.x)}: ${counted.textContent}`,
    );
    mark();
  }

  function frame(pen) {
    const [fx] = scaleFor[state.x], [fy] = scaleFor[state.y], right = made.width - RIGHT, foot = TALL - BOTTOM;
    pen.font = "12px system-ui, sans-serif";
    pen.lineWidth = 1;
    pen.strokeStyle = variable("--rule");
    pen.fillStyle = variable("--soft");
    pen.textAlign = "center";
    for (const tick of ticks(spans[0][0] * fx, spans[0][1] * fx, Math.max(4, made.width / 100))) {
      const x = across(tick / fx);
      line(pen, x, TOP, x, foot);
      pen.fillText(number(tick), x, foot + 16);
    }
    pen.fillText(axisWords(state.x), (LEFT + right) / 2, TALL - 8);
    pen.textAlign = "right";
    for (const tick of ticks(spans[1][0] * fy, spans[1][1] * fy, 7)) {
      const y = up(tick / fy);
      line(pen, LEFT, y, right, y);
      pen.fillText(number(tick), LEFT - 6, y + 4);
    }
    pen.save();
    pen.translate(14, (TOP + foot) / 2);
    pen.rotate(-Math.PI / 2);
    pen.textAlign = "center";
    pen.fillText(axisWords(state.y), 0, 0);
    pen.restore();
  }

  function legend(pen) {
    const [low, high] = spanOf(state.colour),
      f = scaleFor[state.colour][0],
      wide = 120,
      x = made.width - RIGHT - wide,
      y = TOP + 4;
    for (let k = 0; k < wide; k++) {
      pen.fillStyle = ramp(k / wide);
      pen.fillRect(x + k, y, 1.5, 8);
    }
    pen.fillStyle = variable("--ink");
    pen.textAlign = "left";
    pen.fillText(number(low * f, 3), x, y + 22);
    pen.textAlign = "right";
    pen.fillText(number(high * f, 3), x + wide, y + 22);
    pen.fillText(axisWords(state.colour), x - 8, y + 8);
  }

  function mark() {
    const pen = made.markPen();
    for (const [k, radius] of [[state.chosen, 7], [state.hovered, 5]]) {
      if (k === null || !isFinite(columnOf(state.x)[k] + columnOf(state.y)[k])) continue;
      pen.strokeStyle = variable("--ink");
      pen.lineWidth = 2;
      ring(pen, at(k), radius);
    }
    if (state.hovered === null) return;
    const [x, y] = at(state.hovered),
      words = [
        `design ${designOf(state.hovered)}`,
        `${state.x} ${valueWords(state.x, state.hovered)} ${unitOf(state.x)}`,
        `${state.y} ${valueWords(state.y, state.hovered)} ${unitOf(state.y)}`,
      ];
    pen.font = "12px system-ui, sans-serif";
    const wide = 16 + Math.max(...words.map((each) => pen.measureText(each).width)),
      left = Math.min(x + 12, made.width - wide - 4),
      top = Math.min(y + 12, TALL - 62);
    pen.fillStyle = variable("--paper");
    pen.strokeStyle = variable("--rule");
    pen.lineWidth = 1;
    pen.fillRect(left, top, wide, 56);
    pen.strokeRect(left, top, wide, 56);
    pen.fillStyle = variable("--ink");
    pen.textAlign = "left";
    words.forEach((each, n) => pen.fillText(each, left + 8, top + 17 + 16 * n));
  }

  function under(event) {
    const box = made.canvas.getBoundingClientRect(), px = event.clientX - box.left, py = event.clientY - box.top;
    let best = null, nearest = NEAR * NEAR;
    for (const k of among) {
      const [x, y] = at(k), far = (x - px) ** 2 + (y - py) ** 2;
      if (far < nearest) {
        nearest = far;
        best = k;
      }
    }
    return best;
  }

  function choices() {
    better.replaceChildren(
      h("span.soft", "Better is"),
      ...[...new Set([state.x, state.y])].map((name) =>
        button(`${state.greater.has(name) ? "more" : "less"} ${name}`, () => {
          state.greater[state.greater.has(name) ? "delete" : "add"](name);
          tell("change");
        }, { class: "way" })
      ),
    );
  }

  made = canvasIn(holder, TALL, draw, "");
  made.canvas.addEventListener("pointermove", (event) => {
    const k = under(event);
    if (k !== state.hovered) {
      state.hovered = k;
      mark();
    }
    made.canvas.style.cursor = k === null ? "default" : "pointer";
  });
  made.canvas.addEventListener("pointerleave", () => {
    state.hovered = null;
    mark();
  });
  made.canvas.addEventListener("click", (event) => {
    const k = under(event);
    if (k !== null) choose(k);
  });
  made.canvas.addEventListener("keydown", (event) => {
    const step = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!step || !front.length) return;
    const place = front.indexOf(state.chosen);
    choose(front[place < 0 ? 0 : Math.max(0, Math.min(front.length - 1, place + step))]);
    event.preventDefault();
  });
  listeners.change.push(() => {
    choices();
    draw();
  });
  listeners.brush.push(draw);
  listeners.choice.push(mark);
  choices();
  made.fit();
  return { front: () => front };
}

function line(pen, x0, y0, x1, y1) {
  pen.beginPath();
  pen.moveTo(x0, y0);
  pen.lineTo(x1, y1);
  pen.stroke();
}
function ring(pen, /** @type {number[]} */ [x, y], radius) {
  pen.beginPath();
  pen.arc(x, y, radius, 0, 7);
  pen.stroke();
}
function star(pen, /** @type {number[]} */ [x, y]) {
  pen.beginPath();
  for (let k = 0; k < 10; k++) {
    const r = k % 2 ? 4.5 : 11, angle = (k * Math.PI) / 5 - Math.PI / 2;
    pen.lineTo(x + r * Math.cos(angle), y + r * Math.sin(angle));
  }
  pen.closePath();
  pen.fillStyle = variable("--red");
  pen.strokeStyle = variable("--paper");
  pen.lineWidth = 1.5;
  pen.fill();
  pen.stroke();
}
