"""Options that do something else than compute scenes: lists, the live editor, a first scene, imports and exports.

Each function returns the exit status, or raises an error for invalid input. A module that only some options need
is imported when it is used.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from functools import partial
from pathlib import Path
from shlex import quote
from typing import TYPE_CHECKING

from kinelast import __version__
from kinelast.cli.terminal import say
from kinelast.tasks.request import Batch, RequestError
from kinelast.tasks.task import (
    CHECK_FAILED,
    FINE,
    NoEditorError,
    installed_editor,
    scene_paths,
    shipped_scenes,
    shipped_structures,
)
from kinelast.values.error import likely, plain

if TYPE_CHECKING:
    from kinelast.cli.imported import Imported

FIRST = Path(__file__).parents[1] / "scene" / "first.toml"
"""The scene that `--new` writes, which is also the example in docs/scenes.md."""


def instead_of_reports(batch: Batch) -> Callable[[], int] | None:
    """Return the function for an option such as --list, or None if scenes have to be computed instead."""
    for requested, answer in (
        (batch.version, _version),
        (batch.completion, partial(_complete, batch.completion or "")),
        (batch.list, partial(_list, *batch.scenes)),
        (batch.live, partial(_live, *batch.scenes)),
        (batch.foreign, partial(_import, batch.foreign or "", batch.elastic)),
        (batch.copy, partial(_copy, batch.copy or "")),
        (batch.new, partial(_new, batch.new or "")),
        (batch.export, partial(_export, Path(batch.export or ""), *batch.scenes)),
    ):
        if requested:
            return answer
    return None


def _version() -> int:
    print(f"kinelast {__version__}")
    return FINE


def _complete(shell: str) -> int:
    """Print the completion script of a shell."""
    from kinelast.cli.completion import script

    print(script(shell, list(shipped_scenes())))
    return FINE


def _list(kind: str = "", *words: str) -> int:
    """List the shipped scenes, or the sections or materials of the library (`kind`).

    Only sections or materials with names that contain all `words` are listed.
    """
    if kind in ("sections", "materials"):
        from kinelast.scene.library import library_entries

        sought = [word.lower().replace(" ", "") for word in words]
        entries = [
            (name, data)
            for name, data in library_entries(kind)
            if all(word in name.lower().replace(" ", "") for word in sought)
        ]
        if not entries:
            raise RequestError(f"no name contains these words: --list {kind} lists all names")
    elif kind:
        raise RequestError(f'--list lists the shipped scenes, "sections" or "materials", not "{kind}"')
    else:
        structures = shipped_structures()
        entries = [
            (name, _title(path) + (" (--structure)" if name in structures else ""))
            for name, path in (*shipped_scenes().items(), *structures.items())
        ]
    width = max((len(name) for name, _ in entries), default=0)
    for name, data in entries:
        say(f"{name:{width}}  {data}", sys.stdout)
    return FINE


def _title(path: Path) -> str:
    import tomllib

    return str(tomllib.loads(path.read_text(encoding="utf-8")).get("title", ""))


def _live(*scenes: str) -> int:
    """Run the live editor for a scene, or for a new scene if no scene is named."""
    if len(scenes) > 1:
        raise RequestError("--live takes one scene")
    try:
        return int(installed_editor().serve(scenes[0] if scenes else None, partial(say, stream=sys.stdout)))
    except NoEditorError as error:
        raise RequestError(str(error)) from None
    except ModuleNotFoundError as error:
        if error.name not in ("starlette", "uvicorn"):
            raise
        raise RequestError('--live needs a server: pip install "starlette" "uvicorn"') from None


def _new(name: str) -> int:
    """Write a first scene with the file name `name`."""
    return _write_start(Path(f"{name.removesuffix('.toml')}.toml"), FIRST)


def _copy(name: str) -> int:
    """Write a copy of a shipped scene."""
    shipped = shipped_scenes()
    if name not in shipped:
        raise RequestError(f'--copy: there is no shipped scene "{name}"{likely(name, list(shipped))}, see --list')
    return _write_start(Path(f"{name}.toml"), shipped[name])


def _write_start(path: Path, model: Path) -> int:
    """Write a copy of a scene as a starting point for the user."""
    from kinelast.scene.text import with_schema

    _write(path, with_schema(model.read_text(encoding="utf-8")), "change to another folder")
    say(f"{path} written; compute it with: deflection-report {path}", sys.stdout)
    return FINE


def _import(source: str, bend: bool) -> int:
    """Write a scene file for the mechanism of another program, and print whether the mechanism moves."""
    from kinelast.scene.text import with_schema

    first_run = _first_run(source, bend)
    stem = "mechanism" if "://" in source else Path(source).stem
    path = Path(f"{stem}_elastic.toml" if bend else f"{stem}.toml")
    _write(path, with_schema(first_run.text), "change to another folder")
    for note in first_run.notes:
        say(f"{path}: {note}", sys.stderr)
    say(f"{path} written; {first_run.result}", sys.stdout)
    if advice := first_run.advice(quote(str(path)), quote(source)):
        say(advice, sys.stdout)
    return CHECK_FAILED if first_run.reason else FINE


def _first_run(source: str, bend: bool) -> Imported:
    from exchange import ExchangeError, elastic, read
    from kinelast.cli.imported import imported

    try:
        drawing = read(source)
        return imported(elastic(drawing) if bend else drawing)
    except ExchangeError as error:
        raise RequestError(f"--import: {plain(str(error), 300)}") from None


def _export(path: Path, *scenes: str) -> int:
    """Write the mechanism of a scene to a file for another program."""
    from exchange import ExchangeError, written
    from kinelast.cli.imported import require_same_swing
    from kinelast.outputs.exported import changed_laws, exchanged, left_out
    from kinelast.scene.document import document_from_bytes
    from kinelast.scene.text import file_bytes

    paths, problems = scene_paths(scenes)
    if problems or len(paths) != 1:
        raise RequestError(problems[0] if problems else "--export takes one scene")
    scene = document_from_bytes(file_bytes(paths[0]), paths[0]).scene
    try:
        drawing = exchanged(scene)
        text = written(drawing, path.suffix)
        if path.suffix.lower() == ".pmks":
            require_same_swing(scene, drawing, text)
    except ExchangeError as error:
        raise RequestError(f"--export: {plain(str(error), 300)}") from None
    _write(path, text, "give another name")
    missing = changed_laws(scene)
    if path.suffix.lower() == ".pmks":
        kept, lost = ", masses, constant forces", "sections"
        missing += left_out(scene)
    else:
        kept, lost = "", "sections, springs, masses or forces"
    say(f"{path} written: points, links, joints, drives{kept}; the format has no {lost}", sys.stdout)
    if missing:
        say(f"left out: {', '.join(missing)}", sys.stdout)
    return FINE


def _write(path: Path, text: str, otherwise: str) -> None:
    """Write a new file. Raise RequestError if the file exists."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except FileExistsError:
        raise RequestError(f'"{path}" already exists: move it, or {otherwise}') from None
