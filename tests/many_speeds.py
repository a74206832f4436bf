"""Steady states at several speeds at once."""

from elastic.elastodynamics import SpeedSolutions


def speed_map(motion_at, period, ratios, *given, **options):
    """Answers at some relative speeds, for the other arguments of `SpeedSolutions`."""
    answers = SpeedSolutions(motion_at, period, *given, **options)
    answers.find(ratios)
    return answers.map(ratios)
