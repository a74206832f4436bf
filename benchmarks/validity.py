"""How well the program's own error estimates hold: random mechanisms against the nonlinear check and solid links.

    python benchmarks/validity.py [seconds]    (goes on where results/validity.csv ends; without that file, anew)

Sections have no rotary inertia and no shear, so that the beams of both sides are the same, and what differs is the
theory of motion. docs/validity.md says what came out.
"""

from __future__ import annotations

import csv
import math
import sys
import time
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import measuring
import numpy as np
import validity_figures
from random_mechanisms import Drawn, mechanisms

from elastic import Deflection, deflection, reference_deflection, sample
from elastic.assessment import introduction_share, shear_share
from elastic.elastodynamics import Damping, elastodynamic, theory_error
from fem_check import compare_solid
from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, nonlinear_steady_state
from rigid import ConstantSpeed, MechanismError

SECONDS = 2400.0
SEED = 2026  # none that anything was looked at with while the estimates were made
ELEMENTS = 6
DENSE = 3840
POSITIONS = 96, 160, 256, 384  # of which the fewest that hold what the elastodynamic answer has of harmonics
FEW_HARMONICS = 0.2, 2e-4  # left out, as a share of the estimate, or in any case
LONGEST = 20.0  # seconds of processor time that the nonlinear check may take
EVERY = 4  # of how many mechanisms one is put to the solid check, at so many positions
SOLID_POSITIONS = 12
UNBENT = 0.01  # of the largest deflection of all beams, as `theory_error` has it
TAIL = 0.75  # of the harmonics that positions resolve, from which on they are the highest


class TooLongError(Exception):
    """The nonlinear check takes too long."""


def apart(chord: Any, truth: Any) -> float:
    """Greatest difference of the course, as a share of the largest deflection of the beam it is worst for."""
    greatest = np.abs(truth).max(axis=(1, 2))
    greatest = np.maximum(greatest, UNBENT * greatest.max())
    return float((np.abs(chord - truth).max(axis=(1, 2)) / greatest).max())


def unresolved(chord: Any) -> float:
    """How far positions are from enough for a course: its highest harmonics at them, as shares like `apart`."""
    greatest = np.abs(chord).max(axis=(1, 2))
    greatest = np.maximum(greatest, UNBENT * greatest.max())
    spectrum = np.abs(np.fft.rfft(chord, axis=1)) * (2 / chord.shape[1])
    high = spectrum[:, int(TAIL * spectrum.shape[1]) :].sum(axis=1).max(axis=1)
    return float((high / greatest).max())


def worst_share(truth: Any, plain: Any) -> float:
    """Largest deflection of the beam whose quasi-static answer is worst, as a share of that of all beams."""
    greatest = np.abs(truth).max(axis=(1, 2))
    worst = np.abs(plain - truth).max(axis=(1, 2)) / np.maximum(greatest, UNBENT * greatest.max())
    return float(greatest[worst.argmax()] / greatest.max())


def nonlinear(case: Drawn, beta: Sequence[float], positions: int, elements: int) -> Any:
    """Chord deflections of the nonlinear check."""
    end = time.process_time() + LONGEST

    def watch(*_: Any) -> None:
        if time.process_time() > end:
            raise TooLongError

    law = ConstantSpeed(case.start, case.speed)
    asked = case.mechanism, case.sections, [law], case.period, positions, elements
    return nonlinear_steady_state(*asked, damping=list(beta), progress=watch).chord


def positions_of(chord: Any, estimate: float) -> int | None:
    """How many positions the check needs for a course that is known at many; None where more than it has."""
    least = max(FEW_HARMONICS[0] * estimate, FEW_HARMONICS[1])
    enough = (count for count in POSITIONS if unresolved(chord[:, :: DENSE // count]) < least)
    return next(enough, None)


def row(case: Drawn, number: int) -> dict[str, Any]:
    """Estimated and measured errors of one mechanism, as shares."""
    moved = case.motion_at(np.arange(DENSE) * (case.period / DENSE))
    damping = Damping(np.full(len(case.sections), math.nan), ratio=0.01)
    found = elastodynamic(moved, case.motion_at, case.period, case.sections, damping=damping)
    told = {
        "number": number,
        "kind": case.kind,
        "material": case.material,
        "slenderness": case.slenderness,
        "ratio": case.ratio,
        "growth": found.growth,
    }
    if not found.stable:
        return {**told, "outcome": "no steady state comes about"}
    stations = np.linspace(0, 1, ELEMENTS + 1)
    plain, vibrating = (sample(bent, "chord", stations) for bent in (found.quasi_static, found.deflection))
    off = theory_error(found)
    count = positions_of(vibrating, off.large_displacement)
    if count is None:
        return {**told, "outcome": f"rings beyond what {POSITIONS[-1]} positions resolve"}
    beta = np.broadcast_to(found.damping.settled(found.lowest).beams, len(case.sections))
    truth = nonlinear(case, beta, count, ELEMENTS)
    plain, vibrating = (chord[:, :: DENSE // count] for chord in (plain, vibrating))
    return {
        **told,
        "outcome": "measured",
        "positions": count,
        "check's highest harmonics": unresolved(truth),
        "vibration": float(off.history.max()),
        "quasi-static, measured": apart(plain, truth),
        "large displacement": off.large_displacement,
        "time": found.time_error + found.reduction_error,
        "worst beam, share of the largest": worst_share(truth, plain),
        "elastodynamic, measured": apart(vibrating, truth),
        **(solid(case) if number % EVERY == 0 else {}),
    }


def solid(case: Drawn) -> dict[str, Any]:
    """What beam theory leaves out by estimate and by plane-stress bodies: shares of the largest deflection of all."""
    bent: Deflection = deflection(
        case.motion_at(np.arange(SOLID_POSITIONS) * (case.period / SOLID_POSITIONS)), case.sections
    )
    found = compare_solid(bent)
    known = np.isfinite(found.difference)
    share = np.maximum(shear_share(bent), introduction_share(bent)) * reference_deflection(found.largest)
    return {
        "beam theory, estimate": float(share[known].max() / found.largest[known].max()) if known.any() else math.nan,
        "beam theory, measured": found.relative,
    }


def measured(seconds: float) -> list[dict[str, Any]]:
    """Rows of as many mechanisms as there is time for, after those that are there."""
    rows: list[dict[str, Any]] = [*validity_figures.read()]
    end = time.perf_counter() + seconds
    for number, case in enumerate(mechanisms(SEED)):
        if number < len(rows):
            continue
        if time.perf_counter() > end:
            return rows
        try:
            rows.append(row(case, number))
        except (NotCheckedError, DoesNotCloseError, MechanismError, TooLongError, ValueError) as error:
            told = {"kind": case.kind, "material": case.material, "slenderness": case.slenderness, "ratio": case.ratio}
            words = str(error).split(":")[0]
            rows.append({"number": number, **told, "outcome": f"{type(error).__name__}: {words}".rstrip(": ")})
        write(rows)
    return rows


def write(rows: Sequence[Mapping[str, Any]]) -> None:
    """All of them."""
    head = list(dict.fromkeys(key for each in rows for key in each))
    with (measuring.RESULTS / "validity.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.DictWriter(stream, head)
        writer.writeheader()
        writer.writerows([{k: f"{v:.4g}" if isinstance(v, float) else v for k, v in each.items()} for each in rows])


def main() -> None:
    seconds = float(sys.argv[1]) if len(sys.argv) > 1 else SECONDS
    rows = measured(seconds)
    print(Counter(each["outcome"] for each in rows))
    validity_figures.main()


if __name__ == "__main__":
    main()
