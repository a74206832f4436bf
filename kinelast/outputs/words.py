"""Sentences on the results in a report: headline, verdict, limits, errors and checks.

A `Reading` is a result with a unit, an error and a location. The verdict says whether all limits are met.
"""

import math
from collections.abc import Callable, Iterator, Mapping
from typing import Any

from msgspec.structs import replace

from elastic import FIELDS
from kinelast.figures.cycle import MAX_CONDITION
from kinelast.reports.doubted import LIMIT_NAMES, large_errors, unjudged_limits
from kinelast.reports.inputs import INPUTS
from kinelast.reports.limits import KEPT, UNKNOWN, VERDICTS
from kinelast.reports.report import (
    CheckReport,
    FurtherCheck,
    JudgedLimit,
    OutputReading,
    Reliability,
    Report,
    RunReport,
    TheoryReport,
)
from kinelast.reports.trust import digits_left
from kinelast.scene.data import QUASI_STATIC
from kinelast.values.numbers import (
    SI,
    UNRELIABLE,
    DisplayUnits,
    coordinate,
    error_percent,
    few,
    has_large_error,
    number,
    percent,
    quantity,
    with_limit,
)
from kinelast.values.reading import CAUTION, GOOD, OPEN, POOR, Reading
from rigid import counted

DEGREES = 180 / math.pi, "deg"
NEAR_ZERO = 100.0  # relative error above which a curve is called near zero
# the sentence on reliability names at most this number of limits and values; further ones are only counted
MAX_DOUBTED = 2
# for each unreliable value, the sentence on reliability names at most this number of items (such as links)
MAX_ITEMS = 3
OUTCOMES = {words: outcome for outcome, words in VERDICTS.items()}
MAX_NAMED = 3  # a verdict names at most this number of limits; further limits are only counted
LEVELS = {CAUTION: "use with caution", POOR: "not reliable", OPEN: "not known"}


def headline(report: Report) -> str:
    """Return a one-line summary of a report.

    The summary states the verdict, the largest deflection and stress, motors, checks, and the reliability of results.
    """
    accepted, shown_in = report.acceptance, report.shown_in
    verdict = verdict_words(report)
    if accepted.passed is not True:
        verdict = accepted.verdict.upper() + verdict.removeprefix(accepted.verdict)
    film = report.made_from and report.made_from.options["animate"]
    filmed = "the film shows the motion of rigid links" if film else ""
    if report.buckles:
        return "; ".join(filter(None, (verdict, "there is no deflection, stress or safety factor", filmed)))
    words = [verdict] if accepted.verdict else []
    if report.yields and report.yields not in verdict:
        words.append(report.yields)
    if largest := report.largest_deflection:
        drives = [f"{name} at {_coordinate_words(each, shown_in)}" for name, each in largest.drive.items()]
        if report.run.several_turns:
            assert largest.time
            drives = [f"t = {size(largest.time, shown_in)}"]
        place = f"{size(largest.along_member, shown_in, 3)} along it"
        value = size(magnitude(largest), shown_in) + error_words(largest, shown_in)
        words.append(f"largest deflection {value} ({', '.join((largest.member, place, *drives))})")
    else:
        words.append("no position could be computed" if report.links else "nothing bends: no link has beams")
    if stress := report.largest_stress:
        value = size(stress, shown_in, 3) + error_words(stress, shown_in)
        place, safety = stress.member, least_safety(report)
        if safety and safety[0] == place:
            place += f", safety {safety[1].value:.3g}"
        words.append(f"stress {value} ({place})")
        if safety and safety[0] != stress.member:
            words.append(f"safety {safety[1].value:.3g} ({safety[0]})")
    words += _motors(report)
    words += _run(report.run)
    if report.check:
        words.append(check_words(report.check))
    words += _theory(report)
    if filmed and not report.links:
        words.append(filmed)
    return "; ".join([*words, *_reliability(report)])


def member(report: Report, label: str) -> str:
    """Return the name of the member that contains a beam. `label` is the label of the beam.

    A member is a straight row of connected beams. If no beam has the label `label`, return `label`.
    """
    return next((str(each["member"]) for each in report.links if each["label"] == label), label)


def least_safety(report: Report) -> tuple[str, Reading] | None:
    """Return the member with the smallest safety factor, and the factor, or None if no safety factor is known."""
    known = {label: row.safety_factor for label, row in report.strength.items() if row.safety_factor.value is not None}
    label = min(known, key=lambda each: known[each].value or 0.0, default=None)
    return None if label is None else (member(report, label), known[label])


