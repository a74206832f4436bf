"""Results at instants between the positions of a run, because peaks may be larger there."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from elastic.elastodynamics import Elastodynamic, deflection_at
from kinelast.figures.cycle import Cycle
from kinelast.scene.data import scene_deflection
from kinelast.scene.error import SceneError
from rigid import Motion

MAX_REFINED = 10_000  # largest number of positions for which instants between them are computed
MAX_PHASE = 0.5  # [rad] phase of the lowest natural frequency between positions up to which no vibration peak is missed


@dataclass(frozen=True, eq=False)
class Between:
    """Results of all theories at instants between the positions of a quasi-static cycle."""

    quasi_static: Cycle
    _vibrating: dict[int, Cycle] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _motion(self) -> Motion | None:
        """Return the motion with instants between the positions, or None if these cannot be reached or are too many."""
        times, course = self.quasi_static.motion.time, self.quasi_static.scene.course
        if len(times) > MAX_REFINED:
            return None
        try:
            return course.at(course.closer(times))
        except SceneError:
            return None

    @cached_property
    def _finer_quasi_static(self) -> Cycle:
        """Return the quasi-static results with instants between the positions."""
        assert self._motion is not None
        return self._sampled(self._motion, None)

    def _sampled(self, moved: Motion, vibrating: Elastodynamic | None) -> Cycle:
        scene = self.quasi_static.scene
        bent = deflection_at(vibrating, moved) if vibrating else scene_deflection(scene, moved)
        return Cycle(scene, moved, bent, sampled=True, between=True)

    def of(self, cycle: Cycle, vibrating: Elastodynamic | None) -> Cycle | None:
        """Return the results of a cycle with instants between its positions, or None for a single position.

        They are quasi-static if `vibrating` is None.
        """
        motion = self.quasi_static.motion
        if np.shape(motion.time) != motion.columns or len(motion.time) < 2:
            return None
        if self._motion is None:
            return replace(cycle, between=True, _known={}, quasi_static=self.quasi_static)
        if vibrating is None:
            return self._finer_quasi_static
        if id(vibrating) not in self._vibrating:
            self._vibrating[id(vibrating)] = self._sampled(
                self._with_short_elements(self._motion, vibrating), vibrating
            )
        return self._vibrating[id(vibrating)]

    def may_peak(self, vibrating: Elastodynamic) -> bool:
        """Return whether a link may vibrate to a peak and back between two positions."""
        return bool(vibrating.lowest * np.diff(self.quasi_static.motion.time).max(initial=0.0) > MAX_PHASE)

    def _with_short_elements(self, moved: Motion, vibrating: Elastodynamic) -> Motion:
        """Return the motion, adding the nodes of time elements wherever they are closer together than its instants."""
        if vibrating.vibration is None:
            return moved
        grid, times, course = vibrating.vibration.problem.terms.grid, moved.time, self.quasi_static.scene.course
        fine = np.repeat(grid.steps < grid.stages * np.ptp(times) / len(times), grid.stages)
        points = grid.nodes[1:][fine]
        points = points[(points > times[0]) & (points < times[-1])]
        points = points[course.breaks.far(points)]
        return course.at(np.unique(np.append(times, points))) if len(points) else moved
