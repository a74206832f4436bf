// Maps of a field along every link (vertical) over the cycle (horizontal), which show the current instant.
const ACROSS = 240, UP = 31;
const SHADES = [[178, 24, 43], [239, 138, 98], [253, 219, 199], [247, 247, 247], [209, 229, 240], [103, 169, 207], [
  33,
  102,
  172,
]];

function shade(part) {
  // Colours from red (-1) through white (0) to blue (1).
  const place = (Math.max(-1, Math.min(1, part)) + 1) * 3, low = Math.min(5, Math.floor(place)), way = place - low;
  return SHADES[low].map((one, k) => one + way * (SHADES[low + 1][k] - one));
}

function mapsSection() {
  if (!model.beams.length || N < 2) return;
  const names = fieldsShown.map((field) => option(field, FIELDS[field].name, field === FIRST_FIELD));
  const pick = choice("map-field", () => draw(), names);
  const rows = h("div.maps");
  section(
    "maps",
    "Maps",
    "Along each link, over the cycle",
    soft(
      "Vertical: from the first to the second point of the link; horizontal: ",
      axis.label,
      ". Blue is positive, red negative, white zero, grey without figures; each map spans its own range.",
    ),
    hint("Hover for values, click to go to that instant."),
    h("div.bar.kept", labelled("Field", pick)),
    rows,
  );
  const lines = [];
  function draw() {
    lines.length = 0;
    rows.replaceChildren(...model.beams.map((_, beam) => map(beam, pick.value, lines)));
    mark(instant.position);
  }
  const mark = (i) => lines.forEach((line) => (line.style.left = `${(100 * (orderOf.get(i) + 0.5)) / order.length}%`));
  draw();
  follow(mark);
}

function map(beam, field, lines) {
  const { name, unit, value } = FIELDS[field],
    { length, start, end } = model.beams[beam],
    label = beamName(model.beams[beam].label);
  const across = Math.min(order.length, ACROSS),
    columns = Array.from({ length: across }, (_, k) => order[Math.floor((k * order.length) / across)]);
  const values = columns.map((i) =>
    Array.from({ length: UP }, (_, k) => (shownAt(i) ? value(beam, i, k / (UP - 1)) : NaN))
  );
  const most = largestOf(values.flat());
  const canvas = h("canvas", {
      width: across,
      height: UP,
      role: "img",
      "aria-label": `${name} of ${label} over the cycle, at most ${quantity(most, unit)}`,
    }),
    pen = canvas.getContext("2d"),
    image = pen.createImageData(across, UP);
  values.forEach((column, x) =>
    column.forEach((each, k) => {
      const at = 4 * ((UP - 1 - k) * across + x);
      image.data.set(isFinite(each) ? [...shade(most ? each / most : 0), 255] : [150, 150, 150, 255], at);
    })
  );
  pen.putImageData(image, 0, 0);
  const line = h("div.now"), reading = h("span.soft", `±${quantity(most, unit, 3)}`);
  const place = (event) => {
    const box = canvas.getBoundingClientRect(), part = (size, at) => Math.max(0, Math.min(0.999999, at / size));
    return [
      Math.floor(part(box.width, event.clientX - box.left) * order.length),
      1 - part(box.height, event.clientY - box.top),
    ];
  };
  const holder = h("div.map", canvas, line);
  holder.addEventListener("pointermove", (event) => {
    const [k, xi] = place(event), i = order[k];
    if (i === null) return;
    reading.textContent = `${quantity(value(beam, i, xi), unit)} at ${quantity(xi * length, "m", 3)}, ${
      axis.angular ? coordinateWords(row("drive")[i], "rad") : instantWords(i)
    }`;
  });
  holder.addEventListener("pointerleave", () => (reading.textContent = `±${quantity(most, unit, 3)}`));
  holder.addEventListener("click", (event) => {
    const i = order[place(event)[0]];
    if (i !== null) {
      stop();
      showPosition(i);
    }
  });
  lines.push(line);
  return h("div.maprow", h("div.maplabel", h("b", label), h("span.soft", `${start} – ${end}`), reading), holder);
}
