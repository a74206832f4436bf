"""An off-screen sheet of VTK: meshes of moving points, and text."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from animations.legend import LEAST, Words
from animations.paints import paints
from animations.shapes import LEVELS, Cells, Complexes, FlatShape
from animations.solid import SolidShape
from animations.style import Style
from rigid import Reals
from rigid.arrays import Integers

DEPTH = 1e4  # from the sheet's middle to its near and its far end, in pixels; solid bodies stand about the middle
NEAR = 4e3  # where flat shapes begin that lie over solid bodies
BEHIND = ("guide",)  # levels that lie under them
SHINE = {"ambient": 0.5, "diffuse": 0.6, "specular": 0.25, "specular_power": 25}
TRUE = SHINE | {"ambient": 0.75, "diffuse": 0.4}  # the front of a body has the colour that the legend shows
COLOURS = {True: "coolwarm", False: "YlOrRd"}  # of bodies, by whether the field is signed: maps of matplotlib
CLEAR = 0.75  # opacity of the paper behind labels


class Canvas:
    """A sheet of so many pixels, seen straight from above, one unit a pixel."""

    def __init__(self, style: Style) -> None:
        import pyvista as pv

        self._paints, self._unit = paints(style.background), style.unit
        self._plotter: Any = pv.Plotter(off_screen=True, window_size=list(style.size))
        window: Any = self._plotter.render_window
        window.SetDPI(72)  # a text's size is its height in pixels
        self._plotter.renderer.SetBackground(*self._paints["paper"])
        self._plotter.renderer.SetUseOIT(False)  # what is sheer is drawn in order: in any takes half as long again
        self._plotter.enable_anti_aliasing("msaa", multi_samples=8)
        middle = style.size[0] / 2, style.size[1] / 2
        camera = self._plotter.camera
        camera.parallel_projection = True
        camera.focal_point = (*middle, 0.0)
        camera.position = (*middle, DEPTH)
        camera.up = (0.0, 1.0, 0.0)
        camera.parallel_scale = style.size[1] / 2

    def close(self) -> None:
        """Free it."""
        self._plotter.close()

    def image(self) -> Any:
        """The picture on it, uint8, shape (height, width, 3)."""
        self._plotter.camera.clipping_range = (1.0, 2 * DEPTH)
        self._plotter.render()  # a screenshot alone repeats what was last rendered
        return self._plotter.screenshot(None, return_img=True)

    def flat(self, shape: FlatShape, points: Complexes) -> Any:
        """A mesh of a shape, its faces in one actor and its lines in another that shares its points."""
        import pyvista as pv

        mesh = pv.PolyData()
        place = np.zeros((len(points), 3))
        level = LEVELS.index(shape.level)
        place[:, 2] = level - DEPTH / 2 if shape.level in BEHIND else level + NEAR
        mesh.points = place
        move(mesh, points)
        if shape.faces:
            mesh.faces = cells(shape.faces)
            paint, clear = self._paints[shape.fill], shape.opacity
            self._plotter.add_mesh(mesh, color=paint, opacity=clear, lighting=False, name=None, reset_camera=False)
        if shape.lines:
            lines = pv.PolyData()
            lines.SetPoints(mesh.GetPoints())
            lines.lines = cells(shape.lines)
            width, paint = max(shape.width * self._unit / 720, 0.6), self._paints[shape.ink]
            actor = self._plotter.add_mesh(lines, color=paint, line_width=width, lighting=False, reset_camera=False)
            actor.position = (0.0, 0.0, 0.5)
        return mesh

    def solid(self, body: SolidShape, points: Reals, normals: Reals, most: float, signed: bool) -> Any:
        """A mesh of a body, in its own paint or, where it has values up to `most`, in a range of colours."""
        import pyvista as pv

        mesh = pv.PolyData()
        mesh.points = points
        mesh.faces = cells(body.faces)
        mesh.point_data.active_normals = normals
        look: dict[str, Any] = {"color": self._paints[body.fill], "opacity": body.opacity, **SHINE}
        if body.values is not None:
            mesh.point_data["values"] = body.values(0)
            low = -most if signed else 0.0
            look = {"scalars": "values", "cmap": COLOURS[signed], "clim": (low, most or 1.0), **TRUE}
        self._plotter.add_mesh(
            mesh, **look, show_scalar_bar=False, interpolation="phong", reset_camera=False, name=None
        )
        return mesh

    def colour_bar(self, low: complex, high: complex, signed: bool) -> None:
        """A bar between two corners, with colours that run from left to right."""
        import pyvista as pv

        x = np.linspace(low.real, high.real, 65)
        points = np.concatenate([x + 1j * low.imag, x + 1j * high.imag])
        at = np.arange(64)
        corners = tuple(np.stack([at, at + 1, at + 66, at + 65], -1))
        mesh = pv.PolyData(np.stack([points.real, points.imag, np.full(len(points), NEAR)], -1), faces=cells(corners))
        mesh.cell_data["values"] = np.linspace(0.0, 1.0, 64)
        self._plotter.add_mesh(
            mesh,
            scalars="values",
            cmap=COLOURS[signed],
            lighting=False,
            show_scalar_bar=False,
            reset_camera=False,
            name=None,
        )

    def write(self, words: Words, over: bool = False) -> Any:
        """Text; `over`: it clears the paper behind it."""
        from vtkmodules.vtkRenderingCore import vtkTextActor
        from vtkmodules.vtkRenderingFreeType import vtkMathTextFreeTypeTextRenderer  # noqa: F401

        actor = vtkTextActor()
        actor.SetInput(words.text)
        style = actor.GetTextProperty()
        style.SetFontFamily(4)  # a font file: VTK's own fonts leave Greek letters out
        style.SetFontFile(str(font_file()))
        style.SetFontSize(max(round(words.height), round(LEAST)))
        style.SetColor(*self._paints[words.ink])
        if over:
            style.SetBackgroundColor(*self._paints["paper"])
            style.SetBackgroundOpacity(CLEAR)
        style.SetJustification((0, 1, 2)[words.side + 1])
        style.SetVerticalJustificationToCentered()
        actor.SetPosition(words.at.real, words.at.imag)
        self._plotter.add_actor(actor, reset_camera=False, name=None, render=False)
        return actor


def font_file() -> Path:
    """DejaVu Sans, as matplotlib brings it."""
    import matplotlib as mpl

    return Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


def move(mesh: Any, points: Any) -> None:
    """Put new places, complex or in space, into a mesh's own array of points."""
    if np.iscomplexobj(points):
        mesh.points[:, 0] = points.real
        mesh.points[:, 1] = points.imag
    else:
        mesh.points[:] = points
    mesh.GetPoints().Modified()


def cells(parts: Cells) -> Integers:
    """Polygons or polylines as VTK wants them: each with the number of its points before it."""
    return np.concatenate([np.concatenate([[len(part)], part]) for part in parts])
