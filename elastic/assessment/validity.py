"""Validity of linear, quasi-static beam theory: detection of results outside its range of validity.

The limits and their sources are documented in docs/strength.md.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct

from elastic.assessment.beam_theory import introduction_share, shear_share
from elastic.assessment.columns import euler_ratio, member_lengths
from elastic.assessment.cycle import over_cycle
from elastic.extreme_values import Extreme, extremes
from elastic.largest import Largest
from elastic.solution import Deflection
from rigid import Reals
from rigid.constants import per_row

KINDS = ("slenderness", "deflection", "buckling", "yield")


class ValidityRange(Struct, frozen=True):
    """Limits of a figure that measures the validity of a result.

    Attributes
    ----------
    watch
        Upper limit of the figure for an accurate result.
    beyond
        Upper limit of the figure for a usable result. If the figure is between both limits, the result is less
        accurate. If the figure exceeds this limit, the result is unreliable.
    """

    watch: float
    beyond: float

    def passed(self, figure: float) -> bool:
        """Return whether a figure exceeds the limit `watch`."""
        return figure > self.watch

    def far_passed(self, figure: float) -> bool:
        """Return whether a figure exceeds the limit `beyond`."""
        return figure > self.beyond


VALIDITY_RANGES = {  # "vibration" limits the total error of a result, see `kinelast.answers.theory`
    "slenderness": ValidityRange(0.03, 0.25),
    "deflection": ValidityRange(0.01, 0.1),
    "buckling": ValidityRange(0.1, 0.5),
    "yield": ValidityRange(2 / 3, 1.0),
    "vibration": ValidityRange(0.03, 0.25),
}
"""Limits by kind of figure, see `Exceedance.figure`."""


class Exceedance(Struct, frozen=True):
    """A figure that exceeds its limit.

    Attributes
    ----------
    kind
        One of `KINDS`.
    beam
        Index of the beam in `Mechanism.beams`, or None for the whole mechanism.
    position
        Index of the position, or None if the figure does not belong to a single position.
    figure
        Ratio of two values, which depend on the kind. "slenderness": deflection that beam theory neglects, relative to
        the largest deflection from the chord. "deflection": deflection relative to the length of the member.
        "buckling": load relative to the critical load. "yield": von Mises stress relative to the yield stress.
    limit
        Limit that the figure exceeds: `ValidityRange.beyond` if severe, otherwise `ValidityRange.watch`.
    severe
        True if the figure exceeds `ValidityRange.beyond`, so that the result is unreliable.
    message
        Message for the user: the predicate of a sentence with the beam as its subject.
    """

    kind: str
    beam: int | None
    position: int | None
    figure: float
    limit: float
    severe: bool
    message: str


def exceedances(
    deflection: Deflection, kinds: Sequence[str] = KINDS, known: Mapping[str, Any] | None = None
) -> list[Exceedance]:
    """Find the limits that the beams of one design exceed: the largest figure of each kind and beam is checked.

    Parameters
    ----------
    kinds
        Kinds of figures to check.
    known
        Results that have already been computed, by key: results of `extremes` for "w" and "mises"; for "buckling", the
        largest load relative to the critical load. By default, this is the compression relative to the Euler load.

    Raises
    ------
    ValueError
        If there are several designs.
    """
    if len(deflection.motion.columns) != 1:
        raise ValueError(f"the deflection has several designs (shape {deflection.motion.columns}): expected one")
    if not deflection.sections:
        return []
    known = known or {}
    given = {"deflection": known.get("w"), "yield": known.get("mises"), "buckling": known.get("buckling")}
    return [exceeded for kind in kinds for exceeded in _CHECKS[kind](deflection, given.get(kind))]


def _judged(kind: str, beam: int | None, position: int | None, figure: float, message: str) -> Iterator[Exceedance]:
    limit = VALIDITY_RANGES[kind]
    if limit.passed(figure):
        severe = limit.far_passed(figure)
        yield Exceedance(kind, beam, position, figure, limit.beyond if severe else limit.watch, severe, message)


def _slender(deflection: Deflection, _: Extreme | None) -> Iterator[Exceedance]:
    """Check the errors of beam theory due to shear and due to moments introduced at beam ends."""
    parts = shear_share(deflection), introduction_share(deflection)
    for beam, (shear, introduced) in enumerate(zip(*parts, strict=True)):
        figure = float(max(shear, introduced))
        cause = "shear" if shear >= introduced else "local effects at its ends"
        neglected = f"{_share(figure)} its own largest deflection from the chord, due to {cause}"
        message = f"is short and deep: beam theory neglects about {neglected}"
        yield from _judged("slenderness", beam, None, figure, message)


def _deflection(deflection: Deflection, known: Extreme | None) -> Iterator[Exceedance]:
    found = (known or extremes(deflection, ["w"])["w"]).value / member_lengths(deflection)
    message = "deflects by {figure} its length: linear theory keeps the loads at the rigid link"
    yield from _per_beam("deflection", over_cycle(found), message)


def _buckling(deflection: Deflection, known: Reals | None) -> Iterator[Exceedance]:
    message = "carries {figure} its buckling load in compression"
    ratio = euler_ratio(deflection) if known is None else known
    yield from _per_beam("buckling", over_cycle(ratio), message)


def _yield(deflection: Deflection, known: Extreme | None) -> Iterator[Exceedance]:
    limit = per_row([section.yield_stress for section in deflection.sections], 1, float)
    if np.isfinite(limit).any():
        share = (known or extremes(deflection, ["mises"])["mises"]).value / limit
        yield from _per_beam("yield", over_cycle(share), "is stressed to {figure} its yield stress")


def _per_beam(kind: str, peak: Largest, message: str) -> Iterator[Exceedance]:
    for beam, (value, position) in enumerate(zip(np.abs(peak.value), peak.position, strict=True)):
        words = message.format(figure=_share(float(value)))
        yield from _judged(kind, beam, int(position), float(value), words)


def _share(figure: float) -> str:
    """Format a ratio as a percentage if it is below 1, and otherwise as a multiple."""
    return f"{100 * figure:.2g} % of" if figure < 1 else f"{figure:.3g} times"


_CHECKS: Mapping[str, Callable[[Deflection, Any], Iterator[Exceedance]]] = {
    "slenderness": _slender,
    "deflection": _deflection,
    "buckling": _buckling,
    "yield": _yield,
}
