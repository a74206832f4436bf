"""Places of results: a folder or file that appears all at once, beside the files of others, while other runs wait.

A folder is written beside its place under a name of its own and then exchanged with what is there, while a lock keeps
other runs from the same folder. The lock's file tells the name: whoever finds it of a run that was killed cleans up.
"""

from __future__ import annotations

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

HIDDEN = ".kinelast-"  # locks and unfinished folders
UNFINISHED = ".part"  # files
OWNER = ".owner"  # in the place of a lock
PATIENCE = 60.0  # [s] that another run may take to write the same folder
PAUSE = 0.05  # [s] between two tries
LINE = 300  # letters of a message


@contextmanager
def complete(folder: Path) -> Iterator[Path]:
    """A folder to write to, which takes the place of `folder` when all has gone well and vanishes when not.

    What somebody else has put into `folder` stays there, see `foreign`; so do files of earlier runs that the new
    summary lists as `earlier`. A file that was changed by hand is moved aside, as `NAME.edited.EXT`, and not replaced.

    Raises
    ------
    RequestError
        Somebody else's file has the name of one that is written; another run does not let go of the folder; it cannot
        be made.
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
                _move_aside(folder, made)
                folder.rename(old)
            part.rename(folder)
        finally:
            with signals_held_back():
                _clean(folder, hidden)


def rewritten(path: Path, ours: Callable[[], bool], content: Callable[[], bytes]) -> None:
    """Make a file of this program anew, of its content where need be, while other runs wait.

    Raises
    ------
    RequestError
        The file that is there is of somebody else; another run does not let go of it.
    """
    with locked(path) as hidden:
        if path.exists() and not ours():
            raise RequestError(f'"{plain(str(path), LINE)}" was not written by this program: it is left as it is')
        put(path, content(), unfinished=f"{hidden}.part")


def put(path: Path, content: bytes, *more: Path, unfinished: str = "") -> None:
    """Write a file that appears in its place as a whole: content, and that of `more` files behind it.

    It is on the disk before its name is. Whether the name is, is left to the system: where the machine fails right
    after, the file may be missing.
    """
    part = path.with_name(unfinished or f".{path.name}{UNFINISHED}")
    try:
        with part.open("wb") as file:
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
    """Wait until the disk has a file, which is when it finds that it is full."""
    os.fsync(file)


def add_to(folder: Path, texts: Mapping[str, str], summary: Mapping[str, Any]) -> None:
    """Put texts by their file names into a folder, beside files that this program has written there before.

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
    """Put texts into a folder by way of a hidden one, its summary last."""
    for name, text in texts.items():
        (part / name).write_text(text, encoding="utf-8", newline="")
    write_json(part / SUMMARY, with_files(known, part))
    folder.mkdir(exist_ok=True)
    for entry in sorted(part.iterdir(), key=lambda each: each.name == SUMMARY):
        entry.replace(folder / entry.name)


def foreign(folder: Path, summary: Mapping[str, Any] | None = None) -> list[str]:
    """Names of files that somebody else has put into a folder; its summary, where that is known already."""
    with suppress(OSError):
        names = {entry.name for entry in folder.iterdir()}
        return sorted(names - (own_names(summary) if summary else _ours(folder))) if names else []
    return []


def recovered(folder: Path) -> None:
    """Clear away the leftovers of a process that has died, and bring back the folder that was there before."""
    with suppress(OSError, RequestError):
        if _lock_of(folder).exists():
            with locked(folder):
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
def locked(folder: Path, patience: float | None = None) -> Iterator[str]:
    """Keep other runs from a folder or file; the name for hidden files beside it meanwhile.

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
    left = (PATIENCE if patience is None else patience) / PAUSE  # tries, not a time: a machine may sleep meanwhile
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
                _let_go(path, lock, folder, hidden)
            for place in fresh:
                with suppress(OSError):
                    place.rmdir()  # unless something stands in it


def _mark(lock: int, folder: Path, hidden: str) -> None:
    """Write the name for hidden files into a lock's file; those of a run that was killed are removed before."""
    before = os.read(lock, 100).decode("ascii", "replace")
    if re.fullmatch(re.escape(HIDDEN) + "[0-9a-f]{16}", before):
        _clean(folder, before)
    os.lseek(lock, 0, os.SEEK_SET)
    os.ftruncate(lock, 0)
    os.write(lock, hidden.encode())


