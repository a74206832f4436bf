"""Live editor of a scene (a mechanism with its motion): draw, move and load the mechanism in the browser."""

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
    """Serve the editor of a scene until interrupted; return the exit status, see `live.server.serve`.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    """
    from live.server import serve

    return serve(argument, tell, browse)


def view(given: Scene | Document | str | Path | None) -> LiveView:
    """Return the editor of a scene for a notebook, see `kinelast.live`.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    """
    from live.notebook import LiveView

    return LiveView(given)
