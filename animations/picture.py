"""Picture of a mechanism, built once and then updated for each position."""

from types import TracebackType
from typing import Any, Self

import numpy as np

from animations.canvas import Canvas, move
from animations.diagrams import MOTION, SHAPE, Diagram, diagram_named
from animations.extents import stack_of
from animations.labels import DOT_RADIUS, name_labels, peak_label
from animations.layers import Stack
from animations.layout import Scales, View, drawable, scales_of, seen_solid, turn_of, view_of
from animations.legend import Words, drive_words, headings, legend
from animations.placing import Label, ink_of, without_overlaps
from animations.shapes import (
    INK,
    QUIET,
    Complexes,
    FlatShape,
    deformed_shapes,
    diagram_shapes,
    link_shapes,
    outline_shapes,
)
from animations.solid import SolidShape
from animations.solid_mechanism import mechanism_bodies
from animations.style import Style
from animations.symbols import path_shapes, symbol_shapes
from elastic import Deflection
from rigid import Reals
from rigid.arrays import Integers
from symbols import DRIVE, JOINTS, marks_of

MAX_SAMPLES = 120  # maximum number of positions used for the view and the labels
MAX_SOLID_SAMPLES, MAX_LABEL_SAMPLES = 40, 24  # how many of these are used for solid bodies and for labels
MIN_SYMBOL_SIZE = 0.0145  # smallest symbol size of a drive's arrow, relative to the mechanism's size