def size(found: Reading, shown_in: DisplayUnits, digits: int = 4) -> str:
    """Return the value and unit of a reading as text. The value of the reading must not be None."""
    assert found.value is not None
    return quantity(found.value, found.unit, digits, shown_in)


def magnitude(found: Reading) -> Reading:
    """Return a copy of a reading in which the absolute value replaces the value."""
    return replace(found, value=None if found.value is None else abs(found.value))


def _coordinate_words(found: Reading, shown_in: DisplayUnits) -> str:
    assert found.value is not None
    return coordinate(found.value, found.unit, shown_in)


def _motors(report: Report) -> Iterator[str]:
    """Yield a phrase about each drive with a motor: largest effort (moment or force) of the drive, and motor torque."""
    for name, drive in report.drives.items():
        effort, shaft = drive["effort"], drive.get("motor", {}).get("motor_torque")
        if shaft is not None and effort.value is not None and shaft.value is not None:
            both = [size(magnitude(each), report.shown_in) for each in (effort, shaft)]
            yield f"drive of {name} {both[0]}{error_words(effort, report.shown_in)} ({both[1]} at its motor)"


def _run(run: RunReport) -> Iterator[str]:
    """Yield phrases about positions without results, and about ill-conditioned positions."""
    condition = run.largest_condition.value
    if condition is not None and condition > MAX_CONDITION:
        yield f"near a dead point: {digits_left(condition)} digits are certain there"
    if run.singular:
        yield f"{counted(run.singular, 'position')} without figures, at dead points"
    if run.one_position:
        yield "at one position"
    if run.locked:
        yield f"friction may lock {counted(run.locked, 'position')}"
    if run.interrupted:
        yield f"PARTIAL: interrupted at {size(run.interrupted, SI)}"
    elif run.left_out:
        yield f"{counted(run.left_out, 'position')} out of reach"


def _reliability(report: Report) -> Iterator[str]:
    """Yield phrases about reasons for caution and about the number of unreliable values, if there are any."""
    trust = report.reliability
    if trust.level != GOOD:
        yield _reasons(trust)
    if trust.unreliable:
        yield f"{counted(len(trust.unreliable), 'figure')} of the report unreliable"


def _reasons(trust: Reliability) -> str:
    """Return a phrase about the level of reliability (such as "use with caution") and the reasons for the level."""
    return f"{LEVELS[trust.level]}: {', '.join(trust.reasons)}"


def error_words(figure: Reading, shown_in: DisplayUnits) -> str:
    """Return the error of a reading as text to append to the value, such as " ± 3 %".

    If the error is unknown or zero, the text states no error. If the error is larger than the value, the error is given
    in the unit of the value instead of per cent. A large relative error is marked "(unreliable)". If the value is much
    smaller than the largest value with the same unit, the mark is "(near zero)" instead.
    """
    error, value = figure.error, figure.value
    if value is None:
        return ""
    words = ""
    if error:
        words = error_percent(error / abs(value)) if error <= abs(value) else quantity(error, figure.unit, 2, shown_in)
        words = f" ± {words}{' measured' if figure.error_measured else ''}"
    if not value:
        return words
    if figure.unreliable:
        return f"{words} (unreliable)"
    return f"{words} (near zero)" if error and has_large_error(value, error) else words


def verdict_words(report: Report) -> str:
    """Return a phrase with the verdict and the limits that decide the verdict.

    If a link buckles, the phrase names the link instead of the limits.
    """
    accepted, rows = report.acceptance, limit_rows(report)
    if report.buckles:
        return f"{accepted.verdict}: {report.buckles}"
    if not rows:
        return "no limits are set"
    if accepted.passed:
        return f"acceptable: {rows[0][0]}" + (f", tightest of {len(rows)} limits" if len(rows) > 1 else "")
    decides = [words for words, _, outcome in rows if outcome == OUTCOMES[accepted.verdict]]
    more = len(decides) - MAX_NAMED
    named = ", ".join(decides[:MAX_NAMED]) + (f" and {more} more of {len(rows)} limits" if more > 0 else "")
    words = ": ".join(filter(None, (accepted.verdict, named, accepted.problem)))
    unjudged = {row.problem: row for row in reversed(accepted.limits or ()) if row.outcome == UNKNOWN}
    unjudged.pop(accepted.problem, None)
    return "; ".join([words, *(f"{_limit_words(row, report)} {UNKNOWN}: {why}" for why, row in unjudged.items())])


