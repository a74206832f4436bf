"""How near the whole mechanism is to buckling, however its rods are divided into beams."""

from __future__ import annotations

import numpy as np

from elastic.elastodynamics.displacements import own_basis, rigid_body_modes, unit_displacements
from elastic.elastodynamics.elastic_structure import elastic_structure
from elastic.elastodynamics.equations_of_motion import geometric_stiffness
from elastic.elastodynamics.point_effects import chosen_points
from elastic.solution import Deflection
from rigid import Reals

INNER = 4
REAL = 1e-9


def buckling_factor(deflection: Deflection) -> Reals:
    """Factor on all forces at which the mechanism buckles, at every position, shape (positions,).

    The smallest root of K + factor K_G, the drives held: K_G is what displaced links feel of the axial forces of the
    quasi-static answer, and of the other forces that they carry along. Infinite where no forces press, nan at singular
    positions.

    Parameters
    ----------
    deflection
        Of one design.

    Raises
    ------
    ValueError
        Several designs.

    References
    ----------
    Timoshenko and Gere, Theory of Elastic Stability, 2nd ed., section 2.
    """
    motion = deflection.motion
    if len(motion.columns) != 1:
        raise ValueError(f"columns of shape {motion.columns}: expected one design")
    structure = elastic_structure(motion.mechanism, deflection.sections, deflection.joints, INNER)
    factor = np.full(motion.columns, np.inf)
    if not len(structure.stiffness):
        return factor
    chosen = chosen_points(motion.mechanism)
    carried = rigid_body_modes(structure, motion)
    try:
        basis = own_basis(structure, carried, np.eye(len(structure.stiffness)))
    except np.linalg.LinAlgError:  # joints that hold rigidly what others hold too
        return np.full(motion.columns, np.nan)
    moved = unit_displacements(structure, motion, carried, basis, chosen)
    felt = geometric_stiffness(structure, deflection, chosen)
    pressed = felt.stiffness(moved, moved)
    stiffness = np.broadcast_to(structure.stiffness, pressed.shape)
    for effect in felt.effects:
        if effect.elastic:
            own = effect.form(moved, moved)
            pressed, stiffness = pressed - own, stiffness + own
    good = np.isfinite(pressed).all(axis=(-2, -1))
    factor[~good] = np.nan
    try:
        factor[good] = _least_factor(stiffness[good], pressed[good])
    except np.linalg.LinAlgError:  # far from any machine's sizes
        factor[good] = np.nan
    return factor


def _least_factor(stiffness: Reals, pressed: Reals) -> Reals:
    """Smallest positive factor at which stiffness + factor pressed is singular; forces that turn unbalance it."""
    scale = 1.0 / np.sqrt(np.diagonal(stiffness, axis1=-2, axis2=-1))
    both = scale[:, :, None] * scale[:, None, :]
    inverse = np.linalg.inv(np.linalg.cholesky(stiffness * both))
    roots = np.linalg.eigvals(inverse @ (pressed * both) @ inverse.swapaxes(-1, -2))
    size = np.abs(roots).max(axis=-1, keepdims=True)
    pressing = np.where(np.abs(roots.imag) <= REAL * size, -roots.real, 0.0).max(axis=-1)
    with np.errstate(divide="ignore"):
        return np.where(pressing > 0, 1.0 / np.maximum(pressing, 0.0), np.inf)
