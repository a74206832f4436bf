// Fatigue: life of the links.
function lifeWords(figure) {
  if (figure.value === null) return "endless";
  return (figure.unit === "s" ? `${number(figure.value / 3600)} h` : figureWords(figure)) + errorWords(figure);
}

function lifeSection() {
  const { life } = summary;
  if (!life) return;
  const rows = Object.entries(life.links).map(([label, row]) => ({ label, ...row }));
  section(
    "life",
    "Life",
    "Life",
    soft(
      `Safety against endurance by the ${life.criterion[0].toUpperCase()}${
        life.criterion.slice(1)
      } criterion, for the largest cycle of the normal stress in either fibre, including notches. A cycle ` +
        "is a run of the scene. Below the endurance limit the life is endless.",
    ),
    table(rows, [
      { name: "Link", text: (each) => beamName(each.label) },
      {
        name: "safety against endurance",
        of: (each) => value(each.endurance),
        words: (each) => number(value(each.endurance), 3) + errorWords(each.endurance),
        worst: "least",
      },
      { name: "where", text: (each) => `${placeWords(each.label, each)}, ${each.fibre} fibre` },
      { name: "amplitude", unit: "Pa", of: (each) => value(each.amplitude) },
      { name: "mean", unit: "Pa", of: (each) => value(each.mean) },
      {
        name: "endurance limit",
        means: "of the part, its factors of surface, size and reliability in it",
        unit: "Pa",
        of: (each) => value(each.endurance_limit),
      },
      { name: "runs", text: (each) => (each.endless ? "endless" : lifeWords(each.cycles)) },
      { name: "life", text: (each) => (each.endless ? "endless" : lifeWords(each.life)) },
    ], "Life of the links"),
  );
}

partSections.push(lifeSection);
