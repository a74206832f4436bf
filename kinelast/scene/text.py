"""The text of a scene's file, and the file's name in messages about it."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from kinelast.scene.error import SceneError
from kinelast.scene.parsing import parse_toml


def file_text(path: Path) -> str:
    """The text of a file; SceneError where it cannot be read."""
    try:
        return path.read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        raise SceneError(str(path), "", "", "there is no such file") from None
    except OSError as error:
        raise SceneError(str(path), "", "", f"not readable: {error.strerror}") from None
    except UnicodeDecodeError as error:
        line = error.object[: error.start].count(b"\n") + 1
        raise SceneError(str(path), "", "", f"not a text in UTF-8 at line {line}: save it in UTF-8") from None


def toml_tables(text: str, path: str) -> dict[str, Any]:
    """The tables in a TOML text; SceneError where it is none."""
    with of_file(path):
        return parse_toml(text)


@contextmanager
def of_file(path: str) -> Iterator[None]:
    """Add the file to what is said of a mistake in it."""
    try:
        yield
    except SceneError as error:
        raise SceneError(path, error.table, error.key, error.problem) from None
