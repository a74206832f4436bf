"""Full answer: results with the theory and accuracy that the scene requests.

They are computed in a separate process, so that the computation can be cancelled at any time.
"""

from __future__ import annotations

import multiprocessing
import os
import sys
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from kinelast.reports.report import JudgedLimit


def whole_answer(text: str, name: str, folder: Path | None) -> tuple[dict[str, Any], bytes, bytes]:
    """Compute the results of a scene; return plain data with the picture, the arrays of the picture, and the report.

    If the scene cannot be computed, the plain data contain the errors, and the arrays and the report are empty.
    `folder` contains the files to which the text refers.
    """
    import numpy as np
    from msgspec.structs import replace

    from kinelast.outputs.page import report_page
    from kinelast.outputs.sealed import made_from
    from kinelast.outputs.words import headline
    from kinelast.reports.summary import report_of
    from kinelast.runs import SHOWN, computed, is_long
    from kinelast.scene.document import document_from_text
    from kinelast.scene.text import reader_in
    from kinelast.tasks.request import Request
    from live.answer import most_used_first, whole_picture
    from live.text import mistakes_of

    empty: dict[str, Any] = {"mistakes": [], "picture": None, "line": ""}
    try:
        with np.errstate(all="ignore"):
            document = document_from_text(text, name, read=reader_in(folder))
            scene = document.scene
            if is_long(scene, scene.run.positions):
                scene = document.with_positions(SHOWN).scene
            request = Request()
            results = computed(scene, request)
            report = replace(report_of(results), made_from=made_from(text.encode(), request, document.files))
            drawn, data = whole_picture(results)
            drawn |= {
                "theory": report.theory.name,
                "quick": False,
                "closes": {"all": True, "share": 1.0, "words": ""},
                "error": report.theory.error,
                "buckles": report.buckles or "",
                "problem": report.theory.problem,
                "verdict": report.acceptance.verdict,
                "limits": most_used_first(_limit(row) for row in report.acceptance.limits or ()),
            }
            return {**empty, "picture": drawn, "line": headline(report)}, data, report_page(results, report)
    except (ValueError, ArithmeticError) as error:  # errors in the scene, the mechanism or the request
        return {**empty, "mistakes": mistakes_of(error, text, reader_in(folder))}, b"", b""


def _limit(row: JudgedLimit) -> dict[str, Any]:
    """Return the plain data of a limit: its bound, the value closest to the bound, and the outcome.

    The outcome takes the error of the value into account.
    """
    from kinelast.reports.doubted import LIMIT_NAMES

    return {
        "name": LIMIT_NAMES.get(row.kind, row.name),
        "on": row.on,
        "outcome": row.outcome,
        "kept": bool(row.passed),
        "bound": row.limit.value,
        "value": row.found.value,
        "unit": row.limit.unit,
        "used": row.used,
    }


def _work(pipe: Any, text: str, name: str, folder: Path | None) -> None:
    """Compute a full answer and send it through a pipe. This function runs in the separate process."""
    with suppress(BrokenPipeError, KeyboardInterrupt):
        try:
            pipe.send(whole_answer(text, name, folder))
        except Exception as error:
            failure = {"mistakes": [{"line": None, "message": f"the program failed: {error!r}"}], "picture": None}
            pipe.send(({**failure, "line": ""}, b"", b""))


def _context() -> Any:
    """Return the multiprocessing context. If the system supports this, modules are loaded before a process starts."""
    if "forkserver" not in multiprocessing.get_all_start_methods():
        return multiprocessing.get_context("spawn")
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["elastic.elastodynamics", "live.answer"])
    return context


STARTING = threading.Lock()


@contextmanager
def _without_main() -> Iterator[None]:
    """Hide the user's script (`__main__`) while a process starts.

    Otherwise, the process would run the script, which would start another editor.
    """
    with STARTING:
        main = sys.modules["__main__"]
        sys.modules["__main__"] = ModuleType("__main__")
        try:
            yield
        finally:
            sys.modules["__main__"] = main


class Worker:
    """Computes one full answer at a time in a separate process. A newer request cancels the computation."""

    def __init__(self) -> None:
        self._context = _context()
        self._lock = threading.Lock()
        self._process: Any = None

    def begin(self) -> None:
        """Load modules in the background, so that the first full answer takes less time."""
        os.environ.setdefault("OMP_NUM_THREADS", "1")
        process = self._context.Process(target=str, daemon=True)
        with _without_main():
            process.start()

    def cancel(self) -> None:
        """Cancel the running computation, if any."""
        with self._lock:
            if self._process is not None:
                self._process.kill()
                self._process = None

    def answer(self, text: str, name: str, folder: Path | None = None) -> tuple[dict[str, Any], bytes, bytes] | None:
        """Return the full answer (see `whole_answer`), or None if its computation is cancelled."""
        self.cancel()
        ours, theirs = self._context.Pipe(duplex=False)
        process = self._context.Process(target=_work, args=(theirs, text, name, folder), daemon=True)
        with self._lock, _without_main():
            process.start()
            self._process = process
        theirs.close()
        try:
            return ours.recv()
        except EOFError:
            return None
        finally:
            ours.close()
            process.join()
            with self._lock:
                if self._process is process:
                    self._process = None
                process.close()
