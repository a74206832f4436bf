"""Input-output laws of a chain at one position: ratios of rates and of loads."""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from rigid.arrays import Reals
from rigid.parts import MechanismError
from rigid.topology.ranks import RANK_TOLERANCE, Chain, kinematic_matrix, link_motions, null_space

Coordinate = str | tuple[str, str]
MAX_ERROR = 1e-9  # largest relative error of an output that counts as determined by the inputs


class Action(Struct, frozen=True):
    """A load on a link: a magnitude, which may be unknown, times a unit load.

    The unit load consists of `force` [N] at the point `at` [m], and of `moment` [N m]. In space, all three have three
    components. In the plane, `at` and `force` have two components, and `moment` has one.
    """

    name: str
    link: str
    at: tuple[float, ...] = ()
    force: tuple[float, ...] = ()
    moment: tuple[float, ...] = ()


def velocity_law(chain: Chain, inputs: Sequence[Coordinate], outputs: Sequence[Coordinate]) -> Reals:
    """Return the rates of joint coordinates (outputs) per unit rate of other joint coordinates (inputs).

    The shape is (outputs, inputs).

    Parameters
    ----------
    inputs, outputs
        Names of joints with one freedom, or pairs (joint, freedom) such as `("shaft", "Vz")`. Rates are those of the
        joint's end link relative to its start link [rad/s or m/s].

    Raises
    ------
    MechanismError
        If the inputs do not determine an output or depend on each other, or if a coordinate is unknown.

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
    """Return the rates of all joint coordinates [rad/s or m/s] in each of the m independent motions, (freedoms, m)."""
    shares, size = _shares(chain)
    return np.asarray(shares / size[:, None])


def _shares(chain: Chain) -> tuple[Reals, Reals]:
    """Return the scaled rates of joint coordinates in each of the m independent motions, and the scales.

    A scaled rate is the rate times a scale. The scale is the norm of `Chain.scale` times the twist of the freedom. The
    shapes are (freedoms, m) and (freedoms,).
    """
    modes = null_space(kinematic_matrix(chain))
    shares, sizes, start = [], [], 0
    for twist in chain.twists:
        scaled = chain.scale * twist
        count, size = scaled.shape[-1], np.linalg.norm(scaled, axis=0)
        # `modes` are in terms of the orthonormal twists of the same QR decomposition (see `ranks._basis`)
        triangle = np.linalg.qr(scaled, mode="complete")[1][:count]
        shares.append(size[:, None] * np.linalg.solve(triangle, modes[start : start + count]))
        sizes.append(size)
        start += count
    return np.concatenate(shares), np.concatenate(sizes)


def force_law(chain: Chain, actions: Sequence[Action], inputs: Sequence[str], outputs: Sequence[str]) -> Reals:
    """Return the magnitudes of loads (outputs) that balance a chain under unit magnitudes of other loads (inputs).

    The shape is (outputs, inputs). The magnitudes follow from virtual work in the independent motions of the chain.
    Joint forces are not computed, so the chain may have redundant constraints.

    Raises
    ------
    MechanismError
        If the inputs do not determine the outputs, or an action or link is unknown.
    """
    size = {action.name: _size(chain, action) for action in actions}
    powers = {action.name: _power(chain, action) / size[action.name] for action in actions}
    for name in (*inputs, *outputs):
        if name not in powers:
            raise MechanismError(f'unknown action "{name}", expected one of {", ".join(powers)}')
    given = np.array([powers[name] for name in inputs]).T
    wanted = np.array([powers[name] for name in outputs]).T
    if np.linalg.matrix_rank(wanted, RANK_TOLERANCE) < len(outputs):
        names = ", ".join(outputs)
        raise MechanismError(f"equilibrium does not determine {names}: choose fewer outputs, or loads that do work")
    law = -np.linalg.lstsq(wanted, given, rcond=None)[0]
    if np.abs(wanted @ law + given).max(initial=0.0) > MAX_ERROR:
        raise MechanismError(f"{', '.join(outputs)} alone cannot balance {', '.join(inputs)}: the chain would move")
    sizes = [np.array([size[name] for name in names]) for names in (inputs, outputs)]
    return np.asarray(law * sizes[0] / sizes[1][:, None])


def _size(chain: Chain, action: Action) -> float:
    """Return the reference value of a unit action: force times the length of the chain, plus moment [N m]."""
    size = chain.length * float(np.linalg.norm(action.force)) + float(np.linalg.norm(action.moment))
    if not size > 0:
        raise MechanismError(f'action "{action.name}" has neither a force nor a moment')
    return size


def _power(chain: Chain, action: Action) -> Reals:
    """Return the power of a unit action in each independent motion, shape (m,)."""
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
    """Return the index of a joint coordinate among all freedoms."""
    joint, freedom = (coordinate, "") if isinstance(coordinate, str) else coordinate
    start = 0
    for branch, names in zip(chain.graph.branches, chain.freedoms, strict=True):
        if branch.name == joint:
            if not freedom and len(names) == 1:
                return start
            if freedom in names:
                return start + names.index(freedom)
            raise MechanismError(f'joint "{joint}": name one of its freedoms {", ".join(names)}')
        start += len(names)
    raise MechanismError(f'there is no joint "{joint}"')


def _ratio(driving: Reals, driven: Reals, inputs: Sequence[str], outputs: Sequence[str]) -> Reals:
    """Return the matrix L with driven = L @ driving, or raise MechanismError if there is none."""
    if np.linalg.matrix_rank(driving, RANK_TOLERANCE) < len(inputs):
        raise MechanismError(f"{', '.join(inputs)} do not move independently of each other")
    law = np.linalg.lstsq(driving.T, driven.T, rcond=None)[0].T
    error = np.abs(law @ driving - driven).max(axis=1)
    for name, wrong in zip(outputs, error, strict=True):
        if wrong > MAX_ERROR:
            raise MechanismError(f"{name} does not follow from {', '.join(inputs)}: choose more inputs")
    return np.asarray(law)
