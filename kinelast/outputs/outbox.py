"""Atomic writing of result folders and files. Locks exclude concurrent runs.

A new result folder is written under a hidden name. When it is complete, it replaces the existing folder. The lock file
contains the hidden name, so that the next run can remove the hidden files of a killed run.
"""

import hashlib
import os
import platform
import re
import shutil
import time
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from kinelast.outputs.sealed import SUMMARY, changed, own_names, summary_in, with_files, write_json
from kinelast.outputs.table import FORMATS
from kinelast.scene.error import plain
from kinelast.tasks.progress import signals_held_back
from kinelast.tasks.request import RequestError, written

EARLIER = "earlier"  # subfolder for files of earlier runs that the current run did not write again
HIDDEN = ".kinelast-"  # prefix of locks and unfinished folders
UNFINISHED = ".part"  # suffix of unfinished files
OWNER = ".owner"  # suffix of the file that replaces a lock on file systems without locks
PATIENCE = 60.0  # [s] maximum time to wait for another run
PAUSE = 0.05  # [s] pause between two attempts to lock a folder
LINE = 300  # maximum number of characters of a path in a message


@contextmanager
def complete(folder: Path) -> Iterator[Path]:
    """Yield a hidden folder that replaces `folder` on success and is removed on failure.

    Files of earlier runs move to the subfolder `EARLIER` if this run does not write them again. Files that this program
    did not write stay in the folder (see `foreign`). If the user has edited a file of this program, the file is renamed
    to `NAME.edited.EXT`.

    Raises
    ------
    RequestError
        A file that this program did not write has the name of a new file, another run has locked the folder, or the
        folder cannot be created.
    """
    _require_place(folder)
    with locked(folder) as hidden:
        part, old = (folder.with_name(f"{hidden}{end}") for end in (".part", ".old"))
        try:
            part.mkdir()
            yield part
            made = {entry.name for entry in part.iterdir()}
            _refuse_to_replace(folder, made)
            if folder.exists():
                _move_aside(folder)
                folder.rename(old)
            part.rename(folder)
        finally:
            with signals_held_back():
                _clean(folder, hidden)


def rewritten(path: Path, ours: Callable[[], bool], content: Callable[[], bytes]) -> None:
    """Write or replace a file while it is locked against other runs.

    Raises
    ------
    RequestError
        The existing file was not written by this program (`ours` is false), or another run has locked it.
    """
    with locked(path) as hidden:
        if path.exists() and not ours():
            raise RequestError(f'"{plain(str(path), LINE)}" was not written by this program and is not replaced')
        put(path, content(), unfinished=f"{hidden}.part")


def put(path: Path, content: bytes, *more: Path, unfinished: str = "") -> None:
    """Write `content`, followed by the contents of the files `more`, to a file atomically.

    The content is written to a temporary file, which is renamed when the content is on the disk. After a power failure,
    the file may be missing or old, but it is never incomplete.
    """
    part = path.with_name(unfinished or f".{path.name}{UNFINISHED}")
    try:
        with part.open("wb") as file:
            with suppress(FileNotFoundError):
                shutil.copymode(path, part)
            file.write(content)
            for source in more:
                with source.open("rb") as other:
                    shutil.copyfileobj(other, file, 1 << 20)
            file.flush()
            sync(file.fileno())
        part.replace(path)
    except BaseException:
        with suppress(OSError):
            part.unlink()
        raise


def sync(file: int) -> None:
    """Wait until the content of a file is on the disk. Raise OSError if the disk is full."""
    os.fsync(file)


def add_to(folder: Path, texts: Mapping[str, str], summary: Mapping[str, Any]) -> None:
    """Add text files to a result folder.

    Parameters
    ----------
    summary
        Content of summary.json if the folder has no summary yet.

    Raises
    ------
    RequestError
        The folder cannot be written (for the reasons, see `complete`).
    """
    _require_place(folder)
    with locked(folder) as hidden:
        _refuse_to_replace(folder, {*texts, SUMMARY})
        known = summary_in(folder) or {}
        part = folder.with_name(f"{hidden}.part")
        part.mkdir()
        try:
            _add(folder, part, texts, known or summary)
        finally:
            shutil.rmtree(part, ignore_errors=True)


