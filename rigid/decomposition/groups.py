"""Groups of links that are placed together, and the order in which they are.

A group is a smallest set of links whose place follows from links placed before it: a driven link, a dyad, or any
larger Assur group. Within a group the *tree* joints hang every link on one placed before it and leave each a freedom or
none (a driven joint); the *cut* joints close the loops and fix those freedoms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from rigid.arrays import Reals
from rigid.joints import Body, Joint

RIGID = 3  # constraints that hold a link


@dataclass(frozen=True, eq=False)
class GearLoop:
    """Gears of a group that drive one another: their drivers are between links that their followers carry.

    Attributes
    ----------
    followers
        Numbers of the tree joints that follow them.
    carried
        Per follower the links that it carries, as in `Group.carried`.
    release
        Motions of all followers, child from parent, per motion that each gear gives its own while no follower moves,
        shape (followers, followers). Willis' equation is a row of it.
    """

    followers: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]
    release: Reals


@dataclass(frozen=True, eq=False)
class Group:
    """Links that are placed together.

    `tree[k]` carries `links[k]`; `free` the numbers of the tree joints that no drive moves. `carried` lists per free
    joint the links that it carries, each with the numbers of the tree joints from its own back to that one. `cut`
    closes the loops. `rings` are welds that close loops of nothing but welds. `loop`: gears that drive one another.
    """

    links: tuple[int, ...]
    tree: tuple[Joint, ...]
    cut: tuple[Joint, ...]
    free: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]
    rings: tuple[Joint, ...] = ()
    loop: GearLoop | None = None

    @property
    def joints(self) -> tuple[Joint, ...]:
        """Tree joints, cut joints, and the welds of rings."""
        return self.tree + self.cut + self.rings

    @property
    def surplus(self) -> int:
        """Number of constraints beyond its freedoms."""
        return 2 * len(self.cut) + RIGID * len(self.rings) - len(self.free)

    @cached_property
    def fixed(self) -> tuple[Joint, ...]:
        """The tree joints without a coordinate, welds: their children are placed with their parents."""
        return tuple(joint for joint in self.tree if not joint.freedoms)

    @cached_property
    def dyad(self) -> tuple[Joint, Joint, Joint] | None:
        """The two outer joints of a dyad and the inner one, between its two bodies; None where it is none.

        A body is a link with all that are welded to it, and stands for them by the first in the tree.
        """
        if not len(self.links) - len(self.fixed) == len(self.free) == 2 or len(self.cut) != 1:
            return None
        outer, inner = [self.tree[number] for number in self.free], self.cut[0]
        if self.fixed:
            bodies: dict[int, Body] = {}
            for joint in self.tree:
                bodies.setdefault(joint.parent, Body(joint.parent))
                bodies[joint.child] = joint.carry(bodies[joint.parent])
            bodies.setdefault(inner.parent, Body(inner.parent))
            outer, inner = [joint.on_bodies(bodies) for joint in outer], inner.on_bodies(bodies)
        return outer[0], outer[1], inner

    @cached_property
    def angles(self) -> tuple[bool, ...]:
        """Of every free coordinate, whether it is an angle; else it is a slide."""
        return tuple(self.tree[number].turns for number in self.free)

    @cached_property
    def guides(self) -> tuple[bool, ...]:
        """Of every cut joint, whether it holds its links against turning."""
        return tuple(not joint.turns for joint in self.cut)

    @cached_property
    def closed_form(self) -> bool:
        """Whether it is a driven link or a dyad."""
        return not self.free or self.dyad is not None


@dataclass(frozen=True, eq=False)
class Structure:
    """The groups in the order of solution, and all joints (tree joints, cut joints and rings, group by group)."""

    groups: tuple[Group, ...]
    joints: tuple[Joint, ...]

    @cached_property
    def surplus(self) -> bool:
        """Whether a group has more constraints than freedoms."""
        return any(group.surplus for group in self.groups)

    @property
    def closed_form(self) -> bool:
        """Whether one position by itself tells all places, once the branch is known."""
        return all(group.closed_form for group in self.groups) and not self.measured_drivers

    @cached_property
    def measured_drivers(self) -> tuple[tuple[str, int, int], ...]:
        """Names and links of the joints that drive a gear and are not themselves moved."""
        drivers = [driver for joint in self.joints if joint.gear for _, driver in joint.gear.sources]
        return tuple(sorted({(each.name, each.parent, each.child) for each in drivers if not each.moved}))

    def __repr__(self) -> str:
        return f"Structure({len(self.groups)} groups, {len(self.joints)} joints)"
