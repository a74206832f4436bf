"""Strength of the links, their natural frequencies, and friction in the joints, as figures."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from elastic.assessment import harmonics
from kinelast.figures.figure import at_position, figure, largest
from kinelast.figures.peaks import STATIONS
from kinelast.figures.results import Results
from rigid.kinetostatics import rubbing_joints, sliding_directions


def strength_figures(results: Results) -> dict[str, dict[str, Any]]:
    """Per beam: swing of the normal stress, safety, compression over Euler's load, slenderness."""
    run = results.figures
    return {
        label: {
            "stress_range": _swing(run.swings[:, beam], float(results.deflection.length[beam, 0])),
            "yield_stress": figure(float(results.deflection.sections[beam].yield_stress), "Pa"),
            "safety_factor": figure(run.peaks["safety"][beam].value, "1"),
            "euler_ratio": largest(results, run.peaks["buckling"][beam], "1"),
            "slenderness": figure(results.slenderness[beam], "1"),
        }
        for beam, label in enumerate(results.scene.labels)
    }


def _swing(swings: Any, length: float) -> dict[str, Any]:
    """The larger swing of both fibres, shape (2, stations), and where it is."""
    if np.isnan(swings).all():
        return figure(math.nan, "Pa")
    side, at = np.unravel_index(np.nanargmax(swings), swings.shape)
    return figure(
        swings[side, at], "Pa", along=figure(STATIONS[at] * length, "m"), fibre="left" if side == 0 else "right"
    )


def vibration_figures(results: Results) -> dict[str, Any] | None:
    """Natural frequencies over the cycle, and their excitation; None where no link has beams."""
    frequencies = results.frequencies
    if frequencies is None:
        return None
    speed, lowest = fastest_drive(results), frequencies.lowest
    return {
        "positions": len(frequencies.position),
        "natural": [_over_cycle(results, omega) for omega in frequencies.omega if np.isfinite(omega).any()],
        "drive_speed": figure(speed, "rad/s"),
        "drive_to_lowest": figure(speed / lowest, "1"),
        "load": _load(results, lowest),
    }


def _over_cycle(results: Results, omega: Any) -> dict[str, Any]:
    assert results.frequencies is not None
    position = results.frequencies.position
    low, high = int(np.nanargmin(omega)), int(np.nanargmax(np.where(np.isfinite(omega), omega, -1.0)))
    return {
        "lowest": figure(omega[low], "rad/s", **at_position(results, int(position[low]))),
        "highest": figure(omega[high], "rad/s", **at_position(results, int(position[high]))),
    }


def _load(results: Results, lowest: float) -> dict[str, Any] | None:
    """The fastest strong harmonic of the load; None of no cycle."""
    if math.isnan(results.period) or not math.isfinite(lowest) or not results.counted.all():
        return None
    spectrum = harmonics(results.deflection, results.period)
    strong = spectrum.strong()
    number = int(strong[-1]) if len(strong) else 0
    return {
        "harmonic": number,
        "frequency": figure(spectrum.omega[number], "rad/s"),
        "to_lowest": figure(spectrum.omega[number] / lowest, "1"),
    }


def fastest_drive(results: Results) -> float:
    """Greatest speed of any drive that turns [rad/s]; 0 where none does."""
    rates = np.abs(results.figures.rates).max(axis=0)
    turning = (rate for drive, rate in zip(results.mechanism.drives, rates.tolist(), strict=True) if drive.turns)
    return float(max((rate for rate in turning if math.isfinite(rate)), default=0.0))


def friction_figures(results: Results) -> dict[str, Any] | None:
    """Efforts and heat of friction in the joints; None where no joint has any."""
    rubbing = rubbing_joints(results.mechanism)
    if not rubbing:
        return None
    peaks, words = results.figures.peaks, results.joint_words
    places = results.motion.places
    units = ["N m" if places[number].turns else "N" for number, _ in rubbing]
    return {
        "joints": [
            {"joint": words[number][0], "on": words[number][1], "effort": largest(results, peak, unit)}
            for (number, _), peak, unit in zip(rubbing, peaks["friction_effort"], units, strict=True)
        ],
        "power": largest(results, peaks["friction_power"][0], "W"),
        "feedback": figure(peaks["friction_feedback"][0].value, "1"),
        "locked": results.figures.locked,
        "resting": int(np.count_nonzero(resting(results))),
    }


def resting(results: Results) -> Any:
    """Whether nothing slides in any joint with friction, though drives may hold it there, shape (positions,)."""
    signs = sliding_directions(results.motion)
    found = np.all([sign == 0.0 for sign in signs.values()], axis=0)
    return found & ~results.singular
