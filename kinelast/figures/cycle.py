"""A scene in motion, from which all figures are computed, for one run or for many designs or speeds at once."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Iterable
from dataclasses import dataclass, field, replace
from functools import cached_property, reduce
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

import elastic
from elastic import FIELDS, Deflection, Extreme, Largest, extremes, larger_magnitude, largest, sample
from elastic.assessment import PathDeviation, buckling_bound, buckling_ratio, euler_ratio, path_deviation
from elastic.beams import designs_of
from kinelast.scene.data import Scene, scene_deflection
from kinelast.scene.figure import Figure, RowSearch, points_of
from kinelast.tasks.progress import one_thread
from machine.drives import time_weights
from machine.joints import JointHistory, joint_history
from rigid import Mechanism, Motion, Reals, drive_efforts, reachable
from rigid.arrays import Flags, Numbers

if TYPE_CHECKING:
    from elastic.vibration import Frequencies

Result = TypeVar("Result")
EXTREME_FIELDS = tuple(key for key, each in FIELDS.items() if each.main and each.kind is not elastic.FieldKind.LOAD)
WELL = 1e6  # largest condition number of the positions that are included in largest values
STATIONS = 15  # number of stations along a beam at which answers are compared
AT_STATIONS = np.linspace(0.0, 1.0, STATIONS)
INSTANTS = 12  # number of positions with natural frequencies, in addition to those around the minimum
SETTLED = 1e-5  # tolerance of natural frequencies, which is fine enough for their derivatives


@dataclass(frozen=True)
class AlongBeams(RowSearch):
    """Search for the largest magnitude of a field on every beam."""

    key: str

    def rows(self, cycle: Cycle) -> Reals | None:
        """Return the values at all positions, or None if the cycle is not sampled along the beams."""
        return cycle.once(_rows_along, self.key) if cycle.sampled else None

    def __call__(self, cycle: Cycle) -> Largest:
        """Return the largest values on the beams over the included positions."""
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
    """A scene and its motion, with columns (positions,), (designs, positions) or (speeds, positions).

    Attributes
    ----------
    given
        Deflection, if it is known; otherwise it is computed when a figure needs it.
    tabled
        Whether fields are needed at every position, instead of only their largest values.
    wanted
        Fields that the figures need, so that they can be searched together.
    used
        Number of actual designs; the others only pad the arrays.
    period
        Duration of the cycle [s], shape (...), if fields are evaluated between the positions too.
    sampled
        Whether fields are evaluated only at `STATIONS` points along the beams, which is enough for the difference
        between two answers.
    between
        Whether peaks include their gain between the positions.
    quasi_static
        Quasi-static answer for the same motion, which provides the natural frequencies. None if this cycle is itself
        the
        quasi-static answer.
    samples
        Values at the stations by field key, cached while several fields are searched.
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
        """Return the cached result of a function of the cycle and other arguments."""
        key = function, *arguments
        if key not in self._known:
            self._known[key] = function(self, *arguments)
        return self._known[key]

    def of(self, figure: Figure) -> Largest:
        """Return the largest value of every item of a figure."""
        return self._found(figure.find, bool(figure.fields))

    def _found(self, find: Callable[[Cycle], Largest], of_fields: bool) -> Largest:
        key = find, self.sampled and of_fields  # sampled fields differ from exact ones
        if key not in self._known:
            self._known[key] = find(self)
            self.samples.clear()
        return self._known[key]

    def search(self, figures: Iterable[Figure]) -> None:
        """Search several figures at once, and cache the results for `of`."""
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
        """The shape of the columns, including designs that have the same motion."""
        of_cams = (cam.designs for cam in self.scene.cams.values())
        return np.broadcast_shapes(self.motion.columns, designs_of(self.scene.sections), *of_cams)

    @cached_property
    def reached(self) -> Flags:
        """Whether the mechanism can be assembled at each position, shape (..., positions)."""
        return np.broadcast_to(reachable(self.motion), self.columns)

    @cached_property
    def condition(self) -> Reals:
        """The condition number of the motion, shape (..., positions)."""
        return np.broadcast_to(self.motion.condition, self.columns)

    @cached_property
    def singular(self) -> Flags:
        """Whether a position has no figures: it is nearly singular, or friction may lock, shape (..., positions)."""
        return np.broadcast_to(self.deflection.lost, self.columns)

    @cached_property
    def counted(self) -> Flags:
        """Whether a position is included in largest values, shape (..., positions).

        Positions are included if their condition number is at most `WELL`. If there are none, all computed positions
        are.
        """
        well = self.condition <= WELL
        if self.scene.mechanism.friction:
            well = well & ~self.singular
        return well if well.all() else np.where(well.any(axis=-1, keepdims=True), well, ~self.singular)

    @cached_property
    def counted_if_any(self) -> Flags | None:
        """Whether a position is included in largest values, like `counted`; None if all positions are included."""
        return None if self.counted.all() else self.counted

    @cached_property
    def weights(self) -> Reals:
        """The weights of positions in time averages [s], shape (..., positions); 0 if a position is excluded."""
        run = self.scene.run
        cycle: Any = run.duration if run.turn else np.nan
        period = cycle if self.period is None else np.asarray(self.period)[..., None]
        return np.where(self.counted, time_weights(self.motion.time, period), 0.0)

    @cached_property
    def well_conditioned(self) -> Deflection:
        """The deflection with nan at excluded positions."""
        left_out = ~self.singular & ~self.counted
        return elastic.marked(self.deflection, left_out) if left_out.any() else self.deflection

    def largest(self, values: Any) -> Largest:
        """Return the largest magnitude of the values, shape (..., positions), over the included positions."""
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
        """Return the amount by which peaks between the positions are larger, computed by `peak_gain`."""
        run, time = self.scene.run, self.motion.time
        if len(time) < 3 or np.shape(size)[-1] != len(time):
            return np.zeros(np.shape(position))
        return elastic.peak_gain(size, position, time, float(run.duration) if run.turn else np.nan)

    @cached_property
    def coarser(self) -> Cycle:
        """The rigid motion and quasi-static answer at every second position."""
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
        """The value of largest magnitude along every beam by field, shape (beams, ..., positions)."""
        if not self.deflection.sections:
            none = np.zeros((0, *self.columns))
            return {key: Extreme(none, none) for key in EXTREME_FIELDS}
        return extremes(self.deflection, EXTREME_FIELDS)

    @cached_property
    def euler_ratio(self) -> Reals:
        """The compression / Euler load, shape (beams, ..., positions)."""
        return euler_ratio(self.deflection) if self.scene.mechanism.beams else np.zeros((0, *self.columns))

    @property
    def pressed(self) -> Largest:
        """The largest load / critical load over the positions, for the link of every beam, shape (beams, ...).

        The forces are those of this cycle, including any vibration. For several designs or speeds, the ratios are upper
        bounds. They are nan if unknown.
        """
        return self.once(_pressed)[0]

    @property
    def buckling_gain(self) -> Reals:
        """The possible increase of the load ratios between the positions, shape (beams, ...); 0 for upper bounds."""
        return self.once(_pressed)[1]

    @cached_property
    def bending(self) -> Reals:
        """The deflection from the chord / its maximum over the cycle, for the worst beam, shape (..., positions)."""
        sizes = np.abs(sample(self.deflection, "chord", STATIONS)).max(axis=-1)
        base = elastic.reference_deflection(np.nan_to_num(sizes).max(axis=-1))[..., None]
        share = np.divide(sizes, base, out=np.zeros_like(sizes), where=base > 0.0)
        return share.max(axis=0, initial=0.0)

    def joint(self, number: int) -> JointHistory:
        """Return the time history of the force and motion of a joint, with weights for the included positions."""
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
        along, normal, displacement = (np.broadcast_to(each, self.columns) for each in vars(part).values())
        return PathDeviation(along, normal, displacement)

    @property
    def frequencies(self) -> Frequencies | None:
        """The natural frequencies at some positions, nan if unknown; None if no link has beams."""
        return self.quasi_static.frequencies if self.quasi_static else self.once(_frequencies)

    @cached_property
    @one_thread()
    def lowest_frequency(self) -> Reals:
        """The lowest natural frequency at some positions [rad/s], shape (..., positions)."""
        from elastic.vibration import natural_frequencies

        solved = natural_frequencies(
            self.motion,
            self.scene.sections,
            1,
            joints=self.scene.joints,
            settled=SETTLED,
            designs=self.used,
            searched=len(self.columns) == 1,
        ).omega[0]
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
    except np.linalg.LinAlgError:  # unrealistic dimensions, for which the deflection may still be known
        return unknown


