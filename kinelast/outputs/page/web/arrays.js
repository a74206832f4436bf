// The arrays stored in a page: rows of `count` values. Constant rows are stored once, and large arrays are compressed.
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

// The rows of all arrays as stored: one kind after the other, with bytes grouped by significance.
async function storedRows(places, count, packed) {
  const kinds = { d: Float64Array, f: Float32Array }, counts = { d: 0, f: 0 }, rows = {};
  for (const [kind, , , same] of Object.values(places)) {
    counts[kind] += count * same.filter((value) => value === null).length;
  }
  let bytes = packed ? await inflated("numbers") : bytesOf("numbers"), at = 0;
  for (const [kind, Kind] of Object.entries(kinds)) {
    const long = Kind.BYTES_PER_ELEMENT,
      total = counts[kind],
      own = packed ? new Uint8Array(long * total) : bytes.subarray(at, at + long * total);
    if (packed) {
      for (let plane = 0; plane < long; plane++) {
        for (let k = 0; k < total; k++) own[long * k + plane] = bytes[at + plane * total + k];
      }
    }
    rows[kind] = new Kind(own.buffer, own.byteOffset, total);
    at += long * total;
  }
  return rows;
}

// All arrays. The last axis is the count; vectors are stored as x, y, x, y.
async function unpacked({ arrays: places, packed }, count) {
  const rows = await storedRows(places, count, packed), at = { d: 0, f: 0 }, found = {};
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
