// What scrolls can be reached and scrolled by keys, and what the theme leaves without a name gets one: the theme makes
// the boxes around tables and the buttons of code when the page has come.
function reachable() {
  for (const box of document.querySelectorAll(".md-typeset__scrollwrap, .md-typeset table, pre > code, .formula")) {
    if (box.scrollWidth > box.clientWidth && !box.hasAttribute("tabindex")) box.tabIndex = 0;
  }
  for (const nav of document.querySelectorAll(".md-nav[aria-labelledby]")) {
    if (!document.getElementById(nav.getAttribute("aria-labelledby"))?.textContent.trim()) {
      nav.removeAttribute("aria-labelledby"); // of a section with a page of its own
      nav.setAttribute("aria-label", nav.closest("li").querySelector("a").textContent.trim());
    }
  }
  document.querySelectorAll(".md-code__nav").forEach((nav, k) => nav.setAttribute("aria-label", `Code ${k + 1}`));
}
addEventListener("load", () => {
  reachable();
  new MutationObserver(reachable).observe(document.body, { childList: true, subtree: true });
});
addEventListener("resize", reachable);
