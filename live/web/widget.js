// The editor as a notebook widget: the page is in a frame without a URL, and requests are sent as messages.
const PATIENCE = 10_000; // [ms] waiting time before a message says that the kernel does not answer

function render({ model, el }) {
  const files = model.get("files"), addresses = {}, waiting = new Map(), mine = Math.random().toString(36).slice(2);
  let number = 0;
  // each script follows the scripts that it imports
  for (const name of Object.keys(files).filter((each) => each.endsWith(".js"))) {
    const code = files[name].replace(/from "\.\/(\w+\.js)"/g, (_, other) => `from "${addresses[other]}"`);
    addresses[name] = URL.createObjectURL(new Blob([code], { type: "text/javascript" }));
  }
  const listen = (message, buffers) => {
    const done = waiting.get(message.number);
    waiting.delete(message.number);
    done?.(new Response(buffers[0], { status: message.status }));
  };
  model.on("msg:custom", listen);
  const ask = (path, given) =>
    new Promise((done, failed) => {
      const key = `${mine} ${++number}`;
      waiting.set(key, done);
      if (path !== "full") {
        setTimeout(() => waiting.delete(key) && failed(new Error("the kernel does not answer")), 30_000);
      }
      model.send({ number: key, path, given: given ?? {} });
    });
  const frame = document.createElement("iframe");
  frame.title = model.get("name");
  frame.style.cssText = "width:100%;height:60em;border:1px solid #ccd";
  frame.srcdoc = files["page.html"].replace(/<link rel="stylesheet"[^>]*>/, () => `<style>${files["live.css"]}</style>`)
    .replace(/<script.*<\/script>/, "");
  const words = document.createElement("p"),
    elsewhere = `open ${model.get("address")} in a browser on the kernel's computer`,
    began = Date.now();
  words.setAttribute("role", "status");
  const blocked = () => {
    words.textContent = `This notebook keeps the editor's script from running: ${elsewhere}.`;
  };
  frame.onload = () => {
    frame.contentWindow.kernel = ask;
    const main = Object.assign(frame.contentDocument.createElement("script"), {
      type: "module",
      src: addresses["main.js"],
      onerror: blocked,
    });
    frame.contentDocument.body.append(main);
  };
  const look = setInterval(() => {
    if (frame.contentDocument?.body?.dataset.ready) {
      words.textContent = "";
      clearInterval(look);
    } else if (!words.textContent && Date.now() - began > PATIENCE) {
      words.textContent =
        "The kernel does not answer: the editor begins when the cell that runs has ended; if that kernel is " +
        `gone, run its cell again, or ${elsewhere}.`;
    }
  }, 500);
  el.append(frame, words);
  return () => {
    clearInterval(look);
    model.off("msg:custom", listen);
    Object.values(addresses).forEach((each) => URL.revokeObjectURL(each));
  };
}

export default { render };
