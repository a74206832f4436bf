"""Input-output laws of a chain at one position: rates per rate, loads per load."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid.arrays import Reals
from rigid.parts import MechanismError
from rigid.topology.ranks import RANK_TOLERANCE, Chain, kinematic_matrix, link_motions, null_space

Coordinate = str | tuple[str, str]
MAX_ERROR = 1e-9  # largest relative error of an output determined by the inputs


@dataclass(frozen=True)
class Action:
    """Load of unknown size on a link: a force [N] along a direction, or a moment [N m].

    `at` [m], `force` and `moment` have three components in space; in the plane, `at` and `force` have two and `moment`
    one. The size of the load multiplies both.
    """

    name: str
    link: str
    at: tuple[float, ...] = ()
    force: tuple[float, ...] = ()
    moment: tuple[float, ...] = ()


def velocity_law(chain: Chain, inputs: Sequence[Coordinate], outputs: Sequence[Coordinate]) -> Reals:
    """Rates of joint coordinates relative to other joint rates, shape (outputs, inputs).

    Parameters
    ----------
    inputs, outputs
        Joints, by name if they have one freedom, otherwise with the freedom: `("shaft", "Vz")`. Rates are those of the
        joint's end link relative to its start link [rad/s or m/s].

    Raises
    ------
    MechanismError
        The inputs do not determine an output, depend on each other, or a coordinate is unknown.

    Examples
    --------
    >>> from rigid.topology import SpatialJoint, spatial_chain, velocity_law
    >>> screw = spatial_chain([SpatialJoint("pivot", ("support", "screw"), "revolute", axis=(1, 0, 0)),
    ...                        SpatialJoint("guide", ("support", "nut"), "prismatic", axis=(1, 0, 0)),
    ...                        SpatialJoint("thread", ("nut", "screw"), "helical", axis=(1, 0, 0), pitch=2e-3)])
    >>> float(velocity_law(screw, ["pivot"], ["guide"]).round(9)[0, 0])
    -0.002
    """
    shares, size = _shares(chain)
    driving = [_number(chain, coordinate) for coordinate in inputs]
    driven = [_number(chain, coordinate) for coordinate in outputs]
    law = _ratio(shares[driving], shares[driven], [str(name) for name in inputs], [str(name) for name in outputs])
    return np.asarray(law * size[driving] / size[driven][:, None])


def joint_rates(chain: Chain) -> Reals:
    """Rates of all joint coordinates in the independent motions [rad/s, m/s], (freedoms, m)."""
    shares, size = _shares(chain)
    return np.asarray(shares / size[:, None])


def _shares(chain: Chain) -> tuple[Reals, Reals]:
    """Rates of joint coordinates relative to their unit twists, and twist sizes, (freedoms,)."""
    modes = null_space(kinematic_matrix(chain))
    shares, sizes, start = [], [], 0
    for twist in chain.twists:
        scaled = chain.scale * twist
        count, size = scaled.shape[-1], np.linalg.norm(scaled, axis=0)
        # the loop equations use the orthonormal basis from the same QR of these twists
        triangle = np.linalg.qr(scaled, mode="complete")[1][:count]
        shares.append(size[:, None] * np.linalg.solve(triangle, modes[start : start + count]))
        sizes.append(size)
        start += count
    return np.concatenate(shares), np.concatenate(sizes)


def force_law(chain: Chain, actions: Sequence[Action], inputs: Sequence[str], outputs: Sequence[str]) -> Reals:
    """Loads that balance a chain per unit of other loads, shape (outputs, inputs).

    By virtual work on the free motions, without joint forces, so redundancy does not matter. The first index is the
    computed load, the second the given load.

    Raises
    ------
    MechanismError
        The given loads do not determine the others, or an action or link is unknown.
    """
    size = {action.name: _size(chain, action) for action in actions}
    powers = {action.name: _power(chain, action) / size[action.name] for action in actions}
    for name in (*inputs, *outputs):
        if name not in powers:
            raise MechanismError(f'there is no action "{name}": there are {", ".join(powers)}')
    given = np.array([powers[name] for name in inputs]).T
    sought = np.array([powers[name] for name in outputs]).T
    if np.linalg.matrix_rank(sought, RANK_TOLERANCE) < len(outputs):
        raise MechanismError(f"balance does not tell {', '.join(outputs)}: choose fewer, or loads that do work")
    law = -np.linalg.lstsq(sought, given, rcond=None)[0]
    if np.abs(sought @ law + given).max(initial=0.0) > MAX_ERROR:
        raise MechanismError(f"{', '.join(outputs)} alone cannot balance {', '.join(inputs)}: the chain would move")
    sizes = [np.array([size[name] for name in names]) for names in (inputs, outputs)]
    return np.asarray(law * sizes[0] / sizes[1][:, None])


def _size(chain: Chain, action: Action) -> float:
    """Reference power of a unit action: the largest on its link at unit twist [N m]."""
    size = chain.length * float(np.linalg.norm(action.force)) + float(np.linalg.norm(action.moment))
    if not size > 0:
        raise MechanismError(f'action "{action.name}" has neither a force nor a moment')
    return size


def _power(chain: Chain, action: Action) -> Reals:
    """Power of a unit action in each independent motion, shape (m,)."""
    if action.link not in chain.graph.nodes[1:]:
        raise MechanismError(f'action "{action.name}": there is no moving link "{action.link}"')
    motions = link_motions(chain)[:, chain.graph.nodes.index(action.link) - 1]
    turns = chain.size // 2
    dimension = chain.size - turns
    at, force, moment = (
        np.array(values or (0.0,) * count, float)
        for values, count in ((action.at, dimension), (action.force, dimension), (action.moment, turns))
    )
    arm = at - chain.center
    about = np.cross(arm, force) if dimension == 3 else np.array([arm[0] * force[1] - arm[1] * force[0]])
    return np.asarray(motions[:, :turns] @ (moment + about) + motions[:, turns:] @ force)


def _number(chain: Chain, coordinate: Coordinate) -> int:
    """Number of a joint coordinate among all freedoms."""
    joint, freedom = (coordinate, "") if isinstance(coordinate, str) else coordinate
    start = 0
    for branch, names in zip(chain.graph.branches, chain.freedoms, strict=True):
        if branch.name == joint:
            if not freedom and len(names) == 1:
                return start
            if freedom in names:
                return start + names.index(freedom)
            raise MechanismError(f'joint "{joint}": say which of its freedoms {", ".join(names)} is meant')
        start += len(names)
    raise MechanismError(f'there is no joint "{joint}"')


def _ratio(driving: Reals, driven: Reals, inputs: Sequence[str], outputs: Sequence[str]) -> Reals:
    """Matrix that maps the rows `driving` to the rows `driven`."""
    if np.linalg.matrix_rank(driving, RANK_TOLERANCE) < len(inputs):
        raise MechanismError(f"{', '.join(inputs)} do not move independently of each other")
    law = np.linalg.lstsq(driving.T, driven.T, rcond=None)[0].T
    error = np.abs(law @ driving - driven).max(axis=1)
    for name, wrong in zip(outputs, error, strict=True):
        if wrong > MAX_ERROR:
            raise MechanismError(f"{name} does not follow from {', '.join(inputs)}: choose more inputs")
    return np.asarray(law)
