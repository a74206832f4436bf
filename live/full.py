"""The whole answer to a text, by the theory and accuracy that it asks for, in a process that can be ended."""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import Any


def whole_answer(text: str, name: str, folder: Path | None) -> tuple[dict[str, Any], bytes, bytes]:
    """The whole answer to a text, the numbers of its picture, and its report; files beside it are in the folder."""
    import numpy as np

    from kinelast import __version__
    from kinelast.figures.summary import summary
    from kinelast.outputs.batch import headline
    from kinelast.outputs.handout import handout
    from kinelast.outputs.page import report_page
    from kinelast.outputs.sealed import made_from
    from kinelast.runs import SHOWN, computed, is_long
    from kinelast.scene.document import document_from_text
    from kinelast.scene.text import beside
    from kinelast.tasks.request import Request
    from live.answer import whole_picture
    from live.mistakes import mistakes_of

    told: dict[str, Any] = {"mistakes": [], "picture": None, "line": ""}
    try:
        with np.errstate(all="ignore"):
            document = document_from_text(text, name, read=beside(folder))
            scene = document.scene
            if is_long(scene, scene.run.positions):
                scene = document.with_positions(SHOWN).scene
            request = Request()
            results = computed(scene, request)
            made = made_from(text.encode(), request, document.files)
            figures = {"kinelast": __version__, **summary(results), "made_from": made}
            line = headline(figures)
            drawn, data = whole_picture(results)
            theory = figures["theory"]
            drawn |= {
                "theory": theory["name"],
                "quick": False,
                "closes": {"all": True, "share": 1.0, "words": ""},
                "error": theory["error"],
                "buckles": figures["buckles"] or "",
                "problem": theory["problem"],
                "verdict": figures["acceptance"]["verdict"],
                "limits": [_limit(row) for row in figures["acceptance"]["limits"]],
            }
            return {**told, "picture": drawn, "line": line}, data, report_page(results, figures, line, handout(figures))
    except (ValueError, ArithmeticError) as error:  # of a scene, a mechanism, or a request
        return {**told, "mistakes": mistakes_of(error, text, beside(folder))}, b"", b""


def _limit(row: Mapping[str, Any]) -> dict[str, Any]:
    """A limit beside its figure, judged with the error of that."""
    told = {"kind": row["kind"], "on": row["on"], "outcome": row["outcome"], "kept": bool(row["passed"])}
    return {**told, "bound": row["limit"]["value"], "value": row["found"]["value"], "unit": row["limit"]["unit"]}


def _work(pipe: Any, text: str, name: str, folder: Path | None) -> None:
    """In the process: answer, and send."""
    with suppress(BrokenPipeError, KeyboardInterrupt):
        try:
            pipe.send(whole_answer(text, name, folder))
        except Exception as error:
            told = {"mistakes": [{"line": None, "message": f"the program failed: {error!r}"}], "picture": None}
            pipe.send(({**told, "line": ""}, b"", b""))


def _context() -> Any:
    """Processes that begin with all that they need already imported, where the system can."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["live.preloaded"])
    return context


STARTING = threading.Lock()


@contextmanager
def _without_main() -> Iterator[None]:
    """While a process is started: it would run the user's script first, which may begin an editor once more."""
    with STARTING:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


class Worker:
    """Computes one whole answer at a time: a newer one, or a drag, ends the one before."""

    def __init__(self) -> None:
        self._context = _context()
        self._lock = threading.Lock()
        self._process: Any = None

    def begin(self) -> None:
        """Import all that is needed ahead of the first answer."""
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        process = self._context.Process(target=str, daemon=True)
        with _without_main():
            process.start()

    def cancel(self) -> None:
        """End the answer that is under way."""
        with self._lock:
            if self._process is not None:
                self._process.kill()
                self._process = None

    def answer(self, text: str, name: str, folder: Path | None = None) -> tuple[dict[str, Any], bytes, bytes] | None:
        """The whole answer; None where it was cancelled meanwhile."""
        self.cancel()
        ours, theirs = self._context.Pipe(duplex=False)
        process = self._context.Process(target=_work, args=(theirs, text, name, folder), daemon=True)
        with self._lock, _without_main():
            process.start()
            self._process = process
        theirs.close()
        try:
            told: tuple[dict[str, Any], bytes, bytes] = ours.recv()
            return told
        except EOFError:
            return None
        finally:
            ours.close()
            process.join()
            with self._lock:
                if self._process is process:
                    self._process = None
                process.close()
