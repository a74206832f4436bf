"""From benchmarks/results/validity.csv: how many estimates are within a factor of two, and a picture of them."""

from __future__ import annotations

import csv
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Any

import measuring
import numpy as np

SMALL = 1e-3  # errors below which two are taken to agree
SLOW = 0.1  # speed over lowest frequency up to which a mechanism runs as designers have it
SHOWN = 3e-5, 10.0

Rows = Sequence[Mapping[str, Any]]


def agrees(estimate: Any, truth: Any) -> Any:
    """Whether errors are within a factor of two of one another, or both small.

    >>> agrees(np.array([0.01, 0.01, 1e-6]), np.array([0.019, 0.021, 9e-4])).tolist()
    [True, False, True]
    """
    near = (estimate <= 2 * truth) & (truth <= 2 * estimate)
    return near | ((estimate < SMALL) & (truth < SMALL))


def read() -> list[dict[str, str]]:
    """The rows as they were written; none where there is no file."""
    if not (measuring.RESULTS / "validity.csv").exists():
        return []
    with (measuring.RESULTS / "validity.csv").open(newline="", encoding="utf-8") as stream:
        return list(csv.DictReader(stream))


def column(rows: Rows, *names: str) -> Any:
    """Sum of columns, shape (rows,); nan where nothing was measured."""
    return np.sum([[float(each.get(name) or "nan") for each in rows] for name in names], axis=0)


def pairs(rows: Rows) -> dict[str, tuple[Any, Any]]:
    """Estimated and measured errors by what is estimated."""
    quasi, vibrating = column(rows, "quasi-static, measured"), column(rows, "elastodynamic, measured")
    return {
        "quasi-static": (column(rows, "vibration", "large displacement"), quasi),
        "elastodynamic": (column(rows, "large displacement", "time"), vibrating),
        "beam theory": (column(rows, "beam theory, estimate"), column(rows, "beam theory, measured")),
    }


def shares(rows: Rows) -> list[dict[str, Any]]:
    """Of every kind of estimate, how many hold."""
    found = []
    for name, (estimate, truth) in pairs(rows).items():
        known = np.isfinite(estimate + truth)
        own, was = estimate[known], truth[known]
        good, off = agrees(own, was), was / np.maximum(own, 1e-12)
        missed = off[~good]
        found.append(
            {
                "estimate": name,
                "mechanisms": int(known.sum()),
                "within a factor of two [%]": 100 * float(good.mean()) if known.any() else None,
                "too low": int((missed > 1).sum()),
                "too high": int((missed < 1).sum()),
                "measured over estimated: median": float(np.median(off[was > SMALL])) if (was > SMALL).any() else None,
                "9 of 10 below": float(np.quantile(off[was > SMALL], 0.9)) if (was > SMALL).any() else None,
                "greatest": float(off[was > SMALL].max()) if (was > SMALL).any() else None,
            }
        )
    return found


def main() -> None:
    """Print the tables and draw."""
    rows = read()
    print(len(rows), Counter(each["outcome"] for each in rows))
    known = [each for each in rows if each["outcome"] == "measured"]
    slow = [each for each in known if float(each["ratio"]) <= SLOW]
    for title, some in (("measured", known), ("slow", slow)):
        print(f"\n{title}: {len(some)}\n{measuring.as_text(shares(some))}")
    draw(known)


def draw(rows: Rows) -> None:
    """Measured against estimated errors, in percent."""
    ends = 100 * np.array(SHOWN)
    with measuring.figure("validity", 3, (10.5, 3.9)) as axes:
        for axis, (title, (estimates, truths)) in zip(axes, pairs(rows).items(), strict=True):
            axis.plot(ends, ends, color="0.4", lw=0.8)
            for factor in (0.5, 2):
                axis.plot(ends, factor * ends, color="0.4", lw=0.8, ls="--")
            axis.fill_between([ends[0], 100 * SMALL], ends[0], 100 * SMALL, color="0.9", zorder=0)
            estimate, truth = (np.clip(100 * part, *ends) for part in (estimates, truths))
            axis.scatter(estimate, truth, s=14, c="tab:blue", alpha=0.75, lw=0)
            axis.set(xscale="log", yscale="log", xlim=ends, ylim=ends, title=title, aspect="equal")
            axis.set_xlabel("estimated error [%]")
        axes[0].set_ylabel("measured error [%]")


if __name__ == "__main__":
    main()
