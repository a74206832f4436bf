// Notices to the user, and the text that the browser stores.
import * as talk from "./talk.js";
import * as text from "./text.js";
import { $, make, state } from "./state.js";

export const KEY = () => `live ${state.path ?? state.name}`;
export function notice(words, passing = false, ...buttons) {
  const box = $("notice");
  box.replaceChildren(
    words,
    ...buttons.map(([textContent, act]) => {
      const onclick = () => {
        hush(true);
        act();
      };
      return make("button", { textContent, onclick });
    }),
  );
  box.hidden = false;
  box.dataset.passing = String(passing);
}
export function hush(all = false) {
  if (all || $("notice").dataset.passing === "true") $("notice").hidden = true;
}

export function keepInBrowser() {
  const dirty = text.text() !== state.saved;
  $("saved").textContent = !talk.reached
    ? "no server any more"
    : state.path === null
    ? "no file: download to keep"
    : dirty
    ? "not saved"
    : "saved";
  document.title = `${dirty ? "● " : ""}${state.name}`;
  try {
    if (dirty) localStorage.setItem(KEY(), text.text());
    else localStorage.removeItem(KEY());
  } catch { /* the browser does not allow storage */ }
}
