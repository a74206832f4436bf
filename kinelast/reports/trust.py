"""Findings on how far the results of a scene can be trusted, e.g. on the size of neglected effects.

docs/report.md and docs/strength.md list the limits of the theory and their sources.
"""

import math
from collections.abc import Iterator, Sequence
from weakref import WeakKeyDictionary

import numpy as np

from elastic.assessment import VALIDITY_RANGES, Exceedance, shear_share
from kinelast.answers.checks import check_passed
from kinelast.answers.refusals import outside_ranges
from kinelast.answers.results import Results
from kinelast.figures.cycle import MAX_CONDITION
from kinelast.reports.accuracy import accuracy_findings
from kinelast.reports.advice import exceedance_advice
from kinelast.reports.inputs import cycle_findings, input_findings
from kinelast.reports.jumps import jump_findings
from kinelast.reports.sections import friction_of
from kinelast.reports.sideways import sideways_findings
from kinelast.scene.data import GEOMETRICALLY_EXACT
from kinelast.scene.parts import PARTS
from kinelast.values.figure import NOISE
from kinelast.values.numbers import capitalized, number, percent, quantity
from kinelast.values.reading import CAUTION, GOOD, OPEN, ORDER, POOR, Finding, Reader
from rigid import Friction, counted

HEADINGS = {
    "slenderness": "Stubby links",
    "deflection": "Large displacements",
    "buckling": "Buckling",
    "yield": "Strength",
}
WITHIN = {
    "slenderness": "beam theory neglects less than {:.0f} % of the deflection of any link from its chord",
    "deflection": "no link deflects by more than {:.0f} % of its length",
    "buckling": "no link exceeds {:.0f} % of its critical load",
    "yield": "no link exceeds {:.0f} % of its yield stress",
}
IN_THE_ERROR = {  # words on effects that the results include, or that the stated errors cover
    "slenderness": "the stated errors of deflections include its effect at the largest deflection,"
    " which may be smaller; stresses are those of beam theory",
    "deflection": "the answer or its error includes this",
    "buckling": "the answer or its error includes its effect on bending",
}
SHEAR_OFF = 'beams = "euler-bernoulli" neglects shear'
SHEAR_UNKNOWN = "its section has neither shear_area nor kGA, so shear is neglected"
UNKNOWN = {"yield": "strength: {} not given", "vibration": "vibration: the quasi-static theory was chosen"}


_FOUND: WeakKeyDictionary[Results, list[Finding]] = WeakKeyDictionary()


def findings(results: Results) -> list[Finding]:
    """Return all findings on the results of a scene, the most severe first.

    They are computed only once. If a link buckles, findings on formulas, checks and effects within their limits are
    left out. Of the limits of the theory, only the one on axial force is then considered.
    """
    if results not in _FOUND:
        _FOUND[results] = _findings(results)
    return _FOUND[results]


def _findings(results: Results) -> list[Finding]:
    unsorted = [
        *input_findings(results),
        *accuracy_findings(results),
        _positions(results),
        *cycle_findings(results),
        *(finding for part in PARTS for finding in part.findings(Reader(results))),
        *_ranges(results),
        *_friction(results),
        *jump_findings(results),
        *_exceedances(results),
        *sideways_findings(results),
    ]
    if not results.buckles:
        unsorted += [*_formulas(results), *_check(results), *_within(results)]
    return sorted(unsorted, key=lambda finding: ORDER.index(finding.level))


def doubts(results: Results) -> list[str]:
    """Return words on the findings that make all results unreliable, so that no limit can be declared met.

    A known error is not such a finding, because a limit is judged with the error in the limited figure. Nor is a
    yielding link, see `kinelast.answers.refusals.refusals`.
    """
    poor = [finding.heading for finding in findings(results) if finding.level == POOR]
    return [f"not reliable: {heading.lower()}" for heading in poor if heading != HEADINGS["yield"]]


