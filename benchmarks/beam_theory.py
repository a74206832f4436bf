"""Error of beam theory: the estimate compared with plane-stress bodies; docs/validity.md has the tables."""

from typing import Any

import measuring
import numpy as np
from jobs import steel_four_bar
from msgspec.structs import replace

from elastic import Deflection, Section, deflection, reference_deflection
from elastic.assessment import introduction_share, shear_share
from fem_check import compare_solid
from rigid import Beam, LineLoad, Link, Mechanism, Motion, PinDrive, PointLoad, Slider, motion

SLENDER = (5, 10, 20, 50, 100, 200)
RANDOM = 200
UNIFORM = LineLoad("arm", 0, -1j, -1j)


def section(slender: float, length: float = 1.0) -> Section:
    """Rectangular section with EI = 1 for a slenderness."""
    return Section(EA=(slender / length) ** 2, EI=1.0)


def supported() -> Motion:
    """Motion of a beam on two supports under a uniform load."""
    links = Link("ground", {"O": 0}), Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),)), Link("block", {"A": 0})
    guide = Slider("guide", "block", "ground", "A", 0.0, 1.0)
    return motion(Mechanism(links, (), {"O": 0, "A": 1.0}, (guide,), loads=(UNIFORM,)), np.zeros((0, 1)))


def driven(load: Any) -> Motion:
    """Motion of an arm held by its motor."""
    links = Link("ground", {"O": 0}), Link("arm", {"O": 0, "A": 1.0}, (Beam("O", "A"),))
    return motion(Mechanism(links, (PinDrive("arm", "O"),), {"O": 0, "A": 1.0}, loads=(load,)), [0.0])


def estimated(solved: Deflection) -> float:
    """Estimated error of beam theory, relative to the largest deflection of all beams."""
    largest = compare_solid(solved).largest
    share = np.maximum(shear_share(solved), introduction_share(solved))
    return float((share * reference_deflection(largest)).max() / largest.max())


def family() -> list[dict[str, Any]]:
    """Rows of beams and the steel four-bar by slenderness [%]."""
    four_bar = steel_four_bar(72)
    rows = []
    for slender in SLENDER:
        beams = {
            "two supports, uniform load": deflection(supported(), [section(slender)]),
            "driven arm, force at its end": deflection(driven(PointLoad("arm", "A", -1j)), [section(slender)]),
            "driven arm, uniform load": deflection(driven(UNIFORM), [section(slender)]),
            "steel four-bar": deflection(four_bar.motion(), [section(slender, size) for size in (0.1, 0.3, 0.25)]),
        }
        row: dict[str, Any] = {"slenderness": slender}
        for name, solved in beams.items():
            row[f"{name}: estimated [%]"] = 100 * estimated(solved)
            row[f"{name}: plane bodies [%]"] = 100 * compare_solid(solved).relative
        rows.append(row)
    return rows


def at_random() -> list[dict[str, Any]]:
    """Estimate divided by the plane-stress result, for four-bars of random lengths and slenderness 10 to 200."""
    random = np.random.default_rng(1)
    ratios = []
    for _ in range(RANDOM):
        job = steel_four_bar(12, crank=float(random.uniform(0.05, 0.12)))
        lengths = [abs(job.mechanism.links[at].points[beam.end]) for at, beam in job.mechanism.beams]
        drawn = zip(10 ** random.uniform(1, 2.3, 3), lengths, 10 ** random.uniform(-1, 1, 3), strict=True)
        stiff = [(section(slender, size), scale) for slender, size, scale in drawn]
        solved = deflection(job.motion(), [replace(part, EA=part.EA * scale, EI=scale) for part, scale in stiff])
        ratios.append(estimated(solved) / compare_solid(solved).relative)
    found = np.array(ratios)
    return [
        {
            "mechanisms": RANDOM,
            "within a factor of two [%]": 100 * float(((found > 0.5) & (found < 2)).mean()),
            "least": float(found.min()),
            "median": float(np.median(found)),
            "greatest": float(found.max()),
        }
    ]


def main() -> None:
    tables = {"slenderness": family(), "random four-bars": at_random()}
    measuring.report("beam_theory", "Error of beam theory and its estimate", tables)


if __name__ == "__main__":
    main()