def _add(folder: Path, part: Path, texts: Mapping[str, str], known: Mapping[str, Any]) -> None:
    """Write text files and the summary to the hidden folder `part`, and move them to `folder`, the summary last."""
    for name, text in texts.items():
        (part / name).write_text(text, encoding="utf-8", newline="")
    write_json(part / SUMMARY, with_files(known, part))
    folder.mkdir(exist_ok=True)
    for entry in sorted(part.iterdir(), key=lambda each: each.name == SUMMARY):
        entry.replace(folder / entry.name)


def foreign(folder: Path, summary: Mapping[str, Any] | None = None) -> list[str]:
    """Return the names of the files in a folder that this program did not write.

    By default, the summary is read from the folder.
    """
    with suppress(OSError):
        names = {entry.name for entry in folder.iterdir()}
        return sorted(names - {EARLIER} - (own_names(summary) if summary else _ours(folder))) if names else []
    return []


def recovered(folder: Path) -> None:
    """Remove the hidden files of a killed run. If the killed run had renamed `folder`, rename it back."""
    with suppress(OSError, RequestError):
        if _lock_of(folder).exists():
            with locked(folder):
                pass


def _require_place(folder: Path) -> None:
    """Raise RequestError if the path of a result folder, or of its subfolder `EARLIER`, is a file or a link."""
    with suppress(OSError):
        if folder.is_symlink() or (folder.exists() and not folder.is_dir()):
            shown = plain(str(folder), LINE)
            raise RequestError(f'-o: "{shown}" is a file or a link, not a folder: move it, or choose another -o')
        older = folder / EARLIER
        if older.is_symlink() or (older.exists() and not older.is_dir()):
            raise RequestError(f'"{plain(str(older), LINE)}" is a file or a link, not a folder: move it')


def _lock_of(folder: Path) -> Path:
    name = hashlib.sha256(os.fsencode(folder.name)).hexdigest()[:16]
    return folder.with_name(f"{HIDDEN}{name}.lock")


@contextmanager
def locked(folder: Path, patience: float | None = None) -> Iterator[str]:
    """Lock a folder or file against other runs, and yield the prefix for the names of its hidden files.

    Parameters
    ----------
    patience
        Maximum time to wait for another run [s] (default: `PATIENCE`).

    Raises
    ------
    RequestError
        Another run still has the lock after this time, or the lock file or the parent folder cannot be created.
    """
    fresh: list[Path] = []
    hidden = HIDDEN + os.urandom(8).hex()
    path, shown = _lock_of(folder), plain(str(folder), LINE)
    # count attempts instead of measuring time: the computer may sleep while it waits
    left = (PATIENCE if patience is None else patience) / PAUSE
    lock = None
    try:
        try:
            fresh += [place for place in folder.parents if not place.exists()]
            folder.parent.mkdir(parents=True, exist_ok=True)
            while lock is None:
                with signals_held_back():
                    lock, more = _tried(path)
                if lock is None and left <= 0:
                    raise RequestError(f'"{shown}" is being written by another run: wait, or choose another -o{more}')
                if lock is None:
                    left -= 1
                    time.sleep(PAUSE)
            _mark(lock, folder, hidden)
        except OSError as error:
            raise RequestError(f'-o: "{shown}" cannot be made: {error.strerror}') from None
        yield hidden
    finally:
        with signals_held_back():
            if lock is not None:
                _release(path, lock, folder, hidden)
            for place in fresh:
                with suppress(OSError):
                    place.rmdir()  # fails if the folder contains files


def _mark(lock: int, folder: Path, hidden: str) -> None:
    """Remove the hidden files of a killed run, if any. Write the prefix `hidden` of this run to the lock file."""
    before = os.read(lock, 100).decode("ascii", "replace")
    if re.fullmatch(re.escape(HIDDEN) + "[0-9a-f]{16}", before):
        _clean(folder, before)
    os.lseek(lock, 0, os.SEEK_SET)
    os.ftruncate(lock, 0)
    os.write(lock, hidden.encode())


def _release(path: Path, lock: int, folder: Path, hidden: str) -> None:
    """Release a lock. Remove the lock file if no hidden files remain."""
    with suppress(OSError):
        folder.with_name(f"{hidden}.part").unlink()  # the unfinished file, if any
    if not any(folder.with_name(f"{hidden}{end}").exists() for end in (".part", ".old")):
        with suppress(OSError):
            path.unlink()  # before the release: a waiting run checks whether the file still exists
    with suppress(OSError):
        path.with_suffix(OWNER).unlink()
    os.close(lock)


