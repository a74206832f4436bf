// Requests to the server. Only one quick answer is computed at a time. Meanwhile, only the newest request waits. Each
// new request cancels the computation of a full answer.
let number = 0, shown = 0, busy = false, waiting = null, whole = null;
export let reached = true;
const listeners = new Set();
export const onReach = (listener) => listeners.add(listener);

function reach(now) {
  if (now === reached) return;
  reached = now;
  listeners.forEach((listener) => listener(now));
}

async function request(path, given, signal) {
  const options = given === undefined
    ? {}
    : { method: "POST", headers: { "Content-Type": "application/json" }, body: JSON.stringify(given) };
  try {
    // a widget sends the request as a message
    const response = await (window.kernel ? window.kernel(path, given) : fetch(path, { ...options, signal }));
    reach(true);
    return response;
  } catch (error) {
    if (error.name !== "AbortError") reach(false);
    throw error;
  }
}

// Unpacks a response: the length of the JSON text, the JSON text, and numbers. The JSON text contains the offset and
// shape of each array of numbers.
function unpacked(buffer) {
  const length = new DataView(buffer).getUint32(0, true);
  const answer = JSON.parse(new TextDecoder().decode(new Uint8Array(buffer, 4, length)));
  const { picture } = answer;
  if (picture) {
    for (const [name, [at, shape]] of Object.entries(picture.arrays)) {
      picture.arrays[name] = {
        shape,
        values: new Float32Array(buffer, 4 + length + 4 * at, shape.reduce((a, b) => a * b, 1)),
      };
    }
  }
  return answer;
}

export const scene = async () => (await request("scene")).json();
export const state = async () => (await request("state")).json();
export const report = async (path) => URL.createObjectURL(await (await request(path)).blob());
export const save = async (text, digest) => {
  const response = await request("save", { text, digest });
  return { ok: response.ok, ...(await response.json()) };
};

// Requests the quick answer for an edited text. Calls `done` with the answer if no newer answer has arrived before.
export function quick(job) {
  whole?.abort();
  job.number = ++number;
  waiting = job;
  if (!busy) next();
}

async function next() {
  const job = waiting;
  waiting = null;
  busy = true;
  try {
    const { text, edits = [], numbers = false, drag = false, graph, number } = job;
    const response = await request("answer", { text, edits, numbers, dragged: drag, graph, number });
    const content = response.ok ? await response.arrayBuffer() : await response.text();
    if (waiting) next();
    else busy = false; // the server computes the next answer while the page draws this one
    if (!response.ok) {
      job.failed?.(content);
      return;
    }
    const answer = unpacked(content);
    if (answer.number > shown) {
      shown = answer.number;
      job.done(answer);
    }
  } catch {
    if (waiting) next();
    else busy = false;
    job.failed?.("");
  }
}

export const quiet = () => !busy && !waiting;

// Requests the full answer for a text. If there is a newer request in the meantime, ignores the answer.
export async function full(text, done) {
  whole?.abort();
  const mine = (whole = new AbortController()), asked = number;
  try {
    const response = await request("full", { text, number: asked }, mine.signal);
    if (asked !== number) return;
    if (response.status === 204) {
      setTimeout(() => asked === number && mine === whole && full(text, done), 700);
      return;
    } // another window has cancelled the computation: try again
    if (!response.ok) return done({ picture: null, mistakes: [{ message: await response.text() }] });
    const answer = unpacked(await response.arrayBuffer());
    if (asked === number) done(answer);
  } catch { /* the request is cancelled, or the server is gone, which another notice reports */ }
}
