"""Static equilibrium of an elastic mechanism with large displacements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from elastic import JointCompliance, Section
from fem_check.nonlinear.marching import Marcher
from fem_check.nonlinear.rigid_places import DriveLaw
from fem_check.nonlinear.solution import Instants, NonlinearSolution, solution_of
from fem_check.nonlinear.system import system_of
from rigid import Mechanism, Reals


def nonlinear_equilibrium(
    mechanism: Mechanism,
    sections: Sequence[Section],
    laws: Sequence[DriveLaw],
    times: Sequence[float] | Reals,
    elements: int = 8,
    joints: Mapping[str, JointCompliance] | None = None,
) -> NonlinearSolution:
    """Static equilibrium at given times [s], with drives and loads from their laws.

    Each solution starts from the previous one, so laws of time can lead to large displacements in increments. See
    `nonlinear_transient` for parameters and errors.

    Examples
    --------
    A cantilever rolled up to half a circle by the moment pi EI/l:

    >>> from rigid import Beam, Link, Mechanism, PinDrive, PointLoad
    >>> from rigid.dynamics import law_of_time
    >>> arm, ground = Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),)), Link("ground", {"O": 0})
    >>> rolling = PointLoad("arm", "A", moment=np.pi, law=law_of_time(lambda time: time))
    >>> held = Mechanism((ground, arm), (PinDrive("arm", "O"),), {"O": 0, "A": 1}, loads=(rolling,))
    >>> still = lambda time: (0 * time, 0 * time, 0 * time)
    >>> half = nonlinear_equilibrium(held, [Section(EA=1e4, EI=1.0)], [still], np.linspace(0, 1, 6))
    >>> half.phi[0, -1, -1].round(9)
    np.float64(3.141592654)
    """
    times = np.asarray(times, float)
    system = system_of(mechanism, sections, laws, float(times[0]), elements, joints, 0.0)
    marcher = Marcher(system, 1.0)
    rigid = system.rigid_coordinates(system.rigid.at(times))
    rest = np.zeros((1, rigid.shape[1]))
    kept, moved = [], rest
    for k, time in enumerate(times):
        here = marcher.balanced(rigid[k : k + 1] + moved, lambda place: (place, rest, rest), 0.0, 0.0, float(time))[0]
        moved = here - rigid[k : k + 1]
        kept.append((here, marcher.pulls.copy()))
    q, pulls = (np.concatenate(values) for values in zip(*kept, strict=True))
    still = np.zeros_like(q)
    given = q, still, still, pulls, system.drives(times), system.load_factors(times)
    _, state, _ = system.residual(*given, tangent=False)
    return solution_of(system, tuple(sections), elements, Instants(times, rigid, q, still, still, state))
