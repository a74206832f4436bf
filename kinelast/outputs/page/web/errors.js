// Errors of figures in words, like kinelast/outputs/words.py.

const UNRELIABLE = 0.25; // of kinelast/values/numbers.py
// Mark of a figure with a large error.
function unreliableMark(figure) {
  if (!figure?.value) return "";
  if (figure.unreliable) return " (unreliable)";
  return figure.error > UNRELIABLE * Math.abs(figure.value) ? " (near zero)" : "";
}

// Error as a suffix of its figure, relative, or absolute if it exceeds the figure.
/** @param {any} figure */
function errorWords(figure) {
  return errorSize(figure) + unreliableMark(figure);
}

/** @param {any} figure */
function errorSize(figure) {
  const { value, unit, error, error_unknown: unknown, error_measured: measured } = figure ?? {};
  if (error === null && unknown && value !== null) return " (error unknown)";
  if (value === null || value === undefined) return "";
  return error
    ? ` ± ${error <= Math.abs(value) ? errorShare(error / Math.abs(value)) : figureAngle({ value: error, unit }, 2)}${
      measured ? " measured" : ""
    }`
    : "";
}

const share = (part) => `${number(100 * part, 2)} %`;
const errorShare = (part) => (part < 1e-4 ? "< 0.01 %" : share(part)); // MIN_PRINTED_ERROR of kinelast/values/numbers.py
