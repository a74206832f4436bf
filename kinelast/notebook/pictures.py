"""Pictures and films of a deflection. A notebook shows them inline."""

from base64 import b64encode
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from msgspec import Struct

from kinelast.notebook import SceneDeflection
from kinelast.scene.parts import symbols_of

SIZE = (960, 540)  # [pixels] size of a picture or a film


class Still(Struct, frozen=True):
    """A picture. `shows` describes the content, and `png` is the PNG file."""

    shows: str
    png: bytes

    def __repr__(self) -> str:
        return f"Still({self.shows})"

    def _repr_png_(self) -> bytes:
        return self.png


class Film(Struct, frozen=True):
    """A film. `shows` describes the content, and `mp4` is the MP4 file."""

    shows: str
    mp4: bytes

    def __repr__(self) -> str:
        return f"Film({self.shows})"

    def _repr_html_(self) -> str:
        source = f"data:video/mp4;base64,{b64encode(self.mp4).decode()}"
        return f'<video controls loop muted style="max-width:100%" src="{source}"></video>'


def picture(bent: SceneDeflection, diagram: str = "deflection", position: int = 0, **style: Any) -> Still:
    """Return a picture of a deflection at one position.

    Parameters
    ----------
    diagram
        Name of a diagram (see --animate), or key of a field. It must be "motion" for a scene without beams.
    position
        Index of the position.
    style
        Settings of `animations.Style`, such as `look="solid"` or `show=("names", "paths")`.

    Raises
    ------
    ValueError
        The diagram does not exist, or the position cannot be drawn.
    TypeError
        `bent` is not the deflection of a scene.
    RenderingUnavailable
        This machine has no OpenGL.
    """
    _require_deflection(bent)
    from PIL import Image

    from animations import Picture, diagram_named, drawable, off_screen

    possible = drawable(bent, diagram_named(diagram))
    if position not in possible:
        raise ValueError(f"position {position} cannot be drawn: expected {possible[0]} to {possible[-1]}")
    with off_screen(), Picture(bent, diagram, _style(bent, style)) as drawn:
        image = drawn.show(position)
    file = BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return Still(f"{diagram} of {bent.scene.name} at position {position}", file.getvalue())


def film(bent: SceneDeflection, diagram: str = "deflection", frames: int | None = None, **style: Any) -> Film:
    """Return a film of a deflection. See `picture` for the other parameters and errors.

    Parameters
    ----------
    frames
        Number of frames (default: one per position, at most 120).
    """
    _require_deflection(bent)
    from animations import movie

    with TemporaryDirectory() as folder:
        (path,) = movie(bent, diagram, Path(folder) / "film.mp4", frames, _style(bent, style))
        return Film(f"{diagram} of {bent.scene.name}", path.read_bytes())


def _require_deflection(bent: object) -> None:
    if not isinstance(bent, SceneDeflection):
        raise TypeError(f"expected a deflection, as of deflection(scene) or answer(scene).deflection, got {bent!r:.60}")


def _style(bent: SceneDeflection, asked: dict[str, Any]) -> Any:
    from animations import Style

    drawn = {"outlines": bent.scene.outlines, "marks": symbols_of(bent.scene)}
    return Style(**{"title": bent.scene.title, "size": SIZE, **drawn, **asked})
