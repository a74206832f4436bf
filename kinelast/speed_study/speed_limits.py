"""Limits as a function of drive speed: outcome of each limit, and speeds at which limits fail or links yield."""

import math
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.elastodynamics import BoundUtilisation, Resonance, SpeedMap, SpeedSearch
from kinelast.answers.refusals import STRENGTH, refusals
from kinelast.figures.measures import bounded_items
from kinelast.figures.registry import limits_of
from kinelast.reports.limits import KEPT, SEVERITY, UNKNOWN, ends, outcome_index, outcome_indices
from kinelast.scene.data import Scene
from kinelast.values.figure import BEAM, Figure, Limit, items_of
from rigid.arrays import Reals

SCANNED = {"deflection": 0, "chord": 1, "safety": 2}  # row of each figure in the results of the speed scan
AMPLIFIED = 1.2  # a resonance is reported if the ratio of value to quasi-static value is larger


class SpeedLimit(Struct, frozen=True):
    """The speed above which the limits of a scene are no longer met.

    Attributes
    ----------
    speed, above
        Bracket of the limit speed. `speed` is the highest speed up to which all limits are met and no link yields,
        taking errors into account; 0.0 if there is no such speed. `above` is the lowest speed at which this is no
        longer certain.
    broken
        Lowest speed at which a limit is violated by more than its error, or at which a link yields; infinite if there
        is no such speed. Between `above` and `broken`, limits are too close to decide.
    limit, item
        The limit that fails first, and the number of the item that fails. The limit is `STRENGTH` if a link yields, and
        None if there is no steady state at `above`.
    resonance
        Mode with the strongest vibration at the speed `above`; None if vibration has little effect.
    problem
        Reason why the limit cannot be judged. It is empty if the limit is violated or too close to decide, or if a link
        yields.
    """

    speed: float
    above: float
    broken: float
    limit: Limit | None
    item: int
    resonance: Resonance | None
    problem: str = ""


def amplified(search: SpeedSearch, ratio: float, value: float, still: float) -> Resonance | None:
    """Return the mode with the strongest vibration, or None if `value` is close to the quasi-static value `still`."""
    return search.model.resonance(ratio) if value > AMPLIFIED * still else None


def by_figure(scene: Scene, figures: Sequence[Figure], rows: Any) -> dict[str, Any]:
    """Split an array of shape (speeds, rows) into arrays of shape (items, speeds), one for each figure, by key."""
    parts = np.split(rows.T, np.cumsum([len(items_of(scene, figure.of)) for figure in figures])[:-1])
    return {figure.key: part for figure, part in zip(figures, parts, strict=True)}


def outcomes(scene: Scene, values: Mapping[str, Any], errors: Mapping[str, Any]) -> Iterator[Any]:
    """Yield, for each limit, an array with the outcomes at all speeds, as indices into `SEVERITY`.

    The last array contains the outcome for yielding, if there are limits and a yield stress is known.
    """
    yield from outcome_indices(scene, values, errors)
    beams = _yieldable(scene)
    if limits_of(scene) and beams:
        safety = values[STRENGTH.figure][beams]
        outcome = np.maximum(outcome_index(STRENGTH, safety, errors[STRENGTH.figure][beams]), SEVERITY.index(UNKNOWN))
        yield np.where(np.isnan(safety), SEVERITY.index(KEPT), outcome).min(axis=0)


