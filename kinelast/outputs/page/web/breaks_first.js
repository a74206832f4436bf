// Reserves of the links: the failure mode of each link, and the first failure.
const MODES = {
  yield: "yield",
  endurance: "endurance",
  buckling: "buckling",
  "safety limit": "limit on safety",
  "endurance limit": "limit on endurance",
  "buckling limit": "limit on buckling",
  deflection: "deflection",
  chord: "deflection from chord",
  output: "output error",
  life: "life",
  "limit speed": "limit speed",
};
const modeName = (mode) => MODES[mode] ?? summary.figures[mode]?.name ?? mode;
const MOST = 1000; // largest printed reserve

// Reserve with its error, or its lower bound if the error is large. The mark is that of the figure of the reserve.
function reserveWords(reserve) {
  if (!reserve) return "";
  const { value: size, error } = reserve, mark = reserve.unreliable ? " (unreliable)" : "";
  if (size > MOST) return `more than ${MOST}`;
  if (error > UNRELIABLE * size) return `more than ${number(size / (1 + error / size), 2)}${mark}`;
  return number(size, 3) + errorSize(reserve) + mark;
}

// Place of a failure: label of the beam, position along it (missing for a whole beam), and instant.
function spotOf(mode, reserve) {
  const { label } = reserve,
    known = {
      yield: () => summary.strength[label]?.safety_factor,
      "safety limit": () => summary.strength[label]?.safety_factor,
      deflection: () => summary.peaks[label]?.w,
      chord: () => summary.peaks[label]?.chord,
      endurance: () => summary.life?.links[label],
      "endurance limit": () => summary.life?.links[label],
      life: () => summary.life?.links[label],
    };
  return { label, along: known[mode]?.()?.along ?? null, at: reserve };
}

// Place of the first failure of the machine; null if there is none, or for a whole beam.
function firstSpot() {
  const row = summary.breaks_first?.[0],
    spot = row && spotOf(row.governs, row.reserve),
    beam = spot?.along ? summary.links.findIndex((each) => each.label === spot.label) : -1;
  return beam < 0 ? null : {
    beam,
    part: spot.along.value / summary.links[beam].length.value,
    words: `breaks first: ${row.link} by ${modeName(row.governs)}, reserve ${reserveWords(row.reserve)}`,
  };
}

function breaksFirst() {
  const rows = summary.breaks_first;
  if (!rows.length) return;
  const found = rows.flatMap((row) => Object.keys(row.reserves)),
    modes = [...new Set([...Object.keys(MODES), ...found])].filter((mode) => found.includes(mode));
  section(
    "breaks-first",
    "Reserves",
    "What breaks first",
    soft(
      "Reserve: load factor at which a link yields, breaks, buckles or exceeds one of its limits, or the output " +
        "exceeds its limit. Below 1 this has happened. Limits on joints, drives and machine parts are under Limits." +
        (firstSpot() ? " The red ring on the mechanism marks the smallest reserve." : ""),
    ),
    longTable(rows, [
      { name: "Link or output", text: (row) => row.link },
      { name: "governs", text: (row) => modeName(row.governs) },
      { name: "reserve", of: (row) => row.reserve.value, words: (row) => reserveWords(row.reserve), worst: "least" },
      { name: "where", text: (row) => whereWords(spotOf(row.governs, row.reserve)) },
      ...modes.map((mode) => ({
        name: modeName(mode),
        of: (row) => row.reserves[mode]?.value ?? NaN,
        words: (row) => reserveWords(row.reserves[mode]),
      })),
    ], "Reserves"),
  );
}

const whereWords = ({ label, along, at }) =>
  [memberOf(label), placeWords(label, { along }), at.drive ? atWords(at) : ""].filter(Boolean).join(", ");
