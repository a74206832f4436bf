"""Nonlinear elastodynamics: friction, and the exact equations of displaced links, by steps of the linear ones.

The residual of the exact equations is that of the quasi-static answer under the loads of displaced links. What an
answer changes of the displacements before is a quasi-static response; the linear equations of motion in the reduced
coordinates make it a dynamic one. The first step is the second order of large displacement; steps are mixed after
Anderson (Iterative procedures for nonlinear integral equations, Journal of the ACM 12 (1965) 547-560) until both what
one changes and the residual are below the tolerance: the residual has what steps smooth in time, and never feel.
Where friction is hard, that is where such steps do not halve what is left, each step takes it as viscous, as so much
per rate as there was at the last one: Coulomb's law is met by ever nearer secants, which joints that stick allow too.
Derivation: docs/theory.md.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from typing import Any

import numpy as np

from elastic.elastodynamics.correction import displacements_of, inertia_load
from elastic.elastodynamics.displaced_links import Displaced, ExactLoads, exact_loads
from elastic.elastodynamics.displacements import Displacements
from elastic.elastodynamics.point_effects import sliding_rows
from elastic.elastodynamics.reduced_vibration import Vibration
from elastic.elastodynamics.samples import along_beams
from elastic.elastodynamics.second_order import chord_of
from elastic.elastodynamics.strains import given_forces, rigidities, strain_rows
from elastic.elastodynamics.time_elements import Equations, propagation
from elastic.elastodynamics.vibration_loads import ResidualResponse, resampled, vibration_loads
from elastic.links import members_of
from elastic.sampling import reference_deflection
from elastic.solution import Deflection, deflection
from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.kinematics import stacked
from rigid.kinetostatics import friction_per_rate

Sliding = tuple[tuple[int, Columns, Columns], ...]  # as of `AddedLoads.sliding`
Response = Callable[[Reals], tuple[Reals, Reals, Reals]]  # from a load to the history that it makes

STEPS, RUBBING = 30, 50  # at most, without friction and with it
BLUNT = 100.0  # times the creep that hard friction begins with, which would never settle where it changes at once
SHARPER = 3.0  # times as sharp is friction at the next step
FALL = 0.5  # of what a step changes by the next one, below which friction is hard
BEAMS = 10.0  # times the tolerance that the deflection of a single beam may be off
STATIONS = 21
MIXED = 5  # steps before, of which the next is mixed
TINY = float(np.finfo(float).tiny)
LOST = 10.0  # times the least change, beyond which steps lead nowhere
FEW = 8  # steps that tell what a linear answer leaves out, at most
OF_FIRST, RESOLVED = 0.03, 3e-4  # of the first step, and of the largest displacement: what these may leave open
SMALL = 0.005  # of the largest displacement: a first step after which nothing to speak of is left


@dataclass(frozen=True, eq=False)
class Settled:
    """Links displaced by any amount after so many steps.

    Attributes
    ----------
    displaced
        The links.
    change, residual
        Of the beams' displacements [m], complex, shape (points, beams, Gauss points): by one more step, and that of the
        exact equations, the quasi-static answer under the loads of displaced links less their displacement. Without
        beams of the links' rotations [rad], shape (points, links, 1), and of shifts.
    steps
        How many were made, with the one more.
    sliding
        Rates of the joints with friction, where it is hard.
    """

    displaced: Displaced
    change: Complexes
    residual: Complexes
    steps: int
    sliding: Sliding = ()

    @property
    def share(self) -> float:
        """The change or the residual, the greater, of the largest displacement."""
        greatest = np.abs(_places(self.displaced.moved)).max(initial=TINY)
        return float(max(np.abs(off).max(initial=0.0) for off in (self.change, self.residual)) / greatest)

    @cached_property
    def worst(self) -> float:
        """As `share`, of the deflection from the chord, of the largest of the member for which that is most."""
        linear, stations = self.displaced.vibration, np.linspace(0.0, 1.0, STATIONS)
        if not self.displaced.moved.beams.size:
            return 0.0
        parts = (self.displaced.moved.beams[1:, ..., 0], self.change, self.residual)
        chord, *off = (np.abs(chord_of(linear, part, stations)).max(axis=(1, 2), initial=0.0) for part in parts)
        base = reference_deflection(members_of(linear.motion.mechanism).greatest(chord))
        return float((np.maximum(*off) / np.maximum(base, TINY)).max(initial=0.0))

    @property
    def open(self) -> float:
        """How far from settled it may be: a beam that bends little may be less so."""
        return max(self.share, self.worst / BEAMS)


def with_friction(
    linear: Vibration, tolerance: float, fastest: float, sliding: Sliding = ()
) -> tuple[Vibration, Settled]:
    """The vibration of small displacements with friction in the joints by its own forces and rates.

    Parameters and the second result as for `settled_links`.
    """
    rubbed = settled_links(linear, tolerance, fastest, _linear_loads, sliding)
    return replace(linear, history=rubbed.displaced.history, residual=rubbed.displaced.residual), rubbed


def _linear_loads(now: Displaced) -> ExactLoads:
    """Loads of small displacements, which leave sections as they are."""
    linear = now.vibration
    added = vibration_loads(linear.problem, linear.motion, now.history, now.residual)
    return ExactLoads(added, np.zeros_like(now.force[1:]))


def settled_links(
    linear: Vibration,
    tolerance: float,
    fastest: float,
    loads_of: Callable[[Displaced], ExactLoads] = exact_loads,
    sliding: Sliding = (),
    begun: Displaced | None = None,
) -> Settled:
    """Links displaced by any amount; they are open by more than the tolerance where steps do not get there.

    Parameters
    ----------
    fastest
        Angular frequency [rad/s] up to which accelerations of what the linear coordinates do not follow are taken.
    loads_of
        Loads of displaced links.
    sliding
        Rates of the joints with friction that the first step takes, as `AddedLoads` has them; their own without.
    begun
        Links that steps begin with, on the same grid; without it they begin with the linear answer.
    """
    now, last = begun or _begin(linear), np.inf
    response: Response = partial(linear.under, often=begun is None)
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    hard, blunt = False, 1.0
    for count in range(1, (RUBBING if linear.motion.mechanism.friction else STEPS) + 1):
        loads = loads_of(now)
        loads = _rubbed(loads, sliding if sliding and count == 1 else loads.added.sliding, blunt)
        after, residual, bent = _step(now, response, loads, fastest)
        change = _places(after.moved) - _places(now.moved)
        found = Settled(now, change, residual, count, loads.added.sliding if hard else ())
        if best and not hard and not found.open < LOST * best.open:
            break
        best = found if best is None or found.open < best.open or blunt > 1.0 else best
        if best.open <= tolerance and blunt <= 1.0:
            break
        size = float(np.abs(change).max(initial=0.0))
        if bent.forces.friction and (hard or sliding or size > FALL * last):
            blunt = max(blunt / SHARPER, 1.0) if hard or sliding else BLUNT
            hard, response, before = True, _held_back(linear, bent, loads.added.sliding), []
        last = size
        before = [*before[-MIXED:], (after, change)]
        now = _mixed(before)
    assert best is not None
    return best


def _rubbed(loads: ExactLoads, sliding: Sliding, blunt: float) -> ExactLoads:
    """Loads with rates of the joints with friction, and so many times the creep."""
    creeping = tuple((number, rate, creep * blunt) for number, rate, creep in sliding)
    return replace(loads, added=replace(loads.added, sliding=creeping))


def _places(moved: Displacements) -> Complexes:
    """Displacements of one kind at the points, as of `Settled.change`."""
    places: Complexes = moved.beams
    if not places.size:
        places = np.concatenate((moved.angle, moved.moves), axis=1)[:, :, None].astype(complex)
    return places[1:, ..., 0]


def first_steps(linear: Vibration, fastest: float) -> tuple[Settled, float]:
    """Links after as few steps as tell all that large displacement changes but for a small share of it.

    Returns
    -------
    The links after the last step, with the changes that it made; and what further steps may change, as `Settled.open`,
    where they do not get there, else 0.
    """
    now, enough = _begin(linear), 0.0
    before: list[tuple[Displaced, Complexes]] = []
    best: Settled | None = None
    least = np.inf
    for count in range(1, FEW + 1):
        after, residual, _ = _step(now, linear.under, exact_loads(now), fastest)
        change = _places(after.moved) - _places(now.moved)
        size = Settled(now, change, residual, count).open
        enough = enough or max(OF_FIRST * size, RESOLVED)
        if best is None or size < least:
            best, least = Settled(after, change, residual, count), size
        if size <= (SMALL if count == 1 else enough):
            return best, 0.0
        if not size < LOST * least:
            break
        before = [*before[-MIXED:], (after, change)]
        now = _mixed(before)
    assert best is not None
    return best, least


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
    held = (total(*each) for each in zip(*((part.force, part.joints, part.moments) for part in parts), strict=True))
    return Displaced(parts[-1].vibration, (x, x1, x2), residual, *held)


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


def _forces(linear: Vibration, bent: Deflection) -> tuple[Complexes, Complexes, Reals]:
    """N - i V along the beams, and the joint forces and moments, at the nodes."""
    N, V = (along_beams(bent, name, linear.problem.terms.kinematics.structure.xi) for name in ("N", "V"))
    count = (len(N),)
    moments = [bent.forces.without_friction(number)[1] for number in range(len(bent.forces.moment))]
    return N - 1j * V, stacked(bent.forces.force, count, complex).T, stacked(moments, count, float).T


def _held_back(linear: Vibration, bent: Deflection, sliding: Sliding) -> Response:
    """Response of the linear equations with Coulomb's friction as if it were viscous: as much per rate as there is."""
    posed = linear.problem
    kinds, grid = posed.terms.kinematics, posed.terms.grid
    per_rate = friction_per_rate(bent.motion, bent.forces, {number: creep for number, _, creep in sliding})
    damping, stiffness = posed.equations.damping, posed.equations.stiffness
    for viscosity, row in zip(per_rate.values(), sliding_rows(bent.motion, kinds.chosen), strict=True):
        unit = row(kinds.unit)
        felt = posed.speed * (viscosity[:, None] * unit)[1:, :, None]
        damping = damping + felt * unit[1:, None]
        stiffness = stiffness + felt * grid.rates(unit)[0][:, None]

    def response(load: Reals) -> tuple[Reals, Reals, Reals]:
        steps = propagation(grid, Equations(posed.equations.mass, damping, stiffness, load))
        return steps.history(steps.periodic_start() if linear.cyclic else np.zeros(2 * load.shape[1]))

    return response


