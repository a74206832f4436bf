"""Live editor in a notebook. The server runs in a thread of the kernel, and a frame shows the page.

If the kernel is on another computer, the browser cannot reach the server. A widget can then show the page. The widget
sends its requests as notebook messages.
"""

import secrets
import threading
import webbrowser
from contextlib import suppress
from functools import cached_property
from html import escape
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import Any
from weakref import finalize

from kinelast.scene.data import Scene
from kinelast.scene.document import Document, document_from_text
from kinelast.scene.text import reader_in
from live.file import SceneFile
from live.server import WEB, Live, LiveServer, bound_socket, page_file, response_to, scene_file

FRAME = "width:100%;height:60em;border:1px solid #ccd"
ELSEWHERE = (
    "If the frame stays empty, this browser cannot reach the kernel's computer: display <code>.widget</code> instead."
)
MODULES = ("state", "text", "talk", "symbols", "placing", "view", "links", "drawing", "share", "graph", "places",
           "toolbar", "tools", "notices", "shown", "requests", "parts", "inspector", "numbers", "choosing", "file",
           "handing", "main")  # fmt: skip
"""Scripts of the page. Each script follows the scripts that it imports."""
PAGE = "page.html", "live.css", *(f"{name}.js" for name in MODULES)


class LiveView:
    """Editor of a scene in a notebook. It gives access to the last saved text and scene.

    Attributes
    ----------
    address
        Address of the page, including its token.
    """

    def __init__(self, given: Scene | Document | str | Path | None) -> None:
        if isinstance(given, Scene | Document):
            text = given.text if isinstance(given, Scene) else given.text()
            if not text:
                raise ValueError("the scene was built from tables and has no text: open it from a file")
            folder = mkdtemp(prefix="kinelast-")
            finalize(self, rmtree, folder, ignore_errors=True)
            self._file = SceneFile(Path(folder) / f"{given.name}.toml", text)
            self.name = given.name
        else:
            self._file, self.name = scene_file(None if given is None else str(given))
        bound = bound_socket(str(self._file.path))
        live = Live(self._file, self.name, secrets.token_urlsafe(24), bound.getsockname()[1], framed=True)
        live.worker.begin()
        self._live = live
        self.address = live.address
        self._server = LiveServer(live)
        self._thread = threading.Thread(target=self._server.run, kwargs={"sockets": [bound]}, daemon=True)
        self._thread.start()

    @property
    def text(self) -> str:
        """Last saved text. If no text has been saved, the initial text."""
        return self._file.read()[0]

    @property
    def scene(self) -> Scene:
        """Scene of `text`. Raises SceneError if the text is invalid."""
        return document_from_text(self.text, self.name, read=reader_in(self._file.folder)).scene

    @cached_property
    def widget(self) -> Any:
        """Editor as a widget, for a kernel on another computer. Slightly slower than the frame.

        Raises ModuleNotFoundError if anywidget is not installed.
        """
        try:
            return widget_of(self._live)
        except ModuleNotFoundError as error:
            missing = f'the widget needs {error.name}: pip install "anywidget"'
            raise ModuleNotFoundError(missing, name=error.name) from None

    def wait(self, browse: bool = True) -> None:
        """Keep a script running until it is interrupted or the server has stopped. If `browse`, first open the page."""
        if browse:
            webbrowser.open(self.address)
        with suppress(KeyboardInterrupt):
            self._thread.join()

    def close(self) -> None:
        """Stop the server. The browser keeps text that is not saved."""
        self._server.should_exit = True
        self._thread.join()

    def __repr__(self) -> str:
        return f'LiveView("{self.name}": {self.address})'

    def _repr_html_(self) -> str:
        """Return a frame with the page, and a link. The browser and the kernel must be on the same computer."""
        address = escape(self.address)
        link = f'<a href="{address}" target="_blank" rel="noopener">{escape(self.name)} in a separate window</a>'
        frame = f'<iframe src="{address}" style="{FRAME}" title="{escape(self.name)}"></iframe>'
        return f"{frame}<p>{link}. {ELSEWHERE}</p>"


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
        """Page of the editor. The browser gets the files, the name of the scene, and the address of the server."""

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
