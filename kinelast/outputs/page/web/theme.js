// Dark or light theme, selected by preference or by a button; always light in print.
function theme(redraw = () => {}) {
  const dark = matchMedia("(prefers-color-scheme: dark)"), root = document.documentElement;
  const set = (name) => {
    root.dataset.theme = name;
    redraw();
  };
  root.dataset.theme = dark.matches ? "dark" : "light";
  const turn = () => set(root.dataset.theme === "dark" ? "light" : "dark");
  $("tools").append(button("◐", turn, { id: "theme", "aria-label": "dark or light page" }));
  dark.addEventListener("change", () => set(dark.matches ? "dark" : "light"));
  let before = null;
  addEventListener("beforeprint", () => {
    before = root.dataset.theme;
    set("light");
  });
  addEventListener("afterprint", () => {
    if (before) set(before);
    before = null;
  });
}
