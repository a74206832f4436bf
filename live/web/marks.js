// Symbols and points of the drawing or of the moving scene.
import { isUnder, markAttributes, markLines } from "./symbols.js";
import { fill } from "./layers.js";
import { enlarged, pairAt as pair, toScreen, view } from "./view.js";

const NEAR_UNIT = 8.5; // [pixels] size of a symbol

// Draw the marks of the moving scene, or of its tables if it cannot move, and return their lines.
export function symbols(sheet, place, live, picture, i) {
  const local = ({ link, local: [x, y] }) => {
    const [ox, oy] = pair("origin", link, i), [c, s] = pair("direction", link, i), [u, v] = pair("shift", link, i);
    const arm = [c * x - s * y, s * x + c * y],
      { values, shape } = picture.arrays.angle,
      turn = values[link * shape[1] + i];
    return enlarged([ox + arm[0], oy + arm[1]], [u - turn * arm[1], v + turn * arm[0]]);
  };
  const way = ({ spin, axis }) => {
    if (live && spin !== null) return pair("spin", spin, i);
    if (!axis) return [1, 0];
    const [c, s] = live ? pair("direction", axis.link, i) : [1, 0], [x, y] = axis.way;
    return [c * x - s * y, s * x + c * y];
  };
  const frame = {
    scale: view.scale,
    unit: NEAR_UNIT,
    at: (spot) => {
      const spotPlace = spot.point ? place(spot.point) : local(spot);
      return spotPlace && toScreen(spotPlace);
    },
    way,
    mirrored: (drive) => live && picture.arrays.rate.values[drive * picture.positions + i] < 0,
    colour: () => "var(--ink)",
  };
  const path = (mark, more = {}) => ["path", { ...markAttributes(mark, frame), ...more }];
  const marks = [...(live ? picture.marks : sheet.marks ?? []), ...sheet.discs];
  const under = marks.filter(isUnder).map((mark) => path(mark));
  const over = marks.filter((mark) => !isUnder(mark)).map((mark) => path(mark));
  fill("under", under);
  fill("symbols", over);
  const pins = sheet.pins.filter(({ at }) => place(at.point)),
    chosen = view.chosen?.kind === "point" && view.chosen.name;
  const points = pins.map((mark) => {
    const name = mark.at.point, kind = `mark ${mark.kind}${mark.kind === "pin" ? "" : " pin"}`;
    return path(mark, { "data-point": name, class: name === chosen ? `${kind} picked` : kind });
  });
  fill("pins", points);
  return [...under, ...over, ...points].flatMap(([, attributes]) => markLines(attributes));
}
