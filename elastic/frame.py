"""The beams of a link as a tree: the order in which loads are summed and displacements passed on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

from rigid import Link, Mechanism, MechanismError


@dataclass(frozen=True)
class Branch:
    """A beam in the tree of its link: `number` among all beams, `near` and `far` its ends from the tree's root."""

    number: int
    near: str
    far: str
    forward: bool


@lru_cache(maxsize=64)
def branches(mechanism: Mechanism) -> dict[int, tuple[Branch, ...]]:
    """Beams of every moving link that has some, from the root outwards.

    Raises
    ------
    MechanismError
        The beams of a link close a ring or do not hang together.
    """
    trees, number = {}, 0
    for at, link in enumerate(mechanism.links[1:], 1):
        if link.beams:
            trees[at] = _tree(link, number)
            number += len(link.beams)
    return trees


def _tree(link: Link, first: int) -> tuple[Branch, ...]:
    waiting = list(enumerate(link.beams, first))
    reached = {waiting[0][1].start}
    order = []
    while waiting:
        found = next((item for item in waiting if {item[1].start, item[1].end} & reached), None)
        if found is None:
            raise MechanismError(f'link "{link.name}": its beams do not hang together')
        number, beam = found
        if {beam.start, beam.end} <= reached:
            raise MechanismError(f'link "{link.name}": its beams close a ring at "{beam.start}"-"{beam.end}"')
        forward = beam.start in reached
        near, far = (beam.start, beam.end) if forward else (beam.end, beam.start)
        order.append(Branch(number, near, far, forward))
        reached.add(far)
        waiting.remove(found)
    return tuple(order)
