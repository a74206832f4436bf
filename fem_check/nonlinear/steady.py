"""Periodic motion of an elastic mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from elastic import JointCompliance, Section
from fem_check.nonlinear.cycle import Progress, cycle
from fem_check.nonlinear.rigid_places import DriveLaw
from fem_check.nonlinear.solution import Instants, NonlinearSolution, solution_of
from fem_check.nonlinear.system import system_of
from rigid import Mechanism


def nonlinear_steady_state(
    mechanism: Mechanism,
    sections: Sequence[Section],
    laws: Sequence[DriveLaw],
    period: float,
    positions: int = 256,
    elements: int = 8,
    joints: Mapping[str, JointCompliance] | None = None,
    damping: float | Sequence[float] = 0.0,
    start: float = 0.0,
    progress: Progress | None = None,
) -> NonlinearSolution:
    """Periodic motion of a mechanism of elastic beams with inertia and large displacements.

    Input are geometry, masses, sections, loads and drive coordinates. Positions, velocities and accelerations are
    computed independently of `rigid` and `elastic`.

    Parameters
    ----------
    sections
        One per beam, in the order of `Mechanism.beams`. Links with infinite rigidities are rigid bodies.
    laws
        Per drive, a function from times [s] to coordinate, rate and acceleration; only the coordinate is used.
    period
        Period of drives and loads, up to full turns [s].
    positions
        Number of equally spaced positions from `start` [s], also the collocation points.
    elements
        Number of elements per beam.
    joints
        Compliance and misfit of joints, by name.
    damping
        beta of the Kelvin-Voigt law, stress = E (strain + beta d strain/dt) [s], one value or one per beam.
    progress
        Called with the completed share of the work, 0 to 1, and a message.

    Raises
    ------
    NotCheckedError
        The check does not support part of the mechanism; the message names it.
    DoesNotCloseError
        Joints do not close, the motion is not periodic, or no periodic motion is found.
    ValueError
        Invalid number of sections, laws, elements or positions.

    Examples
    --------
    A bar of 1 m and 2 kg that turns at 3 rad/s about its end, pulled by 2 (3^2) 1/2 = 9 N there:

    >>> from math import pi
    >>> from elastic import Section
    >>> from rigid import Beam, ConstantSpeed, Link, Mechanism, PinDrive
    >>> bar = Link("bar", {"O": 0, "A": 1.0}, (Beam("O", "A", 2.0),))
    >>> turning = Mechanism((Link("ground", {"O": 0}), bar), (PinDrive("bar", "O"),), {"O": 0, "A": 1})
    >>> section = Section(EA=1e6, EI=1e3)
    >>> found = nonlinear_steady_state(turning, [section], [ConstantSpeed(0.0, 3.0)], 2 * pi / 3, 16)
    >>> found.N[0, :, 0].round(2)[:2]
    array([9., 9.])
    """
    if positions < 8:
        raise ValueError(f"{positions} positions: a cycle takes 8 or more")
    system = system_of(mechanism, sections, laws, start, elements, joints, damping)
    found = cycle(system, period, positions, progress)
    instants = Instants(found.time, found.rigid, found.q, found.v, found.a, found.state)
    return solution_of(system, tuple(sections), elements, instants)