def reliability(trust: Sequence[Finding]) -> tuple[str, list[str]]:
    """Return the most severe level of all findings, and a heading for each finding with this level.

    A heading is followed by the advice of the finding in parentheses. The finding that a link yields is left out,
    because the report states it separately. Findings of the level "open" are left out too.
    """
    stated = HEADINGS["yield"], POOR
    about = [each for each in trust if each.level != OPEN and (each.heading, each.level) != stated]
    level = min((finding.level for finding in about), key=ORDER.index, default=GOOD)
    worst = [finding for finding in about if finding.level == level]
    words = (finding.heading.lower() + (f" ({finding.advice})" if finding.advice else "") for finding in worst)
    return level, list(dict.fromkeys(words))


def digits_left(condition: float) -> int:
    """Return the number of decimal digits that are reliable at a position with this condition number."""
    return max(0, int(15 - math.log10(max(condition, 1.0))))


def _positions(results: Results) -> Finding:
    count, singular, ill = results.counts
    heading = "Dead points"
    if singular + results.figures.locked == count:
        why = "singular, out of reach, or locked by friction" if results.figures.locked else "singular or out of reach"
        return Finding(POOR, heading, f"No position could be computed: all are {why}.")
    worst = results.figures.peaks["condition"][0].value
    digits = digits_left(worst)
    near = "Round-off grows near" if worst > MAX_CONDITION else "No position is near"
    condition = f"largest condition number {number(worst, 3)}, about {digits} reliable digits there"
    text = f"{near} a dead point of the drives: {condition}."
    if singular:
        text += (
            f" {singular} of {count} positions are singular (dead or change points):"
            " they have no figures and no extreme values."
        )
    if ill:
        text += (
            f" The largest values exclude {counted(ill, 'position')} near a dead point, with a condition number beyond"
            f" {number(MAX_CONDITION)}; positions.csv lists them."
        )
    if results.scene.course.interrupted is not None:
        reached = quantity(results.scene.course.interrupted, "s")
        text += f" The integration was interrupted at {reached}: {results.left_out} later positions are missing."
    elif results.left_out:
        text += f" {counted(results.left_out, 'unreachable position')} left out on request."
    level = POOR if worst > 1e10 else CAUTION if singular or worst > MAX_CONDITION or results.left_out else GOOD
    return Finding(level, heading, text)


def _ranges(results: Results) -> Iterator[Finding]:
    """Yield a finding on each sizing formula that is used outside its range of validity."""
    values = {key: [abs(peak.value) for peak in peaks] for key, peaks in results.figures.peaks.items()}
    for each, items in outside_ranges(results.scene, values):
        found = ", ".join(f"{value:.3g} of {name}" for name, value in items.items())
        text = f"{capitalized(each.words)}, and it is {found}: {each.outside}."
        yield Finding(CAUTION, "Sizing", text, f"{each.formula} of {', '.join(items)}")


def _friction(results: Results) -> Iterator[Finding]:
    """Yield a finding on the power of friction and the risk that friction locks the mechanism."""
    friction = friction_of(Reader(results))
    if friction is None:
        return
    heading, locked, power = "Friction", friction.locked, friction.power
    takes = "an unknown power" if power.value is None else quantity(power.value, power.unit)
    text = f"Friction in {counted(len(friction.joints), 'joint')} takes up to {takes}."
    if friction.feedback.value is not None:
        text += f" Its loop gain is at most {percent(friction.feedback.value)}; at 100 % it may lock the mechanism."
    if locked:
        text += f" It may at {locked} of {counted(results.counts[0], 'position')}: equilibrium is not unique there."
    if friction.resting:
        text += f" At {counted(friction.resting, 'position')} nothing slides and there is no friction."
    free = [name for name, own in results.mechanism.friction.items() if _unguided(results, name, own)]
    if free:
        text += f" The moment on {', '.join(free)} causes no friction, because length is not given."
    yield Finding(POOR if locked else GOOD, heading, text)


def _formulas(results: Results) -> Iterator[Finding]:
    """Yield a finding on inputs and formulas with an uncertainty that the stated errors do not include."""
    names = [part.formulas for part in reversed(PARTS) if part.formulas and part.of(results.scene)]
    if results.mechanism.friction:
        names.append("friction coefficients")
    if names:
        text = f"± is the error of the calculation. It does not cover {', '.join(names)}."
        yield Finding(GOOD, "Formulas", text)


