"""Common data of all designs of a scene (a mechanism with its motion).

A design is the scene with other values of some inputs. The results of a design are called figures, e.g. the largest
stress.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from kinelast.figures.cycle import Cycle
from kinelast.figures.measures import Measure, chosen, measures_of
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of, limits_of
from kinelast.reports.limits import limits_kept
from kinelast.scene import joints, limits, variables
from kinelast.scene.course import CourseByLaws
from kinelast.scene.data import Scene
from kinelast.scene.document import Document
from kinelast.scene.format import SceneTable
from kinelast.scene.parts import PARTS
from kinelast.values import figure, quantities, units
from rigid import structure
from rigid.arrays import Integers, Reals, distinct
from rigid.plane import unit

TABLES_ON_AXIS = ("masses", "joints", "limits", "springs", "sliders", "slots")
EVEN_POSITIONS = 16  # number of evenly spaced positions at which designs are checked for buckling
FLOATS = ("poisson", "strain")  # keys of dimensionless input values that can be arrays


class Base(Struct, frozen=True, eq=False, dict=True):
    """The document of a scene, the input values that differ between the designs, and the requested figures.

    "Nominal" means "as written in the document".

    Attributes
    ----------
    document
        Nominal document.
    places
        Location of each differing input value in the document.
    on_axis
        For each differing input value, True if one array can contain the values of several designs. Otherwise, designs
        with different values of this input are computed separately.
    measures
        Requested figures, each reduced to one value per design.
    by_position
        True if designs are computed only at the positions of the run, e.g. to compare a path with a target point for
        each position. If False, designs are also computed at the times of breaks, see `instants`.
    """

    document: Document
    places: tuple[variables.Place, ...]
    on_axis: tuple[bool, ...]
    measures: tuple[Measure, ...]
    by_position: bool = False

    @property
    def table(self) -> SceneTable:
        """Parsed tables of the document."""
        return self.document.table

    @property
    def scene(self) -> Scene:
        """Nominal scene."""
        return self.document.scene

    @cached_property
    def buckling_positions(self) -> Integers:
        """Positions at which buckling is checked.

        Buckling is checked at evenly spaced positions and, for each beam, at the position with the largest (load /
        critical load) in the nominal scene.
        """
        times = self.instants(self.scene)
        cycle = Cycle(self.scene, self.scene.course.at(times))
        even = np.linspace(0, len(times) - 1, min(EVEN_POSITIONS, len(times))).round().astype(int)
        return distinct([*even, *np.ravel(cycle.buckling_ratio.position)])

    def instants(self, scene: Scene) -> Reals:
        """Return the times at which designs are computed [s].

        The result contains the time of each position, and the times just before and after each break in the drive laws.
        The times of breaks are left out if the times of the positions differ between designs, or if `by_position` is
        True.

        If all differing input values are arrays, the breaks of the nominal scene are used. If only some input values
        are arrays, the breaks are computed for the nominal mechanism with the drive laws of `scene`. If no input value
        is an array, the breaks of `scene` are used.
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
        """Names of the data fields that are needed to compute the figures."""
        return frozenset(key for measure in self.measures for key in measure.figure.fields)


def base_of(document: Document, paths: Sequence[str], figures: Sequence[str | figure.Figure] | None) -> Base:
    """Return the common data of designs that differ in the input values at `paths`.

    Raises
    ------
    SceneError
        See `evaluate`.
    """
    table = document.table
    places = tuple(variables.place_of(table, path) for path in paths)
    if varied := _links_that_vary(table, places):
        document = replace(document, varied=document.varied | varied)
    scene = document.scene
    known = design_measures(scene, scene.output)
    keys = {measure.figure.key for measure in known.values()}
    requested = {name.partition(".")[0] for name in figures or () if isinstance(name, str)}
    bounded = {limit.figure for limit in limits_of(scene)}
    # Some figures need an output point or angle. The scene names none, so choose one.
    if scene.output is None and not requested | bounded <= keys:
        known = design_measures(scene, output_of(scene))
    default = [name for name, each in known.items() if each.figure.listed and each.items is None]
    names: Sequence[str | figure.Figure] = default if figures is None else figures
    on_axis = tuple(_on_axis(table, scene, place) for place in places)
    # Some `Figure` objects need data with one value per position.
    by_position = not all(isinstance(name, str) for name in names)
    return Base(document, places, on_axis, tuple(chosen(known, names)), by_position)


