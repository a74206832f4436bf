"""The vibrating mechanism in its steady state over a cycle."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.solution import (
    TOLERANCE,
    Elastodynamic,
    MotionAt,
    first_grid,
    settled,
    vibrating_model,
)
from elastic.elastodynamics.strains import Damping
from rigid import Motion
from rigid.arrays import Reals


def elastodynamic(
    motion: Motion,
    motion_at: MotionAt,
    period: float,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
    tolerance: float = TOLERANCE,
    breaks: Reals | None = None,
) -> Elastodynamic:
    """Steady state of the vibrating links over a cycle, at the positions of a motion.

    The links' displacements from their rigid places have inertia and damping of their own and feel the axial forces of
    the rigid motion. Drives are held to their laws.

    Parameters
    ----------
    motion
        The positions asked for, of one design, with their instants.
    motion_at
        The motion at any instants [s], shape (positions,).
    period
        After which all comes back [s]: several turns where gears or laws ask for it.
    sections, joints
        As for `deflection`.
    damping
        Kelvin and Voigt's beta [s], of all beams and soft joints, or a `Damping`. Without it a damping ratio of 0.01 of
        the lowest natural frequency over the cycle.
    tolerance
        How far the answer may be from settled, as a share of the largest displacement.
    breaks
        Instants just before laws of drives or loads break off [s]: elements of time end there.

    Raises
    ------
    MechanismError
        The cycle holds a singular position, or a block leaves its beam.
    ValueError
        Several designs at once.
    """
    model = vibrating_model(motion_at, motion.time[0], period, sections, joints or {}, damping)
    return settled(model, motion, first_grid(model, float(motion.time[0]), period, breaks), tolerance)
