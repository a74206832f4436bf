// Draws the display list, for the report and the editor. Each mark is one path in its own axes, with a transform.
const COLOURS = { load: "var(--red)", shade: "color-mix(in srgb, var(--soft) 14%, transparent)", none: "none" };

/**
 * Path of a mark [pixels, y downwards].
 * @param {any} mark
 * @param {number} scale pixels of a metre
 * @param {number} unit pixels of a symbol's size
 * @param {number} length distance of the mark's two places
 * @param {boolean} mirrored at the y axis
 */
export function markPath({ lines, radius }, scale, unit, length = 0, mirrored = false) {
  const side = mirrored ? -1 : 1, r = unit * radius[0] + scale * radius[1];
  const outlines = lines.map(({ symbol_offset: inSymbols, offset, share, closed }) => {
    const spots = (inSymbols ?? offset ?? share).map((_, k) => {
      const [u, v] = inSymbols?.[k] ?? [0, 0], [x, y] = offset?.[k] ?? [0, 0];
      const along = length * (share?.[k] ?? 0) + side * (unit * u + scale * x);
      return `${along.toFixed(2)} ${(-unit * v - scale * y).toFixed(2)}`;
    });
    return `M${spots.join("L")}${closed ? "Z" : ""}`;
  });
  return (r ? `M${r} 0A${r} ${r} 0 1 0 ${-r} 0A${r} ${r} 0 1 0 ${r} 0Z` : "") + outlines.join("");
}

/** Transform to a place on the screen, with the x axis in a direction of the plane. */
export const markTurn = (/** @type {number[]} */ [x, y], /** @type {number[]} */ [c, s]) =>
  `matrix(${c} ${-s} ${s} ${c} ${x} ${y})`;

/**
 * Attributes of a mark's path at an instant.
 * @param {any} mark
 * @param {{scale: number, unit: number, at: function, way: function, mirrored: function, colour: function}} frame
 */
export function markAttributes(mark, frame) {
  const [x, y] = frame.at(mark.at) ?? [NaN, NaN], [ex, ey] = (mark.to ? frame.at(mark.to) : [x, y]) ?? [NaN, NaN];
  const length = Math.hypot(ex - x, ey - y),
    way = mark.to ? [(ex - x) / (length || 1), (y - ey) / (length || 1)] : frame.way(mark);
  const paint = (name) => COLOURS[name] ?? (name === "link" ? frame.colour(mark.at.link) : `var(--${name})`);
  const mirrored = mark.drive !== null && frame.mirrored(mark.drive);
  const seen = isFinite(length + way[0] + way[1]) && (mark.to || Math.hypot(...way) > 0);
  return {
    class: `mark ${mark.kind}`,
    d: seen ? markPath(mark, frame.scale, frame.unit, length, mirrored) : "M0 0",
    transform: seen ? markTurn([x, y], way) : "",
    style: `stroke:${paint(mark.stroke)};fill:${paint(mark.fill)};stroke-width:${mark.width}` +
      (mark.dashed ? ";stroke-dasharray:9 3 2 3" : ""),
  };
}

/** Lines of a mark on the screen, from its path's attributes. */
export function markLines({ d, transform }) {
  const [c, , s, , x, y] = transform.slice(7).split(" ").map(parseFloat);
  return transform === "" ? [] : d.split("M").slice(1).flatMap((outline) => {
    if (outline.includes("A")) return circleLines([x, y], parseFloat(outline));
    const spots = outline.split("L").map((spot) => spot.split(" ").map(parseFloat));
    const places = spots.map(([u, v]) => [c * u + s * v + x, c * v - s * u + y]);
    return places.slice(1).map((to, n) => [places[n], to]).concat(
      outline.endsWith("Z") ? [[places.at(-1), places[0]]] : [],
    );
  });
}

const CORNERS = 12; // of a circle as lines
/** A circle as lines around it. */
export function circleLines(/** @type {number[]} */ [x, y], radius) {
  const far = radius / Math.cos(Math.PI / CORNERS);
  const corners = Array.from({ length: CORNERS + 1 }, (_, k) => (2 * Math.PI * k) / CORNERS)
    .map((turn) => [x + far * Math.cos(turn), y + far * Math.sin(turn)]);
  return corners.slice(1).map((to, k) => [corners[k], to]);
}

export const isUnder = (mark) => mark.level === "guide" || mark.level === "ground"; // behind the links