def _unguided(results: Results, name: str, own: Friction) -> bool:
    """Return whether friction due to the moment on a slider is neglected because the slider's length is not given."""
    if not own.coefficient or np.isfinite(own.length):
        return False
    forces, number = results.deflection.forces, [joint.name for joint in results.motion.structure.joints].index(name)
    if results.motion.places[number].turns:
        return False
    scale = results.figures.scales["N m"]
    return bool(np.any(np.abs(forces.moment[number]) > NOISE * scale))


def _check(results: Results) -> list[Finding]:
    heading = "Finite element check"
    comparison = results.comparison
    if comparison is None:
        return [Finding(OPEN, heading, "Not made. Run with --check to compare with independent finite elements.")]
    passed = check_passed(results)
    if passed is None:
        return [Finding(OPEN, heading, "Nothing to compare: no position could be computed.")]
    text = "No link bends."
    if results.mechanism.beams and comparison.compared:
        largest = max((worst.relative for worst in comparison.worst), default=0.0)
        text = (
            f"{comparison.compared} positions compared, {comparison.elements} elements per beam: "
            f"largest difference {number(largest, 2)} of the field's maximum over the cycle, "
            f"tolerance {number(comparison.tolerance, 2)}."
        )
    for theory, balance in results.balances.items():
        if balance.compared:
            text += (
                f" Momentum of all masses against the forces ({theory}), at {balance.compared} positions: "
                f"largest difference {number(balance.largest, 2)}, tolerance {number(balance.tolerance, 2)}."
            )
    if not comparison.passed and any(section.taper for section in results.deflection.sections):
        text += (
            f" Elements of tapered beams converge with the fourth power of their size: try --check"
            f" {4 * comparison.elements}."
        )
    return [Finding(GOOD if passed else POOR, heading, text)]


def _exceedances(results: Results) -> Iterator[Finding]:
    """Yield a finding for each limit of beam theory that a link exceeds.

    The finding describes the worst link, and names the other links that exceed the limit.
    """
    for kind, heading in HEADINGS.items():
        alike = [each for each, _ in results.exceedances if each.kind == kind and not math.isnan(each.figure)]
        if results.buckles and kind != "buckling":
            continue
        if not alike:
            continue
        worst, members = max(alike, key=lambda each: each.figure), results.scene.member_names
        name = "" if worst.beam is None else members[worst.beam]
        names = dict.fromkeys(members[each.beam] for each in alike if each.beam is not None)
        names.pop(name, None)
        words = f"{name} {worst.message}" if name else capitalized(worst.message)
        level = exceedance_level(results, worst)
        if _in_the_error(results, kind):
            words += f"; {IN_THE_ERROR[kind]}"
            if kind == "buckling" and level != GOOD and worst.figure < 1.0:
                words += f", but an initial curvature of the link grows {1 / (1 - worst.figure):.2g} times"
        elif kind == "buckling" and worst.beam is not None:
            grows = f"its bending grows about {1 / (1 - worst.figure):.3g} times, which is neglected"
            words += f"; {'it buckles' if worst.figure >= 1.0 else grows}"
        sheared = _without_shear(results, worst.beam) if kind == "slenderness" and worst.beam is not None else ""
        words += sheared + (f"; less so {', '.join(names)}" if names else "")
        advice = "" if level == GOOD or sheared else exceedance_advice(results, kind, worst.beam or 0)
        brief = ": ".join(filter(None, (name, advice and _clause(advice))))
        text = f"{words}. {advice}." if advice else f"{words}."
        yield Finding(level, heading, text, brief if level != GOOD else "")


