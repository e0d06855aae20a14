"""Pictures without noise: nearer to the truth, the same each time, and in all kinds of files."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.errors import FileError
from clfractal.files.channels import NOISY, NORMAL
from clfractal.files.exr import read_exr
from clfractal.images.denoise import denoised
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.path_scenes import path, scene_of
from tests.render.shots import engine_of

pytestmark = pytest.mark.light

pyoidn = pytest.importorskip("pyoidn")

Floats = npt.NDArray[np.float32]
COLORS = ("R", "G", "B")


def bulb(samples: int = 2, **output: Any) -> Scene:
    """A bulb under a white sky, 96 x 64."""
    return scene_of(
        formula={"name": "mandelbulb", "iterations": 4},
        camera={"position": [1.3, -2.4, 0.9], "fov": 36},
        image={"width": 96, "height": 64},
        lighting=path(3),
        background={"top": [1, 1, 1], "bottom": [0.1, 0.1, 0.1]},
        renderer={"samples": samples},
        output=output,
    )


def colors(framebuffer: Framebuffer, names: tuple[str, ...] = COLORS) -> Floats:
    return np.stack([framebuffer[name] for name in names], axis=-1)


def error(picture: Floats, truth: Floats) -> float:
    """Mean square of the relative error, as far as a bright ground allows one."""
    return float(np.mean((picture - truth) ** 2 / (truth**2 + 0.01)))


def test_a_denoised_picture_is_nearer_to_the_truth(device: Device, tmp_path: Path) -> None:
    """Its error is less than 0.3 of that of what the rays found, which the file keeps bit for bit."""
    engine = engine_of(device)
    clean = engine.render(bulb(denoise=True, channels=["R", "G", "B", "A", *NOISY]))
    noisy = engine.render(bulb(channels=["R", "G", "B", "A"]))
    truth = colors(engine.render(bulb(150)))
    assert np.array_equal(colors(clean, NOISY), colors(noisy))
    assert np.array_equal(clean["A"], noisy["A"])
    assert clean.channels == ("R", "G", "B", "A", *NOISY)
    assert error(colors(noisy), truth) > 0.01
    assert error(colors(clean), truth) < 0.3 * error(colors(noisy), truth)
    assert "denoised" not in noisy.header
    clean.save(tmp_path / "a.exr")
    planes, header = read_exr(tmp_path / "a.exr")
    assert set(planes) == {"R", "G", "B", "A", *NOISY}
    assert header["clfractalDenoised"] == clean.header["denoised"] == "Open Image Denoise"
    again = engine.render(bulb(denoise=True))
    assert np.array_equal(colors(again), colors(clean))


def test_albedo_and_normals_keep_detail() -> None:
    """Stripes that only the albedo tells from noise stay."""
    random = np.random.default_rng(3)
    stripes = np.repeat(np.where(np.arange(64) % 4 < 2, 0.3, 0.6), 3).reshape(64, 3)
    truth = np.broadcast_to(stripes, (64, 64, 3)).astype(np.float32)
    noisy = (truth * random.exponential(1, (64, 64, 1))).astype(np.float32)
    flat = np.zeros_like(truth)
    flat[..., 2] = 1
    alone, helped = error(denoised(noisy), truth), error(denoised(noisy, truth, flat), truth)
    assert helped < 0.2 * alone < 0.2 * error(noisy, truth)


def test_values_that_are_no_light_do_no_harm() -> None:
    random = np.random.default_rng(4)
    picture = random.random((32, 48, 3), dtype=np.float32)
    wanted = denoised(picture)
    spoilt = picture.copy()
    spoilt[5, 7] = np.nan
    spoilt[9, 11, 1] = np.inf
    spoilt[20, 30] = -1
    spoilt[25, 40] = 1e9
    before = spoilt.copy()
    found = denoised(spoilt)
    assert np.isfinite(found).all()
    assert np.array_equal(spoilt, before, equal_nan=True)
    assert (found[25, 40] == 1e9).all()
    assert found.min() >= 0
    far = np.s_[:4, 40:]
    assert np.abs(found[far] - wanted[far]).max() < 0.2
    assert denoised(picture[:1, :1]).shape == (1, 1, 3)


# Branches up to far away, finer than pixels there, behind fog that lies over the ground.
FOGGED: dict[str, Any] = {
    "formula": {
        "name": "pseudo_kleinian",
        "parameters": {"size": 1, "box_x": 0.92436, "box_y": 0.90756, "box_z": 0.92436, "sheet": 0.03},
        "iterations": 7,
    },
    "image": {"width": 240, "height": 135},
    "camera": {"position": [0.2, -1.6, 0.5], "target": [0, 0.4, 0.2], "fov": 60},
    "lighting": path(3),
    "lights": [
        {"direction": [0.8, 0.25, -0.5], "temperature": 3800, "intensity": 4, "angular_size": 1},
    ],
    "environment": {"sky": {"sun_elevation": 25, "sun": False}, "intensity": 0.6},
    "fog": {
        "color": [0.25, 0.3, 0.36],
        "density": 0.6,
        "height": 0.3,
        "base": 0,
        "scattering": {"anisotropy": 0.4},
    },
    "coloring": {
        "by": "trap",
        "trap": {"shape": "plane"},
        "palette": ["#2d3a2a", "#75814f", "#b9a77a", "#6b5c4d"],
        "scale": 1.2,
    },
    "renderer": {"samples": 16},
}


def grain(picture: Floats) -> float:
    """How much pixels differ from the mean of the 3 x 3 around them, in parts of it (root mean square)."""
    light = picture.mean(axis=-1)
    windows = np.lib.stride_tricks.sliding_window_view(light, (3, 3)).mean(axis=(2, 3))
    return float(np.std(light[1:-1, 1:-1] / windows - 1))


def test_what_fog_hides_keeps_no_grain(device: Device) -> None:
    """Where nothing but fog is seen, detail behind it is no reason to keep noise; of 400 samples the grain is 0.014."""
    names = ["R", "G", "B", *NOISY, *NORMAL]
    scene = clfractal.Scene(**{"version": 1, **FOGGED, "output": {"denoise": True, "channels": names}})
    framebuffer = engine_of(device).render(scene)
    hidden = np.s_[95:130, 22:80]
    assert np.median(np.linalg.norm(colors(framebuffer, NORMAL)[hidden], axis=-1)) < 0.02
    assert grain(colors(framebuffer, NOISY)[hidden]) > 0.08
    assert grain(colors(framebuffer)[hidden]) < 0.015


@pytest.mark.parametrize("lamp", [0, 1e6])
def test_no_light_where_nothing_is(device: Device, lamp: float) -> None:
    """Neither the surface's nor that of a highlight, which may be much brighter, goes over the picture's rim."""
    lamps = [{"type": "sphere", "position": [1.4, -1.2, 1.2], "radius": 0.05, "intensity": lamp}]
    dark = {
        "environment": {"sky": {}, "background": False},
        "background": {"top": [0, 0, 0], "bottom": [0, 0, 0]},
    }
    scene = scene_of(
        formula={"name": "mandelbulb", "iterations": 6},
        image={"width": 128, "height": 96},
        camera={"position": [0, -3.5, 0.8], "fov": 45},
        lighting=path(3),
        material={"color": [0.8, 0.7, 0.6]},
        renderer={"samples": 8},
        output={"denoise": True, "channels": ["R", "G", "B", "A"]},
        **({"lights": lamps, "background": "transparent"} if lamp else dark),
    )
    framebuffer = engine_of(device).render(scene)
    nothing = framebuffer["A"] == 0
    assert 0.5 < nothing.mean() < 0.9
    assert not colors(framebuffer)[nothing].any()
    assert colors(framebuffer)[framebuffer["A"] == 1].mean() > 0.05
    alone = engine_of(device).render(scene, channels=["R", "G", "B"])
    assert np.array_equal(colors(alone), colors(framebuffer))


def test_light_that_comes_by_chance_is_kept(device: Device) -> None:
    """A lamp's light in fog is seen where no surface is; of few samples many have none of it."""
    values = bulb(1, denoise=True, channels=["R", "G", "B", "A", *NOISY]).model_dump(
        mode="json", exclude_none=True
    )
    values["background"] = "transparent"
    values["lights"] = [
        {"type": "point", "position": [-1.6, 0, 0], "intensity": 1, "falloff": "inverse_square"}
    ]
    values["fog"] = {"color": [0, 0, 0], "density": 0.4, "scattering": {}}
    framebuffer = engine_of(device).render(Scene(**values))
    unlucky = (framebuffer["A"] == 0) & (colors(framebuffer, NOISY) == 0).all(axis=-1)
    assert unlucky.any()
    assert (colors(framebuffer)[unlucky] > 0).mean() > 0.9


