"""Vectors and quaternions in formulas, beside NumPy."""

from __future__ import annotations

import itertools
import math

import numpy as np
from numpy.typing import NDArray

from clfractal.errors import Where
from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.evaluate import evaluate
from clfractal.formulas.parser import Names, parse_operand
from clfractal.formulas.vectors import Vector

Floats = NDArray[np.float64]


def evaluated(text: str, count: int, **vectors: Floats) -> Floats:
    """An expression of vectors, at states of shape (n, size)."""
    names = {
        f"{name}.{letter}": value[:, i]
        for name, value in vectors.items()
        for i, letter in enumerate("xyzw"[: value.shape[1]])
    }
    value = parse_operand(text, names=Names(names.keys()), where=Where())
    parts = value.parts if isinstance(value, Vector) else (value,)
    assert len(parts) == count
    backend = NumpyBackend()
    with np.errstate(all="ignore"):
        size = len(next(iter(vectors.values())))
        return np.stack([np.broadcast_to(evaluate(part, names, backend), (size,)) for part in parts], axis=1)


def drawn(size: int, seed: int) -> Floats:
    return np.random.default_rng(seed).normal(size=(40, size))


def test_vector_functions() -> None:
    v, w, q, r = drawn(3, 1), drawn(3, 2), drawn(4, 3), drawn(4, 4)
    np.testing.assert_allclose(evaluated("dot(v, w)", 1, v=v, w=w)[:, 0], (v * w).sum(1))
    np.testing.assert_allclose(evaluated("length(q)", 1, q=q)[:, 0], np.linalg.norm(q, axis=1))
    np.testing.assert_allclose(evaluated("cross(v, w)", 3, v=v, w=w), np.cross(v, w))
    np.testing.assert_allclose(evaluated("normalize(v)", 3, v=v), v / np.linalg.norm(v, axis=1)[:, None])
    np.testing.assert_allclose(evaluated("v.zxy*2 - w", 3, v=v, w=w), v[:, [2, 0, 1]] * 2 - w)
    np.testing.assert_allclose(evaluated("fold(v, 0.5)", 3, v=v), np.clip(v, -0.5, 0.5) * 2 - v)
    np.testing.assert_allclose(evaluated("fold(v, abs(w))", 3, v=v, w=w), np.clip(v, -abs(w), abs(w)) * 2 - v)
    np.testing.assert_allclose(evaluated("max(v, w, 0.1)", 3, v=v, w=w), np.maximum(np.maximum(v, w), 0.1))
    np.testing.assert_allclose(evaluated("where(v.x > 0, v, -w)", 3, v=v, w=w), np.where(v[:, :1] > 0, v, -w))
    np.testing.assert_allclose(evaluated("vec(v.xy, w.z, 1)", 4, v=v, w=w)[:, 2], w[:, 2])
    # Mirrored: the part along the normal is turned round, the rest stays.
    normal = w / np.linalg.norm(w, axis=1)[:, None]
    along = (v * normal).sum(1)[:, None] * normal
    np.testing.assert_allclose(evaluated("reflect(v, w)", 3, v=v, w=w), v - 2 * along)
    # Quaternions: the size of a product is the product of sizes, i j = k, and it is associative.
    product = evaluated("qmul(q, r)", 4, q=q, r=r)
    np.testing.assert_allclose(
        np.linalg.norm(product, axis=1), np.linalg.norm(q, axis=1) * np.linalg.norm(r, axis=1)
    )
    one = np.ones((1, 4))
    for a, b, c in itertools.permutations(range(3)):
        units = [f"vec(0, {', '.join('1' if i == k else '0' for i in range(3))})" for k in (a, b, c)]
        sign = "" if (b - a) % 3 == 1 else "-"
        np.testing.assert_allclose(
            evaluated(f"qmul({units[0]}, {units[1]}) - {sign}{units[2]} + 0*q", 4, q=one), 0
        )
    np.testing.assert_allclose(
        evaluated("qmul(qmul(q, r), q.wzyx)", 4, q=q, r=r), evaluated("qmul(q, qmul(r, q.wzyx))", 4, q=q, r=r)
    )
    z, u = v[:, 0] + 1j * v[:, 1], w[:, 0] + 1j * w[:, 1]
    got = evaluated("cmul(v.xy, w.xy)", 2, v=v, w=w)
    np.testing.assert_allclose(got[:, 0] + 1j * got[:, 1], z * u)
    got = evaluated("cpow(v.xy, 3)", 2, v=v)
    np.testing.assert_allclose(got[:, 0] + 1j * got[:, 1], z**3)


def test_rotations() -> None:
    v = drawn(3, 1)
    for axis, name in enumerate("xyz"):
        # About an axis: the other two turn from the next one to the one after it.
        angles = ", ".join("0.7" if each == name else "0" for each in "xyz")
        got = evaluated(f"rotate(v, vec({angles}))", 3, v=v)
        i, j = (axis + 1) % 3, (axis + 2) % 3
        turned = (v[:, i] + 1j * v[:, j]) * np.exp(0.7j)
        np.testing.assert_allclose(got[:, axis], v[:, axis])
        np.testing.assert_allclose(got[:, i] + 1j * got[:, j], turned)
        unit = f"vec({', '.join('3' if each == name else '0' for each in 'xyz')})"
        np.testing.assert_allclose(evaluated(f"rotate(v, {unit}, 0.7)", 3, v=v), got)
    # About x, then y, then z.
    step = v
    for angles in ("vec(0.3, 0, 0)", "vec(0, -0.8, 0)", "vec(0, 0, 1.9)"):
        step = evaluated(f"rotate(v, {angles})", 3, v=step)
    np.testing.assert_allclose(evaluated("rotate(v, vec(0.3, -0.8, 1.9))", 3, v=v), step)
    plane = evaluated("rotate(v.xy, 0.4)", 2, v=v)
    np.testing.assert_allclose(plane[:, 0] + 1j * plane[:, 1], (v[:, 0] + 1j * v[:, 1]) * np.exp(0.4j))
    # Three turns by a third of a whole one about a diagonal are none; each moves the axes on.
    third = evaluated(f"rotate(v, vec(1, 1, 1), {2 * math.pi / 3!r})", 3, v=v)
    np.testing.assert_allclose(third, v[:, [2, 0, 1]])
