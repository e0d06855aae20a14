"""Formulas against the mathematics they come from."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from clfractal.formulas import catalog
from clfractal.formulas.backends import NumpyBackend
from clfractal.formulas.reference import apply

Float = NDArray[np.float64]
RNG = np.random.default_rng(3)
STATES = RNG.uniform(-1.2, 1.2, (200, 3))


def mapped(name: str, parameters: dict[str, Any], states: Float = STATES) -> Float:
    """One application with nothing added."""
    bound = catalog.load_chain(name, parameters).first
    with np.errstate(all="ignore"):
        result = apply(bound, list(states.T), [0.0] * states.shape[1], NumpyBackend())
    return np.stack([np.broadcast_to(component, len(states)) for component in result], axis=1)


@pytest.mark.parametrize("power", [2, 3, 4, 5, 8, 9, 16, 2.5, 7.25])
@pytest.mark.parametrize("phases", [(0.0, 0.0), (0.4, -1.1)])
def test_the_mandelbulb_is_whites_trigonometric_rule(power: float, phases: tuple[float, float]) -> None:
    x, y, z = STATES.T
    r = np.sqrt(x * x + y * y + z * z)
    theta = power * np.arctan2(np.hypot(x, y), z) + phases[0]
    phi = power * np.arctan2(y, x) + phases[1]
    expected = r**power * np.stack([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
    got = mapped("mandelbulb", {"power": power, "theta_phase": phases[0], "phi_phase": phases[1]})
    np.testing.assert_allclose(got, expected.T, atol=4e-14 * float((r**power).max()))


@pytest.mark.parametrize(("power", "times"), [(4, 2), (8, 3)])
def test_squaring_again_is_the_higher_power_of_hast(power: int, times: int) -> None:
    # Englund 2010, Eq. 12: Z^8 is ((Z^2)^2)^2.
    state = STATES
    for _ in range(times):
        state = mapped("hast", {"power": 2}, state)
    np.testing.assert_allclose(mapped("hast", {"power": power}), state, rtol=1e-13)


@pytest.mark.parametrize("power", [2, 4, 8])
def test_hast_is_the_complex_power_in_its_plane(power: int) -> None:
    flat = STATES * [1, 1, 0]
    expected = (flat[:, 0] + 1j * flat[:, 1]) ** power
    got = mapped("hast", {"power": power}, flat)
    np.testing.assert_allclose(got[:, 0] + 1j * got[:, 1], expected, atol=1e-13)
    np.testing.assert_array_equal(got[:, 2], 0)


def test_hast_never_shrinks_a_point_below_its_square() -> None:
    got = np.linalg.norm(mapped("hast", {"power": 2}), axis=1)
    assert (got >= np.linalg.norm(STATES, axis=1) ** 2 * (1 - 1e-12)).all()


@pytest.mark.parametrize("power", [2, 3, 5])
def test_the_burning_ship_lies_in_its_plane(power: int) -> None:
    flat = STATES * [1, 1, 0]
    expected = (np.abs(flat[:, 0]) + 1j * np.abs(flat[:, 1])) ** power
    got = mapped("burning_ship", {"power": power}, flat)
    np.testing.assert_allclose(got[:, 0] + 1j * got[:, 1], expected, atol=1e-13)
    np.testing.assert_allclose(got[:, 2], 0, atol=1e-15)


def quaternion_product(a: Float, b: Float) -> Float:
    scalar = a[:, 0] * b[:, 0] - (a[:, 1:] * b[:, 1:]).sum(axis=1)
    vector = a[:, :1] * b[:, 1:] + b[:, :1] * a[:, 1:] + np.cross(a[:, 1:], b[:, 1:])
    return np.concatenate([scalar[:, None], vector], axis=1)


@pytest.mark.parametrize("power", [2, 3, 5])
def test_quaternion_powers_are_products(power: int) -> None:
    states = RNG.uniform(-1, 1, (100, 4))
    expected = states
    for _ in range(power - 1):
        expected = quaternion_product(expected, states)
    np.testing.assert_allclose(
        mapped("quaternion_mandelbrot", {"power": power}, states), expected, atol=1e-12
    )


@pytest.mark.parametrize("power", [2, 3])
def test_tetrabrot_powers_are_bicomplex_products(power: int) -> None:
    states = RNG.uniform(-1, 1, (100, 4))
    first, second = states[:, 0] + 1j * states[:, 1], states[:, 2] + 1j * states[:, 3]
    a, b = first, second
    for _ in range(power - 1):
        a, b = a * first - b * second, a * second + b * first
    got = mapped("tetrabrot", {"power": power}, states)
    np.testing.assert_allclose(got, np.stack([a.real, a.imag, b.real, b.imag], axis=1), atol=1e-13)


def test_the_mandelbox_folds_inverts_and_scales() -> None:
    parameters = {"scale": -1.7, "min_radius": 0.4, "fixed_radius": 1.2}
    states = RNG.uniform(-3, 3, (100, 3))
    for got, state in zip(mapped("mandelbox", parameters, states), states, strict=True):
        v = [2 - c if c > 1 else -2 - c if c < -1 else c for c in state]
        r2 = sum(c * c for c in v)
        factor = 1.44 / 0.16 if r2 < 0.16 else 1.44 / r2 if r2 < 1.44 else 1.0
        np.testing.assert_allclose(got, [-1.7 * factor * c for c in v], rtol=1e-13)


@pytest.mark.parametrize("order", [3, 4, 5])
def test_the_polyhedral_folds_reach_one_sector(order: int) -> None:
    # Images of a point under the mirrors all fold to the same point.
    c = math.cos(math.pi / order)
    mirrors = np.array([[1, 0, 0], [0, 1, 0], [-0.5, -c, math.sqrt(0.75 - c * c)]])
    states = RNG.uniform(-1, 1, (30, 3))
    folded = mapped("polyhedral_ifs", {"order": order}, states)
    images = states
    for mirror in RNG.integers(0, 3, 25):
        images = images - 2 * (images @ mirrors[mirror])[:, None] * mirrors[mirror]
        np.testing.assert_allclose(mapped("polyhedral_ifs", {"order": order}, images), folded, atol=1e-12)


def test_the_needle_of_the_mandelbrot_set_is_where_it_should_be() -> None:
    # c = -2 maps to 2 and stays; the plane of hast holds it, and complex arithmetic agrees on its neighbours.
    from clfractal.formulas.reference import escape

    points = np.array([[x, y, 0.0] for x in np.linspace(-2.1, 0.6, 28) for y in np.linspace(-1.2, 1.2, 25)])
    count, _ = escape(catalog.load_chain("hast"), points, 30)
    for point, got in zip(points, count, strict=True):
        z, n = 0j, 0
        while n < 30 and abs(z) <= 4:
            z, n = z * z + complex(point[0], point[1]), n + 1
        assert n == got or abs(abs(z) - 4) < 1e-9
