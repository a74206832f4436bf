"""Response of the vibrating mechanism as a function of drive speed."""

import math
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from msgspec import Struct
from msgspec.structs import replace

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.discretization import Model, MotionAt, checked, first_discretization, vibrating_model
from elastic.elastodynamics.speed_scan import SpeedScan, speed_scan
from elastic.elastodynamics.speed_settings import SPEEDS
from elastic.elastodynamics.speed_states import (
    Errors,
    ErrorTask,
    GridHierarchy,
    SteadyState,
    motion_at_speed,
    steady_state,
)
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.time_grid import Grid
from elastic.elastodynamics.vibration_loads import of_several_speeds, resampled
from elastic.elastodynamics.vibration_settings import VIBRATION
from elastic.solution import Deflection, deflection
from rigid import Motion
from rigid.arrays import Flags, Reals
from rigid.chunks import columns_of, design_chunks

TOLERANCE = 2e-3

OneSpeed = Callable[[int], Deflection]
Measure = Callable[[Deflection, OneSpeed], Any]


class SpeedMap(Struct, frozen=True, eq=False):
    """Results at several drive speeds.

    Attributes
    ----------
    ratio
        Speeds, relative to the speed of the given motion, shape (speeds,).
    values
        Measures of the vibrating mechanism (see `SpeedSolutions`), shape (speeds, ...); nan if the steady state is
        unstable.
    quasi_static
        Measures of the quasi-static deflection (without vibration), shape (speeds, ...).
    growth
        Factor by which the least stable free vibration grows per cycle, shape (speeds,).
    time_error, reduction_error
        Convergence errors (see `Elastodynamic`), shape (speeds,). `reduction_error` is nan if the steady state is
        unstable.
    errors
        Errors of `values`, shape (speeds, ...). They are nan if errors were not requested, or if the steady state is
        unstable. With many speeds, errors are computed only at every third speed, or at even fewer speeds. Between
        these speeds, the ratio (error / value) is interpolated.
    damping
        Kelvin-Voigt damping, in which default values are replaced by numbers.
    omega
        Lowest natural frequency with locked drives at some positions of the cycle [rad/s], shape (positions,).
    """

    ratio: Reals
    values: Reals
    quasi_static: Reals
    growth: Reals
    time_error: Reals
    reduction_error: Reals
    errors: Reals
    damping: Damping
    omega: Reals

    @property
    def error(self) -> Reals:
        """Total convergence error, relative to the largest displacement, shape (speeds,)."""
        return self.time_error + self.reduction_error

    @property
    def stable(self) -> Flags:
        """True if no free vibration grows (except due to round-off), shape (speeds,)."""
        return np.asarray(VIBRATION.stable(self.growth), bool)


