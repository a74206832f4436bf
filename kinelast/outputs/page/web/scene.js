// The data of the page: figures as JSON, coefficients of polynomials, and the evaluation of fields.
const read = (id) => JSON.parse($(id).textContent);

const { summary, model, verdict, trusted, handout, text: sceneText } = read("scene");
const N = model.positions;
Object.assign(chosenUnits, model.units);
const arrays = unpacked(model.arrays, N);
for (const [name, [of, times, factors]] of Object.entries(model.integrals)) {
  arrays[name] = integrated(arrays[name].values, arrays[of], times, factors);
}

// Coefficients of a field. The first ones are given; the others follow from repeated integration of another field.
function integrated(first, { values, shape: [order, pieces] }, times, factors) {
  const whole = new Float64Array((order + times) * pieces * N);
  whole.set(first);
  for (let k = 0; k < order; k++) {
    let product = 1;
    for (let d = 1; d <= times; d++) product *= k + d;
    for (let piece = 0; piece < pieces; piece++) {
      for (let i = 0; i < N; i++) {
        whole[((k + times) * pieces + piece) * N + i] = (values[(k * pieces + piece) * N + i] * factors[piece]) /
          product;
      }
    }
  }
  return { values: whole, shape: [order + times, pieces] };
}

const row = (name, k = 0) => arrays[name].values.subarray(k * N, (k + 1) * N);
const has = (name) => name in arrays;
// Vectors are stored as x, y, x, y. Returns that of link `k` at position `i`; the ground has none.
const vector = (name, k, i) => [arrays[name].values[2 * (k * N + i)], arrays[name].values[2 * (k * N + i) + 1]];

// The rows of the pieces of every beam, and the starts of the pieces.
const piecesOf = model.beams.map((_, beam) =>
  model.pieces.map((owner, at) => [owner, at]).filter(([owner]) => owner === beam).map(([, at]) => at)
);

function pieceAt(beam, i, xi) {
  const rows = piecesOf[beam];
  if (!has("piece.start")) return [rows[0], xi, 1];
  let chosen = rows[0];
  for (const at of rows) if (row("piece.start", at)[i] < xi) chosen = at;
  const start = row("piece.start", chosen)[i], width = row("piece.width", chosen)[i];
  return [chosen, width > 0 ? (xi - start) / width : 0, width];
}

function polynomial(field, piece, i, t, derivative = 0) {
  const { values, shape } = arrays[`field.${field}`];
  const [order, rows] = shape;
  let sum = 0;
  for (let k = order - 1; k >= derivative; k--) {
    let factor = 1;
    for (let d = 0; d < derivative; d++) factor *= k - d;
    sum = sum * t + factor * values[(k * rows + piece) * N + i];
  }
  return sum;
}

// Fields that are derivatives of stored fields: N' = -q_x, M' = V, V' = q_y, w' = phi.
const DERIVED = { V: ["M", 1, 1], phi: ["w", 1, 1], q_x: ["N", 1, -1], q_y: ["M", 2, 1] };

function basic(field, beam, i, xi) {
  const [piece, t] = pieceAt(beam, i, xi);
  if (has(`field.${field}`)) return polynomial(field, piece, i, t);
  const [from, derivative, sign] = DERIVED[field];
  return (sign * polynomial(from, piece, i, t, derivative)) / Math.pow(model.beams[beam].length, derivative);
}

function along(beam, name, xi) {
  const factors = model.beams[beam].taper?.[name];
  if (!factors) return 1;
  return factors.reduceRight((sum, factor) => sum * xi + factor, 0);
}

function stresses(beam, i, xi) {
  const { area, inertia, fibre, peak_shear } = model.beams[beam];
  const axial = basic("N", beam, i, xi) / (area * along(beam, "EA", xi));
  const bending = (basic("M", beam, i, xi) * fibre * along(beam, "fibre", xi)) / (inertia * along(beam, "EI", xi));
  const shear = (basic("V", beam, i, xi) * peak_shear * along(beam, "peak_shear", xi)) / (area * along(beam, "EA", xi));
  return { axial, bending, shear };
}

