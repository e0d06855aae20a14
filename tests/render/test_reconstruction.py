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
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    Floats,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of

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
