"""Mobility and redundancy of a chain of links and joints from the ranks of its equations, in the plane or in space.

What every joint leaves free are *twists*, what it carries are *wrenches*; d is 3 in the plane and 6 in space. The
kinematic side closes the twists round every independent loop, the static side balances the wrenches on every link.
Derivation: docs/structure.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rigid.arrays import Integers, Reals
from rigid.parts import MechanismError
from rigid.topology.graph import Graph, components, cyclomatic_number, fundamental_loops, incidence

RANK_TOLERANCE = 1e-9
"""Singular value over the greatest below which it counts as zero."""
STRESS_TOLERANCE = 1e-6  # share of a self-stress below which a joint has no part in it


@dataclass(frozen=True, eq=False)
class Chain:
    """Joints between links at one or many positions, each with the motions that it leaves free.

    Attributes
    ----------
    graph
        Links as nodes, the fixed one first; joints as branches.
    twists
        Per joint: motions of its end link seen from its start link, shape (..., d, freedoms). The first rows are the
        angular velocity [rad/s] (1 in the plane, 3 in space), the others the velocity [m/s] of the end link's point at
        `center`.
    freedoms
        Per joint, the names of its columns.
    center
        Point about which twists and wrenches are taken [m], shape (2,) or (3,).
    length
        Unit of lengths [m], so that no rank depends on units.
    """

    graph: Graph
    twists: tuple[Reals, ...]
    freedoms: tuple[tuple[str, ...], ...]
    center: Reals
    length: float

    @property
    def size(self) -> int:
        """Components of a twist: 3 in the plane, 6 in space."""
        return int(self.twists[0].shape[-2])

    @property
    def scale(self) -> Reals:
        """Factors that make a twist's components comparable, shape (d, 1)."""
        turns = self.size // 2
        return np.array([1.0] * turns + [1 / self.length] * (self.size - turns))[:, None]


@dataclass(frozen=True, eq=False)
class Mobility:
    """Freedoms and surplus conditions of a chain.

    Attributes
    ----------
    loops
        Independent loops N_c.
    kinematic_unknowns, kinematic_equations, kinematic_rank
        I_c: freedoms of all joints; E_c = d N_c; r_c, shape (...).
    static_unknowns, static_equations, static_rank
        I_s: components that all joints carry; E_s = d (links - 1); r_s, shape (...).
    kept, dropped
        Smallest singular value that counts towards the static rank and greatest that does not, over the greatest of
        all, shape (...): how clear the decision is.

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
        """Degree of mobility m = E_s - r_s, shape (...): independent motions at the position."""
        return self.static_equations - self.static_rank

    @property
    def hyperstaticity(self) -> Integers:
        """Degree of hyperstaticity h = I_s - r_s, shape (...): components of joint forces that statics cannot tell."""
        return self.static_unknowns - self.static_rank

    @property
    def index(self) -> int:
        """Mobility index m - h = I_c - E_c = E_s - I_s: known by count alone."""
        return self.static_equations - self.static_unknowns

    @property
    def sides_agree(self) -> bool:
        """Whether m = I_c - r_c and h = E_c - r_c too."""
        moves = self.kinematic_unknowns - self.kinematic_rank
        return bool(np.all(moves == self.mobility)) and bool(
            np.all(self.kinematic_equations - self.kinematic_rank == self.hyperstaticity)
        )


def mobility(chain: Chain) -> Mobility:
    """Mobility m, hyperstaticity h and the ranks behind them, at every position of a chain.

    A singular value counts as zero below RANK_TOLERANCE (1e-9) of the greatest, with every joint's twists and wrenches
    made orthonormal over `chain.length`. m and h hold at the position: in a singular one both are greater.

    Raises
    ------
    MechanismError
        Links that no joint holds; a position that is not finite.
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
    """Loop equations, shape (..., d loops, freedoms of all joints): the joints' orthonormal twists round every loop."""
    return _assembled(fundamental_loops(chain.graph), [_basis(chain, twist)[0] for twist in chain.twists])


def static_matrix(chain: Chain) -> Reals:
    """Equilibrium, shape (..., d (links - 1), components carried by all joints): wrenches on every moving link.

    A joint's wrench acts on its end link, its opposite on the start link. The transpose gives the rates at which
    velocities of the links violate the joints.
    """
    return _assembled(-incidence(chain.graph)[1:], [_basis(chain, twist)[1] for twist in chain.twists])


def self_stress(chain: Chain) -> Reals:
    """Wrenches that the joints of a redundant chain can hold without any load, at one position.

    Returns
    -------
    Shape (h, joints, d): per state and joint the moment about `chain.center` [N m] and the force [N] on the end link.
    The states are orthogonal, each of unit size with moments over `chain.length`; empty where h = 0.
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
    """Numbers of the joints (branches of the graph) that take part in a self-stress: their forces are undetermined."""
    states = self_stress(chain) / (chain.scale[:, 0] * chain.length)
    share = np.sqrt((states**2).sum(axis=(0, 2)))
    return tuple(int(number) for number in np.flatnonzero(share > STRESS_TOLERANCE))


def link_motions(chain: Chain) -> Reals:
    """Independent motions of the links at one position, shape (m, links - 1, d): twists in SI, orthogonal."""
    modes = null_space(static_matrix(chain).T)
    return modes.T.reshape(-1, len(chain.graph.nodes) - 1, chain.size) / chain.scale[:, 0]


def null_space(matrix: Reals) -> Reals:
    """Orthonormal columns that a matrix sends to zero, by the tolerance of the ranks."""
    _, values, right = np.linalg.svd(matrix)
    rank = int((values > RANK_TOLERANCE * max(values, default=0.0)).sum())
    return right[rank:].T


def _require_connected(chain: Chain) -> None:
    if not chain.graph.branches:
        raise MechanismError("there are no joints: links that share a point, or sliders, make them")
    for part in components(chain.graph)[1:]:
        names = ", ".join(f'"{name}"' for name in part)
        raise MechanismError(f'no chain of joints holds {names} to "{chain.graph.nodes[0]}"')


def _basis(chain: Chain, twist: Reals) -> tuple[Reals, Reals]:
    """Orthonormal twists, shape (..., d, freedoms), and the wrenches without work on them, (..., d, d - freedoms)."""
    full, _ = np.linalg.qr(chain.scale * twist, mode="complete")
    return full[..., : twist.shape[-1]], full[..., twist.shape[-1] :]


def _assembled(pattern: Integers, blocks: Sequence[Reals]) -> Reals:
    """The matrix of blocks pattern[i, j] blocks[j], shape (..., rows d, columns of all blocks)."""
    columns = [
        (pattern[:, j, None, None] * block[..., None, :, :]).reshape(
            *block.shape[:-2], len(pattern) * block.shape[-2], block.shape[-1]
        )
        for j, block in enumerate(blocks)
    ]
    return np.concatenate(columns, axis=-1)


def _singular_values(matrix: Reals) -> Reals:
    """Singular values over the greatest, shape (..., min(rows, columns))."""
    if not np.isfinite(matrix).all():
        raise MechanismError("the mechanism does not close at every position: ask only for reachable ones")
    if 0 in matrix.shape:
        return np.zeros((*matrix.shape[:-2], 0))
    values = np.linalg.svd(matrix, compute_uv=False)
    greatest = values[..., :1]
    return np.asarray(np.divide(values, greatest, out=np.zeros_like(values), where=greatest > 0))
