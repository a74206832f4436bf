"""Groups of links that are placed together, and the order in which they are.

A group is a smallest set of links whose place follows from links placed before it: a driven link, a dyad, or any
larger Assur group. Within a group the *tree* joints hang every link on one placed before it and leave each a freedom or
none (a driven joint); the *cut* joints close the loops and fix those freedoms.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

from rigid.joints import Joint


@dataclass(frozen=True, eq=False)
class Group:
    """Links that are placed together.

    `tree[k]` carries `links[k]`; `free` the numbers of the tree joints that no drive moves. `carried` lists per free
    joint the links that it carries, each with the numbers of the tree joints from its own back to that one. `cut`
    closes the loops.
    """

    links: tuple[int, ...]
    tree: tuple[Joint, ...]
    cut: tuple[Joint, ...]
    free: tuple[int, ...]
    carried: tuple[tuple[tuple[int, tuple[int, ...]], ...], ...]

    @property
    def surplus(self) -> int:
        """Number of constraints beyond its freedoms."""
        return 2 * len(self.cut) - len(self.free)

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
        return not self.free or (len(self.links) == len(self.free) == 2 and len(self.cut) == 1)


@dataclass(frozen=True, eq=False)
class Structure:
    """The groups in the order of solution, and all joints (tree joints, then cut joints, group by group)."""

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
        drivers = [joint.gear.driver for joint in self.joints if joint.gear is not None]
        return tuple(sorted({(each.name, each.parent, each.child) for each in drivers if not each.moved}))

    def __repr__(self) -> str:
        return f"Structure({len(self.groups)} groups, {len(self.joints)} joints)"
