"""How far the figures of a scene can be trusted: what the theory leaves out, sized for this scene.

Rules of thumb, each with the figure it rests on; docs/report.md says where they come from.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elastic import Deflection, deflection, displacement_of, sample
from kinelast.output_results import Peak, Results
from kinelast.report_numbers import number
from rigid import PinDrive, Reals, beam_directions, dot, motion

GOOD, CAUTION, POOR = "good", "caution", "poor"
TRIALS = 60  # positions looked at for the natural frequency
SHEAR_SHARE = 30.0  # 48 E I/(5 kappa G A l^2) = 30/slenderness^2 at E/G = 2.6, kappa = 5/6


@dataclass(frozen=True)
class Finding:
    """One answer to "can I trust this?": a level, a heading, and a sentence with its figure."""

    level: str
    heading: str
    text: str


def findings(results: Results, found: dict[str, list[Peak]], lowest: float) -> list[Finding]:
    """All that can be said about a scene's figures; `lowest` as `lowest_frequency` gives it."""
    return [
        _positions(results),
        *_check(results),
        _displacements(results, found),
        *_shear(results),
        *_vibration(results, lowest),
    ]


def _positions(results: Results) -> Finding:
    condition = results.motion.condition
    singular = int(np.count_nonzero(results.singular))
    heading = "Conditioning of the positions"
    if singular == len(condition):
        return Finding(POOR, heading, "No position could be computed: all are singular or out of reach.")
    worst = float(condition[~results.singular].max())
    digits = max(0, int(15 - math.log10(max(worst, 1.0))))
    text = f"Worst condition number {number(worst, 3)}: about {digits} digits survive there."
    if singular:
        text += f" {singular} of {len(condition)} positions are singular: they have no figures and count in no extreme."
    if results.left_out:
        text += f" {results.left_out} positions are out of the mechanism's reach and were left out on request."
    level = POOR if worst > 1e10 else CAUTION if singular or worst > 1e5 or results.left_out else GOOD
    return Finding(level, heading, text)


def _check(results: Results) -> list[Finding]:
    heading = "Finite element check"
    comparison = results.comparison
    if comparison is None:
        return [Finding(CAUTION, heading, "Not made. Run with --check to compare with independent finite elements.")]
    largest = max((worst.relative for worst in comparison.worst), default=0.0)
    text = (
        f"{comparison.compared} positions compared, {comparison.elements} elements a beam: "
        f"largest difference {number(largest, 2)} of the field's maximum over the cycle."
    )
    return [Finding(GOOD if comparison.passed else POOR, heading, text)]


def _displacements(results: Results, found: dict[str, list[Peak]]) -> Finding:
    """Linear theory takes loads and geometry of the undeformed position."""
    heading = "Small displacements"
    lengths = results.deflection.length[:, 0]
    if not len(lengths):
        return Finding(GOOD, heading, "No link has beams.")
    shares = [abs(peak.value) / float(length) for peak, length in zip(found["w"], lengths, strict=True)]
    if not np.isfinite(shares).any():
        return Finding(POOR, heading, "Nothing could be computed.")
    worst = int(np.nanargmax(shares))
    turn = float(np.nanmax([abs(peak.value) for peak in found["phi"]]))
    level = GOOD if shares[worst] < 0.005 else CAUTION if shares[worst] < 0.05 else POOR
    verdict = {
        GOOD: "linear theory holds well",
        CAUTION: "expect errors of linear theory of some per cent",
        POOR: "beyond linear theory: read the figures as an alarm, not as values",
    }[level]
    text = (
        f"Links deflect by up to {number(100 * shares[worst], 2)} % of their length ({results.scene.labels[worst]}) "
        f"and turn by up to {number(math.degrees(turn), 2)}°: {verdict}."
    )
    return Finding(level, heading, text)


def _shear(results: Results) -> list[Finding]:
    """Shear deformation and rotary inertia are left out: right for slender links."""
    rows = zip(slendernesses(results), results.scene.labels, results.deflection.sections, strict=True)
    known = [(slender, label) for slender, label, section in rows if math.isfinite(slender) and np.isinf(section.kGA)]
    if not known:
        return []
    least, label = min(known)
    share = SHEAR_SHARE / least**2
    level = GOOD if share < 0.01 else CAUTION if share < 0.1 else POOR
    text = (
        f"Least slenderness {number(least, 3)} ({label}): shear, left out, would add about {number(100 * share, 2)} % "
        "to the bending of that link."
    )
    return [Finding(level, "Slender links", text)]


