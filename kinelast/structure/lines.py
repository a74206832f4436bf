"""Lines of text that reports on the structure of planar and spatial chains share."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from textwrap import wrap

from rigid.topology import Graph, Mobility, fundamental_loops, loop_walk

WIDTH = 110
NEARLY = 1e-3


def section(name: str, lines: Iterable[str]) -> str:
    """A heading, its lines indented, an empty line."""
    return "\n".join([name, *(f"  {line}".rstrip() for line in lines), ""])


def table_lines(rows: Sequence[Sequence[str]]) -> list[str]:
    """Rows with their columns set one below the other."""
    widths = [max(len(row[column]) for row in rows) for column in range(len(rows[0]))] if rows else []
    return ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)).rstrip() for row in rows]


def wrapped_lines(text: str) -> list[str]:
    """A sentence in lines that fit a terminal."""
    return wrap(text, WIDTH, subsequent_indent="  ", break_long_words=False, break_on_hyphens=False)


def loop_lines(graph: Graph) -> list[str]:
    """Each loop as the nodes and branches met on the way round."""
    lines = []
    for number, loop in enumerate(fundamental_loops(graph), 1):
        steps = []
        for branch, sign in loop_walk(graph, loop):
            ends = (graph.branches[branch].start, graph.branches[branch].end)
            steps.append((ends[::sign][0], graph.branches[branch].name))
        nodes = [node for node, _ in steps]
        first = nodes.index(graph.nodes[0]) if graph.nodes[0] in nodes else 0
        round_trip = [*steps[first:], *steps[:first]]
        way = " ".join(f"{node} -({joint})-" for node, joint in round_trip)
        lines += wrapped_lines(f"{number}: {way} {round_trip[0][0]}")
    return lines or ["none: an open chain"]


def rank_lines(ranks: Mobility) -> list[str]:
    """Both sides of the count by ranks, and how clear the decision was."""
    m, h = int(ranks.mobility), int(ranks.hyperstaticity)
    kinematic = (ranks.kinematic_unknowns, ranks.kinematic_equations, int(ranks.kinematic_rank))
    static = (ranks.static_unknowns, ranks.static_equations, int(ranks.static_rank))
    lines = [
        "kinematic side: I_c = {} unknowns, E_c = {} equations, rank r_c = {}".format(*kinematic),
        "static side:    I_s = {} unknowns, E_s = {} equations, rank r_s = {}".format(*static),
        f"mobility m = {m}, hyperstaticity h = {h}, mobility index m - h = {ranks.index}",
    ]
    if not ranks.sides_agree:
        lines.append("the two sides disagree: the position is too near a singular one to tell")
    if float(ranks.kept) < NEARLY:
        lines += wrapped_lines(
            f"nearly singular: the smallest singular value that counts is {float(ranks.kept):.1e} of the greatest. "
            "With slightly other dimensions m and h may both be greater: if these are rounded, give more digits"
        )
    return lines


def redundancy_lines(names: Sequence[str]) -> list[str]:
    """Which joints hold forces that statics does not tell."""
    if not names:
        return ["every joint force follows from statics"]
    return wrapped_lines("redundant: statics alone does not tell the forces in " + ", ".join(names))
