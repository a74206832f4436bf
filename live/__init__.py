"""The live editor: a scene drawn, moved and bent in the browser, beside the text of its file."""

from collections.abc import Callable

__all__ = ["serve"]


def serve(argument: str | None, tell: Callable[[str], None], browse: bool = True) -> int:
    """Serve the editor of a scene until it is interrupted, as `live.server.serve`; the exit status.

    Raises
    ------
    ModuleNotFoundError
        Starlette or uvicorn is not installed.
    """
    from live.server import serve

    return serve(argument, tell, browse)