def _vibration(results: Results, lowest: float) -> list[Finding]:
    """Inertia of the elastic motion itself is left out: right where the links are quick to follow."""
    speeds = [np.abs(rate).max() for drive, rate in _drives(results) if isinstance(drive, PinDrive)]
    speed = float(max(speeds, default=0.0))
    if not math.isfinite(lowest):
        return []
    bound = number(lowest / (2 * math.pi), 3)
    text = f"The lowest natural frequency is at most {bound} Hz (by Rayleigh's quotient, the drives held)"
    if not speed:
        return [
            Finding(CAUTION, "Quasi-static answer", text + ". Loads that change as fast will make the links vibrate.")
        ]
    ratio = lowest / speed
    level = GOOD if ratio > 20 else CAUTION if ratio > 8 else POOR
    verdict = {
        GOOD: "the links follow their loads",
        CAUTION: "vibration, left out, will change the deflection noticeably",
        POOR: "the links will vibrate and this quasi-static answer is not enough",
    }[level]
    return [Finding(level, "Quasi-static answer", f"{text}, {number(ratio, 3)} times the drive's speed: {verdict}.")]


def _drives(results: Results) -> list[tuple[Any, Reals]]:
    return list(zip(results.mechanism.drives, results.motion.drive_rate, strict=True))


def left_out(results: Results) -> list[str]:
    """What the figures do not hold, in words."""
    stiff = all(np.isinf(section.kGA) for section in results.deflection.sections)
    others = ["large displacements", "buckling", "play and friction in the joints", "stress and fatigue"]
    return ["vibration of the links", *(["shear deformation"] if stiff else []), *others]


def slendernesses(results: Results) -> list[float]:
    """Length over radius of gyration, l sqrt(EA/EI), of every beam; nan for a rigid one."""
    values = []
    for section, length in zip(results.deflection.sections, results.deflection.length[:, 0], strict=True):
        EA, EI = float(section.EA), float(section.EI)
        values.append(float(length) * math.sqrt(EA / EI) if math.isfinite(EA) and math.isfinite(EI) else math.nan)
    return values


def lowest_frequency(results: Results) -> float:
    """An upper bound of the lowest natural frequency of the mechanism with its drives held [rad/s].

    Rayleigh's quotient, twice the strain energy over the integral of the mass times displacement squared, of the shapes
    that the mechanism takes at rest under its own weight along x and along y; the least over some of the positions.
    nan where nothing bends.
    """
    good = np.flatnonzero(~results.singular)
    if not results.mechanism.beams or not len(good):
        return math.nan
    drive = results.motion.drive[:, good[:: math.ceil(len(good) / TRIALS)]]
    unstrained = [replace(section, strain=0.0) for section in results.deflection.sections]
    squares = []
    for weight in (1.0 + 0.0j, 1.0j):
        resting = replace(results.mechanism, gravity=weight, loads=())
        work, mass = _work_and_mass(deflection(motion(resting, drive), unstrained), weight)
        moves = np.isfinite(work) & (work > 0) & (mass > 0)
        squares.append((work[moves] / mass[moves]).min(initial=math.inf))
    lowest = math.sqrt(min(squares))
    return lowest if math.isfinite(lowest) else math.nan


def _work_and_mass(shape: Deflection, weight: complex) -> tuple[Reals, Reals]:
    """Work of the weight on the shape [J], and mass times displacement squared [kg m^2], shape (positions,).

    The work is twice the strain energy. Gauss' rule with six points is exact for prismatic beams.
    """
    mechanism = shape.motion.mechanism
    nodes, weights = np.polynomial.legendre.leggauss(6)
    along, across = (sample(shape, field, (nodes + 1) / 2) for field in ("u", "w"))
    moved = beam_directions(shape.motion)[..., None] * (along + 1j * across)
    work, mass = np.zeros(shape.motion.columns), np.zeros(shape.motion.columns)
    for k, (_, beam) in enumerate(mechanism.beams):
        taper = np.polynomial.polynomial.polyval((nodes + 1) / 2, beam.mass_taper)
        shares = beam.mass_per_length * shape.length[k].item() / 2 * weights * taper
        work += dot(weight, moved[k]) @ shares
        mass += np.square(np.abs(moved[k])) @ shares
    for at, link in enumerate(mechanism.links[1:], 1):
        for lump in link.lumps:
            lifted = displacement_of(shape, at, lump.point)
            work += lump.mass * dot(weight, lifted)
            mass += lump.mass * np.square(np.abs(lifted)) + lump.inertia * np.square(shape.angle[at])
    return work, mass
