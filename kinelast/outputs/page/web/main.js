// Builds the page from its data.
function runWords() {
  const { run } = summary,
    words = [`${several(run.positions, "position")} from ${figureWords(run.start)} to ${figureWords(run.end)}`];
  if (run.singular) words.push(`, ${run.singular} of them singular`);
  if (run.locked) words.push(`, ${run.locked} of them possibly locked by friction`);
  if (run.left_out) words.push(`; ${run.left_out} more out of reach, left out`);
  if (N < run.positions) words.push(`; curves and pictures show ${N} of them, the figures include all`);
  return `${words.join("")}.`;
}

const ELASTIC = [
  contributions,
  beamSection,
  mapsSection,
  extremesSection,
  strengthSection,
  errorsSection,
  lifeSection,
  vibrationSection,
]; // empty for links that buckle
const SECTIONS = [
  contributions,
  beamSection,
  curvesSection,
  speedsSection,
  whatIfSection,
  studiesSections,
  mapsSection,
  kinematicsSection,
  extremesSection,
  strengthSection,
  errorsSection,
  forcesSection,
  drivesSection,
  ...partSections,
  vibrationSection,
  registerSection,
  checkSection,
  trustSection,
  inputsSection,
];

async function start() {
  const script = document.createElement("script");
  script.textContent = new TextDecoder().decode(await inflated("uplot"));
  document.head.append(script);
  $("gist").remove();
  theme(restyle);
  answerSection();
  const first = new Set(document.querySelectorAll("section"));
  for (const part of SECTIONS) if (!summary.buckles || !ELASTIC.includes(part)) part();
  footer();
  foldAll(
    [.../** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("main > section"))].filter((part) =>
      !first.has(part)
    ),
  );
  showPosition(positionOf(summary.largest_chord ?? summary.output));
  document.body.dataset.ready = "yes";
}

// Interface for tests.
window.kinelast = {
  summary,
  model,
  number,
  quantity,
  fields: FIELDS,
  value: (field, beam, i, xi) => FIELDS[field].value(beam, i, xi),
  placeOf,
  localOf,
  velocityOf,
  accelerationOf,
  displacementOf,
  turnOf,
  row,
  vector,
  showPosition,
  instant,
  charts,
};
start().catch((error) => {
  $("main").prepend(h("p.verdict.poor", `This page could not be drawn: ${error.message}`));
  throw error;
});
