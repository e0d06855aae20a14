"""How samples become a pixel: adaptive sampling, the limit on fireflies, and colours at edges, in a file too."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import png
import pytest

from clfractal.device.select import Device
from clfractal.files.srgb import encode
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.outputs import save_outputs
from clfractal.scene.model import Scene
from tests.environment_maps import write_map
from tests.render.programs import compile_all
from tests.render.sequence import unit_squares
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    CHANNELS,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    SOLIDS,
    Floats,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of
from tests.variants import one_of

SIDE, DETAIL = 48, 0.01
RIM = 0.1  # of DETAIL: how much wider the ball looks
RGB = ("R", "G", "B")


def flat(color: list[float]) -> dict[str, Any]:
    """Ambient light alone: every sample of the ball has this colour."""
    return {
        "lights": [{"shadow": False}],
        "material": {"color": color, "ambient": 1, "diffuse": 0, "specular": 0},
    }


# Adaptive sampling.


def adaptive(
    noise: float | None,
    samples: int,
    min_samples: int | None,
    white: bool,
    transparent: bool,
    greys: tuple[float, float] | None = None,
) -> Scene:
    """A ball and what is behind it: white or black before black, or of two `greys`."""
    renderer = {"noise": noise, "samples": samples, "min_samples": min_samples, "detail": DETAIL}
    ball, sky = greys or (float(white), 0.0)
    return scene_of(
        QUICK_BALL,
        ORTHOGRAPHIC,
        (SIDE, SIDE),
        **flat([ball] * 3),
        background="transparent" if transparent else {"top": [sky] * 3, "bottom": [sky] * 3},
        renderer={key: value for key, value in renderer.items() if value is not None},
    )


@pytest.fixture(scope="module", autouse=True)
def _compiled(device: Device, tmp_path_factory: pytest.TempPathFactory) -> None:
    sky = sun_scene(tmp_path_factory.mktemp("sun"), 1.0, None)
    compile_all([sky, *(adaptive(noise, 16, None, True, True) for noise in (None, 0.1))], device)


def judged(seen: Floats, noise: float, least: int) -> tuple[Floats, Floats]:
    """Samples that each pixel gets, and the mean of what they see, of those it could get, (SIDE, SIDE, samples)."""
    most = seen.shape[-1]
    count = np.full(seen.shape[:2], most)
    for n in range(4 * ((least + 3) // 4), most, 4):
        error = np.sqrt(seen[..., :n].var(-1) / (n - 1))
        count = np.where((count == most) & (error <= noise), n, count)
    kept = np.arange(most) < count[..., None]
    return count, np.asarray((seen * kept).sum(-1) / count)


@lru_cache
def passing(samples: int | None = None) -> Floats:
    """How far from the ball's middle each sample's ray passes, (SIDE, SIDE, samples); or those of a fine grid."""
    scene = adaptive(None, 1, None, True, False)
    if samples is None:
        samples, (row, column) = 400, np.divmod(np.arange(400), 20)
        across, below = (np.broadcast_to((a + 0.5) / 20, (SIDE, SIDE, 400)) for a in (column, row))
    else:
        across, below = unit_squares(SIDE, SIDE, samples, 0)
    each = [
        to_sphere(*rays(scene, across[..., n], below[..., n])[:2], [0, 0, 0], 1.0)[1] for n in range(samples)
    ]
    return np.stack(each, axis=-1)


@pytest.mark.parametrize(
    ("white", "transparent"), [(True, False), (True, True), (False, True)], ids=["light", "both", "coverage"]
)
@pytest.mark.parametrize(("noise", "least"), [(0.07, None), (0.03, 8), (0.045, 30)])
def test_samples_by_noise(
    device: Device, noise: float, least: int | None, white: bool, transparent: bool
) -> None:
    """Sample by sample: the standard error of what is seen, light or coverage, is what stops a pixel."""
    samples = 128
    framebuffer = shoot(adaptive(noise, samples, least, white, transparent), device)
    # A ray past the ball hits where the distance, half the true one there, is below 0.03 of DETAIL.
    hit_distance = DETAIL * 2.6 / SIDE
    sure = (np.abs(passing(samples) - BALL_RADIUS - RIM * hit_distance) > 0.2 * hit_distance).all(-1)
    hits = passing(samples) < BALL_RADIUS + RIM * hit_distance
    count, mean = judged(hits.astype(float), noise, least or 16)
    taken, first = framebuffer["samples"], 4 * -(-(least or 16) // 4)
    assert taken.min() == first
    assert taken.max() <= samples
    assert (sure & (count > first)).sum() > 45
    np.testing.assert_array_equal(taken[sure], count[sure])
    np.testing.assert_allclose(framebuffer["A"][sure], mean[sure], atol=1e-6)
    np.testing.assert_allclose(framebuffer["R"], framebuffer["A"] if white else 0, atol=1e-6)
    # The error is below what was asked for, but where samples ran out or the first ones were all alike by chance.
    exact = (passing() < BALL_RADIUS + RIM * hit_distance).mean(-1)
    error = framebuffer["A"] - exact
    alike = (framebuffer["A"] == 0) | (framebuffer["A"] == 1)
    assert np.abs(error[alike]).max() < 1.5 / first
    stopped = ~alike & (taken < samples)
    assert stopped.sum() > 10
    assert np.sqrt((error[stopped] ** 2).mean()) < 0.7 * noise


def test_samples_by_the_noise_of_greys(device: Device) -> None:
    """What counts is brightness as an eye perceives it, the root of luminance; 0 and 1 are their own roots."""
    ball, sky, noise, samples = 0.09, 0.36, 0.0191, 64
    framebuffer = shoot(adaptive(noise, samples, None, True, False, (ball, sky)), device)
    hit_distance = DETAIL * 2.6 / SIDE
    sure = (np.abs(passing(samples) - BALL_RADIUS - RIM * hit_distance) > 0.2 * hit_distance).all(-1)
    hits = passing(samples) < BALL_RADIUS + RIM * hit_distance
    count, _ = judged(np.where(hits, ball**0.5, sky**0.5), noise, 16)
    # The roots differ by 0.3, the luminances by 0.27: neither these nor others would stop at the same samples.
    assert len(np.unique(count[sure])) > 5
    np.testing.assert_array_equal(framebuffer["samples"][sure], count[sure])


def test_without_noise_every_pixel_gets_all(device: Device) -> None:
    framebuffer = shoot(adaptive(None, 24, None, True, False), device)
    assert (framebuffer["samples"] == 24).all()
    # A target that nothing meets leaves the same samples, and so the same picture.
    strict = shoot(adaptive(1e-9, 24, None, True, False), device)
    flat_parts = (framebuffer["A"] == 0) | (framebuffer["A"] == 1)
    assert (strict["samples"][flat_parts] == 16).all()
    assert (strict["samples"][~flat_parts] == 24).mean() > 0.9
    whole = strict["samples"] == 24
    np.testing.assert_array_equal(stacked(strict, RGB)[whole], stacked(framebuffer, RGB)[whole])


# Fireflies.


def sun_scene(folder: Path, sun: float, limit: float | None, **sections: Any) -> Scene:
    """A matt or mirroring ball under an even sky with a small sun of another colour."""
    sky = np.full((16, 32, 3), [0.3, 0.4, 0.5], np.float32)
    sky[4:6, 9:11] = np.array([1, 0.8, 0.5]) * sun
    path = write_map(folder / f"sun{sun:g}.exr", sky)
    renderer = {"firefly_limit": limit, "bounces": 1, "detail": 0.05, **sections.pop("renderer", {})}
    usual = {"environment": {"file": path.name, "rays": 4}, "renderer": renderer, "lights": []}
    return scene_of(BALL, PERSPECTIVE, (SIDE, SIDE), folder=folder, **{**usual, **sections})


def seen(framebuffer: Framebuffer) -> Floats:
    return stacked(framebuffer, RGB).astype(float)


def matt(reflection: float) -> dict[str, Any]:
    return {"color": [1, 1, 1], "ambient": 0, "diffuse": 1, "specular": 0, "reflection": reflection}


@pytest.mark.parametrize("reflection", [0.0, 1.0], ids=["environment", "mirror"])
@pytest.mark.parametrize(("limit", "exposure"), [(1.0, 0.0), (3.0, 2.0)])
def test_fireflies(device: Device, tmp_path: Path, reflection: float, limit: float, exposure: float) -> None:
    """One sample's light from its rays is at most the limit, in its own hue; less light stays as it is. Exposure is no
    part of it: what a picture holds is what the scene sends out."""
    parts = {"material": matt(reflection), "output": {"exposure": exposure}}
    free, bound = (shoot(sun_scene(tmp_path, 400, chosen, **parts), device) for chosen in (None, limit))
    hit = free["A"] == 1
    light = seen(free)
    brightest = light.max(-1, keepdims=True)
    assert (hit & (brightest[..., 0] > limit)).sum() > 20
    assert (hit & (brightest[..., 0] < limit)).sum() > 500
    expected = np.where(hit[..., None], light * np.minimum(1, limit / brightest), light)
    np.testing.assert_allclose(seen(bound), expected, rtol=1e-5)
    assert seen(bound)[hit].max() <= limit * 1.00001
    # Behind the ball the sun itself is seen as it is.
    np.testing.assert_array_equal(seen(bound)[~hit], light[~hit])


def test_limit_changes_nothing_dark(device: Device, tmp_path: Path) -> None:
    """Where no ray brings much the picture stays, bit for bit; lamps may be as bright as they like."""
    for parts in (
        {"material": matt(0.5)},
        {"material": matt(0), "lights": [{"intensity": 50, "shadow": False}]},
    ):
        free, bound = (shoot(sun_scene(tmp_path, 0.4, limit, **parts), device) for limit in (None, 2.0))
        np.testing.assert_array_equal(stacked(bound), stacked(free))
    assert seen(bound).max() > 20


# Edges.


@pytest.mark.parametrize("bits", [8, 16])
@pytest.mark.parametrize("name", ["box", "blackman_harris"])
def test_edges_have_the_surfaces_colour(device: Device, tmp_path: Path, name: str, bits: Any) -> None:
    """Over a transparent background R, G, B are premultiplied: divided by coverage they are the surface's colour, to the
    last pixel that has any; so are those of a PNG."""
    color = [0.25, 0.5, 0.9]
    scene = scene_of(
        QUICK_BALL,
        PERSPECTIVE,
        (SIDE, SIDE),
        **flat(color),
        background="transparent",
        renderer={"samples": 64, "filter": name, "noise": 0.02},
    )
    framebuffer = shoot(scene, device)
    coverage = framebuffer["A"][..., None]
    edge = ((coverage > 0) & (coverage < 1))[..., 0]
    assert edge.sum() > 100
    np.testing.assert_allclose(
        stacked(framebuffer, RGB)[edge] / coverage[edge], np.broadcast_to(color, (edge.sum(), 3)), rtol=1e-5
    )
    path = tmp_path / "ball.png"
    save_outputs(framebuffer, [path], transparent=True, bits=bits)
    width, height, rows, _ = png.Reader(filename=str(path)).read()
    pixels: npt.NDArray[Any] = np.array([list(row) for row in rows]).reshape(height, width, 4)
    largest = 2**bits - 1
    there = coverage[..., 0] > 0
    codes = np.broadcast_to(encode(np.array(color)) * largest, (there.sum(), 3))
    np.testing.assert_allclose(pixels[there][:, :3], codes, atol=1.0)
    np.testing.assert_array_equal(pixels[..., 3], np.round(coverage[..., 0] * largest))


GRADIENT = {"top": [0.1, 0.4, 2.0], "bottom": [0.5, 0.0, 1.0]}
# Ambient light alone: every sample of the ball has this colour.
FLAT: dict[str, Any] = {
    "lights": [{"shadow": False}],
    "material": {"color": [0.25, 0.5, 1.0], "ambient": 1, "diffuse": 0, "specular": 0},
}


def test_background(device: Device) -> None:
    """Linear between its colours from the picture's upper rim to its lower one."""
    scene = scene_of(QUICK_BALL, PERSPECTIVE, (40, 50), background=GRADIENT)
    framebuffer = shoot(scene, device)
    share = ((np.arange(50) + 0.5) / 50)[:, None, None]
    expected = (1 - share) * np.array(GRADIENT["top"]) + share * np.array(GRADIENT["bottom"])
    miss = framebuffer["A"] == 0
    assert miss.sum() > 500
    np.testing.assert_allclose(
        stacked(framebuffer, RGB)[miss], np.broadcast_to(expected, (50, 40, 3))[miss], rtol=1e-6
    )


