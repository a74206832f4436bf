"""Groups of links that are solved together for their positions, in the order of solution.

A group is a minimal set of links whose positions follow from the positions of earlier groups: a driven link, a dyad, or
a larger Assur group.

The *tree* joints of a group connect each of its links to an earlier link of the tree, or to a link
of an earlier group. The other joints are *cut* joints, which close loops. A tree joint without drive, gear or weld is
*free*. The coordinates of the free joints are determined by the condition that the gaps of the cut joints are zero.
"""

from functools import cached_property

from msgspec import Struct

from rigid.arrays import Reals
from rigid.joints import Body, Joint

LINK_CONSTRAINTS = 3  # number of constraints that fix a link in the plane


class GearLoop(Struct, frozen=True, eq=False):
    """Gears of a group that drive each other: the motion of each driver depends on the motions of the followers.

    Attributes
    ----------
    followers
        Indices of the tree joints that are followers of gears.
    carried
        For each follower, the links that move with it, as in `Group.carried`.
    release
        Matrix R with y = R r, shape (followers, followers). y are the motions of the followers (child relative to
        parent). Entry k of r is the motion of follower k if all other followers are fixed. R is the inverse of the
        matrix of Willis' equations.
    """

    followers: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]
    release: Reals


class Group(Struct, frozen=True, eq=False, dict=True):
    """Links that are solved together for their positions.

    Attributes
    ----------
    links
        Indices of the links, in the order of the tree.
    tree
        For each of `links`, the tree joint that has this link as child.
    cut
        Joints that close the loops.
    free
        Indices in `tree` of the joints without drives, gears or welds.
    carried
        For each free joint, the links that move with it. Each entry is a pair: a link, and the indices of the tree
        joints on the way from this link back to the free joint.
    rings
        Welds that connect links that other welds connect already.
    loop
        Gears that drive each other, or None.
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
        """All joints of the group: tree joints, cut joints, and `rings`."""
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
        """For each free joint, whether its coordinate is an angle (otherwise it is a displacement)."""
        return tuple(self.tree[number].turns for number in self.free)

    @cached_property
    def guides(self) -> tuple[bool, ...]:
        """For each cut joint, whether it prevents relative rotation of its links."""
        return tuple(not joint.turns for joint in self.cut)

    @cached_property
    def closed_form(self) -> bool:
        """Whether the group is a driven link or a dyad."""
        return not self.free or self.dyad is not None


class Structure(Struct, frozen=True, eq=False, dict=True):
    """Groups of a mechanism in the order of computation, and all joints, group by group."""

    groups: tuple[Group, ...]
    joints: tuple[Joint, ...]

    @cached_property
    def surplus(self) -> bool:
        """Whether any group has redundant constraints."""
        return any(group.surplus for group in self.groups)

    @property
    def closed_form(self) -> bool:
        """Whether each position can be computed without the positions before it, on a known branch (assembly).

        This requires that all groups have closed forms, and that no undriven joint drives a gear.
        """
        return all(group.closed_form for group in self.groups) and not self.measured_drivers

    @cached_property
    def measured_drivers(self) -> tuple[tuple[str, int, int], ...]:
        """Name, parent and child of each joint that has no drive but drives a gear."""
        drivers = [driver for joint in self.joints if joint.gear for _, driver in joint.gear.sources]
        return tuple(sorted({(each.name, each.parent, each.child) for each in drivers if not each.moved}))

    def __repr__(self) -> str:
        return f"Structure({len(self.groups)} groups, {len(self.joints)} joints)"
