// Controls of the mechanism: play, select diagrams, exaggerate displacements, show and hide.
const FIRST_FIELD = "M";

function check(words, on, change, attributes = {}) {
  return h(
    "label.check",
    { ...attributes },
    h("input", { type: "checkbox", checked: on, onchange: (event) => change(event.target.checked) }),
    h("span", words),
  );
}

function mechanismSection() {
  const words = h("output", { id: "instant", class: "instant" });
  const slider = h("input", {
    type: "range",
    id: "position",
    min: 0,
    max: N - 1,
    value: 0,
    step: 1,
    "aria-label": "position in the cycle",
    oninput: (event) => {
      stop();
      showPosition(Number(event.target.value));
    },
  });
  const start = button("Play", toggle, { id: "play", class: "main", "aria-pressed": "false" });
  const speeds = [["slow", 20], ["medium", 8], ["fast", 3]].map(([name, seconds]) =>
    option(seconds, name, seconds === 8)
  );
  const speed = h("select", { id: "speed", "aria-label": "speed" }, speeds);
  function toggle() {
    if (instant.playing !== null) return stop();
    play(() => Number(speed.value));
    tell(true);
  }
  // Screen readers do not announce changes while the motion plays.
  function tell(playing) {
    start.textContent = playing ? "Pause" : "Play";
    start.setAttribute("aria-pressed", String(playing));
    words.setAttribute("aria-live", playing ? "off" : "polite");
  }
  instant.stopped = () => tell(false);
  const holder = h("div.stage", { id: "stage" }), tip = h("div.tip", { hidden: true });
  const drawn = h("p.paper.drawn-words");
  addEventListener("beforeprint", () => {
    const fields = Array.from(view.fields, (field) => {
      const { name, unit } = FIELDS[field];
      return `${name}, up to ${quantity(scaleOfField(field), unit, 3)}`;
    });
    drawn.textContent = [instantWords(instant.position), ...fields].join("; ");
  });
  holder.append(tip);
  const more = model.beams.length ? "; hover for values, click a link to see its fields below" : "";
  const shown = bar(
    suited ? show("rigid", "rigid position") : null,
    show("paths", "paths of the points"),
    show("reactions", "joint forces"),
    show("names", "names"),
    firstSpot() ? show("spot", "where it breaks first") : null,
    button("SVG of this instant", saveMechanism),
  );
  const controls = h(
    "div.controls",
    bar(start, speed, slider, words),
    exaggeration(),
    h(
      "details",
      h("summary", "Diagrams, and what else is drawn"),
      hint(`Drag the slider or any link${more}. Keys: space plays, ← and → step.`),
      diagramChoice(),
      shown,
    ),
  );
  const part = section("mechanism", "Mechanism", "The mechanism, moving", h("div.picture", holder, drawn), controls);
  drawMechanism(holder, tip);
  follow((i) => {
    slider.value = i;
    slider.setAttribute("aria-valuetext", instantWords(i));
    words.textContent = instantWords(i) + (counted(i) ? "" : " – too near a dead point: in no largest value");
  });
  // Keyboard control. It also works without focus on the picture if no other element has focus and the picture is
  // visible.
  document.addEventListener("keydown", (event) => {
    const target = /** @type {any} */ (event.target),
      inside = part.contains(target),
      box = holder.getBoundingClientRect();
    if (
      event.ctrlKey || event.altKey || event.metaKey ||
      !(inside || (target === document.body && box.bottom > 0 && box.top < innerHeight))
    ) return;
    if (target.matches("input:not([type=checkbox]), select, summary")) return;
    const steps = { ArrowLeft: -1, ArrowRight: 1, ...(inside ? { PageUp: -10, PageDown: 10 } : {}) };
    if (event.key === " " && target.matches("button, input")) return;
    if (event.key === " ") toggle();
    else if (event.key in steps) {
      stop();
      showPosition(instant.position + steps[event.key]);
    } else return;
    event.preventDefault();
  });
  return part;
}

function show(name, words) {
  return check(words, view[name], (on) => {
    view[name] = on;
    view.redraw();
  }, { id: `show-${name}` });
}

function diagramChoice() {
  if (!model.beams.length) return soft("No link has beams, so there are no diagrams.");
  return h(
    "fieldset.bar.diagrams",
    h("legend", "Diagrams on the links (each to its own scale)"),
    fieldsShown.map((field) => {
      const row = FIELDS[field];
      return h(
        "label",
        { class: `check chip f-${field}`, title: row.means },
        h("input", {
          type: "checkbox",
          value: field,
          checked: view.fields.has(field),
          onchange: (event) => {
            view.fields[event.target.checked ? "add" : "delete"](field);
            view.redraw();
            showBeam();
          },
        }),
        h("span", row.name),
      );
    }),
  );
}

function exaggeration() {
  if (!suited) return null;
  const words = h("output", `${number(view.factor)} times`);
  const low = Math.min(0, Math.log10(suited) - 2), high = Math.max(0, Math.log10(suited) + 1);
  const range = h("input", {
    type: "range",
    id: "exaggeration",
    min: low,
    max: high,
    step: 0.01,
    value: Math.log10(view.factor),
    "aria-label": "exaggeration of the displacements",
    oninput: (event) => set(Math.pow(10, Number(event.target.value))),
  });
  function set(factor) {
    view.factor = Number(factor.toPrecision(2));
    words.textContent = `${number(view.factor)} times`;
    view.redraw();
  }
  const to = (name, factor) =>
    button(name, () => {
      if (factor > 0) range.value = Math.log10(factor);
      set(factor);
    });
  const sizes = [to("true size", 1), to("rigid", 0), to(`${number(suited)} times`, suited)];
  return bar(labelled("Displacements drawn larger", range), words, sizes);
}

// A copy of the picture with the colours of the page written into it.
function saveMechanism() {
  const copy = view.svg().cloneNode(true);
  const originals = view.svg().querySelectorAll("*");
  copy.querySelectorAll("*").forEach((element, k) => {
    const style = getComputedStyle(originals[k]);
    for (
      const name of [
        "fill",
        "stroke",
        "stroke-width",
        "stroke-dasharray",
        "fill-opacity",
        "opacity",
        "font",
        "visibility",
        "display",
      ]
    ) element.style.setProperty(name, style.getPropertyValue(name));
  });
  copy.setAttribute("xmlns", SVG);
  copy.setAttribute("width", view.svg().clientWidth);
  downloadSvg("mechanism", copy, `_${instant.position}`);
}