@one_thread()
def _pressed(cycle: Cycle) -> tuple[Largest, Reals]:
    scene = cycle.scene
    owners = [at for at, _ in scene.mechanism.beams]
    if not owners:
        none = np.zeros((0, *cycle.columns[:-1]))
        return Largest(none, none.astype(int)), none
    bent = cycle.deflection.unmarked or cycle.deflection
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
    """Return the value of largest magnitude among the stations of every beam, shape (beams, ..., positions)."""
    if parts := FIELDS[key].greatest_of:
        larger = reduce(larger_magnitude, (cycle.once(_rows_along, part) for part in parts))
        return larger if FIELDS[key].signed else np.abs(larger)
    return greatest_along(sample(cycle.deflection, key, AT_STATIONS, cycle.samples))


def greatest_along(values: Any) -> Reals:
    """Return the values of largest magnitude along the last axis (stations), with signs."""
    most, least = values.max(axis=-1), values.min(axis=-1)
    return np.where(most >= -least, most, least)


MAX_FULL_BEAMS = 64  # maximum number of beams with all coordinates (1.5 GB, 15 s)
MAX_COORDINATES = 18 * MAX_FULL_BEAMS
MAX_BEAMS = 150  # maximum number of beams if they are short pieces of links, which have fewer coordinates
INNER = 4  # initial number of polynomials along a vibrating beam


def too_many_beams(mechanism: Mechanism) -> str:
    """Return the reason why vibration and buckling are not computed; empty if they are computed."""
    count = len(mechanism.beams)
    if count <= MAX_FULL_BEAMS:
        return ""
    from elastic.vibration import elastic_coordinates

    coordinates = {link.name: elastic_coordinates(link, INNER) for link in mechanism.links}
    size = sum(coordinates.values())
    if count <= MAX_BEAMS and size <= MAX_COORDINATES:
        return ""
    link = max(coordinates, key=lambda name: coordinates[name])
    where = f'of which {len(mechanism.links[mechanism.index[link]].beams)} are in the link "{link}"'
    most = f"expected at most {MAX_BEAMS} beams and {MAX_COORDINATES} coordinates"
    return f"vibration and buckling are not computed for {count} beams with {size} coordinates, {where}: {most}"
