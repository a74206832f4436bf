// Saves and downloads the scene, and loads the scene file again if it has changed on disk.
import * as talk from "./talk.js";
import * as text from "./text.js";
import { hush, keepInBrowser, notice } from "./notices.js";
import { changed } from "./requests.js";
import { make, state } from "./state.js";

export async function save() {
  const whole = text.text();
  if (state.path === null) return download();
  try {
    const reply = await talk.save(whole, state.digest);
    if (!reply.ok) {
      return notice(reply.problem, false, ["Take the file's text", () => follow(true)], ["Download mine", download]);
    }
    Object.assign(state, { digest: reply.digest, saved: whole });
    hush(true);
    keepInBrowser();
  } catch {
    keepInBrowser();
  }
}

export function download() {
  const href = URL.createObjectURL(new Blob([text.text()], { type: "text/plain" }));
  make("a", { href, download: `${state.name}.toml` }).click();
  setTimeout(() => URL.revokeObjectURL(href), 1000);
}

// Loads the text of the file. If the page has unsaved changes, asks the user first; with `forced`, does not ask.
export async function follow(forced = false) {
  const reply = await talk.scene();
  if (reply.problem) return notice(reply.problem);
  const before = text.text(), mine = before !== state.saved;
  if (reply.digest === "missing" && state.digest !== "missing") {
    state.saved = null;
    keepInBrowser();
    return notice("The file is gone from the disk; its text is still here, and Save writes it again.");
  }
  if (mine && !forced && reply.text !== before) {
    return notice("The file has changed on disk, and the text here is not saved.", false, [
      "Take the file's text",
      () => follow(true),
    ], ["Keep mine", () => hush(true)]);
  }
  Object.assign(state, { digest: reply.digest, saved: reply.text });
  if (reply.text === before) return keepInBrowser();
  await changed(reply.text);
  text.keep(before);
  hush(true);
}

export async function watch() {
  try {
    const { digest } = await talk.state();
    if (digest !== state.digest && digest !== state.reported && state.dragging === null) {
      state.reported = digest;
      await follow();
    }
  } catch { /* the listener of onReach reports that the server is gone */ }
  setTimeout(watch, window.kernel ? 5000 : 1000);
}
