"""The class `Cycle`: a scene in motion, from which all figures (results such as the largest deflection) are computed.

It represents one run, or the runs of many designs, or runs at many speeds.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, field
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple, replace

import elastic
from elastic import FIELDS, Deflection, Extreme, Largest, extremes, larger_magnitude, largest, sample
from elastic.assessment import PathDeviation, buckling_bound, buckling_ratio, euler_ratio, path_deviation
from elastic.beams import designs_of
from kinelast.figures.beam_limits import too_many_beams
from kinelast.scene.data import Scene, scene_deflection
from kinelast.tasks.progress import one_thread
from kinelast.values.figure import Figure, RowSearch, points_of
from machine.drives import time_weights
from machine.joints import JointHistory, joint_history
from rigid import Motion, Reals, drive_efforts, reachable
from rigid.arrays import Flags, Numbers

if TYPE_CHECKING:
    from elastic.vibration import Frequencies

Result = TypeVar("Result")
EXTREME_FIELDS = tuple(key for key, each in FIELDS.items() if each.main and each.kind is not elastic.FieldKind.LOAD)
MAX_CONDITION = 1e6  # ill-conditioned positions, with a larger condition number, are excluded from largest values
STATIONS = 15  # number of locations along a beam at which the results of two theories are compared
AT_STATIONS = np.linspace(0.0, 1.0, STATIONS)
INSTANTS = 12  # number of positions at which natural frequencies are computed, in addition to some around the minimum
DESIGN_AXES = 2  # an array of this dimension, shape (designs, 1), contains the numbers of several designs
MIN_BENDING = 1e-9  # smaller chord deflections are round-off, relative to the largest axial displacement
SETTLED = 1e-5  # relative tolerance of natural frequencies of several designs, small enough for difference quotients


@dataclass(frozen=True)
class AlongBeams(RowSearch):
    """Function that finds, over a cycle, the largest magnitude of a field (quantity along beams) on every beam."""

    key: str

    def rows(self, cycle: Cycle) -> Reals | None:
        """Return the extreme value along each beam at all positions, or None if `cycle.sampled` is false."""
        return cycle.once(_rows_along, self.key) if cycle.sampled else None

    def __call__(self, cycle: Cycle) -> Largest:
        """Return the largest magnitude on each beam over all included positions."""
        rows = self.rows(cycle)
        if rows is not None:
            return cycle.largest(rows)
        if cycle.tabled:
            extreme = cycle.extremes[self.key]
            return largest(extreme.value, cycle.counted_if_any, extreme.xi)
        if self.key not in cycle.maxima:
            return elastic.cycle_maxima(cycle.deflection, [self.key], cycle.counted_if_any, cycle.period)[self.key]
        return cycle.maxima[self.key]


@dataclass(frozen=True, eq=False)
class Cycle:
    """A scene and its motion, with arrays of shape (positions,), (designs, positions) or (speeds, positions).

    Attributes
    ----------
    given
        Deflection, if it has been computed already. Otherwise it is computed as soon as a figure needs it.
    tabled
        Whether fields (quantities along the beams) are needed at every position. Otherwise only the largest values of
        fields are computed.
    wanted
        Keys of the fields that the figures need. The largest values of these fields are searched together.
    used
        Number of designs that are evaluated; the remaining ones only fill the arrays.
    period
        Duration of the cycle [s], shape (...). If it is given, fields are also evaluated between the positions.
    sampled
        Whether fields are evaluated only at `STATIONS` points along the beams. This is enough for the difference
        between the results of two theories.
    between
        Whether largest values include an estimate of how much they increase between the positions.
    quasi_static
        Quasi-static answer for the same motion, which provides the natural frequencies. None if this cycle is itself
        the quasi-static answer.
    samples
        Cache of the values at the stations, by field key, while several fields are searched.
    """

    scene: Scene
    motion: Motion
    given: Deflection | None = None
    tabled: bool = False
    wanted: frozenset[str] = field(default_factory=frozenset)
    used: int | None = None
    period: Any = None
    sampled: bool = False
    between: bool = False
    quasi_static: Cycle | None = None
    samples: dict[str, Reals] = field(default_factory=dict, init=False, repr=False)
    _known: dict[tuple[Any, ...], Any] = field(default_factory=dict, repr=False)

    def once(self, function: Callable[..., Result], *arguments: Hashable) -> Result:
        """Return the result of a function of the cycle and other arguments. It is computed only once."""
        key = function, *arguments
        if key not in self._known:
            self._known[key] = function(self, *arguments)
        return self._known[key]

    def of(self, figure: Figure) -> Largest:
        """Return the value of a figure over the cycle for every item."""
        return self._found(figure.find, bool(figure.fields))

    def _found(self, find: Callable[[Cycle], Largest], of_fields: bool) -> Largest:
        key = find, self.sampled and of_fields  # sampled fields differ from exact ones
        if key not in self._known:
            self._known[key] = find(self)
            self.samples.clear()
        return self._known[key]

    def search(self, figures: Iterable[Figure]) -> None:
        """Find the values of several figures at once, and cache them for the method `of`."""
        searched: dict[Any, Numbers] = {}
        for figure in figures:
            key = figure.find, self.sampled and bool(figure.fields)
            if isinstance(figure.find, RowSearch) and key not in self._known:
                rows = figure.find.rows(self)
                if rows is not None:
                    searched[key] = np.abs(rows) if np.iscomplexobj(rows) else rows
        self.samples.clear()
        if not searched:
            return
        together, end = self.largest(np.concatenate([*searched.values()])), 0
        gain = np.broadcast_to(together.gain, np.shape(together.value))
        for key, rows in searched.items():
            part, end = slice(end, end + len(rows)), end + len(rows)
            self._known[key] = Largest(together.value[part], together.position[part], gain=gain[part])

    @cached_property
    def deflection(self) -> Deflection:
        """The deflection of the links."""
        return self.given or scene_deflection(self.scene, self.motion)

    @cached_property
    def columns(self) -> tuple[int, ...]:
        """The shape of arrays of values at each position.

        The shape also includes designs that differ only in sections, cams or other parts, such as motors.
        """
        of_cams = (cam.designs for cam in self.scene.cams.values())
        parts = (part for own in self.scene.parts.values() for part in own.values() if isinstance(part, Struct))
        numbers = (value for part in parts for value in astuple(part))
        of_parts = (value.shape for value in numbers if isinstance(value, np.ndarray) and value.ndim == DESIGN_AXES)
        return np.broadcast_shapes(self.motion.columns, designs_of(self.scene.sections), *of_cams, *of_parts)

    @cached_property
    def reached(self) -> Flags:
        """Whether the mechanism can be assembled at each position, shape (..., positions)."""
        return np.broadcast_to(reachable(self.motion), self.columns)

    @cached_property
    def condition(self) -> Reals:
        """The condition number of the motion, shape (..., positions)."""
        return np.broadcast_to(self.motion.condition, self.columns)

    @cached_property
    def lost(self) -> Flags:
        """Whether a position has no figures because it is singular or friction may lock, shape (..., positions)."""
        return np.broadcast_to(self.deflection.lost, self.columns)

    @cached_property
    def counted(self) -> Flags:
        """Whether a position is included in largest values, shape (..., positions).

        A position is included if its condition number is at most `MAX_CONDITION`. If there is no such position, all
        positions that are not singular are included.
        """
        well = self.condition <= MAX_CONDITION
        if self.scene.mechanism.friction:
            well = well & ~self.lost
        return well if well.all() else np.where(well.any(axis=-1, keepdims=True), well, ~self.lost)

    @cached_property
    def counted_if_any(self) -> Flags | None:
        """The same as `counted`, or None if all positions are included."""
        return None if self.counted.all() else self.counted

    @cached_property
    def weights(self) -> Reals:
        """The weight of each position in time averages [s], shape (..., positions); 0 for excluded positions."""
        return np.where(self.counted, self.durations, 0.0)

    @cached_property
    def durations(self) -> Reals:
        """The part of the run that belongs to each position [s], shape (..., positions)."""
        run = self.scene.run
        cycle: Any = run.duration if run.turn else np.nan
        period = cycle if self.period is None else np.asarray(self.period)[..., None]
        return np.asarray(time_weights(self.motion.time, period))

    @cached_property
    def well_conditioned(self) -> Deflection:
        """The deflection, with nan at positions that are excluded from largest values."""
        left_out = ~self.lost & ~self.counted
        return elastic.without_positions(self.deflection, left_out) if left_out.any() else self.deflection

    def largest(self, values: Any) -> Largest:
        """Return the largest magnitude of values of shape (..., positions) over the included positions."""
        if np.shape(values)[-len(self.columns) :] != self.columns:
            values = np.broadcast_to(values, (*np.shape(values)[: -len(self.columns)], *self.columns))
        found = largest(values, self.counted_if_any)
        return replace(found, gain=self._gain(np.abs(values), found.position)) if self.between else found

    def least(self, values: Any) -> Largest:
        """Return the smallest value over the positions (last axis); nan if no value is known."""
        known = np.where(np.isnan(values), np.inf, values)
        at = known.argmin(axis=-1)
        value = np.take_along_axis(np.asarray(values), at[..., None], -1)[..., 0]
        found = Largest(value, np.where(np.isnan(value), -1, at)[()])
        return replace(found, gain=self._gain(-known, found.position)) if self.between else found

    def _gain(self, size: Reals, position: Any) -> Reals:
        """Return how much the peaks increase between the positions, as estimated by `peak_gain`.

        The gain does not depend on the time scale, so the time and the period of the first speed serve for all speeds.
        """
        run, time = self.scene.run, self.motion.time
        period = float(run.duration) if run.turn else np.nan
        if time.ndim > 1:
            time, period = time[0], np.nan if self.period is None else float(np.ravel(self.period)[0])
        if len(time) < 3 or np.shape(size)[-1] != len(time):
            return np.zeros(np.shape(position))
        return elastic.peak_gain(size, position, time, period)

    @cached_property
    def coarser(self) -> Cycle:
        """The scene at every second position, with its quasi-static deflection."""
        return Cycle(self.scene, self.scene.course.at(self.motion.time[::2]), sampled=True)

    def rows(self, values: Any) -> Numbers:
        """Return the values of several items, broadcast to all columns, shape (items, ..., positions)."""
        columns = self.columns
        wide = [each if np.shape(each) == columns else np.broadcast_to(each, columns) for each in values]
        return np.array(wide) if wide else np.zeros((0, *self.columns))

    def along(self, key: str) -> Largest:
        """Return the largest magnitude of a field on every beam over the included positions, shape (beams, ...)."""
        return self._found(AlongBeams(key), True)

    @cached_property
    def maxima(self) -> dict[str, Largest]:
        """The largest magnitudes of the `wanted` fields."""
        return elastic.cycle_maxima(self.deflection, sorted(self.wanted), self.counted_if_any, self.period)

    @cached_property
    def extremes(self) -> dict[str, Extreme]:
        """The value of largest magnitude along every beam, shape (beams, ..., positions), by field key."""
        if not self.deflection.sections:
            none = np.zeros((0, *self.columns))
            return {key: Extreme(none, none) for key in EXTREME_FIELDS}
        return extremes(self.deflection, EXTREME_FIELDS)

    @cached_property
    def euler_ratio(self) -> Reals:
        """The ratio of compressive force to Euler load, shape (beams, ..., positions)."""
        return euler_ratio(self.deflection) if self.scene.mechanism.beams else np.zeros((0, *self.columns))

    @property
    def buckling_ratio(self) -> Largest:
        """The largest ratio of load to critical load over the positions, shape (beams, ...).

        All beams of a link have the ratio of the link. The forces are those of this cycle, and include vibration if it
        was solved. For several designs or speeds, only upper bounds are computed. Unknown ratios are nan.
        """
        return self.once(_buckling)[0]

    @property
    def buckling_gain(self) -> Reals:
        """The possible increase of `buckling_ratio` between the positions, shape (beams, ...).

        It is 0 for upper bounds.
        """
        return self.once(_buckling)[1]

    @cached_property
    def bending(self) -> Reals:
        """The chord deflection relative to its maximum over the cycle, shape (..., positions).

        This is the largest ratio of all beams. It is about 0 if the links only stretch.
        """
        sizes = np.abs(sample(self.deflection, "chord", STATIONS)).max(axis=-1)
        ends = np.abs(sample(self.deflection, "u", np.ones(1))[..., 0])
        stretch = ends.max(axis=(0, -1), initial=0.0, where=~self.lost)[..., None]
        base = elastic.reference_deflection(np.nan_to_num(sizes).max(axis=-1))[..., None]
        base = np.maximum(base, MIN_BENDING * stretch)
        share = np.divide(sizes, base, out=np.zeros_like(sizes), where=base > 0.0)
        return share.max(axis=0, initial=0.0)

    def joint(self, number: int) -> JointHistory:
        """Return the time history of the force and the motion in a joint, with the weights of the positions."""
        return self.once(_joint, number)

    @cached_property
    def efforts(self) -> Reals:
        """The moment [N m] or force [N] of every drive, shape (drives, ..., positions)."""
        return drive_efforts(self.deflection.motion, self.deflection.forces)

    @cached_property
    def deviations(self) -> dict[str, PathDeviation]:
        """The displacement of every named moving point, shape (..., positions)."""
        links = self.scene.mechanism.links
        return {name: self._deviation(links[link].name, name) for name, link in points_of(self.scene.mechanism)}

    def _deviation(self, link: str, point: str) -> PathDeviation:
        part = path_deviation(self.deflection, link, point)
        along, normal, displacement = (np.broadcast_to(each, self.columns) for each in astuple(part))
        return PathDeviation(along, normal, displacement)

    @property
    def frequencies(self) -> Frequencies | None:
        """The natural frequencies at some positions; nan if they are unknown, and None if no link has beams."""
        return self.quasi_static.frequencies if self.quasi_static else self.once(_frequencies)

    @cached_property
    @one_thread()
    def lowest_frequency(self) -> Reals:
        """The lowest natural frequency at some positions [rad/s], shape (..., positions)."""
        if len(self.columns) == 1 and self.frequencies:
            return self.frequencies.omega[0]
        from elastic.vibration import natural_frequencies

        given = self.motion, self.scene.sections, 1, INSTANTS, self.scene.joints, SETTLED, self.used
        solved = natural_frequencies(*given, searched=True).omega[0]
        lowest = np.full((*self.columns[:-1], solved.shape[-1]), np.nan)
        lowest[: len(solved)] = solved
        return lowest


@one_thread()
def _frequencies(cycle: Cycle) -> Frequencies | None:
    from elastic.vibration import Frequencies, natural_frequencies

    scene = cycle.scene
    if not scene.mechanism.beams:
        return None
    unknown = Frequencies(np.full((1, 1), np.nan), np.zeros(1, int), np.nan)
    if too_many_beams(scene.mechanism):
        return unknown
    try:
        return natural_frequencies(cycle.motion, scene.sections, positions=INSTANTS, joints=scene.joints, searched=True)
    except np.linalg.LinAlgError:  # dimensions are unrealistic, but the deflection may still be known
        return unknown


@one_thread()
def _buckling(cycle: Cycle) -> tuple[Largest, Reals]:
    scene = cycle.scene
    owners = [at for at, _ in scene.mechanism.beams]
    if not owners:
        none = np.zeros((0, *cycle.columns[:-1]))
        return Largest(none, none.astype(int)), none
    bent = cycle.deflection.complete or cycle.deflection
    alone = len(cycle.columns) == 1
    if alone and not too_many_beams(scene.mechanism):
        ratio = buckling_ratio(bent, cycle.counted)
        return Largest(ratio.ratio[owners], ratio.position[owners]), ratio.neighbour_drop[owners]
    bound = buckling_bound(bent)[owners]
    bound = np.where(cycle.counted & ~np.isnan(bound), bound, 0.0)
    value = bound.max(axis=-1)
    found = Largest(np.where(np.isinf(value) | (alone & (value >= 1.0)), np.nan, value), bound.argmax(axis=-1))
    return found, np.zeros(np.shape(value))


def _joint(cycle: Cycle, number: int) -> JointHistory:
    return joint_history(cycle.motion, cycle.deflection.forces, number, cycle.weights)


def _rows_along(cycle: Cycle, key: str) -> Reals:
    """Return the value of largest magnitude at the sampled locations on every beam, shape (beams, ..., positions)."""
    if parts := FIELDS[key].greatest_of:
        larger = reduce(larger_magnitude, (cycle.once(_rows_along, part) for part in parts))
        return larger if FIELDS[key].signed else np.abs(larger)
    return greatest_along(sample(cycle.deflection, key, AT_STATIONS, cycle.samples))


def greatest_along(values: Any) -> Reals:
    """Return the value of largest magnitude along the last axis (locations on a beam), with its sign."""
    most, least = values.max(axis=-1), values.min(axis=-1)
    return np.where(most >= -least, most, least)
