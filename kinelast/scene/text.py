"""The text of a scene's file, and the file's name in messages about it."""

from __future__ import annotations

import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinelast.scene.error import SceneError
from kinelast.scene.parsing import parse_toml

LARGEST_FILE = 4_000_000  # bytes: a table of 100,000 entries


def file_bytes(path: Path) -> bytes:
    """Bytes of a scene's file, read once; SceneError where it cannot be read or is no file of a scene's size."""
    try:
        if not stat.S_ISREG(path.stat().st_mode):
            raise OSError("a folder, a pipe or a device is no scene")
        with path.open("rb") as file:
            content = file.read(LARGEST_FILE + 1)
    except FileNotFoundError:
        raise SceneError(str(path), "", "", "there is no such file") from None
    except (OSError, ValueError) as error:  # a name that holds a null character is a ValueError
        problem = getattr(error, "strerror", None) or str(error)
        raise SceneError(str(path), "", "", f"not readable: {problem}") from None
    if len(content) > LARGEST_FILE:
        raise SceneError(str(path), "", "", f"larger than {LARGEST_FILE // 1_000_000} MB: too large for a scene")
    return content


def decoded(content: bytes, path: str) -> str:
    """The text in a file's bytes; SceneError where they are none."""
    try:
        return content.decode("utf-8-sig").replace("\r\n", "\n").replace("\r", "\n")
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise SceneError(path, "", "", f"not a text in UTF-8 at line {line}: save it in UTF-8") from None


def file_text(path: Path) -> str:
    """The text of a file; SceneError where it cannot be read."""
    return decoded(file_bytes(path), str(path))


def scene_name(path: Path) -> str:
    """The name of a scene, of the letters in its file's name."""
    return path.stem.encode("utf-8", "surrogateescape").decode("utf-8", "replace")


def toml_tables(text: str, path: str) -> dict[str, Any]:
    """The tables in a TOML text; SceneError where it is none."""
    with of_file(path):
        return parse_toml(text)


@contextmanager
def of_file(path: str) -> Iterator[None]:
    """Add the file to the message of a mistake in it."""
    try:
        yield
    except SceneError as error:
        raise SceneError(path, error.table, error.key, error.problem) from None
    except RecursionError:
        raise SceneError(path, "", "", "lists or tables in one another go too deep for a scene") from None
