"""Residual of the exact equations of displaced links, and its reduction by linear equations of motion."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.correction import displacements_of, inertia_load
from elastic.elastodynamics.displaced_links import Displaced, ExactLoads
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.samples import along_beams
from elastic.elastodynamics.settled import TINY
from elastic.elastodynamics.strains import given_forces, rigidities, strain_rows
from elastic.elastodynamics.vibration_loads import ResidualResponse, resampled
from elastic.solution import Deflection, deflection
from rigid.arrays import Complexes, Numbers, Reals
from rigid.kinematics import stacked

ROUND_OFF = 1e-8  # round-off of strains, relative to (largest displacement / length)
SMALL = 0.1  # smallest reference for a residual force, relative to the largest force of all beams

Response = Callable[[Reals], tuple[Reals, Reals, Reals]]  # function from a load to the history of the coordinates


@dataclass(frozen=True, eq=False)
class Loaded:
    """Quantities of a quasi-static deflection at the nodes of a grid that are compared in the residual.

    Attributes
    ----------
    force, joints, moments
        See `Displaced`. The force does not include couples.
    strained
        Forces of the strains, see `given_forces`.
    moved
        Displacements, as a single kind.
    """

    force: Complexes
    joints: Complexes
    moments: Reals
    strained: Reals
    moved: Displacements

    def without(self, other: Loaded, share: float) -> Loaded:
        """Subtract `share` times another set of quantities."""
        return Loaded(
            self.force - share * other.force,
            self.joints - share * other.joints,
            self.moments - share * other.moments,
            self.strained - share * other.strained,
            self.moved - other.moved @ np.array([[share]]),
        )


def loaded(vibration: Vibration, bent: Deflection) -> Loaded:
    """Return the quantities of a deflection at the nodes of the grid of a vibration."""
    structure = vibration.problem.terms.kinematics.structure
    N, V = (along_beams(bent, name, structure.xi) for name in ("N", "V"))
    count = (len(N),)
    moments = [bent.forces.without_friction(number)[1] for number in range(len(bent.forces.moment))]
    joints, held = stacked(bent.forces.force, count, complex).T, stacked(moments, count, float).T
    return Loaded(N - 1j * V, joints, held, given_forces(structure, bent), displacements_of(vibration, bent))


@dataclass(frozen=True, eq=False)
class Coordinates:
    """Strains of the reduced coordinates of a vibration at the nodes of its grid."""

    vibration: Vibration

    @cached_property
    def _strains(self) -> tuple[Reals, Reals]:
        kinds = self.vibration.problem.terms.kinematics
        return strain_rows(kinds.structure, kinds.basis), rigidities(kinds.structure)

    def forces(self, amounts: Reals) -> Reals:
        """Return the forces due to the strains for given values of the coordinates, shape (nodes, rows)."""
        strains, stiff = self._strains
        forces: Reals = stiff * (strains @ amounts[..., None])[..., 0]
        return forces

    def push(self, strained: Reals) -> Reals:
        """Return the load on the coordinates due to forces of strains, shape (nodes, r)."""
        push: Reals = (self._strains[0].swapaxes(-1, -2) @ strained[..., None])[..., 0]
        return push

    def static(self, push: Reals) -> Reals:
        """Return the static response to a load, shape (nodes, r)."""
        strains, stiff = self._strains
        found: Any = np.linalg.solve((strains.swapaxes(-1, -2) * stiff) @ strains, push[..., None])
        return np.asarray(found[..., 0], float)

    def response(self, amounts: Reals) -> ResidualResponse:
        """Return the displacements and forces for given values of the coordinates, shape (nodes, r)."""
        moved = self.vibration.problem.terms.kinematics.unit @ amounts[..., None]
        return ResidualResponse(moved, self.forces(amounts))


@dataclass(frozen=True, eq=False)
class Unbalanced:
    """Displaced links, and the quasi-static deflection under their loads. They agree in equilibrium.

    Attributes
    ----------
    now
        Displaced links.
    bent
        Quasi-static deflection under their loads.
    found
        Quantities of this deflection; the forces include the couples of rotated sections.
    """

    now: Displaced
    bent: Deflection
    found: Loaded

    @cached_property
    def change(self) -> Displacements:
        """Residual: displacements of the quasi-static deflection minus displacements of the links."""
        return self.found.moved - self.now.moved

    @cached_property
    def strained(self) -> Reals:
        """Residual of the forces of the strains, shape (nodes, rows); 0 for compliant joints."""
        now, structure = self.now, self.now.vibration.problem.terms.kinematics.structure
        more = self.found.strained - self._coordinates.forces(now.vibration.problem.terms.grid.at_nodes(now.history[0]))
        more -= now.residual.forces
        more[:, more.shape[1] - len(structure.soft) :] = 0.0
        return more

    @property
    def force_share(self) -> float:
        """Largest residual of N or M, relative to the largest value on its beam, or to `SMALL` times that of all beams.

        Round-off of the strains is subtracted, because it would cause large forces in stiff beams.
        """
        structure = self.now.vibration.problem.terms.kinematics.structure
        weights, both = structure.weights, 2 * structure.weights.size
        if not weights.size:
            return 0.0

        def greatest(rows: Reals) -> Reals:
            return np.abs(rows.reshape(-1, 2, *weights.shape) / weights).max(axis=(0, 3))

        strain = ROUND_OFF * np.abs(self.now.moved.beams).max() / structure.length ** np.array([[1], [2]])
        noise = strain * greatest(rigidities(structure)[:both])
        off, forces = (greatest(rows[1:, :both]) for rows in (self.strained, self.found.strained))
        base = np.maximum(forces, SMALL * forces.max(axis=1, keepdims=True))
        return float((np.maximum(off - noise, 0.0) / np.maximum(base, TINY)).max())

    @cached_property
    def _coordinates(self) -> Coordinates:
        return Coordinates(self.now.vibration)

    @cached_property
    def push(self) -> Reals:
        """Residual as a load on the reduced coordinates, shape (nodes, r)."""
        return self._coordinates.push(self.strained)

    @cached_property
    def besides(self) -> ResidualResponse:
        """Residual minus its static response in the reduced coordinates."""
        followed = self._coordinates.response(self._coordinates.static(self.push))
        return ResidualResponse(self.change, self.strained) - followed


def unbalanced(now: Displaced, loads: ExactLoads, still: Loaded | None = None, share: float = 1.0) -> Unbalanced:
    """Compute the residual of displaced links under their loads.

    Parameters
    ----------
    still
        Quasi-static deflection under the loads of the rigid motion, of which only `share` acts. If None, they act
        fully.
    """
    linear = now.vibration
    grid, plain = linear.problem.terms.grid, linear.quasi_static
    added = resampled(replace(loads.added, section=None), grid.at_nodes)
    bent = deflection(plain.motion, plain.sections, plain.joints, added)
    found = loaded(linear, bent)
    if still is not None and share != 1.0:
        found = found.without(still, 1.0 - share)
    return Unbalanced(now, bent, replace(found, force=found.force + grid.at_nodes(loads.residual)))


def stepped(step: Unbalanced, operator: Vibration, response: Response, fastest: float) -> Displaced:
    """Correct displaced links by the response of linear equations of motion to their residual.

    Parameters
    ----------
    operator
        Equations of motion, also used for the inertia of the residual response.
    response
        Function for the response of their coordinates to a load.
    fastest
        See `exact_steps.settled_links`.
    """
    now = step.now
    besides = step.besides.slowed(now.vibration.problem, now.vibration.cyclic, fastest)
    moving = response(step.push[1:] + inertia_load(operator, besides))
    x, x1, x2 = (part + added for part, added in zip(now.history, moving, strict=True))
    residual, answer = now.residual + besides, step.found
    after = replace(
        now, history=(x, x1, x2), residual=residual, force=answer.force, joints=answer.joints, moments=answer.moments
    )
    return shortened(after)


def shortened(now: Displaced) -> Displaced:
    """Update the foreshortening, if there is any, to the current rotations."""
    if now.shortened is None:
        return now
    return replace(now, amplitudes=now.shortened.amplitudes(now.history[0], now.residual.moved, now.amplitudes))


def begin(linear: Vibration) -> Displaced:
    """Convert a linear vibration to displaced links."""
    terms = linear.problem.terms
    residual = linear.residual
    if residual is None:
        nothing = terms.kinematics.unit @ np.zeros((terms.kinematics.unit.angle.shape[-1], 1))
        residual = ResidualResponse(
            nothing, np.zeros((len(nothing.angle), len(rigidities(terms.kinematics.structure))))
        )
    found = loaded(linear, linear.deflection)
    return Displaced(linear, linear.history, residual, found.force, found.joints, found.moments)


def mixed(before: Sequence[tuple[Displaced, Complexes]]) -> Displaced:
    """Combine the last steps with weights that minimise the change (Anderson mixing)."""
    changes = np.array([np.ravel(change).view(float) for _, change in before])
    shares = np.linalg.lstsq(np.diff(changes, axis=0).T, changes[-1], rcond=None)[0]
    return summed([after for after, _ in before], np.diff(shares, prepend=0.0, append=1.0))


def summed(parts: Sequence[Displaced], weights: Reals) -> Displaced:
    """Combine displaced links linearly with weights that add up to one."""

    def total(*values: Any) -> Numbers:
        weighted: Numbers = sum(weight * value for weight, value in zip(weights, values, strict=True))
        return weighted

    x, x1, x2 = (total(*each) for each in zip(*(part.history for part in parts), strict=True))
    moved = Displacements(*map(total, *(vars(part.residual.moved).values() for part in parts)))
    residual = ResidualResponse(moved, total(*(part.residual.forces for part in parts)))
    held = (total(*each) for each in zip(*((part.force, part.joints, part.moments) for part in parts), strict=True))
    force, joints, moments = held
    last = parts[-1]
    return shortened(replace(last, history=(x, x1, x2), residual=residual, force=force, joints=joints, moments=moments))


def carried_over(now: Displaced, linear: Vibration, turned: Reals) -> Displaced:
    """Transfer displaced links to another discretization of the same elastic coordinates.

    Parameters
    ----------
    linear
        Vibration in that discretization.
    turned
        Coordinates per unit coordinate of `now`, shape (new r, r). They also take over the representable part of the
        residual response, differentiated within each time element, because it may jump at the edges. Rates of the
        other amplitudes are interpolated.
    """
    grid = linear.problem.terms.grid
    sampler = now.vibration.problem.terms.grid.sampler(grid.nodes[1:])

    def sampled(values: Any) -> Any:
        return grid.at_nodes(sampler(values[1:]))

    coordinates = Coordinates(linear)
    moved = Displacements(*map(sampled, vars(now.residual.moved).values()))
    residual = ResidualResponse(moved, sampled(now.residual.forces))
    amounts = coordinates.static(coordinates.push(residual.forces))
    rates = (grid.derivative(amounts[1:], order) for order in (1, 2))
    parts = zip(now.history, (amounts[1:], *rates), strict=True)
    history = _consistent(linear, [sampler(known) @ turned.T + added for known, added in parts])
    residual -= coordinates.response(amounts)
    return Displaced(linear, history, residual, sampled(now.force), sampled(now.joints), sampled(now.moments))


def _consistent(linear: Vibration, history: Sequence[Reals]) -> tuple[Reals, Reals, Reals]:
    """Return the history of a vibration under the load that balances an interpolated history.

    Interpolated rates are not exactly the derivatives of interpolated amplitudes. Steps would not remove this error,
    because they add to a history.
    """
    equations = linear.problem.equations
    x, x1, x2 = (part - known for part, known in zip(history, linear.history, strict=True))
    load: Reals = (
        equations.mass @ x2[..., None] + equations.damping @ x1[..., None] + equations.stiffness @ x[..., None]
    )
    added = linear.under(load[..., 0])
    x, x1, x2 = (known + part for known, part in zip(linear.history, added, strict=True))
    return x, x1, x2
