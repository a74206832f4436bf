"""Server of the live editor on the loopback address.

It serves the page, the answers (results for a text, see `live.answer`) and one file. Each request needs a token.
"""

import json
import math
import os
import secrets
import socket
import struct
import threading
import webbrowser
from collections import OrderedDict
from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field
from hashlib import sha256
from importlib.resources import files
from pathlib import Path
from typing import Any

import uvicorn
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request
from starlette.responses import JSONResponse, Response
from starlette.routing import Route

from kinelast.scene.library import library_entries
from kinelast.scene.parts import PARTS
from kinelast.scene.text import PAGES, file_text
from kinelast.tasks.task import foreign_words, shipped_scenes
from kinelast.values.error import MissingFileError, SceneError
from live.answer import Memory, quick_answer
from live.drives import MOTIONS
from live.edit import EMPTY, edited
from live.entries import keys
from live.file import ChangedError, SceneFile
from live.full import Worker
from live.parts import EditError
from live.share import LANDING, MARK, POLICY, linked

HOST = "127.0.0.1"
FIRST_PORT, PORTS = 49152, 16000
MAX_REQUEST = 4_000_000  # [bytes]
MAX_REPORTS = 4  # maximum number of report pages that the server keeps
WEB, PAGE = files("live") / "web", files("kinelast.outputs.page") / "web"
SHARED = ("placing.js", "symbols.js")  # scripts of the report that the editor also uses
KINDS = {"html": "text/html", "css": "text/css", "js": "text/javascript"}
SAFE = {"Cache-Control": "no-store", "Referrer-Policy": "no-referrer", "X-Content-Type-Options": "nosniff"}
NOTEBOOKS = "http://localhost:* http://127.0.0.1:* https://localhost:* https://127.0.0.1:* vscode-webview: vscode-file:"
PAGE_POLICY = "default-src 'none'; script-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' blob: data:; connect-src 'self'; base-uri 'none'; form-action 'none'"  # noqa: E501


@dataclass
class Live:
    """State of the server: file, address, worker, last motion and last reports.

    If `framed`, notebooks on this computer may show the page in a frame.
    """

    file: SceneFile
    name: str
    token: str
    port: int
    framed: bool = False
    worker: Worker = field(default_factory=Worker)
    memory: Memory = field(default_factory=Memory)
    reports: OrderedDict[str, bytes] = field(default_factory=OrderedDict)

    @property
    def hosts(self) -> tuple[str, str]:
        """Host names that are allowed in requests."""
        return f"{HOST}:{self.port}", f"localhost:{self.port}"

    @property
    def address(self) -> str:
        """Address of the page."""
        return f"http://{HOST}:{self.port}/{self.token}/"


def refusal(live: Live, request: Request) -> Response | None:
    """Return an error response for an unauthorised request, otherwise None."""
    if request.headers.get("host") not in live.hosts:
        return Response("this is not the address of the editor", 403)
    token = str(request.path_params.get("token", ""))
    if not secrets.compare_digest(token.encode(), live.token.encode()):
        return Response("the token in the address is missing or wrong: use the address that the command printed", 403)
    if request.method != "GET" and request.headers.get("origin") not in [f"http://{host}" for host in live.hosts]:
        return Response("the request comes from another page", 403)
    return None


Handler = Callable[[Live, Request, Any], Response]


def _authorised(live: Live, handler: Handler) -> Callable[[Request], Any]:
    """Return a function that checks a request, parses the JSON content, and runs the handler in a thread."""

    async def respond(request: Request) -> Response:
        refused = refusal(live, request)
        if refused is not None:
            return refused
        given: Any = {}
        if request.method == "POST":
            if int(request.headers.get("content-length") or MAX_REQUEST + 1) > MAX_REQUEST:
                return Response("too large for a scene", 413)
            try:
                given = json.loads(await request.body())
                given["text"] = str(given.get("text", ""))
            except (ValueError, AttributeError, TypeError):
                return Response("expected JSON", 400)
        try:
            response = await run_in_threadpool(handler, live, request, given)
        except Exception as error:
            response = Response(f"the program failed, please report this: {error!r}", 500)
        response.headers.update(SAFE if live.framed else {**SAFE, "X-Frame-Options": "DENY"})
        return response

    return respond


def _page(live: Live, request: Request, given: Any) -> Response:
    return _web("page.html", f"; frame-ancestors {NOTEBOOKS}" if live.framed else "; frame-ancestors 'none'")


def _file_of_page(live: Live, request: Request, given: Any) -> Response:
    return _web(str(request.path_params["name"]))


