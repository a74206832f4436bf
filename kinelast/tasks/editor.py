"""The live editor, provided by another package through an entry point."""

from __future__ import annotations

from collections.abc import Callable
from importlib.metadata import entry_points
from typing import Any, Protocol, cast

GROUP = "kinelast.editor"  # entry point that names a module


class NoEditorError(LookupError):
    """No package provides an editor."""


class Editor(Protocol):
    """The functions of a module that edits scenes in a browser."""

    def serve(self, argument: str | None, tell: Callable[[str], None]) -> int:
        """Serve the editor of a scene until it is interrupted, and return the exit status."""

    def view(self, given: Any) -> Any:
        """Return the editor of a scene for a notebook."""


def installed_editor() -> Editor:
    """The installed editor.

    Raises
    ------
    NoEditorError
        No package provides an editor.
    """
    for entry in entry_points(group=GROUP):
        return cast(Editor, entry.load())
    raise NoEditorError(f"no package provides a live editor (entry point {GROUP}): install kinelast again")
