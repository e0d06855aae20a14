"""What a text depends on: the questions that its writer asks about parameter values, and the answers that it got.

The writer knows parameter values only from these answers. So where other values give the same answers the text is the
same, and only the constants that are passed at run time are computed anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from clfractal.formulas.evaluate import as_function, finite
from clfractal.formulas.language import BoundFormula, Name, Node, names_in

# - folded: is the value 0 or 1, and so a number in the text? The answer is that number's text, else None.
# - exact: which number is it? The answer is its text.
# - truth: does the condition hold? The answer is True or False.
# - passed: nothing of it is in the text, whatever it is.
Kind = Literal["folded", "exact", "truth", "passed"]
Answer = str | bool | None


@dataclass(slots=True)
class Question:
    """One expression of parameters whose value the writer used.

    Attributes:
        kind: what it wanted to know of the value.
        function: gives the value.
        answer: what shaped the text.
        strict: the value must be a finite number. It need not be where only a branch uses it that is not taken.
        slot: its place among the run-time constants, if it has one.
    """

    kind: Kind
    function: Callable[[Mapping[str, float]], Any]
    answer: Answer
    strict: bool
    slot: int | None = None

    def answered(self, value: Any) -> Answer:
        """The answer for a value."""
        if self.kind == "truth":
            return bool(value)
        if self.kind == "exact":
            return repr(float(value))
        # The text of a number, because 0.0 and -0.0 are equal, but not the same text.
        return repr(float(value)) if self.kind == "folded" and (value == 0 or value == 1) else None


class Decisions:
    """Answers questions about one link's parameters, and keeps them in the order in which they were asked first."""

    def __init__(self, bound: BoundFormula) -> None:
        self.values = bound.values
        self.live = bound.live
        self.questions: list[Question] = []
        self._asked: dict[tuple[Kind, Node], Question] = {}

    def is_live(self, node: Node) -> bool:
        """Whether the expression uses a live parameter, so that nothing of its value may be in the text."""
        return bool(self.live) and not self.live.isdisjoint(names_in(node))

    def exact(self, name: str) -> float:
        """The value of a baked parameter, for the text."""
        self._ask("exact", Name(name), strict=True)
        return self.values[name]

    def folded(self, node: Node, *, strict: bool) -> float | None:
        """The value if it is 0 or 1 and no live parameter is in it; None if it is to be passed at run time."""
        kind: Kind = "passed" if self.is_live(node) else "folded"
        answer = self._ask(kind, node, strict=strict).answer
        return float(answer) if isinstance(answer, str) else None

    def truth(self, node: Node) -> bool:
        """Whether a condition without live parameters holds."""
        return self._ask("truth", node, strict=True).answer is True

    def place(self, node: Node, slot: int, *, strict: bool) -> None:
        """Gives a value its place among the run-time constants."""
        known = self._asked.get(("folded", node)) or self._ask("passed", node, strict=strict)
        known.slot = slot

    def _ask(self, kind: Kind, node: Node, *, strict: bool) -> Question:
        key = (kind, node)
        question = self._asked.get(key)
        if question is None:
            question = Question(kind, as_function(node), None, strict)
            question.answer = question.answered(self._value(question))
            self.questions.append(question)
            self._asked[key] = question
        elif strict and not question.strict:
            question.strict = True
            self._value(question)
        return question

    def _value(self, question: Question) -> Any:
        value = question.function(self.values)
        return finite(value) if question.strict else value


def replayed(
    questions: tuple[Question, ...], values: Mapping[str, float], constants: list[float]
) -> list[float] | None:
    """Fills the constants for other values; None where these give another answer, and so another text.

    It is also None where a value is no finite number that has to be one: the writer tells what is wrong then.
    """
    for question in questions:
        value = question.function(values)
        if question.strict and not math.isfinite(value):
            return None
        if question.kind != "passed" and question.answered(value) != question.answer:
            return None
        if question.slot is not None:
            constants[question.slot] = float(value)
    return constants
