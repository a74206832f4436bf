// The tools: their buttons, keys and hints.
import { $, make } from "./state.js";
export const TOOLS = [
  ["move", "Move", "v", "Drag a point to change the mechanism, a link to move it; arrows move the chosen point"],
  ["link", "Link", "l", "Drag from point to point, or click twice; a click on nothing makes the point"],
  ["fix", "Support", "g", "Click a point to stand it on the ground; once more frees it"],
  [
    "drive",
    "Drive",
    "d",
    "Click a link to turn it about its pin, or a point to push it along its slot; once more takes the drive away",
  ],
  ["load", "Force", "f", "Drag from the point where a force acts: 1 N to a pixel"],
  ["plate", "Plate", "p", "Click the points of a plate, and the first once more; Enter ends an open one"],
  ["trace", "Trace", "t", "Click a link to put a point on it, or drag to a place beside it; on a point: a pin"],
  [
    "slot",
    "Slot",
    "s",
    "Click a point to let it slide in the link under it, or on the ground along x; drag from it for " +
    "another line; once more frees it",
  ],
  ["weld", "Weld", "w", "Click a point to join its links rigidly; once more pins them"],
  ["spring", "Spring", "k", "Drag from a point to another"],
  ["mass", "Mass", "m", "Click a point to give it a mass; once more takes it away"],
  ["cylinder", "Cylinder", "c", "Drag from its foot to the point that it pushes"],
  [
    "gear",
    "Gear",
    "r",
    "Click the link that drives, then the one that follows: wheels that mesh from outside; a point in a " +
    "slot is a rack; once more takes them away",
  ],
];
const FIRST = 5; // number of tools in the first group: a new user needs them first

export function fillToolbar(take, actions) {
  const buttons = TOOLS.map(([name, words, key, hint]) => {
    const button = make("button", { title: `${hint} (${key.toUpperCase()})`, onclick: () => take(name) }, words);
    button.dataset.tool = name;
    return button;
  });
  const act = (id, words, title) => make("button", { id, title, onclick: () => actions[id]() }, words);
  $("tools").replaceChildren(...buttons.slice(0, FIRST));
  $("moretools").replaceChildren(
    ...buttons.slice(FIRST),
    act("copy", "Copy", "The chosen link, or all links, once more beside"),
    act(
      "mirror",
      "Mirror",
      "The chosen link, or all links, once more across the upright line through the chosen point",
    ),
    act("delete", "Delete", "Take away the chosen part (Del)"),
  );
}

export function showTool(name) {
  /** @type {NodeListOf<HTMLElement>} */ (document.querySelectorAll("[data-tool]")).forEach((button) =>
    button.setAttribute("aria-pressed", String(button.dataset.tool === name))
  );
  $("hint").textContent = TOOLS.find(([each]) => each === name)[3];
}
