"""Tasks: scenes that arguments name, and the outcome of each; a fault of one does not take the others with it."""

from __future__ import annotations

import os
import traceback
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from glob import glob, has_magic
from pathlib import Path
from typing import Any

from kinelast.scene.error import SceneError, plain
from kinelast.tasks.progress import stops_kept
from kinelast.tasks.request import RequestError

LINE = 200  # letters of an argument in a message
MECHANISMS = Path(__file__).parent.parent / "mechanisms"


def shipped_scenes() -> dict[str, Path]:
    """Paths of the shipped scenes by name."""
    return {path.stem: path for path in sorted(MECHANISMS.glob("*.toml"))}


def shipped_structures() -> dict[str, Path]:
    """Paths of the shipped scenes that describe a structure alone, by name."""
    return {path.stem: path for path in sorted((MECHANISMS / "structure").glob("*.toml"))}


def scene_paths(arguments: Iterable[str]) -> tuple[list[Path], list[str]]:
    """The files of the scenes, each once, and the problems of arguments that name none."""
    paths: dict[str, Path] = {}
    problems = []
    for argument in arguments:
        try:
            named = _paths(argument)
        except (OSError, ValueError) as error:  # no permission, a name too long or with a null character
            reason = getattr(error, "strerror", None) or str(error)
            problems.append(f'"{plain(argument, LINE)}" cannot be looked at: {reason.lower()}')
            continue
        if isinstance(named, str):
            problems.append(named)
            continue
        for path in named:
            if not path.stem.strip("."):
                problems.append(f'"{plain(str(path), LINE)}" has no name before .toml, which its results would bear')
            else:
                paths.setdefault(os.path.abspath(path), path)  # noqa: PTH100 - which looks at no link
    return list(paths.values()), problems


def _paths(argument: str) -> list[Path] | str:
    """The files that an argument names, or the problem with it."""
    if not argument.strip():  # as of a variable of the shell that is not set: not all of the working folder
        return "a scene without a name was given: name a .toml file or a shipped scene, see --list"
    path, shown = Path(argument), plain(argument, LINE)
    if path.is_file() or (path.suffix == ".toml" and not path.is_dir() and not has_magic(argument)):
        return [path]
    shipped = {**shipped_structures(), **shipped_scenes()}
    if argument in shipped:
        return [shipped[argument]]
    if path.is_dir():
        return _inside(path) or f'the folder "{shown}" holds no .toml file'
    if has_magic(argument):
        found = [Path(each) for each in sorted(glob(argument, recursive=True))]  # noqa: PTH207 - of a folder too
        scenes = [scene for each in found for scene in (_inside(each) if each.is_dir() else [each])]
        return scenes or f'there is no file like "{shown}"'
    from difflib import get_close_matches

    close = get_close_matches(argument[:LINE], shipped, 1)
    advice = f'did you mean "{close[0]}"?' if close else "--list shows the shipped scenes"
    return f'"{shown}" is neither a .toml file nor a shipped scene: {advice}'


def _inside(folder: Path) -> list[Path]:
    """Scenes in a folder and in the folders in it, hidden ones left out."""
    found = [path for path in sorted(folder.rglob("*.toml")) if path.is_file()]
    return [path for path in found if not any(part.startswith(".") for part in path.relative_to(folder).parts)]


def result_names(paths: Sequence[Path]) -> list[Path] | str:
    """Under which names the results of scenes stand: their own, after folders where scenes are named alike.

    A text says which scenes would share a folder all the same.
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
                both = f"{plain(str(another), LINE)} and {plain(str(path), LINE)}"
                return f'two scenes would share the folder "{plain(str(other), LINE)}": {both}; run one after the other'
    return names


def _folder(path: Path) -> str:
    return os.path.dirname(os.path.abspath(path))  # noqa: PTH100, PTH120 - which looks at no link


FINE, CHECK_FAILED, BAD_INPUT, BUG = 0, 1, 2, 3
"""Exit statuses of the command, the greatest of all scenes' counts."""
DONE, FAILED, SKIPPED = "done", "failed", "skipped"
MESSAGE = 1000  # letters of a line, at most
OURS = ("kinelast", "rigid", "elastic", "machine", "fem_check", "animations", "exchange")
TO_INSTALL = {  # by the name that is imported, where that is not what is installed
    "imageio_ffmpeg": "imageio[ffmpeg]",
    "shapely": "sectionproperties",
    "skfem": "scikit-fem",
    "uplot": "uplot-python",
    "vtkmodules": "vtk",
}


@dataclass(frozen=True)
class Task:
    """A scene's file, the folder for its results, and the name of both in messages.

    `beside` is what its summary tells besides its own figures, by key.
    """

    path: Path
    folder: Path
    name: str
    beside: Mapping[str, Any] = field(default_factory=dict, compare=False)


@dataclass(frozen=True)
class Outcome:
    """How a scene went.

    The exit status it calls for, one line about it, whether it was done, failed or skipped, questions about its
    figures, its figures where there are any, and how many seconds it took. `interrupted`: a user ended it, and what was
    found until then is kept. `unwritten`: the disk did not take it, and the next time it may.
    """

    status: int
    line: str
    state: str = FAILED
    questions: tuple[str, ...] = ()
    figures: Mapping[str, Any] = field(default_factory=dict)
    seconds: float = 0.0
    interrupted: bool = False
    unwritten: bool = False


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
        with stops_kept():
            return work()
    except MemoryError:
        return Outcome(BAD_INPUT, f"{name}: out of memory: ask for fewer {fewer}")
    except OSError as error:
        where = f"{error.filename or place}: " if error.filename or place else ""
        missing = isinstance(error, SceneError)  # of a scene's file that is not there
        told = str(error) if missing else f"not written: {where}{(error.strerror or str(error)).lower()}"
        return Outcome(BAD_INPUT, f"{name}: {_lines(told)}", unwritten=not missing)
    except Exception as error:
        from rigid import MechanismError

        if isinstance(error, (SceneError, MechanismError, RequestError)):
            return Outcome(BAD_INPUT, f"{name}: {_lines(str(error))}")
        if told := missing_package(error):
            return Outcome(BAD_INPUT, f"{name}: {told}")
        return Outcome(BUG, f"{name}: the program failed, please report this:\n{traceback.format_exc()}")


def _lines(text: str) -> str:
    """A message, every line of it as it can be printed."""
    return "\n".join(plain(line, MESSAGE) for line in text.split("\n"))


def missing_package(error: BaseException) -> str:
    """The message on a package that is not installed; empty of any other error."""
    name = (error.name or "").partition(".")[0] if isinstance(error, ModuleNotFoundError) else ""
    if not name or name in OURS:
        return ""
    return f'the package "{name}" is not installed: pip install "{TO_INSTALL.get(name, name)}"'