def limit_speed(
    scene: Scene, figures: Sequence[Figure], still: Sequence[Figure], search: SpeedSearch, nominal: float
) -> SpeedLimit | None:
    """Return the limit speed and the limit that fails first, or None if all limits are met at all speeds.

    Yielding is treated like a limit, because no other limit can be judged if a link yields.
    """
    rows = [(limit, item) for limit in limits_of(scene) for item in bounded_items(scene, limit)]
    rows += [(STRENGTH, beam) for beam in _yieldable(scene)]

    def used(answers: SpeedMap, side: float = 1.0) -> Reals:
        values, errors = (by_figure(scene, figures, each) for each in (answers.values, answers.errors))
        shares = []
        for limit, item in rows:
            if limit is STRENGTH:
                shares.append(_near_yield(values, item, errors if side > 0.0 else {}))
                continue
            share = _used(limit, values.get(limit.figure), errors.get(limit.figure), item, side)
            for _, refused in _refusals(scene, limit, item, values):
                share = np.where(refused, np.nan, share)
            shares.append(share)
        return np.array(np.broadcast_arrays(*shares))

    fields = [SCANNED.get(limit.figure, 0) for limit, _ in rows]
    beams = [item if limit.of == BEAM else -1 for limit, item in rows]
    bracket = search.find_limit(BoundUtilisation(used, fields, beams))
    if bracket is None:
        return None
    low, above = bracket
    answers = search.solutions.map([above])
    limit_at = partial(SpeedLimit, low * nominal, above * nominal)
    if not answers.stable.all():
        return limit_at(above * nominal, None, -1, None)
    shares = used(answers)[:, 0]
    parts = by_figure(scene, figures, answers.values), by_figure(scene, still, answers.quasi_static)
    if not np.any(shares > 1.0):
        limit, item = rows[int(np.isnan(shares).argmax())]
        known = limit.figure in parts[0] and np.isfinite(parts[0][limit.figure][item]).all()
        reasons = [words for words, refused in _refusals(scene, limit, item, parts[0]) if refused.any()]
        reasons = reasons or ["its error is unknown" if known else "the figure is unknown"]
        return limit_at(above * nominal, limit, item, None, "; ".join(reasons))
    passed = search.find_limit(BoundUtilisation(partial(used, side=-1.0), fields, beams))
    broken = math.inf if passed is None else passed[1] * nominal
    limit, item = rows[int(np.nan_to_num(shares, nan=0.0).argmax())]
    one, other = (float(_used(limit, part[limit.figure], None, item, 0.0)[0]) for part in parts)
    return limit_at(broken, limit, item, amplified(search, above, one, other))


def yield_speed(
    scene: Scene, figures: Sequence[Figure], search: SpeedSearch, nominal: float
) -> tuple[float, int] | None:
    """Return the lowest speed at which a link yields, and the number of the yielding beam; None if no link yields."""
    beams = _yieldable(scene)

    def used(answers: SpeedMap) -> Reals:
        values = by_figure(scene, figures, answers.values)
        return np.array([_near_yield(values, beam, {}) for beam in beams])

    bracket = (
        search.find_limit(BoundUtilisation(used, [SCANNED[STRENGTH.figure]] * len(beams), beams)) if beams else None
    )
    if bracket is None:
        return None
    return bracket[1] * nominal, beams[int(used(search.solutions.map(bracket[1:])).argmax())]


def _yieldable(scene: Scene) -> list[int]:
    """Return the numbers of the beams with a known yield stress."""
    return [beam for beam, section in enumerate(scene.sections) if np.isfinite(section.yield_stress).any()]


def _near_yield(values: Mapping[str, Any], beam: int, errors: Mapping[str, Any]) -> Reals:
    """Return the stress plus its error, relative to the yield stress of a beam, shape (speeds,).

    Return 0 if it is unknown. The error is zero if `errors` is empty.
    """
    safety = values[STRENGTH.figure]
    return np.where(np.isnan(safety[beam]), 0.0, _used(STRENGTH, safety, errors.get(STRENGTH.figure), beam, 1.0))


def _refusals(scene: Scene, limit: Limit, item: int, values: Mapping[str, Any]) -> Iterator[tuple[str, Any]]:
    """Yield the possible reasons, other than yielding, why a limit cannot be judged.

    Each reason comes with flags of shape (speeds,) that are true if it applies.
    """
    without = {key: each for key, each in values.items() if key != STRENGTH.figure}
    return refusals(scene, limit.figure, [item], without)


def _used(limit: Limit, values: Any, errors: Any, item: int, side: float) -> Reals:
    """Return the utilisation of a limit by an item, shape (speeds,); nan if the figure is unknown.

    The value is moved by its error in the unfavourable direction if `side` is 1, and in the favourable direction if
    `side` is -1.
    """
    if values is None:
        return np.full(1, np.nan)
    value = np.asarray(values[item])
    low, high = ends(limit, value, 0.0 if errors is None else errors[item])
    own = replace(limit, bound=float(np.ravel(limit.bound)[0]))
    return own.used(low if limit.least == (side > 0.0) else high)
