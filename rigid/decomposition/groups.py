"""Groups of links that are solved together, in the order of solution.

A group is a minimal set of links that is determined by previously placed links: a driven link, a dyad, or a larger
Assur group. The *tree* joints of a group attach each of its links to a previous link. Each tree joint leaves one
freedom, unless it is driven. The *cut* joints close the loops, which determines these freedoms.
"""

from dataclasses import dataclass
from functools import cached_property

from rigid.arrays import Reals
from rigid.joints import Body, Joint

LINK_CONSTRAINTS = 3  # number of constraints that fix a link in the plane


@dataclass(frozen=True, eq=False)
class GearLoop:
    """Mutually driving gears of a group: each driver depends on the followers' motion.

    Attributes
    ----------
    followers
        Indices of the tree joints that follow the gears.
    carried
        Links that each follower carries, as in `Group.carried`.
    release
        Motion of each follower (child relative to parent) per prescribed motion of each gear, shape (followers,
        followers). The prescribed motion is that with all other followers fixed. The rows are Willis' equations.
    """

    followers: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]
    release: Reals


@dataclass(frozen=True, eq=False)
class Group:
    """Links that are solved together.

    Attributes
    ----------
    links, tree
        Links, and the tree joint that carries each link.
    cut
        Joints that close the loops.
    free
        Indices of the undriven tree joints.
    carried
        For each free joint, the links that it carries, each with the indices of the tree joints from the link back to
        the free joint.
    rings
        Welds that close loops of welds.
    loop
        Mutually driving gears, or None.
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
        """Tree joints, cut joints, and welds that close rings."""
        return self.tree + self.cut + self.rings

    @property
    def surplus(self) -> int:
        """Number of redundant constraints."""
        return 2 * len(self.cut) + LINK_CONSTRAINTS * len(self.rings) - len(self.free)

    @cached_property
    def fixed(self) -> tuple[Joint, ...]:
        """Welds of the tree, which fix a child to its parent."""
        return tuple(joint for joint in self.tree if not joint.freedoms)

    @cached_property
    def dyad(self) -> tuple[Joint, Joint, Joint] | None:
        """The two outer joints and the inner joint of a dyad, or None for other groups.

        Welded links form one body, which is represented by its first link in the tree.
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
        """Whether each free coordinate is an angle (otherwise it is a slide)."""
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
    """Groups of a mechanism in the order of solution, and all joints, group by group."""

    groups: tuple[Group, ...]
    joints: tuple[Joint, ...]

    @cached_property
    def surplus(self) -> bool:
        """Whether any group has redundant constraints."""
        return any(group.surplus for group in self.groups)

    @property
    def closed_form(self) -> bool:
        """Whether each position on a known branch can be solved without its neighbours."""
        return all(group.closed_form for group in self.groups) and not self.measured_drivers

    @cached_property
    def measured_drivers(self) -> tuple[tuple[str, int, int], ...]:
        """Name, parent and child of each undriven joint that drives a gear."""
        drivers = [driver for joint in self.joints if joint.gear for _, driver in joint.gear.sources]
        return tuple(sorted({(each.name, each.parent, each.child) for each in drivers if not each.moved}))

    def __repr__(self) -> str:
        return f"Structure({len(self.groups)} groups, {len(self.joints)} joints)"