@pytest.mark.parametrize("samples", [1, 16])
def test_transparent(device: Device, samples: int) -> None:
    """R, G, B are premultiplied: the colour times the coverage, 0 where nothing is hit."""
    scene = scene_of(QUICK_BALL, PERSPECTIVE, background="transparent", **FLAT)
    framebuffer = shoot(scene, device, samples=samples)
    coverage = framebuffer["A"]
    if samples == 1:
        assert set(np.unique(coverage)) == {0, 1}
    else:
        assert np.array_equal(coverage * 16, np.round(coverage * 16))
        assert len(np.unique(coverage)) > 5
    np.testing.assert_allclose(
        stacked(framebuffer, RGB), coverage[..., None] * np.array([0.25, 0.5, 1]), rtol=1e-6
    )


@pytest.mark.parametrize("samples", [16, 64])
def test_coverage_is_the_share_of_the_area(device: Device, samples: int) -> None:
    """Seen from infinity the ball is a disc. Independent samples would have a standard error of
    sqrt(p (1 - p) / N) in a pixel that the disc covers by p; stratified ones halve it at least, and the whole
    area is better still."""
    scene = scene_of(QUICK_BALL, ORTHOGRAPHIC, (SIDE, SIDE), renderer={"detail": DETAIL}, **FLAT)
    coverage = shoot(scene, device, samples=samples, channels=("A",))["A"].astype(float)
    fine, pixel = (passing() < BALL_RADIUS).mean(-1), 2.6 / SIDE
    # Ray by ray: only those that pass the ball within two hit distances may hit or not.
    reaches = (-1e-5, 0.02 * pixel + 1e-5)
    least, most = ((passing(samples) < BALL_RADIUS + reach).mean(-1) for reach in reaches)
    assert (coverage >= least).all()
    assert (coverage <= most).all()
    _, middle = to_sphere(*rays(scene)[:2], (0, 0, 0), BALL_RADIUS)
    rim = np.abs(middle - BALL_RADIUS) < 0.75 * pixel  # half a pixel's diagonal, and the hit distance
    assert rim.sum() > 100
    independent = np.sqrt((fine * (1 - fine))[rim].mean() / samples)
    assert np.sqrt(((coverage - fine)[rim] ** 2).mean()) < 0.5 * independent
    # All of it.
    disc = [np.pi * (BALL_RADIUS + 2 * detail * pixel) ** 2 for detail in (0, DETAIL)]
    assert 0.9995 * disc[0] < coverage.sum() * pixel**2 < 1.0005 * disc[1]


