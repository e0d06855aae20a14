"""Cut planes against an independent Mandelbrot set, closed forms, and palettes by NumPy."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.formulas import reference
from clfractal.integrators.cut_plane import renderer_of
from clfractal.integrators.plan import choose_precision
from clfractal.scene.palette import named_table
from clfractal.scene.rectangle import moved
from tests.devices import check_usable
from tests.render.planes import SMOOTH_RADIUS, Floats, mandelbrot, picture_of, pixel_points, plane_scene, sure
from tests.render.shots import CHANNELS, shoot, stacked

STEPPED, SMOOTH = {"mode": "stepped"}, {"mode": "smooth"}
# Around the whole set; a piece of the seahorse valley, 10^-8 wide, where counts are high.
WHOLE = {"center": [-0.5, 0, 0], "width": 3, "height": 3}
VALLEY = {"center": [-0.743643887037151, 0.131825904205330, 0], "width": 1e-8, "height": 1e-8}
# What rounding in an orbit does is at most what a few steps of the number type in the point do.
NUDGE = {"float32": 4 * 2.0**-23, "float64": 4 * 2.0**-52}
# A map that stays where it is: the inside is a ball of radius 1.
BALL: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "bailout": 1,
    "bounds": {"radius": 2},
}
BLACK = [{"at": 0, "color": [0, 0, 0]}, {"at": 1, "color": [0, 0, 0]}]
WHITE_DISK = {**STEPPED, "palette": BLACK, "inside": [1, 1, 1]}


class TestMandelbrot:
    """At z = 0 hast of power 2 is the Mandelbrot set."""

    @pytest.mark.parametrize(
        ("precision", "plane", "iterations", "least"),
        [("float32", WHOLE, 256, 0.99), ("float64", WHOLE, 256, 0.99), ("float64", VALLEY, 3000, 0.9)],
        ids=["float32", "float64", "a valley in float64"],
    )
    def test_count_by_count(
        self, device: Device, precision: Precision, plane: dict[str, Any], iterations: int, least: float
    ) -> None:
        check_usable(precision)
        size = (96, 96) if iterations < 1000 else (40, 40)
        scene = plane_scene(size=size, iterations=iterations, plane=plane, colors=STEPPED)
        framebuffer = shoot(scene, device, precision)
        points = pixel_points(scene).astype(np.longdouble)
        x, y = points[..., 0], points[..., 1]
        certain = sure(x, y, iterations, NUDGE[precision])
        count, _ = mandelbrot(x, y, iterations)
        assert certain.mean() > least
        np.testing.assert_array_equal(framebuffer["iterations"][certain], count[certain])
        assert len(np.unique(count[certain])) > 20
        inside = (picture_of(framebuffer) == 0).all(axis=-1)
        np.testing.assert_array_equal(inside[certain], count[certain] == iterations)

    def test_smooth_counts(self, device: Device) -> None:
        scene = plane_scene(size=(128, 128), iterations=100, plane=WHOLE, colors=SMOOTH)
        framebuffer = shoot(scene, device)
        points = pixel_points(scene)
        x, y = points[..., 0], points[..., 1]
        count, radius = mandelbrot(x, y, 110, SMOOTH_RADIUS)
        certain = sure(x, y, 110, NUDGE["float32"]) & (count < 60)
        expected = count - np.log2(np.log(np.maximum(radius, SMOOTH_RADIUS)) / np.log(SMOOTH_RADIUS))
        np.testing.assert_allclose(framebuffer["iterations"][certain], expected[certain], atol=1e-2)
        assert certain.sum() > 5000
        assert (framebuffer["iterations"][count == 110] == 100).mean() > 0.99


class TestIterations:
    @pytest.mark.parametrize("curve", ["linear", "log"])
    def test_the_plane_has_a_limit_of_its_own(self, device: Device, curve: str) -> None:
        """Counts, the inside and the colours are those of a formula with that limit."""
        colors = {"mode": "stepped", "curve": curve}
        own = plane_scene(size=(48, 48), iterations=9, plane=WHOLE, colors=colors, plane_iterations=70)
        whole = plane_scene(size=(48, 48), iterations=70, plane=WHOLE, colors=colors)
        framebuffer = shoot(own, device)
        assert stacked(framebuffer).tobytes() == stacked(shoot(whole, device)).tobytes()
        assert framebuffer["iterations"].max() == 70
        short = shoot(plane_scene(size=(48, 48), iterations=9, plane=WHOLE, colors=colors), device)
        assert short["iterations"].max() == 9


class TestChannels:
    def test_they_tell_of_the_plane(self, device: Device) -> None:
        plane = {
            "center": [0.1, 0.2, -0.3],
            "normal": [1, 2, 2],
            "width": 3,
            "height": 1,
            "transform": [{"rotate_normal": 20}, {"rotate_x": 10}, {"move_side": 0.25}],
        }
        scene = plane_scene(size=(60, 40), plane=plane, colors=STEPPED)
        framebuffer = shoot(scene, device)
        placed = renderer_of(scene).plane.placed
        points = stacked(framebuffer, ("P.X", "P.Y", "P.Z"))
        np.testing.assert_allclose(points, pixel_points(scene), atol=1e-6)
        np.testing.assert_allclose(points[20:, :30].mean(axis=(0, 1)), placed.at(0.25, 0.0), atol=1)
        normals = stacked(framebuffer, ("N.X", "N.Y", "N.Z"))
        np.testing.assert_allclose(normals, np.broadcast_to(placed.normal, normals.shape), atol=1e-6)
        assert (framebuffer["Z"] == 0).all()
        assert (framebuffer["A"] == 1).all()
        assert (framebuffer["samples"] == 1).all()
        assert (framebuffer["steps"] >= 1).all()
        assert (framebuffer["steps"] <= framebuffer["iterations"]).all()
        # Counts are those of the points, by NumPy and in float64.
        count, _ = reference.escape(scene.chain, pixel_points(scene).reshape(-1, 3), 64)
        assert (count.reshape(40, 60) == framebuffer["iterations"]).mean() > 0.98


def palette_by_numpy(palette: str, place: Floats, *, repeat: bool) -> Floats:
    """The palette's colours at places, mixed linearly between its 256 entries."""
    table = named_table(palette).astype(float)
    if repeat:
        table = np.vstack([table, table[:1]])
        place = place - np.floor(place)
    at = np.clip(place, 0, 1) * (len(table) - 1)
    return np.stack([np.interp(at, np.arange(len(table)), table[:, i]) for i in range(3)], axis=-1)


