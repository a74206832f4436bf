"""The file of a live scene: read, watched, and written as a whole where it is still the one that was read."""

from __future__ import annotations

import os
import tempfile
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from kinelast.scene.error import MissingFileError, SceneError
from kinelast.scene.text import decoded, file_bytes

MISSING = "missing"
UNREADABLE = "unreadable"


class ChangedError(Exception):
    """The file on disk is not the one that was read."""


@dataclass(frozen=True)
class SceneFile:
    """The one file that is read and written; None where none was given.

    Attributes
    ----------
    path
        The file, whether it is there or not.
    first
        The text to begin with where it is not there.
    """

    path: Path | None
    first: str = ""

    @property
    def folder(self) -> Path | None:
        """Where the files are that the scene may name; None where it is no file."""
        return None if self.path is None else self.path.parent

    def read(self) -> tuple[str, str]:
        """The text and its digest; SceneError where the file cannot be read."""
        if self.path is None or not self.path.exists():
            return self.first, MISSING
        content = file_bytes(self.path)
        return decoded(content, str(self.path)), _digest(content)

    def digest(self) -> str:
        """Return the digest of the file as it is now; `UNREADABLE` for a pipe, a folder or a file that is too large."""
        try:
            return MISSING if self.path is None else _digest(file_bytes(self.path))
        except MissingFileError:
            return MISSING
        except SceneError:
            return UNREADABLE

    def write(self, text: str, known: str) -> str:
        """The digest of the file with a text written into it.

        Parameters
        ----------
        known
            The digest of the file as it was read.

        Raises
        ------
        ChangedError
            The file is no longer that one; nothing is written.
        OSError
            The disk does not take it; the file stays as it was.
        """
        if self.path is None:
            raise ChangedError("no file was given to the command: download the text instead")
        if self.digest() not in (known, MISSING):
            raise ChangedError(f"{self.path.name} has changed on disk since it was read: nothing was overwritten")
        target = self.path.resolve()  # a link stays one
        content = text.encode("utf-8")
        number, name = tempfile.mkstemp(prefix=f".{target.name}.", dir=target.parent)
        try:
            with os.fdopen(number, "wb") as file:
                file.write(content)
                file.flush()
                os.fsync(file.fileno())
            mode = target.stat().st_mode & 0o777 if target.exists() else 0o666 & ~_umask()
            Path(name).chmod(mode)
            Path(name).replace(target)
        except BaseException:
            with suppress(OSError):
                Path(name).unlink()
            raise
        return _digest(content)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()
