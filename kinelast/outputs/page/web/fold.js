// Sections below the answer are folded. A heading or a link to a section opens it, and a button opens all sections.
function foldAll(parts) {
  for (const part of parts) {
    const [heading, ...rest] = part.children;
    part.append(h("details.fold", h("summary", heading), rest));
  }
  const folds = parts.map((part) => part.firstElementChild);
  const openOrFold = () => {
    const open = folds.some((fold) => !fold.open);
    for (const fold of folds) fold.open = open;
  };
  document.querySelector("nav").append(button("Open or fold all", openOrFold, { id: "unfold" }));
  const follow = () => unfold(decodeURIComponent(location.hash.slice(1)));
  document.addEventListener(
    "click",
    (event) => unfold(/** @type {any} */ (event.target).closest?.("a[href^='#']")?.hash.slice(1)),
  );
  addEventListener("hashchange", follow);
  follow();
}

// Folded sections are opened for searching, linking and printing.
function unfold(id) {
  const fold = id && $(id)?.querySelector(":scope > .fold");
  if (fold) fold.open = true;
}
