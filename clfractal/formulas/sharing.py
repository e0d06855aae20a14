"""Names for parts of expressions that are used several times."""

from __future__ import annotations

from clfractal.formulas.nodes import Call, Name, Node


class Sharing:
    """Gives parts names that no text can have; whoever writes the expression gives them their values before."""

    def __init__(self) -> None:
        self._count = 0
        self._pending: dict[Node, str] = {}

    def share(self, node: Node) -> Node:
        """The part, or a name for it if it is an operation."""
        if not isinstance(node, Call):
            return node
        if node not in self._pending:
            self._count += 1
            self._pending[node] = f"part {self._count}"
        return Name(self._pending[node], node.position)

    def taken(self) -> list[tuple[str, Node]]:
        """The names that were given since the last time, and their values, in order."""
        pairs = [(name, node) for node, name in self._pending.items()]
        self._pending = {}
        return pairs
