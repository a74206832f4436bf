"""The folder of a scene: what it was made from, and how it appears all at once."""

from __future__ import annotations

import hashlib
import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict, dataclass
from importlib import metadata
from pathlib import Path
from typing import Any


@dataclass(frozen=True)
class Request:
    """What is asked of a scene; the fields are the options of the command."""

    fields: bool = False
    stations: int = 101
    check: int | None = None
    animate: tuple[str, ...] = ()
    frames: int | None = None
    picture: str = "mp4"
    mesh: bool = False
    stills: bool = False
    positions: int | None = None
    refine: bool = False
    reachable: bool = False


class RequestError(ValueError):
    """Something is asked for that cannot be given."""


def made_from(path: Path, request: Request) -> dict[str, Any]:
    """What a folder was made from: where this is the same, so are the results."""
    try:
        digest = hashlib.sha256(path.read_bytes()).hexdigest()
    except OSError:
        digest = ""
    options = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(request).items()}
    return {"sha256": digest, "options": options}


@contextmanager
def complete(folder: Path) -> Iterator[Path]:
    """A folder to write to, which takes the place of `folder` when all has gone well and vanishes when not.

    Raises
    ------
    RequestError
        What is there now was not all written by this program, or the folder cannot be made.
    """
    part = folder.with_name(f".{folder.name}.part")
    shutil.rmtree(part, ignore_errors=True)
    try:
        try:
            _refuse_foreign(folder)
            part.mkdir(parents=True)
        except OSError as error:
            raise RequestError(f'-o: "{folder}" cannot be made: {error.strerror}') from None
        yield part
        _exchange(part, folder)
    finally:
        shutil.rmtree(part, ignore_errors=True)


def add_to(folder: Path, texts: dict[str, str], summary: dict[str, Any]) -> None:
    """Put texts by their file names into a folder, beside what this program has written there before.

    Parameters
    ----------
    summary
        What a new folder's summary.json says.

    Raises
    ------
    OSError
        They cannot be written.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for name, text in texts.items():
        (folder / name).write_text(text, encoding="utf-8")
    known = _summary_in(folder) or summary
    write_json(folder / "summary.json", {**known, "files": sorted({*known.get("files", ()), *texts, "summary.json"})})


def write_json(path: Path, data: Any) -> None:
    """Indented, strict JSON."""
    import msgspec

    path.write_bytes(msgspec.json.format(msgspec.json.encode(data), indent=1) + b"\n")


def _summary_in(folder: Path) -> dict[str, Any]:
    """The summary that a folder holds; empty where there is none that can be read."""
    try:
        found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return {}
    return found if isinstance(found, dict) else {}


def finished(folder: Path, made: dict[str, Any]) -> dict[str, Any] | None:
    """The summary of a folder that was made from just this by this version; None of any other."""
    before = _summary_in(folder)
    same = before.get("made_from") == made and before.get("kinelast") == metadata.version("kinelast")
    return before if same else None


def _refuse_foreign(folder: Path) -> None:
    """Raise where the folder holds what this program did not write: replacing it would lose that."""
    if not folder.exists():
        return
    known = set(_summary_in(folder).get("files", ()))
    others = sorted({entry.name for entry in folder.iterdir()} - known) if folder.is_dir() else [folder.name]
    if others:
        raise RequestError(
            f'"{folder}" holds what this program did not write ({", ".join(others[:3])}): choose another -o'
        )


def _exchange(part: Path, folder: Path) -> None:
    """Put a complete folder in the place of an older one."""
    old = folder.with_name(f".{folder.name}.old")
    shutil.rmtree(old, ignore_errors=True)
    if folder.exists():
        folder.rename(old)
    part.rename(folder)
    shutil.rmtree(old, ignore_errors=True)