CURVES: dict[str, Callable[[Floats], Floats]] = {
    "linear": lambda n: n / 64,
    "root": lambda n: np.sqrt(n / 64),
    "log": lambda n: np.log(np.maximum(n, 1)) / np.log(64),
}


class TestColors:
    @pytest.mark.parametrize("curve", CURVES)
    @pytest.mark.parametrize("repeat", [False, True], ids=["ends go on", "repeat"])
    def test_the_palette_over_the_curve(self, device: Device, curve: str, repeat: bool) -> None:
        colors = {
            **SMOOTH,
            "palette": "magma",
            "curve": curve,
            "scale": 2.5,
            "offset": -0.3,
            "repeat": repeat,
            "inside": [0.25, 0.5, 2],
        }
        framebuffer = shoot(plane_scene(size=(48, 48), plane=WHOLE, colors=colors), device)
        inside = framebuffer["iterations"] == 64
        quantity = CURVES[curve](framebuffer["iterations"].astype(float))
        wanted = palette_by_numpy("magma", 2.5 * quantity - 0.3, repeat=repeat)
        np.testing.assert_allclose(picture_of(framebuffer)[~inside], wanted[~inside], atol=2e-4)
        np.testing.assert_array_equal(
            picture_of(framebuffer)[inside], np.broadcast_to([0.25, 0.5, 2], (inside.sum(), 3))
        )
        assert 0.1 < inside.mean() < 0.5

    @pytest.mark.parametrize("curve", CURVES)
    def test_a_single_iteration(self, device: Device, curve: str) -> None:
        """C itself is the first application: nobody within the bailout has escaped, and no curve breaks."""
        colors = {**SMOOTH, "curve": curve}
        plane = {"width": 12, "height": 12}
        framebuffer = shoot(plane_scene(size=(32, 32), iterations=1, plane=plane, colors=colors), device)
        assert np.isfinite(stacked(framebuffer)).all()
        radius = np.hypot(framebuffer["P.X"], framebuffer["P.Y"])
        np.testing.assert_array_equal((picture_of(framebuffer) == 0).all(axis=-1), radius <= 4)


