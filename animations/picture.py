"""Picture of a mechanism, which is built once and then updated for each position."""

from collections.abc import Sequence
from itertools import pairwise
from types import TracebackType
from typing import Any, Self

import numpy as np
from msgspec.structs import replace

from animations.canvas import Canvas, move
from animations.diagrams import MOTION, SHAPE, STATIONS, Diagram, diagram_named
from animations.labels import DOT_RADIUS, name_labels, peak_label, peak_of
from animations.layers import Stack, layers, reach, stacked
from animations.layout import Scales, View, drawable, scales_of, seen_solid, turn_of, view_of
from animations.legend import Words, drive_words, headings, legend
from animations.placing import Label, ink_of, without_overlaps
from animations.shapes import (
    FINE,
    INK,
    QUIET,
    Complexes,
    FlatShape,
    carried,
    deformed_shapes,
    diagram_shapes,
    link_shapes,
    moved_beams,
    outline_shapes,
)
from animations.solid import SolidShape
from animations.solid_mechanism import AXLE_RADIUS, EYE_RADIUS, block, mechanism_bodies, rail, sections_of, thicknesses
from animations.style import Style
from animations.symbols import moved_place, path_shapes, symbol_shapes
from elastic import Deflection
from rigid import Reals
from rigid.arrays import Integers
from symbols import DRIVE, JOINTS, ROLLER, UNDER, hull, marks_of

MAX_SAMPLES = 120  # maximum number of positions used to fit the view and to place the labels
MAX_SOLID_SAMPLES = 40  # maximum number of positions at which the view is fitted to solid bodies
MIN_SYMBOL_SIZE = 0.0145  # smallest size of the arrow of a drive, relative to the size of the mechanism
CONVEX_PIECES = 6  # number of convex pieces that approximate a bent beam in tests for overlaps


class Picture:
    """Picture of a diagram that can be shown at one position after another.

    Create it inside `files.off_screen`, and close it or use it as a context manager.

    Attributes
    ----------
    scales, view
        Scales and view, which are the same for all positions.
    shapes, meshes
        Flat shapes and their meshes, which are reused for all positions.
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
        self._leaders = self._canvas.flat(_pairs(len(self._labels)), self._leader_ends(first))
        self._texts = [self._canvas.write(Words(" ", 0j, label.height, 0, label.ink), True) for label in self._labels]

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Release the canvas."""
        self._canvas.close()

    def show(self, position: int) -> Any:
        """Move everything to a position and return the image, uint8, shape (height, width, 3)."""
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
        move(self._leaders, self._leader_ends(position))
        self._drive.SetInput(self._drive_words(position))
        return self._canvas.image()

    def _leader_ends(self, position: int) -> Complexes:
        """Return zero twice, and then both ends of the leader line of each label [pixels], see `_pairs`."""
        return np.concatenate([np.zeros(2, complex), *(label.leader(position) for label in self._labels)])

    def _placed(self, body: SolidShape, position: int) -> tuple[Reals, Reals]:
        """Return the points [pixels] and the unit normals of a body at a position, both in the axes of the view."""
        points, normals = body.place(position)
        return self.view.solid(points), normals @ self.view.turn.T

    def _labelled(
        self, deflection: Deflection, diagram: Diagram, style: Style, looked_at: Integers, stack: Stack | None
    ) -> list[Label]:
        """Create the moving labels, and add the dot at the peak to the shapes."""
        moved = self.scales.exaggeration if diagram is SHAPE or stack else 0.0
        marks = [shape for shape in self.shapes if shape.level == "mark"]
        with_peak = "peak" in style.show and self.scales.peak
        if with_peak:
            place = peak_of(deflection, diagram, self.scales, self.view, stack).place
            self.shapes.append(_dot(place, DOT_RADIUS * self.scales.pin))
        ink = ink_of(self.shapes, self.bodies, self.view, looked_at.tolist(), 0.008 * style.unit)
        names = name_labels(deflection, self.scales, self.view, style, ink, moved, stack)
        if not with_peak:
            return without_overlaps(names)
        _, label = peak_label(deflection, diagram, self.scales, self.view, style, names, marks, stack, ink)
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
    """Return all moving flat shapes."""
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
            rollers = [replace(mark, stroke=QUIET, level=UNDER) for mark in marks if mark.kind == ROLLER]
            shapes += symbol_shapes(deflection, rollers, scales.symbol)  # an undeformed roller touches its cam
            shapes += deformed_shapes(deflection, scales.exaggeration)
    bodies = () if style.look == "plain" else JOINTS
    shown = [mark for mark in marks if mark.kind != DRIVE and mark.kind not in bodies]
    shapes += symbol_shapes(deflection, shown, scales.symbol, moved)
    return [shape for shape in shapes if shape.faces or shape.lines]


