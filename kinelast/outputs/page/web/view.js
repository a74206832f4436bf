// The view of the mechanism: visible elements, frame, and scales of displacements and forces.
const STATIONS = 24, DIAGRAM_SHARE = 0.11, DEFORMED_SHARE = 0.06;
const view = {
  factor: 1,
  fields: new Set(),
  names: true,
  paths: true,
  reactions: false,
  rigid: true,
  spot: true,
  selected: null,
  redraw: () => {},
};

// Corners of the frame, with a margin for diagrams and displaced links.
const roomShare = model.beams.length ? DIAGRAM_SHARE : 0.02;
const [lowest, highest] = model.extent;
const extent = Math.max(highest[0] - lowest[0], highest[1] - lowest[1]);
const room = roomShare * extent;
const corners = [plus(lowest, [-room, -room]), plus(highest, [room, room])];

function roundDown(value) {
  const power = Math.pow(10, Math.floor(Math.log10(value)));
  return [5, 2, 1].map((step) => step * power).find((each) => each <= value * (1 + 1e-9)) ?? power;
}

// The round factor that makes the largest displacement of any point or beam well visible; 0 if there is none.
const suited = (() => {
  let largest = Math.max(...["u", "w"].map((field) => (model.beams.length ? scaleOfField(field) : 0)), 0);
  for (const { link, point } of movingPoints) {
    for (let i = 0; i < N; i++) {
      if (counted(i)) largest = Math.max(largest, size(displacementOf(link, point, i)) || 0);
    }
  }
  return largest > 1e-12 * extent ? roundDown((DEFORMED_SHARE * extent) / largest) : 0;
})();
view.factor = suited && Math.max(1, suited); // the first picture shows displacements, if they are known

const largestForce = (() => {
  let largest = 0;
  for (let k = 0; k < model.joints.length; k++) {
    for (let i = 0; i < N; i++) if (counted(i)) largest = Math.max(largest, size(vector("force", k, i)) || 0);
  }
  return largest;
})();

// Links without beams, drawn by their outline or their points.
const bareLinks = model.links.map((_, k) => k).filter((k) =>
  k > GROUND && !model.beams.some((beam) => beam.link === k)
);

// Whether the last position is followed by the first.
const isClosed = (() => {
  const one = movingPoints[0];
  if (!one || N < 3) return false;
  const place = (i) => placeOf(one.link, localOf(one.link, one.point), i);
  const apart = (i, k) => size(plus(place(i), scaled(-1, place(k))));
  return apart(0, N - 1) < 1.6 * apart(0, 1);
})();
