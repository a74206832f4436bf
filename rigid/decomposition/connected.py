"""Connected sets of nodes, such as links."""

from collections.abc import Hashable, Iterable
from typing import Any


class ConnectedSets:
    """Union-find structure: each connected set of nodes has one node as its root. At first, each set is one node."""

    def __init__(self, nodes: Iterable[Hashable]) -> None:
        self.above = {node: node for node in nodes}

    def root(self, node: Hashable) -> Any:
        """Return the root of the set that contains a node."""
        while self.above[node] != node:
            node = self.above[node]
        return node

    def join(self, first: Hashable, second: Hashable) -> bool:
        """Join the sets of two nodes. Return False if both nodes are already in the same set."""
        first, second = self.root(first), self.root(second)
        self.above[second] = first
        return first != second