class SpeedSolutions:
    """Steady states at many drive speeds. Terms that do not depend on the speed are computed only once.

    Each call of `find` adds solutions at further speeds. All speeds share the same time grids and coordinates. These
    are refined if one of the speeds requires it.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        See `elastodynamic`. They describe the motion at relative speed 1. The cycle begins at time 0.
    measure
        Function that computes the quantities of interest (measures) from a deflection over the cycle, as an array of
        shape (..., speeds). The columns of the deflection have the shape (speeds, positions). Positions are in the
        order of time, and the last one is the end of the cycle. The function gets a second argument. This is a function
        that returns the deflection at a single speed, given the index of the speed, with columns of shape (positions,).
    tolerance
        Largest accepted convergence error, relative to the largest displacement.
    quasi_static_measure
        Function that computes the measures of the quasi-static deflection, by default `measure`.
    errors
        Function that returns the errors of the measures, see `Errors` in speed_states.py.
    on_speed
        Function that is called with the number of finished speeds and the total number of speeds.
    resolved
        If the bound on the convergence error exceeds this value, the error is measured with a finer discretization.

    Attributes
    ----------
    least_damping
        Estimate of the smallest damping ratio of a natural mode. The width of the resonance peak of the mode, relative
        to the speed, is twice this value.

    Raises
    ------
    MechanismError, ValueError
        See `elastodynamic`. ValueError is also raised if no link vibrates.
    """

    def __init__(
        self,
        motion_at: MotionAt,
        period: float,
        sections: Sequence[Section],
        measure: Measure,
        joints: Mapping[str, JointCompliance] | None = None,
        damping: Damping | float | None = None,
        tolerance: float = TOLERANCE,
        quasi_static_measure: Measure | None = None,
        errors: Errors | None = None,
        on_speed: Callable[[int, int], None] | None = None,
        resolved: float = 0.0,
    ) -> None:
        model = vibrating_model(motion_at, 0.0, period, sections, joints or {}, damping)
        if model.cycle is None:
            raise ValueError("nothing vibrates: all beams and joints are rigid or without mass")
        self.damping, self.omega = model.damping, model.cycle.omega
        betas = [*model.damping.beams[model.damping.beams > 0], *([model.damping.joints] * (model.damping.joints > 0))]
        self.least_damping = float(min(betas, default=0.0) * self.omega.min() / 2)
        self._measure, self._quasi_static_measure, self._tolerance = measure, quasi_static_measure or measure, tolerance
        self._errors = None if errors is None else ErrorTask(errors, resolved)
        self._on_speed = on_speed or (lambda done, of: None)
        grids = [Grid(np.linspace(0.0, period, SPEEDS.first_elements + 1))]
        self._hierarchy = GridHierarchy(first_discretization(model, tolerance), grids)
        self._rows: dict[float, _Row] = {}

    def find(self, ratios: Sequence[float]) -> None:
        """Compute solutions at further relative speeds, and refine the discretization until they have converged.

        Raise ValueError if a speed is not positive.
        """
        if not all(ratio > 0 for ratio in ratios):
            raise ValueError(f"relative speed {min(ratios):g}: expected a speed above 0")
        left = sorted({float(ratio) for ratio in ratios} - self._rows.keys())
        for _ in range(VIBRATION.max_refinements):
            hierarchy, resolved = self._hierarchy, self._hierarchy.time_tolerance
            for first in range(0, len(left), SPEEDS.loads_in_memory):
                part = left[first : first + SPEEDS.loads_in_memory]
                every = (
                    max(SPEEDS.error_stride, math.ceil(len(part) / SPEEDS.max_errors)) if len(part) > SPEEDS.many else 1
                )
                steady = []
                for number, ratio in enumerate(part):
                    self._on_speed(first + number, len(left))
                    steady.append(
                        steady_state(hierarchy, ratio, self._tolerance, None if number % every else self._errors)
                    )
                self._rows |= _measured(hierarchy, steady, self._measure, self._quasi_static_measure)
            errors = {ratio: self._rows[ratio].reduction_error for ratio in left}
            left = [
                ratio
                for ratio, error in errors.items()
                if error > self._tolerance and self._rows[ratio].time_error <= resolved
            ]
            finer = hierarchy.discretization.finer(max(errors[ratio] for ratio in left)) if left else None
            if finer is None:
                break
            self._hierarchy = GridHierarchy(finer, hierarchy.grids)

    def refine_errors(self, ratio: float) -> bool:
        """Compute the errors at a known speed again, using Newton's method for the effect of large displacement.

        Nothing is computed if errors are not required, the steady state is unstable, or the known errors already
        include the whole effect. Return whether errors were computed.
        """
        row = self._rows[ratio]
        if self._errors is None or not VIBRATION.stable(row.growth) or (row.measured and not row.remaining_change):
            return False
        steady = steady_state(self._hierarchy, ratio, self._tolerance, replace(self._errors, by_newton=True))
        assert steady.errors is not None
        self._rows[ratio] = replace(row, errors=steady.errors, measured=True, remaining_change=0.0)
        return True

    def map(self, ratios: Sequence[float] | None = None) -> SpeedMap:
        """Return the results at all known speeds, or only at the speeds `ratios`."""
        known = sorted(self._rows) if ratios is None else [float(ratio) for ratio in ratios]
        rows = [self._rows[ratio] for ratio in known]
        parts = {name: np.array([getattr(row, name) for row in rows]) for name in _Row.__match_args__}
        gaps = VIBRATION.stable(parts["growth"]) & np.array([not row.measured for row in rows], bool)
        measured = sorted(ratio for ratio, row in self._rows.items() if row.measured)
        if gaps.any() and measured:
            relative = np.array(
                [_relative_errors(self._rows[ratio].errors, self._rows[ratio].values) for ratio in measured]
            )
            parts["errors"][gaps] = parts["values"][gaps] * _interpolated(np.array(known)[gaps], measured, relative)
        del parts["measured"], parts["remaining_change"]
        return SpeedMap(np.array(known), **parts, damping=self.damping, omega=self.omega)

    def stable(self, ratio: float) -> bool:
        """Return whether the steady state at a speed is stable."""
        return bool(VIBRATION.stable(self._hierarchy.growth(ratio)))

    def scan(self) -> SpeedScan:
        """Set up a scan of speeds between the smallest and the largest known speed, on the finest grid."""
        hierarchy, ends = self._hierarchy, (min(self._rows), max(self._rows))
        hierarchy.level = len(hierarchy.grids) - 1
        problems = [hierarchy.problem(ratio) for ratio in (ends[0], math.sqrt(ends[0] * ends[1]), ends[1])]
        return speed_scan(hierarchy.current()[0], problems, ends[1])


