"""Skeleton diagram of a mechanism as drawn: links as lines and plates, joints and the ground by their symbols."""

from __future__ import annotations

from io import StringIO
from typing import TYPE_CHECKING

import numpy as np

from kinelast.outputs.sheet import PAPER, Sheet
from rigid import Mechanism
from rigid.topology import assembled

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from kinelast.scene.data import Scene


def skeleton_svg(subject: Mechanism | Scene) -> str:
    """The skeleton diagram as SVG text.

    Raises
    ------
    MechanismError
        The mechanism does not close near its drawing.
    """
    from matplotlib import rc_context

    figure = skeleton(subject)
    text = StringIO()
    with rc_context({"svg.hashsalt": "skeleton", "svg.fonttype": "none"}):
        figure.savefig(text, format="svg", metadata={"Date": None})
    return text.getvalue()


def skeleton(subject: Mechanism | Scene) -> Figure:
    """The skeleton diagram as a matplotlib figure, to be saved in any format."""
    from matplotlib.figure import Figure

    mechanism = subject if isinstance(subject, Mechanism) else subject.mechanism
    here = assembled(mechanism)
    drawing = Sheet(here)
    width, height = drawing.extent
    tall = float(np.clip(8.0 * height / width, 3.0, 9.0))
    figure = Figure(figsize=(8.0, tall), layout="constrained", facecolor=PAPER)
    axes = figure.add_subplot()
    axes.set_aspect("equal")
    axes.set_axis_off()
    drawing.axes = axes
    drawing.draw()
    axes.margins(0.04)
    axes.autoscale_view()
    return figure
