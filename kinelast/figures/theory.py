"""Which theory of motion answers a scene, and how far its answer is from the truth."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from elastic import Deflection, cycle_maxima, reference_deflection, sample
from elastic.assessment import introduction_share, shear_share
from elastic.elastodynamics import (
    Damping,
    Elastodynamic,
    TheoryError,
    elastodynamic,
    geometrically_exact,
    theory_error,
    transient,
)
from elastic.links import members_of
from kinelast.figures.cycle import too_many_beams
from kinelast.scene.data import ELASTODYNAMIC, GEOMETRICALLY_EXACT, QUASI_STATIC, Scene, Theory
from kinelast.scene.error import SceneError
from kinelast.scene.numbers import number
from kinelast.tasks.progress import one_thread
from rigid import MechanismError, Motion

ACCURACY = 0.05  # where none is asked for
TOLERANCE = 1e-4  # of the elastodynamic answer, in time and in its coordinates
SETTLED = 0.004  # of the accuracy, that being allowed to be coarser: the worst beam may bend a hundredth of the largest
FINE = 0.02  # of the accuracy, that being finer than the tolerance
LEFT = ("beam theory", "round-off")  # parts that no theory of motion changes
BESIDES = 0.1  # of the accuracy: what is not worth answering where others hold the accuracy back
HOPELESS = 4.0  # radians of a section's rotation, beyond which vibration is not looked at
EPS, TINY = float(np.finfo(float).eps), float(np.finfo(float).tiny)
STATIONS = 21  # along a beam, at which deflections are looked at


@dataclass(frozen=True, eq=False)
class Answer:
    """The deflection by the theory that was taken.

    Attributes
    ----------
    theory
        "quasi-static", "elastodynamic" or "geometrically-exact".
    deflection, quasi_static
        The answer, and that of links that do not vibrate.
    vibrating
        The vibrating mechanism; None where it was not computed.
    errors
        What the answer may be off by, as shares of the largest deflection from the chord of the worst beam: of
        "vibration" and "large displacement" (nan where it is not known), "beam theory", "time" and "round-off".
    accuracy
        That was asked for; None where it was not.
    missed
        What vibration changes of the quasi-static answer, as such a share; nan where that is not known.
    unanswered
        Why vibration cannot be answered; nothing where it is.
    """

    theory: str
    deflection: Deflection
    quasi_static: Deflection
    vibrating: Elastodynamic | None
    errors: Mapping[str, float]
    accuracy: float | None = None
    missed: float = math.nan
    unanswered: str = ""

    @property
    def error(self) -> float:
        """All parts together, as if they added up; nan where one is not known."""
        return math.fsum(self.errors.values())

    @property
    def unknown(self) -> str:
        """Reason why nobody knows how far the answer is off; empty where that is known."""
        if not math.isnan(self.error):
            return ""
        if not self.unanswered and self.vibrating and not self.vibrating.stable:
            grown = number(self.vibrating.growth, 3)
            return f"the links have no steady state, their vibration grows by {grown} every cycle"
        return self.unanswered or "vibration is not known"

    @property
    def accurate(self) -> bool | None:
        """Whether the answer is as near as was asked for; None where nothing was asked."""
        return None if self.accuracy is None else self.error <= self.accuracy


@one_thread()
def answer(scene: Scene, plain: Deflection, theory: Theory, period: float, only_told: bool = False) -> Answer:
    """The answer of the theory asked for, or of the cheapest one that is accurate enough.

    Parameters
    ----------
    plain
        The quasi-static deflection at the positions of the run.
    period
        Duration of the cycle [s]; nan where the motion is none, and vibration starts from the quasi-static deflection.
    only_told
        The quasi-static answer is taken however far it is off.

    Raises
    ------
    SceneError
        What is asked for by name cannot be answered: a singular position, a block that leaves its beam, a gear.
    """
    wanted = ACCURACY if theory.accuracy is None else theory.accuracy
    named = theory.name is not None
    if not named and np.nanmax(cycle_maxima(plain, ["phi"])["phi"].value, initial=0.0) > HOPELESS:
        return _unknown(plain, theory, "vibration is not looked at where links turn by so much")
    tolerance = TOLERANCE if named else max(min(TOLERANCE, FINE * wanted), SETTLED * wanted)
    if scene.mechanism.friction:
        tolerance = max(tolerance, FINE * wanted)
    try:
        linear = _vibrating(scene, plain.motion, period, tolerance)
        if not named and linear.time_error + linear.reduction_error > max(wanted, ACCURACY):
            fine = (
                "friction sticks too hard to be settled"
                if scene.mechanism.friction
                else "it is too fine to be resolved"
            )
            raise SceneError(scene.path, "run", "theory", f"vibration cannot be answered: {fine}")
    except SceneError as error:
        if named:
            raise
        return _unknown(plain, theory, error.problem)
    rungs: list[Answer] = []
    for rung in _rungs(scene, plain, linear, theory, tolerance):
        if only_told or (not named and (_enough(rung, wanted) or not linear.stable)) or rung.theory == theory.name:
            return rung
        rungs.append(rung)
    return min(reversed(rungs), key=lambda rung: math.inf if math.isnan(rung.error) else rung.error)


def _rungs(
    scene: Scene, plain: Deflection, linear: Elastodynamic, theory: Theory, tolerance: float
) -> Iterator[Answer]:
    """The answers of all theories, from the cheapest to the finest.

    Raises
    ------
    SceneError
        Large displacement is asked for by name and cannot be answered: a gear, a slider along a link that bends.
    """
    off = theory_error(linear)
    missed = float(off.history.max(initial=0.0))
    missed = math.inf if math.isnan(missed) else missed  # no steady state comes about
    of_plain = {"vibration": missed, "large displacement": off.large_displacement, **_others(plain)}
    yield Answer(QUASI_STATIC, plain, plain, linear, of_plain, theory.accuracy, missed)
    yield _vibrating_answer(ELASTODYNAMIC, linear, off, theory)
    try:
        exact = geometrically_exact(linear, tolerance)
    except MechanismError as error:
        if theory.name == GEOMETRICALLY_EXACT:
            raise SceneError(scene.path, "run", "theory", f"large displacement cannot be answered: {error}") from None
    else:
        yield _vibrating_answer(GEOMETRICALLY_EXACT, exact, theory_error(exact), theory)


def _vibrating_answer(name: str, vibrating: Elastodynamic, off: TheoryError, theory: Theory) -> Answer:
    large, settled = off.large_displacement, vibrating.time_error + vibrating.reduction_error
    errors = {"large displacement": large, **_others(vibrating.deflection), "time": settled}
    missed = float(off.history.max(initial=0.0))
    missed = math.inf if math.isnan(missed) else missed
    return Answer(name, vibrating.deflection, vibrating.quasi_static, vibrating, errors, theory.accuracy, missed)


def _enough(rung: Answer, wanted: float) -> bool:
    """Whether a finer theory would not help: the accuracy is reached, or the error that it could take away is small."""
    left = math.fsum(share for name, share in rung.errors.items() if name in LEFT)
    return rung.error - left <= max(wanted - left, BESIDES * wanted)


def _unknown(plain: Deflection, theory: Theory, why: str) -> Answer:
    errors = {"vibration": math.nan, "large displacement": math.nan, **_others(plain)}
    return Answer(QUASI_STATIC, plain, plain, None, errors, theory.accuracy, unanswered=why)


def _others(bent: Deflection) -> dict[str, float]:
    """Errors of both theories: of beam theory, and round-off."""
    beams = np.maximum(shear_share(bent), introduction_share(bent))
    return {
        "beam theory": float(beams.max(initial=0.0)),
        "round-off": _round_off(bent),
    }


def _round_off(bent: Deflection) -> float:
    """Round-off, as a share of the largest deflection: EPS times a position's condition, 1 at most, times its share."""
    chord = np.abs(sample(bent, "chord", np.linspace(0.0, 1.0, STATIONS))).max(axis=-1)
    known = np.isfinite(bent.condition) & np.isfinite(chord).all(axis=0)
    chord, condition = chord[:, known], bent.condition[known]
    greatest = members_of(bent.motion.mechanism).greatest(chord.max(axis=1, initial=0.0))
    share = (chord / np.maximum(reference_deflection(greatest), TINY)[:, None]).max(axis=0, initial=0.0)
    return max(EPS, float((np.minimum(EPS * condition, 1.0) * share).max(initial=0.0)))


def damping_of(scene: Scene) -> Damping:
    """Damping of every beam: beta where its material gives it, the damping ratio for the others."""
    theory = scene.theory
    return Damping(np.array(theory.damping or (math.nan,) * len(scene.labels)), ratio=theory.damping_ratio)


def _vibrating(scene: Scene, motion: Motion, period: float, tolerance: float) -> Elastodynamic:
    given = scene.sections, scene.joints, damping_of(scene), tolerance
    if many := too_many_beams(scene.mechanism):
        raise SceneError(scene.path, "run", "theory", many)
    try:
        if math.isnan(period):
            return transient(motion, scene.course.at, *given)
        return elastodynamic(motion, scene.course.at, period, *given)
    except (MechanismError, ValueError) as error:
        raise SceneError(scene.path, "run", "theory", f"vibration cannot be answered: {error}") from None