const known = (beam) =>
  model.beams[beam].area !== null && model.beams[beam].inertia !== null && model.beams[beam].fibre !== null;
const stress = (rule) => (beam, i, xi) => (known(beam) ? rule(stresses(beam, i, xi)) : NaN);

// The properties of a field other than its name.
const MEANINGS = {
  q_x: "inertia, weight and other loads along the link, per length",
  q_y: "inertia, weight and other loads across the link, per length",
  N: "along the link; positive pulls",
  V: "across the link",
  M: "the moment by which one half of the link turns the other",
  u: "displacement along the link, from where a rigid link would be",
  w: "displacement across the link, from where a rigid link would be",
  phi: "by how much the link is turned there from a rigid one",
  chord: "how far the link bows out of the straight line through its own displaced ends: bending alone, " +
    "without what carries the link about",
  left: "normal stress of the outermost fibre on the left of the way from the first point to the second",
  right: "normal stress of the outermost fibre on the right",
  normal: "the larger of both outermost fibres; tension positive",
  shear: "the largest shear stress of the section",
  mises: "what is compared with the yield stress",
  axial: "axial force over area",
};
const OWN = {
  chord: (beam, i, xi) => {
    // ends of the member: beam, xi, sign across this beam
    const { first, last, begin, rise } = model.beams[beam].member;
    const [from, to] = [first, last].map(([at, end, sign]) => sign * basic("w", at, i, end));
    return basic("w", beam, i, xi) - from - (to - from) * (begin + rise * xi);
  },
  axial: stress((s) => s.axial),
  left: stress((s) => s.axial - s.bending),
  right: stress((s) => s.axial + s.bending),
  shear: stress((s) => s.shear),
};

// All registered fields by key, with name, symbol, unit, meaning, and value on a beam at a position and location.
const FIELDS = Object.fromEntries(model.fields.map((field) => [field.key, { ...field, means: MEANINGS[field.key] }]));
for (const [key, field] of Object.entries(FIELDS)) {
  if (field.greatest_of.length) {
    field.value = (beam, i, xi) => {
      const most = field.greatest_of.map((part) => FIELDS[part].value(beam, i, xi)).reduce((
        one,
        other,
      ) => (Math.abs(other) > Math.abs(one) ? other : one));
      return field.signed ? most : Math.abs(most);
    };
  } else if (field.root_of.length) {
    field.value = (beam, i, xi) =>
      Math.sqrt(field.root_of.reduce((sum, [weight, part]) => sum + weight * FIELDS[part].value(beam, i, xi) ** 2, 0));
  } else field.value = OWN[key] ?? ((beam, i, xi) => basic(key, beam, i, xi));
}
const FIRST = ["M", "w", "chord", "u", "phi", "N", "V", "left", "right", "shear", "mises", "q_x", "q_y"];
const PARTS = ["axial", "normal", "axis"]; // of others, which show them
const OFFERED = [...FIRST, ...Object.keys(FIELDS).filter((field) => !FIRST.includes(field) && !PARTS.includes(field))];
const stressed = model.beams.some((_, beam) => known(beam));
const fieldsShown = OFFERED.filter((field) => stressed || FIELDS[field].unit !== "Pa");
const counted = (i) => arrays.counted.values[i] > 0;

// The greatest magnitude of a field over all beams, stations and positions, which scales diagrams and maps.
const scales = {};
function scaleOfField(field) {
  if (field in scales) return scales[field];
  let largest = 0;
  const step = Math.max(1, Math.floor(N / 120));
  for (let beam = 0; beam < model.beams.length; beam++) {
    for (let i = 0; i < N; i += step) {
      for (let k = 0; k <= 16 && counted(i); k++) {
        const size = Math.abs(FIELDS[field].value(beam, i, k / 16));
        if (size > largest) largest = size;
      }
    }
  }
  return (scales[field] = largest);
}

const fileName = (words) => `${summary.scene.name}_${words.toLowerCase().replace(/[^a-z0-9]+/g, "_")}`;
function downloadSvg(name, picture, more = "") {
  download(`${fileName(name)}${more}.svg`, "image/svg+xml", new XMLSerializer().serializeToString(picture));
}
