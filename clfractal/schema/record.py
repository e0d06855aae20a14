"""What kernels read of an element, declared without NumPy: numbers of its own in the record of its family."""

from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal


@dataclass(frozen=True, slots=True)
class Number:
    """A number of a record, or `count` of them; as `Field` of `clfractal/device/structs.py`, which it becomes."""

    name: str
    type: Literal["real", "int"]
    count: int = 0
    meaning: str = ""

    @property
    def nothing(self) -> object:
        """Its value in records of kinds that have no such number."""
        return (0,) * self.count if self.count else 0


def all_numbers(of_kinds: Iterable[Iterable[Number]]) -> tuple[Number, ...]:
    """What a family's record has beside what all its kinds have: kinds may share numbers of one name.

    Raises:
        ValueError: two have one name and differ.
    """
    found: dict[str, Number] = {}
    for numbers in of_kinds:
        for each in numbers:
            if found.setdefault(each.name, each) != each:
                raise ValueError(f"two kinds have different numbers {each.name}")
    return tuple(found.values())
