"""Order in which the positions of links are computed: groups of links, each with a tree of joints."""

from collections.abc import Iterator, Sequence
from functools import lru_cache
from typing import Any

import numpy as np
from msgspec.structs import replace

from rigid.decomposition.connected import ConnectedSets
from rigid.decomposition.groups import GearLoop, Group, Structure
from rigid.decomposition.net import Net
from rigid.joints import Joint, WeldJoint
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import MechanismError

KNOWN = -1  # number that stands for all links with known positions
MAX_NAMED = 3  # maximum number of points listed in a message
RANK_TOLERANCE = 1e-9  # largest singular value or coefficient that counts as zero, relative to the largest entry


@lru_cache(maxsize=64)
def structure(mechanism: Mechanism) -> Structure:
    """Return the groups of a mechanism in the order in which their positions are computed.

    The result does not depend on the drawing, masses or loads.

    Raises
    ------
    MechanismError
        If there are too few or too many drives or joints, or if a drive is at an unknown joint.
    """
    drives = tuple(replace(drive, inertia=0.0) for drive in mechanism.drives)
    return _structure(mechanism.links, drives, mechanism.sliders, mechanism.gears, mechanism.welds)


@lru_cache(maxsize=64)
def _structure(*parts: Any) -> Structure:
    """Return the structure for links, drives, sliders, gears and welds.

    The cached result is used for all drawings of a mechanism, because the drawing is not an argument.
    """
    net = Net(*parts)
    known, groups = {0}, []
    unknown = set(range(1, len(net.links)))
    while unknown:
        links = next(net.determined(known, unknown), None) or next(net.surplus(known, unknown), None)
        if links is None:
            raise _undetermined(net, known, unknown)
        group = _group(net, links, known)
        inside = {end for joint in group.tree if joint.gear for end in joint.gear.ends} & set(links)
        groups.append(_with_loop(net, group) if inside else group)
        known |= set(links)
        unknown -= set(links)
    joints = tuple(joint for group in groups for joint in group.joints)
    _require_all(net, joints)
    return Structure(tuple(groups), joints)


def _group(net: Net, links: tuple[int, ...], known: set[int]) -> Group:
    """Choose the tree joints and cut joints of a set of links, and return the group.

    Joints are added to the tree unless they close a loop. The order is: welds, driven joints, joints to known links,
    other joints.
    """

    def rank(joint: Joint) -> tuple[int, bool, bool]:
        return joint.freedoms, not joint.moved, joint.parent not in known

    tree, cut = [], []
    sets = ConnectedSets((KNOWN, *links))
    for joint in sorted(net.joints(links, known), key=rank):
        parent, child = (KNOWN if link in known else link for link in (joint.parent, joint.child))
        if sets.join(parent, child):
            tree.append(joint)
        else:
            cut.append(joint)
    rings = [joint for joint in cut if not joint.freedoms]
    cut = [joint for joint in cut if joint.freedoms]
    if any(joint.moved for joint in cut):
        raise MechanismError(
            f"the drives of {net.quoted(links)} conflict: too many drives in one loop",
            kind="drives",
            links=net.names(links),
        )
    return _directed(links, tree, cut, rings, known)


def _directed(
    links: tuple[int, ...], tree: list[Joint], cut: list[Joint], rings: list[Joint], known: set[int]
) -> Group:
    """Return the group with the tree joints in order, each with its child farther from the known links."""
    placed: dict[int, tuple[int, ...]] = dict.fromkeys(known, ())
    tree_joints: list[Joint] = []
    free: list[int] = []
    while tree:
        joint = next(joint for joint in tree if joint.parent in placed or joint.child in placed)
        tree.remove(joint)
        if joint.parent not in placed:
            joint = joint.exchanged()
        if not joint.moved:
            free.append(len(tree_joints))
        placed[joint.child] = (len(tree_joints), *placed[joint.parent])
        tree_joints.append(joint)
    order = tuple(joint.child for joint in tree_joints)
    carried = tuple(
        tuple((link, placed[link][: placed[link].index(k) + 1]) for link in order if k in placed[link]) for k in free
    )
    return Group(order, tuple(tree_joints), tuple(cut), tuple(free), carried, tuple(rings))


def _with_loop(net: Net, group: Group) -> Group:
    """Add the release matrix, and the joints that prescribe each follower, to a group with gears that drive each other.

    The motions y of the followers (child relative to parent) satisfy y = r + M y. Entry k of r is the motion of
    follower k if all other followers are fixed; it is due to drives and to links of earlier groups. Therefore y = R r
    with the release matrix R = (I - M)^-1.
    """
    tree, followers = group.tree, [k for k, joint in enumerate(group.tree) if joint.gear]
    chains = _chains(group)
    carried = tuple(
        tuple((link, chain[: chain.index(k) + 1]) for link, chain in chains.items() if k in chain) for k in followers
    )
    open_ = np.eye(len(followers)) - np.array([[_driven_by(tree, chains, g, k) for k in followers] for g in followers])
    if np.linalg.svd(open_, compute_uv=False)[-1] <= RANK_TOLERANCE * np.abs(open_).max():
        raise MechanismError(
            f"the gears of {net.quoted(group.links)} lock one another or do not determine their motion: "
            "change a ratio, or drive another of their wheels",
            kind="freedoms",
            links=net.names(group.links),
        )
    release = np.linalg.inv(open_)
    sources = [_sources(net, tree, chains, k) for k in followers]
    joints = list(tree)
    for row, k in enumerate(followers):
        terms: dict[tuple[str, int, int], tuple[float, Joint]] = {}
        for share, given in zip(release[row], sources, strict=True):
            for factor, joint in given:
                key = joint.name, joint.parent, joint.child
                terms[key] = terms.get(key, (0.0, joint))[0] + tree[k].sense * share * factor, joint
        greatest = max((abs(factor) for factor, _ in terms.values()), default=0.0)
        law = tuple(term for term in terms.values() if abs(term[0]) > RANK_TOLERANCE * greatest)
        gear = tree[k].gear
        assert gear is not None
        joints[k] = replace(tree[k], gear=replace(gear, law=law))
    return replace(group, tree=tuple(joints), loop=GearLoop(tuple(followers), carried, release))


