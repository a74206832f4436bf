"""Mobility of planar mechanisms: twists of their pairs in a posture, and consistency of redundant constraints."""

from collections.abc import Iterable
from functools import lru_cache

import numpy as np

from rigid.arrays import Complexes, Reals
from rigid.decomposition.groups import Group
from rigid.decomposition.order import structure
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import MechanismError
from rigid.postures import Posture
from rigid.topology.assembly import assembled
from rigid.topology.kinematic_pairs import Contact, Pair, pairs
from rigid.topology.mechanism_graphs import link_graph
from rigid.topology.ranks import Chain, Mobility, mobility


def planar_chain(here: Posture, contacts: Iterable[Contact] = ()) -> Chain:
    """Joints of a planar mechanism in a posture of one or many positions.

    `contacts` (gears, cams) are at fixed points of this posture; with contacts, use a posture of one position.

    Examples
    --------
    Two rolling gears have a count of 0, but mobility 1 and one redundant constraint:

    >>> from rigid.topology import Contact, assembled, mobility, planar_chain
    >>> from rigid import Link, Mechanism
    >>> links = (Link("ground", {"O": 0, "D": 3}), Link("pinion", {"O": 0}), Link("wheel", {"D": 0}))
    >>> gears = assembled(Mechanism(links, (), {"O": 0, "D": 3}))
    >>> found = mobility(planar_chain(gears, [Contact("mesh", "pinion", "wheel", 1.0)]))
    >>> int(found.mobility), int(found.hyperstaticity), found.index
    (1, 1, 0)
    """
    contacts = tuple(contacts)
    joints = pairs(here.mechanism, contacts)
    places = [_place(here, pair) for pair in joints]
    everywhere = np.concatenate([np.ravel(place) for place in places]) if places else np.zeros(1, complex)
    center = complex(everywhere.mean())
    length = float(np.sqrt((np.abs(everywhere - center) ** 2).mean())) or 1.0
    twists = [_twists(here, pair, place - center) for pair, place in zip(joints, places, strict=True)]
    graph = link_graph(here.mechanism, contacts)
    return Chain(
        graph,
        tuple(twist for twist, _ in twists),
        tuple(names for _, names in twists),
        np.array([center.real, center.imag]),
        length,
    )


def mechanism_mobility(mechanism: Mechanism, contacts: Iterable[Contact] = ()) -> Mobility:
    """Mobility and hyperstaticity of a mechanism as drawn, without drives."""
    return mobility(planar_chain(assembled(mechanism), contacts))


def _place(here: Posture, pair: Pair) -> Complexes:
    """Position of a pair in ground axes [m]; for a slider, its block's point."""
    if pair.joint is not None:
        return here.place(pair.joint.block, pair.joint.at(pair.joint.block))
    assert pair.contact is not None
    return np.full(np.shape(here.origin)[1:], pair.contact.at, complex)


def _twists(here: Posture, pair: Pair, arm: Complexes) -> tuple[Reals, tuple[str, ...]]:
    """Twists (angular velocity, velocity at the center) of a pair at `arm` from the center."""
    turn = _column(np.ones(np.shape(arm)), -1j * arm)
    if not pair.freedoms:
        return turn[..., :0], ()
    if pair.joint is not None and not pair.joint.turns:
        return _column(np.zeros(np.shape(arm)), pair.joint.along(here)), ("slide",)
    if pair.contact is not None and pair.contact.normal is not None:
        slip = _column(np.zeros(np.shape(arm)), np.full(np.shape(arm), 1j * pair.contact.normal))
        return np.concatenate([turn, slip], axis=-1), ("angle", "slip")
    return turn, ("angle",)


def _column(angular: Reals, velocity: Complexes) -> Reals:
    """One twist, shape (..., 3, 1)."""
    angular, velocity = np.broadcast_arrays(angular, velocity)
    return np.stack([angular, velocity.real, velocity.imag], axis=-1)[..., None]


@lru_cache(maxsize=64)
def require_fit(mechanism: Mechanism) -> None:
    """Raise MechanismError for redundant constraints that do not fit, or are drives.

    Raises
    ------
    MechanismError
        The joints do not close, the mechanism is locked, or it has more drives than freedoms.
    """
    for group in structure(mechanism).groups:
        if group.surplus:
            _require_fit(mechanism, group)


def _require_fit(mechanism: Mechanism, group: Group) -> None:
    drives = len(mechanism.drives)
    names = tuple(mechanism.links[link].name for link in sorted(group.links))
    try:
        ways = int(mechanism_mobility(mechanism).mobility)
    except MechanismError as unfit:
        raise MechanismError(
            f"links {_quoted(names)} are held {counted(group.surplus, 'time')} too often, "
            f"and the surplus does not fit ({unfit}): remove a joint",
            kind="overconstrained",
            links=names,
        ) from unfit
    if drives and ways == 0:
        names = tuple(link.name for link in mechanism.links[1:])
        locked = f"links {_quoted(names)} are locked: no drive can move them, remove a link or a joint"
        raise MechanismError(locked, kind="overconstrained", links=names)
    if drives > ways:
        many = f"too many drives: {drives} of a mechanism that moves in {counted(ways, 'way')}: remove one"
        raise MechanismError(many, kind="drives")


def _quoted(names: tuple[str, ...]) -> str:
    return ", ".join(f'"{name}"' for name in names)
