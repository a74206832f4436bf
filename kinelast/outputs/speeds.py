"""Output of a speed study: table, plot, plain data and sentences.

A speed study computes the results at several speeds of a drive, and the limit speed: the highest speed up to which all
limits are met and no link yields. A peak is a speed at which a deflection or stress has a maximum, for example due to
resonance.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np

from elastic.elastodynamics import Resonance
from kinelast.answers.refusals import STRENGTH
from kinelast.figures.leading_drive import leading_drive, speed_unit
from kinelast.figures.output import output_of
from kinelast.figures.registry import figures_of, limits_of
from kinelast.outputs.table import Column, Table
from kinelast.reports.limits import TOO_NEAR, UNKNOWN
from kinelast.scene.data import Scene
from kinelast.speed_study.speed_limits import SpeedLimit
from kinelast.speed_study.speeds import FIGURE_OF_FIELD, Speeds
from kinelast.values.figure import drive_words, items_of
from kinelast.values.numbers import UNRELIABLE, percent, quantity, scale_of, unit_words
from kinelast.values.reading import known

NEAR = 0.002  # relative accuracy with which the limit speed is computed
MAX_DISTANCE = 0.05  # resonance at a peak explains errors at a speed if |speed of the peak / speed - 1| <= MAX_DISTANCE
LABEL_ROOM = 0.04  # (smallest distance between two labelled peaks) / (range of speeds)
UNITS = dict(zip(FIGURE_OF_FIELD, ("m", "m", "Pa"), strict=True))


def speed_table(scene: Scene, result: Speeds) -> Table:
    """Return a table with a row for each speed.

    The columns contain the largest deflections and stresses of each beam with and without vibration, the growth of
    vibration over a cycle, the verdict, other results, and the errors of results.
    """
    answer = result.map
    ways = (("", answer.values), (" without vibration", answer.quasi_static))
    of_fields = {key: name for name, key in FIGURE_OF_FIELD.items()}
    return Table(
        (
            Column("speed", result.speed, speed_unit(scene)),
            *(
                Column(f"{label}.{field}{way}", values[:, row, beam], UNITS[field])
                for way, values in ways
                for row, field in enumerate(FIGURE_OF_FIELD)
                for beam, label in enumerate(scene.labels)
            ),
            Column("growth over a cycle", answer.growth, "1"),
            Column("stable", answer.stable.tolist()),
            Column("error", result.error, "1"),
            *([Column("verdict", result.verdicts)] if result.verdicts else []),
            Column("asked for", result.asked.tolist()),
            *(
                Column(name, values, measure.unit)
                for name, (measure, values, _) in result.figures.items()
                if measure.figure.key not in FIGURE_OF_FIELD.values()
            ),
            *(
                Column(f"error of {name}", errors, measure.unit)
                for name, (measure, _, errors) in result.figures.items()
                if measure.items is None or measure.figure.key in of_fields
            ),
        )
    )


PANELS = {
    "w": (1e3, "deflection [mm]"),
    "chord": (1e3, "chord deflection [mm]"),
    "mises": (1e-6, "von Mises stress [MPa]"),
}
PEAKS = "5x2: the 5th harmonic of the cycle meets the 2nd natural mode; mode 2: it vibrates without such a harmonic"


def draw_speeds(path: Path, scene: Scene, result: Speeds) -> None:
    """Plot results as functions of the drive speed, and write the plot as SVG.

    The plot shows the chord deflection, the stress, and the result whose limit determines the limit speed. If the scene
    limits the deflection, the plot also shows the deflection. Peaks, speeds without a steady state, and the limit speed
    are marked.
    """
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams["svg.hashsalt"] = "kinelast"
    decides = result.limit.limit.figure if result.limit and result.limit.limit else ""
    limits = limits_of(scene)
    fields = [
        field
        for field in FIGURE_OF_FIELD
        if field != "w" or any(limit.figure == FIGURE_OF_FIELD["w"] for limit in limits)
    ]
    extra = [
        (name, each)
        for name, each in result.figures.items()
        if name == decides and name not in FIGURE_OF_FIELD.values()
    ]
    figure = Figure(figsize=(9, 3 * len([*fields, *extra])), layout="constrained")
    panels = figure.subplots(len([*fields, *extra]), 1, sharex=True)
    factor, unit = scene.shown_in.get(speed_unit(scene), (1.0, speed_unit(scene)))
    speed, between = factor * result.speed, factor * result.between[0]
    for axes, field in zip(panels, fields, strict=False):
        scale, words = PANELS[field]
        with_, without = (
            scale * values[:, [*FIGURE_OF_FIELD].index(field)]
            for values in (result.map.values, result.map.quasi_static)
        )
        for beam, name in enumerate(scene.beam_names):
            (line,) = axes.plot(between, scale * result.between[1][[*FIGURE_OF_FIELD].index(field), beam], label=name)
            axes.plot(speed, without[:, beam], ":", color=line.get_color(), lw=1)
        for limit in limits:
            if limit.figure == FIGURE_OF_FIELD[field]:
                axes.axhline(scale * float(limit.bound), color="black", ls="-.", lw=1, label="limit")
        axes.set_ylabel(f"largest {words}")
        if np.nanmax(with_, initial=0.0) > 0.0:
            axes.set_yscale("log")
        _label_peaks(axes, result, with_, factor)
    for axes, (name, (measure, values, _)) in zip(panels[len(fields) :], extra, strict=True):
        scale, prefixed = scene.shown_in.get(measure.unit) or scale_of(np.nanmax(values, initial=0.0), measure.unit)
        axes.plot(speed, scale * values, label=name)
        if result.limit and result.limit.limit:
            axes.axhline(scale * float(result.limit.limit.bound), color="black", ls="-.", lw=1, label="limit")
        axes.set_ylabel(f"{measure.figure.name} [{unit_words(prefixed)}]")
    for axes in panels:
        for low, high in result.unstable:
            axes.axvspan(factor * low, factor * high, color="crimson", alpha=0.25, lw=0, label="no steady state")
        if result.limit and result.highest:
            axes.axvline(factor * result.highest, color="black", ls="--", lw=1, label="limits hold up to here")
        axes.legend(title="dotted: without vibration", fontsize=8)
    panels[-1].set_xlim(speed[0], speed[-1])
    panels[-1].set_xlabel(f"speed of the drive [{unit}]\n{PEAKS}")
    figure.savefig(path, metadata={"Date": None})


def _label_peaks(axes: Any, result: Speeds, values: Any, factor: float) -> None:
    """Label peaks with their harmonic and mode. If two labels would overlap, label only the higher peak."""
    taken: list[float] = []
    room = LABEL_ROOM * (result.speed[-1] - result.speed[0])
    sizes = {peak: np.nanmax(values[result.speed == peak.speed], initial=-np.inf) for peak in result.peaks}
    for peak in sorted(sizes, key=lambda peak: -sizes[peak]):
        if peak.resonance is None or np.isinf(sizes[peak]) or any(abs(peak.speed - other) < room for other in taken):
            continue
        taken.append(peak.speed)
        name = (
            f"{peak.resonance.harmonic}x{peak.resonance.mode}"
            if peak.resonance.coincides
            else f"mode {peak.resonance.mode}"
        )
        axes.annotate(
            name,
            (factor * peak.speed, sizes[peak]),
            (0, 3),
            textcoords="offset points",
            ha="center",
            fontsize=7,
            clip_on=True,
        )


def speed_figures(result: Speeds, scene: Scene) -> dict[str, Any]:
    """Return the results of a speed study as plain data for JSON. The entry `words` contains sentences.

    At speeds without a steady state, results are nan, which becomes null in JSON.
    """
    ways = {"values": result.map.values, "without_vibration": result.map.quasi_static}
    curves = {
        kind: {
            field: {label: values[:, k, beam].tolist() for beam, label in enumerate(scene.labels)}
            for k, field in enumerate(FIGURE_OF_FIELD)
        }
        for kind, values in ways.items()
    }
    return {
        "words": list(_words(result, scene)),
        "outcome": _outcome(result, scene),
        "unit": speed_unit(scene),
        "speed": result.speed.tolist(),
        "asked": result.asked.tolist(),
        **curves,
        "figures": {
            name: {"unit": measure.unit, "values": values.tolist(), "errors": errors.tolist()}
            for name, (measure, values, errors) in result.figures.items()
            if measure.items is None
        },
        "between": {
            "speed": [float(f"{speed:.8g}") for speed in result.between[0]],
            "values": {
                field: {
                    label: [float(f"{value:.6g}") for value in result.between[1][k, beam]]
                    for beam, label in enumerate(scene.labels)
                }
                for k, field in enumerate(FIGURE_OF_FIELD)
            },
        },
        "from": float(result.speed[0]),
        "to": float(result.speed[-1]),
        "count": int(result.asked.sum()),
        "highest_within_limits": result.highest,
        "verdicts": list(result.verdicts),
        "limit": _limit_figures(result.limit, scene) if result.limit else None,
        "peaks": [
            {
                "speed": peak.speed,
                "field": peak.field,
                "of": scene.labels[peak.beam],
                "value": peak.value,
                "resonance": _resonance_figures(peak.resonance, scene),
            }
            for peak in result.peaks
        ],
        "error": result.error.tolist(),
        "unstable": [float(speed) for speed in result.speed[~result.map.stable]],
        "unstable_ranges": [list(span) for span in result.unstable],
        "critical": {str(harmonic): list(span) for harmonic, span in result.critical.items()},
    }


def _limit_figures(limit: SpeedLimit, scene: Scene) -> dict[str, Any]:
    return {
        "kind": limit.limit.kind if limit.limit else None,
        "of": _item_of(limit, scene) or None,
        "above": limit.above,
        "too_close_to_decide_up_to": known(limit.broken),
        "resonance": _resonance_figures(limit.resonance, scene),
        "words": limit_words(limit, scene),
    }


def _resonance_figures(resonance: Resonance | None, scene: Scene) -> dict[str, Any] | None:
    if resonance is None:
        return None
    parts = {"harmonic": resonance.harmonic, "mode": resonance.mode, "met": resonance.coincides}
    return {**parts, "of": scene.labels[resonance.beam], "words": resonance_words(resonance, scene)}


def ordinal(count: int) -> str:
    """Return a number as an ordinal, such as "1st".

    >>> [ordinal(count) for count in (1, 2, 3, 4, 11, 22)]
    ['1st', '2nd', '3rd', '4th', '11th', '22nd']
    """
    ending = "th" if count % 100 in (11, 12, 13) else {1: "st", 2: "nd", 3: "rd"}.get(count % 10, "th")
    return f"{count}{ending}"


def resonance_words(resonance: Resonance, scene: Scene) -> str:
    """Return a phrase about a natural mode that vibrates, and about the harmonic of the cycle that excites the mode.

    The phrase names the beam with the largest strain energy in the mode.
    """
    mode = f"the {ordinal(resonance.mode)} mode (mostly {scene.beam_names[resonance.beam]})"
    return f"{ordinal(resonance.harmonic)} harmonic meets {mode}" if resonance.coincides else f"{mode} vibrates"


def limit_words(limit: SpeedLimit, scene: Scene) -> str:
    """Return a phrase about the cause of the limit speed: the limit that is not met, or the link that yields.

    If there is a resonance just above the limit speed, the phrase also names the resonance.
    """
    if limit.limit is None:
        return "no steady state exists: vibration grows"
    kinds = {"deflection": "deflection", "chord": "deflection from the chord", "safety": "safety against yield"}
    names = {figure.key: figure.name for figure in figures_of(output_of(scene))}
    kind = kinds.get(limit.limit.kind) or names[limit.limit.figure]
    words = ", ".join(filter(None, (scene.shown_items(limit.limit.of)[limit.item], kind)))
    if limit.problem:
        words += f" cannot be judged: {limit.problem}"
    elif limit.limit == STRENGTH:
        words = f"{scene.beam_names[limit.item]} yields"
    return f"{words}: {resonance_words(limit.resonance, scene)}" if limit.resonance else words


def _item_of(limit: SpeedLimit, scene: Scene) -> str:
    """Return the name of the item (such as a link) that determines the limit speed.

    Return an empty text if the limit applies to the whole machine.
    """
    return items_of(scene, limit.limit.of)[limit.item] if limit.limit else ""


def _words(result: Speeds, scene: Scene) -> Iterator[str]:
    """Yield sentences about the limit speed, speeds without a steady state, and errors."""
    printed = _printed(scene)
    if sum(bool(getattr(law, "speed", 0.0)) for law in scene.laws) > 1:
        name = drive_words(scene.mechanism)[leading_drive(scene)][0]
        yield f"speeds are those of {name}, the other drives keep their ratio to it"
    beyond = [number for number, words in enumerate(result.buckles) if words]
    if beyond:
        first, last = printed(result.buckling), printed(result.speed[beyond[-1]])
        yield f"not acceptable from {first} to {last}: {result.buckles[beyond[-1]]}"
    yield _outcome(result, scene)
    yielding = result.figures[STRENGTH.figure][1] < STRENGTH.bound if result.yielding else np.zeros(0, bool)
    if result.yielding and yielding.any():
        first, link = printed(result.yielding[0]), scene.member_names[result.yielding[1]]
        counts = Counter(verdict for verdict, yields in zip(result.verdicts, yielding, strict=False) if yields)
        rows = ", ".join(f"{count} {verdict}" for verdict, count in counts.items())
        on = yielding[yielding.argmax() :].all()
        where = f"from {first} ({link}) on" if on else f"first at {first} ({link})"
        yield f"a link yields at {yielding.sum()} of {len(yielding)} speeds, {where}" + (f": {rows}" if rows else "")
    for low, high in result.unstable:
        yield f"no steady state from {printed(low)} to {printed(high)}: the links' vibration grows"
    yield from _error_words(result, scene, printed)


def _printed(scene: Scene) -> Callable[[Any], str]:
    """Return a function that converts a drive speed to text with a unit."""
    return lambda speed: quantity(float(speed), speed_unit(scene), shown_in=scene.shown_in)


def _outcome(result: Speeds, scene: Scene) -> str:
    """Return a sentence about the limit speed and its cause."""
    printed, limit = _printed(scene), result.limit
    if result.highest is None:
        return "no limits are set, so there is no limit speed"
    if not result.highest:
        words = {TOO_NEAR: "are too close to decide", UNKNOWN: "cannot be judged"}
        outcome = words.get(result.verdicts[0], "do not hold")
        why = f" ({limit_words(limit, scene)})" if limit else ""
        return f"limits {outcome} at the lowest speed, {printed(result.speed[0])}{why}"
    hold = f"all limits hold up to {printed(result.highest)}"
    if limit is None:
        return f"{hold}; above it a link buckles" if any(result.buckles) else f"{hold}, the highest requested speed"
    near = ""
    if limit.broken > (1 + NEAR) * limit.above:
        known = math.isfinite(limit.broken)
        near = f"; too close to decide up to {printed(limit.broken)}" if known else "; above it too close to decide"
    return f"{hold} ({limit_words(limit, scene)}){near}"


def _error_words(result: Speeds, scene: Scene, printed: Callable[[Any], str]) -> Iterator[str]:
    """Yield a sentence about the speeds at which the error of the results exceeds the requested accuracy.

    Yield nothing if there are no such speeds. If there is a resonance near the speed with the largest error, the
    sentence names the resonance.
    """
    wanted = scene.theory.wanted
    missed = np.flatnonzero(result.error > wanted)
    if not len(missed) or np.isnan(result.error).all():
        return
    worst, unreliable = int(np.nanargmax(result.error)), result.error > UNRELIABLE
    first, at = (printed(result.speed[number]) for number in (missed[0], worst))
    words = f"{len(missed)} of {len(result.speed)} speeds, from {first} on, have errors beyond {percent(wanted)}"
    near = min(result.peaks, key=lambda peak: abs(peak.speed - result.speed[worst]), default=None)
    if not unreliable.any():
        yield f"{words}, up to {percent(result.error[worst])} at {at} (a report at this speed names the cause)"
        return
    words += f", {unreliable.sum()} of them unreliable"
    if near is None or near.resonance is None or abs(near.speed / result.speed[worst] - 1.0) > MAX_DISTANCE:
        yield f"{words}, for example {at}"
    else:
        resonance = resonance_words(near.resonance, scene)
        yield f"{words}: damping decides at resonance, for example at {printed(near.speed)}, where {resonance}"
