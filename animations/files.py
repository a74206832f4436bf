"""Pictures and films as files."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator, Sequence
from contextlib import closing, contextmanager
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np

from animations.diagrams import diagram_named
from animations.layout import Style, drawable
from animations.picture import Picture
from animations.rendering import off_screen
from animations.shapes import PAINTS
from elastic import Deflection

MOVIES = (".mp4", ".gif", ".png")
FRAMES = 120
Progress = Callable[[int, int], None]


def stills(
    deflection: Deflection,
    diagram: str,
    positions: Sequence[int],
    path: str | Path,
    style: Style | None = None,
    on_frame: Progress | None = None,
) -> tuple[Path, ...]:
    """A picture at each of some positions.

    Parameters
    ----------
    diagram
        One of `DIAGRAMS`.
    positions
        Their numbers.
    path
        A .png file. Where there are several positions, each file's name ends in its position's number.
    on_frame
        Called with the number of pictures done and to be done after each.

    Returns
    -------
    The files written.

    Raises
    ------
    ValueError
        A position that there is not or that is singular, a diagram or a file type that there is not.
    RenderingUnavailable
        This machine has no OpenGL.
    """
    path = _of_type(path, (".png",))
    possible = drawable(deflection, diagram_named(diagram))
    count = deflection.motion.columns[-1]
    for position in positions:
        if not 0 <= position < count:
            raise ValueError(f"position {position} is not among the {count} positions, 0 to {count - 1}")
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
    rate: int = 25,
) -> tuple[Path, ...]:
    """A film of a diagram over all positions.

    Parameters
    ----------
    diagram
        One of `DIAGRAMS`.
    path
        A .mp4 or .gif file, or .png for numbered stills.
    frames
        How many positions are shown, spread evenly over those that can be drawn; None: all, 120 at most.
    on_frame
        Called with the number of frames done and to be done after each.
    rate
        Frames a second.

    Returns
    -------
    The files written.

    Raises
    ------
    ValueError
        More frames than positions, a diagram or a file type that there is not.
    RenderingUnavailable
        This machine has no OpenGL.
    """
    path = _of_type(path, MOVIES)
    chosen = spread(drawable(deflection, diagram_named(diagram)), frames)
    if path.suffix.lower() == ".png":
        return stills(deflection, diagram, chosen, path, style, on_frame)
    write = _write_gif if path.suffix.lower() == ".gif" else _write_mp4
    with closing(_frames(deflection, diagram, chosen, style, on_frame)) as images, _complete(path) as unfinished:
        write(unfinished, images, rate)
    return (path,)


def spread(possible: Any, frames: int | None) -> list[int]:
    """Some of the possible positions, evenly.

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
    """Images, one by one."""
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
    """A name beside `path` to write to, which becomes `path` only if all goes well."""
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


def _write_mp4(path: Path, images: Iterator[Any], rate: int) -> None:
    import imageio.v2 as imageio

    options: Any = {"codec": "libx264", "quality": 8, "pixelformat": "yuv420p", "ffmpeg_log_level": "quiet"}
    options["output_params"] = ["-preset", "veryfast"]  # half the time of "medium", and files of the same size
    film: Any
    with imageio.get_writer(path, format="FFMPEG", fps=rate, **options) as film:
        for image in images:
            film.append_data(image)


def _write_gif(path: Path, images: Iterator[Any], rate: int) -> None:
    frames = _indexed(images)
    first = next(frames)
    with path.open("wb") as file:
        first.save(file, "GIF", save_all=True, append_images=frames, duration=1000 / rate, loop=0, optimize=False)


def _indexed(images: Iterator[Any]) -> Iterator[Any]:
    """Images in the colours that pictures are painted with and blends of any two: what smoothed edges are made of.

    Pillow's own search for the nearest colour is coarse and tints the white.
    """
    from PIL import Image

    paints = np.array([[int(paint[k : k + 2], 16) for k in (1, 3, 5)] for paint in PAINTS])
    pairs = np.array(list(combinations(paints, 2)))[:, None]
    shares = np.arange(1, 7)[:, None] / 7
    blends = pairs[:, :, 0] + (pairs[:, :, 1] - pairs[:, :, 0]) * shares
    palette = np.concatenate([paints, np.rint(blends).astype(int).reshape(-1, 3)])
    known = np.full(1 << 24, -1, np.int16)  # number in the palette of every colour met so far
    for image in images:
        colours = image.astype(np.int32) @ [1 << 16, 1 << 8, 1]
        new = np.unique(colours[known[colours] < 0])
        parts = np.stack([new >> 16, new >> 8 & 255, new & 255], -1)
        known[new] = np.square(parts[:, None] - palette).sum(-1).argmin(-1)
        frame = Image.fromarray(known[colours].astype(np.uint8))
        frame.putpalette(palette.astype(np.uint8).tobytes())
        yield frame
