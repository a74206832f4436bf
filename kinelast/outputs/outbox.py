"""The folder of a scene: what it was made from, and how it appears all at once.

A folder is written beside its place under a name of its own and then exchanged with what is there, while a lock keeps
other runs from the same folder. The lock's file tells the name: whoever finds it of a run that was killed cleans up.
"""

from __future__ import annotations

import hashlib
import json
import os
import re
import shutil
import time
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import asdict
from functools import cache
from importlib import metadata
from pathlib import Path
from typing import Any

from kinelast.request import Request, RequestError, written
from kinelast.scene.error import plain

HIDDEN = ".kinelast-"  # locks and unfinished folders
PATIENCE = 60.0  # [s] that another run may take to write the same folder
LINE = 300  # letters of a message


@cache
def version() -> str:
    """Version of the program, looked up once: that takes a while."""
    return metadata.version("kinelast")


def made_from(content: bytes, request: Request) -> dict[str, Any]:
    """What a folder is made from: the bytes of the scene's file and the options. Where they are the same, so is it."""
    options = {name: list(value) if isinstance(value, tuple) else value for name, value in asdict(request).items()}
    return {"sha256": hashlib.sha256(content).hexdigest(), "options": options}


@contextmanager
def complete(folder: Path) -> Iterator[Path]:
    """A folder to write to, which takes the place of `folder` when all has gone well and vanishes when not.

    What somebody else has put into `folder` stays there, see `foreign`.

    Raises
    ------
    RequestError
        Somebody else's file has the name of one that is written; another run does not let go of the folder; it cannot
        be made.
    """
    _require_place(folder)
    with held(folder) as hidden:
        part, old = (folder.with_name(f"{hidden}{end}") for end in (".part", ".old"))
        try:
            part.mkdir()
            yield part
            _refuse_to_replace(folder, {entry.name for entry in part.iterdir()})
            if folder.exists():
                folder.rename(old)
            part.rename(folder)
        finally:
            _clean(folder, hidden)


def add_to(folder: Path, texts: Mapping[str, str], summary: Mapping[str, Any]) -> None:
    """Put texts by their file names into a folder, beside what this program has written there before.

    Parameters
    ----------
    summary
        What a new folder's summary.json says.

    Raises
    ------
    RequestError
        As `complete`.
    """
    _require_place(folder)
    with held(folder) as hidden:
        _refuse_to_replace(folder, {*texts, "summary.json"})
        folder.mkdir(exist_ok=True)
        known = _summary_in(folder) or {}
        whole = {
            **(known or summary),
            "files": {**_files(known), **{name: _bytes(text) for name, text in texts.items()}},
        }
        part = folder.with_name(f"{hidden}.part")
        part.mkdir()
        for name, text in texts.items():
            (part / name).write_text(text, encoding="utf-8", newline="")
        write_json(part / "summary.json", whole)
        for entry in sorted(part.iterdir(), key=lambda each: each.name == "summary.json"):
            entry.replace(folder / entry.name)
        part.rmdir()


def write_json(path: Path, data: Any) -> None:
    """Indented, strict JSON."""
    path.write_bytes(json_bytes(data, indent=1) + b"\n")


def json_bytes(data: Any, indent: int = 0) -> bytes:
    """Data as strict JSON; nan is null, and what no text may hold, of a file's name, is told by its number."""
    import msgspec

    try:
        text = msgspec.json.encode(data)
    except UnicodeEncodeError:
        text = json.dumps(data, allow_nan=False).encode()
    return msgspec.json.format(text, indent=indent) if indent else text


def sizes(folder: Path) -> dict[str, int]:
    """Bytes of every file in a folder, and of what is in every folder in it, by name."""
    return {
        entry.name: sum(file.stat().st_size for file in entry.rglob("*")) if entry.is_dir() else entry.stat().st_size
        for entry in sorted(folder.iterdir())
    }


def finished(folder: Path, made: Mapping[str, Any]) -> dict[str, Any] | None:
    """The summary of a folder that was made from just this by this version and is whole; None of any other."""
    before = _summary_in(folder)
    if not before or before.get("made_from") != made or before.get("kinelast") != version():
        return None
    try:
        found = sizes(folder)
    except OSError:
        return None
    whole = all(found.get(name) == size for name, size in _files(before).items())
    return before if whole and _files(before) and not before.get("failed") else None


def foreign(folder: Path, summary: Mapping[str, Any] | None = None) -> list[str]:
    """Names of what somebody else has put into a folder; its summary, where that is known already."""
    with suppress(OSError):
        names = {entry.name for entry in folder.iterdir()}
        return sorted(names - ({*_files(summary), "summary.json"} if summary else _ours(folder))) if names else []
    return []


def recovered(folder: Path) -> None:
    """Clear away what a process that has died left of a folder, and bring back what was there before."""
    with suppress(OSError, RequestError):
        if _lock_of(folder).exists():
            with held(folder):
                pass


