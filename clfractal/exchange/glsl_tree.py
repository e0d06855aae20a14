"""What a fragment's code is made of: expressions, statements, functions, numbers that the user chooses."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.errors import Where

SIZES = {"float": 1, "int": 1, "uint": 1, "bool": 1, "double": 1}
SIZES |= {f"{kind}vec{size}": size for kind in ("", "i", "b", "u", "d") for size in (2, 3, 4)}
"""Numbers in a value of each type."""
MATRICES = {f"{kind}mat{size}": size for kind in ("", "d") for size in (2, 3, 4)}
MATRICES |= {f"mat{size}x{size}": size for size in (2, 3, 4)}
WHOLE = ("int", "uint", *(f"{kind}vec{size}" for kind in ("i", "u") for size in (2, 3, 4)))
"""Types of whole numbers."""
TYPES = frozenset((*SIZES, *MATRICES))


@dataclass(frozen=True, slots=True)
class Expression:
    """A value.

    Attributes:
        kind: `number`, `name`, `member` (name is the member's), `item`, `call` (of a function or a type), `operator`,
            `assign` (name is its sign), `list` (values with commas) and `before`/`after` (`++` and `--`).
        name: what the kind says.
        whole: of a number: whether it is an `int`.
    """

    kind: str
    name: str
    parts: tuple[Expression, ...]
    where: Where
    number: float = 0.0
    whole: bool = False


@dataclass(frozen=True, slots=True)
class Statement:
    """Something to do.

    Attributes:
        kind: `do` (an expression), `declare` (name; value or nothing), `if`, `loop`, `switch`, `case`, `leave`,
            `return`, `block`.
        values: the expressions; of a `loop` its condition, or none.
        blocks: of `if` two, of `loop` its beginning, its step and its body.
        type: of a declaration.
        size: of a declaration: how many values an array has; 0: it is none.
        late: of a loop: its condition stands behind its body.
    """

    kind: str
    name: str
    where: Where
    values: tuple[Expression, ...] = ()
    blocks: tuple[tuple[Statement, ...], ...] = ()
    type: str = ""
    size: int = 0
    late: bool = False


@dataclass(frozen=True, slots=True)
class Argument:
    """An argument of a function; what is `out` gets its value from it in the end."""

    name: str
    type: str
    out: bool
    given: bool
    size: int = 0


@dataclass(frozen=True, slots=True)
class Function:
    """A function of the text."""

    name: str
    type: str
    arguments: tuple[Argument, ...]
    body: tuple[Statement, ...]
    where: Where


@dataclass(frozen=True, slots=True)
class Uniform:
    """A number or vector that the user may choose, by a slider, a colour or a checkbox.

    Attributes:
        values: those that it begins with; None: nobody chooses it.
        least, most: the ends of its slider.
    """

    name: str
    type: str
    where: Where
    values: tuple[float, ...] | None = None
    least: tuple[float, ...] | None = None
    most: tuple[float, ...] | None = None


@dataclass(frozen=True, slots=True)
class Code:
    """All of a text.

    Attributes:
        statements: declarations outside of functions, in their order.
        functions: by name; several of one name differ in their arguments.
    """

    uniforms: dict[str, Uniform]
    statements: tuple[Statement, ...]
    functions: dict[str, tuple[Function, ...]]
