"""The course of a scene with a drive that is an effort: its motion is integrated."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from kinelast.scene.course import Course, OnStep, of_scene
from kinelast.scene.drives import DriveEffort
from rigid import Motion, Reals
from rigid.chunks import columns_of
from rigid.dynamics import INTERRUPTED, ForwardError, IntegratedMotion, forward, motion_during


@dataclass(frozen=True, eq=False)
class IntegratedCourse(Course):
    """A course with a drive that is an effort: its motion is integrated over the run, once, when it is asked for.

    Attributes
    ----------
    on_step
        Called with the time [s] that is reached after every step.
    """

    on_step: OnStep | None = None

    def telling(self, on_step: OnStep) -> Course:
        """The same course, not yet integrated."""
        return replace(self, on_step=on_step)

    @cached_property
    def integrated(self) -> tuple[IntegratedMotion, ForwardError | None]:
        """The motion, and the error that stops it where it cannot go on to the end of the run.

        Raises
        ------
        SceneError
            It cannot begin.
        """
        drives = [law.effort if isinstance(law, DriveEffort) else law for law in self.laws]
        begin = [(law.start, law.speed) if isinstance(law, DriveEffort) else (0.0, 0.0) for law in self.laws]
        start, rate = zip(*begin, strict=True)
        run = self.run
        with of_scene(self.path, self.mechanism):
            try:
                way = run.duration, run.tolerance, run.steps, self.on_step
                return forward(self.mechanism, drives, start, rate, *way), None
            except ForwardError as error:
                if error.course is None:
                    raise
                return error.course, error

    @property
    def span(self) -> tuple[float, float]:
        """Times between which the motion is integrated [s]."""
        return 0.0, float(self.integrated[0].time[-1])

    @property
    def interrupted(self) -> float | None:
        """Up to which time a user let the motion be integrated [s]."""
        stop = self.integrated[1]
        return float(stop.time) if stop is not None and stop.kind == INTERRUPTED else None

    def at(self, times: Any) -> Motion:
        """The motion at any instants."""
        times = np.asarray(times, float)
        with of_scene(self.path, self.mechanism):
            return motion_during(self._until(times), times)

    def chunks(self, times: Reals) -> Iterator[Motion]:
        """The motion, chunk by chunk."""
        with of_scene(self.path, self.mechanism):
            step, whole = columns_of(self.mechanism, len(times)), self._until(times)
            yield from (motion_during(whole, times[k : k + step]) for k in range(0, len(times), step))

    def reached(self, times: Reals) -> Reals:
        """Instants that the integration reaches."""
        return np.asarray(times[times <= self.integrated[0].time[-1]])

    def _until(self, times: Reals) -> IntegratedMotion:
        """The integrated motion; raises the error that stops it before the last of some instants."""
        whole, stop = self.integrated
        if stop is not None and times.max(initial=0.0) > whole.time[-1]:
            raise stop
        return whole