def test_averages_are_of_linear_light(device: Device) -> None:
    """A pixel half covered has the mean of the numbers in R, G, B, whatever the exposure of a PNG would be."""
    same = {"top": [0.1, 0.2, 3.0], "bottom": [0.1, 0.2, 3.0]}
    framebuffer = shoot(scene_of(QUICK_BALL, PERSPECTIVE, background=same, **FLAT), device, samples=8)
    a = framebuffer["A"][..., None]
    assert ((a > 0) & (a < 1)).any()
    np.testing.assert_allclose(
        stacked(framebuffer, RGB), a * np.array([0.25, 0.5, 1]) + (1 - a) * np.array(same["top"]), rtol=2e-6
    )


@pytest.mark.parametrize("samples", [2, 5, 16])
def test_data_channels_take_the_nearest_sample(device: Device, samples: int) -> None:
    """Depth, point and normal of one ray, that of the sample nearest to the pixel's centre: hit or not, no averages."""
    scene = scene_of(QUICK_BALL, ORTHOGRAPHIC, (48, 48), renderer={"detail": 0.01, "seed": 7})
    framebuffer = shoot(scene, device, samples=samples)
    across, below = unit_squares(48, 48, samples, 7)
    chosen = ((across - 0.5) ** 2 + (below - 0.5) ** 2).argmin(axis=-1)[..., None]
    u, v = (np.take_along_axis(place, chosen, axis=-1)[..., 0] for place in (across, below))
    origin, direction, _ = rays(scene, u, v)
    distance, nearest = to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)
    sure = np.abs(nearest - BALL_RADIUS) > 1e-2
    hit = np.isfinite(framebuffer["Z"])
    assert np.array_equal(hit[sure], np.isfinite(distance)[sure])
    points, facing = points_of(framebuffer), nearest < 0.9 * BALL_RADIUS
    expected = origin + np.where(np.isfinite(distance), distance, 0)[..., None] * direction
    np.testing.assert_allclose(points[facing], expected[facing], atol=5e-3)
    # On that ray, to rounding: a mean of two rays would lie beside it.
    offset = points - origin
    aside = offset - (offset * direction).sum(-1, keepdims=True) * direction
    assert np.abs(aside[hit]).max() < 2e-6
    np.testing.assert_allclose(np.linalg.norm(normals_of(framebuffer)[hit], axis=-1), 1, atol=1e-5)
    assert np.isfinite(stacked(framebuffer, [name for name in CHANNELS if name != "Z"])).all()