def _tried(path: Path) -> tuple[int | None, str]:
    """Try to lock a file. Return the descriptor of the open file, or None if another run has locked the file.

    The second value is a text to append to the error message of the caller. It is empty if there is nothing to add. The
    operating system releases the lock when the process ends.
    """
    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        import fcntl

        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        return None, ""
    except ImportError:  # without locks, the hidden files of different runs still have different names
        return lock, ""
    except OSError:  # a file system without locks, such as a network drive
        os.close(lock)
        if _owned(path):  # open the file again, because the previous owner may have removed it
            return os.open(path, os.O_RDWR | os.O_CREAT, 0o644), ""
        return None, f'; if there is none, remove "{plain(str(path.with_suffix(OWNER)), LINE)}"'
    with suppress(OSError):
        if os.fstat(lock).st_ino == path.stat().st_ino:
            return lock, ""
    os.close(lock)
    return None, ""


def _owned(path: Path) -> bool:
    """Create the file that replaces a lock (suffix `OWNER`). Return False if the file already exists.

    An existing file is removed if the process that created the file ran on this computer and has ended. The next
    attempt then succeeds.
    """
    place, here = path.with_suffix(OWNER), platform.node()
    try:
        with place.open("x", encoding="utf-8") as file:
            file.write(f"{os.getpid()} {here}")
        return True
    except FileExistsError:
        pass
    with suppress(OSError, ValueError):
        number, _, machine = place.read_text(encoding="utf-8").partition(" ")
        if machine == here and not _runs(int(number)):
            place.unlink()
    return False


def _runs(number: int) -> bool:
    """Return True if the process with this number is running on this computer."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _clean(folder: Path, hidden: str) -> None:
    """Remove the hidden files of a result folder.

    `hidden` is the prefix of their names. If there is no folder with the final name, the old folder gets this name
    again. Otherwise, files that exist only in the old folder are moved into the new folder, see `complete`.
    """
    part, old = (folder.with_name(f"{hidden}{end}") for end in (".part", ".old"))
    shutil.rmtree(part, ignore_errors=True)
    with suppress(OSError):
        part.unlink()
    if not old.is_dir():
        return
    if not folder.exists():
        old.rename(folder)
        return
    for place in (old, *(path for path in old.rglob("*") if path.is_dir())):
        with suppress(OSError):
            place.chmod(0o700)  # files in a read-only folder could not be removed
    others = {*foreign(old), EARLIER}
    for entry in sorted(old.iterdir(), key=lambda each: each.name not in others):  # files of the user first
        if not (folder / entry.name).exists():
            _move(entry, folder if entry.name in others else folder / EARLIER)
    shutil.rmtree(old, ignore_errors=True)


def _move(entry: Path, folder: Path) -> None:
    """Move a file or folder into a folder. If the name already exists in this folder, append a number to the name."""
    folder.mkdir(exist_ok=True)
    place, number = folder / entry.name, 1
    while place.exists() or place.is_symlink():
        number += 1
        place = folder / f"{entry.stem}.{number}{entry.suffix}"
    entry.rename(place)


def _ours(folder: Path) -> set[str]:
    """Return the names of the files in a folder that this program has written, as listed in the summary.

    If the summary is not valid JSON, return the names of the files that are named like files of this program.
    """
    known = summary_in(folder)
    if known is None:
        found = _written() & {entry.name for entry in folder.iterdir()}
        return {*found, SUMMARY} if found else set()
    return own_names(known) if known else set()


def _move_aside(folder: Path) -> None:
    """Find files of this program that the user has edited, and rename them to `NAME.edited.EXT`."""
    for name in changed(folder):
        path, number = folder / name, 1
        while (aside := path.with_name(f"{path.stem}.edited{number if number > 1 else ''}{path.suffix}")).exists():
            number += 1
        path.rename(aside)


def _written() -> set[str]:
    """Return all file names that this program uses. Tables are included in all file formats."""
    names = written()
    tables = [name.removesuffix(".csv") for name in names if name.endswith(".csv")]
    return names | {f"{name}.{kind}" for name in tables for kind in FORMATS}


def _refuse_to_replace(folder: Path, names: set[str]) -> None:
    """Raise RequestError if a new file has the same name as a file that this program did not write."""
    clash = sorted(names & set(foreign(folder)))
    if clash:
        shown = plain(str(folder), LINE)
        raise RequestError(
            f'"{shown}" has files of other origin ({", ".join(clash[:3])}): move them, or choose another -o'
        )
