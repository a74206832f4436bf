"""Steady state of the vibrating mechanism over a cycle."""

from collections.abc import Mapping, Sequence

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.discretization import MotionAt, first_grid, vibrating_model
from elastic.elastodynamics.solution import TOLERANCE, Elastodynamic, settled
from elastic.elastodynamics.strains import Damping
from elastic.solution import Deflection
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
    static: Deflection | None = None,
) -> Elastodynamic:
    """Compute the steady state of vibrating links over a cycle, at the positions of a motion.

    The model includes the inertia and damping of displacements from the rigid positions, and the effect of the axial
    forces of the rigid motion. Drives follow their laws.

    Parameters
    ----------
    motion
        Motion of one design at the requested positions, with their times.
    motion_at
        Function that returns the motion at any instants [s], shape (positions,).
    period
        Period of the cycle [s], which comprises several turns if gears or laws require it.
    sections, joints
        See `deflection`.
    damping
        Kelvin-Voigt beta of all beams and compliant joints [s], or a `Damping`. By default, the damping ratio is 0.01
        at the lowest natural frequency over the cycle.
    tolerance
        Tolerance relative to the largest displacement.
    breaks
        Instants just before discontinuities of drive laws or loads [s], at which time elements end.
    static
        Quasi-static deflection at the requested positions, if known.

    Raises
    ------
    MechanismError
        If the cycle contains a singular position, or a block leaves its beam.
    ValueError
        If there are several designs.
    """
    model = vibrating_model(motion_at, motion.time[0], period, sections, joints or {}, damping)
    grid = first_grid(model, float(motion.time[0]), period, breaks)
    return settled(model, motion, grid, tolerance, static=static)
