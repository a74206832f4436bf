"""Oriented graphs: nodes and branches, incidence, spanning tree and independent loops."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from rigid.arrays import ArrayLike, Integers
from rigid.names import counted
from rigid.parts import MechanismError


@dataclass(frozen=True)
class Branch:
    """An oriented branch: a joint between two links, or a bar between two joints."""

    name: str
    start: str
    end: str


@dataclass(frozen=True)
class Graph:
    """An oriented graph.

    Parameters
    ----------
    branches
        In the order of the columns of its matrices. Several may join the same two nodes.
    nodes
        In the order of the rows; as the branches first mention them where left out.

    Raises
    ------
    MechanismError
        A branch begins or ends at a node that is not there, or where it begins.
    """

    branches: tuple[Branch, ...]
    nodes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Find the nodes and see that every branch has two of them."""
        mentioned = dict.fromkeys(node for branch in self.branches for node in (branch.start, branch.end))
        object.__setattr__(self, "nodes", tuple(self.nodes or mentioned))
        for branch in self.branches:
            for node in (branch.start, branch.end):
                if node not in self.nodes:
                    raise MechanismError(f'branch "{branch.name}": there is no node "{node}"')
            if branch.start == branch.end:
                raise MechanismError(f'branch "{branch.name}" begins and ends at "{branch.start}"')


def incidence(graph: Graph) -> Integers:
    """Incidence matrix A, shape (nodes, branches): +1 where a branch leaves a node, -1 where it enters.

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


def graph_from_incidence(matrix: ArrayLike, nodes: Sequence[str] = (), branches: Sequence[str] = ()) -> Graph:
    """The graph that has a given incidence matrix; names are 1, 2, ... where left out.

    Raises
    ------
    MechanismError
        A column that does not hold one +1, one -1 and zeros.
    """
    entries = np.asarray(matrix)
    rows, columns = ([str(number + 1) for number in range(size)] for size in entries.shape)
    nodes, names = tuple(nodes or rows), tuple(branches or columns)
    made = []
    for name, column in zip(names, entries.T, strict=True):
        leaves, enters = np.flatnonzero(column == 1), np.flatnonzero(column == -1)
        if len(leaves) != 1 or len(enters) != 1 or np.count_nonzero(column) != 2:
            ends = f"leaves {counted(len(leaves), 'node')} and enters {len(enters)}"
            raise MechanismError(f'branch "{name}" {ends}: it must leave one, enter one')
        made.append(Branch(name, nodes[leaves[0]], nodes[enters[0]]))
    return Graph(tuple(made), nodes)


def components(graph: Graph) -> tuple[tuple[str, ...], ...]:
    """Nodes that hang together, part by part."""
    root = _Roots(graph.nodes)
    for branch in graph.branches:
        root.join(branch.start, branch.end)
    parts: dict[str, list[str]] = {}
    for node in graph.nodes:
        parts.setdefault(root.of(node), []).append(node)
    return tuple(tuple(part) for part in parts.values())


def cyclomatic_number(graph: Graph) -> int:
    """Number of independent loops: branches - nodes + parts."""
    return len(graph.branches) - len(graph.nodes) + len(components(graph))


def spanning_tree(graph: Graph, preferred: Iterable[int] = ()) -> tuple[int, ...]:
    """Numbers of the branches of a tree that reaches every node, ascending.

    Branches are taken in their order, `preferred` ones before all others. In a graph of several parts: one tree each.
    """
    root = _Roots(graph.nodes)
    ends = [(branch.start, branch.end) for branch in graph.branches]
    return tuple(sorted(number for number in (*preferred, *range(len(ends))) if root.join(*ends[number])))


def fundamental_loops(graph: Graph, tree: Collection[int] | None = None) -> Integers:
    """Fundamental loop matrix B_f, shape (loops, branches), so that A B_f^T = 0.

    Row by row the branches outside the tree, ascending: the loop that each closes through the tree and runs along; +1
    for a branch met along its direction, -1 against it. `B_f = [-(A_t^-1 A_l)^T : I]`, in the order of the branches.

    Parameters
    ----------
    tree
        Numbers of the tree's branches; `spanning_tree(graph)` where left out.

    Raises
    ------
    MechanismError
        The branches given are no spanning tree.

    References
    ----------
    Scutaru, Vlase, Marin, equation (9), its [A]_f read as the tree's A_t.
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
    # A_t is unimodular: its inverse has no entries but -1, 0, 1, and rounding makes it exact.
    loops[:, chosen] = -np.rint(np.linalg.solve(reduced[:, chosen], reduced[:, chords])).astype(np.int64).T
    return loops


def loop_walk(graph: Graph, loop: Integers) -> tuple[tuple[int, int], ...]:
    """Branches of a loop as met on the way round, each with its sign: (number, +1 or -1).

    `loop` is a row of the fundamental loop matrix; the walk begins with its last branch, along it.
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
    """Which nodes hang together, while branches join."""

    def __init__(self, nodes: Iterable[str]) -> None:
        self.above = {node: node for node in nodes}

    def of(self, node: str) -> str:
        while self.above[node] != node:
            node = self.above[node]
        return node

    def join(self, first: str, second: str) -> bool:
        """Join two parts; False where they are one already."""
        first, second = self.of(first), self.of(second)
        self.above[second] = first
        return first != second
