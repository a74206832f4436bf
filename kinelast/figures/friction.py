"""What friction in the joints takes, as figures; and whether it may lock the mechanism."""

from __future__ import annotations

from typing import Any

import numpy as np

from kinelast.figures.figure import figure, largest
from kinelast.figures.results import Results, joint_words
from rigid.friction import friction_power, rubbing_joints, sliding_directions


def friction_figures(results: Results) -> dict[str, Any] | None:
    """Efforts and heat of friction in the joints; None where no joint has any."""
    motion, forces = results.motion, results.deflection.forces
    rubbing = rubbing_joints(results.mechanism)
    if not rubbing:
        return None
    words, places = joint_words(results), motion.places
    feedback = np.where(forces.locked, -1.0, np.broadcast_to(forces.feedback, motion.columns))
    return {
        "joints": [
            {
                "joint": words[number][0],
                "on": words[number][1],
                "effort": largest(results, forces.friction[number], "N m" if places[number].turns else "N"),
            }
            for number, _ in rubbing
        ],
        "power": largest(results, friction_power(motion, forces), "W"),
        "feedback": figure(feedback.max() if feedback.max() >= 0 else np.nan, "1"),
        "locked": results.locked_count,
        "resting": int(np.count_nonzero(resting(results.shown))),
    }


def resting(results: Results) -> Any:
    """Whether nothing slides in any joint with friction, though drives may hold it there, shape (positions,)."""
    signs = sliding_directions(results.motion)
    found = np.all([sign == 0.0 for sign in signs.values()], axis=0)
    return found & ~results.singular