def _let_go(path: Path, lock: int, folder: Path, hidden: str) -> None:
    """Let go of a lock; its file goes too unless hidden files are left that it tells of."""
    with suppress(OSError):
        folder.with_name(f"{hidden}.part").unlink()  # where it is a file that was not finished
    if not any(folder.with_name(f"{hidden}{end}").exists() for end in (".part", ".old")):
        with suppress(OSError):
            path.unlink()  # before it is let go of: whoever has waited for it looks whether it is still there
    with suppress(OSError):
        path.with_suffix(OWNER).unlink()
    os.close(lock)


def _tried(path: Path) -> tuple[int | None, str]:
    """A lock's file, open and held, or None where another run holds it; and more to say on that.

    The system lets go of it with the process, however that ends.
    """
    lock = os.open(path, os.O_RDWR | os.O_CREAT, 0o644)
    try:
        import fcntl

        fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        os.close(lock)
        return None, ""
    except ImportError:  # a system without such locks: the names alone keep two runs apart
        return lock, ""
    except OSError:  # a file system without them, as that of another machine may be
        os.close(lock)
        if _owned(path):  # whoever owned it before may have removed the file that was open here
            return os.open(path, os.O_RDWR | os.O_CREAT, 0o644), ""
        return None, f'; if there is none, remove "{plain(str(path.with_suffix(OWNER)), LINE)}"'
    with suppress(OSError):
        if os.fstat(lock).st_ino == path.stat().st_ino:
            return lock, ""
    os.close(lock)
    return None, ""


def _owned(path: Path) -> bool:
    """Whether this process could make the file that stands for a lock where there are no locks.

    That of a process of this machine that has ended is taken away; any other is waited for.
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
    """Whether a process of this machine runs."""
    try:
        os.kill(number, 0)
    except ProcessLookupError:
        return False
    except PermissionError:
        pass
    return True


def _clean(folder: Path, hidden: str) -> None:
    """Remove the hidden files beside a folder; files that stood in it and were not replaced go back."""
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
            place.chmod(0o700)  # so that what was written to be read alone goes away, too
    staying = {*foreign(old), *own_names(summary_in(folder) or {})}
    for name in (entry.name for entry in list(old.iterdir())):
        if name in staying and not (folder / name).exists():
            (old / name).rename(folder / name)
    shutil.rmtree(old, ignore_errors=True)


def _ours(folder: Path) -> set[str]:
    """Names of the files that this program has written into a folder, as its summary tells.

    Where that cannot be read, by a fault of the disk or of an editor, all names that this program uses.
    """
    known = summary_in(folder)
    if known is None:
        found = _written() & {entry.name for entry in folder.iterdir()}
        return {*found, SUMMARY} if found else set()
    return own_names(known) if known else set()


def _move_aside(folder: Path, made: set[str]) -> None:
    """Give files that are to be replaced, but were changed by hand, a name of their own."""
    for name in made & set(changed(folder)):
        path, number = folder / name, 1
        while (aside := path.with_name(f"{path.stem}.edited{number if number > 1 else ''}{path.suffix}")).exists():
            number += 1
        path.rename(aside)


def _written() -> set[str]:
    """Names that this program gives to files, tables in every format."""
    names = written()
    tables = [name.removesuffix(".csv") for name in names if name.endswith(".csv")]
    return names | {f"{name}.{kind}" for name in tables for kind in FORMATS}


def _refuse_to_replace(folder: Path, names: set[str]) -> None:
    """Raise where files of somebody else have names that are to be written."""
    clash = sorted(names & set(foreign(folder)))
    if clash:
        shown = plain(str(folder), LINE)
        raise RequestError(
            f'"{shown}" holds what this program did not write ({", ".join(clash[:3])}): move it, or choose another -o'
        )
