"""Reasons why limits cannot be judged: a link yields, or a sizing formula is used outside its range of validity."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import numpy as np

from kinelast.figures.registry import limits_of
from kinelast.scene.data import Scene
from kinelast.scene.parts import PARTS
from kinelast.values.figure import Limit
from kinelast.values.numbers import number
from machine import Range
from rigid.arrays import Flags

CHECKS = [check for part in PARTS for check in part.checks]
MAX_NAMED = 3  # maximum number of yielding links that are named in addition to the worst link
STRENGTH = Limit("safety", 1.0, least=True, unit="1")  # no limit can be judged if a link yields


def needed_by_limits(scene: Scene) -> set[str]:
    """Return the keys of figures that are needed to judge the limits, in addition to the limited figures."""
    limited = {limit.figure for limit in limits_of(scene)}
    of_parts = (key for part in PARTS if part.of(scene) for key in part.needs)
    of_strength = (STRENGTH.figure,) if can_yield(scene) else ()
    return {*of_parts, *of_strength, *(check.by for check in CHECKS if limited & {*check.refuses})}


def can_yield(scene: Scene) -> bool:
    """Return whether the yield stress of at least one beam is known."""
    return any(np.isfinite(section.yield_stress).any() for section in scene.sections)


def yield_words(scene: Scene, safeties: Sequence[float]) -> str:
    """Return words on the largest stress and on all links that yield; empty if no link yields."""
    known = {beam: safety for beam, safety in enumerate(safeties) if safety < STRENGTH.bound}
    if not known:
        return ""
    worst, *_ = beams = sorted(known, key=lambda each: known[each])
    _, *others = dict.fromkeys(scene.mechanism.links[scene.mechanism.beams[beam][0]].name for beam in beams)
    named = others if len(others) <= MAX_NAMED else [*others[: MAX_NAMED - 1], f"{len(others) - MAX_NAMED + 1} more"]
    more = f"; {' and '.join(named)} yield{'s' * (len(others) == 1)} too" if others else ""
    return f"stress is {number(1.0 / known[worst], 3)} times the yield strength of {scene.member_names[worst]}{more}"


def refusals(
    scene: Scene, figure: str, items: Sequence[int], figures: Mapping[str, Any], errors: Mapping[str, Any] | None = None
) -> Iterator[tuple[str, Any]]:
    """Yield the possible reasons why a limit cannot be judged, each with flags that are true if the reason applies.

    The flags have the shape (...), e.g. one for each design.

    Parameters
    ----------
    figure, items
        Key of the figure that the limit applies to, and numbers of the items.
    figures
        Values of all items by key, including the figures from `needed_by_limits`.
    errors
        Errors in `figures`, with the same shapes. If they are not given, they count as zero.
    """
    safeties = np.asarray(figures.get(STRENGTH.figure, np.zeros(0)), float)
    if len(safeties):
        least = np.fmin.reduce(safeties, axis=0)
        yield yield_words(scene, np.fmin.reduce(safeties.reshape(len(safeties), -1), axis=1).tolist()), least < 1.0
        error = np.asarray((errors or {}).get(STRENGTH.figure, 0.0), float)
        may = (least >= STRENGTH.bound) & (safeties < STRENGTH.bound * (1.0 + error / safeties))
        names = dict.fromkeys(
            scene.member_names[beam] for beam in np.flatnonzero(may.reshape(len(may), -1).any(axis=1))
        )
        yield f"{' and '.join(names)} may yield: the stress with its error exceeds the yield strength", may.any(axis=0)
    for part in PARTS:
        yield from part.faults(scene, figures)
    for check in CHECKS:
        if figure in check.refuses and check.by in figures:
            inside = check.range.holds(check.quantity(scene, np.asarray(figures[check.by])))
            yield check.range.condition, ~inside[[*items]].all(axis=0)


def outside_ranges(scene: Scene, figures: Mapping[str, Any]) -> Iterator[tuple[Range, dict[str, float]]]:
    """Yield each range of validity that some items violate, and the checked quantity of each of these items by name."""
    for check in CHECKS:
        names = scene.shown_items(check.of)
        values = check.quantity(scene, np.asarray(figures.get(check.by, []), float)) if names else np.zeros(0)
        outside: Flags = ~check.range.holds(values)
        if outside.any():
            yield check.range, {names[item]: float(values[item]) for item in np.flatnonzero(outside)}
