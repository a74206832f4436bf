"""Geometrically exact elastodynamics: the exact equations of displaced links, by steps of the linear ones.

The residual of the exact equations is that of the quasi-static answer under the loads of displaced links. What an
answer changes of the displacements before is a quasi-static response; the linear equations of motion in the reduced
coordinates make it a dynamic one. The first step is the second order of large displacement; steps are mixed after
Anderson (Iterative procedures for nonlinear integral equations, Journal of the ACM 12 (1965) 547-560) until both what
one changes and the residual are below the tolerance: the residual has what steps smooth in time, and never feel.
Derivation: docs/theory.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from elastic.elastodynamics.correction import displacements_of, inertia_load
from elastic.elastodynamics.displaced_links import Displaced, exact_loads
from elastic.elastodynamics.displaced_points import require_known
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.samples import along_beams
from elastic.elastodynamics.second_order import chord_of
from elastic.elastodynamics.strains import given_forces, rigidities, strain_rows
from elastic.elastodynamics.vibration_loads import ResidualResponse, resampled
from elastic.links import members_of
from elastic.sampling import reference_deflection
from elastic.solution import Deflection, deflection
from rigid.arrays import Complexes, Numbers, Reals

STEPS = 30
BEAMS = 10.0  # times the tolerance that the deflection of a single beam may be off
STATIONS = 21
MIXED = 5  # steps before, of which the next is mixed
TINY = float(np.finfo(float).tiny)
LOST = 10.0  # times the least change, beyond which steps lead nowhere


@dataclass(frozen=True, eq=False)
class Settled:
    """Links displaced by any amount after so many steps.

    Attributes
    ----------
    displaced
        The links.
    change, residual
        Of the beams' displacements [m], complex, shape (points, beams, Gauss points): by one more step, and that of the
        exact equations, the quasi-static answer under the loads of displaced links less their displacement.
    steps
        How many were made, with the one more.
    """

    displaced: Displaced
    change: Complexes
    residual: Complexes
    steps: int

    @property
    def share(self) -> float:
        """The change or the residual, the greater, of the largest displacement."""
        greatest = np.abs(self.displaced.moved.beams).max(initial=TINY)
        return float(max(np.abs(off).max(initial=0.0) for off in (self.change, self.residual)) / greatest)

    @cached_property
    def worst(self) -> float:
        """As `share`, of the deflection from the chord, of the largest of the member for which that is most."""
        linear, stations = self.displaced.vibration, np.linspace(0.0, 1.0, STATIONS)
        parts = (self.displaced.moved.beams[1:, ..., 0], self.change, self.residual)
        chord, *off = (np.abs(chord_of(linear, part, stations)).max(axis=(1, 2), initial=0.0) for part in parts)
        base = reference_deflection(members_of(linear.motion.mechanism).greatest(chord))
        return float((np.maximum(*off) / np.maximum(base, TINY)).max(initial=0.0))

    @property
    def open(self) -> float:
        """How far from settled it may be: a beam that bends little may be less so."""
        return max(self.share, self.worst / BEAMS)


def settled_links(linear: Vibration, tolerance: float, fastest: float) -> Settled:
    """Links displaced by any amount; they are open by more than the tolerance where steps do not get there.

    Parameters
    ----------
    fastest
        Angular frequency [rad/s] up to which accelerations of what the linear coordinates do not follow are taken.

    Raises
    ------
    MechanismError
        A gear, or a slider along an elastic link.
    """
    require_known(linear.motion)
    now = _begin(linear)
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    for count in range(1, STEPS + 1):
        after, residual = _step(now, fastest)
        change = (after.moved.beams - now.moved.beams)[1:, ..., 0]
        found = Settled(now, change, residual, count)
        if best and not found.open < LOST * best.open:
            break
        best = found if best is None or found.open < best.open else best
        if best.open <= tolerance:
            break
        before = [*before[-MIXED:], (after, change)]
        now = _mixed(before)
    assert best is not None
    return best


def _mixed(before: Sequence[tuple[Displaced, Complexes]]) -> Displaced:
    """The last steps' answers, summed with the weights for which the changes' sum is least."""
    changes = np.array([np.ravel(change).view(float) for _, change in before])
    shares = np.linalg.lstsq(np.diff(changes, axis=0).T, changes[-1], rcond=None)[0]
    return _sum([after for after, _ in before], np.diff(shares, prepend=0.0, append=1.0))


def _sum(parts: Sequence[Displaced], weights: Reals) -> Displaced:
    """A sum of states with weights that add up to one."""

    def total(*values: Any) -> Numbers:
        weighted: Numbers = sum(weight * value for weight, value in zip(weights, values, strict=True))
        return weighted

    x, x1, x2 = (total(*each) for each in zip(*(part.history for part in parts), strict=True))
    moved = Displacements(*map(total, *(vars(part.residual.moved).values() for part in parts)))
    residual = ResidualResponse(moved, total(*(part.residual.forces for part in parts)))
    force, joints = total(*(part.force for part in parts)), total(*(part.joints for part in parts))
    return Displaced(parts[-1].vibration, (x, x1, x2), residual, force, joints)


def _begin(linear: Vibration) -> Displaced:
    """The linear answer."""
    terms = linear.problem.terms
    residual = linear.residual
    if residual is None:
        nothing = terms.kinematics.unit @ np.zeros((terms.kinematics.unit.angle.shape[-1], 1))
        residual = ResidualResponse(
            nothing, np.zeros((len(nothing.angle), len(rigidities(terms.kinematics.structure))))
        )
    return Displaced(linear, linear.history, residual, *_forces(linear, linear.deflection))


def _forces(linear: Vibration, bent: Deflection) -> tuple[Complexes, Complexes]:
    """N - i V along the beams, and the joint forces, at the nodes."""
    N, V = (along_beams(bent, name, linear.problem.terms.kinematics.structure.xi) for name in ("N", "V"))
    joints = [np.broadcast_to(force, len(N)) for force in bent.forces.force]
    return N - 1j * V, np.array(joints, complex).reshape(len(joints), -1).T


def _step(now: Displaced, fastest: float) -> tuple[Displaced, Complexes]:
    """Displaced links under their exact loads, with the vibration that this change makes in the linear equations.

    With them the residual of the beams' displacements, as of `Settled`.
    """
    linear = now.vibration
    terms = linear.problem.terms
    structure, unit, grid = terms.kinematics.structure, terms.kinematics.unit, terms.grid
    loads = exact_loads(now)
    plain, added = linear.quasi_static, replace(loads.added, section=None)
    bent = deflection(plain.motion, plain.sections, plain.joints, resampled(added, grid.at_nodes))
    force, joints = _forces(linear, bent)
    strains, stiff = strain_rows(structure, terms.kinematics.basis), rigidities(structure)

    def made_by(amounts: Reals) -> Reals:
        return stiff * (strains @ amounts[..., None])[..., 0]

    more = given_forces(structure, bent) - made_by(grid.at_nodes(now.history[0])) - now.residual.forces
    more[:, more.shape[1] - len(structure.soft) :] = 0.0
    push = (strains.swapaxes(-1, -2) @ more[..., None])[..., 0]
    static: Any = np.linalg.solve((strains.swapaxes(-1, -2) * stiff) @ strains, push[..., None])[..., 0]
    change = displacements_of(linear, bent) - now.moved
    rest = ResidualResponse(change - unit @ static[..., None], more - made_by(static)).smoothed(grid, fastest)
    moving = linear.under(push[1:] + inertia_load(linear, rest))
    x, x1, x2 = (part + added for part, added in zip(now.history, moving, strict=True))
    after = Displaced(linear, (x, x1, x2), now.residual + rest, force + grid.at_nodes(loads.residual), joints)
    return after, change.beams[1:, ..., 0]


def exact_deflection(now: Displaced, bent: Deflection, sampler: Callable[[Any], Any]) -> Deflection:
    """Deflection of displaced links at other positions than those of their grid.

    Parameters
    ----------
    bent
        Quasi-static, at these positions.
    sampler
        From values at the points of the grid to those at the positions.
    """
    loads = resampled(exact_loads(now).added, sampler)
    return deflection(bent.motion, bent.sections, bent.joints, loads)
