"""Maps of the library against the equations of their sources, written anew: products by tables, complex numbers, angles."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.reference import NumpyBackend, apply, constant_of, escape

Floats = NDArray[np.float64]
Values = Mapping[str, float]
# z before an application, C, values of parameters, numbers that are carried: z after it.
Equation = Callable[[Floats, Floats, Values, Floats], Sequence[Any] | Floats]


def product(table: Sequence[Sequence[tuple[int, int]]], a: Floats, b: Floats) -> Floats:
    """The product of two numbers whose units multiply as the table says: (sign, unit) for each pair of units."""
    found = np.zeros_like(a)
    for i, row in enumerate(table):
        for j, (sign, unit) in enumerate(row):
            found[unit] = found[unit] + sign * a[i] * b[j]
    return found


def power(table: Sequence[Sequence[tuple[int, int]]], a: Floats, exponent: float) -> Floats:
    found = a
    for _ in range(round(exponent) - 1):
        found = product(table, found, a)
    return found


def units(text: str) -> list[list[tuple[int, int]]]:
    """A table of units from its rows, `1 i j k`."""
    names = text.split()[: len(text.splitlines())]
    return [
        [(-1 if word[0] == "-" else 1, names.index(word.strip("-"))) for word in row.split()]
        for row in text.splitlines()
    ]


QUATERNION = units("1 i j k\ni -1 k -j\nj -k -1 i\nk j -i -1")
# 1, i, i' and their product j, all of which commute.
BICOMPLEX = units("1 i e j\ni -1 j -e\ne j -1 -i\nj -e -i 1")
DUDLEY = units("1 i j\ni j -1\nj -1 i")


def triplex(p: Floats, exponent: float) -> Floats:
    """The power of spherical coordinates whose latitude is measured from the equator."""
    r = np.linalg.norm(p, axis=0)
    longitude, latitude = np.arctan2(p[1], p[0]) * exponent, np.arcsin(p[2] / r) * exponent
    across = np.cos(latitude)
    found: Floats = r**exponent * np.stack(
        [across * np.cos(longitude), across * np.sin(longitude), np.sin(latitude)]
    )
    return found


def lambdabulb(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    w = z - triplex(z, p["power"])
    turned = complex(p["seed_x"], p["seed_y"])
    plane = turned * (w[0] + 1j * w[1])
    return np.stack([plane.real, plane.imag, abs(turned) * w[2]])


def square_by_axis(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    """Of each point about the axis whose line is nearest: the square of that axis's number plus an imaginary vector."""
    found = np.empty_like(z)
    for index, point in enumerate(z.T):
        axis = int(np.argmin([np.linalg.norm(np.delete(point, k)) for k in range(3)]))
        found[:, index] = 2 * point[axis] * point
        found[axis, index] = 2 * point[axis] ** 2 - point @ point
    return found + c