def _chains(group: Group) -> dict[int, tuple[int, ...]]:
    """Return the indices of the tree joints from each link of a group back to a link of an earlier group."""
    chains: dict[int, tuple[int, ...]] = {}
    for k, joint in enumerate(group.tree):
        chains[joint.child] = (k, *chains.get(joint.parent, ()))
    return chains


def _driven_by(tree: Sequence[Joint], chains: dict[int, tuple[int, ...]], follower: int, k: int) -> float:
    """Return the motion of the follower of a gear per unit motion of tree joint k.

    Both are motions of the child relative to the parent.
    """
    gear = tree[follower].gear
    assert gear is not None
    if gear.driver.turns != tree[k].turns:
        return 0.0
    ends = [k in chains.get(link, ()) for link in gear.ends]
    return tree[follower].sense * gear.ratio * (ends[1] - (ends[0] if gear.driver.turns else 0.0))


def _sources(
    net: Net, tree: Sequence[Joint], chains: dict[int, tuple[int, ...]], follower: int
) -> Iterator[tuple[float, Joint]]:
    """Yield the joints that prescribe the motion of a gear's follower while all other followers are fixed.

    Each item contains a factor and a joint. The motion is that of the child relative to the parent. Each joint either
    has a drive, or its coordinate is the angle of a link of an earlier group.
    """
    gear = tree[follower].gear
    assert gear is not None
    ratio = tree[follower].sense * gear.ratio
    if not set(gear.ends) & set(chains):
        yield ratio, gear.driver
        return
    for link, sign in zip(gear.ends, (-ratio, ratio), strict=True):
        chain = chains.get(link, ())
        driven = [tree[k] for k in chain if tree[k].drive is not None and tree[k].turns == gear.driver.turns]
        yield from ((sign, joint) for joint in driven)
        root = tree[chain[-1]].parent if chain else link
        if root and gear.driver.turns:
            yield sign, net.turned(root)


def _undetermined(net: Net, known: set[int], unknown: set[int]) -> MechanismError:
    """Return the error, with its cause, for unknown links among which no group can be found."""
    joints = net.joints(sorted(unknown), known)
    freedoms = 3 * len(unknown) - 2 * len(joints) - sum(joint.moved for joint in joints)
    names = net.names(unknown)
    who = f"link {net.quoted(unknown)} is" if len(unknown) == 1 else f"links {net.quoted(unknown)} are"
    if freedoms > 0:
        message = f"{who} left with {counted(freedoms, 'freedom')}: add a drive or a joint for each"
        return MechanismError(message + _unshared(net, unknown), kind="freedoms", links=names)
    if freedoms < 0:
        message = f"{who} overconstrained by {counted(-freedoms, 'constraint')}: remove a drive or a joint for each"
        return MechanismError(message, kind="freedoms", links=names)
    who = f"links {net.quoted(unknown)}"
    rings = [gear for gear, driver in net.geared.values() if {driver.parent, driver.child} & unknown]
    if rings:
        message = f"the gears of {who} are driven by the links that they move: drive one of these, such as the carrier"
        return MechanismError(message, kind="freedoms", links=names)
    message = f"some of the {who} are overconstrained and others are free: check their joints"
    return MechanismError(message, kind="freedoms", links=names)


def _unshared(net: Net, links: set[int]) -> str:
    """Return a note for an error message: points that belong to one link only, at which a joint may be missing."""
    joined = {*net.pins, *(slider.point for slider, _, _ in net.sliders.values())}
    alone = [name for at in sorted(links) for name in net.links[at].points if name not in joined]
    if not alone:
        return ""
    named = ", ".join(f'"{name}"' for name in alone[:MAX_NAMED])
    return f"; points of one link only: {named}"


def _require_all(net: Net, joints: Sequence[Joint]) -> None:
    """Raise MechanismError if a joint or drive of the mechanism is not in the joints of the groups."""
    for point, links in net.pins.items():
        used = sum(joint.name == point and joint.turns for joint in joints)
        if used < len(links) - 1:
            raise MechanismError(
                f'overconstrained: the pin "{point}" of {net.quoted(links)} joins links that are already determined',
                kind="overconstrained",
                links=net.names(links),
                joints=(point,),
            )
    made = {id(joint.weld) for joint in joints if isinstance(joint, WeldJoint)}
    for (point, ends), weld in net.welds.items():
        if id(weld) not in made:
            raise MechanismError(
                f'the links {net.quoted(ends)} are already joined by other welds at "{point}": leave out one weld',
                kind="overconstrained",
                links=net.names(ends),
                joints=(point,),
            )
    surplus = sorted(set(net.sliders) - {joint.name for joint in joints if not joint.turns})
    if surplus:
        raise MechanismError(
            f'overconstrained: the slider "{surplus[0]}" joins links that are already determined',
            kind="overconstrained",
            joints=surplus[:1],
        )
    idle = set(range(len(net.drives))) - {joint.drive for joint in joints}
    if idle:
        name = next(key[0] for key, number in net.driven.items() if number in idle)
        raise MechanismError(
            f'too many drives: the one at "{name}" has no freedom left to move', kind="drives", joints=(name,)
        )
