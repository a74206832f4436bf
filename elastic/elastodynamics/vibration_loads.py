"""Loads that vibration adds to those of the rigid motion: along beams, at points and in compliant joints.

The quasi-static deflection under these loads is that of the vibrating mechanism. Displacements that the reduced
coordinates do not represent are included statically, and forces and fields agree to round-off.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.polynomial import legendre

from elastic.elastodynamics.displacements import UNDER, Displacements
from elastic.elastodynamics.elastic_structure import ElasticStructure, way_of
from elastic.elastodynamics.equations_of_motion import Problem, mass_rows, masses
from elastic.elastodynamics.point_effects import lumps_of, sliding_rows
from elastic.elastodynamics.strains import rigidities
from elastic.links.added_loads import AddedLoads, map_loads
from rigid import Motion
from rigid import structure as joints_of
from rigid.arrays import Columns, Complexes, Numbers, Reals
from rigid.kinetostatics import beam_directions, creep_rate, friction_joints
from rigid.plane import cross


@lru_cache(maxsize=32)
def to_powers(points: int) -> Reals:
    """Return the matrix that maps values at Gauss points to coefficients in powers of xi, shape (points, points)."""
    nodes, _ = legendre.leggauss(points)
    series = np.linalg.inv(legendre.legvander(nodes, points - 1))
    in_xi = np.zeros((points, points))
    for order in range(points):
        one = legendre.Legendre.basis(order, domain=[0.0, 1.0])
        in_xi[: order + 1, order] = one.convert(kind=np.polynomial.Polynomial, domain=[-1.0, 1.0]).coef
    return in_xi @ series


@dataclass(frozen=True, eq=False)
class ResidualResponse:
    """Residual response: displacements and forces at the nodes of a grid that the coordinates do not represent.

    Attributes
    ----------
    moved
        Displacements, as a single kind.
    forces
        Forces of the strains (see `given_forces`), shape (nodes, rows); 0 for compliant joints.
    """

    moved: Displacements
    forces: Reals

    def __sub__(self, other: ResidualResponse) -> ResidualResponse:
        return ResidualResponse(self.moved - other.moved, self.forces - other.forces)

    def __add__(self, other: ResidualResponse) -> ResidualResponse:
        return ResidualResponse(self.moved + other.moved, self.forces + other.forces)

    def slowed(self, problem: Problem, cyclic: bool, fastest: float) -> ResidualResponse:
        """Return the response with the delay by damping, and without changes faster than an angular frequency.

        See `Grid.lagged` and `Grid.smoothed`. The delay is that of the beam with the largest damping.
        """
        grid, lag = problem.terms.grid, problem.speed * float(np.max(problem.terms.damping.beams, initial=0.0))

        def slow(values: Numbers) -> Numbers:
            return grid.at_nodes(grid.smoothed(grid.lagged(values[1:], lag, cyclic), fastest))

        return ResidualResponse(Displacements(*map(slow, vars(self.moved).values())), slow(self.forces))

    def viscous(self, found: Problem) -> Reals:
        """Return the rates of the forces at the points times beta, shape (points, rows)."""
        terms = found.terms
        beta = found.speed * terms.damping.per_row(terms.kinematics.structure)
        return beta * terms.grid.derivative(self.forces[1:], 1)


class GatheredLoads:
    """Builder of `AddedLoads`, in arrays with positions first."""

    def __init__(self, structure: ElasticStructure, count: int) -> None:
        self.structure = structure
        beams, points = structure.weights.shape
        self.q = np.zeros((count, beams, points), complex)
        self.points: list[tuple[int, str, Any, Any]] = []
        self.blocks: list[tuple[int, Any, Any]] = []

    def along_beams(self, force: Complexes) -> None:
        """Add a force per length at Gauss points in beam axes [N/m], complex, shape (positions, beams, points)."""
        self.q += force @ to_powers(force.shape[-1]).T

    @staticmethod
    def positions_last(values: Numbers) -> Numbers:
        """Reorder the axes such that powers are first and positions last."""
        return np.moveaxis(values, (-1, 0), (0, -1))

    def at_ends(self, directions: Complexes, start: Numbers, end: Numbers, moments: bool = False) -> None:
        """Add forces in beam axes, complex, or moments to both ends of the beams, shape (positions, beams)."""
        for k, (at, beam) in enumerate(self.structure.mechanism.beams):
            for name, value in ((beam.start, start[:, k]), (beam.end, end[:, k])):
                pair = (0.0, value) if moments else (directions[:, k] * value, 0.0)
                self.points.append((at, name, *pair))


def vibration_loads(
    problem: Problem, motion: Motion, history: tuple[Reals, Reals, Reals], residual: ResidualResponse | None = None
) -> AddedLoads:
    """Compute the loads at the points of a grid from amplitudes, rates and accelerations, shape (points, r) each.

    `motion` is the rigid motion at the nodes of the grid, and `residual` the residual response.
    """
    x, x1, _ = history
    terms, kinds = problem.terms, problem.terms.kinematics
    structure = kinds.structure
    directions = beam_directions(motion).T[1:]
    acceleration = terms.accelerations(history)
    slope = (kinds.unit.slope[1:] @ x[:, None, :, None])[..., 0]
    if residual is not None:
        rows = mass_rows(structure, motion, kinds.chosen, residual.moved)[1:, :, 0]
        acceleration = acceleration + terms.grid.derivative(rows, 2)
        slope = slope + residual.moved.slope[1:, ..., 0]
    inertia = (-(problem.speed**2) * masses(structure)) * acceleration
    gathered = GatheredLoads(structure, len(x))
    flux = _of_beams(gathered, problem, motion, slope, inertia)
    viscous = strain_rates(problem, x, x1)
    if residual is not None:
        viscous = viscous + residual.viscous(problem)
    of_strain_rates(gathered, directions, viscous, flux)
    of_lumps(gathered, motion, inertia)
    _of_effects(gathered, problem, x, x1, residual)
    gaps, turns = openings(gathered, motion, viscous)
    return AddedLoads(
        gathered.positions_last(gathered.q),
        tuple(gathered.points),
        tuple(gathered.blocks),
        gaps,
        turns,
        sliding=sliding_rates(problem, motion, x, x1),
    )


def _of_beams(gathered: GatheredLoads, found: Problem, motion: Motion, slope: Reals, inertia: Complexes) -> Reals:
    """Add the inertia along the beams, and return the force on slopes [N], shape (positions, beams, points)."""
    structure, felt, directions = gathered.structure, found.felt, beam_directions(motion).T[1:]
    shape = (len(inertia), *structure.weights.shape)
    size = structure.weights.size
    force: Complexes = inertia[:, :size].reshape(shape)
    if felt.turning is not None:
        force = force + 1j * felt.turning[1:] * slope
    gathered.along_beams(np.conj(directions)[..., None] * force / structure.weights)
    flux = -felt.pull[1:] * slope
    if structure.rotary.any():
        flux = flux + inertia[:, size : 2 * size].real.reshape(shape)
    return flux / structure.weights


def strain_rates(problem: Problem, x: Reals, x1: Reals) -> Reals:
    """Return the rates of the forces of the strains times beta, shape (positions, rows)."""
    terms, structure = problem.terms, problem.terms.kinematics.structure
    rates = (terms.strains @ x1[..., None])[..., 0]
    if np.ndim(terms.strain_rate):
        rates = rates + (terms.strain_rate @ x[..., None])[..., 0]
    return rates * (problem.speed * rigidities(structure) * terms.damping.per_row(structure))


def of_strain_rates(gathered: GatheredLoads, directions: Complexes, viscous: Reals, flux: Reals) -> None:
    """Add damping forces of the strains and forces on slopes, as loads along the beams and at their ends."""
    structure = gathered.structure
    shape = (len(viscous), *structure.weights.shape)
    size = structure.weights.size
    series = to_powers(shape[-1]).T
    power = np.arange(1, shape[-1]) / structure.length[:, None]
    stretching, bending = (
        (viscous[:, k * size : (k + 1) * size].reshape(shape) / structure.weights) @ series for k in (0, 1)
    )
    across = flux @ series
    across[..., :-1] += bending[..., 1:] * power
    gathered.q[..., :-1] += stretching[..., 1:] * power - 1j * across[..., 1:] * power
    pull = 1j * across - stretching
    gathered.at_ends(directions, -pull[..., 0], pull.sum(-1))
    gathered.at_ends(directions, bending[..., 0], -bending.sum(-1), moments=True)


def of_lumps(gathered: GatheredLoads, motion: Motion, inertia: Complexes) -> None:
    """Add the inertia of the lumps."""
    lumps = lumps_of(gathered.structure.mechanism)
    first = inertia.shape[1] - 2 * len(lumps)
    for number, (at, lump) in enumerate(lumps):
        force, moment = inertia[:, first + 2 * number], inertia[:, first + 2 * number + 1].real
        arm = motion.direction[at][1:] * np.ravel(lump.offset)[0]
        gathered.points.append((at, lump.point, force, moment + cross(arm, force)))


def _of_effects(
    gathered: GatheredLoads, problem: Problem, x: Reals, x1: Reals, residual: ResidualResponse | None
) -> None:
    """Add the forces on displaced points."""
    if not problem.felt.effects:
        return
    kinds, grid = problem.terms.kinematics, problem.terms.grid
    moved = kinds.unit[1:] @ x[..., None]
    for effect in problem.felt.effects:
        places = effect[1:]
        cause = places.cause(moved)[:, 0]
        besides = 0.0 if residual is None else effect.cause(residual.moved)[1:, 0]
        amount = places.stiffness * (cause + besides)
        if effect.rubs:
            continue
        if np.any(places.damping):
            cause = effect.cause(kinds.unit)
            rate = (grid.rates(cause)[0] * x + cause[1:] * x1).sum(axis=-1)
            amount = amount + problem.speed * places.damping * rate
        for point, force, moment in places.loads(-amount):
            at, name = kinds.chosen[point]
            if name.startswith(UNDER):
                gathered.blocks.append((int(name.removeprefix(UNDER)), force, moment))
            else:
                gathered.points.append((at, name, force, moment))


def sliding_rates(problem: Problem, motion: Motion, x: Reals, x1: Reals) -> tuple[tuple[int, Reals, float], ...]:
    """Return the rates that vibration adds to joints with friction, see `AddedLoads.sliding`.

    They are those of the coordinates alone, because the residual response is smooth only between stick-slip events.
    """
    grid, kinds = problem.terms.grid, problem.terms.kinematics
    rates = []
    rubbing = friction_joints(motion.mechanism)
    for (number, _), row in zip(rubbing, sliding_rows(motion, kinds.chosen), strict=True):
        unit = row(kinds.unit)
        rate = (grid.rates(unit)[0] * x + unit[1:] * x1).sum(axis=-1)
        rates.append((number, problem.speed * rate, creep_rate(motion, number)))
    return tuple(rates)


def openings(
    gathered: GatheredLoads, motion: Motion, viscous: Reals
) -> tuple[tuple[Columns, ...], tuple[Columns, ...]]:
    """Return the openings of compliant joints that correspond to their damping forces, by joint."""
    structure = gathered.structure
    joints = joints_of(structure.mechanism).joints
    gaps: list[Columns] = [0.0] * len(joints)
    turns: list[Columns] = [0.0] * len(joints)
    first = len(structure.stiffness) - len(structure.soft)
    for number, freedom in enumerate(structure.soft):
        closed = -viscous[:, 3 * structure.weights.size + number] / structure.stiffness[first + number, first + number]
        if freedom.kind == "turn":
            turns[freedom.joint] = turns[freedom.joint] + closed
            continue
        way = way_of(freedom, motion)
        gaps[freedom.joint] = gaps[freedom.joint] + closed * np.broadcast_to(way, motion.columns)[1:]
    return tuple(gaps), tuple(turns)


def resampled(loads: AddedLoads, sampled: Callable[[Any], Any]) -> AddedLoads:
    """Convert loads to other instants; `sampled` converts values at the points of a grid, shape (points, k)."""
    columns = loads.q.shape[-1]
    pairs = [item[-2:] for item in (*loads.points, *loads.blocks, *loads.sliding, *loads.slides)] + list(
        zip(loads.gaps, loads.turns, strict=True)
    )
    along = [part for part in (loads.q, loads.strain, loads.section) if part is not None]
    first = sum(part[..., 0].size for part in along)
    given = np.empty((first + 2 * len(pairs), columns), complex)
    given[:first] = np.concatenate([part.reshape(-1, columns) for part in along])
    for row, value in enumerate((value for pair in pairs for value in pair), start=first):
        given[row] = value
    whole = sampled(given.T).T
    moved = iter(zip(whole[first::2], whole[first + 1 :: 2].real, strict=True))
    points = tuple((*item[:2], *next(moved)) for item in loads.points)
    blocks = tuple((item[0], *next(moved)) for item in loads.blocks)
    sliding = tuple((item[0], *next(moved)) for item in loads.sliding)
    slides = tuple((item[0], *next(moved)) for item in loads.slides)
    gaps, turns = zip(*moved, strict=True)
    ends = np.cumsum([part[..., 0].size for part in along])
    q, *others = (
        rows.reshape(*part.shape[:-1], whole.shape[-1])
        for part, rows in zip(along, np.split(whole[:first], ends[:-1]), strict=True)
    )
    strain = None if loads.strain is None else others.pop(0)
    section = None if loads.section is None else others.pop(0)
    return AddedLoads(q, points, blocks, gaps, turns, strain, section, sliding, slides)


def of_several_speeds(loads: Sequence[AddedLoads]) -> AddedLoads:
    """Combine the loads of several speeds, with columns (positions,), to columns (speeds, positions)."""
    count = loads[0].q.shape[-1]

    def side_by_side(*parts: Any) -> Numbers:
        return np.stack([np.broadcast_to(part, (*np.shape(part)[:-1], count)) for part in parts], axis=-2)

    return map_loads(side_by_side, *loads)
