// Requests for the results of a text: quick answers, edits in sequence, and full answers.
import * as talk from "./talk.js";
import * as text from "./text.js";
import { rescale, view } from "./view.js";
import { hush, keepInBrowser, notice } from "./notices.js";
import { show, theoryWords } from "./shown.js";
import { $, make, state } from "./state.js";

// Callbacks after a quick answer and after an edit. main.js sets them.
export const listeners = { answered: (_answer, _job) => {}, edited: (_change) => {} };

export function ask(job) {
  return new Promise((resolve) =>
    talk.quick({
      ...job,
      done: (answer) => {
        take(answer, job);
        resolve(answer);
      },
      failed: (words) => {
        if (words) notice(words);
        resolve(null);
      },
    })
  );
}

export function take(answer, job) {
  if (answer.refused) notice(answer.refused, true);
  else if (!job.drag) hush();
  const began = performance.now();
  if (!job.typed) text.show(answer.text, Boolean(job.edits?.length));
  text.tellMistakes(answer.mistakes);
  if (answer.sheet) {
    view.sheet = answer.sheet;
    state.tables = answer.sheet.tables ?? state.tables;
  }
  $("empty").hidden = !view.sheet?.empty;
  if (view.sheet?.empty) view.picture = null;
  if (answer.picture) {
    view.picture = answer.picture;
    view.stale = false;
  } else view.stale = Boolean(view.picture);
  if (answer.numbers) state.numbers = answer.numbers;
  if (!job.drag && answer.picture) rescale();
  listeners.answered(answer, job);
  if (view.picture) view.position = Math.min(view.position, view.picture.positions - 1);
  show();
  keepInBrowser();
  if (job.stamp) state.drawing.push(performance.now() - began);
  if (job.stamp) {
    requestAnimationFrame(() => {
      const channel = new MessageChannel();
      channel.port1.onmessage = () => state.latencies.push(performance.now() - job.stamp);
      channel.port2.postMessage(0);
    });
  }
}

// Sends edits one after the other: each starts from the text that the previous edit returned. Then requests a full
// answer. A drag does not use this function.
export function edit(...edits) {
  return (state.queue = state.queue.then(async () => {
    const before = text.text(), answer = await ask({ text: before, edits, numbers: true });
    if (answer && !answer.refused) {
      text.keep(before);
      listeners.edited(edits.at(-1));
      settle();
    }
  }));
}

export function changed(whole, typed = false) {
  return ask({ text: whole, numbers: true, typed }).then((answer) => answer && settle());
}

let timer = 0;
export function settle(wait = 150) {
  clearTimeout(timer);
  $("report").hidden = true;
  $("line").textContent = "";
  timer = setTimeout(() => {
    if (!view.picture || view.stale || !view.picture.closes.all) return;
    $("theory").textContent = `${theoryWords(view.picture)}; the whole answer is on its way …`;
    const asked = text.text();
    talk.full(asked, (answer) => {
      if (asked !== text.text()) return;
      if (!answer.picture) {
        $("theory").textContent = theoryWords(view.picture);
        $("line").textContent = answer.mistakes.map(({ message }) => message).join("; ");
        return;
      }
      const { position, picture } = view;
      view.picture = answer.picture;
      view.position = Math.round((position / Math.max(1, picture.positions)) * answer.picture.positions);
      rescale();
      show();
      const [verdict, ...rest] = answer.line.split(/(?=; )/);
      $("line").replaceChildren(picture.limits.length ? make("b", {}, verdict) : verdict, ...rest);
      $("report").href = `report/${answer.report}`;
      $("report").hidden = !answer.report;
      state.whole++;
    });
  }, wait);
}