def view_for(shapes: list[FlatShape], bodies: list[SolidShape], positions: Any, style: Style) -> View:
    """Return a view that contains all moving shapes at the given positions."""
    turn = turn_of(style.look)
    unscaled = View(0j, 1.0, turn)
    flat = (unscaled.flat(shape.place(position)) for shape in shapes for position in positions)
    some = positions[:: -(-len(positions) // MAX_SOLID_SAMPLES)]
    solid = (seen_solid(body.place(position)[0], turn) for body in bodies for position in some)
    return view_of([*flat, *solid], style, turn)


def _pairs(count: int) -> FlatShape:
    """Return a shape of `count` separate lines, after a first line that always has zero length."""
    lines = tuple(np.arange(2 * count + 2).reshape(-1, 2))
    return FlatShape("mark", lambda _: np.zeros(2 * count + 2, complex), lines=lines, ink=FINE, width=0.8)


def _dot(place: Complexes, radius: float) -> FlatShape:
    circle = radius * np.exp(2j * np.pi * np.arange(16) / 16)
    return FlatShape(
        "mark", lambda position: place[position] + circle, (np.arange(16),), (np.arange(17) % 16,), fill=INK
    )


def stack_of(deflection: Deflection, scales: Scales, style: Style, positions: Any) -> Stack:
    """Assign layers such that no solid link passes through another."""
    found = layers(_links(deflection, scales, style, positions), _pins(deflection, scales, positions))
    return stacked(found, thicknesses(deflection, scales))


def _links(deflection: Deflection, scales: Scales, style: Style, positions: Any) -> list[list[Reals]]:
    """Return the extents of the parts of each link, see `reach`."""
    motion, pin, moved = deflection.motion, scales.pin, scales.exaggeration
    links = motion.mechanism.links
    bodies: list[list[Reals]] = [[] for _ in links]

    def add(at: int, corners: Sequence[complex] | Complexes, margin: float) -> None:
        place = carried(deflection, at, np.array(corners, complex), moved)
        bodies[at].append(reach(np.array([place(position) for position in positions]), margin))

    sections = sections_of(deflection, scales)
    axes = moved_beams(deflection, moved) if sections else None
    bent = np.array([axes(position) for position in positions]) if axes else np.zeros((0, 0, 0), complex)
    for beam, ((at, _), section) in enumerate(zip(motion.mechanism.beams, sections, strict=True)):
        for one, other in pairwise(np.linspace(0, len(STATIONS) - 1, CONVEX_PIECES + 1).astype(int)):
            bodies[at].append(reach(bent[:, beam, one : other + 1], float(section.depth.max()) / 2))
    for at, link in enumerate(links[1:], 1):
        for point in link.points:
            bodies[at].append(reach(moved_place(deflection, at, point, moved)[positions, None], EYE_RADIUS * pin))
        if not link.beams and len(link.points) > 1:
            add(at, hull(np.array(list(link.points.values()), complex)), 0.5 * pin)
        if link.name in style.outlines:
            add(at, style.outlines[link.name], 0.0)
    for joint in motion.structure.joints:
        if joint.turns:
            continue
        slider, at, on = motion.mechanism.slider(joint.name), joint.block, joint.owner
        box = block(deflection, slider, scales)[positions]
        bodies[at].append(reach(box, 0.0))
        if on:
            bodies[on].append(reach(box, 0.0))
        else:
            bodies[at].append(reach(np.tile(rail(deflection, slider, pin), (len(positions), 1)), 0.0))
    return bodies


def _pins(deflection: Deflection, scales: Scales, positions: Any) -> list[tuple[set[int], Reals]]:
    """Return for each axle or block the set of links that it joins, and the extent of this body (see `reach`)."""
    motion = deflection.motion
    joined: dict[str, set[int]] = {}
    axles: dict[str, Reals] = {}
    for joint in motion.structure.joints:
        if joint.turns:
            place = moved_place(deflection, joint.child, joint.name, scales.exaggeration)[positions, None]
            axles[joint.name] = reach(place, AXLE_RADIUS * scales.pin)
        elif joint.parent:
            axles[joint.name] = reach(block(deflection, motion.mechanism.slider(joint.name), scales)[positions], 0.0)
        else:
            continue  # the ground guides this block by a rail
        joined.setdefault(joint.name, set()).update((joint.parent, joint.child))
    return [(joined[name], axles[name]) for name in axles]
