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
from clfractal.files.channels import NOISY
from clfractal.files.exr import read_exr
from clfractal.pictures.denoise import denoised
from clfractal.pictures.film import Film
from clfractal.scene.model import Scene
from tests.render.shots import engine_of
from tests.render.test_paths import path, scene_of

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


def colors(film: Film, names: tuple[str, ...] = COLORS) -> Floats:
    return np.stack([film[name] for name in names], axis=-1)


def error(picture: Floats, truth: Floats) -> float:
    """Mean square of the relative error, as far as a bright ground allows one."""
    return float(np.mean((picture - truth) ** 2 / (truth**2 + 0.01)))


def test_a_denoised_picture_is_nearer_to_the_truth(device: Device) -> None:
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
    assert clean.header["denoised"] == "Open Image Denoise"
    assert "denoised" not in noisy.header
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


def denoised_as(eye: Film, engine: Any, values: dict[str, Any], stereo: dict[str, Any], side: str) -> Floats:
    """What denoising makes of an eye's layers, which are rendered as a picture of that eye."""
    aids = [f"{name}.{part}" for name, parts in (("albedo", "RGB"), ("normal", "XYZ")) for part in parts]
    output = {"denoise": False, "channels": [*COLORS, *aids]}
    film = engine.render(Scene(**{**values, "stereo": {**stereo, "mode": side}, "output": output}))
    assert np.array_equal(colors(film), colors(eye, NOISY))
    return denoised(colors(film), colors(film, tuple(aids[:3])), colors(film, tuple(aids[3:])))


def test_volumes_are_denoised_by_their_colours(device: Device) -> None:
    values = bulb(denoise=True).model_dump(mode="json", exclude_none=True)
    del values["lighting"]
    values["renderer"] = {"type": "volume", "resolution": 32, "samples": 1}
    film = engine_of(device).render(Scene(**values))
    values["output"] = {}
    assert np.array_equal(colors(film), denoised(colors(engine_of(device).render(Scene(**values)))))


def test_files_say_that_they_are_denoised(device: Device, tmp_path: Path) -> None:
    film = engine_of(device).render(bulb(denoise=True, channels=["R", "G", "B", "A", *NOISY]))
    film.save(tmp_path / "a.exr")
    planes, header = read_exr(tmp_path / "a.exr")[:2]
    assert set(planes) == {"R", "G", "B", "A", *NOISY}
    assert header["clfractalDenoised"] == "Open Image Denoise"


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
