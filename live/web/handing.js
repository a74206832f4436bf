// Opens scenes from other sources, and creates links that contain this scene.
import * as share from "./share.js";
import * as text from "./text.js";
import { fit, view } from "./view.js";
import { hush, notice } from "./notices.js";
import { changed } from "./requests.js";
import { show } from "./shown.js";
import { $, make, state } from "./state.js";

async function copyLink() {
  const link = state.opens + (await share.fragment(text.text()));
  const how = "opens by a click as long as this editor runs; in any other editor, paste it on the page";
  try {
    await navigator.clipboard.writeText(link);
    notice(`The link is copied. It ${how}.`, true);
  } catch {
    const field = make("input", { type: "text", value: link, readOnly: true, size: 30 });
    field.setAttribute("aria-label", "Link to this scene");
    notice(`Copy this link. It ${how}. `, true);
    $("notice").append(field);
    field.select();
  }
}

// Opens a scene from another source. If the drawing is not empty, asks the user first.
async function offer(found) {
  try {
    const whole = await found, before = text.text();
    if (whole === null || whole === before) return;
    const get = () => replaceBy(whole, before);
    if (view.sheet?.empty) return await get();
    notice("A scene was handed to this page.", false, ["Take it", get], ["Leave it", () => hush(true)]);
  } catch (error) {
    notice(`No scene could be read there: ${error.message}.`, true);
  }
}
export async function replaceBy(whole, before = text.text()) {
  Object.assign(view, { picture: null, position: 0 });
  await changed(whole);
  text.keep(before);
  fit();
  show();
}
export function takeFragment() {
  if (!location.hash) return;
  const { hash, pathname } = location;
  history.replaceState(null, "", pathname);
  offer(share.linked(hash));
}
export function wireShare() {
  $("share").onclick = copyLink;
  window.addEventListener("hashchange", takeFragment);
  document.addEventListener("paste", (event) => {
    const link = event.clipboardData?.getData("text") ?? "";
    if (!link.includes("#scene=")) return;
    event.preventDefault();
    offer(share.linked(link));
  });
  document.addEventListener("dragover", (event) => event.preventDefault());
  document.addEventListener("drop", (event) => {
    const file = event.dataTransfer?.files[0];
    if (!file) return;
    event.preventDefault();
    offer(file.text().then((content) => share.carried(content, file.name)));
  });
}
