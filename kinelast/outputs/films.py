"""Films of a scene, as they are asked for."""

from __future__ import annotations

import errno
import os
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from kinelast.figures.results import Results
from kinelast.scene.data import Scene
from kinelast.tasks.request import Request, RequestError

if TYPE_CHECKING:
    from animations import Style

LITTLE = 1_000_000  # bytes that are free on a disk that is full to an encoder, which writes by blocks


def require_rendering() -> None:
    """Raise `RequestError` where nothing can be drawn on this machine."""
    from animations import RenderingUnavailable, probe

    try:
        probe()
    except RenderingUnavailable as error:
        raise RequestError(f"--animate: {error}") from None


def draw_film(
    part: Path, results: Results, diagram: str, request: Request, on_frame: Callable[[int, int], None]
) -> None:
    """A film, or numbered stills, of a diagram.

    Raises
    ------
    ValueError
        More frames than positions; a field that is not known.
    OSError
        It cannot be written, as where the disk is full.
    """
    from animations import RATE, movie

    target, rate = part / f"{diagram}.{request.picture}", request.fps or RATE
    try:
        movie(results.deflection, diagram, target, request.frames, style_of(results.scene, request), on_frame, rate)
    except OSError as error:
        raise _without_encoder(error, target) from None


def _without_encoder(error: OSError, target: Path) -> OSError:
    """A fault of writing in the system's words: where the encoder has died of it, its own are a command line."""
    if error.errno not in (None, errno.EPIPE):
        return error
    if shutil.disk_usage(target.parent).free < LITTLE:
        return OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), str(target))
    return OSError(errno.EPIPE, "the encoder of films (ffmpeg) ended before its time", str(target))


def style_of(scene: Scene, request: Request) -> Style:
    """How a scene is to be drawn."""
    from animations import Style

    asked = {name: getattr(request, name) for name in ("size", "exaggeration", "background", "show")}
    given = {name: value for name, value in asked.items() if value is not None}
    return Style(title=scene.title, outlines=scene.outlines, look=request.style, **given)
