"""Oriented graphs: nodes and branches, incidence, spanning tree and independent loops."""

from collections.abc import Collection, Iterable
from dataclasses import dataclass

import numpy as np

from rigid.arrays import Integers
from rigid.parts import MechanismError


@dataclass(frozen=True)
class Branch:
    """Oriented branch: a joint between two links, or a bar between two joints."""

    name: str
    start: str
    end: str


@dataclass(frozen=True)
class Graph:
    """Oriented graph.

    Parameters
    ----------
    branches
        Columns of the matrices. Several branches may connect the same two nodes.
    nodes
        Rows of the matrices; by default in the order of the branches.

    Raises
    ------
    MechanismError
        A branch has an unknown node, or its ends are equal.
    """

    branches: tuple[Branch, ...]
    nodes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Collect the nodes and check the ends of every branch."""
        mentioned = dict.fromkeys(node for branch in self.branches for node in (branch.start, branch.end))
        object.__setattr__(self, "nodes", tuple(self.nodes or mentioned))
        for branch in self.branches:
            for node in (branch.start, branch.end):
                if node not in self.nodes:
                    raise MechanismError(f'branch "{branch.name}": there is no node "{node}"')
            if branch.start == branch.end:
                raise MechanismError(f'branch "{branch.name}" begins and ends at "{branch.start}"')


def incidence(graph: Graph) -> Integers:
    """Incidence matrix A, (nodes, branches): +1 if a branch leaves a node, -1 if it enters.

    References
    ----------
    Scutaru, Vlase, Marin, equation (2).

    Examples
    --------
    >>> incidence(Graph((Branch("1", "O", "A"), Branch("2", "A", "B"))))
    array([[ 1,  0],
           [-1,  1],
           [ 0, -1]])
    """
    row = {node: number for number, node in enumerate(graph.nodes)}
    matrix = np.zeros((len(graph.nodes), len(graph.branches)), np.int64)
    for number, branch in enumerate(graph.branches):
        matrix[row[branch.start], number] += 1
        matrix[row[branch.end], number] -= 1
    return matrix


def components(graph: Graph) -> tuple[tuple[str, ...], ...]:
    """Connected components as lists of nodes."""
    root = _Roots(graph.nodes)
    for branch in graph.branches:
        root.join(branch.start, branch.end)
    parts: dict[str, list[str]] = {}
    for node in graph.nodes:
        parts.setdefault(root.of(node), []).append(node)
    return tuple(tuple(part) for part in parts.values())


def cyclomatic_number(graph: Graph) -> int:
    """Number of independent loops: branches - nodes + components."""
    return len(graph.branches) - len(graph.nodes) + len(components(graph))


def spanning_tree(graph: Graph, preferred: Iterable[int] = ()) -> tuple[int, ...]:
    """Numbers of the branches of a spanning tree, ascending.

    Branches are taken in order, `preferred` ones first. A graph with several components has one tree in each.
    """
    root = _Roots(graph.nodes)
    ends = [(branch.start, branch.end) for branch in graph.branches]
    return tuple(sorted(number for number in (*preferred, *range(len(ends))) if root.join(*ends[number])))


def fundamental_loops(graph: Graph, tree: Collection[int] | None = None) -> Integers:
    """Fundamental loop matrix B_f, shape (loops, branches), with A B_f^T = 0.

    There is one row per branch outside the tree, ascending: its loop through the tree, with +1 for a branch in the
    loop's direction and -1 for one against it. `B_f = [-(A_t^-1 A_l)^T : I]`, in the order of the branches.

    Parameters
    ----------
    tree
        Numbers of the tree's branches; by default `spanning_tree(graph)`.

    Raises
    ------
    MechanismError
        The given branches are not a spanning tree.

    References
    ----------
    Scutaru, Vlase, Marin, equation (9), with [A]_f read as the tree's A_t.
    """
    chosen = sorted(spanning_tree(graph) if tree is None else tree)
    kept = [node not in {part[-1] for part in components(graph)} for node in graph.nodes]
    if set(spanning_tree(graph, chosen)) != set(chosen):
        names = ", ".join(graph.branches[number].name for number in chosen)
        raise MechanismError(f"the branches {names} are no spanning tree of {len(graph.nodes)} nodes")
    chords = [number for number in range(len(graph.branches)) if number not in chosen]
    reduced = incidence(graph)[kept]
    loops = np.zeros((len(chords), len(graph.branches)), np.int64)
    loops[:, chords] = np.eye(len(chords), dtype=np.int64)
    # A_t is unimodular: its inverse has only entries -1, 0, 1, so rounding is exact
    loops[:, chosen] = -np.rint(np.linalg.solve(reduced[:, chosen], reduced[:, chords])).astype(np.int64).T
    return loops


def loop_walk(graph: Graph, loop: Integers) -> tuple[tuple[int, int], ...]:
    """Branches along a loop with signs: (number, +1 or -1).

    `loop` is a row of the fundamental loop matrix; the walk begins with its last branch, in that branch's direction.
    """
    left = [int(number) for number in np.flatnonzero(loop)]
    steps: list[tuple[int, int]] = []
    number = left[-1]
    while left:
        left.remove(number)
        steps.append((number, int(loop[number])))
        at = _far_end(graph, *steps[-1])
        ahead = [other for other in left if _near_end(graph, other, int(loop[other])) == at]
        number = ahead[0] if ahead else -1
    return tuple(steps)


def _far_end(graph: Graph, number: int, sign: int) -> str:
    branch = graph.branches[number]
    return branch.end if sign > 0 else branch.start


def _near_end(graph: Graph, number: int, sign: int) -> str:
    return _far_end(graph, number, -sign)


class _Roots:
    """Union-find of connected nodes."""

    def __init__(self, nodes: Iterable[str]) -> None:
        self.above = {node: node for node in nodes}

    def of(self, node: str) -> str:
        while self.above[node] != node:
            node = self.above[node]
        return node

    def join(self, first: str, second: str) -> bool:
        """Join two components; False if already connected."""
        first, second = self.of(first), self.of(second)
        self.above[second] = first
        return first != second
