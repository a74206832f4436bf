"""A mechanism on an off-screen canvas: built once, then only its points move."""

from __future__ import annotations

from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np

from animations.diagrams import Diagram, diagram_named
from animations.layout import HEAD, MARGIN, Layout, Style, drawable, layout
from animations.legend import Words, drive_words, headings, legend
from animations.shapes import (
    INK,
    LEVELS,
    QUIET,
    Shape,
    deformed_shapes,
    diagram_shapes,
    link_shapes,
    outline_shapes,
)
from animations.symbols import symbol_shapes
from elastic import Deflection


class Picture:
    """A diagram of a mechanism, to be shown at one position after another.

    Make it inside `rendering.off_screen`, and close it or use it in a `with` statement.

    Attributes
    ----------
    layout
        Its scales.
    shapes, meshes
        What is drawn, and the mesh that draws each of them; the same mesh for all positions.
    """

    def __init__(self, deflection: Deflection, name: str, style: Style) -> None:
        diagram = diagram_named(name)
        self.layout: Layout = layout(deflection, diagram, style)
        self.shapes = shapes_of(deflection, diagram, self.layout, style)
        self._height = style.size[1]
        first = int(drawable(deflection, diagram)[0])
        self._plotter = _canvas(style.size)
        measures, words = legend(diagram, self.layout, style)
        self.meshes = [self._draw(shape, self._pixels(shape, first)) for shape in self.shapes]
        for shape in measures:
            self._draw(shape, shape.place(0))
        for line in headings(diagram, self.layout, style) + words:
            self._write(line)
        at = style.size[0] - MARGIN * self._height + 1j * (1 - 0.42 * HEAD) * self._height
        self._drive = self._write(Words(" ", at, 0.03 * self._height, 1))
        self._drive_words = drive_words(deflection)
        self._look(style.size)

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the canvas."""
        self._plotter.close()

    def show(self, position: int) -> Any:
        """Move everything to a position; returns the picture, uint8, shape (height, width, 3)."""
        for shape, mesh in zip(self.shapes, self.meshes, strict=True):
            _move(mesh, self._pixels(shape, position))
        self._drive.SetInput(self._drive_words(position))
        self._plotter.render()  # a screenshot alone repeats what was last rendered
        return self._plotter.screenshot(None, return_img=True)

    def _pixels(self, shape: Shape, position: int) -> Any:
        return (shape.place(position) - self.layout.corner) * self.layout.pixels

    def _draw(self, shape: Shape, points: Any) -> Any:
        """A mesh of a shape, its faces in one actor and its lines in another that shares its points."""
        import pyvista as pv

        place = np.zeros((len(points), 3))
        place[:, 2] = LEVELS.index(shape.level)
        mesh = pv.PolyData()
        mesh.points = place
        _move(mesh, points)
        if shape.faces:
            mesh.faces = _cells(shape.faces)
            self._plotter.add_mesh(mesh, color=shape.fill, lighting=False, name=None, reset_camera=False)
        if shape.lines:
            lines = pv.PolyData()
            lines.SetPoints(mesh.GetPoints())
            lines.lines = _cells(shape.lines)
            width = max(shape.width * self._height / 720, 0.6)
            actor = self._plotter.add_mesh(lines, color=shape.ink, line_width=width, lighting=False, reset_camera=False)
            actor.position = (0.0, 0.0, 0.5)
        return mesh

    def _write(self, words: Words) -> Any:
        from vtkmodules.vtkRenderingCore import vtkTextActor
        from vtkmodules.vtkRenderingFreeType import vtkMathTextFreeTypeTextRenderer  # noqa: F401

        actor = vtkTextActor()
        actor.SetInput(words.text)
        style = actor.GetTextProperty()
        style.SetFontFamily(4)  # a font file: VTK's own fonts leave Greek letters out
        style.SetFontFile(str(font_file()))
        style.SetFontSize(max(round(words.height), 8))
        style.SetColor(*(int(words.ink[k : k + 2], 16) / 255 for k in (1, 3, 5)))
        style.SetJustification(words.side + 1 if words.side <= 0 else 2)
        style.SetVerticalJustificationToCentered()
        actor.SetPosition(words.at.real, words.at.imag)
        self._plotter.add_actor(actor, reset_camera=False, name=None, render=False)
        return actor

    def _look(self, size: tuple[int, int]) -> None:
        """A camera straight above, one unit a pixel."""
        camera = self._plotter.camera
        camera.parallel_projection = True
        camera.focal_point = (size[0] / 2, size[1] / 2, 0.0)
        camera.position = (size[0] / 2, size[1] / 2, 100.0)
        camera.up = (0.0, 1.0, 0.0)
        camera.parallel_scale = size[1] / 2
        camera.clipping_range = (1.0, 200.0)


def shapes_of(deflection: Deflection, diagram: Diagram, scales: Layout, style: Style) -> list[Shape]:
    """All that moves in a picture."""
    shapes = outline_shapes(deflection, style.outlines)
    whole = diagram.field is None
    shapes += link_shapes(deflection, 0.75 * scales.pin, QUIET if whole else INK)
    if diagram.field is not None:
        shapes += diagram_shapes(deflection, diagram.field, scales.scale)
    if scales.exaggeration:
        shapes += deformed_shapes(deflection, scales.exaggeration)
    return shapes + symbol_shapes(deflection, scales.pin, scales.exaggeration if whole else 0.0)


def _canvas(size: tuple[int, int]) -> Any:
    """A white sheet of so many pixels."""
    import pyvista as pv

    plotter: Any = pv.Plotter(off_screen=True, window_size=list(size))
    window: Any = plotter.render_window
    window.SetDPI(72)  # a text's size is its height in pixels
    plotter.set_background("white")
    plotter.enable_anti_aliasing("msaa", multi_samples=8)
    return plotter


def font_file() -> Path:
    """DejaVu Sans, as matplotlib brings it."""
    import matplotlib as mpl

    return Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


def _move(mesh: Any, points: Any) -> None:
    """Put new places into a mesh's own array of points."""
    mesh.points[:, 0] = points.real
    mesh.points[:, 1] = points.imag
    mesh.GetPoints().Modified()


def _cells(cells: Any) -> Any:
    return np.concatenate([np.concatenate([[len(cell)], cell]) for cell in cells])
