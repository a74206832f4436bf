"""Export of pictures and films, and rendering without a screen."""

import os
import subprocess
import sys
from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from functools import cache
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from msgspec.structs import replace

from animations.diagrams import diagram_named
from animations.layout import drawable
from animations.picture import Picture
from animations.style import Style
from elastic import Deflection

MOVIES = (".mp4", ".gif", ".png")
FRAMES = 120
RATE = 25.0
"""Default frame rate of a film [1/s]."""
CODECS: dict[str, dict[str, Any]] = {
    ".mp4": {
        "codec": "libx264",
        "quality": 8,
        "output_params": ["-preset", "veryfast"],  # takes half the time of "medium", for the same file size
    },
    ".gif": {
        # The palette is computed from the first 8 frames, which include the legend.
        # A palette for all frames would need too much memory.
        "codec": "gif",
        "pix_fmt_out": "pal8",
        "quality": None,
        "bitrate": "1M",  # the codec ignores it, but without it a bit rate would be guessed
        "output_params": [
            "-filter_complex",
            "[0:v]split[a][b];[a]trim=end_frame=8,palettegen[p];[b][p]paletteuse=dither=none:diff_mode=rectangle",
            *("-loop", "0"),
        ],
    },
}
Progress = Callable[[int, int], None]
WINDOW = "VTK_DEFAULT_OPENGL_WINDOW"
OFF_SCREEN = ("vtkEGLRenderWindow", "vtkOSOpenGLRenderWindow")
TRIAL = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderer, vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(16, 16)
window.AddRenderer(vtkRenderer())
window.Render()
"""


def stills(
    deflection: Deflection,
    diagram: str,
    positions: Sequence[int],
    path: str | Path,
    style: Style | None = None,
    on_frame: Progress | None = None,
) -> tuple[Path, ...]:
    """Write one picture for each given position.

    Parameters
    ----------
    diagram
        One of `DIAGRAMS`.
    positions
        Indices of the positions.
    path
        A .png file. If there are several positions, each file name ends with the index of the position.
    on_frame
        Function that is called after each picture with the number of finished pictures and the total.

    Returns
    -------
    The files written.

    Raises
    ------
    ValueError
        If a position is unknown or singular, or the diagram or file type is unknown.
    RenderingUnavailable
        The machine has no OpenGL.
    """
    path = _of_type(path, (".png",))
    possible = drawable(deflection, diagram_named(diagram))
    count = deflection.motion.columns[-1]
    for position in positions:
        if not 0 <= position < count:
            raise ValueError(f"there is no position {position}: choose from 0 to {count - 1}")
        if position not in possible:
            raise ValueError(f"position {position} cannot be drawn: it is singular or out of reach")
    digits = len(str(count - 1))
    names = [path]
    if len(positions) > 1:
        names = [path.with_name(f"{path.stem}-{position:0{digits}d}.png") for position in positions]
    with closing(_frames(deflection, diagram, positions, style, on_frame)) as images:
        for name, image in zip(names, images, strict=True):
            _save(name, image)
    return tuple(names)


def movie(
    deflection: Deflection,
    diagram: str,
    path: str | Path,
    frames: int | None = None,
    style: Style | None = None,
    on_frame: Progress | None = None,
    rate: float = RATE,
) -> tuple[Path, ...]:
    """Write a film of a diagram over the motion.

    Parameters
    ----------
    diagram
        One of `DIAGRAMS`.
    path
        A .mp4 or .gif file, or a .png file for numbered stills.
    frames
        Number of frames, at evenly spaced positions. The default is one frame per drawable position, at most 120.
    on_frame
        Function that is called after each frame with the number of finished frames and the total.
    rate
        Frames per second.

    Returns
    -------
    The files written.

    Raises
    ------
    ValueError
        If there are more frames than positions, or the diagram or file type is unknown.
    RenderingUnavailable
        The machine has no OpenGL.
    """
    path = _of_type(path, MOVIES)
    chosen = spread(drawable(deflection, diagram_named(diagram)), frames)
    if path.suffix.lower() == ".png":
        return stills(deflection, diagram, chosen, path, style, on_frame)
    style = replace(style or Style(), pace=pace_words(deflection.motion.time, chosen, rate))
    with closing(_frames(deflection, diagram, chosen, style, on_frame)) as images, _complete(path) as unfinished:
        _write(unfinished, images, rate)
    return (path,)


def pace_words(time: Any, chosen: Sequence[int], rate: float) -> str:
    """Describe the speed of the film relative to the machine, or return "" if the times are unknown.

    >>> pace_words(np.linspace(0.0, 0.1, 51), range(51), 25.0)
    'slow motion 1 : 20'
    >>> pace_words(np.linspace(0.0, 0.01, 31), range(31), 25.0)
    'slow motion 1 : 120'
    """
    lasts = float(time[chosen[-1]] - time[chosen[0]])
    if lasts <= 0.0 or np.array_equal(time, np.arange(len(time))):
        return ""
    slower = (len(chosen) - 1) / rate / lasts
    if 0.95 < slower < 1.05:
        return "in real time"
    if slower < 1:
        return f"{1 / slower:.2g} times as fast as the machine"
    return f"slow motion 1 : {float(f'{slower:.2g}'):g}"


def spread(possible: Any, frames: int | None) -> list[int]:
    """Choose evenly spaced positions.

    >>> spread([0, 1, 2, 4, 5, 6], 3)
    [0, 2, 5]
    """
    count = min(len(possible), FRAMES) if frames is None else frames
    if not 1 <= count <= len(possible):
        raise ValueError(
            f"{count} frames from {len(possible)} positions that can be drawn: choose 1 to {len(possible)}"
        )
    return [int(possible[k * len(possible) // count]) for k in range(count)]


def _frames(
    deflection: Deflection, diagram: str, positions: Sequence[int], style: Style | None, on_frame: Progress | None
) -> Generator[Any, None, None]:
    """Yield the images of the given positions."""
    with off_screen(), Picture(deflection, diagram, style or Style()) as picture:
        for done, position in enumerate(positions, 1):
            yield picture.show(position)
            if on_frame:
                on_frame(done, len(positions))


def _of_type(path: str | Path, types: tuple[str, ...]) -> Path:
    path = Path(path)
    if path.suffix.lower() not in types:
        raise ValueError(f'"{path.name}": the name must end in {" or ".join(types)}')
    return path


@contextmanager
def _complete(path: Path) -> Iterator[Path]:
    """Yield a temporary path in the same folder, which is renamed to `path` on success."""
    unfinished = path.with_name(f".{path.stem}.part{path.suffix.lower()}")
    try:
        yield unfinished
        unfinished.replace(path)
    finally:
        unfinished.unlink(missing_ok=True)


def _save(path: Path, image: Any) -> None:
    from PIL import Image

    with _complete(path) as unfinished:
        Image.fromarray(image).save(unfinished)


def _write(path: Path, images: Iterator[Any], rate: float) -> None:
    """Write a film frame by frame through ffmpeg."""
    from imageio_ffmpeg import write_frames

    first = next(images)
    height, width = first.shape[:2]
    film = write_frames(
        str(path), (width, height), fps=rate, macro_block_size=2, ffmpeg_log_level="quiet", **CODECS[path.suffix]
    )
    with closing(film):
        film.send(None)
        for image in chain([first], images):
            film.send(np.ascontiguousarray(image))


class RenderingUnavailable(RuntimeError):  # noqa: N818 - names the condition, not an error
    """Raised if this machine cannot render; the message names the library to install."""


@cache
def probe() -> str | None:
    """Find a VTK window class that works, by a trial in a child process. The result is cached.

    Returns
    -------
    Name of the window class, or None for the default of VTK.

    Raises
    ------
    RenderingUnavailable
        If no window class works.
    """
    chosen: tuple[str | None, ...] = (None,)
    if sys.platform.startswith("linux") and WINDOW not in os.environ:
        chosen = (*OFF_SCREEN, None)  # `OFF_SCREEN` first: it needs no display, and $DISPLAY may be invalid
    for window in chosen:
        if _renders(window):
            return window
    raise RenderingUnavailable(
        "pictures need OpenGL, and rendering an empty window failed. On Debian or Ubuntu install it by "
        "`sudo apt install libegl1 libgl1`, or software rendering alone by `sudo apt install libosmesa6`. "
        "Everything else works without OpenGL: motion, deflection, reports, tables, finite element checks and meshes."
    )


def _renders(window: str | None) -> bool:
    environment = os.environ if window is None else {**os.environ, WINDOW: window}
    try:
        trial = subprocess.run(
            [sys.executable, "-c", TRIAL], env=environment, capture_output=True, timeout=60, check=False
        )
    except (OSError, subprocess.TimeoutExpired):
        return False
    return trial.returncode == 0


@contextmanager
def off_screen() -> Iterator[None]:
    """Render with the window class found by `probe`, and raise errors of VTK at the end.

    Raises
    ------
    RenderingUnavailable
        See `probe`.
    RuntimeError
        If VTK reported an error.
    """
    window = probe()
    import pyvista as pv

    before = os.environ.get(WINDOW)
    if window is not None:
        os.environ[WINDOW] = window
    try:
        with pv.VtkErrorCatcher(raise_errors=True, send_to_logging=False):
            yield
    finally:
        if window is not None and before is None:
            del os.environ[WINDOW]
