"""Atomic writing of result folders and files. A lock prevents two runs from writing to the same folder.

A run writes its files to a hidden folder. When the hidden folder is complete, the run renames the previous result
folder to another hidden name, and renames the hidden folder to the name of the result folder. The names of all hidden
files of a run start with the same prefix. The lock file contains this prefix. If the run is killed, the next run reads
the prefix from the lock file and removes the hidden files.
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
from kinelast.tasks.progress import signals_held_back
from kinelast.tasks.request import RequestError, written
from kinelast.values.error import plain

EARLIER = "earlier"  # name of the subfolder for result files of earlier runs that the current run does not write
HIDDEN = ".kinelast-"  # start of the names of lock files and hidden folders
UNFINISHED = ".part"  # suffix of unfinished files
OWNER = ".owner"  # suffix of the file that replaces the lock file on file systems without locks
PATIENCE = 60.0  # [s] maximum time to wait until another run releases a lock
PAUSE = 0.05  # [s] pause between two attempts to get a lock
LINE = 300  # maximum number of characters of a path in an error message


@contextmanager
def complete(folder: Path) -> Iterator[Path]:
    """Yield a hidden folder for new result files. On success, the hidden folder replaces `folder`.

    If an exception occurs, the hidden folder is removed and `folder` is kept. When the hidden folder replaces
    `folder`, the existing files are treated as follows:

    - A file that this program did not write stays in the folder (see `foreign`).
    - A file that this program wrote and the user has edited is renamed to `NAME.edited.EXT`.
    - A file of an earlier run is deleted if this run has written a file with the same name. Otherwise it is moved to
      the subfolder `EARLIER`.

    Raises
    ------
    RequestError
        A new file would replace a file that this program did not write, another run has locked the folder, or the
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
    """Write a file, or replace an existing file of this program. Other runs are locked out while this run writes.

    `ours` is a function that checks whether this program wrote the existing file. `content` is a function that returns
    the new content.

    Raises
    ------
    RequestError
        This program did not write the existing file (`ours` returns False), or another run has locked the file.
    """
    with locked(path) as hidden:
        if path.exists() and not ours():
            raise RequestError(f'"{plain(str(path), LINE)}" was not written by this program and is not replaced')
        put(path, content(), unfinished=f"{hidden}.part")


def put(path: Path, content: bytes, *more: Path, unfinished: str = "") -> None:
    """Write `content`, followed by the contents of the files `more`, to the file `path` atomically.

    First write a temporary file. When all data are on the disk, rename the temporary file to `path`. After a power
    failure, `path` may be missing or have its previous content, but `path` is never incomplete.
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
    """Wait until the operating system has written a file to the disk. Raise OSError if the disk is full."""
    os.fsync(file)


def add_to(folder: Path, texts: Mapping[str, str], summary: Mapping[str, Any]) -> None:
    """Add text files to a result folder, and list the added files in summary.json.

    Parameters
    ----------
    summary
        Content of a new summary.json, used if the folder has no summary.json.

    Raises
    ------
    RequestError
        A new file would replace a file that this program did not write, another run has locked the folder, or the
        folder cannot be created.
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
    """Write text files and the summary to the hidden folder `part`. Move all files to `folder`, the summary last."""
    for name, text in texts.items():
        (part / name).write_text(text, encoding="utf-8", newline="")
    write_json(part / SUMMARY, with_files(known, part))
    folder.mkdir(exist_ok=True)
    for entry in sorted(part.iterdir(), key=lambda each: each.name == SUMMARY):
        entry.replace(folder / entry.name)


def foreign(folder: Path, summary: Mapping[str, Any] | None = None) -> list[str]:
    """Return the names of the files in a folder that this program did not write.

    Files that the summary of the folder does not list count as written by others. If `summary` is None, the summary is
    read from the folder.
    """
    with suppress(OSError):
        names = {entry.name for entry in folder.iterdir()}
        return sorted(names - {EARLIER} - (own_names(summary) if summary else _ours(folder))) if names else []
    return []


def recovered(folder: Path) -> None:
    """Remove the hidden files of a killed run. If the killed run had renamed `folder`, undo the renaming."""
    with suppress(OSError, RequestError):
        if _lock_of(folder).exists():
            with locked(folder):
                pass


def _require_place(folder: Path) -> None:
    """Raise RequestError if a file or a link has the name of the result folder, or of its subfolder `EARLIER`."""
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
    """Lock a folder or file against other runs. Yield the prefix for the names of the hidden files of this run.

    Parameters
    ----------
    patience
        Maximum time to wait until another run releases the lock [s] (default: `PATIENCE`).

    Raises
    ------
    RequestError
        Another run has not released the lock within `patience`, or the lock file or the parent folder cannot be
        created.
    """
    fresh: list[Path] = []
    hidden = HIDDEN + os.urandom(8).hex()
    path, shown = _lock_of(folder), plain(str(folder), LINE)
    # Count attempts instead of measuring time, because time also passes while the computer sleeps.
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
                    place.rmdir()  # rmdir only removes empty folders


