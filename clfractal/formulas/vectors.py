"""Vectors of two to four numbers in expressions: each is written as the trees of its components."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType
from typing import NoReturn, TypeAlias

from clfractal.formulas.nodes import Call, Node, Number

COMPONENTS = "xyzw"
MOST = len(COMPONENTS)


@dataclass(frozen=True, slots=True)
class Vector:
    """Two to four numbers."""

    parts: tuple[Node, ...]
    position: int = 0


Operand: TypeAlias = Node | Vector
# Refuses an operand: the message, and its column.
Fail = Callable[[str, int], NoReturn]
# Gives what is used several times a name of its own.
Share = Callable[[Node], Node]


def size_of(value: Operand) -> int:
    """How many numbers it is of; 1 for a plain number."""
    return len(value.parts) if isinstance(value, Vector) else 1


def described(value: Operand) -> str:
    """In words: a number, or a vector of so many."""
    return f"a vector of {size_of(value)}" if isinstance(value, Vector) else "a number"


def each_component(function: str, operands: Sequence[Operand], position: int, fail: Fail) -> Operand:
    """A function of numbers, of each component by itself; a number beside vectors goes to all components."""
    sizes = {len(each.parts) for each in operands if isinstance(each, Vector)}
    if not sizes:
        return Call(function, tuple(each for each in operands if not isinstance(each, Vector)), position)
    if len(sizes) > 1:
        shown = " and ".join(map(described, operands))
        fail(f"{function} cannot take {shown}", position)
    (size,) = sizes
    columns = (each.parts if isinstance(each, Vector) else (each,) * size for each in operands)
    return Vector(tuple(Call(function, part, position) for part in zip(*columns, strict=True)), position)


def swizzled(value: Vector, letters: str, position: int, fail: Fail) -> Operand:
    """Components by their letters: `v.x`, `v.zyx`."""
    known = COMPONENTS[: len(value.parts)]
    if not 1 <= len(letters) <= MOST or any(letter not in known for letter in letters):
        fail(f"'.{letters}' is no part of a vector of {len(value.parts)}: use the letters {known}", position)
    parts = tuple(value.parts[known.index(letter)] for letter in letters)
    return parts[0] if len(parts) == 1 else Vector(parts, position)


@dataclass(frozen=True, slots=True)
class _Given:
    """The operands of a call, and how to complain of them."""

    function: str
    operands: tuple[Operand, ...]
    position: int
    fail: Fail
    share: Share

    def vector(self, index: int, *sizes: int) -> tuple[Node, ...]:
        """The components of an operand, each of which may be used several times."""
        value = self.operands[index]
        if not isinstance(value, Vector) or (sizes and len(value.parts) not in sizes):
            wanted = " or ".join(map(str, sizes))
            wanted = f"a vector of {wanted}" if sizes else "a vector"
            self.fail(
                f"{self.function} needs {wanted} as its argument {index + 1}, got {described(value)}",
                value.position,
            )
        return tuple(map(self.share, value.parts))

    def pair(self) -> tuple[tuple[Node, ...], tuple[Node, ...]]:
        """Two vectors of one size."""
        a, b = self.vector(0), self.vector(1)
        if len(a) != len(b):
            self.fail(
                f"{self.function} cannot take a vector of {len(a)} and a vector of {len(b)}", self.position
            )
        return a, b

    def number(self, index: int) -> Node:
        """A plain number."""
        value = self.operands[index]
        if isinstance(value, Vector):
            self.fail(
                f"{self.function} needs a number as its argument {index + 1}, got {described(value)}",
                value.position,
            )
        return self.share(value)


def _add(*parts: Node) -> Node:
    total = parts[0]
    for part in parts[1:]:
        total = Call("add", (total, part))
    return total


def _sub(a: Node, b: Node) -> Node:
    return Call("sub", (a, b))


def _mul(*parts: Node) -> Node:
    product = parts[0]
    for part in parts[1:]:
        product = Call("mul", (product, part))
    return product


def _dot(a: Sequence[Node], b: Sequence[Node]) -> Node:
    return _add(*(_mul(p, q) for p, q in zip(a, b, strict=True)))


def _vec(given: _Given) -> Operand:
    parts = [
        part for each in given.operands for part in (each.parts if isinstance(each, Vector) else (each,))
    ]
    if not 2 <= len(parts) <= MOST:
        given.fail(f"a vector has 2 to {MOST} numbers, got {len(parts)}", given.position)
    return Vector(tuple(parts), given.position)


def _normalize(given: _Given) -> Operand:
    v = given.vector(0)
    square = given.share(_dot(v, v))
    inverse = Call(
        "where",
        (Call("gt", (square, Number(0.0))), Call("div", (Number(1.0), Call("sqrt", (square,)))), Number(0.0)),
    )
    shared = given.share(inverse)
    return Vector(tuple(_mul(part, shared) for part in v), given.position)


def _cross(given: _Given) -> Operand:
    (a, b, c), (x, y, z) = given.vector(0, 3), given.vector(1, 3)
    return Vector(
        (_sub(_mul(b, z), _mul(c, y)), _sub(_mul(c, x), _mul(a, z)), _sub(_mul(a, y), _mul(b, x))),
        given.position,
    )


def _reflect(given: _Given) -> Operand:
    """Mirrored at the plane through 0 with this normal, of any length but 0."""
    v, normal = given.pair()
    twice = Call("div", (_mul(Number(2.0), _dot(v, normal)), _dot(normal, normal)))
    share = given.share(twice)
    return Vector(tuple(_sub(p, _mul(share, q)) for p, q in zip(v, normal, strict=True)), given.position)


def _fold(given: _Given) -> Operand:
    """What is beyond -limit to limit is mirrored there."""

    def one(part: Node, limit: Node) -> Node:
        clamped = Call("clamp", (part, Call("neg", (limit,)), limit))
        return _sub(_mul(Number(2.0), clamped), part)

    value, limit = given.operands
    if not isinstance(value, Vector):
        return one(given.share(value), given.number(1))
    parts = given.vector(0)
    limits = given.pair()[1] if isinstance(limit, Vector) else (given.number(1),) * len(parts)
    return Vector(tuple(one(part, most) for part, most in zip(parts, limits, strict=True)), given.position)


def _rotate(given: _Given) -> Operand:
    """By an angle in the plane; by three angles about x, then y, then z; or about an axis by an angle."""
    if len(given.operands) == 3:
        return _rotate_about(given)
    if not isinstance(given.operands[1], Vector):
        x, y = given.vector(0, 2)
        angle = given.number(1)
        c, s = given.share(Call("cos", (angle,))), given.share(Call("sin", (angle,)))
        return Vector((_sub(_mul(x, c), _mul(y, s)), _add(_mul(x, s), _mul(y, c))), given.position)
    v, angles = given.vector(0, 3, 4), given.vector(1, 3)
    (ca, sa), (cb, sb), (cc, sc) = (
        (given.share(Call("cos", (angle,))), given.share(Call("sin", (angle,)))) for angle in angles
    )
    rows = (
        (_mul(cb, cc), _sub(_mul(sa, sb, cc), _mul(ca, sc)), _add(_mul(ca, sb, cc), _mul(sa, sc))),
        (_mul(cb, sc), _add(_mul(sa, sb, sc), _mul(ca, cc)), _sub(_mul(ca, sb, sc), _mul(sa, cc))),
        (Call("neg", (sb,)), _mul(sa, cb), _mul(ca, cb)),
    )
    shared = (tuple(map(given.share, row)) for row in rows)
    return Vector((*(_dot(row, v[:3]) for row in shared), *v[3:]), given.position)


def _rotate_about(given: _Given) -> Operand:
    """Rodrigues' rotation about an axis of any length."""
    v, axis, angle = given.vector(0, 3, 4), given.operands[1], given.number(2)
    unit = _normalize(_Given(given.function, (axis,), given.position, given.fail, given.share))
    assert isinstance(unit, Vector)
    if len(unit.parts) != 3:
        given.fail(f"{given.function} needs a vector of 3 as its axis, got {described(axis)}", given.position)
    k = tuple(map(given.share, unit.parts))
    c, s = given.share(Call("cos", (angle,))), given.share(Call("sin", (angle,)))
    along = given.share(_mul(_dot(k, v[:3]), _sub(Number(1.0), c)))
    (a, b, d), (x, y, z) = k, v[:3]
    across = (_sub(_mul(b, z), _mul(d, y)), _sub(_mul(d, x), _mul(a, z)), _sub(_mul(a, y), _mul(b, x)))
    turned = (
        _add(_mul(p, c), _mul(q, s), _mul(r, along)) for p, q, r in zip((x, y, z), across, k, strict=True)
    )
    return Vector((*turned, *v[3:]), given.position)