def page_file(name: str) -> Any:
    """Return a file of the page by name, or None if there is no such file. The report page also uses some files."""
    folder = PAGE if name in SHARED else WEB
    return next((each for each in folder.iterdir() if each.name == name), None)


def _web(name: str, ancestors: str = "") -> Response:
    file = page_file(name)
    if file is None:
        return Response("there is no such file", 404)
    content = file.read_bytes()
    kind = KINDS[name.rpartition(".")[2]]
    return Response(content, media_type=kind, headers={"Content-Security-Policy": PAGE_POLICY + ancestors})


def _scene(live: Live, request: Request, given: Any) -> Response:
    """Return the text of the scene file and the initial data of the page."""
    try:
        text, digest = live.file.read()
    except SceneError as error:
        return JSONResponse({"problem": str(error)}, 409)
    shipped = {name: path.read_text(encoding="utf-8") for name, path in shipped_scenes().items()}
    return JSONResponse(
        {
            "text": text,
            "digest": digest,
            "name": live.name,
            "path": None if live.file.path is None else str(live.file.path),
            "shipped": {"empty sheet": EMPTY, **shipped},
            "sections": [name for name, _ in library_entries("sections")],
            "materials": [name for name, _ in library_entries("materials")],
            "keys": keys(),
            "parts": {part.key: part.menu for part in PARTS if part.menu},
            "opens": f"http://{HOST}:{live.port or preferred_port('None')}/",
            "motions": MOTIONS,
        }
    )


def _state(live: Live, request: Request, given: Any) -> Response:
    return JSONResponse({"digest": live.file.digest()})


def _answer(live: Live, request: Request, given: Any) -> Response:
    """Apply edits to a text and return the quick answer for the result. Cancel the running full answer, if any."""
    text, changes = given["text"], given.get("edits", ())
    live.worker.cancel()
    reply: dict[str, Any] = {"number": given.get("number"), "refused": ""}
    try:
        for change in changes:
            text = edited(text, change, live.file.folder)
    except (EditError, ValueError) as error:
        text, reply["refused"] = given["text"], str(error)
    options = bool(given.get("numbers")), bool(given.get("dragged"))
    answer, data = quick_answer(text, live.name, *options, live.memory, live.file.folder, str(given.get("graph") or ""))
    return Response(packed({**answer, **reply, "text": text}, data), media_type="application/octet-stream")


def packed(answer: dict[str, Any], data: bytes) -> bytes:
    """Return an answer as bytes: length of the JSON text, JSON text, array data.

    Blanks at the end make the length of the JSON text a multiple of four bytes.
    """
    head = json.dumps(_finite(answer), allow_nan=False).encode()
    head += b" " * (-len(head) % 4)
    return struct.pack("<I", len(head)) + head + data


def _finite(value: Any) -> Any:
    """Convert a value to JSON types. Replace nan and inf by None, because JSON has no such numbers."""
    if isinstance(value, float) and not math.isfinite(value):
        return None
    if isinstance(value, dict):
        return {str(key): _finite(each) for key, each in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(each) for each in value]
    return value if isinstance(value, str | int | float | bool | None) else str(value)


def _full(live: Live, request: Request, given: Any) -> Response:
    """Return the full answer for a text. The status is 204 (no content) if a newer request cancels the computation."""
    result = live.worker.answer(given["text"], live.name, live.file.folder)
    if result is None:
        return Response(status_code=204)
    answer, data, report = result
    key = None
    if report:
        key = secrets.token_urlsafe(6)
        live.reports[key] = report
        while len(live.reports) > MAX_REPORTS:
            live.reports.popitem(last=False)
    reply = {**answer, "number": given.get("number"), "report": key}
    return Response(packed(reply, data), media_type="application/octet-stream")


def _report(live: Live, request: Request, given: Any) -> Response:
    report = live.reports.get(str(request.path_params["key"]))
    if report is None:
        return Response("this report is no longer available: compute the full answer again", 404)
    from kinelast.outputs.page import report_policy

    return Response(report, media_type="text/html", headers={"Content-Security-Policy": report_policy()})


def _save(live: Live, request: Request, given: Any) -> Response:
    """Save the text to the file."""
    try:
        return JSONResponse({"digest": live.file.write(given["text"], str(given.get("digest")))})
    except ChangedError as error:
        return JSONResponse({"problem": str(error), "digest": live.file.digest()}, 409)
    except OSError as error:
        return JSONResponse({"problem": f"not written: {(error.strerror or str(error)).lower()}"}, 507)


READ: Mapping[str, Handler] = {"scene": _scene, "state": _state}
SENT: Mapping[str, Handler] = {"answer": _answer, "full": _full, "save": _save}  # requests that contain a text
HANDLERS: Mapping[str, Handler] = {**READ, **SENT, "report": _report}


