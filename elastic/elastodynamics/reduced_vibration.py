"""Vibration in reduced coordinates on a given time grid."""

from collections.abc import Callable
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct

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

# a cycle is closed if section forces at its start and end differ by at most this, relative to the largest
MAX_CYCLE_JUMP = 1e-6

Start = Callable[[Propagation, Problem, Deflection], Any]


class Vibration(Struct, frozen=True, eq=False, dict=True):
    """Solution of the equations of motion on a grid.

    Attributes
    ----------
    quasi_static
        Quasi-static deflection at the nodes of the grid.
    history
        Amplitudes x of the coordinates and their derivatives x' and x'', at the points of the grid, shape (points, r)
        each.
    initial_state
        Initial state (x, x'), shape (2 r,), or None for a periodic solution.
    residual
        Residual response: displacements that the coordinates do not represent, or None if they are neglected.
    """

    quasi_static: Deflection
    problem: Problem
    propagation: Propagation
    history: tuple[Reals, Reals, Reals]
    initial_state: Reals | None
    residual: ResidualResponse | None = None

    @property
    def cyclic(self) -> bool:
        """True for a periodic solution."""
        return self.initial_state is None

    @property
    def motion(self) -> Motion:
        """Rigid motion at the nodes of the grid."""
        return self.quasi_static.motion

    @cached_property
    def loads(self) -> AddedLoads:
        """Loads that the vibration adds at the points of the grid."""
        return vibration_loads(self.problem, self.motion, self.history, self.residual)

    @cached_property
    def deflection(self) -> Deflection:
        """Deflection of the vibrating mechanism at the nodes."""
        plain = self.quasi_static
        return deflection(
            plain.motion, plain.sections, plain.joints, resampled(self.loads, self.problem.terms.grid.with_start)
        )

    @cached_property
    def closed(self) -> bool:
        """True if the quasi-static section forces are equal at the start and at the end of the grid."""
        moments, forces = self.quasi_static.amplitudes.M, self.quasi_static.amplitudes.N
        return all(
            bool((np.abs(each[..., -1] - each[..., 0]) <= MAX_CYCLE_JUMP * np.abs(each).max(initial=0.0)).all())
            for each in (moments, forces)
        )

    def sampler(self, times: Reals) -> Callable[[Any], Any]:
        """Return the function that interpolates values at the points to given instants, see `Grid.sampler`."""
        grid = self.problem.terms.grid
        return grid.sampler(grid.cycled(times, self.closed) if self.cyclic else times)

    @cached_property
    def multipliers(self) -> Complexes:
        """Factors by which free vibrations grow in the cycle (Floquet multipliers) or in the run."""
        return self.propagation.multipliers

    @property
    def stable(self) -> bool:
        """Whether no free vibration grows, see `VibrationSettings.stable`."""
        return bool(VIBRATION.stable(np.abs(self.multipliers).max(initial=0.0), self.cyclic))

    def response_to(self, load: Reals, often: bool = False) -> tuple[Reals, Reals, Reals]:
        """Return the history (x, x', x'') of the coordinates under another load alone, shape (points, r).

        If the vibration is periodic, so is the result. If the vibration starts deflected and at rest, the result starts
        with the static response to the load. Otherwise the result starts from zero. For `often` see
        `Propagation.loaded`.
        """
        steps = self.propagation.loaded(load, often)
        if self.initial_state is None:
            return steps.history(steps.periodic_start())
        deflected, rate = np.split(self.initial_state, 2)
        start = np.zeros_like(self.initial_state)
        if deflected.any() and not rate.any():
            start[: len(rate)] = static_start(self.problem, load)
        return steps.history(start)

    @cached_property
    def displacements(self) -> Numbers:
        """Displacements of the beams in beam axes [m], complex, shape (points, beams * Gauss points).

        For a mechanism without beams, these are the amplitudes of the coordinates.
        """
        return self.beam_displacements(self.history[0])

    @property
    def inertia_load(self) -> Reals:
        """Inertia forces on the coordinates due to their accelerations, with opposite sign, shape (points, r)."""
        return np.asarray((self.problem.equations.mass @ self.history[2][..., None])[..., 0], float)

    def unresolved(self, inertia_load: Reals) -> Reals:
        """Return the part of the vibration that each time element does not resolve.

        It is relative to the largest displacement. The shape is (elements,). This is the largest of three unresolved
        parts: of the displacements, of the static displacements under the inertia forces, and of the axial forces. The
        part of the axial forces has a small weight, because axial vibration is faster than bending and hardly affects
        it.
        """
        terms = self.problem.terms
        many = terms.elastic.ndim == 3
        bent: Any = np.linalg.solve(terms.elastic, inertia_load[..., None] if many else inertia_load.T)
        moved = self.displacements
        by_inertia = self.beam_displacements(bent[..., 0] if many else bent.T)
        greatest = np.abs(moved).max()
        tails = [terms.grid.tail(values, greatest) for values in (moved, by_inertia)]
        return np.maximum.reduce([*tails, VIBRATION.axial_weight * self.unresolved_axial])

    @property
    def unresolved_axial(self) -> Reals:
        """Part of the axial forces that each element does not resolve, relative to the largest force, (elements,)."""
        N, least = self.axial_forces
        return self.problem.terms.grid.tail(N, max(float(np.abs(N).max(initial=0.0)), least))

    @property
    def axial_forces(self) -> tuple[Reals, float]:
        """Axial forces due to the coordinates [N], and a lower bound on the reference for their errors.

        The forces have the shape (points, beams * Gauss points).
        """
        kinematics = self.problem.terms.kinematics
        structure, basis = kinematics.structure, kinematics.basis
        count = structure.weights.size
        strains = strain_rows(structure, basis if basis.ndim == 2 else basis[1:])[..., : 2 * count, :]
        stiff = rigidities(structure)[: 2 * count] / np.tile(structure.weights.ravel(), 2)
        forces: Reals = stiff * (strains @ self.history[0][..., None])[..., 0]
        longest = structure.weights.sum(axis=-1).max(initial=0.0)
        bending = float(np.abs(forces[:, count:]).max(initial=0.0))
        return forces[:, :count], VIBRATION.min_axial_reference * bending / longest if longest else 0.0

    def beam_displacements(self, amounts: Reals) -> Numbers:
        """Return `displacements` for given amplitudes, shape (points, r)."""
        moved = self.problem.terms.kinematics.unit
        if not moved.beams.size:
            return amounts
        along = (moved.beams[1:] @ amounts[:, None, :, None])[..., 0]
        return (np.conj(beam_directions(self.motion)).T[1:, :, None] * along).reshape(len(amounts), -1)


def static_start(posed: Problem, load: Reals) -> Reals:
    """Return the amplitudes of the static response to a load at the start of the grid, shape (r,).

    The load has the shape (points, r).
    """
    grid = posed.terms.grid.first
    points = slice(grid.stages)
    static: Any = np.linalg.solve(posed.equations.stiffness[points], load[points, :, None])[..., 0]
    return np.asarray(grid.with_start(static)[0], float)


def vibration(terms: MotionTerms, bent: Deflection, start: Start | None = None, speed: float = 1.0) -> Vibration:
    """Solve the equations of motion on a grid.

    Parameters
    ----------
    bent
        Quasi-static deflection at the nodes.
    start
        Function that returns the initial state. If None, the solution is periodic.
    speed
        Speed of the mechanism, relative to the speed of the motion for which the grid was set up. Rates and
        accelerations in the history are derivatives with respect to the time of the grid.
    """
    posed = problem(terms, bent, speed)
    steps = propagation(terms.grid, posed.equations)
    initial_state = start(steps, posed, bent) if start else None
    return Vibration(
        bent,
        posed,
        steps,
        steps.history(steps.periodic_start() if initial_state is None else initial_state),
        initial_state,
    )