def msltoe_symmetric(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    swapped = z[[0, 2, 1]]
    return np.where(z[1] ** 2 >= z[2] ** 2, triplex(z, 2), triplex(swapped, 2)[[0, 2, 1]]) + c


# Where a formula's components stand among 1, i, e, j.
ARROWHEAD, MOUSE = [0, 1, 3, 2], [1, 2, 3, 0]


def bicomplex(places: list[int]) -> Equation:
    def equation(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
        number = np.empty_like(z)
        number[places] = z
        return power(BICOMPLEX, number, p["power"])[places] + c

    return equation


def quick_dudley(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    return product(DUDLEY, z, z) + c


def phoenix(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    return product(QUATERNION, z, z) + p["memory"] * carried + c


def julibrot(z: Floats, c: Floats, p: Values, carried: Floats) -> Any:
    after = (z[0] + 1j * z[1]) ** 2 + (z[2] + 1j * z[3])
    return [after.real, after.imag, z[2], z[3]]


def henon(z: Floats, c: Floats, p: Values, carried: Floats) -> Any:
    first, second = z[0] + 1j * z[1], z[2] + 1j * z[3]
    after = first**2 + complex(p["c_re"], p["c_im"]) - complex(p["a_re"], p["a_im"]) * second
    return [after.real, after.imag, first.real, first.imag]


def cubic(z: Floats, c: Floats, p: Values, carried: Floats) -> Any:
    a, b = c[0] + 1j * c[1], c[2] + 1j * c[3]
    first, second = (w**3 - 3 * a**2 * w + b for w in (z[0] + 1j * z[1], z[2] + 1j * z[3]))
    return [first.real, first.imag, second.real, second.imag]


def ball_fold(p: Floats, least: float) -> Floats:
    """Inverted in the unit ball, within `least` enlarged as at its surface."""
    r = np.linalg.norm(p, axis=0)
    return np.where(r < least, p / least**2, np.where(r < 1, p / r**2, p))


def box_fold(p: Floats, wall: Floats) -> Floats:
    wall = np.broadcast_to(wall[:, None], p.shape)
    return np.where(p > wall, 2 * wall - p, np.where(p < -wall, -2 * wall - p, p))


def turned(first: Any, second: Any, angle: float) -> tuple[Any, Any]:
    both = (first + 1j * second) * np.exp(1j * angle)
    return both.real, both.imag


def mandelbox_4d(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    f = ball_fold(box_fold(z, np.ones(4)), p["min_radius"])
    return p["scale"] * np.stack([f[0], f[1], *turned(f[2], f[3], p["turn"])]) + c


def amazing_box_mod(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    middle = np.array([0, 0, p["center_z"]])[:, None]
    f = box_fold(z, np.array([p["wall_x"], p["wall_y"], p["wall_z"]]))
    x, y, height = ball_fold(f - middle, p["min_radius"]) + middle
    y, height = turned(y, height, p["turn_x"])
    return p["scale"] * np.stack([*turned(x, y, p["turn_z"]), height]) + c


def octahedral_box(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    """The nearest point of the octahedron by bisection: what must be taken from each absolute value."""
    low, high = np.zeros(z.shape[1]), np.abs(z).max(axis=0)
    for _ in range(80):
        middle = (low + high) / 2
        outside = np.maximum(np.abs(z) - middle, 0).sum(axis=0) > p["size"]
        low, high = np.where(outside, middle, low), np.where(outside, high, middle)
    taken = np.where(np.abs(z).sum(axis=0) > p["size"], high, 0)
    nearest = np.sign(z) * np.maximum(np.abs(z) - taken, 0)
    return p["scale"] * ball_fold(2 * nearest - z, p["min_radius"]) + c


def mandalay_box(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    fold, gap = p["fold"], p["gap"]
    a = np.abs(z)
    f = np.empty_like(z)
    for axis in range(3):
        one, other = sorted({0, 1, 2} - {axis})
        beside = np.where(a[one] > a[other], a[one], a[other])
        # A ramp that comes back to its foot at twice the fold, below the height of the plateau beside; and one behind.
        first = np.maximum(np.where(a[axis] < fold, -a[axis], a[axis] - 2 * fold), beside - 4 * fold)
        behind = np.maximum(a[axis] - 2 * fold - gap, beside)
        f[axis] = np.sign(z[axis]) * np.minimum(np.minimum(first, behind), a[axis])
    return p["scale"] * ball_fold(f, p["min_radius"]) + c


def benesi_mag_tree(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    """A rotation that takes the diagonal of a cube to the x axis, and the tree's square by angles."""
    rows = [[1, np.sqrt(2), 0], [1, -np.sqrt(0.5), np.sqrt(1.5)], [1, -np.sqrt(0.5), -np.sqrt(1.5)]]
    frame = np.array(rows) / np.sqrt(3)
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-14)
    x, y, height = p["spread"] * (frame.T @ np.abs(frame @ z)) - np.array([[p["offset"]], [0], [0]])
    angle, ring = np.arctan2(height, y), np.hypot(y, height)
    # The tree's second and third part are 2 x ring times sine and cosine of the doubled angle about x.
    squared = [x**2 - ring**2, 2 * x * ring * np.sin(2 * angle), 2 * x * ring * np.cos(2 * angle)]
    return np.stack(squared) + c[[0, 2, 1]]


def turned_menger(z: Floats, c: Floats, p: Values, carried: Floats) -> Floats:
    x, y, height = z
    y, height = turned(y, height, p["turn_x"])
    height, x = turned(height, x, p["turn_y"])
    x, y = turned(x, y, p["turn_z"])
    folded = np.sort(np.abs([x, y, height]), axis=0)[::-1]
    middle = np.array([p["center_x"], p["center_y"], p["center_z"]])[:, None] * (p["scale"] - 1)
    after = p["scale"] * folded - middle
    # Of the least number the mirror half way between the holes' middles.
    after[2] = np.where(p["scale"] * folded[2] > middle[2] / 2, after[2], p["scale"] * folded[2])
    return after


EQUATIONS: dict[str, Equation] = {
    "lambdabulb": lambdabulb,
    "square_by_axis": square_by_axis,
    "msltoe_symmetric": msltoe_symmetric,
    "arrowheadbrot": bicomplex(ARROWHEAD),
    "mousebrot": bicomplex(MOUSE),
    "quick_dudley": quick_dudley,
    "quaternion_phoenix": phoenix,
    "julibrot": julibrot,
    "henon_map": henon,
    "cubic_locus": cubic,
    "mandelbox_4d": mandelbox_4d,
    "amazing_box_mod": amazing_box_mod,
    "octahedral_box": octahedral_box,
    "mandalay_box": mandalay_box,
    "benesi_mag_tree": benesi_mag_tree,
    "turned_menger": turned_menger,
}


def settings(name: str) -> list[dict[str, float]]:
    """The usual values, and two drawn from the ranges."""
    random = np.random.default_rng(5)
    found: list[dict[str, float]] = [{}]
    for _ in range(2):
        drawn = {}
        for each in catalog.load(name).parameters:
            low, high = each.minimum, each.maximum
            assert low is not None
            assert high is not None
            value = random.uniform(low, high)
            drawn[each.name] = float(round(value)) if each.type == "int" else value
        found.append(drawn)
    return found


@pytest.mark.parametrize("name", sorted(EQUATIONS))
def test_an_application_is_the_source_s_equation(name: str) -> None:
    for parameters in settings(name):
        chain = catalog.load_chain(name, parameters)
        bound = chain.first
        random = np.random.default_rng(6)
        z = random.uniform(-1.6, 1.6, (chain.size, 300))
        point = random.uniform(-1, 1, (chain.size, 300))
        carried = random.uniform(-1, 1, (len(chain.carried), 300))
        constant = (
            [np.full(300, float(each)) for each in constant_of(bound, list(point))] if bound.julia else point
        )
        values = {each: float(value) for each, value in bound.values.items()}
        got = apply(bound, [*z, *carried], list(constant), NumpyBackend(), number=3)
        expected = EQUATIONS[name](z, np.array(constant), values, carried)
        np.testing.assert_allclose(np.array(got[: chain.size]), np.array(expected), rtol=1e-9, atol=1e-9)


def test_the_cubic_orbits_begin_at_the_critical_points() -> None:
    """Where 3 z**2 - 3 a**2 is 0."""
    chain = catalog.load_chain("cubic_locus")
    point = np.random.default_rng(1).uniform(-1, 1, (4, 50))
    got = np.array(apply(chain.first, list(point), list(point), NumpyBackend(), number=0))
    a, b = point[0] + 1j * point[1], point[2] + 1j * point[3]
    np.testing.assert_allclose(got[0] + 1j * got[1], a**3 - 3 * a**2 * a + b, atol=1e-12)
    np.testing.assert_allclose(got[2] + 1j * got[3], -(a**3) + 3 * a**2 * a + b, atol=1e-12)


def test_the_phoenix_remembers_the_number_before_the_last() -> None:
    chain = catalog.load_chain("quaternion_phoenix", {"memory": -0.5})
    z = [np.array([0.3]), np.array([0.1]), np.array([-0.2]), np.array([0.4])]
    zero = [np.zeros(1)] * 4
    constant = list(constant_of(chain.first, z))
    after = apply(chain.first, [*z, *zero], constant, NumpyBackend())
    np.testing.assert_array_equal(np.array(after[4:]), np.array(z))
    # In the complex plane: Ushiki's z*z + c + k w.
    flat = catalog.load_chain({"name": "quaternion_phoenix", "julia": [0.56667, 0, 0, 0]}, {"memory": -0.5})
    w, number = 0j, 0.2 + 0.3j
    state: list[Any] = [np.array([0.2]), np.array([0.3]), *zero[:2], *zero]
    for _ in range(5):
        w, number = number, number**2 + 0.56667 - 0.5 * w
        state = apply(flat.first, state, list(constant_of(flat.first, z)), NumpyBackend())
    assert complex(state[0][0], state[1][0]) == pytest.approx(number, abs=1e-12)


MANDELBROT = 200


def in_mandelbrot(c: NDArray[np.complex128], count: int) -> NDArray[np.bool_]:
    z = np.zeros_like(c)
    stays = np.ones(c.shape, bool)
    for _ in range(count):
        z = np.where(stays, z * z + c, z)
        stays &= np.abs(z) <= 1e3
    return stays


def test_bicomplex_sets_are_what_two_mandelbrot_sets_have_in_common() -> None:
    """Of both idempotent components; bailouts differ, so orbits are long and far."""
    p = np.random.default_rng(3).uniform(-1.3, 1.3, (20_000, 3))
    for name, first, second in (
        ("arrowheadbrot", p[:, 0] + p[:, 2] + 1j * p[:, 1], p[:, 0] - p[:, 2] + 1j * p[:, 1]),
        ("mousebrot", p[:, 2] + 1j * (p[:, 0] - p[:, 1]), -p[:, 2] + 1j * (p[:, 0] + p[:, 1])),
    ):
        _, inside = escape(catalog.load_chain(name), p, MANDELBROT, 1e3)
        expected = in_mandelbrot(first, MANDELBROT) & in_mandelbrot(second, MANDELBROT)
        assert inside.sum() > 100
        assert (inside != expected).mean() < 1e-3


@pytest.mark.parametrize("name", sorted({*EQUATIONS} - {"cubic_locus"}))
def test_far_outside_z_grows_by_the_degree(name: str) -> None:
    chain = catalog.load_chain(name)
    z = np.random.default_rng(9).normal(size=(chain.size, 400))
    z /= np.linalg.norm(z, axis=0)
    if name in ("julibrot", "henon_map"):
        z[2:] = 0  # these go along or behind
    zero = [np.zeros(400)] * 8
    sizes = []
    for size in (1e5, 1e6):
        after = apply(
            chain.first,
            [*(size * z), *zero[: len(chain.carried)]],
            zero[: chain.size],
            NumpyBackend(),
            number=2,
        )
        sizes.append(np.linalg.norm(np.array(after[: chain.size]), axis=0))
    assert np.median(np.log10(sizes[1] / sizes[0])) == pytest.approx(chain.degree, abs=1e-3)
