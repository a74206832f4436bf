"""The structure of a chain of joints in space as text for a terminal."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from kinelast.structure.lines import loop_lines, rank_lines, redundancy_lines, section, table_lines
from rigid.topology import Graph, SpatialJoint, joint_rates, mobility, spatial_chain, stressed_joints


def spatial_text(joints: Sequence[SpatialJoint], title: str = "", fixed: str | None = None) -> str:
    """The structure of a chain of joints in space, for structure alone, in lines for a terminal.

    Raises
    ------
    MechanismError
        The joints make no chain.
    """
    chain = spatial_chain(joints, fixed)
    ranks = mobility(chain)
    rows = [
        (
            joint.name,
            joint.kind.name,
            " - ".join(joint.links),
            _free(joint),
            _carried(joint),
        )
        for joint in joints
    ]
    stressed = [chain.graph.branches[number].name for number in stressed_joints(chain)]
    sections = [
        (f"Links ({len(chain.graph.nodes)})", [f"{chain.graph.nodes[0]} (fixed)", *chain.graph.nodes[1:]]),
        (f"Joints ({len(rows)})", table_lines([("", "", "", "leaves free", "carries"), *rows])),
        ("Independent loops", loop_lines(chain.graph)),
        ("Mobility", [*rank_lines(ranks), *redundancy_lines(stressed)]),
        ("Input-output laws", _laws(chain.freedoms, chain.graph, joint_rates(chain))),
    ]
    head = [title, "=" * len(title), ""] if title else []
    return "\n".join(head) + "\n".join(section(name, lines) for name, lines in sections)


def _free(joint: SpatialJoint) -> str:
    words = " ".join(joint.kind.freedoms) or "nothing"
    return f"{words}, Vz = p Ωz, p = {joint.pitch:g} m" if joint.kind.name == "helical" else words


def _carried(joint: SpatialJoint) -> str:
    words = " ".join(joint.kind.transmits) or "nothing"
    return f"{words}, N = -p Z" if joint.kind.name == "helical" else words


def _laws(
    freedoms: Sequence[Sequence[str]], graph: Graph, rates: np.ndarray[tuple[int, ...], np.dtype[np.float64]]
) -> list[str]:
    """With one mobility, all rates over the first that is not zero."""
    if rates.shape[1] == 0:
        return ["no motion"]
    if rates.shape[1] != 1:
        return [f"{rates.shape[1]} independent motions: choose as many inputs"]
    names = [
        (branch.name, freedom) for branch, words in zip(graph.branches, freedoms, strict=True) for freedom in words
    ]
    values = rates[:, 0]
    moving = np.flatnonzero(np.abs(values) > 1e-9 * np.abs(values).max())
    base = int(moving[0])
    lines = []
    for number, (joint, freedom) in enumerate(names):
        ratio = values[number] / values[base] if number in moving else 0.0
        if number != base:
            lines.append((f"{freedom} of {joint}", f"= {ratio:.10g} * {names[base][1]} of {names[base][0]}"))
    return table_lines(lines)
