"""Assur groups of a mechanism, with class and order."""

from collections import deque
from collections.abc import Iterable

from msgspec import Struct

from rigid.decomposition.groups import Group
from rigid.decomposition.order import structure
from rigid.joints import Joint
from rigid.mechanism import Mechanism
from rigid.names import counted

ROMAN = ("0", "I", "II", "III", "IV", "V", "VI", "VII", "VIII", "IX", "X")


class AssurGroup(Struct, frozen=True):
    """Group of links that are positioned together (Assur group).

    Attributes
    ----------
    links
        Names of the links, in the order of the mechanism.
    drives
        Indices of the drives of joints inside the group, or between the group and links of earlier groups.
    group_class
        Class 0: overconstrained links, which are not an Assur group. Class 1: links that are positioned by drives or
        welds only. Class 2: a dyad, i.e. two links with three joints. The class of a larger group is the larger of two
        numbers: the largest number of links in an independent loop of the group, and the largest number of inner joints
        on one link.
    order
        Number of joints between the group and links of earlier groups. In groups of class 2 or higher, joints with
        drives do not count.
    signature
        For a dyad, the types of its outer, inner and outer joint, such as "RRP"; otherwise "".
    surplus
        Number of redundant constraints.
    fixed
        Whether the links are positioned by welds only.
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
    """Return the groups of a mechanism in the order of solution. The highest class is the class of the mechanism.

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
    """Map each link to the index of its body, i.e. a set of links that are connected by driven joints or welds.

    The index of a body is its smallest link index, or -1 if it contains a link of an earlier group.
    """
    body = {link: link for link in links}
    for joint in joints:
        if joint.moved:
            parent, child = body.get(joint.parent, -1), body.get(joint.child, -1)
            kept, merged = min(parent, child), max(parent, child)
            body = {link: kept if old == merged else old for link, old in body.items()}
    return body


def _greatest_contour(edges: list[tuple[int, int]]) -> int:
    """Return the number of links in the largest loop of a minimal cycle basis, or 0 without loops.

    `edges` are pairs of bodies that a joint connects. Horton's method: the candidates are the shortest loops through
    each pair of an edge and a body. They are added to the basis in ascending order of length. A candidate is skipped if
    it depends on the loops in the basis.
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
    """Return for each body the edges on a shortest path from `root`, as a bit mask.

    Bit k of the mask is 1 if the path contains edge k.
    """
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
