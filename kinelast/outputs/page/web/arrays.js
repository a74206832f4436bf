// The arrays stored in a page: rows of `count` values, first of float64 and then of float32. Constant rows are stored once.
function bytesOf(id) {
  const text = atob($(id).textContent.trim());
  const bytes = new Uint8Array(text.length);
  for (let k = 0; k < text.length; k++) bytes[k] = text.charCodeAt(k);
  return bytes;
}

async function inflated(id) {
  const stream = new Blob([bytesOf(id)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

// All arrays. The last axis is the count; vectors are stored as x, y, x, y.
function unpacked(places, count) {
  const bytes = bytesOf("numbers").buffer, found = {}, at = { d: 0, f: 0 };
  const doubles = Object.values(places).filter(([kind]) => kind === "d").flatMap(([, , , same]) => same);
  const middle = 8 * count * doubles.filter((value) => value === null).length;
  const rows = { d: new Float64Array(bytes, 0, middle / 8), f: new Float32Array(bytes, middle) };
  for (const [name, [kind, shape, vectors, same]] of Object.entries(places)) {
    const values = new Float64Array(same.length * count), parts = vectors ? 2 : 1;
    same.forEach((value, r) => {
      const from = Math.floor(r / parts) * parts * count + (r % parts);
      for (let i = 0; i < count; i++) values[from + parts * i] = value === null ? rows[kind][at[kind] + i] : value;
      if (value === null) at[kind] += count;
    });
    found[name] = { values, shape };
  }
  return found;
}
