// Reserves of all items against their limits and of the links against failure, and the first failure.
const MOST = 1000; // largest printed reserve

// Reserve with its error, or its lower bound if the error is large. The mark is that of the figure of the reserve.
// A reserve is value / limit if the limit is a minimum (`least`), otherwise limit / value.
function reserveWords({ reserve, least: minimum }) {
  const { value: size, error } = reserve, mark = reserve.unreliable ? " (unreliable)" : "";
  if (size === null) return "–";
  const uncertain = error > UNRELIABLE * size, direct = minimum && error < size;
  const least = !uncertain ? size : direct ? size - error : size / (1 + error / size);
  if (least > MOST) return `more than ${MOST}${mark}`;
  return uncertain ? `more than ${number(least, 2)}${mark}` : number(size, 4) + errorSize(reserve) + mark;
}

const itemWords = ({ kind, item }) => [kind, item].filter(Boolean).join(" ");

// Place of a failure: label of the beam, position along it (missing for a whole beam), and instant.
function spotOf({ kind, figure, found }) {
  const label = kind === "link" ? found.label : "";
  const life = ["endurance", "life"].includes(figure) ? summary.life?.links[label] : null;
  return { label, along: (life ?? found).along ?? null, at: found };
}

// Place of the smallest reserve of a link; null if there is none, or for a whole beam.
function firstSpot() {
  const row = summary.breaks_first.find(({ kind }) => kind === "link"),
    spot = row && spotOf(row),
    beam = spot?.along ? summary.links.findIndex((each) => each.label === spot.label) : -1;
  return beam < 0 ? null : {
    beam,
    part: spot.along.value / summary.links[beam].length.value,
    words: `first link: ${row.item}, ${row.name}, reserve ${reserveWords(row)}`,
  };
}

// Failure modes of links that the report does not judge: yield without a yield stress, fatigue without its table.
const unjudgedFailures = () => [leastSafe() ? "" : "yield", summary.life ? "" : "fatigue"].filter(Boolean);

function breaksFirst() {
  const rows = summary.breaks_first;
  if (!rows.length) return;
  section(
    "breaks-first",
    "Reserves",
    "What breaks first",
    soft(
      "Reserve: limit / value, or value / limit for a minimum. Below 1, the limit is violated. If the value is " +
        "proportional to the loads, the reserve is the factor by which the loads may grow. For lives and cam " +
        "pressures it is this factor too, found from the exponent of their formula. Yield, fatigue and buckling of " +
        "links need no limit in the scene, but yield needs a yield stress, and fatigue the table [fatigue]." +
        (firstSpot() ? " The red ring on the mechanism marks the smallest reserve of a link." : ""),
    ),
    longTable(rows, [
      { name: "Item", text: itemWords },
      { name: "limit", wraps: true, text: (row) => row.name },
      { name: "reserve", of: (row) => row.reserve.value, words: reserveWords, worst: "least" },
      { name: "value", text: foundWords },
      { name: "allowed", text: allowedWords },
      { name: "where", text: (row) => whereWords(spotOf(row)) },
    ], "Reserves"),
  );
}

const whereWords = ({ label, along, at }) =>
  [memberOf(label), placeWords(label, { along }), at.drive ? atWords(at) : ""].filter(Boolean).join(", ");
