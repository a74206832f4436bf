"""Groups of links that are placed together, in the order of solution.

A group is a minimal set of links determined by links placed before it: a driven link, a dyad, or a larger Assur group.
Within a group, the *tree* joints attach each link to one placed before it; each leaves a freedom unless it is driven.
The *cut* joints close the loops and determine those freedoms.
"""

from dataclasses import dataclass
from functools import cached_property

from rigid.arrays import Reals
from rigid.joints import Body, Joint

LINK_CONSTRAINTS = 3  # number of constraints that fix a link in the plane


@dataclass(frozen=True, eq=False)
class GearLoop:
    """Gears of a group that drive one another through their followers' links.

    Attributes
    ----------
    followers
        Numbers of the tree joints that follow the gears.
    carried
        Links carried by each follower, as in `Group.carried`.
    release
        Motions of all followers, child from parent, per prescribed motion of each gear with the other followers fixed,
        shape (followers, followers). Its rows are Willis' equation.
    """

    followers: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]
    release: Reals


@dataclass(frozen=True, eq=False)
class Group:
    """Links that are placed together.

    `tree[k]` carries `links[k]`; `free` are the numbers of the undriven tree joints. `carried` lists, per free joint,
    the links it carries, each with the numbers of the tree joints from the link back to that joint. `cut` closes the
    loops. `rings` are welds that close loops of welds. `loop`: gears that drive one another.
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
        """Tree joints, cut joints, and welds of rings."""
        return self.tree + self.cut + self.rings

    @property
    def surplus(self) -> int:
        """Number of constraints beyond the freedoms."""
        return 2 * len(self.cut) + LINK_CONSTRAINTS * len(self.rings) - len(self.free)

    @cached_property
    def fixed(self) -> tuple[Joint, ...]:
        """Welds of the tree, with children fixed to their parents."""
        return tuple(joint for joint in self.tree if not joint.freedoms)

    @cached_property
    def dyad(self) -> tuple[Joint, Joint, Joint] | None:
        """Outer joints of a dyad and the inner joint between its bodies, or None.

        A body is a link with all links welded to it, represented by the first one in the tree.
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
        """Whether each free coordinate is an angle; otherwise it is a slide."""
        return tuple(self.tree[number].turns for number in self.free)

    @cached_property
    def guides(self) -> tuple[bool, ...]:
        """Whether each cut joint prevents relative rotation."""
        return tuple(not joint.turns for joint in self.cut)

    @cached_property
    def closed_form(self) -> bool:
        """Whether the group is a driven link or a dyad."""
        return not self.free or self.dyad is not None


@dataclass(frozen=True, eq=False)
class Structure:
    """Groups in the order of solution, and all joints, group by group."""

    groups: tuple[Group, ...]
    joints: tuple[Joint, ...]

    @cached_property
    def surplus(self) -> bool:
        """Whether a group has more constraints than freedoms."""
        return any(group.surplus for group in self.groups)

    @property
    def closed_form(self) -> bool:
        """Whether each position can be solved independently, on a known branch."""
        return all(group.closed_form for group in self.groups) and not self.measured_drivers

    @cached_property
    def measured_drivers(self) -> tuple[tuple[str, int, int], ...]:
        """Names and links of undriven joints that drive a gear."""
        drivers = [driver for joint in self.joints if joint.gear for _, driver in joint.gear.sources]
        return tuple(sorted({(each.name, each.parent, each.child) for each in drivers if not each.moved}))

    def __repr__(self) -> str:
        return f"Structure({len(self.groups)} groups, {len(self.joints)} joints)"
