"""Pictures, films and the page as objects that a notebook shows where they stand."""

from __future__ import annotations

from base64 import b64encode
from dataclasses import dataclass
from html import escape
from io import BytesIO
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from kinelast.figures.summary import summary
from kinelast.notebook import SceneDeflection
from kinelast.outputs.batch import headline
from kinelast.outputs.page import report_page
from kinelast.outputs.sealed import made_from
from kinelast.runs import computed
from kinelast.scene.data import Scene
from kinelast.tasks.request import Request
from kinelast.version import VERSION

SIZE = (960, 540)
FRAME = "width:100%;height:48em;border:1px solid #ccd"


@dataclass(frozen=True)
class Still:
    """A picture: its subject, and its bytes as PNG."""

    shows: str
    png: bytes

    def __repr__(self) -> str:
        return f"Still({self.shows})"

    def _repr_png_(self) -> bytes:
        return self.png


@dataclass(frozen=True)
class Film:
    """A film: its subject, and its bytes as MP4."""

    shows: str
    mp4: bytes

    def __repr__(self) -> str:
        return f"Film({self.shows})"

    def _repr_html_(self) -> str:
        source = f"data:video/mp4;base64,{b64encode(self.mp4).decode()}"
        return f'<video controls loop muted style="max-width:100%" src="{source}"></video>'


@dataclass(frozen=True)
class Report:
    """The report of `deflection-report` on a scene: the answer in one line, all figures, and the page."""

    name: str
    headline: str
    figures: dict[str, Any]
    page: bytes

    def __repr__(self) -> str:
        return f'Report("{self.name}": {self.headline})'

    def _repr_html_(self) -> str:
        """The headline and, in a frame of its own, the page, which asks for nothing."""
        page = escape(self.page.decode())
        frame = f'<iframe sandbox="allow-scripts allow-downloads" style="{FRAME}" srcdoc="{page}"></iframe>'
        return f"<p><b>{escape(self.name)}</b>: {escape(self.headline)}</p>{frame}"


def report(
    scene: Scene, positions: int | None = None, check: int | None = None, accuracy: float | None = None
) -> Report:
    """The report on a scene, by the theory that the scene asks for.

    Parameters
    ----------
    positions
        Overrides how many.
    check
        Compare with finite elements, so many to a beam.
    accuracy
        How far the answer may be off, as a share: takes the cheapest theory that gets there.

    Raises
    ------
    SceneError
        As `kinelast.deflection`.
    """
    request = Request(positions=positions, checks=() if check is None else (check,), accuracy=accuracy)
    results = computed(scene, request)
    made = made_from(scene.text.encode(), request)
    figures = {"kinelast": VERSION, **summary(results), "made_from": made}
    line = headline(figures)
    return Report(scene.name, line, figures, report_page(results, figures, line))


def picture(bent: SceneDeflection, diagram: str = "deflection", position: int = 0, **style: Any) -> Still:
    """A diagram of a deflection at one of its positions.

    Parameters
    ----------
    diagram
        A name as on the command line, or a field's key; of a scene without beams "motion".
    style
        Of `animations.Style`, as `look="solid"` or `show=("names", "paths")`.

    Raises
    ------
    ValueError
        There is no such diagram or position.
    RenderingUnavailable
        This machine has no OpenGL.
    """
    from PIL import Image

    from animations import Picture, diagram_named, drawable, off_screen

    possible = drawable(bent, diagram_named(diagram))
    if position not in possible:
        raise ValueError(f"position {position} is not among those that can be drawn, {possible[0]} to {possible[-1]}")
    with off_screen(), Picture(bent, diagram, _style(bent, style)) as drawn:
        image = drawn.show(position)
    file = BytesIO()
    Image.fromarray(image).save(file, "PNG")
    return Still(f"{diagram} of {bent.scene.name} at position {position}", file.getvalue())


def film(bent: SceneDeflection, diagram: str = "deflection", frames: int | None = None, **style: Any) -> Film:
    """A film of a deflection over its positions; the parameters and errors are those of `picture`."""
    from animations import movie

    with TemporaryDirectory() as folder:
        (path,) = movie(bent, diagram, Path(folder) / "film.mp4", frames, _style(bent, style))
        return Film(f"{diagram} of {bent.scene.name}", path.read_bytes())


def _style(bent: SceneDeflection, asked: dict[str, Any]) -> Any:
    from animations import Style

    return Style(**{"title": bent.scene.title, "outlines": bent.scene.outlines, "size": SIZE, **asked})