def to_read(report: Report) -> Report:
    """Return a copy of a report in which the display unit of angles is the degree.

    The HTML report and the printed page use this copy.
    """
    return replace(report, shown_in={**report.shown_in, "rad": DEGREES})


def trust_words(report: Report) -> tuple[str, str]:
    """Return a phrase about the reliability of the results, and the level of reliability.

    If a link yields, the phrase says that the results assume elastic links, instead of calling the results reliable.
    """
    trust, doubted = report.reliability, ", ".join(_doubted(report))
    near = ""
    if trust.near_zero:
        near = f"; errors above {percent(UNRELIABLE)} in {counted(trust.near_zero, 'figure')} near zero"
    more = (f"; unreliable: {doubted}" if doubted else "") + near
    if report.buckles:
        return "only figures of the rigid motion are shown", CAUTION
    if trust.level != GOOD:
        return f"{_reasons(trust)}{more}", trust.level
    if report.yields:
        return f"the figures assume elastic links{more}", CAUTION
    if report.run.one_position:
        return f"the figures hold at one position only{more}", CAUTION
    words = "all figures are reliable" + (f" except {doubted}" if doubted else "") + near
    return words, CAUTION if doubted else GOOD


def _doubted(report: Report) -> list[str]:
    """Return phrases about limits that cannot be judged, and about values and curves with large errors.

    Only the first `MAX_DOUBTED` phrases are returned. If there are further phrases, an additional phrase states their
    number.
    """
    names, verdict = [], verdict_words(report)
    if not report.run.one_position and not report.yields:
        for why, limits in unjudged_limits(report.acceptance.limits or (), lambda label: member(report, label)).items():
            names += [f"{each} ({UNKNOWN})" if why in verdict else f"{each} ({UNKNOWN}: {why})" for each in limits]
    courses = {name: error for name, error in report.theory.courses.items() if error and error > UNRELIABLE}
    sizes = {name: f"± {percent(error)}" if error < NEAR_ZERO else "near zero" for name, error in courses.items()}
    curves = [f"curve of {_field_name(name)} ({size})" for name, size in sizes.items()]
    return few([*names, *large_errors(report.reliability.unreliable, MAX_ITEMS), *curves], MAX_DOUBTED)


def _field_name(name: str) -> str:
    """Return a field's name and symbol, such as "longitudinal displacement u"."""
    return f"{FIELDS[name].name} {name}" if name in FIELDS else name


def output_words(output: OutputReading) -> str:
    """Return the kind and the name of the output as text, such as "point D" or "angle of rocker at D"."""
    at = f" at {output.point}" if output.point else ""
    return f"{output.kind}{'' if output.kind == 'point' else ' of'} {output.name}{at}"


def limit_rows(report: Report) -> list[tuple[str, float | None, str]]:
    """Return a row for each limit, starting with the highest utilisation.

    A row contains a phrase about the limit, the utilisation (None if unknown), and the outcome, such as "kept".
    """
    limits = report.acceptance.limits or ()
    rows = sorted(limits, key=lambda row: -math.inf if row.used is None else -row.used)
    return [(_limit_words(row, report), row.used, row.outcome) for row in rows]


def _limit_words(row: JudgedLimit, report: Report) -> str:
    """Return a phrase that states the limited value and the limit."""
    figure, shown_in = row.found, report.shown_in
    item = member(report, figure.label) if figure.label else row.on
    name = LIMIT_NAMES.get(row.kind)
    if name and item and row.kind != "output":
        name = f"{name} of {item}"
    elif not name:
        name = f"{row.name} ({item})" if item else row.name
    if figure.value is None and not figure.endless:
        return name
    # a report contains None for an infinite limit, because JSON has no infinity
    bound = math.inf if row.limit.value is None else row.limit.value
    value, allowed = with_limit(math.inf if figure.value is None else figure.value, bound, row.limit.unit, shown_in)
    if figure.value is None:
        lasts = (report.run.end.value or 0.0) - (report.run.start.value or 0.0)
        value = f"not settled within the run of {quantity(lasts, 's')}" if row.kind == "settling" else "endless"
    within = ", kept within twice this error" if figure.unreliable and row.outcome == KEPT else ""
    error = error_words(figure, shown_in)
    error = error.removesuffix(" (unreliable)") if within else error
    return f"{name} {value}{error} ({'minimum' if row.least else 'limit'} {allowed}{within})"


def questions(report: Report) -> list[str]:
    """Return questions to the user about unusual input values. The unit of an unusual value may be wrong."""
    return [finding.text for finding in report.trust if finding.heading == INPUTS]


