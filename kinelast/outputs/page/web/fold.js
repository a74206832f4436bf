// Sections below the answer are folded: a heading opens one, a link to it too, a button all of them.
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

// What is folded is found, linked to and printed once it is open.
function unfold(id) {
  const fold = id && $(id)?.querySelector(":scope > .fold");
  if (fold) fold.open = true;
}
