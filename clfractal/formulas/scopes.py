"""An emitter whose names get new values: variables, and what is written within branches and loops."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from clfractal.formulas.emit import Emitter
from clfractal.formulas.nodes import Node
from clfractal.formulas.products import Value

Kind = Literal["flat", "varying"]


@dataclass(frozen=True, slots=True)
class Scope:
    """What was there before a part that is written by itself."""

    lines: list[str]
    bindings: dict[str, Value]
    known: dict[tuple[str, ...], Value]


class ScopedEmitter(Emitter):
    """An `Emitter` for statements."""

    __slots__ = ()

    def rebind(self, name: str, value: Value) -> None:
        """Gives a name another value."""
        self.bindings[name] = value
        # They are found by expressions, whose names may mean something else now.
        self._pairs.clear()

    def closed(self, node: Node) -> Node | None:
        """An expression of parameters alone, with names filled in; None for any other."""
        return self._closed(node)

    def passed(self, node: Node) -> str:
        """C text of a plain number that the host passes; the truth of a condition is 1 or 0."""
        return self._passed(node)

    def is_constant(self, name: str) -> bool:
        """Whether a name depends on parameters alone."""
        return self._is_constant(name)

    def condition(self, node: Node) -> str | bool:
        """A condition as the text of a mask, or its truth when it is known now."""
        return self._condition(node)

    def name(self) -> str:
        """A new name for C text."""
        return self._name()

    def mask(self, text: str) -> str:
        """A mask that is computed once."""
        name = self._name()
        self.lines.append(f"const mask {name} = {text};")
        return name

    def enter(self) -> Scope:
        """Begins a part that is written by itself: what it gives names and has computed is known in it alone."""
        scope = Scope(self.lines, self.bindings, self._known)
        self.lines, self.bindings, self._known = [], dict(self.bindings), dict(self._known)
        # Constants in it need not be numbers: it may be left out.
        self._arms += 1
        self._pairs.clear()
        return scope

    def leave(self, scope: Scope) -> None:
        """Ends it; its lines are whoever's who wrote them."""
        self.lines, self.bindings, self._known = scope.lines, scope.bindings, scope.known
        self._arms -= 1
        self._pairs.clear()

    def c_type(self, kind: str) -> str:
        """The C type of a value of this kind."""
        return "dual" if self.number_type == "dual" and kind == "varying" else "real"

    def variable(self, kind: Kind, value: Value | None = None) -> Value:
        """A new variable, which may begin with a value."""
        result = Value(self._name(), kind)
        begin = "" if value is None else f" = {self.full(value, result)}"
        self.lines.append(f"{self.c_type(kind)} {result.text}{begin};")
        return result

    def full(self, value: Value, variable: Value) -> str:
        """A value as text of the type of a variable."""
        return self._lift(value) if self.c_type(variable.kind) == "dual" else value.text

    def copied(self, text: str, variable: Value) -> str:
        """What a text stands for now, in a name of its own."""
        name = self._name()
        self.lines.append(f"const {self.c_type(variable.kind)} {name} = {text};")
        return name

    def picked(self, variable: Value, mask: str, text: str) -> str:
        """The statement that changes a variable in the lanes of a mask."""
        pick = "dual_where" if self.c_type(variable.kind) == "dual" else "pick"
        return f"{variable.text} = {pick}({mask}, {text}, {variable.text});"

    def select(self, mask: str, yes: Value, no: Value) -> Value:
        """`yes` in the lanes of a mask, else `no`."""
        return yes if yes.text == no.text else self._select(mask, yes, no)
