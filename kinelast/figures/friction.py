"""What friction in the joints takes, as figures; and whether it may lock the mechanism."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.figures.figure import figure, largest
from kinelast.figures.results import Results
from rigid.friction import rubbing_joints, sliding_directions


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
