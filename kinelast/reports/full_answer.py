"""Full answer: a design by the theory that the scene requests, with errors and judged limits.

Designs, optimization and sweeps compute quasi-static figures (results such as the largest deflection), and full answers
only for a few designs.
"""

import math
from collections.abc import Iterable, Mapping

from msgspec import Struct

from kinelast.answers.results import results_in_full
from kinelast.figures.measures import measures_of
from kinelast.figures.registry import figures_of
from kinelast.reports.limits import UNKNOWN, Judgement, if_reliable, judged_measure, value_and_error
from kinelast.scene.data import QUASI_STATIC, Scene
from kinelast.values.error import SceneError
from kinelast.values.figure import Limit


class FullAnswer(Struct, frozen=True):
    """The results of a design according to the theory chosen in the scene, with errors.

    Attributes
    ----------
    theory
        Name of the theory; empty if there are no results.
    judgements
        Judgement of each limit.
    figures
        Magnitude of each requested figure and its error in SI units, by name; nan if unknown.
    """

    theory: str
    judgements: tuple[Judgement, ...]
    figures: Mapping[str, tuple[float, float]]


def full_answer(scene: Scene, limits: Iterable[Limit], names: Iterable[str] = ()) -> FullAnswer:
    """Compute a scene by the theory chosen in it, judge `limits`, and look up the figures `names`."""
    try:
        results = results_in_full(scene)
    except SceneError as error:
        unknown = tuple(Judgement(limit, UNKNOWN, 0, math.nan, math.nan, error.problem) for limit in limits)
        return FullAnswer("", unknown, dict.fromkeys(names, (math.nan, math.nan)))
    measures = measures_of(scene, figures_of(results.figures.output))
    theory = QUASI_STATIC if results.answer is None else results.answer.theory
    judged = [judged_measure(results, limit, measures.get(limit.figure)) for limit in limits]
    judgements = if_reliable(results, judged)
    figures = {name: value_and_error(results, measures[name]) for name in names if name in measures}
    return FullAnswer(theory, judgements, figures)
