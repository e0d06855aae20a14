"""Data classes of `clfractal.records` beside Python's own, from the same classes."""

from __future__ import annotations

import copy
import dataclasses
import inspect
import pickle
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from clfractal import records

ROOT = Path(__file__).resolve().parent.parent
Maker = Callable[..., Any]
KINDS = [
    {"frozen": True, "slots": True},
    {"frozen": True},
    {"slots": True},
    {"frozen": True, "slots": True, "eq": False},
    {"slots": True, "kw_only": True},
]


def of(dataclass: Maker, **how: bool) -> Any:
    @dataclass(**how)
    class Thing:
        """A thing."""

        first: int
        second: str = "two"
        third: list[int] = dataclasses.field(default_factory=list, compare=False)
        hidden: int = dataclasses.field(default=4, repr=False, hash=False)

        def __post_init__(self) -> None:
            if self.first < 0:
                raise ValueError("below 0")

    return Thing


@records.dataclass(frozen=True, slots=True)
class Kept:
    """At a module's top, as pickling wants it."""

    value: int
    others: tuple[int, ...] = ()


@pytest.mark.parametrize("how", KINDS, ids=str)
def test_they_are_as_python_makes_them(how: dict[str, bool]) -> None:
    ours, theirs = of(records.dataclass, **how), of(dataclasses.dataclass, **how)
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs)).replace(
        "<factory>", str(dataclasses.MISSING)
    )
    assert ours.__match_args__ == theirs.__match_args__
    for one, another in ((ours, ours), (theirs, theirs)):
        a, b, c = one(first=1), another(first=1, third=[5]), another(first=1, hidden=5)
        assert (a == b) is how.get("eq", True)
        assert a != c
        assert a != 1
        assert dataclasses.replace(a, first=2).first == 2
        assert a.third == []
        assert a.third is not one(first=1).third
        with pytest.raises(ValueError, match="below 0"):
            one(first=-1)
        with pytest.raises(TypeError, match=r"Thing\.__init__\(\).*first"):
            one()
        with pytest.raises(TypeError, match="fourth"):
            one(first=1, fourth=4)
    made, other = ours(first=1), theirs(first=1)
    assert repr(made) == repr(other)
    assert dataclasses.asdict(made) == dataclasses.asdict(other)
    assert hasattr(made, "__dict__") == hasattr(other, "__dict__")
    assert (ours.__hash__ is None) is (theirs.__hash__ is None)
    if how.get("frozen") and how.get("eq", True):
        assert hash(made) == hash(other)
    assert copy.copy(made).first == 1


@pytest.mark.parametrize("dataclass", [records.dataclass, dataclasses.dataclass])
def test_nothing_of_a_frozen_one_changes(dataclass: Maker) -> None:
    thing = of(dataclass, frozen=True, slots=True)(1)
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot assign to field 'first'"):
        thing.first = 2
    with pytest.raises(dataclasses.FrozenInstanceError, match="cannot delete field 'first'"):
        del thing.first
    assert thing.first == 1


def test_what_a_class_says_itself_stays() -> None:
    @records.dataclass(frozen=True)
    class Own:
        """With words of its own."""

        value: int

        def __repr__(self) -> str:
            return "mine"

        def __eq__(self, other: object) -> bool:
            return True

        def __hash__(self) -> int:
            return 7

    assert repr(Own(1)) == "mine"
    assert Own(1) == Own(2)
    assert hash(Own(1)) == 7


def test_they_can_be_sent_before_any_was_made() -> None:
    sent = pickle.dumps(Kept(3, (4,)))
    code = f"import pickle; print(pickle.loads({sent!r}))"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "Kept(value=3, others=(4,))"


def test_one_that_holds_itself_is_shown() -> None:
    @records.dataclass(slots=True)
    class Loop:
        """Of itself."""

        inner: Any = None

    loop = Loop()
    loop.inner = loop
    assert repr(loop).endswith("Loop(inner=...)")


def test_all_data_classes_of_the_program_are_these() -> None:
    found = [
        path.relative_to(ROOT).as_posix()
        for path in (ROOT / "clfractal").rglob("*.py")
        if any(
            line.startswith("from dataclasses import")
            and "dataclass" in line.split("import", 1)[1].split(", ")
            for line in path.read_text().splitlines()
        )
    ]
    assert found == []