class TestSolids:
    def test_a_sponge_is_cut_where_the_surface_is(self, device: Device) -> None:
        """Its inside is the last solid, which is less than the ball of the bailout."""
        plane = {"center": [0, 0, 0.2], "normal": [0.3, 0.2, 1], "width": 3.2, "height": 3.2}
        scene = plane_scene("menger_sponge", (96, 96), iterations=3, plane=plane, colors=SMOOTH)
        framebuffer = shoot(scene, device)
        distance = reference.distance(scene.chain, pixel_points(scene).reshape(-1, 3), 3)[0].reshape(96, 96)
        inside = (picture_of(framebuffer) == 0).all(axis=-1)
        assert (inside == (distance == 0)).mean() > 0.995
        assert 0.1 < inside.mean() < 0.9

    def test_linear_formulas_have_smooth_counts(self, device: Device) -> None:
        """|z| grows by 3 each time: after log(R / r) / log(3) applications, a fraction of one included, it is R."""
        formula = {**BALL, "map": ["3*x", "3*y", "3*z"]}
        scene = plane_scene(formula, (48, 48), iterations=20, plane={"width": 2, "height": 1}, colors=SMOOTH)
        framebuffer = shoot(scene, device)
        radius = np.hypot(framebuffer["P.X"], framebuffer["P.Y"]).astype(float)
        expected = np.log(scene.chain.distance_bailout / radius) / np.log(3)
        np.testing.assert_allclose(framebuffer["iterations"], expected, atol=1e-4)


class TestSamples:
    def test_the_mean_is_the_area(self, device: Device) -> None:
        """White in a disk of radius 0.8 (a ball of radius 1, cut at height 0.6), black outside."""
        plane = {"center": [0, 0, 0.6], "width": 2, "height": 2}
        scene = plane_scene(
            BALL,
            (40, 40),
            iterations=4,
            plane=plane,
            colors=WHITE_DISK,
            samples=64,
            min_samples=64,
            noise=1e-3,
        )
        framebuffer = shoot(scene, device)
        radius = np.hypot(framebuffer["P.X"], framebuffer["P.Y"])
        half_diagonal = 0.05 * np.sqrt(0.5)
        assert (framebuffer["R"][radius < 0.8 - 2 * half_diagonal] == 1).all()
        assert (framebuffer["R"][radius > 0.8 + 2 * half_diagonal] == 0).all()
        assert framebuffer["R"].sum() * 0.05**2 == pytest.approx(np.pi * 0.64, rel=1e-3)
        assert (framebuffer["samples"] == 64).all()

    def test_noise_sends_samples_to_the_edge(self, device: Device) -> None:
        plane = {"center": [0, 0, 0.6], "width": 2, "height": 2}
        keys: dict[str, Any] = {"samples": 256, "noise": 0.02, "min_samples": 8, "filter": "tent"}
        framebuffer = shoot(
            plane_scene(BALL, (40, 40), iterations=4, plane=plane, colors=WHITE_DISK, **keys), device
        )
        radius = np.hypot(framebuffer["P.X"], framebuffer["P.Y"])
        far, near = np.abs(radius - 0.8) > 0.15, np.abs(radius - 0.8) < 0.02
        assert (framebuffer["samples"][far] == 8).all()
        assert framebuffer["samples"][near].mean() > 60


class TestPrecision:
    @pytest.mark.parametrize(
        ("plane", "size", "wanted"),
        [
            ({}, 1024, "float32"),
            ({"center": [-0.75, 0.1, 0], "width": 1e-2, "height": 1e-2}, 1000, "float64"),
            ({"center": [-0.75, 0.1, 0], "width": 1e-1, "height": 1e-1}, 1000, "float32"),
            # Near the origin coordinates are fine enough, but orbits are not.
            ({"width": 1e-3, "height": 1e-3}, 1000, "float64"),
        ],
    )
    def test_auto(self, plane: dict[str, Any], size: int, wanted: str) -> None:
        scene = plane_scene(size=(size, size), plane=plane)
        assert choose_precision(scene, "auto", has_float64=True)[0] == wanted

    def test_a_plane_that_is_moved_far_off(self) -> None:
        scene = plane_scene(size=(100, 100), plane={"width": 0.1, "height": 0.1})
        far = moved(renderer_of(scene).plane, normal=1e5)
        other = scene.model_copy(update={"renderer": renderer_of(scene).model_copy(update={"plane": far})})
        assert choose_precision(scene, "auto", has_float64=True)[0] == "float32"
        assert choose_precision(other, "auto", has_float64=True)[0] == "float64"