HALF = 1.2  # of the box's side
FILTERS = [("box", 1.0), ("box", 0.5), ("box", 3.0), ("tent", 2.0), ("tent", 5.0)]
FILTERS += [("blackman_harris", 3.0), ("blackman_harris", 6.0)]


def passed(name: str, place: npt.NDArray[np.floating[Any]]) -> Floats:
    """The part of a filter's area, its width 1, that lies left of places: Harris 1978 for the window of four terms."""
    x = np.clip(place, -0.5, 0.5)
    if name == "box":
        return np.asarray(x + 0.5)
    if name == "tent":
        return np.asarray(np.where(x < 0, 2 * (x + 0.5) ** 2, 1 - 2 * (0.5 - x) ** 2))
    terms = (0.35875, 0.48829, 0.14128, 0.01168)
    waves = [a * np.sin(2 * np.pi * n * x) / (2 * np.pi * n) for n, a in enumerate(terms) if n]
    return np.asarray(0.5 + x + sum(waves) / terms[0])


def from_above(name: str, width: float | None, height: float, up: list[float], samples: int) -> Scene:
    """The box, a square of the side 2 HALF."""
    return scene_of(
        SOLIDS,
        {
            "projection": "orthographic",
            "position": [0, 0, 4],
            "target": [0, 0, 0],
            "up": up,
            "height": height,
        },
        (SIDE, SIDE),
        lights=[],
        renderer={"samples": samples, "filter": name, "filter_width": width, "detail": DETAIL, "seed": 4},
    )


