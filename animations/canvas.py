"""Off-screen VTK canvas for moving meshes and text."""

from pathlib import Path
from typing import Any

import numpy as np

from animations.legend import MIN_LETTER_HEIGHT, Words
from animations.shapes import LEVELS, Cells, Complexes, FlatShape
from animations.solid import SolidShape
from animations.style import Style, paints
from rigid import Reals
from rigid.arrays import Integers

CLIP_DISTANCE = 1e4  # [pixels] distance of the clipping planes from the middle plane, which contains the solid bodies
FLAT_HEIGHT = 4e3  # [pixels] z of flat shapes, which are drawn over solid bodies
BACK_LEVELS = ("guide",)  # `FlatShape.level` of shapes that are drawn under solid bodies
SHADING = {"ambient": 0.5, "diffuse": 0.6, "specular": 0.25, "specular_power": 25}
# With this shading, faces towards the viewer have the colours of the legend.
COLOUR_SHADING = SHADING | {"ambient": 0.75, "diffuse": 0.4}
COLOURS = {True: "coolwarm", False: "YlOrRd"}  # matplotlib colour maps for signed and unsigned fields
LABEL_OPACITY = 0.75  # opacity of the background of labels


class Canvas:
    """Canvas of a given size, viewed from above, on which one unit is one pixel."""

    def __init__(self, style: Style) -> None:
        import pyvista as pv

        self._paints, self._unit = paints(style.background), style.unit
        self._plotter: Any = pv.Plotter(off_screen=True, window_size=list(style.size))
        window: Any = self._plotter.render_window
        window.SetDPI(72)  # with 72 dpi, a text height of one point is one pixel
        self._plotter.renderer.SetBackground(*self._paints["paper"])
        self._plotter.renderer.SetUseOIT(False)  # order-independent blending is 50 % slower
        self._plotter.enable_anti_aliasing("msaa", multi_samples=8)
        middle = style.size[0] / 2, style.size[1] / 2
        camera = self._plotter.camera
        camera.parallel_projection = True
        camera.focal_point = (*middle, 0.0)
        camera.position = (*middle, CLIP_DISTANCE)
        camera.up = (0.0, 1.0, 0.0)
        camera.parallel_scale = style.size[1] / 2

    def close(self) -> None:
        """Release the window."""
        self._plotter.close()

    def image(self) -> Any:
        """Render and return the image, uint8, shape (height, width, 3)."""
        self._plotter.camera.clipping_range = (1.0, 2 * CLIP_DISTANCE)
        self._plotter.render()  # a screenshot alone would show the previous rendering
        return self._plotter.screenshot(None, return_img=True)

    def flat(self, shape: FlatShape, points: Complexes) -> Any:
        """Add a flat shape, with one actor for its faces, and one for its lines, on the same points."""
        import pyvista as pv

        mesh = pv.PolyData()
        place = np.zeros((len(points), 3))
        level = LEVELS.index(shape.level)
        place[:, 2] = level - CLIP_DISTANCE / 2 if shape.level in BACK_LEVELS else level + FLAT_HEIGHT
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
        """Add a solid body.

        If the body has values, colours show them. The scale starts at 0, or at -`most` if `signed`, and ends at `most`.
        """
        import pyvista as pv

        mesh = pv.PolyData()
        mesh.points = points
        mesh.faces = cells(body.faces)
        mesh.point_data.active_normals = normals
        look: dict[str, Any] = {"color": self._paints[body.fill], "opacity": body.opacity, **SHADING}
        if body.values is not None:
            mesh.point_data["values"] = body.values(0)
            low = -most if signed else 0.0
            look = {"scalars": "values", "cmap": COLOURS[signed], "clim": (low, most or 1.0), **COLOUR_SHADING}
        self._plotter.add_mesh(
            mesh, **look, show_scalar_bar=False, interpolation="phong", reset_camera=False, name=None
        )
        return mesh

    def colour_bar(self, low: complex, high: complex, signed: bool) -> None:
        """Add a horizontal colour bar; `low` and `high` are its lower left and upper right corners [pixels]."""
        import pyvista as pv

        x = np.linspace(low.real, high.real, 65)
        points = np.concatenate([x + 1j * low.imag, x + 1j * high.imag])
        at = np.arange(64)
        corners = tuple(np.stack([at, at + 1, at + 66, at + 65], -1))
        mesh = pv.PolyData(
            np.stack([points.real, points.imag, np.full(len(points), FLAT_HEIGHT)], -1), faces=cells(corners)
        )
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
        """Add text. If `over` is True, the drawing behind the text is dimmed."""
        from vtkmodules.vtkRenderingCore import vtkTextActor
        from vtkmodules.vtkRenderingFreeType import vtkMathTextFreeTypeTextRenderer  # noqa: F401

        actor = vtkTextActor()
        actor.SetInput(words.text)
        style = actor.GetTextProperty()
        style.SetFontFamily(4)  # use a font file, because the built-in fonts of VTK lack Greek letters
        style.SetFontFile(str(font_file()))
        style.SetFontSize(max(round(words.height), round(MIN_LETTER_HEIGHT)))
        style.SetColor(*self._paints[words.ink])
        if over:
            style.SetBackgroundColor(*self._paints["paper"])
            style.SetBackgroundOpacity(LABEL_OPACITY)
        style.SetJustification((0, 1, 2)[words.side + 1])
        style.SetVerticalJustificationToCentered()
        actor.SetPosition(words.at.real, words.at.imag)
        self._plotter.add_actor(actor, reset_camera=False, name=None, render=False)
        return actor


def font_file() -> Path:
    """Return the path of the DejaVu Sans font that matplotlib installs."""
    import matplotlib as mpl

    return Path(mpl.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"


def move(mesh: Any, points: Any) -> None:
    """Set the points of a mesh, given as complex numbers in the plane or as vectors in space."""
    if np.iscomplexobj(points):
        mesh.points[:, 0] = points.real
        mesh.points[:, 1] = points.imag
    else:
        mesh.points[:] = points
    mesh.GetPoints().Modified()


def cells(parts: Cells) -> Integers:
    """Encode polygons or polylines for VTK, each preceded by its number of points."""
    return np.concatenate([np.concatenate([[len(part)], part]) for part in parts])