def test_each_eye_view_and_region(device: Device) -> None:
    """Eyes of a pair are denoised each by itself, as are views; a region by what it shows."""
    engine = engine_of(device)
    stereo = {
        "mode": "pair",
        "screen_width": 60,
        "screen_distance": 70,
        "plane": {"center": [0, 0, 0], "normal": [1.3, -2.4, 0.9], "width": 2},
    }
    values = bulb(denoise=True, channels=["R", "G", "B", *NOISY]).model_dump(mode="json", exclude_none=True)
    for eye in engine.render_pair(Scene(**{**values, "stereo": stereo})):
        assert np.array_equal(colors(eye), denoised_as(eye, engine, values, stereo, eye.header["view"]))
    part = engine.render(bulb(denoise=True), region=(16, 8, 48, 40))
    whole = engine.render(bulb(denoise=True))
    assert colors(part).shape == (40, 48, 3)
    assert not np.array_equal(colors(part), colors(whole)[8:48, 16:64])
    assert np.abs(colors(part) - colors(whole)[8:48, 16:64]).mean() < 0.02


def denoised_as(
    eye: Framebuffer, engine: Any, values: dict[str, Any], stereo: dict[str, Any], side: str
) -> Floats:
    """What denoising makes of an eye's layers, which are rendered as a picture of that eye."""
    aids = [f"{name}.{part}" for name, parts in (("albedo", "RGB"), ("normal", "XYZ")) for part in parts]
    output = {"denoise": False, "channels": [*COLORS, *aids]}
    framebuffer = engine.render(Scene(**{**values, "stereo": {**stereo, "mode": side}, "output": output}))
    assert np.array_equal(colors(framebuffer), colors(eye, NOISY))
    return denoised(
        colors(framebuffer), colors(framebuffer, tuple(aids[:3])), colors(framebuffer, tuple(aids[3:]))
    )


def test_volumes_are_denoised_by_their_colours(device: Device) -> None:
    values = bulb(denoise=True).model_dump(mode="json", exclude_none=True)
    del values["lighting"]
    values["renderer"] = {"type": "volume", "resolution": 32, "samples": 1}
    framebuffer = engine_of(device).render(Scene(**values))
    values["output"] = {}
    assert np.array_equal(colors(framebuffer), denoised(colors(engine_of(device).render(Scene(**values)))))


def test_without_the_package_one_line_says_what_to_install(
    monkeypatch: pytest.MonkeyPatch, device: Device
) -> None:
    import importlib.util

    found = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name, *more: None if name == "pyoidn" else found(name, *more)
    )
    monkeypatch.setitem(sys.modules, "pyoidn", None)
    message = r"output\.denoise: needs the package pyoidn: pip install 'clfractal\[denoise\]'"
    with pytest.raises(FileError, match=message):
        engine_of(device).render(bulb(denoise=True))
    with pytest.raises(FileError, match=message):
        denoised(np.zeros((4, 4, 3), np.float32))
    assert clfractal.render(bulb(1), channels=["R"])["R"].shape == (64, 96)
