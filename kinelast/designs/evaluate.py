"""Evaluation of many designs of a scene at once, with arrays that have an axis of designs."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace
from numpy.typing import NDArray

from kinelast.answers.results import Results, at_breaks
from kinelast.designs.base import Base, DesignRows, base_of, out_of_bounds, table_with
from kinelast.designs.plan import Plan
from kinelast.figures.cycle import Cycle
from kinelast.reports.limits import BROKEN, VERDICTS
from kinelast.scene.build import built
from kinelast.scene.data import Scene, scene_deflection, scene_motion
from kinelast.scene.document import Document, Tables, document_of
from kinelast.tasks.progress import SILENT, Progress
from kinelast.values.error import SceneError
from kinelast.values.figure import Figure
from rigid import MechanismError, Reals, TableError, counted, posture
from rigid.arrays import Integers
from rigid.chunks import columns_of
from rigid.positions import select_designs

BLOCK = 4096  # maximum number of designs for which one scene is built, with arrays of input values
MIN_POSITIONS = 64  # the number of designs in a batch is computed for at least this number of positions per design
# Assumed maximum of (largest load at all positions) / (largest load at the positions checked for buckling).
BUCKLING_MARGIN = 2.0
# (designs * positions in a batch) / `columns_of`; above 1, because only small arrays are needed to find largest values.
BATCH_FACTOR = 2
# Number of designs between two reports of progress: BATCH if all input values can be arrays, SMALL_BATCH if some can be
# arrays, otherwise 1.
BATCH, SMALL_BATCH = 512, 64


class Designs(Struct, frozen=True, eq=False):
    """Results of designs, called figures, e.g. the mass or the largest stress.

    Attributes
    ----------
    columns
        Values by name of the figure in SI units, shape (designs,); nan if unknown.
    units
        SI units by name of the figure.
    reason
        Reason why a design has no figures, shape (designs,); empty for designs with figures.
    place
        Location of the largest value by name of the figure, shape (designs,). The location is an integer that
        identifies the position and the beam or joint, or -1 if there is no location.
    """

    columns: Mapping[str, Reals]
    units: Mapping[str, str]
    reason: Any
    place: Mapping[str, Any]

    def __repr__(self) -> str:
        return f"Designs({len(self.reason)}, {', '.join(self.columns)})"


def evaluate(
    scene: Document | Tables, paths: Sequence[str], values: Any, figures: Sequence[str | Figure] | None = None
) -> Designs:
    """Compute results (figures) of many designs of a scene by quasi-statics.

    The designs differ in some input values of the scene. The results of a design do not depend on the other designs.

    Parameters
    ----------
    scene
        A scene as a parsed document, or the tables that were read from a scene file.
    paths
        Paths of the differing input values, such as "sections.bar.depth".
    values
        Input values in SI units, shape (designs, paths).
    figures
        Names or `Figure` objects of the figures to compute. The default is the figures in the summary of a design.

    Raises
    ------
    SceneError
        The tables are invalid, or an input value or figure does not exist. An error in a single design is not raised
        but stored in `reason`.

    Examples
    --------
    Mass in grams of the steel four-bar with bars of 3 mm and 6 mm:

    >>> from kinelast import shipped_scenes
    >>> from kinelast.scene.document import read_document
    >>> four_bar = read_document(shipped_scenes()["steel_four_bar"])
    >>> found = evaluate(four_bar, ["sections.bar.depth"], [[0.003], [0.006]], ["mass"])
    >>> [round(1e3 * mass, 3) for mass in found.columns["mass"].tolist()]
    [153.075, 306.15]
    """
    return evaluated(base_of(document_of(scene), paths, figures), values)


def evaluated(base: Base, values: Any) -> Designs:
    """Compute figures of many designs as in `evaluate`, from the common data `base` of the designs."""
    values, paths = np.asarray(values, float), base.places
    if values.ndim != 2 or values.shape[1] != len(paths):
        raise ValueError(f"values of shape {values.shape} for {len(paths)} paths, expected (designs, {len(paths)})")
    count = len(values)
    columns = {measure.name: np.full(count, np.nan) for measure in base.measures}
    places = {measure.name: np.full(count, -1) for measure in base.measures}
    reason = np.full(count, "", object)
    with np.errstate(all="ignore"):
        for group in _groups(base, values):
            for part in _computed(base, group):
                reason[part.rows] = part.reason
                for name, (value, place) in part.figures.items():
                    columns[name][part.rows] = value
                    places[name][part.rows] = place
    for name, value in columns.items():
        if name != "reach":
            value[reason != ""] = np.nan
    found_places = {name: place for name, place in places.items() if (place >= 0).any()}
    return Designs(columns, {measure.name: measure.unit for measure in base.measures}, reason, found_places)


Words = NDArray[np.object_]
"""One text per design."""


class PartialResult(Struct, frozen=True, eq=False):
    """Results of some designs.

    Attributes
    ----------
    rows
        Row numbers of the computed designs among all designs.
    reason
        Reason why a design has no figures; empty for designs with figures.
    figures
        Values of each figure, and locations of the largest values, by name of the figure.
    """

    rows: Integers
    reason: Any
    figures: Mapping[str, tuple[Any, Any]]


def _groups(base: Base, values: Any) -> Iterator[DesignRows]:
    """Yield blocks of at most `BLOCK` designs that can be computed together.

    Within a block, all designs have equal values of every input that cannot be an array.
    """
    apart = [k for k, place in enumerate(base.places) if not base.on_axis[k]]
    if not apart:
        same = np.zeros(len(values), int)
    else:
        same = np.unique(values[:, apart], axis=0, return_inverse=True)[1].ravel()
    order = np.argsort(same, kind="stable")
    for rows in np.split(order, np.flatnonzero(np.diff(same[order])) + 1):
        for first in range(0, len(rows), BLOCK):
            some = rows[first : first + BLOCK]
            if len(some):
                yield DesignRows(some, values[some])


def _computed(base: Base, group: DesignRows) -> Iterator[PartialResult]:
    """Compute a group of designs. If a design cannot be built, yield the reason instead of figures."""
    for rows, reason in out_of_bounds(base, group):
        yield PartialResult(rows, reason, {})
        group = group.without(rows)
    while len(group.rows):
        try:
            document = base.document
            many = built(table_with(base, group), base.scene.name, document.files, varied=document.varied)
            scene = _with_design_axis(base, many, len(group.rows) + 1)
        except (SceneError, MechanismError) as error:
            wrong = getattr(error, "designs", None)
            if wrong is None or not len(wrong):
                yield PartialResult(group.rows, str(error), {})
                return
            # row 0 of the arrays is the nominal scene, and row k + 1 is design k of the group
            bad = group.rows[wrong[wrong > 0] - 1]
            if not len(bad):
                yield PartialResult(group.rows, f"the scene as written: {error}", {})
                return
            yield PartialResult(bad, str(error), {})
            group = group.without(bad)
            continue
        yield from _in_batches(base, scene, group)
        return


def _with_design_axis(base: Base, scene: Scene, count: int) -> Scene:
    """Give the stiffness EA of the first section one row per design.

    All figures then have one row per design, even figures that do not depend on the input values.
    """
    if not scene.sections or not any(base.on_axis):
        return scene
    first = replace(scene.sections[0], EA=np.broadcast_to(scene.sections[0].EA, (count, 1)))
    return replace(scene, sections=(first, *scene.sections[1:]))


def _in_batches(base: Base, scene: Scene, group: DesignRows) -> Iterator[PartialResult]:
    """Compute designs in batches that fit into the processor's cache."""
    if not any(base.on_axis):
        yield from _all_positions(base, scene, group)
        return
    positions = max(scene.run.positions, MIN_POSITIONS)
    step = max(BATCH_FACTOR * columns_of(scene.mechanism, positions) // positions, 2) - 1
    for first in range(0, len(group.rows), step):
        yield from _batch(base, scene, group, np.arange(first, min(first + step, len(group.rows))), step)


def _batch(base: Base, scene: Scene, group: DesignRows, which: Any, step: int) -> Iterator[PartialResult]:
    """Compute a batch of designs.

    The first row is the nominal scene, which selects the assembly branch.

    The round-off of numpy's products depends on the array size. Therefore, all batches have one size: copies of the
    nominal scene fill a batch with fewer than `step` designs. Otherwise the results of a design would depend on the
    number of designs.
    """
    rows = np.zeros(step + 1, int)
    rows[1 : len(which) + 1] = which + 1
    try:
        yield from _all_positions(base, select_designs(scene, rows, (len(group.rows) + 1, 1)), group.at(which))
    except (SceneError, MechanismError, TableError) as error:
        if len(which) == 1:
            yield PartialResult(group.rows[which], str(error), {})
            return
        for half in np.array_split(which, 2):
            yield from _batch(base, scene, group, half, step)


def _all_positions(base: Base, scene: Scene, group: DesignRows) -> Iterator[PartialResult]:
    """Compute the figures of designs from all positions. Row 0, the nominal scene, is not part of the result."""
    rows = group.rows
    cycle = Cycle(scene, scene.course.at(base.instants(scene)), wanted=base.fields, used=len(rows) + 1)
    counted = slice(1, len(rows) + 1) if len(cycle.columns) > 1 else slice(None)
    figures = {}
    for measure in base.measures:
        value, place = measure.of(cycle)
        figures[measure.name] = np.atleast_1d(value)[counted], np.atleast_1d(place)[counted]
    reason = np.array(np.broadcast_to(np.atleast_1d(_reasons(cycle))[counted], len(rows)))
    if scene.labels and not all(measure.figure.rigid for measure in base.measures):
        for at in np.flatnonzero((reason == "") & (BUCKLING_MARGIN * _largest_load_ratio(base, cycle)[counted] >= 1.0)):
            reason[at] = _buckling_reason(base, group.values[at])
    yield PartialResult(rows, reason, figures)


def _reasons(cycle: Cycle) -> Words:
    """Return the reason why a design has no figures, shape (designs,); empty for designs with figures."""
    motion, reached = cycle.motion, cycle.reached
    known = cycle.columns[:-1]
    reason = np.full(known, "", object)
    whole = reached.all(axis=-1)
    if not whole.all():
        share = (~reached).mean(axis=-1)
        joint = _opening_joint(cycle)
        for at in np.ndindex(known):
            if share[at] == 1.0:
                reason[at] = (
                    f'the mechanism cannot be assembled: the joint "{joint[at]}" is out of reach at every position'
                )
            elif share[at]:
                reason[at] = f'{share[at]:.0%} of the positions are out of reach: the joint "{joint[at]}" opens'
    bent = cycle.__dict__.get("deflection")  # None if no figure needs the deflection
    for block in () if bent is None else bent.blocks:
        off = (reached & np.isnan(block.xi)).any(axis=-1)
        number, beam = motion.mechanism.beams[block.beam]
        link = motion.mechanism.links[number].name
        reason[off & (reason == "")] = f'a block on "{link}" leaves the beam "{beam.start}"-"{beam.end}"'
    if bent is not None:
        locked = np.broadcast_to(bent.forces.locked, cycle.columns).sum(axis=-1)
        for at in map(tuple, np.argwhere(locked)):
            reason[at] = reason[at] or f"friction may lock {counted(int(locked[at]), 'position')}"
    lost = np.broadcast_to(cycle.motion.singular, cycle.columns) if bent is None else bent.lost
    reason[(reason == "") & lost.all(axis=-1)] = "singular at every position"
    return reason


def _largest_load_ratio(base: Base, cycle: Cycle) -> Reals:
    """Return the largest (load / critical load) at the positions checked for buckling, shape (designs,).

    An unknown ratio is replaced by inf.
    """
    if len(cycle.columns) > 1:
        motion = cycle.motion
        some = np.minimum(base.buckling_positions, motion.time.shape[-1] - 1)
        near = posture(motion, (..., some))
        cycle = Cycle(cycle.scene, cycle.scene.course.near(motion.time[..., some], near))
    return np.atleast_1d(np.nan_to_num(cycle.buckling_ratio.value, nan=np.inf).max(axis=0, initial=0.0))


def _buckling_reason(base: Base, values: Reals) -> str:
    """Return a description of the buckling of a design; empty if the design does not buckle."""
    scene = base.document.with_values({place.variable.path: float(value)
                                       for place, value in zip(base.places, values, strict=True)}).scene  # fmt: skip
    words = at_breaks(Results(scene, scene_deflection(scene, scene_motion(scene, partial=True)))).buckles
    return f"{VERDICTS[BROKEN]}: {words}" if words else ""


def _opening_joint(cycle: Cycle) -> Words:
    """Return, for each design, the name of a joint that opens at one or more positions, shape (designs,).

    The joint belongs to the first group of links that cannot be assembled. The name is empty if all groups can be
    assembled.
    """
    motion = cycle.motion
    name = np.full(cycle.columns[:-1], "", object)
    for closed in motion.closures:
        links = list(closed.group.links)
        if closed.group.cut:
            closes = np.isfinite(motion.origin[links] + motion.direction[links]).all(axis=(0, -1))
            closes = np.broadcast_to(closes, name.shape)
            name[~closes & (name == "")] = closed.group.cut[0].name
    return name


class Evaluation(Struct, frozen=True, dict=True):
    """Callable object that computes the designs of a plan, see `kinelast.sweep.running.Compute`.

    The results are columns: input values by path, and figures by name.
    """

    document: Document
    plan: Plan
    figures: tuple[str, ...] | None = None

    def __reduce__(self) -> Any:
        """Pickle only the document, plan and figures. After unpickling, `base` is computed again."""
        return Evaluation, (self.document, self.plan, self.figures)

    @cached_property
    def base(self) -> Base:
        """Common data of all designs, computed once per process."""
        return base_of(self.document, self.plan.paths, self.figures)

    @property
    def units(self) -> dict[str, str]:
        """Units of the columns."""
        numbers = {place.variable.path: place.variable.unit for place in self.base.places}
        return {**numbers, **{measure.name: measure.unit for measure in self.base.measures}}

    def __call__(self, first: int, last: int) -> tuple[dict[str, Any], Sequence[str]]:
        """Return the columns for designs `first` to `last` - 1, and the reasons for missing figures."""
        values = self.plan.values(first, last)
        found = evaluated(self.base, values)
        numbers = dict(zip(self.plan.paths, values.T, strict=True))
        return {**numbers, **found.columns}, found.reason


def batched_figures(
    document: Document,
    paths: Sequence[str],
    figures: Sequence[str | Figure],
    progress: Progress = SILENT,
    stage: str = "",
) -> Callable[[np.ndarray], Designs]:
    """Return a function that computes the figures of designs in batches and reports progress before each batch.

    The returned function takes the input values at `paths`, shape (designs, paths).
    """
    base = base_of(document, paths, figures)
    part = BATCH if all(base.on_axis) else SMALL_BATCH if any(base.on_axis) else 1

    def found(values: np.ndarray) -> Designs:
        parts = []
        for first in range(0, len(values), part):
            if stage:
                progress(stage, first, len(values))
            parts.append(evaluated(base, values[first : first + part]))
        if len(parts) == 1:
            return parts[0]
        places = {name: None for part in parts for name in part.place}
        return Designs(
            {name: np.concatenate([part.columns[name] for part in parts]) for name in parts[0].columns},
            parts[0].units,
            np.concatenate([part.reason for part in parts]),
            {name: np.concatenate([_place(part, name) for part in parts]) for name in places},
        )

    return found


def _place(part: Designs, name: str) -> Integers:
    return part.place.get(name, np.full(len(part.reason), -1))
