"""Mobility and redundancy of a chain of links in the plane or in space, from matrix ranks.

*Twists* are the free motions of a joint, and *wrenches* are the loads that the joint transmits. Twists and wrenches
have d components: 3 in the plane and 6 in space. The kinematic equations state that the twists around each independent
loop add up to zero. The static equations state that the wrenches on each link are in equilibrium. Derivation:
docs/structure.md.
"""

from collections.abc import Sequence

import numpy as np
from msgspec import Struct

from rigid.arrays import Integers, Reals
from rigid.parts import MechanismError
from rigid.topology.graph import Graph, components, cyclomatic_number, fundamental_loops, incidence

RANK_TOLERANCE = 1e-9
"""Largest singular value that counts as zero, relative to the largest singular value."""
STRESS_TOLERANCE = 1e-6  # a joint is unstressed if its wrench in the orthonormal self-stresses has at most this norm


class Chain(Struct, frozen=True, eq=False):
    """Links and joints at one or many positions, with the free motions of the joints.

    Attributes
    ----------
    graph
        Graph with links as nodes (the fixed link first) and joints as branches.
    twists
        For each joint, motions of its end link relative to its start link at unit rate of each freedom, shape (..., d,
        freedoms). The first rows (1 in the plane, 3 in space) are the angular velocity [rad/s]. The other rows are the
        velocity of the end link's point at `center` [m/s].
    freedoms
        Names of the freedoms of each joint.
    center
        Reference point of twists and wrenches [m], shape (2,) or (3,).
    length
        Reference length [m], which makes the ranks independent of units.
    """

    graph: Graph
    twists: tuple[Reals, ...]
    freedoms: tuple[tuple[str, ...], ...]
    center: Reals
    length: float

    @property
    def size(self) -> int:
        """Number of twist components: 3 in the plane, 6 in space."""
        return int(self.twists[0].shape[-2])

    @property
    def scale(self) -> Reals:
        """Factors of the twist components, shape (d, 1): 1 for angular velocities, 1 / `length` for velocities."""
        turns = self.size // 2
        return np.array([1.0] * turns + [1 / self.length] * (self.size - turns))[:, None]


class Mobility(Struct, frozen=True, eq=False):
    """Freedoms and redundant constraints of a chain.

    Attributes
    ----------
    loops
        Number of independent loops N_c.
    kinematic_unknowns
        Number I_c of freedoms of all joints.
    kinematic_equations
        Number E_c = d N_c of loop equations.
    kinematic_rank
        Rank r_c of the loop equations, shape (...).
    static_unknowns
        Number I_s of wrench components that all joints transmit.
    static_equations
        Number E_s = d (links - 1) of equilibrium equations.
    static_rank
        Rank r_s of the equilibrium equations, shape (...).
    kept
        Smallest of the singular values of the equilibrium equations that count as nonzero, relative to the largest
        singular value, shape (...).
    dropped
        Largest of the singular values that count as zero, relative to the largest singular value, shape (...). If
        `kept` is much larger than `dropped`, the rank is certain.

    References
    ----------
    Course chapter "Analysis and modelling of mechanisms", II.7.
    """

    loops: int
    kinematic_unknowns: int
    kinematic_equations: int
    kinematic_rank: Integers
    static_unknowns: int
    static_equations: int
    static_rank: Integers
    kept: Reals
    dropped: Reals

    @property
    def mobility(self) -> Integers:
        """Degree of mobility m = E_s - r_s, the number of independent motions, shape (...)."""
        return self.static_equations - self.static_rank

    @property
    def hyperstaticity(self) -> Integers:
        """Degree of hyperstaticity h = I_s - r_s, the number of statically indeterminate components, shape (...)."""
        return self.static_unknowns - self.static_rank

    @property
    def index(self) -> int:
        """Mobility index m - h = I_c - E_c = E_s - I_s, which follows from counting."""
        return self.static_equations - self.static_unknowns

    @property
    def sides_agree(self) -> bool:
        """Whether the kinematic equations give the same result: m = I_c - r_c and h = E_c - r_c."""
        moves = self.kinematic_unknowns - self.kinematic_rank
        return bool(np.all(moves == self.mobility)) and bool(
            np.all(self.kinematic_equations - self.kinematic_rank == self.hyperstaticity)
        )


def mobility(chain: Chain) -> Mobility:
    """Return the mobility, the hyperstaticity and the ranks at each position of a chain.

    The twists and wrenches of each joint are scaled with `chain.length` and orthonormalised. Singular values below
    RANK_TOLERANCE (1e-9) of the largest count as zero. Mobility and hyperstaticity are larger at singular positions.

    Raises
    ------
    MechanismError
        If joints do not connect all links, or a position is not finite.
    """
    _require_connected(chain)
    kinematic, static = kinematic_matrix(chain), static_matrix(chain)
    values = _singular_values(static)
    counts = values > RANK_TOLERANCE
    return Mobility(
        cyclomatic_number(chain.graph),
        kinematic.shape[-1],
        kinematic.shape[-2],
        np.asarray((_singular_values(kinematic) > RANK_TOLERANCE).sum(axis=-1)),
        static.shape[-1],
        static.shape[-2],
        np.asarray(counts.sum(axis=-1)),
        np.min(values, axis=-1, initial=1.0, where=counts),
        np.max(values, axis=-1, initial=0.0, where=~counts),
    )