class Picture:
    """Picture of a diagram, shown at one position after another.

    Create it inside `rendering.off_screen`, and close it or use it in a `with` statement.

    Attributes
    ----------
    scales, view
        The same for all positions.
    shapes, meshes
        Flat shapes and their meshes, reused for all positions.
    bodies, solids
        Solid bodies and their meshes.
    """

    def __init__(self, deflection: Deflection, name: str, style: Style) -> None:
        diagram = diagram_named(name)
        self.scales = scales_of(deflection, diagram, style)
        possible = drawable(deflection, diagram)
        looked_at = possible[:: -(-len(possible) // MAX_SAMPLES)]
        self.shapes = shapes_of(deflection, diagram, self.scales, style)
        self.bodies, stack = [], None
        if style.look == "solid":
            stack = stack_of(deflection, self.scales, style, possible)
            self.bodies = mechanism_bodies(deflection, diagram, self.scales, style, stack)
        self.view = view_for(self.shapes, self.bodies, looked_at, style)
        self._labels = self._labelled(deflection, diagram, style, looked_at, stack)
        self._canvas = Canvas(style)
        first = int(possible[0])
        self.meshes = [self._canvas.flat(shape, self.view.flat(shape.place(first))) for shape in self.shapes]
        signed = diagram.signed and diagram.field is not None
        self.solids = [
            self._canvas.solid(body, *self._placed(body, first), self.scales.peak, signed) for body in self.bodies
        ]
        self._write_around(deflection, diagram, style, signed)
        self._texts = [self._canvas.write(Words(" ", 0j, label.height, 0, label.ink), True) for label in self._labels]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free the canvas."""
        self._canvas.close()

    def show(self, position: int) -> Any:
        """Move everything to a position and return the image, uint8, (height, width, 3)."""
        for shape, mesh in zip(self.shapes, self.meshes, strict=True):
            move(mesh, self.view.flat(shape.place(position)))
        for body, mesh in zip(self.bodies, self.solids, strict=True):
            points, normals = self._placed(body, position)
            move(mesh, points)
            mesh.point_data.active_normals[:] = normals
            mesh.GetPointData().GetNormals().Modified()
            if body.values is not None:
                mesh.point_data["values"][:] = body.values(position)
                mesh.GetPointData().GetScalars().Modified()
        for label, text in zip(self._labels, self._texts, strict=True):
            words = label.at(position)
            text.SetVisibility(bool(words))
            text.SetInput(words or " ")
            text.SetPosition(label.middle[position].real, label.middle[position].imag)
        self._drive.SetInput(self._drive_words(position))
        return self._canvas.image()

    def _placed(self, body: SolidShape, position: int) -> tuple[Reals, Reals]:
        """Points [pixels] and normals of a body in view coordinates."""
        points, normals = body.place(position)
        return self.view.solid(points), normals @ self.view.turn.T

    def _labelled(
        self, deflection: Deflection, diagram: Diagram, style: Style, looked_at: Integers, stack: Stack | None
    ) -> list[Label]:
        """Create the moving labels, and add a dot at the peak to the shapes."""
        some = looked_at[:: -(-len(looked_at) // MAX_LABEL_SAMPLES)]
        moved = self.scales.exaggeration if diagram is SHAPE or stack else 0.0
        ink = ink_of(self.shapes, self.bodies, self.view, [int(position) for position in some], 0.008 * style.unit)
        names = name_labels(deflection, self.scales, self.view, style, ink, moved)
        if "peak" not in style.show or not self.scales.peak:
            return without_overlaps(names)
        marks = [shape for shape in self.shapes if shape.level == "mark"]
        place, label = peak_label(deflection, diagram, self.scales, self.view, style, names, marks, stack)
        self.shapes.append(_dot(place, DOT_RADIUS * self.scales.pin))
        return without_overlaps([label, *names])

    def _write_around(self, deflection: Deflection, diagram: Diagram, style: Style, signed: bool) -> None:
        """Write the title and the legend."""
        self._drive_words = drive_words(deflection)
        longest = max(len(self._drive_words(position)) for position in range(len(deflection.motion.time)))
        drive, *lines = headings(diagram, self.scales, style, longest)
        foot = legend(diagram, self.scales, self.view, style)
        for shape in foot.shapes:
            self._canvas.flat(shape, shape.place(0))
        if foot.bar:
            self._canvas.colour_bar(*foot.bar, signed)
        for words in (line for line in lines + foot.words if line.text):
            self._canvas.write(words)
        self._drive = self._canvas.write(drive)


def shapes_of(deflection: Deflection, diagram: Diagram, scales: Scales, style: Style) -> list[FlatShape]:
    """All flat shapes that move."""
    whole = diagram in (SHAPE, MOTION)
    moved = scales.exaggeration if whole or style.look == "solid" else 0.0
    marks = marks_of(deflection.motion, style.marks)
    arrows = [mark for mark in marks if mark.kind == DRIVE] if "drives" in style.show else []
    shapes = symbol_shapes(deflection, arrows, max(scales.symbol, MIN_SYMBOL_SIZE * scales.size), moved)
    if "paths" in style.show:
        shapes += path_shapes(deflection, drawable(deflection, diagram), moved)
    if style.look == "plain":
        shapes += outline_shapes(deflection, style.outlines)
        shapes += link_shapes(deflection, 0.75 * scales.pin, QUIET if diagram is SHAPE else INK)
        if diagram.field is not None:
            shapes += diagram_shapes(deflection, diagram.field, scales.scale)
        if scales.exaggeration:
            shapes += deformed_shapes(deflection, scales.exaggeration)
    bodies = () if style.look == "plain" else JOINTS
    shown = [mark for mark in marks if mark.kind != DRIVE and mark.kind not in bodies]
    shapes += symbol_shapes(deflection, shown, scales.symbol, moved)
    return [shape for shape in shapes if shape.faces or shape.lines]


def view_for(shapes: list[FlatShape], bodies: list[SolidShape], positions: Any, style: Style) -> View:
    """View that shows all moving shapes at the given positions."""
    turn = turn_of(style.look)
    unscaled = View(0j, 1.0, turn)
    flat = (unscaled.flat(shape.place(position)) for shape in shapes for position in positions)
    some = positions[:: -(-len(positions) // MAX_SOLID_SAMPLES)]
    solid = (seen_solid(body.place(position)[0], turn) for body in bodies for position in some)
    return view_of([*flat, *solid], style, turn)


def _dot(place: Complexes, radius: float) -> FlatShape:
    circle = radius * np.exp(2j * np.pi * np.arange(16) / 16)
    return FlatShape("mark", lambda position: place[position] + circle, (np.arange(16),), fill=INK)
