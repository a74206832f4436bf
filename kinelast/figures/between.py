"""Results at instants between the positions of a run, because a peak may lie between two positions."""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from elastic.elastodynamics import Elastodynamic, deflection_at
from kinelast.figures.cycle import Cycle
from kinelast.scene.data import scene_deflection
from kinelast.values.error import SceneError
from rigid import Motion
from rigid.arrays import distinct

MAX_REFINED = 10_000  # no instants are added to runs with more positions than this
MAX_PHASE = 0.5  # [rad] largest phase of the lowest mode between two positions; above it, a peak may be missed


@dataclass(frozen=True, eq=False)
class Between:
    """Results of all theories at instants between the positions of a quasi-static cycle."""

    quasi_static: Cycle
    _vibrating: dict[int, Cycle] = field(default_factory=dict, init=False, repr=False)

    @cached_property
    def _motion(self) -> Motion | None:
        """The motion with added instants, or None if it cannot reach them or has too many positions."""
        times, course = self.quasi_static.motion.time, self.quasi_static.scene.course
        if len(times) > MAX_REFINED:
            return None
        try:
            return course.at(course.closer(times))
        except SceneError:
            return None

    @cached_property
    def _finer_quasi_static(self) -> Cycle:
        """The quasi-static results at the positions and at the instants between them."""
        assert self._motion is not None
        return self._sampled(self._motion, None)

    def _sampled(self, moved: Motion, vibrating: Elastodynamic | None) -> Cycle:
        scene = self.quasi_static.scene
        bent = deflection_at(vibrating, moved) if vibrating else scene_deflection(scene, moved)
        return Cycle(scene, moved, bent, sampled=True, between=True)

    def of(self, cycle: Cycle, vibrating: Elastodynamic | None) -> Cycle | None:
        """Return the results of `cycle` with instants added between its positions.

        Return None if there is only one position. The results are those of `vibrating`, or quasi-static if it is None.
        If no instants can be added, they are the results at the positions of `cycle`. In all cases, the largest values
        include an estimate of how much they increase between the instants.
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
        """Return whether free vibration may have a peak between two positions that is missed at both positions."""
        return bool(vibrating.lowest * np.diff(self.quasi_static.motion.time).max(initial=0.0) > MAX_PHASE)

    def _with_short_elements(self, moved: Motion, vibrating: Elastodynamic) -> Motion:
        """Return the motion with instants added at the nodes of short time elements.

        An element is short if it is shorter than the mean time step of the motion.
        """
        if vibrating.vibration is None:
            return moved
        grid, times, course = vibrating.vibration.problem.terms.grid, moved.time, self.quasi_static.scene.course
        fine = np.repeat(grid.steps < grid.stages * np.ptp(times) / len(times), grid.stages)
        points = grid.nodes[1:][fine]
        points = points[(points > times[0]) & (points < times[-1])]
        points = points[course.breaks.far(points)]
        return course.at(distinct(np.append(times, points))) if len(points) else moved