def _mark(lock: int, folder: Path, hidden: str) -> None:
    """Write the prefix `hidden` of this run to the lock file.

    If the lock file contains the prefix of a killed run, first remove the hidden files of the killed run.
    """
    before = os.read(lock, 100).decode("ascii", "replace")
    if re.fullmatch(re.escape(HIDDEN) + "[0-9a-f]{16}", before):
        _clean(folder, before)
    os.lseek(lock, 0, os.SEEK_SET)
    os.ftruncate(lock, 0)
    os.write(lock, hidden.encode())


def _release(path: Path, lock: int, folder: Path, hidden: str) -> None:
    """Release a lock. Remove the lock file if this run has left no hidden files."""
    with suppress(OSError):
        folder.with_name(f"{hidden}.part").unlink()  # the incomplete file of a failed `put`, if there is one
    if not any(folder.with_name(f"{hidden}{end}").exists() for end in (".part", ".old")):
        with suppress(OSError):
            # Remove the file before the lock is released, because a waiting run then checks whether the file exists.
            path.unlink()
    with suppress(OSError):
        path.with_suffix(OWNER).unlink()
    os.close(lock)


def _tried(path: Path) -> tuple[int | None, str]:
    """Try to lock a file. The operating system releases the lock when the process ends.

    Returns
    -------
    The descriptor of the locked file, or None if another run has locked the file. The second value is a text that the
    caller appends to its error message; the text may be empty.
    """
    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        import fcntl

        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        return None, ""
    except ImportError:  # Windows: without a lock, hidden files of two runs still have different names
        return lock, ""
    except OSError:  # the file system has no locks, for example on a network drive
        os.close(lock)
        if _owned(path):  # open again: the run that had the lock may have removed the file
            return os.open(path, os.O_RDWR | os.O_CREAT, 0o644), ""
        return None, f'; if there is none, remove "{plain(str(path.with_suffix(OWNER)), LINE)}"'
    with suppress(OSError):
        if os.fstat(lock).st_ino == path.stat().st_ino:
            return lock, ""
    os.close(lock)
    return None, ""


def _owned(path: Path) -> bool:
    """Create the owner file (suffix `OWNER`), which replaces the lock. Return False if the owner file already exists.

    The owner file contains the process number and the computer of the run. If the owner file already exists, and its
    process ran on this computer and has ended, remove the owner file. The next call can then create a new owner file.
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
    """Remove the hidden files that a run has created next to a result folder.

    `hidden` is the prefix of the names of the hidden files. If the result folder is missing, rename the hidden previous
    version back to the name of the result folder. Otherwise, move files that exist only in the previous version into
    the result folder or its subfolder `EARLIER` (see `complete`), and delete the previous version.
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
            place.chmod(0o700)  # the files in a read-only folder cannot be removed
    others = {*foreign(old), EARLIER}
    # Move the subfolder `EARLIER` and the files of others first, because the rest is moved into this subfolder.
    for entry in sorted(old.iterdir(), key=lambda each: each.name not in others):
        if not (folder / entry.name).exists():
            _move(entry, folder if entry.name in others else folder / EARLIER)
    shutil.rmtree(old, ignore_errors=True)


def _move(entry: Path, folder: Path) -> None:
    """Move a file or folder into `folder`. If `folder` already contains the name, append a number to the name."""
    folder.mkdir(exist_ok=True)
    place, number = folder / entry.name, 1
    while place.exists() or place.is_symlink():
        number += 1
        place = folder / f"{entry.stem}.{number}{entry.suffix}"
    entry.rename(place)


def _ours(folder: Path) -> set[str]:
    """Return the names of the files that this program wrote to a folder, according to the summary of the folder.

    If the summary is not valid JSON, return the files whose names are among the file names of this program.
    """
    known = summary_in(folder)
    if known is None:
        found = _written() & {entry.name for entry in folder.iterdir()}
        return {*found, SUMMARY} if found else set()
    return own_names(known) if known else set()


def _move_aside(folder: Path) -> None:
    """Rename each file that this program wrote and the user has edited to `NAME.edited.EXT`."""
    for name in changed(folder):
        path, number = folder / name, 1
        while (aside := path.with_name(f"{path.stem}.edited{number if number > 1 else ''}{path.suffix}")).exists():
            number += 1
        path.rename(aside)


def _written() -> set[str]:
    """Return all names of result files. A table has one name for each table format."""
    names = written()
    tables = [name.removesuffix(".csv") for name in names if name.endswith(".csv")]
    return names | {f"{name}.{kind}" for name in tables for kind in FORMATS}


def _refuse_to_replace(folder: Path, names: set[str]) -> None:
    """Raise RequestError if `names` contains a file in the folder that this program did not write."""
    clash = sorted(names & set(foreign(folder)))
    if clash:
        shown = plain(str(folder), LINE)
        raise RequestError(
            f'"{shown}" has files of other origin ({", ".join(clash[:3])}): move them, or choose another -o'
        )
