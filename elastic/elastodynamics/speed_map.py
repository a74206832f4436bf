"""How the vibrating mechanism answers to the speed of its drives."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic.beams.section import JointCompliance, Section
from elastic.elastodynamics.equations_of_motion import Kinematics, kinematics
from elastic.elastodynamics.point_effects import chosen_points
from elastic.elastodynamics.reduction import near_modes, reduced_basis
from elastic.elastodynamics.solution import (
    NEUTRAL,
    Model,
    MotionAt,
    Vibration,
    checked,
    vibrating_model,
    vibration,
)
from elastic.elastodynamics.strains import Damping
from elastic.elastodynamics.time_elements import Grid
from elastic.elastodynamics.vibration_loads import of_several_speeds, resampled, vibration_loads
from elastic.links.added_loads import AddedLoads
from elastic.solution import Deflection, deflection
from rigid import Motion, with_rates
from rigid.chunks import columns_of, design_chunks
from rigid.kinematics import repeated

ELEMENTS = (12, 18, 27, 40, 60, 90, 135, 200, 300)
TOLERANCE = 1e-3
COARSER = 30.0
MULTIPLES = 6  # of the cycle's frequency, that are looked at where they meet a natural one
MORE_MODES = 2  # besides those near the lowest

Measure = Callable[[Deflection], Any]


@dataclass(frozen=True, eq=False)
class SpeedMap:
    """Answers at several speeds, each so many times that of the motion given.

    Attributes
    ----------
    ratio
        Speeds, shape (speeds,).
    values, quasi_static
        What was measured with and without vibration, shape (speeds, ...); nan where the steady state is unstable.
    growth
        Of the least stable free vibration over a cycle, shape (speeds,).
    unresolved
        What the elements of time leave open, as a share of the largest displacement, shape (speeds,).
    damping
        That was taken.
    omega
        Natural frequencies at some positions of the cycle, the drives held: the lowest [rad/s], shape (positions,).
    """

    ratio: Any
    values: Any
    quasi_static: Any
    growth: Any
    unresolved: Any
    damping: Damping
    omega: Any

    @property
    def stable(self) -> Any:
        """Where all free vibrations die out, bool, shape (speeds,)."""
        return self.growth <= 1 + NEUTRAL


def speed_map(
    motion_at: MotionAt,
    period: float,
    ratios: Sequence[float],
    sections: Sequence[Section],
    measure: Measure,
    joints: Mapping[str, JointCompliance] | None = None,
    damping: Damping | float | None = None,
    tolerance: float = TOLERANCE,
) -> SpeedMap:
    """Steady states at many speeds of the drives; positions, and what only they tell, are found once.

    Parameters
    ----------
    motion_at, period, sections, joints, damping
        As for `elastodynamic`, at the speed of ratio 1; the cycle begins at time 0.
    ratios
        Speeds, above 0.
    measure
        What is asked of a deflection at positions all over the cycle. It is given that of several speeds at once, whose
        columns are (speeds, positions), and returns shape (..., speeds): reduced over the positions, the last axis.
    tolerance
        Of the resolution in time, as a share of the largest displacement.

    Raises
    ------
    MechanismError, ValueError
        As for `elastodynamic`; nothing that vibrates; a speed that is not above 0.
    """
    speeds = np.asarray(ratios, float)
    if not (speeds > 0).all():
        raise ValueError(f"speeds from {speeds.min():g}, expected above 0")
    model = vibrating_model(motion_at, 0.0, period, sections, joints or {}, damping)
    if model.cycle is None:
        raise ValueError("nothing vibrates: all beams and joints are rigid")
    modes = min(near_modes(model.cycle) + MORE_MODES, len(model.cycle.values))
    cases = _Cases(model, reduced_basis(model.cycle, modes, float(np.sqrt(tolerance))), period)
    steady = [_at_speed(cases, ratio, tolerance) for ratio in speeds]
    values, plain = _measured(cases, steady, measure)
    growth, unresolved = (np.array([getattr(each, name) for each in steady]) for name in ("growth", "unresolved"))
    return SpeedMap(speeds, values, plain, growth, unresolved, model.damping, model.cycle.omega)


def critical_speeds(omega: Any, multiples: int = MULTIPLES) -> dict[int, tuple[float, float]]:
    """Between what speeds a multiple of the cycle's frequency runs through a natural frequency.

    Parameters
    ----------
    omega
        Natural frequencies over the cycle [rad/s], of one mode, as `SpeedMap.omega` has them, shape (positions,).
    multiples
        From 1 to this.

    Returns
    -------
    Per multiple the least and the greatest angular frequency of the cycle [rad/s].

    Examples
    --------
    >>> critical_speeds([600.0, 900.0], 2)
    {1: (600.0, 900.0), 2: (300.0, 450.0)}
    """
    least, most = float(np.min(omega)), float(np.max(omega))
    return {n: (least / n, most / n) for n in range(1, multiples + 1)}


class _Cases:
    """Positions and displacements at the nodes of grids, found when first asked for."""

    def __init__(self, model: Model, basis: Any, period: float) -> None:
        self.model, self.basis, self.period = model, basis, period
        self.known: dict[int, tuple[Motion, Kinematics]] = {}
        self.level = 0

    def grid(self) -> Grid:
        return Grid(np.linspace(0.0, self.period, ELEMENTS[self.level] + 1))

    def here(self) -> tuple[Motion, Kinematics]:
        if self.level not in self.known:
            motion = checked(self.model.motion_at(self.grid().nodes))
            chosen = chosen_points(self.model.structure.mechanism)
            self.known[self.level] = motion, kinematics(self.model.structure, motion, self.basis, chosen)
        return self.known[self.level]


@dataclass(frozen=True, eq=False)
class _Steady:
    """The steady state at one speed: on which grid, and the loads of the vibration there, none where it is unstable."""

    ratio: float
    level: int
    growth: float
    unresolved: float
    loads: AddedLoads | None


def _at_speed(cases: _Cases, ratio: float, tolerance: float) -> _Steady:
    """On the coarsest grid that resolves it."""
    model = cases.model
    while True:
        base, kinds = cases.here()
        plain = deflection(_passed(base, ratio), model.sections, model.joints)
        found = vibration(kinds, plain, Grid(cases.grid().edges / ratio), model.damping, None)
        unresolved = float(found.unresolved.max())
        if unresolved <= tolerance or cases.level == len(ELEMENTS) - 1:
            break
        cases.level += 1
    level = cases.level
    if unresolved < tolerance / COARSER:  # the next speed may do with less
        cases.level = max(level - 1, 0)
    growth = float(np.abs(found.propagation.multipliers).max())
    return _Steady(ratio, level, growth, unresolved, None if growth > 1 + NEUTRAL else _loads(found))


def _passed(base: Motion, ratio: Any) -> Motion:
    """The same cycle at another speed, or at several of shape (speeds, 1)."""
    if np.ndim(ratio):
        columns = np.broadcast_shapes(np.shape(ratio), base.columns)
        wide: dict[str, Any] = {
            name: np.broadcast_to(getattr(base, name)[:, None], (len(base.drive), *columns))
            for name in ("drive", "drive_rate", "drive_acceleration")
        }
        base = replace(repeated(base, columns), **wide)
    motion = with_rates(base, base.drive_rate * ratio, base.drive_acceleration * ratio**2)
    return replace(motion, time=base.time / ratio)


def _loads(found: Vibration) -> AddedLoads:
    """At the nodes of the grid, whose first is its last a cycle before."""
    loads = vibration_loads(found.problem, found.motion, found.history)
    return resampled(loads, lambda values: np.concatenate((values[-1:], values)))


def _measured(cases: _Cases, steady: Sequence[_Steady], measure: Measure) -> tuple[Any, Any]:
    """What is measured with and without vibration, shape (speeds, ...); nan where the steady state is unstable."""
    values: dict[_Steady, Any] = {}
    plain: dict[_Steady, Any] = {}
    for some in _on_one_grid(cases, steady):
        plain |= _together(cases, some, measure)
        stable = [each for each in some if each.loads]
        if stable:
            loads = of_several_speeds([each.loads for each in stable if each.loads])
            values |= _together(cases, stable, measure, loads)
    rows = [values.get(each, np.full_like(plain[each], np.nan)) for each in steady]
    return np.array(rows), np.array([plain[each] for each in steady])


def _on_one_grid(cases: _Cases, steady: Sequence[_Steady]) -> Iterator[Sequence[_Steady]]:
    """Steady states on the same grid, as many at a time as stay in the cache."""
    for level in {each.level for each in steady}:
        base, _ = cases.known[level]
        alike = [each for each in steady if each.level == level]
        count = base.columns[-1]
        for rows in design_chunks((len(alike),), count, columns_of(base.mechanism, count)):
            yield alike[rows]


def _together(
    cases: _Cases, some: Sequence[_Steady], measure: Measure, loads: AddedLoads | None = None
) -> dict[_Steady, Any]:
    """What is measured of steady states on one grid, in one deflection."""
    base, _ = cases.known[some[0].level]
    motion = _passed(base, np.array([[each.ratio] for each in some]))
    found = measure(deflection(motion, cases.model.sections, cases.model.joints, loads))
    return dict(zip(some, np.moveaxis(found, -1, 0), strict=True))