def _quaternion_product(given: _Given) -> Operand:
    (a, b, c, d), (x, y, z, w) = given.vector(0, 4), given.vector(1, 4)
    return Vector(
        (
            _sub(_mul(a, x), _add(_mul(b, y), _mul(c, z), _mul(d, w))),
            _add(_mul(a, y), _mul(b, x), _sub(_mul(c, w), _mul(d, z))),
            _add(_mul(a, z), _mul(c, x), _sub(_mul(d, y), _mul(b, w))),
            _add(_mul(a, w), _mul(d, x), _sub(_mul(b, z), _mul(c, y))),
        ),
        given.position,
    )


def _complex_product(given: _Given) -> Operand:
    (a, b), (x, y) = given.vector(0, 2), given.vector(1, 2)
    return Vector((_sub(_mul(a, x), _mul(b, y)), _add(_mul(a, y), _mul(b, x))), given.position)


def _complex_power(given: _Given) -> Operand:
    (x, y), exponent = given.vector(0, 2), given.number(1)
    return Vector((Call("cpow_re", (x, y, exponent)), Call("cpow_im", (x, y, exponent))), given.position)


# What takes or gives vectors: fewest and most arguments, and what is written.
VECTOR_FUNCTIONS: Mapping[str, tuple[int, int, Callable[[_Given], Operand]]] = MappingProxyType(
    {
        "vec": (1, MOST, _vec),
        "dot": (2, 2, lambda given: _dot(*given.pair())),
        "length": (1, 1, lambda given: Call("sqrt", (_dot(given.vector(0), given.vector(0)),))),
        "normalize": (1, 1, _normalize),
        "cross": (2, 2, _cross),
        "reflect": (2, 2, _reflect),
        "fold": (2, 2, _fold),
        "rotate": (2, 3, _rotate),
        "qmul": (2, 2, _quaternion_product),
        "cmul": (2, 2, _complex_product),
        "cpow": (2, 2, _complex_power),
    }
)


def call_vector(
    function: str, operands: Sequence[Operand], position: int, fail: Fail, share: Share
) -> Operand:
    """A function of `VECTOR_FUNCTIONS`; the number of operands is right."""
    return VECTOR_FUNCTIONS[function][2](_Given(function, tuple(operands), position, fail, share))