def exceedance_level(results: Results, exceedance: Exceedance) -> str:
    """Return the severity of the finding on an exceeded limit of beam theory.

    It is "open" if the size of the effect is unknown. Effects that are computed, or covered by the error estimate,
    raise no caution. A large axial force is the exception, because its effect also depends on how straight the link is
    initially, which is unknown.
    """
    kind, figure = exceedance.kind, exceedance.figure
    if math.isnan(figure):
        return OPEN
    if not _in_the_error(results, kind):
        return POOR if exceedance.severe else CAUTION
    if kind != "buckling" or not VALIDITY_RANGES[kind].far_passed(figure):
        return GOOD
    return POOR if figure >= 1.0 else CAUTION


def _in_the_error(results: Results, kind: str) -> bool:
    """Return whether the results include an effect, or the stated errors cover it."""
    return kind in IN_THE_ERROR and results.answer is not None and not results.error_unknown


def _without_shear(results: Results, beam: int) -> str:
    """Return why significant shear is neglected in a short beam. Return "" if shear is included or not significant."""
    if not VALIDITY_RANGES["slenderness"].passed(float(shear_share(results.deflection)[beam])):
        return ""
    known = np.isfinite(results.scene.sections[beam].shear_rigidity).all()
    return f"; {SHEAR_OFF if known else SHEAR_UNKNOWN}"


def _clause(words: str) -> str:
    return words[0].lower() + words[1:]


def _within(results: Results) -> Iterator[Finding]:
    """Yield a finding on the limits of beam theory that all links meet, and one on effects that cannot be judged."""
    if not results.mechanism.beams or results.figures.singular == results.figures.positions:
        return
    judged = _judged(results)
    passed = {caution.kind for caution, _ in results.exceedances}
    limits = {kind: VALIDITY_RANGES[kind].watch * 100 for kind in WITHIN}
    fine = [words.format(limits[kind]) for kind, words in WITHIN.items() if kind in judged - passed]
    if fine:
        yield Finding(GOOD, "Within the limits", capitalized("; ".join(fine)) + ".")
    found = {"vibration"} if results.answer else set()
    unknown = [words for kind, words in UNKNOWN.items() if kind not in judged | passed | found]
    unknown = [words.format(_lacking(results)) for words in unknown]
    unknown += [one.message for one, _ in results.exceedances if math.isnan(one.figure)]
    if unknown:
        yield Finding(OPEN, "Not judged", capitalized("; ".join(unknown)) + ".")


def _lacking(results: Results) -> str:
    """Return the names of the missing inputs for the safety factor, followed by "is" or "are"."""
    stress, depth = "the yield stress of the materials", "the dimensions of the sections"
    yields = any(np.isfinite(section.yield_stress) for section in results.deflection.sections)
    stressed = any(math.isfinite(peak.value) for peak in results.figures.peaks["stress"])
    if yields and stressed:
        return f"{stress} and {depth} of the same beam are"
    if yields:
        return f"{depth} are"
    return f"{stress} is" if stressed else f"{stress} and {depth} are"


def _judged(results: Results) -> set[str]:
    """Return the kinds of caution for which the size of the effect is known."""
    sections = results.deflection.sections
    kinds = {
        "slenderness": any(np.isfinite(section.EA) and np.isfinite(section.EI) for section in sections),
        "deflection": True,
        "buckling": any(np.isfinite(section.EI) for section in sections),
        "yield": any(not math.isnan(peak.value) for peak in results.figures.peaks["safety"]),
    }
    return {kind for kind, is_judged in kinds.items() if is_judged}


def left_out(results: Results) -> list[str]:
    """Return the names of the effects that the results neglect."""
    cleared = any(parts.clearance for parts in results.scene.bearings.values())
    effects = {
        "vibration of the links": not results.vibrates,
        "shear deformation": all(np.isinf(section.kGA) for section in results.deflection.sections),
        "large displacements": not results.answer or results.answer.theory != GEOMETRICALLY_EXACT,
        "the axial force's part in bending": not results.vibrates,
        "impacts of the play in the joints" if cleared else "play in the joints": True,
        "friction in the joints": not results.mechanism.friction,
        "fatigue": not results.scene.fatigue,
    }
    return [effect for effect, neglected in effects.items() if neglected]
