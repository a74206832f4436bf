"""File of a live scene: read, watch, and overwrite it if unchanged on disk."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from kinelast.outputs.outbox import put
from kinelast.scene.error import MissingFileError, SceneError
from kinelast.scene.text import decoded, file_bytes

MISSING = "missing"
UNREADABLE = "unreadable"


class ChangedError(Exception):
    """The file on disk has changed since it was read."""


@dataclass(frozen=True)
class SceneFile:
    """The only file that the editor reads and writes; `path` is None if there is no file.

    Attributes
    ----------
    path
        Path of the file, which may not exist yet.
    first
        Initial text if the file does not exist.
    """

    path: Path | None
    first: str = ""

    @property
    def folder(self) -> Path | None:
        """Folder of the files that the scene names, or None."""
        return None if self.path is None else self.path.parent

    def read(self) -> tuple[str, str]:
        """Return the text and its checksum; raise SceneError if the file cannot be read."""
        if self.path is None or not self.path.exists():
            return self.first, MISSING
        content = file_bytes(self.path)
        return decoded(content, str(self.path)), _digest(content)

    def digest(self) -> str:
        """Checksum of the file on disk; `UNREADABLE` for a pipe, a folder or a file that is too large."""
        try:
            return MISSING if self.path is None else _digest(file_bytes(self.path))
        except MissingFileError:
            return MISSING
        except SceneError:
            return UNREADABLE

    def write(self, text: str, known: str) -> str:
        """Overwrite the file with a text and return its checksum.

        Parameters
        ----------
        known
            Checksum that the file had when it was read.

        Raises
        ------
        ChangedError
            If the file has changed since then; it is not overwritten.
        OSError
            If the file cannot be written; it stays unchanged.
        """
        if self.path is None:
            raise ChangedError("no file was given to the command: download the text instead")
        if self.digest() not in (known, MISSING):
            raise ChangedError(f"{self.path.name} has changed on disk since it was read: nothing was overwritten")
        target = self.path.resolve()  # write through a symbolic link
        content = text.encode("utf-8")
        put(target, content)
        return _digest(content)


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()
