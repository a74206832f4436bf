"""A task and its outcome: a fault of a scene does not take the others with it."""

from __future__ import annotations

import traceback
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from kinelast.scene.error import SceneError, plain
from kinelast.tasks.request import RequestError

FINE, CHECK_FAILED, BAD_INPUT, BUG = 0, 1, 2, 3
"""Exit statuses of the command, the greatest of all scenes' counts."""
DONE, FAILED, SKIPPED = "done", "failed", "skipped"
MESSAGE = 1000  # letters of a line, at most
OURS = ("kinelast", "rigid", "elastic", "fem_check", "animations")
TO_INSTALL = {  # by the name that is imported, where that is not what is installed
    "distributed": "kinelast[cluster]",
    "imageio_ffmpeg": "imageio[ffmpeg]",
    "pandas": "kinelast[notebook]",
    "pyarrow": "kinelast[sweep]",
    "skfem": "scikit-fem",
    "vtkmodules": "vtk",
    "xarray": "kinelast[notebook]",
}


@dataclass(frozen=True)
class Task:
    """A scene's file, the folder for its results, and the name of both in messages."""

    path: Path
    folder: Path
    name: str


@dataclass(frozen=True)
class Outcome:
    """How a scene went.

    The exit status it calls for, one line about it, whether it was done, failed or skipped, questions about its
    figures, its figures where there are any, and how many seconds it took. `interrupted`: a user ended it, and what was
    found until then is kept.
    """

    status: int
    line: str
    state: str = FAILED
    questions: tuple[str, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    interrupted: bool = False


def guarded(name: str, work: Callable[[], Outcome], fewer: str = "positions", place: str = "") -> Outcome:
    """The outcome of a scene's work, or of the exception that it raises.

    Parameters
    ----------
    fewer
        What to ask less of where memory runs out.
    place
        Where it was written to, for faults of the disk that name no file.
    """
    try:
        return work()
    except MemoryError:
        return Outcome(BAD_INPUT, f"{name}: out of memory: ask for fewer {fewer}")
    except OSError as error:
        where = f"{error.filename or place}: " if error.filename or place else ""
        told = plain(f"{where}{(error.strerror or str(error)).lower()}", MESSAGE)
        return Outcome(BAD_INPUT, f"{name}: not written: {told}")
    except Exception as error:
        from rigid import MechanismError

        if isinstance(error, (SceneError, MechanismError, RequestError)):
            return Outcome(BAD_INPUT, f"{name}: {plain(str(error), MESSAGE)}")
        if told := missing_package(error):
            return Outcome(BAD_INPUT, f"{name}: {told}")
        return Outcome(BUG, f"{name}: the program failed, please report this:\n{traceback.format_exc()}")


def missing_package(error: BaseException) -> str:
    """The message on a package that is not installed; empty of any other error."""
    name = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    if not name or name in OURS:
        return ""
    return f'the package "{name}" is not installed: pip install "{TO_INSTALL.get(name, name)}"'
