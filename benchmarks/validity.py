"""How well the program's own error estimates hold: random mechanisms against the nonlinear check and solid links.

    python benchmarks/validity.py [seconds]

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

from elastic import Deflection, deflection, sample
from elastic.assessment import introduction_share, shear_share
from elastic.elastodynamics import Damping, elastodynamic, large_displacement_error, theory_error
from fem_check import compare_solid
from fem_check.nonlinear import DoesNotCloseError, NotCheckedError, nonlinear_steady_state
from kinelast.figures.theory import axial_share, vibration_estimate
from rigid import ConstantSpeed, MechanismError

SECONDS = 720.0
SEED = 7
POSITIONS, ELEMENTS = 96, 6
LONGEST = 6.0  # seconds that the nonlinear check may take
EVERY = 4  # of how many mechanisms one is put to the solid check, at so many positions
SOLID_POSITIONS = 12
UNBENT = 0.01  # of the largest deflection of all beams, as `theory_error` has it
TAIL = 0.75  # of the harmonics that the positions resolve, from which they are taken for the check's own error


class TooLongError(Exception):
    """The nonlinear check takes too long."""


def apart(chord: Any, truth: Any) -> float:
    """Greatest difference of the course, as a share of the largest deflection of the beam it is worst for."""
    greatest = np.abs(truth).max(axis=(1, 2))
    greatest = np.maximum(greatest, UNBENT * greatest.max())
    return float((np.abs(chord - truth).max(axis=(1, 2)) / greatest).max())


def unresolved(chord: Any) -> float:
    """How far the positions of the check are from enough: its highest harmonics, as shares like `apart`."""
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
    end = time.perf_counter() + LONGEST

    def watch(*_: Any) -> None:
        if time.perf_counter() > end:
            raise TooLongError

    law = ConstantSpeed(case.start, case.speed)
    asked = case.mechanism, case.sections, [law], case.period, positions, elements
    return nonlinear_steady_state(*asked, damping=list(beta), progress=watch).chord


def row(case: Drawn, number: int) -> dict[str, Any]:
    """Estimated and measured errors of one mechanism, as shares."""
    moved = case.motion_at(np.arange(POSITIONS) * (case.period / POSITIONS))
    plain = deflection(moved, case.sections)
    found = elastodynamic(moved, case.motion_at, case.period, case.sections, damping=Damping(
        np.full(len(case.sections), math.nan), ratio=0.01
    ))  # fmt: skip
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
    beta = np.broadcast_to(found.damping.settled(found.lowest).beams, len(case.sections))
    truth = nonlinear(case, beta, POSITIONS, ELEMENTS)
    stations = np.linspace(0, 1, ELEMENTS + 1)
    return {
        **told,
        "outcome": "measured",
        "check's own error": unresolved(truth),
        "vibration, cheap estimate": vibration_estimate(plain, case.period),
        "axial forces over Euler's loads": axial_share(plain),
        "vibration, computed": float(theory_error(found).history.max()),
        "quasi-static, large displacement": large_displacement_error(plain),
        "quasi-static, measured": apart(sample(plain, "chord", stations), truth),
        "large displacement, estimate": large_displacement_error(found.deflection),
        "time, estimate": found.time_error + found.reduction_error,
        "worst beam, share of the largest": worst_share(truth, sample(plain, "chord", stations)),
        "elastodynamic, measured": apart(sample(found.deflection, "chord", stations), truth),
        **(solid(case) if number % EVERY == 0 else {}),
    }


def solid(case: Drawn) -> dict[str, Any]:
    """What beam theory leaves out by estimate and by plane-stress bodies: shares of the largest deflection of all."""
    bent: Deflection = deflection(
        case.motion_at(np.arange(SOLID_POSITIONS) * (case.period / SOLID_POSITIONS)), case.sections
    )
    found = compare_solid(bent)
    known = np.isfinite(found.difference)
    share = np.maximum(shear_share(bent), introduction_share(bent)) * found.largest
    return {
        "beam theory, estimate": float(share[known].max() / found.largest[known].max()) if known.any() else math.nan,
        "beam theory, measured": found.relative,
    }


def measured(seconds: float) -> list[dict[str, Any]]:
    """Rows of as many mechanisms as there is time for."""
    rows, end = [], time.perf_counter() + seconds
    for number, case in enumerate(mechanisms(SEED)):
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
