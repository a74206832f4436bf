// Reads the text of a scene from the fragment of a link, from a report or from a file.
const MARK = "#scene=", LARGEST = 4e6; // largest number of characters in a scene
const OTHERS = /\.(pmks|linkage2|json|dxf)$/i; // names of files of other programs

const flow = (bytes, through) => new Blob([bytes]).stream().pipeThrough(through);

// Returns the link fragment that contains a text. The text is compressed and encoded in URL characters.
export async function fragment(text) {
  const bytes = new Uint8Array(await new Response(flow(text, new CompressionStream("deflate"))).arrayBuffer());
  let letters = "";
  for (const byte of bytes) letters += String.fromCharCode(byte);
  return MARK + btoa(letters).replaceAll("+", "-").replaceAll("/", "_").replaceAll("=", "");
}

// Returns the text in a link, or null if the link contains no text.
export async function linked(link) {
  const letters = link.split(MARK)[1]?.trim();
  if (!letters) return null;
  const bytes = Uint8Array.from(atob(letters.replaceAll("-", "+").replaceAll("_", "/")), (each) => each.charCodeAt(0));
  const reader = flow(bytes, new DecompressionStream("deflate")).pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  for (let part = await reader.read(); !part.done; part = await reader.read()) {
    text += part.value;
    if (text.length > LARGEST) throw new Error("too large for a scene");
  }
  return text;
}

// Returns the text of a scene file, or the text of the scene in a report.
export function carried(content, name = "") {
  if (OTHERS.test(name)) {
    throw new Error(`${name} is of another program, "deflection-report --import ${name}" writes its scene`);
  }
  if (!/^\s*<!doctype html/i.test(content)) return content;
  const data = new DOMParser().parseFromString(content, "text/html").getElementById("scene");
  const { text } = JSON.parse(data?.textContent ?? "{}");
  if (!text) throw new Error("the page contains no scene");
  return text;
}