def _require_place(folder: Path) -> None:
    """Raise where no folder can be: at a file or a link, which would lead the results elsewhere."""
    with suppress(OSError):
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            shown = plain(str(folder), LINE)
            raise RequestError(f'-o: "{shown}" is not a folder but a file or a link: move it, or choose another -o')


def _lock_of(folder: Path) -> Path:
    name = hashlib.sha256(os.fsencode(folder.name)).hexdigest()[:16]
    return folder.with_name(f"{HIDDEN}{name}.lock")


@contextmanager
def held(folder: Path, patience: float | None = None) -> Iterator[str]:
    """Keep other runs from a folder or file; the name of what may be hidden beside it meanwhile.

    Parameters
    ----------
    patience
        Time that another run may take to let go of it [s]; `PATIENCE` where left out.

    Raises
    ------
    RequestError
        Another run holds it, or it cannot be made.
    """
    fresh: list[Path] = []
    hidden = HIDDEN + os.urandom(8).hex()
    path, shown = _lock_of(folder), plain(str(folder), LINE)
    try:
        try:
            fresh += [place for place in folder.parents if not place.exists()]
            folder.parent.mkdir(parents=True, exist_ok=True)
            lock = _locked(path, shown, PATIENCE if patience is None else patience)
            before = os.read(lock, 100).decode("ascii", "replace")
            if re.fullmatch(re.escape(HIDDEN) + "[0-9a-f]{16}", before):
                _clean(folder, before)
            os.lseek(lock, 0, os.SEEK_SET)
            os.ftruncate(lock, 0)
            os.write(lock, hidden.encode())
        except OSError as error:
            raise RequestError(f'-o: "{shown}" cannot be made: {error.strerror}') from None
        try:
            yield hidden
        finally:
            with suppress(OSError):
                folder.with_name(f"{hidden}.part").unlink()  # where it is a file that was not finished
            if not any(folder.with_name(f"{hidden}{end}").exists() for end in (".part", ".old")):
                with suppress(OSError):
                    path.unlink()  # before it is let go of: whoever has waited for it looks whether it is still there
            os.close(lock)
    finally:
        for place in fresh:
            with suppress(OSError):
                place.rmdir()  # unless something stands in it


def _locked(path: Path, shown: str, patience: float) -> int:
    """A lock's file, open and held; the system lets go of it with the process, however that ends."""
    end = time.monotonic() + patience
    while True:
        lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
        try:
            import fcntl

            fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            os.close(lock)
            if time.monotonic() > end:
                raise RequestError(f'"{shown}" is being written by another run: wait, or choose another -o') from None
            time.sleep(0.05)
            continue
        except (ImportError, OSError):  # a system without such locks: the names alone keep two runs apart
            return lock
        with suppress(OSError):
            if os.fstat(lock).st_ino == path.stat().st_ino:
                return lock
        os.close(lock)


def _clean(folder: Path, hidden: str) -> None:
    """Away with what is hidden beside a folder; what stood in the folder and was not replaced goes back."""
    part, old = (folder.with_name(f"{hidden}{end}") for end in (".part", ".old"))
    shutil.rmtree(part, ignore_errors=True)
    with suppress(OSError):
        part.unlink()
    if not old.is_dir():
        return
    if not folder.exists():
        old.rename(folder)
        return
    for name in foreign(old):
        (old / name).rename(folder / name)
    shutil.rmtree(old, ignore_errors=True)


def _ours(folder: Path) -> set[str]:
    """Names of what this program has written into a folder, as its summary tells.

    Where that cannot be read, by a fault of the disk or of an editor, all names that this program uses.
    """
    known = _summary_in(folder)
    if known is None:
        found = written() & {entry.name for entry in folder.iterdir()}
        return {*found, "summary.json"} if found else set()
    return {*_files(known), "summary.json"} if known else set()


def _files(summary: Mapping[str, Any]) -> dict[str, Any]:
    found = summary.get("files")
    return found if isinstance(found, dict) else dict.fromkeys(found) if isinstance(found, list) else {}


def _summary_in(folder: Path) -> dict[str, Any] | None:
    """The summary that this program has put into a folder; empty where there is none, None of an unreadable one."""
    try:
        found = json.loads((folder / "summary.json").read_text(encoding="utf-8"))
    except OSError:
        return {}
    except (ValueError, RecursionError):
        return None
    return found if isinstance(found, dict) and "kinelast" in found else {}


def _refuse_to_replace(folder: Path, names: set[str]) -> None:
    """Raise where files of somebody else have names that are to be written."""
    clash = sorted(names & set(foreign(folder)))
    if clash:
        shown = plain(str(folder), LINE)
        raise RequestError(
            f'"{shown}" holds what this program did not write ({", ".join(clash[:3])}): move it, or choose another -o'
        )


def _bytes(text: str) -> int:
    return len(text.encode("utf-8"))
