"""What a scene allows: limits of deflection, safety and output, and which point or angle is the output."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

from kinelast.scene.error import fault, known_name, likely
from kinelast.scene.format import SceneTable
from kinelast.scene.format_limits import LimitsTable, LinkLimitsTable
from kinelast.scene.many import real
from rigid import Mechanism


@dataclass(frozen=True)
class Limit:
    """A bound that the answer is held against.

    Attributes
    ----------
    kind
        "deflection" or "chord" [m] or "output" [m or rad], which may not be more, or "safety", which may not be less.
    link
        Whose; empty for all links.
    """

    kind: str
    link: str
    value: float
    unit: str


@dataclass(frozen=True)
class Output:
    """What the machine is there for: the place of a point, or the angle of a link where `point` is empty."""

    link: str
    point: str = ""


def build_limits(table: SceneTable, mechanism: Mechanism) -> tuple[Limit, ...]:
    """All limits of a scene."""
    return tuple(_limits(table, mechanism))


def _limits(table: SceneTable, mechanism: Mechanism) -> Iterator[Limit]:
    limits = table.limits
    yield from _of_links(limits, "")
    elastic = [link.name for link in mechanism.links[1:] if link.beams]
    for name, own in limits.links.items():
        known_name("limits.links", name, name, elastic, "link with beams")
        yield from _of_links(own, name)
    if limits.output is not None:
        output, unit = build_output(table, mechanism), limits.output.unit
        meant = unit if output is None else "m" if output.point else "rad"
        if unit not in ("", meant):
            expected = 'a length, as in "0.1 mm"' if meant == "m" else 'an angle, as in "0.1 deg"'
            raise fault("limits", "output", f"expected {expected}, as the output is {table.run.output}")
        if not meant and table.units != "m":
            expected = 'a length or an angle with its unit, as in "0.1 mm"'
            raise fault("limits", "output", f"expected {expected}, as no output is named under [run]")
        yield Limit("output", "", limits.output.within(meant), meant)


def _of_links(table: LimitsTable | LinkLimitsTable, link: str) -> Iterator[Limit]:
    for kind, value, unit in (
        ("deflection", table.deflection, "m"),
        ("chord", table.chord, "m"),
        ("safety", table.safety, "1"),
    ):
        if value is not None:
            yield Limit(kind, link, real(value), unit)


def build_output(table: SceneTable, mechanism: Mechanism) -> Output | None:
    """The output that a scene names, as a point or as LINK.angle; None where it names none.

    Raises
    ------
    SceneError
        There is no such point that moves, or no such link.
    """
    words = table.run.output
    if not words:
        return None
    moving = mechanism.links[1:]
    owner, _, what = words.rpartition(".")
    if owner and what == "angle":
        if owner not in {link.name for link in moving}:
            names = [link.name for link in moving]
            raise fault("run", "output", f'there is no moving link "{owner}"{likely(owner, names)}')
        return Output(owner)
    still = mechanism.links[0].points
    found = next((link.name for link in moving if words in link.points and words not in still), None)
    if found is None:
        names = list(dict.fromkeys(point for link in moving for point in link.points if point not in still))
        problem = f'there is no point "{words}" that moves{likely(words, names)}'
        problem += f'; an angle is named as in "{moving[-1].name}.angle"'
        raise fault("run", "output", problem)
    return Output(found, words)
