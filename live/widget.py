"""Live editor as a widget. Requests are notebook messages, so that the kernel can be on another computer."""

import threading
from typing import Any

from live.server import WEB, Live, page_file, response_to

MODULES = ("state", "text", "talk", "symbols", "placing", "view", "layers", "links", "marks", "drawing", "share",
           "graph", "places", "toolbar", "tools", "notices", "shown", "requests", "parts", "entries", "inspector",
           "numbers", "choosing", "file", "handing", "main")  # fmt: skip
"""Scripts of the page. Each script comes after the scripts that it imports."""
PAGE = "page.html", "live.css", *(f"{name}.js" for name in MODULES)


def widget_of(live: Live) -> Any:
    """Return the widget of an editor.

    Raises
    ------
    ModuleNotFoundError
        anywidget is not installed.
    """
    import anywidget
    import traitlets

    class EditorWidget(anywidget.AnyWidget):  # type: ignore[misc, unused-ignore]
        """Page of the editor: files, name of the scene, and address on the kernel's computer."""

        _esm = (WEB / "widget.js").read_text(encoding="utf-8")
        files = traitlets.Dict().tag(sync=True)
        name = traitlets.Unicode().tag(sync=True)
        address = traitlets.Unicode().tag(sync=True)

    files = {name: page_file(name).read_text(encoding="utf-8") for name in PAGE}
    editor = EditorWidget(files=files, name=live.name, address=live.address)

    def answer(content: dict[str, Any]) -> None:
        response = response_to(live, str(content["path"]), content["given"])
        editor.send({"number": content["number"], "status": response.status_code}, [bytes(response.body)])

    def listen(_: Any, content: dict[str, Any], buffers: Any) -> None:
        threading.Thread(target=answer, args=(content,), daemon=True).start()

    editor.on_msg(listen)
    return editor