# Whatever the way that the inside is found, but for what it took.
SHOWN = tuple(name for name in CHANNELS if name != "steps")
CASES: dict[str, tuple[dict[str, Any] | str, dict[str, Any], str]] = {
    "hast": ("hast", {"center": [-0.5, 0, 0], "width": 3, "height": 3}, "stepped"),
    "hast, smooth, oblique": (
        "hast",
        {"center": [-0.4, 0, 0.1], "normal": [0.2, 0.5, 1], "width": 3},
        "smooth",
    ),
    # Four coordinates, and a constant: the orbit begins at the point.
    "quaternions": (
        {"name": "quaternion_julia", "julia": [-0.2, 0.6, 0.2, 0]},
        {"width": 3, "height": 3},
        "smooth",
    ),
    # A chain, whose formulas take turns: an orbit must come back in the same turn.
    "bulbox": ("bulbox", {"width": 6, "height": 6, "normal": [1, 0, 0]}, "stepped"),
    # Degree 1: orbits go beyond the bailout and come back.
    "mandelbox": ("mandelbox", {"width": 12, "height": 12, "center": [0, 0, 0.7]}, "smooth"),
}


@pytest.mark.parametrize("case", CASES)
def test_the_picture_is_the_same_bit_for_bit(device: Device, case: str) -> None:
    formula, plane, mode = CASES[case]
    keys: dict[str, Any] = {"iterations": 600, "plane": plane, "colors": {"mode": mode}, "samples": 2}
    found = shoot(plane_scene(formula, (96, 96), **keys), device)
    plain = shoot(plane_scene(formula, (96, 96), periodicity=False, **keys), device)
    assert stacked(found, SHOWN).tobytes() == stacked(plain, SHOWN).tobytes()
    inside = plain["iterations"] == 600
    assert (plain["steps"][inside] >= 600).all()
    assert 0.01 < inside.mean() < 0.9
    assert (found["steps"] <= plain["steps"]).all()


def test_it_finds_most_of_them_soon(device: Device) -> None:
    plane = {"center": [-0.5, 0, 0], "width": 3, "height": 3}
    framebuffer = shoot(
        plane_scene(size=(96, 96), iterations=10_000, plane=plane, colors={"mode": "stepped"}), device
    )
    inside = framebuffer["iterations"] == 10_000
    assert 0.15 < inside.mean() < 0.18  # of the area 9, that of the set is 1.5066
    assert np.median(framebuffer["steps"][inside]) < 200
    assert framebuffer["steps"][inside].mean() < 1000


def test_an_orbit_that_leaves_and_comes_back_is_inside_by_its_last_application(device: Device) -> None:
    """z goes round r, 4 r, 16 r, r, ... and is beyond the bailout of 2 in one or two turns of three, never beyond the
    distance bailout: that it comes back must not hide where it is in the end."""
    formula = {
        "variables": ["x", "y", "z"],
        "let": {"r": "sqrt(x*x + y*y + z*z)", "f": "where(r < 2.5, 4, 0.0625)"},
        "map": ["f*x", "f*y", "f*z"],
        "add": "none",
        "degree": 1,
        "bailout": 2,
        "bounds": {"radius": 2},
    }
    plane = {"width": 2, "height": 2}
    for iterations in range(30, 33):
        scene = plane_scene(formula, (64, 64), iterations=iterations, plane=plane, colors={"mode": "smooth"})
        framebuffer = shoot(scene, device)
        x, y = framebuffer["P.X"].astype(float), framebuffer["P.Y"].astype(float)
        radius = np.hypot(x, y)
        # Powers of two change nothing but the exponent: the orbits are exact.
        for _ in range(iterations):
            radius = radius * np.where(radius < 2.5, 4, 0.0625)
        sure = np.abs(radius - 2) > 1e-5
        inside = (picture_of(framebuffer) == 0).all(axis=-1)
        np.testing.assert_array_equal(inside[sure], (radius <= 2)[sure])
        assert 0.01 < inside.mean() < 0.99
