"""The live editor: a scene drawn, moved and bent in the browser, beside the text of its file."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from kinelast.scene.data import Scene
    from kinelast.scene.document import Document
    from live.notebook import LiveView

__all__ = ["serve", "view"]


def serve(argument: str | None, tell: Callable[[str], None], browse: bool = True) -> int:
    """Serve the editor of a scene until it is interrupted, as `live.server.serve`; the exit status.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    """
    from live.server import serve

    return serve(argument, tell, browse)


def view(given: Scene | Document | str | Path | None) -> LiveView:
    """The editor of a scene as a notebook shows it, as `kinelast.live`.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    """
    from live.notebook import LiveView

    return LiveView(given)
