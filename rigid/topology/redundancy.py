"""Check that redundant constraints of a mechanism fit."""

from functools import lru_cache

from rigid.decomposition.groups import Group
from rigid.decomposition.order import structure
from rigid.mechanism import Mechanism
from rigid.names import counted
from rigid.parts import MechanismError
from rigid.topology.planar import mechanism_mobility


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
