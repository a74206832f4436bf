"""Scene file of the editor: read it, detect changes on disk, and write it if it has not changed."""

from hashlib import sha256
from pathlib import Path

from msgspec import Struct

from kinelast.outputs.outbox import put
from kinelast.scene.text import decoded, file_bytes
from kinelast.values.error import MissingFileError, SceneError

MISSING = "missing"
UNREADABLE = "unreadable"


class ChangedError(Exception):
    """The file has changed on disk since it was read, or the editor has no file."""


class SceneFile(Struct, frozen=True):
    """The only file that the editor reads and writes.

    Attributes
    ----------
    path
        Path of the file, or None if the editor has no file. The file need not exist.
    first
        Initial text if the file does not exist.
    """

    path: Path | None
    first: str = ""

    @property
    def folder(self) -> Path | None:
        """Folder of the files to which the scene refers, or None."""
        return None if self.path is None else self.path.parent

    def read(self) -> tuple[str, str]:
        """Return the text of the file and its checksum. Raise SceneError if the file cannot be read.

        If the file does not exist, return the initial text and `MISSING`.
        """
        if self.path is None or not self.path.exists():
            return self.first, MISSING
        content = file_bytes(self.path)
        return decoded(content, str(self.path)), _digest(content)

    def digest(self) -> str:
        """Return the checksum of the file on disk, `MISSING`, or `UNREADABLE` (e.g. a folder or a very large file)."""
        try:
            return MISSING if self.path is None else _digest(file_bytes(self.path))
        except MissingFileError:
            return MISSING
        except SceneError:
            return UNREADABLE

    def write(self, text: str, known: str) -> str:
        """Write a text to the file; return the checksum of the text.

        Parameters
        ----------
        known
            Checksum of the file when it was read.

        Raises
        ------
        ChangedError
            The file has changed since it was read, and is not overwritten. Or the editor has no file.
        OSError
            The file cannot be written, and stays unchanged.
        """
        if self.path is None:
            raise ChangedError("the editor was started without a file: download the text instead")
        if self.digest() not in (known, MISSING):
            raise ChangedError(f"{self.path.name} has changed on disk since it was read: nothing was overwritten")
        target = self.path.resolve()  # follow a symbolic link
        content = text.encode("utf-8")
        put(target, content)
        return _digest(content)


def _digest(content: bytes) -> str:
    return sha256(content).hexdigest()
