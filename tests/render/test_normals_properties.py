"""Normals from a pixel's points, for points and subsets that hypothesis chooses; and the NumPy normals themselves."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.device.structs import Precision
from tests.render import normals_oracle as oracle
from tests.render.normals_kernel import GRID, lanes_of, run
from tests.small_kernels import Floats

# What a search may hand over, far beyond what it should.
NUMBERS = st.floats(-1e12, 1e12) | st.sampled_from([0.0, 1.0, -1.0, 1e-7, 1e-20, 1e-38, 1e12])


@settings(max_examples=300)
@given(
    st.sampled_from(["float32", "float64"]),
    st.lists(st.tuples(NUMBERS, NUMBERS, NUMBERS, st.booleans()), min_size=9, max_size=40),
)
def test_any_points_are_safe(precision: Precision, points: list[tuple[float, float, float, bool]]) -> None:
    """Whatever is found, wherever: no NaN, length 1, towards the viewer, and (0, 0, 1) where nothing can be told."""
    given = np.array([point[:3] for point in points])[None]
    there = np.array([point[3] for point in points])[None]
    found = run(given, there, precision, lanes_of(precision))
    assert np.isfinite(found.residual).all()
    for normals, usable in (*found.methods().values(), (found.eight, found.eight_usable)):
        assert np.abs(np.linalg.norm(normals, axis=-1) - 1).max() <= 1e-6
        assert (normals[..., 2] > 0).all()
        assert (normals[~usable] == [0, 0, 1]).all()


def sphere_depths(offsets: Floats, pixel_width: float, distance: float) -> Floats:
    """Where rays from the eye meet the unit sphere around (0, 0, -distance); NaN where they miss."""
    rays = np.concatenate([offsets * pixel_width, -np.ones((len(offsets), 1))], axis=1)
    rays /= np.linalg.norm(rays, axis=1, keepdims=True)
    toward = -distance * rays[:, 2]
    under = 1 - distance**2 + toward**2
    return np.asarray(toward - np.sqrt(np.where(under < 0, np.nan, under)))


@pytest.mark.parametrize("rim", [0.0, 0.5, 0.9])
def test_numpys_normals_of_a_sphere(rim: float) -> None:
    """In perspective, at places up to near the rim: all five within the bend of the surface over a pixel."""
    width, distance = 1e-3, 4.0
    middle = np.array([rim * np.tan(np.arcsin(1 / distance)) / width, 0.0])
    offsets = GRID + middle
    points = oracle.perspective_points(offsets, width, sphere_depths(offsets, width, distance))
    exact = oracle.gradient(points[4] + [0, 0, distance], np.array([1.0, 0, 0]), np.array([0, 1.0, 0]))
    bend = width * distance / np.sqrt(1 - rim**2)
    plane, residual = oracle.least_squares(points)
    assert residual < width * distance * bend
    shaded = oracle.eight_triangles_shading(points[None], lambda normals: normals)[0]
    for normal in (
        plane,
        oracle.one_triangle(points[None])[0],
        oracle.eight_triangles_normal(points[None])[0],
        shaded,
    ):
        assert np.linalg.norm(normal - exact) < bend


def test_numpys_normals_leave_out_what_is_missing() -> None:
    plane = np.concatenate([GRID, GRID @ np.array([[2.0], [-1.0]])], axis=1)
    normal = np.array([-2.0, 1.0, 1.0]) / np.sqrt(6)
    for missing in ([0], [1, 6], [4], [0, 1, 2, 3]):
        points = plane.copy()[None]
        points[0, missing, 2] = np.nan
        np.testing.assert_allclose(oracle.least_squares(points)[0][0], normal, atol=1e-14)
        np.testing.assert_allclose(oracle.one_triangle(points)[0], normal, atol=1e-14)
        np.testing.assert_allclose(oracle.eight_triangles_normal(points)[0], normal, atol=1e-14)
        shaded = oracle.eight_triangles_shading(points, lambda normals: normals[..., :1])
        np.testing.assert_allclose(shaded[0], normal[:1], atol=1e-14)
    assert np.isnan(oracle.least_squares(plane[None, :3])[0]).all()