def _step(
    now: Displaced, response: Response, loads: ExactLoads, fastest: float
) -> tuple[Displaced, Complexes, Deflection]:
    """Displaced links under given loads, with the vibration that this change makes by a response to loads.

    With them the residual of the beams' displacements, as of `Settled`, and the quasi-static answer under those loads.
    """
    linear = now.vibration
    terms = linear.problem.terms
    structure, unit, grid = terms.kinematics.structure, terms.kinematics.unit, terms.grid
    plain, added = linear.quasi_static, replace(loads.added, section=None)
    bent = deflection(plain.motion, plain.sections, plain.joints, resampled(added, grid.at_nodes))
    force, joints, moments = _forces(linear, bent)
    strains, stiff = strain_rows(structure, terms.kinematics.basis), rigidities(structure)

    def made_by(amounts: Reals) -> Reals:
        return stiff * (strains @ amounts[..., None])[..., 0]

    more = given_forces(structure, bent) - made_by(grid.at_nodes(now.history[0])) - now.residual.forces
    more[:, more.shape[1] - len(structure.soft) :] = 0.0
    push = (strains.swapaxes(-1, -2) @ more[..., None])[..., 0]
    static: Any = np.linalg.solve((strains.swapaxes(-1, -2) * stiff) @ strains, push[..., None])[..., 0]
    change = displacements_of(linear, bent) - now.moved
    rest = ResidualResponse(change - unit @ static[..., None], more - made_by(static)).smoothed(grid, fastest)
    moving = response(push[1:] + inertia_load(linear, rest))
    x, x1, x2 = (part + added for part, added in zip(now.history, moving, strict=True))
    after = Displaced(linear, (x, x1, x2), now.residual + rest, force + grid.at_nodes(loads.residual), joints, moments)
    return after, _places(change), bent


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
