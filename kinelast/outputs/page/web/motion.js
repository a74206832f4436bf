// Positions, velocities and displacements of links and points. Link 0 is the ground.
const GROUND = 0;
const LINK_COLOURS = 8;
const ON_BEAM = 1e-9; // offset of a point that is on a beam, relative to the beam's length
const linkColour = (link) => (link === GROUND ? "var(--ink)" : `var(--l${(link - 1) % LINK_COLOURS})`);
/** @typedef {[number, number]} Vector x and y */
/** @type {(one: number[], other: number[]) => Vector} */
const times = ([a, b], [c, d]) => [a * c - b * d, a * d + b * c];
/** @type {(one: number[], other: number[]) => Vector} */
const plus = ([a, b], [c, d]) => [a + c, b + d];
/** @type {(factor: number, place: number[]) => Vector} */
const scaled = (f, [a, b]) => [f * a, f * b];
/** @type {(place: number[]) => number} */
const size = ([a, b]) => Math.hypot(a, b);

const localOf = (link, point) => model.links[link].points[point];

function armOf(link, local, i) {
  return link === GROUND ? local : times(vector("direction", link - 1, i), local);
}

function placeOf(link, local, i) {
  return link === GROUND ? local : plus(vector("origin", link - 1, i), armOf(link, local, i));
}

function velocityOf(link, local, i) {
  if (link === GROUND) return [0, 0];
  const omega = row("angular_velocity", link - 1)[i], [x, y] = armOf(link, local, i);
  return plus(vector("velocity", link - 1, i), [-omega * y, omega * x]);
}

function accelerationOf(link, local, i) {
  if (link === GROUND) return [0, 0];
  const omega = row("angular_velocity", link - 1)[i], alpha = row("angular_acceleration", link - 1)[i];
  const [x, y] = armOf(link, local, i), square = omega * omega;
  return plus(vector("acceleration", link - 1, i), [-square * x - alpha * y, -square * y + alpha * x]);
}

function angleOf(link, i) {
  const [x, y] = vector("direction", link - 1, i);
  return Math.atan2(y, x);
}

// Unit vector along a beam, in the ground's axes.
const beamWay = model.beams.map(({ link, start, end }) => {
  const from = localOf(link, start), to = localOf(link, end), way = [to[0] - from[0], to[1] - from[1]];
  return scaled(1 / size(way), way);
});
const beamDirection = (beam, i) => armOf(model.beams[beam].link, beamWay[beam], i);

// The first beam of a link that ends at a point, or otherwise passes through it, and the fraction of the beam before
// the point. There is no result for a point that is not on a beam.
function beamAt(link, point) {
  const own = [...model.beams.keys()].filter((k) => model.beams[k].link === link);
  const end = own.find((k) => model.beams[k].start === point || model.beams[k].end === point);
  if (end !== undefined) return [end, model.beams[end].start === point ? 0 : 1];
  for (const k of own) {
    const [x, y] = localOf(link, point), [a, b] = localOf(link, model.beams[k].start), [c, s] = beamWay[k];
    const xi = (c * (x - a) + s * (y - b)) / model.beams[k].length, aside = c * (y - b) - s * (x - a);
    if (xi > 0 && xi < 1 && Math.abs(aside) < ON_BEAM * model.beams[k].length) return [k, xi];
  }
  return null;
}

function displacementOf(link, point, i) {
  if (link === GROUND) return [0, 0];
  const end = beamAt(link, point);
  if (end) return times(beamDirection(end[0], i), [basic("u", ...[end[0], i, end[1]]), basic("w", end[0], i, end[1])]);
  const angle = row("angle", link - 1)[i], [x, y] = armOf(link, localOf(link, point), i);
  return plus(vector("shift", link - 1, i), [-angle * y, angle * x]);
}

function turnOf(link, point, i) {
  const end = beamAt(link, point);
  return end ? basic("phi", end[0], i, end[1]) : row("angle", link - 1)[i];
}

// The position at which a point of a link is drawn, with its displacement multiplied by a factor.
function drawnPlace(link, point, i, factor) {
  const place = placeOf(link, localOf(link, point), i);
  return factor ? plus(place, scaled(factor, displacementOf(link, point, i))) : place;
}

// The drawn position of a point on a beam.
function drawnOnBeam(beam, xi, i, factor) {
  const { link, start, length } = model.beams[beam];
  const from = placeOf(link, localOf(link, start), i), way = beamDirection(beam, i);
  const bent = factor
    ? [length * xi + factor * basic("u", beam, i, xi), factor * basic("w", beam, i, xi)]
    : [length * xi, 0];
  return plus(from, times(way, bent));
}

// All named moving points, each with one link to which it belongs.
const movingPoints = (() => {
  const found = new Map();
  model.links.forEach((link, k) =>
    Object.keys(link.points).forEach((point) => {
      if (k > GROUND && !found.has(point) && !(point in model.links[GROUND].points)) found.set(point, k);
    })
  );
  return [...found].map(([point, link]) => ({ point, link }));
})();

// The abscissa of the charts: the angle of the first drive if it turns in one direction only, otherwise the time.
const axis = (() => {
  const drive = model.drives[0], values = has("drive") && model.drives.length ? row("drive") : null;
  const steps = values ? Array.from({ length: N - 1 }, (_, i) => values[i + 1] - values[i]) : [];
  if (
    drive && drive.unit === "rad" && steps.length &&
    (steps.every((step) => step > 0) || steps.every((step) => step < 0))
  ) {
    return {
      values: Array.from(values, (angle) => (angle * 180) / Math.PI),
      label: `angle of ${drive.name} [°]`,
      angular: true,
      falling: steps[0] < 0,
    };
  }
  const [factor, unit] = scaleOf(Math.max(...row("time").map(Math.abs)), "s");
  return {
    values: Array.from(row("time"), (time) => time * factor),
    label: `time [${unit}]`,
    angular: false,
    falling: false,
  };
})();

function instantWords(i) {
  const drives = model.drives.map((drive, k) => `${drive.name} ${coordinateWords(row("drive", k)[i], drive.unit)}`);
  return [`t = ${quantity(row("time")[i], "s")}`, ...drives].join(", ");
}

// The location of a figure in the cycle, in words: the angle of the first drive if it defines the position, or the time.
const atWords = (figure) => (figure?.value && figure.time ? whenWords(figure) : "");
function whenWords({ time, drive }) {
  const first = axis.angular && !summary.run.several_turns && Object.entries(drive)[0];
  return first ? `${first[0]} ${coordinateWords(first[1].value, first[1].unit)}` : `t = ${figureWords(time)}`;
}

// The position nearest to the location of a figure of the summary.
function positionOf(figure) {
  if (!figure?.time || figure.time.value === null) return 0;
  let best = 0;
  const time = row("time");
  for (let i = 1; i < N; i++) {
    if (Math.abs(time[i] - figure.time.value) < Math.abs(time[best] - figure.time.value)) best = i;
  }
  return best;
}
