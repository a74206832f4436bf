// The instant that is shown by all parts of the page, and its animation.
const instant = { position: 0, listeners: [], playing: null, stopped: () => {} };

function showPosition(i) {
  const wrapped = ((Math.round(i) % N) + N) % N;
  if (wrapped === instant.position && instant.shown) return;
  instant.position = wrapped;
  instant.shown = true;
  for (const listener of instant.listeners) listener(wrapped);
}
const follow = (listener) => instant.listeners.push(listener);

function play(seconds) {
  stop();
  const begin = performance.now(), from = instant.position;
  const step = (now) => {
    showPosition(from + (((now - begin) / 1000) * N) / seconds());
    instant.playing = requestAnimationFrame(step);
  };
  instant.playing = requestAnimationFrame(step);
}

function stop() {
  if (instant.playing !== null) cancelAnimationFrame(instant.playing);
  instant.playing = null;
  instant.stopped();
}
