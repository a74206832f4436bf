"""Vibration in reduced coordinates on a given time grid."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.equations_of_motion import MotionTerms, Problem, problem
from elastic.elastodynamics.strains import rigidities, strain_rows
from elastic.elastodynamics.time_elements import Propagation, propagation
from elastic.elastodynamics.vibration_loads import ResidualResponse, resampled, vibration_loads
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import Motion
from rigid.arrays import Complexes, Numbers, Reals
from rigid.kinetostatics import beam_directions

CLOSED = 1e-6  # a larger difference of section forces between the ends of a cycle is a jump; relative to the largest

Start = Callable[[Propagation, Problem, Deflection], Any]


@dataclass(frozen=True, eq=False)
class Vibration:
    """Solution of the equations of motion on a grid.

    Attributes
    ----------
    quasi_static
        Quasi-static deflection at the nodes of the grid.
    begun
        Initial state x, x', shape (2 r,), or None for a periodic solution.
    residual
        Residual response, or None.
    """

    quasi_static: Deflection
    problem: Problem
    propagation: Propagation
    history: tuple[Reals, Reals, Reals]
    begun: Reals | None
    residual: ResidualResponse | None = None

    @property
    def cyclic(self) -> bool:
        """True for a periodic solution."""
        return self.begun is None

    @property
    def motion(self) -> Motion:
        """Rigid motion at the nodes of the grid."""
        return self.quasi_static.motion

    @cached_property
    def loads(self) -> AddedLoads:
        """Loads of the vibration at the points of the grid."""
        return vibration_loads(self.problem, self.motion, self.history, self.residual)

    @cached_property
    def deflection(self) -> Deflection:
        """Deflection of the vibrating mechanism at the nodes."""
        plain = self.quasi_static
        return deflection(
            plain.motion, plain.sections, plain.joints, resampled(self.loads, self.problem.terms.grid.at_nodes)
        )

    @cached_property
    def closed(self) -> bool:
        """True if the loads at the end of the grid equal those at its start."""
        moments, forces = self.quasi_static.amplitudes.M, self.quasi_static.amplitudes.N
        return all(
            bool(np.abs(each[..., -1] - each[..., 0]).max(initial=0.0) <= CLOSED * np.abs(each).max(initial=0.0))
            for each in (moments, forces)
        )

    def sampler(self, times: Reals) -> Callable[[Any], Any]:
        """Return the function that interpolates to given instants, see `Grid.sampler`."""
        grid = self.problem.terms.grid
        return grid.sampler(grid.cycled(times, self.closed) if self.cyclic else times)

    @cached_property
    def multipliers(self) -> Complexes:
        """Floquet multipliers, i.e. the growth of free vibrations per cycle; empty for a transient."""
        return self.propagation.multipliers if self.cyclic else np.zeros(0, complex)

    def under(self, load: Reals, often: bool = False) -> tuple[Reals, Reals, Reals]:
        """Return the history under another load alone, shape (points, r); `often` prepares for many loads.

        If the vibration starts deflected and at rest, this history starts with the static response to the load.
        Otherwise it is periodic, or starts from zero.
        """
        steps = self.propagation.loaded(load, often)
        if self.begun is None:
            return steps.history(steps.periodic_start())
        deflected, rate = np.split(self.begun, 2)
        start = np.zeros_like(self.begun)
        if deflected.any() and not rate.any():
            start[: len(rate)] = static_start(self.problem, load)
        return steps.history(start)

    @cached_property
    def displacements(self) -> Numbers:
        """Displacements of the beams in beam axes, complex, (points, places), or amplitudes if there are no beams."""
        return self.places(self.history[0])

    @property
    def unresolved(self) -> Reals:
        """Unresolved part of total and inertial displacements in every element, shape (elements,).

        Axial forces have less weight, because they oscillate faster than links bend, and hardly affect bending.
        """
        terms, (_, _, x2) = self.problem.terms, self.history
        forces = self.problem.equations.mass @ x2[..., None]
        bent: Any = np.linalg.solve(terms.elastic, forces if terms.elastic.ndim == 3 else forces[..., 0].T)
        moved = self.displacements
        by_inertia = self.places(bent[..., 0] if bent.ndim == 3 else bent.T)
        greatest = np.abs(moved).max()
        tails = [terms.grid.tail(values, greatest) for values in (moved, by_inertia)]
        return np.maximum.reduce([*tails, VIBRATION.axial_weight * self.unresolved_axial])

    @property
    def unresolved_axial(self) -> Reals:
        """Unresolved part of the axial forces in every element, relative to the largest one, shape (elements,)."""
        N, least = self.axial_forces
        return self.problem.terms.grid.tail(N, max(float(np.abs(N).max(initial=0.0)), least))

    @property
    def axial_forces(self) -> tuple[Reals, float]:
        """Axial forces of the coordinates [N], shape (points, places), and their smallest reference value."""
        kinds = self.problem.terms.kinematics
        structure, basis = kinds.structure, kinds.basis
        count = structure.weights.size
        strains = strain_rows(structure, basis if basis.ndim == 2 else basis[1:])[..., : 2 * count, :]
        stiff = rigidities(structure)[: 2 * count] / np.tile(structure.weights.ravel(), 2)
        forces: Reals = stiff * (strains @ self.history[0][..., None])[..., 0]
        longest = structure.weights.sum(axis=-1).max(initial=0.0)
        bending = float(np.abs(forces[:, count:]).max(initial=0.0))
        return forces[:, :count], VIBRATION.min_axial_reference * bending / longest if longest else 0.0

    def places(self, amounts: Reals) -> Numbers:
        """Return the displacements for given amplitudes, see `displacements`."""
        moved = self.problem.terms.kinematics.unit
        if not moved.beams.size:
            return amounts
        along = (moved.beams[1:] @ amounts[:, None, :, None])[..., 0]
        return (np.conj(beam_directions(self.motion)).T[1:, :, None] * along).reshape(len(amounts), -1)


def static_start(posed: Problem, load: Reals) -> Reals:
    """Return the static response at the start of the grid to a load on the coordinates, (points, r), shape (r,)."""
    grid = posed.terms.grid.first
    points = slice(grid.stages)
    static: Any = np.linalg.solve(posed.equations.stiffness[points], load[points, :, None])[..., 0]
    return np.asarray(grid.at_nodes(static)[0], float)


def vibration(terms: MotionTerms, bent: Deflection, start: Start | None = None, speed: float = 1.0) -> Vibration:
    """Solve the equations of motion about the motion of a deflection at the nodes of a grid.

    Without a `start`, the solution is periodic. The motion runs at `speed` times the speed of the grid. The history is
    in the time of the grid.
    """
    posed = problem(terms, bent, speed)
    steps = propagation(terms.grid, posed.equations)
    begun = start(steps, posed, bent) if start else None
    return Vibration(bent, posed, steps, steps.history(steps.periodic_start() if begun is None else begun), begun)
