"""Upper bound on load / critical load, for arrays of positions and designs.

The compression P of a span does work on its slopes. A slope is the rotation c of the chord plus the slope w' relative
to the chord. Since w is zero at both ends of the chord,

    P int (c + w')^2 dx = P L c^2 + P int w'^2 dx <= P L c^2 + (P/P_E + P/kGA) U,

where P_E is the Euler load of the pinned span and U twice its strain energy. The strain energies add up to that of the
mechanism. Hence the load ratio is at most max(P/P_E + P/kGA) plus the largest eigenvalue of the part due to the chords.
This part is a small matrix that contains the rotation of each chord due to a couple P L on another. Forces that turn
with their links add rows to it. Its Frobenius norm bounds the eigenvalue.

The work of the forces of a link is at most W, its largest P/P_E + P/kGA plus the diagonal elements of its rows. The
ratio of a link is the ratio of the mode times the link's work / the largest work of any link. The ratio of the mode is
the sum of the work of all links, so it is at most the largest work times the number of links with W > 0. The ratio of a
link is therefore at most this number times its W. The equations are in docs/theory.md.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.assessment.columns import compressions, euler_loads, least_shear_rigidity
from elastic.elastodynamics.displacements import UNDER, Points
from elastic.elastodynamics.point_effects import PointRow, chosen_points, point_effects
from elastic.links import spans_of
from elastic.links.added_loads import AddedLoads
from elastic.links.compatibility import bent_links, compatible_forces, problem_of, under_blocks
from elastic.links.configuration import ElasticProblem
from elastic.links.free_body import NO_DISPLACEMENT, resultants, with_points
from elastic.links.sliding_blocks import block_loads
from elastic.solution import Deflection
from rigid import JointForces, LineLoad
from rigid.arrays import Columns, Reals
from rigid.closures import displacements, joint_forces, self_stresses
from rigid.constants import per_row
from rigid.plane import ZERO, dot

PointLoad = tuple[int, str, Columns, Columns]
"""Link index, point name, force in ground axes [N], complex, and moment [N m]."""


@dataclass(frozen=True, eq=False)
class _ComponentRow:
    """Component of the displacements that contributes weight * component^2 to the work of the forces of a link.

    `loads` are the unit loads that do work on the component.
    """

    loads: tuple[PointLoad, ...]
    weight: Reals
    link: int


def buckling_bound(deflection: Deflection) -> Reals:
    """Return an upper bound on the load / critical load of each link, shape (links, ..., positions).

    It is nan at singular positions. It is inf if line loads turn with their beams, because no bound is known then.
    """
    mechanism, columns = deflection.motion.mechanism, deflection.motion.columns
    work = np.zeros((len(mechanism.links), *columns))
    if any(isinstance(load, LineLoad) and load.turning for load in mechanism.loads):
        return np.full(work.shape, np.inf)
    largest, chords = _spans(deflection, work)
    turned, beyond = _turned_points(deflection, work)
    whole, rows = largest + beyond, [row for row in (*chords, *turned) if np.any(row.weight > 0.0)]
    if rows:
        matrix = _responses(deflection, rows)
        for at, row in enumerate(rows):
            work[row.link] += matrix[at, at]
        square: Reals = (matrix * matrix.swapaxes(0, 1)).sum(axis=(0, 1))
        whole = whole + np.sqrt(np.maximum(square, 0.0))
    return np.minimum(whole, (work > 0.0).sum(axis=0) * work)


def _spans(deflection: Deflection, work: Reals) -> tuple[Reals, list[_ComponentRow]]:
    """Return the largest ratio of the compression of a span to its pinned critical load with shear, and the chord rows.

    The largest value of each link is added to its `work`, shape (links, ..., positions).
    """
    motion = deflection.motion
    mechanism, ndim = motion.mechanism, len(motion.columns)
    pressed = compressions(deflection)
    stiff = per_row([least_shear_rigidity(section) for section in deflection.sections], ndim, float)
    with np.errstate(invalid="ignore"):
        ratio = pressed / euler_loads(deflection) + pressed / stiff
    for at in {at for at, _ in mechanism.beams}:
        work[at] += ratio[[owner == at for owner, _ in mechanism.beams]].max(axis=0)
    chords = []
    for span in spans_of(mechanism).runs:
        at, first = mechanism.beams[span.beams[0]]
        last = mechanism.beams[span.beams[-1]][1]
        begin = first.end if span.turned[0] else first.start
        end = last.start if span.turned[-1] else last.end
        points = mechanism.links[at].points
        chord = motion.direction[at] * (points[end] - points[begin])
        across = 1j * chord / np.abs(chord) ** 2
        weight = pressed[span.beams[0]] * np.abs(chord)
        chords.append(_ComponentRow(((at, end, across, 0.0), (at, begin, -across, 0.0)), weight, at))
    return work.max(axis=0, initial=0.0), chords


def _turned_points(deflection: Deflection, work: Reals) -> tuple[list[_ComponentRow], Reals]:
    """Return the rows of forces on displaced points, and a bound for forces along one displacement due to another.

    A force of the second kind does the work 2 f c, which is at most |f| |c| + f c. The products are computed with the
    flexibility matrix. The bound is added to the `work` of both links.
    """
    chosen, rows = chosen_points(deflection.motion.mechanism), []
    pairs: dict[frozenset[int], Any] = {}
    effects = [
        effect for effect in point_effects(deflection, chosen) if not effect.elastic and np.any(effect.stiffness)
    ]
    for effect in effects:
        if effect.felt is effect.cause:
            weight = np.maximum(-effect.stiffness, 0.0)
            rows.append(_ComponentRow(_loads_of(effect.felt, chosen), weight, _link_of(effect.cause, chosen)))
        else:
            both = frozenset((id(effect.felt), id(effect.cause)))
            before = pairs[both][1] if both in pairs else 0.0
            pairs[both] = (effect.felt, effect.cause), before + np.abs(effect.stiffness)
    beyond = np.zeros(deflection.motion.columns)
    for both, stiffness in pairs.values():
        unit = np.ones(deflection.motion.columns)
        (own, across), (_, other) = _responses(
            deflection, [_ComponentRow(_loads_of(row, chosen), unit, _link_of(row, chosen)) for row in both]
        )
        bound = stiffness * (np.sqrt(np.maximum(own * other, 0.0)) + np.abs(across)) / 2
        beyond = beyond + bound
        for at in {_link_of(row, chosen) for row in both}:
            work[at] += bound
    return rows, beyond


def _link_of(row: PointRow, chosen: Points) -> int:
    """Return the index of the link to which the work on a component is assigned, see `buckling_ratio`."""
    return chosen[next(iter((*row.shares, *row.ways)))][0]


def _loads_of(row: PointRow, chosen: Points) -> tuple[PointLoad, ...]:
    """Return the unit loads that do work on a component; points of the ground do not move and are omitted."""
    forces = [(*chosen[point], way, 0.0) for point, way in row.ways.items()]
    moments = [(*chosen[point], 0.0, share) for point, share in row.shares.items()]
    return tuple(load for load in (*forces, *moments) if load[0])


def _responses(deflection: Deflection, rows: Sequence[_ComponentRow]) -> Reals:
    """Compute the component of each row due to the weighted loads of every row, shape (rows, rows, ..., positions)."""
    motion, sections = deflection.motion, deflection.sections
    problem = problem_of(motion, sections, deflection.joints).unloaded
    states = self_stresses(motion.closures, deflection.forces.flank)
    responses = np.empty((len(rows), len(rows), *motion.columns))
    for number, row in enumerate(rows):
        loads = tuple((at, point, row.weight * force, row.weight * moment) for at, point, force, moment in row.loads)
        moved = _displaced(problem, loads, deflection.forces.flank, states)
        for other, felt in enumerate(rows):
            work = (
                dot(force, move) + moment * turn
                for (*_, force, moment), (move, turn) in zip(felt.loads, map(moved, felt.loads), strict=True)
            )
            responses[other, number] = sum(work, start=np.zeros(motion.columns))
    return responses


def _displaced(
    problem: ElasticProblem, loads: tuple[PointLoad, ...], flank: Mapping[int, Columns], states: Sequence[JointForces]
) -> Callable[[PointLoad], tuple[Columns, Columns]]:
    """Return a function that gives the displacement and rotation of the point of a load under the given loads alone."""
    motion, trees = problem.motion, problem.configuration.trees
    no_gaps, zeros = (0.0,) * len(motion.places), [ZERO] * len(motion.mechanism.links)
    points = tuple(load for load in loads if not load[1].startswith(UNDER))
    blocks = tuple((_number(load), *load[2:]) for load in loads if load[1].startswith(UNDER))
    added = AddedLoads(problem.loads.q, points, blocks, no_gaps, no_gaps)
    problem = replace(problem, loads=replace(problem.loads, nodes=with_points({}, trees, points)), added=added)
    pull, twist = zeros[:], zeros[:]
    for at, force, moment in resultants(added, motion, problem.configuration):
        pull[at], twist[at] = pull[at] + force, twist[at] + moment
    forces = joint_forces(motion.closures, pull, twist, flank=flank)
    if states:
        forces = compatible_forces(problem, forces, bent_links(problem, forces)[1], states)
    response, gaps = bent_links(problem, forces)
    shifts, turning, _ = displacements(motion.closures, gaps.displacement, gaps.rotation, zeros, flank)
    rails = dict(zip(trees.rails, block_loads(motion, problem.configuration, forces, added), strict=True))

    def moved(load: PointLoad) -> tuple[Columns, Columns]:
        at, point, *_ = load
        angle = np.imag(turning[at])
        if point.startswith(UNDER):
            bent, arm = under_blocks(problem, response, rails[_number(load)]), motion.places[_number(load)].arm(at)
        else:
            bent = response.nodes.get((at, point), NO_DISPLACEMENT)
            arm = motion.direction[at] * motion.mechanism.links[at].points[point]
        return shifts[at] + 1j * angle * arm + bent[0], angle + bent[1]

    return moved


def _number(load: PointLoad) -> int:
    """Return the index of the slider joint with the block that applies a load."""
    return int(load[1].removeprefix(UNDER))
