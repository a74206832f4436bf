"""Common data of all designs of a scene: numbers that vary, which of these numbers can be arrays, and figures."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.figures.cycle import Cycle
from kinelast.figures.limits import limits_kept
from kinelast.figures.measures import Measure, chosen, measures_of
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of, limits_of
from kinelast.scene import figure, joints, limits, quantities, units, variables
from kinelast.scene.course import CourseByLaws
from kinelast.scene.data import Scene
from kinelast.scene.document import Document
from kinelast.scene.format import SceneTable
from kinelast.scene.parts import PARTS
from rigid import structure
from rigid.arrays import Integers, Reals, distinct
from rigid.plane import unit

TABLES_ON_AXIS = ("masses", "joints", "limits", "springs", "sliders", "slots")
EVEN_POSITIONS = 16  # number of evenly spaced positions at which designs are checked for buckling
FLOATS = ("poisson", "strain")  # keys of dimensionless numbers that can be arrays


class Base(Struct, frozen=True, eq=False, dict=True):
    """The document of a scene, and the numbers that differ between its designs.

    "Nominal" means "as written in the document".

    Attributes
    ----------
    document
        Nominal document.
    places
        Locations in the document of the numbers that differ.
    on_axis
        For each number, True if it can be an array. Designs that differ in a number that cannot be an array are
        computed separately.
    measures
        Requested figures.
    by_position
        True if a figure needs its data at exactly the positions of the run, such as the points of a path. No other
        times are then added.
    """

    document: Document
    places: tuple[variables.Place, ...]
    on_axis: tuple[bool, ...]
    measures: tuple[Measure, ...]
    by_position: bool = False

    @property
    def table(self) -> SceneTable:
        """The parsed tables."""
        return self.document.table

    @property
    def scene(self) -> Scene:
        """Nominal scene."""
        return self.document.scene

    @cached_property
    def buckling_positions(self) -> Integers:
        """Positions at which buckling is checked: evenly spaced ones, and the worst ones of the nominal scene."""
        times = self.instants(self.scene)
        cycle = Cycle(self.scene, self.scene.course.at(times))
        even = np.linspace(0, len(times) - 1, min(EVEN_POSITIONS, len(times))).round().astype(int)
        return distinct([*even, *np.ravel(cycle.buckling_ratio.position)])

    def instants(self, scene: Scene) -> Reals:
        """Return the times at which designs are computed: the positions, and both sides of each break in the laws.

        If a number is an array, the breaks are computed for the nominal mechanism with the laws of these designs.
        """
        course, times = scene.course, scene.course.times()
        if times.ndim > 1 or self.by_position:
            return times
        if any(self.on_axis):
            nominal = self.scene.course
            course = nominal if all(self.on_axis) else replace(nominal, laws=course.laws, run=course.run)
        return course.with_breaks(times)

    @cached_property
    def fields(self) -> frozenset[str]:
        """Fields that the figures need."""
        return frozenset(key for measure in self.measures for key in measure.figure.fields)


def base_of(document: Document, paths: Sequence[str], figures: Sequence[str | figure.Figure] | None) -> Base:
    """Look up the numbers and figures of a scene by name. Raises the same errors as `evaluate`."""
    table = document.table
    places = tuple(variables.place_of(table, path) for path in paths)
    if varied := _links_that_vary(table, places):
        document = replace(document, varied=document.varied | varied)
    scene = document.scene
    known = design_measures(scene, scene.output)
    keys = {measure.figure.key for measure in known.values()}
    requested = {name.partition(".")[0] for name in figures or () if isinstance(name, str)}
    bounded = {limit.figure for limit in limits_of(scene)}
    if scene.output is None and not requested | bounded <= keys:  # choose an output
        known = design_measures(scene, output_of(scene))
    default = [name for name, each in known.items() if each.figure.listed and each.items is None]
    names: Sequence[str | figure.Figure] = default if figures is None else figures
    on_axis = tuple(_on_axis(table, scene, place) for place in places)
    by_position = not all(isinstance(name, str) for name in names)  # figures of a path or of the nominal output
    return Base(document, places, on_axis, tuple(chosen(known, names)), by_position)


def design_measures(scene: Scene, output: limits.Output | None) -> dict[str, Measure]:
    """Return all figures of the designs of a scene, by name, including those that the limits need."""
    figures = figures_of(output)
    return measures_of(scene, [*figures, *limits_kept(scene, figures)] if limits_of(scene) else figures)


def _links_that_vary(table: SceneTable, places: Iterable[variables.Place]) -> frozenset[str]:
    """Return the names of the links with a point that varies."""
    drawn = {place.keys[1] for place in places if place.keys[0] == "points"}
    own = {place.keys[1] for place in places if place.keys[0] == "links" and place.keys[2] == "points"}
    return frozenset(own.union(name for name, link in table.links.items() if drawn & set(link.points)))


def _on_axis(table: SceneTable, scene: Scene, place: variables.Place) -> bool:
    """Return True if a number can be an array: it affects neither the structure nor the assembly branch.

    With friction, no number can be an array: the iteration ends when all columns have converged. The result of a design
    would then depend on the other designs.
    """
    top, *inner = place.keys
    plain = not isinstance(place.leaf, units.Quantity | quantities.Sizes | quantities.Direction)
    if not isinstance(scene.course, CourseByLaws) or scene.mechanism.friction or (plain and inner[-1] not in FLOATS):
        return False
    one_drive = len(table.drives) == 1
    if top == "points" or (top == "links" and inner[:2] == ["ground", "points"]):
        able = _follows_its_drawing(table, scene)
    elif top == "sections":
        able = not _is_tapered(table.sections[inner[0]]) and not isinstance(inner[-1], int)
    elif top == "materials":
        modulus_known = any(material.G is not None for material in table.materials.values())
        shears = inner[1] in ("poisson", "G") or (inner[1] == "E" and modulus_known)
        able = not shears or not any(_is_tapered(section) for section in table.sections.values())
    elif top == "drives":
        able = one_drive and inner[1] in ("speed", "start") and table.drives[0].speed is not None
    elif top == "run":
        able = inner[0] == "gravity" or (inner[0] == "duration" and one_drive)
    elif top == "loads":
        able = inner[1] in ("force", "moment", "start", "end")
    elif top == "links":
        able = not _stroke_depends_on_start(table)
    elif top == "joints":
        able = inner[1] not in joints.FRICTION_KEYS
    else:
        able = top in TABLES_ON_AXIS or any(part.on_axis for part in PARTS if part.key == top)
    return able


def _follows_its_drawing(table: SceneTable, scene: Scene) -> bool:
    """Return True if the drawing determines the branch of each design: all groups are driven links or dyads."""
    closed = all(group.closed_form for group in structure(scene.mechanism).groups)
    start_drawn = any(drive.start is None and drive.motion is None and drive.link for drive in table.drives)
    one_way = not start_drawn or len(table.drives) == 1
    return closed and not table.gears and one_way and not _stroke_depends_on_start(table)


def _stroke_depends_on_start(table: SceneTable) -> bool:
    """Return True if the stroke of a drive depends on its drawn start: its law ends at a given value, or repeats."""
    drawn = [drive for drive in table.drives if drive.start is None and drive.law is not None]
    return any(drive.repeat for drive in drawn) or any(
        segment.to is not None for drive in drawn for segment in drive.law or ()
    )


def _is_tapered(section: Any) -> bool:
    sizes = (getattr(section, name) for name in section.__struct_fields__)
    return any(isinstance(size, quantities.Sizes) and size[0] != size[1] for size in sizes)


class DesignRows(Struct, frozen=True, eq=False):
    """A subset of the designs: row index of each design, and values, shape (designs, paths)."""

    rows: Integers
    values: Reals

    def at(self, which: Any) -> DesignRows:
        """Return the designs with the given indices in this subset."""
        return DesignRows(self.rows[which], self.values[which])

    def without(self, rows: Any) -> DesignRows:
        """Return all designs of this subset except those with the given row indices."""
        kept = ~np.isin(self.rows, rows)
        return DesignRows(self.rows[kept], self.values[kept])


def table_with(base: Base, group: DesignRows) -> SceneTable:
    """Return the tables of designs with arrays of numbers. The first row of each array is the nominal scene.

    The designs must agree in all numbers that cannot be arrays. If no number is an array, all designs are equal, and
    the tables describe a single scene.

    Raises
    ------
    SceneError
        A common number is invalid.
    """
    apart = {place.variable.path: group.values[0, k] for k, place in enumerate(base.places) if not base.on_axis[k]}
    table = base.document.with_values(apart).table
    for k, place in enumerate(base.places):
        if base.on_axis[k]:
            each = np.concatenate([[place.variable.base], group.values[:, k]])[:, None]
            table = variables.replaced(table, place.keys, _array_content(place, each))
    return table


def _array_content(place: variables.Place, each: Any) -> Any:
    """Return the content of a location in the document: an array of the values of many designs."""
    leaf, bare_unit = place.leaf, "" if place.variable.unit == "1" else place.variable.unit
    if isinstance(leaf, quantities.Sizes):
        both = quantities.Size.many(each, bare_unit)
        return quantities.Sizes((both, both))
    if isinstance(leaf, quantities.Direction):
        way = quantities.Direction(complex(np.nan, np.nan))
        way.each = unit(each)
        way.each[0] = complex(leaf)
        return way
    return (type(leaf) if isinstance(leaf, units.Quantity) else units.Quantity).many(each, bare_unit)


def out_of_bounds(base: Base, group: DesignRows) -> Iterator[tuple[Any, Any]]:
    """Yield the rows of designs with a number out of bounds, and a message for each row."""
    fine = np.ones(len(group.rows), bool)
    for k, place in enumerate(base.places):
        if not base.on_axis[k]:
            continue
        values, shown = group.values[:, k], place.variable
        leaf = quantities.Size if isinstance(place.leaf, quantities.Sizes) else type(place.leaf)
        known = issubclass(leaf, units.Quantity)
        wrong = fine & ~(leaf.holds(values) if known else variables.within_bounds(base.table, place, values))
        fine &= ~wrong
        at = np.flatnonzero(wrong)
        if len(at):
            expected = leaf.expected if known else "a number"
            said = [
                f"{shown.path}: expected {expected}, {leaf.bound(value) if known else 'within its bounds'}, "
                f"got {value:g}{'' if shown.unit == '1' else ' ' + shown.unit}"
                for value in values[at]
            ]
            yield group.rows[at], np.array(said, object)