def response_to(live: Live, path: str, given: Any) -> Response:
    """Return the response to a request that a widget sends as a notebook message."""
    name, _, key = path.partition("/")
    handler = HANDLERS.get(name)
    if handler is None:
        return Response("there is no such request", 404)
    request = Request({"type": "http", "path_params": {"key": key}})
    try:
        return handler(live, request, {**given, "text": str(given.get("text", ""))})
    except Exception as error:
        return Response(f"the program failed, please report this: {error!r}", 500)


def application(live: Live) -> Starlette:
    """Return the web application of the editor."""
    paths = {"": _page, "web/{name}": _file_of_page, "report/{key}": _report, **READ, **SENT}

    async def landing(request: Request) -> Response:
        if request.headers.get("host") not in live.hosts:
            return Response("this is not the address of the editor", 403)
        return Response(LANDING, media_type="text/html", headers={**SAFE, "Content-Security-Policy": POLICY})

    routes = [Route("/", landing)]
    for path, handler in paths.items():
        method = "POST" if path in SENT else "GET"
        routes.append(Route(f"/{{token}}/{path}", _authorised(live, handler), methods=[method]))
    return Starlette(routes=routes)


def scene_file(argument: str | None) -> tuple[SceneFile, str]:
    """Return the scene file and the name of the scene for a command-line argument.

    The file need not exist. The file of a shipped scene is a new file in the working folder. A new scene, and a scene
    from a report or web link, have no file.
    """
    if argument is None:
        return SceneFile(None, EMPTY), "scene"
    if MARK in argument:
        return SceneFile(None, linked(argument)), "scene"
    shipped = shipped_scenes()
    path = Path(argument)
    if path.suffix in PAGES and path.is_file():
        return SceneFile(None, file_text(path)), path.stem
    if argument in shipped and not path.is_file():
        text = shipped[argument].read_text(encoding="utf-8")
        return SceneFile(Path.cwd() / f"{argument}.toml", text), argument
    if path.suffix != ".toml" or not path.absolute().parent.is_dir():
        expected = "expected a .toml file (which need not exist), a report, or a shipped scene, see --list"
        raise MissingFileError(argument, "", "", foreign_words(argument) or expected)
    return SceneFile(path.absolute(), EMPTY), path.stem


def preferred_port(name: str) -> int:
    """Return the preferred port for a file, which depends only on the name of the file."""
    return FIRST_PORT + int(sha256(name.encode()).hexdigest(), 16) % PORTS


def bound_socket(name: str) -> socket.socket:
    """Return a listening socket on the loopback address, if possible with the preferred port of the file `name`.

    With the same port, the page finds the text that the browser stored earlier.
    """
    for port in (preferred_port(name), 0):
        bound = socket.socket(
            socket.AF_INET, socket.SOCK_STREAM, socket.IPPROTO_TCP
        )  # without an explicit protocol, asyncio does not set TCP_NODELAY
        bound.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, os.name != "nt")
        try:
            bound.bind((HOST, port))
            bound.listen(64)  # requests may arrive before the server runs
        except OSError:
            bound.close()
            if port == 0:
                raise
        else:
            return bound
    raise AssertionError


class LiveServer(uvicorn.Server):
    """Web server of an editor."""

    def __init__(self, live: Live) -> None:
        config = uvicorn.Config(
            application(live), log_level="critical", access_log=False, lifespan="off", timeout_graceful_shutdown=1
        )
        super().__init__(config)
        self._live = live

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Cancel the running full answer, and shut down."""
        self._live.worker.cancel()
        await super().shutdown(sockets)


def serve(argument: str | None, tell: Callable[[str], None], browse: bool = True) -> int:
    """Serve the editor until interrupted; return the exit status.

    Parameters
    ----------
    argument
        File, web link, or name of a shipped scene; None for a new scene.
    tell
        Function that prints a text to the terminal.
    browse
        Whether to open the page in a browser.
    """
    file, name = scene_file(argument)
    bound = bound_socket(str(file.path))
    live = Live(file, name, secrets.token_urlsafe(24), bound.getsockname()[1])
    live.worker.begin()
    where = "save the scene by download" if file.path is None else f"Save writes {file.path}"
    tell(f"{name}: {live.address}\n{where}; Ctrl+C ends it")
    if live.port != (usual := preferred_port(str(file.path))):
        tell(f"The usual port {usual} is in use. Text that the browser stored at the usual address is not shown.")
    if browse:
        threading.Timer(0.3, webbrowser.open, [live.address]).start()
    with bound, suppress(KeyboardInterrupt):
        LiveServer(live).run(sockets=[bound])
    return 0