def kinematic_matrix(chain: Chain) -> Reals:
    """Return the loop equations for orthonormal joint twists, shape (..., d loops, freedoms)."""
    return _assembled(fundamental_loops(chain.graph), [_basis(chain, twist)[0] for twist in chain.twists])


def static_matrix(chain: Chain) -> Reals:
    """Return the equilibrium equations of the moving links for orthonormal joint wrenches.

    The shape is (..., d (links - 1), components). The wrench of a joint acts on the end link, and the opposite wrench
    on the start link. The transpose of the matrix, multiplied by the link twists, gives the rates of the constraint
    residuals.
    """
    return _assembled(-incidence(chain.graph)[1:], [_basis(chain, twist)[1] for twist in chain.twists])


def self_stress(chain: Chain) -> Reals:
    """Return the self-stresses of a redundant chain at one position.

    A self-stress is a state of joint wrenches in equilibrium without loads. The h self-stresses are orthonormal, if
    moments are divided by `chain.length`.

    Returns
    -------
    Array of shape (h, joints, d). The last axis is the moment about `chain.center` [N m] and then the force [N] on the
    end link.
    """
    bases = [_basis(chain, twist)[1] for twist in chain.twists]
    states = null_space(static_matrix(chain))
    ends = np.cumsum([0, *(basis.shape[-1] for basis in bases)])
    parts = [
        (basis @ states[start:end] * chain.scale * chain.length).T
        for basis, start, end in zip(bases, ends, ends[1:], strict=False)
    ]
    return np.stack(parts, axis=1)


def stressed_joints(chain: Chain) -> tuple[int, ...]:
    """Return the indices of joints with a wrench in a self-stress, i.e. with statically indeterminate forces."""
    states = self_stress(chain) / (chain.scale[:, 0] * chain.length)
    share = np.sqrt((states**2).sum(axis=(0, 2)))
    return tuple(int(number) for number in np.flatnonzero(share > STRESS_TOLERANCE))


def link_motions(chain: Chain) -> Reals:
    """Return the twists of the moving links in SI units in each of the m independent motions at one position.

    The shape is (m, links - 1, d).
    """
    modes = null_space(static_matrix(chain).T)
    return modes.T.reshape(-1, len(chain.graph.nodes) - 1, chain.size) / chain.scale[:, 0]


def null_space(matrix: Reals) -> Reals:
    """Return an orthonormal basis of the null space of a matrix, with the tolerance `RANK_TOLERANCE`."""
    _, values, right = np.linalg.svd(matrix)
    rank = int((values > RANK_TOLERANCE * max(values, default=0.0)).sum())
    return right[rank:].T


def _require_connected(chain: Chain) -> None:
    if not chain.graph.branches:
        raise MechanismError("there are no joints: connect links by a common point or a slider")
    for part in components(chain.graph)[1:]:
        names = ", ".join(f'"{name}"' for name in part)
        raise MechanismError(f'no chain of joints connects {names} to "{chain.graph.nodes[0]}"')


def _basis(chain: Chain, twist: Reals) -> tuple[Reals, Reals]:
    """Return orthonormal twists of a joint, and orthonormal wrenches that do no work on them.

    The shapes are (..., d, freedoms) and (..., d, d - freedoms).
    """
    full, _ = np.linalg.qr(chain.scale * twist, mode="complete")
    return full[..., : twist.shape[-1]], full[..., twist.shape[-1] :]


def _assembled(pattern: Integers, blocks: Sequence[Reals]) -> Reals:
    """Return the block matrix with the blocks pattern[i, j] * blocks[j] in row i and column j.

    The shape is (..., rows of `pattern` * d, columns of all blocks).
    """
    columns = [
        (pattern[:, j, None, None] * block[..., None, :, :]).reshape(
            *block.shape[:-2], len(pattern) * block.shape[-2], block.shape[-1]
        )
        for j, block in enumerate(blocks)
    ]
    return np.concatenate(columns, axis=-1)


def _singular_values(matrix: Reals) -> Reals:
    """Return the singular values relative to the largest, shape (..., min(rows, columns))."""
    if not np.isfinite(matrix).all():
        raise MechanismError("the mechanism does not close at every position: use reachable positions only")
    if 0 in matrix.shape:
        return np.zeros((*matrix.shape[:-2], 0))
    values = np.linalg.svd(matrix, compute_uv=False)
    greatest = values[..., :1]
    return np.asarray(np.divide(values, greatest, out=np.zeros_like(values), where=greatest > 0))