def design_measures(scene: Scene, output: limits.Output | None) -> dict[str, Measure]:
    """Return all figures that can be computed for designs, by name.

    If the scene has limits, the result also contains the two figures of `limits_kept`: whether a design meets all
    limits, and its smallest margin to a limit.
    """
    figures = figures_of(output)
    return measures_of(scene, [*figures, *limits_kept(scene, figures)] if limits_of(scene) else figures)


def _links_that_vary(table: SceneTable, places: Iterable[variables.Place]) -> frozenset[str]:
    """Return the names of the links that have a point with varying coordinates."""
    drawn = {place.keys[1] for place in places if place.keys[0] == "points"}
    own = {place.keys[1] for place in places if place.keys[0] == "links" and place.keys[2] == "points"}
    return frozenset(own.union(name for name, link in table.links.items() if drawn & set(link.points)))


def _on_axis(table: SceneTable, scene: Scene, place: variables.Place) -> bool:
    """Return True if an input value can be an array with one value per design.

    An input value can be an array if it affects neither the structure of the mechanism nor the assembly branch.

    If the mechanism has friction, no input value can be an array. The iteration for friction ends when all designs in
    an array have converged. The results of a design would therefore depend on the other designs.
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
    """Return True if the drawn positions of the points determine the assembly branch of each design.

    The following conditions must be met. All groups of links must be driven links or dyads. There must be no gears. The
    stroke of a drive must not depend on the drawn start position, see `_stroke_depends_on_start`. If a drive starts at
    the drawn position, the mechanism must not have another drive.
    """
    closed = all(group.closed_form for group in structure(scene.mechanism).groups)
    start_drawn = any(drive.start is None and drive.motion is None and drive.link for drive in table.drives)
    one_way = not start_drawn or len(table.drives) == 1
    return closed and not table.gears and one_way and not _stroke_depends_on_start(table)


def _stroke_depends_on_start(table: SceneTable) -> bool:
    """Return True if a drive starts at the drawn position and the length of its stroke depends on this position.

    The length depends on the drawn position if a segment of the drive law ends at a given value, or if the drive law
    repeats.
    """
    drawn = [drive for drive in table.drives if drive.start is None and drive.law is not None]
    return any(drive.repeat for drive in drawn) or any(
        segment.to is not None for drive in drawn for segment in drive.law or ()
    )


def _is_tapered(section: Any) -> bool:
    sizes = (getattr(section, name) for name in section.__struct_fields__)
    return any(isinstance(size, quantities.Sizes) and size[0] != size[1] for size in sizes)


class DesignRows(Struct, frozen=True, eq=False):
    """A subset of the designs: row numbers among all designs, and input values of shape (designs, paths)."""

    rows: Integers
    values: Reals

    def at(self, which: Any) -> DesignRows:
        """Return the designs with the indices `which` in this subset."""
        return DesignRows(self.rows[which], self.values[which])

    def without(self, rows: Any) -> DesignRows:
        """Return this subset without the designs that have the row numbers `rows`."""
        kept = ~np.isin(self.rows, rows)
        return DesignRows(self.rows[kept], self.values[kept])


def table_with(base: Base, group: DesignRows) -> SceneTable:
    """Return the tables of a scene, in which arrays contain the input values of several designs.

    The first row of each array is the nominal value, and the other rows are the values of the designs.

    If an input cannot be an array, all designs in `group` must have one value of this input. If no input can be an
    array, all designs in `group` are therefore equal, and the tables describe a single scene.

    Raises
    ------
    SceneError
        The value of an input that cannot be an array is invalid.
    """
    apart = {place.variable.path: group.values[0, k] for k, place in enumerate(base.places) if not base.on_axis[k]}
    table = base.document.with_values(apart).table
    for k, place in enumerate(base.places):
        if base.on_axis[k]:
            each = np.concatenate([[place.variable.base], group.values[:, k]])[:, None]
            table = variables.replaced(table, place.keys, _array_content(place, each))
    return table


def _array_content(place: variables.Place, each: Any) -> Any:
    """Return an entry of the document with an array in place of a single value.

    The array is made from `each`, the value of the nominal scene and the values of all designs.
    """
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
    """Yield row numbers of designs that have an input value out of bounds, with one error message per design."""
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