def _theory(report: Report) -> list[str]:
    """Return phrases about the theory, the nonlinear check and the solid check.

    If the requested accuracy is not reached, the phrase about the theory states the requested and the reached accuracy.
    """
    theory, words = report.theory, []
    if theory.error is not None and theory.reached is False:
        words.append(f"{theory.name}, {percent(theory.accuracy or 0.0)} asked, {reached_words(theory)}")
    elif report.links and theory.problem:
        known = theory.problem in report.acceptance.problem
        words.append(theory.name + ("" if known else f", error unknown: {theory.problem}"))
    elif report.links and theory.error is not None:
        words.append(theory.name)
    return [*words, *_checks(report)]


def _checks(report: Report) -> Iterator[str]:
    return further_checks(report.nonlinear_check, report.solid_check, lambda label: member(report, label))


def further_checks(
    nonlinear: FurtherCheck | None, solid: FurtherCheck | None, shown: Callable[[str], str] = str
) -> Iterator[str]:
    """Yield phrases about the nonlinear and the solid check.

    `shown` is a function that returns the name of a beam from the label of the beam.
    """
    for check, name in ((nonlinear, "nonlinear check"), (solid, "solid check")):
        if not check:
            continue
        if check.problem:
            yield f"{name} CANNOT BE MADE: {check.problem}"
        elif check.cannot_tell:
            yield f"{name} cannot tell: the stated error is larger than the answer"
        elif check.largest is not None:
            outcome = "" if check.passed not in (True, False) else " agrees" if check.passed else " FAILED"
            more = f", without {', '.join(check.left_out)}" if check.left_out else ""
            if check.too_close_to_decide and check.own_errors:
                outcome = " TOO CLOSE TO DECIDE"
                more += f", error of the check up to {percent(sum(check.own_errors.values()))}"
            if check is solid and check.largest > UNRELIABLE:
                more += ": beam theory does not fit, and the stated errors count this difference"
            links = {label: _difference(row) for label, row in (check.links or {}).items()}
            of = f" of {shown(max(links, key=lambda label: links[label]))}" if links else ""
            yield f"{name}{outcome} (deflection from chord{of} {percent(check.largest)} apart{more})"


def _difference(row: Any) -> float:
    """Return the relative difference that a check found for a link. `row` is the entry of the link in the check."""
    return float((row["difference"] if isinstance(row, Mapping) else row) or 0.0)


def reached_words(theory: TheoryReport) -> str:
    """Return a phrase about the error that exceeds the requested accuracy.

    If the largest error of a single result exceeds the accuracy, the phrase names the main cause of the error.
    Otherwise the error of a curve over the cycle exceeds the accuracy, and the phrase names the curve with the largest
    error.
    """
    if theory.error is not None and theory.accuracy is not None and theory.error > theory.accuracy:
        largest = max(theory.errors, key=lambda part: theory.errors[part] or 0.0)
        return f"{percent(theory.error)} reached in the {theory.figure}: mostly {largest}"
    name, share = max(theory.courses.items(), key=lambda item: item[1] or 0.0)
    return f"{percent(share or 0.0)} reached in the curve of {name}"


def check_words(check: CheckReport) -> str:
    """Return a phrase about the finite element check: whether the results agree, and the largest differences."""
    if check.passed is None:
        return "check has nothing to compare"
    sizes = [] if check.largest is None else [number(check.largest, 2)]
    for theory, balance in check.momentum.items():
        if balance.compared and balance.largest is not None:
            of = "" if theory == QUASI_STATIC else f" of {theory} links"
            sizes.append(f"momentum{of} {'' if balance.passed else 'OFF BY '}{number(balance.largest, 2)}")
    return f"check {'agrees' if check.passed else 'FAILED'} ({', '.join(sizes)})"


def checked(report: Report) -> str:
    """Return a sentence about the estimated error and the checks of the deflection analysis."""
    theory, words = report.theory, []
    if theory.error is not None:
        worst = f" ({theory.figure})" if theory.figure else ""
        worst += f"; larger relative errors of small figures: {', '.join(theory.near_zero)}" if theory.near_zero else ""
        largest = "Largest estimated error of the largest deflection and stress, the output and limits"
        words.append(f"{largest}: {error_percent(theory.error)}{worst}")
    elif theory.problem and report.links:
        words.append(f"Error unknown: {theory.problem}")
    words.append(check_words(report.check) if report.check else "not compared with finite elements (--check)")
    return "; ".join([*words, *_checks(report)]) + "."
