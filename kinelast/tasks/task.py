"""Find the scene files for command-line arguments, run a function for each scene, and find the live editor.

An error in one scene does not stop the run for the other scenes.
"""

from __future__ import annotations

import os
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from glob import glob, has_magic
from pathlib import Path
from typing import TYPE_CHECKING, Any

from msgspec import Struct, field

from kinelast.tasks.progress import stops_kept
from kinelast.tasks.request import RequestError
from kinelast.values.error import SceneError, plain

if TYPE_CHECKING:
    from kinelast.reports.report import Report

MAX_ARGUMENT = 200  # longer arguments are shortened to this number of characters in messages
FOREIGN = ".pmks", ".linkage2", ".json", ".dxf"  # file extensions of other programs
MECHANISMS = Path(__file__).parent.parent / "mechanisms"


def shipped_scenes() -> dict[str, Path]:
    """Return the paths of the scenes that are shipped with kinelast, by name."""
    return {path.stem: path for path in sorted(MECHANISMS.glob("*.toml"))}


def shipped_structures() -> dict[str, Path]:
    """Return the paths of the shipped scenes that only the option --structure can use, by name."""
    return {path.stem: path for path in sorted((MECHANISMS / "structure").glob("*.toml"))}


def scene_paths(arguments: Iterable[str]) -> tuple[list[Path], list[str]]:
    """Return the scene files for the arguments, without duplicates, and messages about invalid arguments."""
    paths: dict[str, Path] = {}
    problems = []
    for argument in arguments:
        if foreign := foreign_words(argument):
            problems.append(f'"{plain(argument, MAX_ARGUMENT)}" is {foreign}')
            continue
        try:
            named = _paths(argument)
        except (OSError, ValueError) as error:  # missing permission, or invalid file name
            reason = getattr(error, "strerror", None) or str(error)
            problems.append(f'"{plain(argument, MAX_ARGUMENT)}" cannot be read: {reason.lower()}')
            continue
        if isinstance(named, str):
            problems.append(named)
            continue
        for path in named:
            if not path.stem.strip("."):
                problems.append(f'"{plain(str(path), MAX_ARGUMENT)}" has no name before .toml for its results')
            else:
                paths.setdefault(os.path.abspath(path), path)  # noqa: PTH100 - Path.resolve follows links
    return list(paths.values()), problems


def _paths(argument: str) -> list[Path] | str:
    """Return the scene files that an argument selects, or an error message."""
    if not argument.strip():  # Path("") is the working folder, which an unset shell variable must not select
        return "the name of a scene is empty: name a .toml file or a shipped scene, see --list"
    path, shown = Path(argument), plain(argument, MAX_ARGUMENT)
    if path.is_file() or (path.suffix == ".toml" and not path.is_dir() and not has_magic(argument)):
        return [path]
    shipped = {**shipped_structures(), **shipped_scenes()}
    if argument in shipped:
        return [shipped[argument]]
    if path.is_dir():
        return _inside(path) or f'the folder "{shown}" contains no .toml file'
    if has_magic(argument):
        found = [Path(each) for each in sorted(glob(argument, recursive=True))]  # noqa: PTH207 - it may be absolute
        scenes = [scene for each in found for scene in (_inside(each) if each.is_dir() else [each])]
        return scenes or f'there is no file like "{shown}"'
    from difflib import get_close_matches

    from animations import DIAGRAMS

    close = get_close_matches(argument[:MAX_ARGUMENT], shipped, 1)
    advice = f'did you mean "{close[0]}"?' if close else "--list shows the shipped scenes"
    if argument in DIAGRAMS:
        advice = f'"--animate {argument}" makes a movie of this field'
    return f'"{shown}" is neither a .toml file nor a shipped scene: {advice}'


def foreign_words(argument: str) -> str:
    """Return advice if an argument is a file or web link of another program, otherwise an empty string."""
    linked = argument.startswith(("http://", "https://")) and "?" in argument
    if linked or Path(argument).suffix.lower() in FOREIGN:
        return f"of another program: --import {plain(argument, MAX_ARGUMENT)!r} writes its scene"
    return ""


def _inside(folder: Path) -> list[Path]:
    """Return all scene files in a folder and its subfolders, except files in hidden folders."""
    found = [path for path in sorted(folder.rglob("*.toml")) if path.is_file()]
    return [path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts)]


def result_names(paths: Sequence[Path]) -> list[Path] | str:
    """Return a unique name for the result folder of each scene.

    The name is the file name of the scene without ".toml". If several scenes have the same file name, the name starts
    with the path from their common folder. If two result folders would still be equal, or one would lie inside the
    other, return an error message instead.
    """
    count = Counter(path.stem for path in paths)
    names = []
    for path in paths:
        if count[path.stem] == 1:
            names.append(Path(path.stem))
            continue
        alike = [_folder(other) for other in paths if other.stem == path.stem]
        names.append(Path(os.path.relpath(_folder(path), os.path.commonpath(alike))) / path.stem)
    for name, path in zip(names, paths, strict=True):
        for other, another in zip(names, paths, strict=True):
            if path is not another and (name == other or other in name.parents):
                both = f"{plain(str(another), MAX_ARGUMENT)} and {plain(str(path), MAX_ARGUMENT)}"
                folder = plain(str(other), MAX_ARGUMENT)
                return f'two scenes would share the folder "{folder}": {both}; run one after the other'
    return names