def stable_below(
    motion_at: MotionAt,
    period: float,
    sections: Sequence[Section],
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
) -> float:
    """Find the speed below which the steady state is stable, for a cycle that is unstable at relative speed 1.

    Speeds from 100 % down to 30 % are checked in steps of 1 % (see `SpeedSettings`). The limit below the lowest
    unstable speed is then located by bisection. Unstable ranges that are narrower than a step may be missed.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        See `elastodynamic`.

    Returns
    -------
    Relative speed with an accuracy of 1/16 of a step. The result is nan if even the lowest checked speed is unstable,
    and 1 if no checked speed is unstable.
    """
    solutions = SpeedSolutions(motion_at, period, sections, _no_measure, joints, damping)
    solutions.find([1.0])
    ratios = np.arange(1.0, SPEEDS.min_stability_speed, -SPEEDS.stability_step)
    unstable = [float(ratio) for ratio in ratios if not solutions.stable(float(ratio))]
    if not unstable or unstable[-1] == ratios[-1]:
        return math.nan if unstable else 1.0
    low, high = unstable[-1] - SPEEDS.stability_step, unstable[-1]
    while high - low > SPEEDS.stability_step / 16:
        middle = (low + high) / 2
        low, high = (middle, high) if solutions.stable(middle) else (low, middle)
    return low


def _no_measure(bent: Deflection, _: OneSpeed) -> Reals:
    return np.zeros((1, *bent.motion.columns[:-1]))


def critical_speeds(omega: Reals, multiples: int = SPEEDS.harmonics) -> dict[int, tuple[float, float]]:
    """Return for each harmonic of the cycle the range of speeds at which it equals a natural frequency.

    The natural frequency depends on the position. A speed is in the range if both are equal at some position.

    Parameters
    ----------
    omega
        Natural frequencies of one mode over the cycle (see `SpeedMap.omega`) [rad/s], shape (positions,).
    multiples
        Largest harmonic.

    Returns
    -------
    For each harmonic, by number, the smallest and largest angular frequency of the cycle [rad/s].

    Examples
    --------
    >>> critical_speeds([600.0, 900.0], 2)
    {1: (600.0, 900.0), 2: (300.0, 450.0)}
    """
    least, most = float(np.min(omega)), float(np.max(omega))
    return {n: (least / n, most / n) for n in range(1, multiples + 1)}


class _Row(Struct, frozen=True, eq=False):
    """Entry of a map for one speed.

    `measured` is True if `errors` were computed. For `remaining_change` see `SteadyState`.
    """

    values: Reals
    quasi_static: Reals
    growth: float
    time_error: float
    reduction_error: float
    errors: Reals
    measured: bool
    remaining_change: float


def _relative_errors(errors: Any, values: Any) -> Reals:
    """Return errors / values, or 0 for values that are not positive."""
    return np.divide(errors, values, out=np.zeros_like(values), where=values > 0.0)


def _interpolated(at: Reals, known: Sequence[float], values: Reals) -> Reals:
    """Interpolate values linearly from the speeds `known`, shape (known, columns), to `at`, shape (at, columns)."""
    return np.stack([np.interp(at, known, column) for column in values.T], axis=-1)


def _measured(
    hierarchy: GridHierarchy, steady: Sequence[SteadyState], measure: Measure, quasi_static_measure: Measure
) -> dict[float, _Row]:
    """Compute the measures with and without vibration. Those with vibration are nan if the steady state is unstable.

    The positions are evenly spaced. Their number is the number of points of the finest grid among the steady states.
    """
    count = max(len(each.grid.nodes) - 1 for each in steady)
    times = hierarchy.grids[0].edges[-1] * np.arange(1, count + 1) / count
    base = checked(hierarchy.model.motion_at(times))
    rows: dict[float, _Row] = {}
    for part in design_chunks((len(steady),), count, columns_of(base.mechanism, count)):
        some = steady[part]
        quasi_static = _measures(hierarchy.model, base, some, quasi_static_measure)
        stable = [row for row, each in enumerate(some) if each.loads]
        known = _measures(hierarchy.model, base, [some[k] for k in stable] or some[:1], measure, bool(stable))
        values = np.full((len(some), *known.shape[1:]), np.nan)
        if stable:
            values[stable] = known
        for row, each in enumerate(some):
            rows[each.ratio] = _Row(
                values[row],
                quasi_static[row],
                each.growth,
                each.time_error,
                each.reduction_error,
                np.full(values.shape[1:], np.nan) if each.errors is None else each.errors,
                each.errors is not None,
                each.remaining_change,
            )
    return rows


def _measures(
    model: Model, base: Motion, some: Sequence[SteadyState], measure: Measure, vibrating: bool = False
) -> Reals:
    """Return the measures of several steady states, from a single computation of the deflection at all their speeds.

    If not `vibrating`, the deflection is quasi-static.
    """
    motion = motion_at_speed(base, np.array([[each.ratio] for each in some]))
    loads = []
    if vibrating:
        loads = [resampled(each.loads, each.grid.sampler(base.time)) for each in some if each.loads]
    bent = deflection(motion, model.sections, model.joints, of_several_speeds(loads) if loads else None)

    def alone(number: int) -> Deflection:
        own = loads[number] if loads else None
        return deflection(motion_at_speed(base, some[number].ratio), model.sections, model.joints, own)

    return np.moveaxis(measure(bent, alone), -1, 0)
