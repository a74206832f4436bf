"""Errors of the time histories of fields and joint forces, computed from differences between answers."""

import math

import numpy as np

from elastic import Deflection, reference_deflection, sample
from elastic.links import members_of
from kinelast.figures.cycle import STATIONS, Cycle
from kinelast.figures.errors import TIME, Estimate
from rigid.arrays import Complexes, Numbers, Reals

COURSES, JOINT_FORCES = ("u", "w", "chord", "N", "M"), "joint forces"
FORCES = "N", "M", JOINT_FORCES  # time histories of forces
COMPARED_AT = np.linspace(0.0, 1.0, 5)  # stations at which time histories are compared
SMALL = 0.1  # smallest reference value of errors over time, relative to the largest of all beams or joints


def history_error(answer: Cycle, off: Estimate) -> float:
    """Return the largest error of any chord deflection over time, due to the theory of motion and time elements.

    It is relative to the `reference_deflection` of the beam's member. `--check nonlinear` measures this error.
    """
    chord = sample(answer.deflection, "chord", STATIONS)
    base = reference_deflection(_greatest_of_members(answer, chord))
    shares = math.fsum(off.shares.values())
    if not off.stages:
        return shares
    final = [*off.stages.values()][-1].deflection
    return shares + _greatest_share(chord, sample(final, "chord", STATIONS), base)


def course_errors(answer: Cycle, off: Estimate) -> dict[str, float]:
    """Return the largest errors of fields and joint forces over time, due to the theory of motion and time elements.

    Each error is relative to the largest value of its member or joint, but at least to `SMALL` times the largest value
    of all members or joints.
    """
    shares, errors = math.fsum(off.shares.values()), {}
    of_forces = shares + max(off.forces - off.shares.get(TIME, 0.0), 0.0)  # displacements converge faster than forces
    known = {name: of_forces if name in FORCES else shares for name in (*COURSES, JOINT_FORCES)}
    if not off.stages:
        return known
    bent, final = answer.deflection, [*off.stages.values()][-1].deflection
    for name in COURSES:
        values = sample(bent, name, COMPARED_AT)
        base = _greatest_of_members(answer, values)
        errors[name] = known[name] + _greatest_share(values, sample(final, name, COMPARED_AT), _not_small(base))
    forces, others = (_joint_forces(each) for each in (bent, final))
    base = np.nan_to_num(np.abs(forces)).max(axis=1, initial=0.0)
    return {**errors, JOINT_FORCES: known[JOINT_FORCES] + _greatest_share(forces, others, _not_small(base))}


def _greatest_of_members(answer: Cycle, values: Reals) -> Reals:
    """Return the largest magnitude in the member of each beam from values of shape (beams, positions, stations)."""
    greatest: Reals = np.nan_to_num(np.abs(values)).max(axis=(1, 2), initial=0.0)
    return members_of(answer.scene.mechanism).greatest(greatest)


def _not_small(greatest: Reals) -> Reals:
    """Return the reference values of relative errors, which are at least `SMALL` times the largest of all."""
    return np.maximum(greatest, SMALL * greatest.max(initial=0.0))


def _greatest_share(values: Numbers, others: Numbers, base: Reals) -> float:
    """Return the largest difference in any row, relative to the reference value of the row."""
    apart = np.nan_to_num(np.abs(others - values)).max(axis=tuple(range(1, values.ndim)), initial=0.0)
    return float(np.divide(apart, base, out=np.zeros_like(apart), where=base > 0.0).max(initial=0.0))


def _joint_forces(bent: Deflection) -> Complexes:
    """Return the complex joint forces [N], shape (joints, positions)."""
    columns = bent.motion.columns
    forces = [np.broadcast_to(np.asarray(force, complex), columns) for force in bent.forces.force]
    return np.reshape(np.array(forces, complex), (len(forces), *columns))