@pytest.mark.parametrize(("name", "width"), FILTERS)
@pytest.mark.parametrize("height", one_of(3.61, 3.3))
def test_profile_of_an_edge(device: Device, name: str, width: float, height: float) -> None:
    """Across an upright or level edge coverage is the filter's integral, but for one sample: of 2^n samples one falls into
    each 2^n-th of the filter's area. The light of the whole square stays."""
    samples = 256
    scene = from_above(name, width, height, [0, 1, 0], samples)
    coverage = shoot(scene, device, channels=("A",))["A"].astype(float)
    pixel = height / SIDE
    places = (np.arange(SIDE) + 0.5) - SIDE / 2
    inner = slice(SIDE // 2 - 4, SIDE // 2 + 4)
    for profile in (coverage[inner].T, coverage[:, inner]):
        least, most = (
            np.subtract(*(passed(name, (side - places) / width) for side in (edge, -edge)))
            for edge in (HALF / pixel, HALF / pixel + 1.1 * DETAIL)
        )
        assert ((least > 0.01) & (least < 0.99)).sum() >= 2 * round(width / 3)
        assert (profile >= least[:, None] - 1.001 / samples).all()
        assert (profile <= most[:, None] + 1.001 / samples).all()
    if (name, width) != ("box", 0.5):  # which leaves gaps between pixels
        assert coverage.sum() * pixel**2 == pytest.approx(4 * (HALF + DETAIL / 2 * pixel) ** 2, rel=1e-3)


def test_whole_picture_is_filtered(device: Device) -> None:
    """A turned square, its corners too: the mean over a tent's area in both directions. Independent samples
    would have a standard error of sqrt(p (1 - p) / N)."""
    samples, fine, height, width = 256, 96, 4.0, 2.0
    scene = from_above("tent", width, height, [0.4, 1, 0], samples)
    coverage = shoot(scene, device, channels=("A",))["A"].astype(float)
    grid = np.linspace(-0.5, 0.5, 20001)
    place = width * np.interp((np.arange(fine) + 0.5) / fine, passed("tent", grid), grid)
    places = ((np.arange(SIDE) + 0.5 - SIDE / 2)[:, None] + place) * height / SIDE
    cosine, sine = np.array([1, 0.4]) / np.hypot(1, 0.4)
    expected = np.zeros((SIDE, SIDE))
    for column, across in enumerate(places):
        x, y = across[:, None, None], -places
        inside = (np.abs(x * cosine + y * sine) < HALF) & (np.abs(y * cosine - x * sine) < HALF)
        expected[:, column] = inside.mean((0, 2))
    error = coverage - expected
    part = (expected > 0.01) & (expected < 0.99)
    assert part.sum() > 140
    independent = np.sqrt((expected * (1 - expected))[part].mean() / samples)
    assert np.sqrt((error[part] ** 2).mean()) < 0.5 * independent
    assert np.abs(error).max() < 0.04
    assert abs(error.sum()) < 2 * DETAIL * 4 * 2 * HALF / height * SIDE


@pytest.mark.parametrize(("name", "width"), [("box", 1.0), ("tent", 2.0), ("blackman_harris", 3.0)])
def test_usual_widths(device: Device, name: str, width: float) -> None:
    usual, given = (
        shoot(from_above(name, chosen, 4.0, [0, 1, 0], 8), device, channels=("A",))["A"]
        for chosen in (None, width)
    )
    np.testing.assert_array_equal(usual, given)
