// Layers of the drawing, from back to front, and the marks in them.
const svg = document.getElementById("svg"), NS = "http://www.w3.org/2000/svg";
const NAMES = "grid trace paths under chosen drawn rigid last bent symbols names sizes guides pins";
const layers = Object.fromEntries(
  NAMES.split(" ").map((name) => {
    const layer = document.createElementNS(NS, "g");
    layer.setAttribute("class", name === "grid" ? "grid" : "");
    layer.id = `layer-${name}`;
    svg.append(layer);
    return [name, layer];
  }),
);

// Draws the marks of a layer. If their number is unchanged, the elements are reused and only attributes are updated.
export function fill(name, marks) {
  const layer = layers[name];
  while (layer.childNodes.length > marks.length) layer.lastChild.remove();
  marks.forEach(([tag, attributes, words], k) => {
    let node = layer.children[k];
    if (!node || node.tagName !== tag) {
      const fresh = document.createElementNS(NS, tag);
      if (node) node.replaceWith(fresh);
      else layer.append(fresh);
      node = fresh;
    }
    for (const attribute of [...node.attributes]) {
      if (!(attribute.name in attributes)) node.removeAttribute(attribute.name);
    }
    for (const [key, value] of Object.entries(attributes)) {
      if (node.getAttribute(key) !== String(value)) node.setAttribute(key, value);
    }
    if (words !== undefined && node.textContent !== words) node.textContent = words;
  });
}
