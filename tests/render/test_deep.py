"""Pictures of deep places: what they show is the set, and what is alike at two depths looks alike."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.errors import ClfractalError
from clfractal.integrators.points import escape
from tests.deep_truth import PLACES, all_depths, exact_count, is_inside, placed
from tests.devices import check_usable, device

Floats = npt.NDArray[np.float64]

SIZE = (24, 16)
FOV = 40.0
QUICK = [("menger_sponge", 100)]


def deep_scene(name: str, depth: int, **more: Any) -> clfractal.Scene:
    """A place from where most is outside."""
    count = PLACES[name]["iterations"][depth]
    chain = placed(name, depth, count)
    rng = np.random.default_rng(2)
    stands = rng.normal(size=(300, 3))
    stands *= 3 / np.linalg.norm(stands, axis=1, keepdims=True)
    counts, _ = escape(chain, stands, count, device=device(), lanes=8, precision="float64")
    said: dict[str, Any] = {
        "version": 1,
        "formula": {**PLACES[name]["formula"], "iterations": count},
        "deep": {"center": PLACES[name]["center"], "magnification": 10.0**depth},
        "camera": {"position": stands[np.argmin(counts)].tolist(), "target": [0, 0, 0], "fov": FOV},
        "image": {"width": SIZE[0], "height": SIZE[1]},
        "renderer": {"max_steps": 4000},
        **more,
    }
    return clfractal.load_scene(said)


def hits(scene: clfractal.Scene) -> Floats:
    """Where rays hit, shape (n, 3); NaN where they do not."""
    picture = clfractal.render(scene, channels=["P.X", "P.Y", "P.Z", "A"], precision="float64")
    points = np.stack([picture[f"P.{axis}"] for axis in "XYZ"], axis=-1).astype(float)
    points[picture["A"] <= 0] = np.nan
    return points.reshape(-1, 3)


def off_by(name: str, depth: int, eye: Floats, point: Floats, count: int) -> float:
    """How far from a hit the solid is, in footprints: the nearest inside point that is found; infinite where there is none.

    Nor may the ray have gone through the solid before: then it is infinite, too.
    """
    away = float(np.linalg.norm(point - eye))
    along, footprint = (point - eye) / away, away * 2 * np.tan(np.radians(FOV / 2)) / SIZE[1]
    before = np.linspace(0.3 * away, away - 3 * footprint, 8)
    if any(is_inside(name, depth, eye + float(t) * along, count) for t in before):
        return np.inf
    beside = np.random.default_rng(1).normal(size=(4, 3))
    for reach in (0.1, 0.5, 1.0, 2.0, 3.0):
        tries = [along, -along, *(each / np.linalg.norm(each) for each in beside)]
        if any(is_inside(name, depth, point + reach * footprint * each, count) for each in tries):
            return reach
    return np.inf


def check_hits(name: str, depth: int, rays: int) -> None:
    check_usable("float64")
    scene = deep_scene(name, depth)
    found = hits(scene)
    found = found[np.isfinite(found[:, 0])]
    assert len(found) > 20
    chosen = np.random.default_rng(4).permutation(len(found))[:rays]
    eye = np.array(scene.camera.position)
    off = [off_by(name, depth, eye, found[each], scene.formula.iterations) for each in chosen]
    assert np.percentile(off, 95) <= 1
    assert max(off) <= 3


@pytest.mark.parametrize(("name", "depth"), QUICK)
def test_rays_hit_the_set(name: str, depth: int) -> None:
    check_hits(name, depth, 12)


@pytest.mark.combination
@pytest.mark.parametrize(("name", "depth"), all_depths())
def test_all_rays_hit_the_set(name: str, depth: int) -> None:
    check_hits(name, depth, 300)


# A point of the Menger sponge whose ternary digits have period two: it lies on no fold, and nine times nearer all is alike.
PERIODIC = {"center": ["0.75", "0.25", "0.5"]}


def sponge(power: int, **more: Any) -> clfractal.Scene:
    return clfractal.load_scene(
        {
            "version": 1,
            "formula": {"name": "menger_sponge", "iterations": power + 4},
            "deep": {**PERIODIC, "magnification": 3.0**power},
            "camera": {"position": [0.9, -1.3, 0.7], "target": [0, 0, 0], "fov": 50},
            "image": {"width": 48, "height": 32},
            **more,
        }
    )


@pytest.mark.parametrize("powers", [(10, 40), (10, 210)])
def test_a_sponge_looks_alike_at_all_depths(powers: tuple[int, int]) -> None:
    check_usable("float64")
    shallow, deep = (hits(sponge(power)) for power in powers)
    both = np.isfinite(shallow[:, 0]) & np.isfinite(deep[:, 0])
    assert both.mean() > 0.8
    assert np.isfinite(shallow[:, 0]).sum() == np.isfinite(deep[:, 0]).sum() == both.sum()
    apart = np.linalg.norm(shallow - deep, axis=1)[both]
    assert np.percentile(apart, 99) < 1e-6


@pytest.mark.combination
def test_light_along_paths_is_alike_at_all_depths() -> None:
    check_usable("float64")
    lamp = {"type": "point", "position": [0.8, -1.2, 0.7], "intensity": 3}
    light = {"lighting": {"mode": "path"}, "renderer": {"samples": 4}, "lights": [lamp]}
    shallow, deep = (clfractal.render(sponge(power, **light), channels=["R", "G", "B"]) for power in (10, 90))
    for channel in "RGB":
        apart, usual = np.abs(shallow[channel] - deep[channel]), float(shallow[channel].mean())
        assert (apart > 1e-3 * usual).mean() < 0.02
        assert shallow[channel].std() > 0.2 * usual > 1e-4


@pytest.mark.combination
@pytest.mark.parametrize("magnification", [1e3, 1e6])
@pytest.mark.parametrize("name", ["mandelbulb", "mandelbox"])
def test_a_magnified_place_is_what_a_camera_near_it_sees(name: str, magnification: float) -> None:
    check_usable("float64")
    stand, iterations = (0.3, -0.8, 0.4), int(np.log10(magnification)) + 4
    plain: dict[str, Any] = {
        "version": 1,
        "formula": {"name": name, "iterations": iterations},
        "camera": {"position": [3 * s for s in stand], "target": [0, 0, 0]},
        "image": {"width": 32, "height": 24},
        "renderer": {"max_steps": 4000},
    }
    whole = clfractal.probe({**plain, "image": {"width": 33, "height": 25}}, 16, 12, precision="float64")
    center = whole.point
    assert whole.hit
    assert center is not None
    deep = {**plain, "deep": {"center": list(center), "magnification": magnification}}
    near = [c + 3 * s / magnification for c, s in zip(center, stand, strict=True)]
    plain["camera"] = {"position": near, "target": list(center)}
    a = (hits(clfractal.load_scene(plain)) - center) * magnification
    b = hits(clfractal.load_scene(deep))
    both = np.isfinite(a[:, 0]) & np.isfinite(b[:, 0])
    assert both.mean() > 0.3
    assert (np.isfinite(a[:, 0]) != np.isfinite(b[:, 0])).mean() < 0.02
    # (P is float32, near 1: that is what is left of it.)
    apart = np.linalg.norm(a - b, axis=1)[both]
    pixel = 3 * 2 * np.tan(np.radians(20)) / 24
    assert np.percentile(apart, 90) < pixel / 2 + 1e-7 * magnification


@pytest.mark.combination
@pytest.mark.parametrize(
    ("name", "depth"), [("box_and_bulb", 20), ("box_and_bulb", 50), ("burning_ship", 20)]
)
def test_counts_of_a_cut_plane_are_exact(name: str, depth: int) -> None:
    check_usable("float64")
    count = PLACES[name]["iterations"][depth]
    corners = [[-1.0, -0.5, 0.2], [1.0, -0.5, 0.2], [-1.0, 0.5, 0.2]]
    scene = deep_scene(name, depth, renderer={"type": "cut_plane", "plane": {"corners": corners}})
    plane = clfractal.render(scene, channels=["iterations", "P.X", "P.Y", "P.Z"], precision="float64")
    points = np.stack([plane[f"P.{axis}"] for axis in "XYZ"], axis=-1).astype(float)
    exact = [exact_count(name, depth, point, count) for point in points.reshape(-1, 3)]
    # (The channel has smooth counts: whole ones and a part of one.)
    assert np.abs(plane["iterations"].reshape(-1) - exact).max() <= 1.01
    assert plane["iterations"].std() > 0.05


def test_the_disparity_of_a_pair_is_that_of_its_depth() -> None:
    check_usable("float64")
    left, right = clfractal.render_pair(sponge(40, stereo={"screen_width": 0.6, "screen_distance": 0.6}))
    shallow = clfractal.render_pair(sponge(10, stereo={"screen_width": 0.6, "screen_distance": 0.6}))
    for deep, other in zip((left, right), shallow, strict=True):
        np.testing.assert_allclose(deep["Z"], other["Z"], rtol=1e-5)
    assert not np.array_equal(left["Z"], right["Z"])


def test_float32_is_refused() -> None:
    with pytest.raises(ClfractalError, match="deep needs float64, and got float32"):
        clfractal.render(sponge(10), precision="float32")
