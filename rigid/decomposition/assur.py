"""Assur groups of a mechanism, with class and order."""

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
    """A group of links that are solved together.

    Attributes
    ----------
    links
        Names of the links, in the order of the mechanism.
    drives
        Indices of the drives of joints inside the group, or between the group and placed links.
    group_class
        1 for links that are placed by drives or welds only, and 2 for a dyad. For larger groups, the order of the
        largest contour: the number of links in a loop of the group, or of inner joints on one link. 0 for
        overconstrained links, which are not an Assur group.
    order
        Number of joints between the group and placed links.
    signature
        For a dyad, the types of its outer, inner and outer joint, such as "RRP"; otherwise "".
    surplus
        Number of redundant constraints.
    fixed
        Whether the links are placed by welds only.
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
            return f"overconstrained {links}, {counted(self.surplus, 'redundant constraint')}"
        if self.group_class == 1 and self.fixed:
            return "welded link" if len(self.links) == 1 else "welded links"
        if self.group_class == 1:
            return "driven link" if len(self.links) == 1 else "driven chain"
        kind = f"dyad {self.signature}" if self.signature else f"group of {len(self.links)} links"
        return f"{kind}, class {ROMAN[self.group_class]}"


def assur_groups(mechanism: Mechanism) -> tuple[AssurGroup, ...]:
    """Return the groups of a mechanism in the order of solution. Their highest class is that of the mechanism.

    Two links of a group with a driven joint or a weld between them count as one body.

    Raises
    ------
    MechanismError
        If the drives do not determine the mechanism.

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
    body_of = _bodies(group.links, joints)
    free = [joint for joint in joints if not joint.moved]
    inner = [joint for joint in free if -1 not in (body_of.get(joint.parent, -1), body_of.get(joint.child, -1))]
    outer = [joint for joint in free if joint not in inner]
    bodies = set(body_of.values()) - {-1}
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
    edges = [(body_of[joint.parent], body_of[joint.child]) for joint in inner]
    most_joints = max(sum(body in edge for edge in edges) for body in bodies)
    return AssurGroup(names, drives, max(2, most_joints, _greatest_contour(edges)), len(outer))


def _bodies(links: Iterable[int], joints: Iterable[Joint]) -> dict[int, int]:
    """Map each link to the body that it forms with links at driven joints; -1 if a placed link belongs to it."""
    body = {link: link for link in links}
    for joint in joints:
        if joint.moved:
            parent, child = body.get(joint.parent, -1), body.get(joint.child, -1)
            kept, merged = min(parent, child), max(parent, child)
            body = {link: kept if old == merged else old for link, old in body.items()}
    return body


def _greatest_contour(edges: list[tuple[int, int]]) -> int:
    """Return the number of links in the largest loop of a minimal cycle basis, or 0.

    Horton's method: candidates are the shortest loops through each edge and each link. A loop joins the basis if it is
    independent of the shorter ones.
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
        for vector in basis:
            rest = min(rest, rest ^ vector)
        if rest:
            basis.append(rest)
            basis.sort(reverse=True)
            greatest = loop.bit_count()
    return greatest


def _shortest_paths(root: int, edges: list[tuple[int, int]]) -> dict[int, int]:
    """Return the edges on a shortest path from a body to each other body, as the bits of a number."""
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
