// Formats numbers with SI prefixes, few digits and angles within one turn, like kinelast/values/numbers.py.
const PREFIXES = { "-9": "n", "-6": "µ", "-3": "m", 0: "", 3: "k", 6: "M", 9: "G" };
const UNPREFIXED = new Set(["", "deg", "kg", "kg/m", "kg/m^3", "kg m^2", "1", "m/s^2", "1/s^2", "rad/s", "rad/s^2"]);
const METRES = { m: 1, cm: 1e-2, mm: 1e-3, "µm": 1e-6 };
const RAISED = "⁰¹²³⁴⁵⁶⁷⁸⁹";

// Requested display units by SI unit, as factor and name. Other units have a suitable prefix.
const chosenUnits = {};

function scaleOf(largest, unit) {
  return chosenUnits[unit] ?? prefixedScale(largest, unit);
}

function prefixedScale(largest, unit) {
  const size = Math.abs(largest), raised = /^m\^(\d)/.exec(unit);
  if (raised) {
    // The power would apply to the prefix too.
    if (!(size > 0 && isFinite(size))) return [1, unit];
    const name = Object.keys(METRES).find((each) => size >= Math.pow(METRES[each], Number(raised[1])) * (1 - 1e-9)) ??
      "µm";
    return [1 / Math.pow(METRES[name], Number(raised[1])), name + unit.slice(1)];
  }
  if (UNPREFIXED.has(unit) || unit.startsWith("1/") || !isFinite(size) || size < 1e-12) return [1, unit];
  if (unit === "s" && size >= 3600) return [1 / 3600, "h"];
  let power = Math.min(Math.max(3 * Math.floor(Math.log10(size) / 3), -9), unit === "s" ? 0 : 9);
  if (unit === "m" && power > 0) power = size >= 1e4 ? 3 : 0;
  return [Math.pow(10, -power), PREFIXES[power] + unit];
}

function plain(value, digits) {
  // Rounded to significant digits in the format of Python's %g.
  const power = value === 0 ? 0 : Number(value.toExponential(digits - 1).split("e")[1]);
  if (power < -5 || power >= Math.max(digits, 7)) {
    const [mantissa, exponent] = value.toExponential(digits - 1).split("e");
    return [mantissa.includes(".") ? mantissa.replace(/\.?0+$/, "") : mantissa, Number(exponent)];
  }
  const text = value.toFixed(Math.max(0, digits - 1 - power));
  return [text.includes(".") ? text.replace(/\.?0+$/, "") : text, 0];
}

function number(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!isFinite(value)) return value > 0 ? "∞" : "−∞";
  const size = Math.abs(value);
  let text;
  if (size >= Math.pow(10, digits) && size < 1e7) text = value.toFixed(0);
  else {
    const [mantissa, power] = plain(value + 0, digits);
    const raised = String(Math.abs(power)).replace(/\d/g, (digit) => RAISED[digit]);
    text = power ? `${mantissa}·10${power < 0 ? "⁻" : ""}${raised}` : mantissa;
  }
  return (text === "-0" ? "0" : text).replace(/-/g, "−");
}

function unitWords(unit) {
  return (unit === "1" ? "" : unit).replace(/\^2/g, "²").replace(/\^3/g, "³").replace(/\^4/g, "⁴").replace(/ /g, "·")
    .replace("deg", "°");
}

function quantity(value, unit, digits = 4) {
  if (value === null || value === undefined || !isFinite(value)) return number(value);
  const small = unit === "Pa" && unit in chosenUnits && value !== 0 && Math.abs(value * chosenUnits[unit][0]) < 1e-3;
  const [factor, prefixed] = small ? prefixedScale(value, unit) : scaleOf(value, unit);
  return `${number(value * factor, digits)} ${unitWords(prefixed)}`.trim();
}

function figureWords(figure, digits = 4) {
  return figure ? quantity(figure.value, figure.unit, digits) : "–";
}

// Angles in degrees.
function figureAngle(figure, digits = 4) {
  if (figure.unit !== "rad" || figure.value === null) return figureWords(figure, digits);
  return `${number((figure.value * 180) / Math.PI, digits)}°`;
}

function withinTurn(angle) {
  const degrees = ((((angle * 180) / Math.PI) % 360) + 360) % 360;
  return degrees > 360 - 5e-7 ? 0 : degrees;
}

function coordinateWords(value, unit) {
  return unit === "rad" ? `${number(withinTurn(value))}°` : quantity(value, unit);
}

// Round ticks between two values.
function ticks(low, high, most) {
  const raw = (high - low) / most || 1,
    power = Math.pow(10, Math.floor(Math.log10(raw))),
    step = [1, 2, 5, 10].map((f) => f * power).find((each) => each >= raw * 0.999);
  const first = Math.ceil(low / step - 1e-9), count = Math.floor(high / step + 1e-9) - first;
  return Array.from({ length: Math.max(0, Math.min(50, count + 1)) }, (_, k) => (first + k) * step);
}
