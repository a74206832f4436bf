"""The answer against the speed of the drive, as a table and as curves."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from kinelast.figures.speeds import FIELDS, Speeds, speed_unit
from kinelast.outputs.table import Column, Table
from kinelast.scene.data import Scene

UNITS = dict(zip(FIELDS, ("m", "m", "Pa"), strict=True))


def speed_table(scene: Scene, result: Speeds) -> Table:
    """A row a speed: largest values of every beam with and without vibration, growth, the error, other figures."""
    answer = result.map
    ways = (("", answer.values), (" without vibration", answer.quasi_static))
    return Table(
        (
            Column("speed", result.speed, speed_unit(scene)),
            *(
                Column(f"{label}.{field}{way}", values[:, row, beam], UNITS[field])
                for way, values in ways
                for row, field in enumerate(FIELDS)
                for beam, label in enumerate(scene.labels)
            ),
            Column("growth over a cycle", answer.growth, "1"),
            Column("stable", answer.stable.tolist()),
            Column("error", np.where(answer.stable, answer.error, np.nan), "1"),
            *(
                Column(name, values, measure.unit)
                for name, (measure, values) in result.figures.items()
                if measure.figure.key not in FIELDS.values()
            ),
        )
    )


def draw_speeds(path: Path, scene: Scene, result: Speeds) -> None:
    """Largest chord deflection and stress against speed, with critical speeds and instability, as SVG."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    mpl.rcParams["svg.hashsalt"] = "kinelast"
    figure = Figure(figsize=(9, 6), layout="constrained")
    above, below = figure.subplots(2, 1, sharex=True)
    steady = result.map
    shown = (above, "chord", 1e3, "chord deflection [mm]"), (below, "mises", 1e-6, "von Mises stress [MPa]")
    for axes, field, scale, words in shown:
        with_, without = (scale * values[:, [*FIELDS].index(field)] for values in (steady.values, steady.quasi_static))
        for beam, label in enumerate(scene.labels):
            (line,) = axes.plot(result.speed, with_[:, beam], label=label)
            axes.plot(result.speed, without[:, beam], ":", color=line.get_color(), lw=1)
        for harmonic, (low, high) in result.critical.items():
            axes.axvspan(low, high, color="0.5", alpha=0.12, lw=0)
            axes.text(
                max(low, result.speed[0]),
                0.98,
                f" {harmonic}x",
                transform=axes.get_xaxis_transform(),
                va="top",
                fontsize=8,
            )
        for speed in result.speed[~steady.stable]:
            axes.axvline(speed, color="crimson", lw=0.8)
        axes.set_ylabel(f"largest {words}")
        axes.set_ylim(bottom=0)
        axes.set_xlim(result.speed[0], result.speed[-1])
    if result.highest:
        below.axvline(result.highest, color="black", ls="--", lw=1, label="limits hold up to here")
    below.set_xlabel("speed of the drive [rad/s]; grey: a multiple of it in the range of the lowest natural frequency")
    above.legend(title="dotted: without vibration", fontsize=8)
    figure.savefig(path, metadata={"Date": None})