def _folder(path: Path) -> str:
    return os.path.dirname(os.path.abspath(path))  # noqa: PTH100, PTH120 - Path.resolve follows links


FINE, CHECK_FAILED, BAD_INPUT, BUG = 0, 1, 2, 3
"""Exit statuses. The command returns the largest status of all scenes."""
DONE, FAILED, SKIPPED = "done", "failed", "skipped"
MESSAGE = 1000  # maximum number of characters per line of a message
# Packages of this project. If an import of one of them fails, `missing_package` does not advise to install it with pip.
OURS = ("kinelast", "rigid", "elastic", "symbols", "machine", "fem_check", "animations", "exchange")
TO_INSTALL = {  # maps a missing module to the package to install, if their names differ
    "imageio_ffmpeg": "imageio[ffmpeg]",
    "shapely": "sectionproperties",
    "skfem": "scikit-fem",
    "uplot": "uplot-python",
    "vtkmodules": "vtk",
}


PARTS_OF_OTHERS = ("shapely",)  # modules that pip installs as dependencies of the package in `TO_INSTALL`


class Task(Struct, frozen=True):
    """A scene to compute: file of the scene, folder for the results, and name of the scene in messages.

    `extra` contains additional entries for the summary.
    """

    path: Path
    folder: Path
    name: str
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __hash__(self) -> int:
        return hash(self.folder)  # `extra` is a dictionary, which cannot be hashed


class Outcome(Struct, frozen=True):
    """Outcome of a scene.

    Attributes
    ----------
    status, line, state
        Exit status, message, and one of `DONE`, `FAILED` and `SKIPPED`.
    questions
        Questions to the user about unusual input values.
    report, seconds
        Report (None if the scene failed), and duration of the computation [s].
    interrupted
        True if the user stopped the run and partial results are stored.
    unwritten
        True if the results could not be written. The reason may be temporary, such as a full disk.
    """

    status: int
    line: str
    state: str = FAILED
    questions: tuple[str, ...] = ()
    report: Report | None = None
    seconds: float = 0.0
    interrupted: bool = False
    unwritten: bool = False


def guarded(name: str, work: Callable[[], Outcome], fewer: str = "positions", place: str = "") -> Outcome:
    """Run a function for a scene, and convert an exception to an outcome.

    Parameters
    ----------
    fewer
        Quantities of which the user should request fewer if memory runs out, such as "positions" (for the message).
    place
        Folder for the results. If a disk error contains no file name, the message names this folder.
    """
    try:
        with stops_kept():
            return work()
    except MemoryError:
        return Outcome(BAD_INPUT, f"{name}: out of memory: ask for fewer {fewer}")
    except OSError as error:
        where = f"{error.filename or place}: " if error.filename or place else ""
        missing = isinstance(error, SceneError)  # this subclass of OSError means a missing scene file
        message = str(error) if missing else f"not written: {where}{(error.strerror or str(error)).lower()}"
        return Outcome(BAD_INPUT, f"{name}: {_printable(message)}", unwritten=not missing)
    except Exception as error:
        from rigid import MechanismError

        if isinstance(error, (SceneError, MechanismError, RequestError)):
            return Outcome(BAD_INPUT, f"{name}: {_printable(str(error))}")
        if message := missing_package(error):
            return Outcome(BAD_INPUT, f"{name}: {message}")
        return Outcome(BUG, f"{name}: the program failed, please report this:\n{traceback.format_exc()}")


def _printable(text: str) -> str:
    """Escape control characters in a message, and shorten long lines."""
    return "\n".join(plain(line, MESSAGE) for line in text.split("\n"))


def missing_package(error: BaseException) -> str:
    """Return a message if the error is a missing package of another project, otherwise an empty string."""
    name = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    if not name or name in OURS:
        return ""
    install = TO_INSTALL.get(name, name)
    of = f', which comes with "{install}",' if name in PARTS_OF_OTHERS else ""
    return f'the package "{name}"{of} is not installed: pip install "{install}"'


GROUP = "kinelast.editor"  # an editor package registers its module as an entry point of this group


class NoEditorError(LookupError):
    """No package provides an editor."""


def installed_editor() -> Any:
    """Return the module of the live editor, which contains the functions `serve` and `view`.

    Raises
    ------
    NoEditorError
        No package provides an editor.
    """
    from importlib.metadata import entry_points  # imported here, because --help does not need this module

    for entry in entry_points(group=GROUP):
        return entry.load()
    raise NoEditorError(f"no package provides a live editor (entry point {GROUP}): install kinelast again")
