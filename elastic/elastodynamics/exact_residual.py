"""Residual of the exact equations for large displacement, and its reduction by linear equations of motion.

Displaced links are links with large displacement, see `Displaced`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import astuple, replace

from elastic.elastodynamics.correction import displacements_of, inertia_load
from elastic.elastodynamics.displaced_links import Displaced, ExactLoads
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.exact_iterate import TINY
from elastic.elastodynamics.exact_settings import EXACT
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.strains import rigidities, strain_forces, strain_rows
from elastic.elastodynamics.vibration_loads import ResidualResponse, resampled
from elastic.sampling import along_beams
from elastic.solution import Deflection, deflection
from rigid.arrays import Complexes, Numbers, Reals
from rigid.kinematics import stacked

# Round-off of strains. For a stretch, it is relative to the largest displacement divided by the beam length. For a
# curvature, it is relative to the largest displacement divided by the square of the beam length.
ROUND_OFF = 1e-8
# the reference for a residual force is at least this, relative to the largest force of all beams
MIN_FORCE_REFERENCE = 0.1

Response = Callable[[Reals], tuple[Reals, Reals, Reals]]  # function from a load to the history of the coordinates


class DeflectionState(Struct, frozen=True, eq=False):
    """Forces and displacements of a quasi-static deflection at the nodes of a grid.

    The residual is the difference between them and the forces and displacements of displaced links.

    Attributes
    ----------
    force
        Section force N - i V of the deflection, with the same shape as `Displaced.force`.
    joints, moments
        See `Displaced`.
    strain_forces
        Forces conjugate to the strains, see `strain_forces`.
    moved
        Displacements, as a single displacement field (c = 1).
    """

    force: Complexes
    joints: Complexes
    moments: Reals
    strain_forces: Reals
    moved: Displacements

    def without(self, other: DeflectionState, share: float) -> DeflectionState:
        """Subtract `share` times the forces and displacements of another deflection."""
        return DeflectionState(
            self.force - share * other.force,
            self.joints - share * other.joints,
            self.moments - share * other.moments,
            self.strain_forces - share * other.strain_forces,
            self.moved - other.moved @ np.array([[share]]),
        )


def deflection_state(vibration: Vibration, bent: Deflection) -> DeflectionState:
    """Return the forces and displacements of a deflection at the nodes of the grid of a vibration."""
    structure = vibration.problem.terms.kinematics.structure
    N, V = (along_beams(bent, name, structure.xi) for name in ("N", "V"))
    count = (len(N),)
    moments = [bent.forces.without_friction(number)[1] for number in range(len(bent.forces.moment))]
    joints, joint_moments = stacked(bent.forces.force, count, complex).T, stacked(moments, count, float).T
    return DeflectionState(
        N - 1j * V, joints, joint_moments, strain_forces(structure, bent), displacements_of(vibration, bent)
    )


class CoordinateForces(Struct, frozen=True, eq=False, dict=True):
    """Elastic forces due to the reduced coordinates of a vibration, at the nodes of its grid."""

    vibration: Vibration

    @cached_property
    def _strains(self) -> tuple[Reals, Reals]:
        kinematics = self.vibration.problem.terms.kinematics
        return strain_rows(kinematics.structure, kinematics.basis), rigidities(kinematics.structure)

    def forces(self, values: Reals) -> Reals:
        """Return the forces conjugate to the strains for given values of the coordinates, shape (nodes, rows)."""
        strains, stiff = self._strains
        forces: Reals = stiff * (strains @ values[..., None])[..., 0]
        return forces

    def load(self, strain_forces: Reals) -> Reals:
        """Return the load on the coordinates that is equivalent to given `strain_forces`, shape (nodes, r)."""
        load: Reals = (self._strains[0].swapaxes(-1, -2) @ strain_forces[..., None])[..., 0]
        return load

    def static(self, load: Reals) -> Reals:
        """Return the static response of the coordinates to a load, shape (nodes, r)."""
        strains, stiff = self._strains
        found: Any = np.linalg.solve((strains.swapaxes(-1, -2) * stiff) @ strains, load[..., None])
        return np.asarray(found[..., 0], float)

    def response(self, amounts: Reals) -> ResidualResponse:
        """Return the displacements and forces for given values of the coordinates, shape (nodes, r)."""
        moved = self.vibration.problem.terms.kinematics.unit @ amounts[..., None]
        return ResidualResponse(moved, self.forces(amounts))


class ResidualState(Struct, frozen=True, eq=False, dict=True):
    """Links with large displacement (displaced links), and the quasi-static deflection under their loads.

    In equilibrium, both have the same displacements.

    Attributes
    ----------
    now
        Displaced links.
    bent
        Quasi-static deflection under the loads of `now`.
    state
        Forces and displacements of the deflection `bent`. As section force it contains P, which is N - i V plus
        `ExactLoads.section_correction`.
    """

    now: Displaced
    bent: Deflection
    state: DeflectionState

    @cached_property
    def change(self) -> Displacements:
        """Residual: displacements of the quasi-static deflection minus displacements of the links."""
        return self.state.moved - self.now.moved

    @cached_property
    def strain_force_residual(self) -> Reals:
        """Residual of the forces conjugate to the strains, shape (nodes, rows); 0 for compliant joints."""
        now, structure = self.now, self.now.vibration.problem.terms.kinematics.structure
        residual = self.state.strain_forces - self._coordinates.forces(
            now.vibration.problem.terms.grid.with_start(now.history[0])
        )
        residual -= now.residual.forces
        residual[:, residual.shape[1] - len(structure.joint_openings) :] = 0.0
        return residual

    @property
    def force_residual(self) -> float:
        """Largest residual of N or M, relative to the largest N or M of the same beam.

        The reference is at least `MIN_FORCE_REFERENCE` times the largest N or M of all beams. Round-off of the strains
        causes large forces in stiff beams. An estimate of these forces is subtracted from the residual.
        """
        structure = self.now.vibration.problem.terms.kinematics.structure
        weights, both = structure.weights, 2 * structure.weights.size
        if not weights.size:
            return 0.0

        def greatest(rows: Reals) -> Reals:
            return np.abs(rows.reshape(-1, 2, *weights.shape) / weights).max(axis=(0, 3))

        strain = ROUND_OFF * np.abs(self.now.moved.beams).max() / structure.length ** np.array([[1], [2]])
        noise = strain * greatest(rigidities(structure)[:both])
        residuals, forces = (
            greatest(rows[1:, :both]) for rows in (self.strain_force_residual, self.state.strain_forces)
        )
        reference = np.maximum(forces, MIN_FORCE_REFERENCE * forces.max(axis=1, keepdims=True))
        return float((np.maximum(residuals - noise, 0.0) / np.maximum(reference, TINY)).max())

    @cached_property
    def _coordinates(self) -> CoordinateForces:
        return CoordinateForces(self.now.vibration)

    @cached_property
    def load(self) -> Reals:
        """Residual, converted to a load on the reduced coordinates, shape (nodes, r)."""
        return self._coordinates.load(self.strain_force_residual)

    @cached_property
    def unrepresented(self) -> ResidualResponse:
        """Part of the residual that a static response of the reduced coordinates does not represent."""
        represented = self._coordinates.response(self._coordinates.static(self.load))
        return ResidualResponse(self.change, self.strain_force_residual) - represented

    def is_disturbed_by(self, load: Reals) -> bool:
        """Return whether the residual of the coordinates is large, and a load on them would disturb their correction.

        The load has the shape (points, r).
        """
        grid = self.now.vibration.problem.terms.grid
        by_load = self._coordinates.response(self._coordinates.static(grid.with_start(load))).moved
        unrepresented = self.unrepresented.moved
        disturbance, represented, rest = (
            np.abs(each.beams[1:]).max(initial=0.0) for each in (by_load, self.change - unrepresented, unrepresented)
        )
        return bool(
            represented > EXACT.max_represented_ratio * rest and disturbance > EXACT.max_disturbance * represented
        )


def residual_state(
    now: Displaced, loads: ExactLoads, rigid_loads_state: DeflectionState | None = None, share: float = 1.0
) -> ResidualState:
    """Compute the residual of links with large displacement under their loads.

    Parameters
    ----------
    rigid_loads_state
        Forces and displacements of the quasi-static deflection under the loads of the rigid motion. Required if `share`
        is below 1.
    share
        Fraction of the loads of the rigid motion that acts on the links.
    """
    linear = now.vibration
    grid, quasi_static = linear.problem.terms.grid, linear.quasi_static
    added = resampled(replace(loads.added, section=None), grid.with_start)
    bent = deflection(quasi_static.motion, quasi_static.sections, quasi_static.joints, added)
    state = deflection_state(linear, bent)
    if rigid_loads_state is not None and share != 1.0:
        state = state.without(rigid_loads_state, 1.0 - share)
    return ResidualState(now, bent, replace(state, force=state.force + grid.with_start(loads.section_correction)))


def stepped(
    step: ResidualState, operator: Vibration, response: Response, cutoff: float, separately: bool = False
) -> Displaced:
    """Take one step: correct `step.now` by the response of linear equations of motion to its residual.

    Parameters
    ----------
    operator
        Linear equations of motion, from which the inertia load of the residual response is computed.
    response
        Function that returns the response of the coordinates of `operator` to a load.
    cutoff
        See `exact_steps.solve_exact`.
    separately
        Correct only the coordinates, and keep the residual response, if the coordinates are not in equilibrium and the
        inertia of a corrected residual response would disturb them. In fast motion, the steps may not converge
        otherwise.
    """
    now, state, load, residual = step.now, step.state, step.load[1:], step.now.residual
    unrepresented = step.unrepresented.filtered(now.vibration.problem, now.vibration.cyclic, cutoff)
    inertia = inertia_load(operator, unrepresented)
    if not (separately and step.is_disturbed_by(inertia)):
        load, residual = load + inertia, residual + unrepresented
    x, x1, x2 = (part + added for part, added in zip(now.history, response(load), strict=True))
    after = replace(
        now, history=(x, x1, x2), residual=residual, force=state.force, joints=state.joints, moments=state.moments
    )
    return with_updated_foreshortening(after)


def with_updated_foreshortening(now: Displaced) -> Displaced:
    """Update the amplitudes of the foreshortening for the current rotations, if there is foreshortening."""
    if now.foreshortening is None:
        return now
    return replace(now, amplitudes=now.foreshortening.amplitudes(now.history[0], now.residual.moved, now.amplitudes))


def from_linear(linear: Vibration) -> Displaced:
    """Convert a linear vibration to displaced links."""
    terms = linear.problem.terms
    residual = linear.residual
    if residual is None:
        zero = terms.kinematics.unit @ np.zeros((terms.kinematics.unit.angle.shape[-1], 1))
        residual = ResidualResponse(zero, np.zeros((len(zero.angle), len(rigidities(terms.kinematics.structure)))))
    state = deflection_state(linear, linear.deflection)
    return Displaced(linear, linear.history, residual, state.force, state.joints, state.moments)


def mixed(before: Sequence[tuple[Displaced, Complexes]]) -> Displaced:
    """Combine the results of the last steps so that the combined change is as small as possible (Anderson mixing).

    `before` contains for each step the links after the step, and the change in the step.
    """
    changes = np.array([np.ravel(change).view(float) for _, change in before])
    shares = np.linalg.lstsq(np.diff(changes, axis=0).T, changes[-1], rcond=None)[0]
    return summed([after for after, _ in before], np.diff(shares, prepend=0.0, append=1.0))


def summed(parts: Sequence[Displaced], weights: Reals) -> Displaced:
    """Combine displaced links linearly with weights that add up to one."""

    def total(*values: Any) -> Numbers:
        weighted: Numbers = sum(weight * value for weight, value in zip(weights, values, strict=True))
        return weighted

    x, x1, x2 = (total(*each) for each in zip(*(part.history for part in parts), strict=True))
    moved = Displacements(*map(total, *(astuple(part.residual.moved) for part in parts)))
    residual = ResidualResponse(moved, total(*(part.residual.forces for part in parts)))
    totals = (total(*each) for each in zip(*((part.force, part.joints, part.moments) for part in parts), strict=True))
    force, joints, moments = totals
    last = parts[-1]
    return with_updated_foreshortening(
        replace(last, history=(x, x1, x2), residual=residual, force=force, joints=joints, moments=moments)
    )


def transferred(now: Displaced, linear: Vibration, transformation: Reals) -> Displaced:
    """Transfer displaced links to another discretization of the same elastic coordinates.

    The coordinates and their rates are interpolated. If the new coordinates can represent a part of the residual
    response, this part is added to them. The rates of this part are computed separately within each time element,
    because the residual response may jump at the edges of elements.

    Parameters
    ----------
    linear
        Vibration in the other discretization.
    transformation
        New coordinates per unit of each old coordinate, shape (r of `linear`, r of `now`).
    """
    grid = linear.problem.terms.grid
    sampler = now.vibration.problem.terms.grid.sampler(grid.nodes[1:])

    def sampled(values: Any) -> Any:
        return grid.with_start(sampler(values[1:]))

    coordinates = CoordinateForces(linear)
    moved = Displacements(*map(sampled, astuple(now.residual.moved)))
    residual = ResidualResponse(moved, sampled(now.residual.forces))
    amounts = coordinates.static(coordinates.load(residual.forces))
    rates = (grid.derivative(amounts[1:], order) for order in (1, 2))
    parts = zip(now.history, (amounts[1:], *rates), strict=True)
    history = _consistent(linear, [sampler(known) @ transformation.T + added for known, added in parts])
    residual -= coordinates.response(amounts)
    return Displaced(linear, history, residual, sampled(now.force), sampled(now.joints), sampled(now.moments))


def _consistent(linear: Vibration, history: Sequence[Reals]) -> tuple[Reals, Reals, Reals]:
    """Replace an interpolated history by a solution of the equations of motion under the same forces.

    In an interpolated history, rates are not exactly the derivatives of the coordinates. Later steps would not remove
    this inconsistency, because they only add corrections to the history.
    """
    equations = linear.problem.equations
    x, x1, x2 = (part - known for part, known in zip(history, linear.history, strict=True))
    load: Reals = (
        equations.mass @ x2[..., None] + equations.damping @ x1[..., None] + equations.stiffness @ x[..., None]
    )
    added = linear.response_to(load[..., 0])
    x, x1, x2 = (known + part for known, part in zip(linear.history, added, strict=True))
    return x, x1, x2
