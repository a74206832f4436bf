"""Assur groups of a mechanism with their class and order."""

from collections import deque
from collections.abc import Iterable
from dataclasses import dataclass

from rigid.decomposition.groups import Group
from rigid.decomposition.order import structure
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.names import counted

ROMAN = ("0", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X")


@dataclass(frozen=True)
class AssurGroup:
    """Group of links that are placed together.

    Attributes
    ----------
    links
        Names of the links, in the order of the mechanism.
    drives
        Numbers of the drives of joints inside the group or to placed links.
    group_class
        1 for links placed only by drives or welds, 2 for a dyad, otherwise the order of the largest contour: links in a
        loop of the group, or joints within the group on one link. 0 for overconstrained links, which are not an Assur
        group.
    order
        Number of joints to placed links.
    signature
        For a dyad, the pairs outer, inner, outer, such as "RRP"; otherwise "".
    surplus
        Number of constraints beyond the freedoms.
    fixed
        Whether only welds hold the links.
    """

    links: tuple[str, ...]
    drives: tuple[int, ...]
    group_class: int
    order: int
    signature: str = ""
    surplus: int = 0
    fixed: bool = False

    @property
    def name(self) -> str:
        """Description such as "dyad RRR, class II"."""
        if self.surplus:
            links = "link" if len(self.links) == 1 else "links"
            return f"redundant {links}, {counted(self.surplus, 'condition')} too many"
        if self.group_class == 1 and self.fixed:
            return "welded link" if len(self.links) == 1 else "welded links"
        if self.group_class == 1:
            return "driven link" if len(self.links) == 1 else "driven chain"
        what = f"dyad {self.signature}" if self.signature else f"group of {len(self.links)} links"
        return f"{what}, class {ROMAN[self.group_class]}"


def assur_groups(mechanism: Mechanism) -> tuple[AssurGroup, ...]:
    """Groups in the order of solution. The highest class is the class of the mechanism.

    A driven joint or a weld inside a group makes its two links one body.

    Raises
    ------
    MechanismError
        The drives do not determine the mechanism.

    Examples
    --------
    >>> from rigid import Link, Mechanism, PinDrive
    >>> from rigid.decomposition import assur_groups
    >>> links = (Link("ground", {"O": 0, "D": 3}), Link("crank", {"O": 0, "A": 1}),
    ...          Link("coupler", {"A": 0, "B": 3}), Link("rocker", {"D": 0, "B": 2}))
    >>> [group.name for group in assur_groups(Mechanism(links, (PinDrive("crank", "O"),), {}))]
    ['driven link', 'dyad RRR, class II']
    """
    return tuple(_classified(mechanism, group) for group in structure(mechanism).groups)


def _classified(mechanism: Mechanism, group: Group) -> AssurGroup:
    joints = group.joints
    names = tuple(mechanism.links[link].name for link in sorted(group.links))
    drives = tuple(sorted(joint.drive for joint in joints if joint.drive is not None))
    body = _bodies(group.links, joints)
    free = [joint for joint in joints if not joint.moved]
    inner = [joint for joint in free if -1 not in (body.get(joint.parent, -1), body.get(joint.child, -1))]
    outer = [joint for joint in free if joint not in inner]
    bodies = set(body.values()) - {-1}
    surplus = 2 * len(joints) + sum(joint.moved for joint in joints) - 3 * len(names)
    if surplus:
        return AssurGroup(names, drives, 0, len(outer), surplus=surplus)
    if not free:
        fixed = all(joint.drive is None and joint.gear is None for joint in joints)
        return AssurGroup(names, drives, 1, sum(joint.parent not in group.links for joint in joints), fixed=fixed)
    if len(bodies) == 2 and len(inner) == 1:
        ends = sorted(joint.letter for joint in outer)
        first, last = ("R", "P") if ends == ["P", "R"] else ends
        return AssurGroup(names, drives, 2, len(outer), first + inner[0].letter + last)
    edges = [(body[joint.parent], body[joint.child]) for joint in inner]
    held = max(sum(one in edge for edge in edges) for one in bodies)
    return AssurGroup(names, drives, max(2, held, _greatest_contour(edges)), len(outer))


def _bodies(links: Iterable[int], joints: Iterable[Joint]) -> dict[int, int]:
    """Map links to bodies, joined by driven joints; -1 for links driven from placed links."""
    body = {link: link for link in links}
    for joint in joints:
        if joint.moved:
            parent, child = body.get(joint.parent, -1), body.get(joint.child, -1)
            kept, gone = min(parent, child), max(parent, child)
            body = {link: kept if old == gone else old for link, old in body.items()}
    return body


def _greatest_contour(edges: list[tuple[int, int]]) -> int:
    """Number of links in the largest loop of a minimal cycle basis, or 0.

    Shortest loops through each edge and link, taken if independent of the previous ones (Horton's method).
    """
    bodies = sorted({body for edge in edges for body in edge})
    loops = set()
    for root in bodies:
        path = _shortest_paths(root, edges)
        for number, (one, other) in enumerate(edges):
            if path[one] ^ path[other] ^ (1 << number):
                loops.add(path[one] ^ path[other] ^ (1 << number))
    basis: list[int] = []
    greatest = 0
    for loop in sorted(loops, key=int.bit_count):
        rest = loop
        for held in basis:
            rest = min(rest, rest ^ held)
        if rest:
            basis.append(rest)
            basis.sort(reverse=True)
            greatest = loop.bit_count()
    return greatest


def _shortest_paths(root: int, edges: list[tuple[int, int]]) -> dict[int, int]:
    """Edges on a shortest path from a body to each other body, as bits."""
    path = {root: 0}
    waiting = deque([root])
    while waiting:
        here = waiting.popleft()
        for number, (one, other) in enumerate(edges):
            if here in (one, other):
                there = other if here == one else one
                if there not in path:
                    path[there] = path[here] | 1 << number
                    waiting.append(there)
    return path
