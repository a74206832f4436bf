"""Transient motion of an elastic mechanism."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import pairwise

import numpy as np

from elastic import JointCompliance, Section
from fem_check.nonlinear.cycle import Progress
from fem_check.nonlinear.marching import Marcher, Start
from fem_check.nonlinear.rigid_places import DriveLaw
from fem_check.nonlinear.solution import Instants, NonlinearSolution, solution_of
from fem_check.nonlinear.system import system_of
from rigid import Mechanism, Reals


def nonlinear_transient(
    mechanism: Mechanism,
    sections: Sequence[Section],
    laws: Sequence[DriveLaw],
    times: Sequence[float] | Reals,
    step: float,
    elements: int = 8,
    joints: Mapping[str, JointCompliance] | None = None,
    damping: float | Sequence[float] = 0.0,
    begin: Start = "rigid",
    dissipation: float = 0.2,
    progress: Progress | None = None,
) -> NonlinearSolution:
    """Motion of a mechanism of elastic beams from a start, with large displacements.

    Parameters
    ----------
    laws
        Per drive, a function from times [s] to coordinate, rate and acceleration; only the coordinate is used.
    times
        Requested times [s], increasing; the first is the start.
    step
        Largest time step [s]; the interval between two requested times is divided evenly.
    begin
        "rigid": positions and velocities of the rigid links; "quasi-static": deformed by the loads and the inertia of
        the rigid motion, with the rate of this deformation; "static": at rest, deformed by the loads.
    dissipation
        Numerical damping of the highest frequencies, 0 to 1; low frequencies are undamped to second order.
    mechanism, sections, elements, joints, damping, progress
        See `nonlinear_steady_state`.

    Raises
    ------
    NotCheckedError
        The check does not support part of the mechanism; the message names it.
    DoesNotCloseError
        Joints do not close, or a step does not converge.
    ValueError
        Invalid numbers.

    Examples
    --------
    A bar of 1 m released horizontally accelerates at 3 g/2 per length:

    >>> from elastic import RIGID
    >>> from rigid import Beam, Link, Mechanism
    >>> links = Link("ground", {"O": 0}), Link("bar", {"O": 0, "A": 1.0}, (Beam("O", "A", 2.0),))
    >>> fall = Mechanism(links, (), {"O": 0, "A": 1}, gravity=-10j)
    >>> found = nonlinear_transient(fall, [RIGID], [], [0.0, 0.01], 0.001)
    >>> round(found.phi[0, -1, 0] / (-15 * 0.01**2 / 2), 3)
    np.float64(1.0)
    """
    times = np.asarray(times, float)
    if times.ndim != 1 or len(times) < 2 or not (np.diff(times) > 0).all():
        raise ValueError("expected two times or more, growing")
    if not step > 0 or not 0 <= dissipation <= 1:
        raise ValueError(f"step {step:g} s and dissipation {dissipation:g}: expected more than 0, and 0 to 1")
    system = system_of(mechanism, sections, laws, float(times[0]), elements, joints, damping)
    marcher = Marcher(system, 1.0 - dissipation)
    marcher.start(float(times[0]), step, begin)
    kept = [marcher.copy()]
    for number, (last, now) in enumerate(pairwise(times), 1):
        count = max(1, int(np.ceil((now - last) / step * (1 - 1e-12))))
        for k in range(count):
            marcher.advance(last + (now - last) * (k + 1) / count, (now - last) / count)
        kept.append(marcher.copy())
        if progress:
            progress(number / (len(times) - 1), f"{now:.6g} s")
    q, v, a, pulls = (np.concatenate(values) for values in zip(*kept, strict=True))
    rigid = system.rigid_coordinates(system.rigid.at(times))
    _, state, _ = system.residual(q, v, a, pulls, system.drives(times), system.load_factors(times), tangent=False)
    return solution_of(system, tuple(sections), elements, Instants(times, rigid, q, v, a, state))
