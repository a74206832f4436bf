"""Which theory of motion answers a scene, and how far its answer is from the truth."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np

from elastic import Deflection, extremes
from elastic.assessment import euler_loads, harmonics, introduction_share, quasi_static_error, shear_share
from elastic.elastodynamics import (
    Damping,
    Elastodynamic,
    elastodynamic,
    large_displacement_error,
    theory_error,
    transient,
)
from elastic.vibration import natural_frequencies
from kinelast.scene.data import ELASTODYNAMIC, QUASI_STATIC, Scene, Theory
from kinelast.scene.error import SceneError
from kinelast.scene.motion import scene_motion_at
from rigid import MechanismError, Motion

SURE = 10.0  # times too low the cheap estimate hardly ever is: 2 of 142 mechanisms, docs/validity.md
HOPELESS = 1e3  # share of what small displacements leave out, beyond which vibration is not looked at
EPS = float(np.finfo(float).eps)


@dataclass(frozen=True, eq=False)
class Answer:
    """The deflection by the theory that was taken.

    Attributes
    ----------
    theory
        "quasi-static" or "elastodynamic".
    deflection, quasi_static
        The answer, and that of links that do not vibrate.
    vibrating
        The vibrating mechanism; None where it was not computed.
    errors
        What the answer may be off by, as shares of the largest deflection from the chord of the worst beam: of
        "vibration" (nan where it is not known), "large displacement", "beam theory", "time" and "round-off".
    accuracy
        That was asked for; None where it was not.
    missed
        What vibration changes of the quasi-static answer, as such a share; nan where that was not asked.
    """

    theory: str
    deflection: Deflection
    quasi_static: Deflection
    vibrating: Elastodynamic | None
    errors: Mapping[str, float]
    accuracy: float | None = None
    missed: float = math.nan

    @property
    def error(self) -> float:
        """All parts together, as if they added up; nan where one is not known."""
        return math.fsum(self.errors.values())

    @property
    def accurate(self) -> bool | None:
        """Whether the answer is as near as was asked for; None where nothing was asked."""
        return None if self.accuracy is None else self.error <= self.accuracy


def answer(scene: Scene, plain: Deflection, theory: Theory, period: float) -> Answer:
    """The answer of the theory asked for, or of the cheapest one that is accurate enough.

    Parameters
    ----------
    plain
        The quasi-static deflection at the positions of the run.
    period
        Duration of the cycle [s]; nan where the motion is none, and vibration starts from rest.

    Raises
    ------
    SceneError
        Vibration is asked for by name and cannot be answered: a singular position, a block that leaves its beam.
    """
    others = {} if theory.accuracy is None else _others(plain)
    if theory.accuracy is not None and not math.isnan(period):
        estimate = SURE * vibration_estimate(plain, period)
        if estimate + math.fsum(others.values()) <= theory.accuracy:
            errors = {"vibration": estimate, **others}
            return Answer(QUASI_STATIC, plain, plain, None, errors, theory.accuracy, estimate)
    unknown = Answer(QUASI_STATIC, plain, plain, None, {"vibration": math.nan, **others}, theory.accuracy)
    if others.get("large displacement", 0.0) > HOPELESS:
        return unknown
    try:
        found = _vibrating(scene, plain.motion, period)
    except SceneError:
        if theory.name:
            raise
        return unknown
    missed = float(theory_error(found).history.max())
    missed = math.inf if math.isnan(missed) else missed  # no steady state comes about
    if theory.accuracy is not None and missed + math.fsum(others.values()) <= theory.accuracy:
        return Answer(QUASI_STATIC, plain, plain, found, {"vibration": missed, **others}, theory.accuracy, missed)
    errors = {**_others(found.deflection), "time": found.time_error + found.reduction_error}
    return Answer(ELASTODYNAMIC, found.deflection, plain, found, errors, theory.accuracy, missed)


def vibration_estimate(plain: Deflection, period: float) -> float:
    """About what vibration changes of a quasi-static answer, as a share.

    From its harmonics and lowest frequency; and its axial forces over Euler's loads: by so much they stiffen or soften
    the beams, which the elastodynamic answer takes into account.
    """
    try:
        lowest = natural_frequencies(plain.motion, plain.sections, modes=1, positions=4, joints=plain.joints).lowest
    except np.linalg.LinAlgError:  # far from any machine's sizes
        return math.nan
    vibrates = quasi_static_error(harmonics(plain, period), lowest) if math.isfinite(lowest) else 0.0
    return vibrates + axial_share(plain)


def axial_share(plain: Deflection) -> float:
    """Greatest axial force of any beam, tension or compression, over Euler's load of that beam."""
    share = np.abs(extremes(plain, ["N"])["N"].value) / euler_loads(plain)
    return float(share[np.isfinite(share)].max(initial=0.0))


def _others(bent: Deflection) -> dict[str, float]:
    """What either theory leaves out."""
    condition = bent.condition[np.isfinite(bent.condition)]
    beams = np.maximum(shear_share(bent), introduction_share(bent))
    return {
        "large displacement": large_displacement_error(bent),
        "beam theory": float(beams.max(initial=0.0)),
        "round-off": EPS * float(condition.max(initial=1.0)),
    }


def damping_of(scene: Scene) -> Damping:
    """beta of every beam whose material tells it, and the damping ratio for the others."""
    theory = scene.theory
    return Damping(np.array(theory.damping or (math.nan,) * len(scene.labels)), ratio=theory.damping_ratio)


def _vibrating(scene: Scene, motion: Motion, period: float) -> Elastodynamic:
    motion_at = partial(scene_motion_at, scene)
    given = scene.sections, scene.joints, damping_of(scene)
    try:
        if math.isnan(period):
            return transient(motion, motion_at, *given)
        return elastodynamic(motion, motion_at, period, *given)
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "run", "theory", f"vibration cannot be answered: {error}") from None
