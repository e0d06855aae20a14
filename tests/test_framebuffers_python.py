"""Framebuffers as Python users have them: arrays, images, data sets, statistics, copies in other processes."""

from __future__ import annotations

import io
import json
import pickle
import sys
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import clfractal
from tests.shell import SCENE, InProcess, works

PAIR = SCENE + "stereo: {screen_width: 0.6, screen_distance: 0.7}\n"


@pytest.fixture(scope="module")
def framebuffer() -> clfractal.Framebuffer:
    return clfractal.render(SCENE)


def test_an_array_of_a_film_has_its_colours_side_by_side(framebuffer: clfractal.Framebuffer) -> None:
    colors = np.asarray(framebuffer)
    assert colors.shape == (36, 40, 3)
    assert colors.dtype == np.float32
    for component, name in enumerate("RGB"):
        np.testing.assert_array_equal(colors[..., component], framebuffer[name])
    assert np.asarray(framebuffer, np.float64).dtype == np.float64
    colors[:] = 7  # a copy: the framebuffer stays as it was
    assert framebuffer["R"].max() < 7
    with pytest.raises(ValueError, match="without copying"):
        np.array(framebuffer, copy=False)
    with pytest.raises(KeyError, match="unknown channel"):
        np.asarray(clfractal.Framebuffer(["Z"], (2, 2)))


def test_an_image_has_the_pixels_of_a_png(framebuffer: clfractal.Framebuffer) -> None:
    image = framebuffer.to_image()
    assert (image.mode, image.size) == ("RGB", (40, 36))
    np.testing.assert_array_equal(np.asarray(image), framebuffer.to_rgb8())
    with pytest.raises(KeyError, match="unknown channel"):
        clfractal.Framebuffer(["Z"], (2, 2)).to_image()


def test_an_image_is_as_bright_and_as_transparent_as_the_scene_says(tmp_path: Path) -> None:
    clear = clfractal.render(SCENE + "background: transparent\noutput: {exposure: 1}\n")
    image = clear.to_image()
    assert image.mode == "RGBA"
    assert 0 < np.asarray(image)[..., 3].mean() < 255
    clear.save(tmp_path / "a.png")
    np.testing.assert_array_equal(np.asarray(image), np.asarray(Image.open(tmp_path / "a.png")))


def test_a_data_set_names_every_channel(tmp_path: Path) -> None:
    xarray = pytest.importorskip("xarray")
    part = clfractal.render(SCENE, region=(8, 4, 16, 10))
    found = part.to_xarray()
    assert isinstance(found, xarray.Dataset)
    assert list(found) == list(part)
    assert dict(found.sizes) == {"y": 10, "x": 16}
    assert float(found.x[0]) == 8.5
    assert float(found.y[-1]) == 13.5
    assert found.Z.dtype == np.float32
    for name in part:
        np.testing.assert_array_equal(found[name], part[name])
    assert float(found.R.sel(x=12.5, y=6.5)) == part["R"][2, 4]
    assert "scene units" in found.Z.attrs["description"]
    assert clfractal.load_scene(found.attrs["scene"]).formula.name == "mandelbulb"
    assert all(isinstance(value, (str, int, float)) for value in found.attrs.values())


def test_a_data_set_needs_xarray(framebuffer: clfractal.Framebuffer, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "xarray", None)
    with pytest.raises(clfractal.FileError, match="pip install xarray"):
        framebuffer.to_xarray()


def test_a_film_has_the_statistics_that_the_shell_writes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "s.yaml").write_text(PAIR.replace("0.7}", "0.7, mode: pair}"))
    shell = InProcess(capsys)
    stats = tmp_path / "s.json"
    works(shell("render", tmp_path / "s.yaml", "-o", tmp_path / "a_.exr", "--stats", stats))
    written = json.loads(stats.read_text())
    left, right = clfractal.render_pair(tmp_path / "s.yaml")
    measured = {"build_ms", "kernel_ms", "write_ms", "wall_ms", "rays_per_second", "peak_memory_mb"}
    # The process may need more memory by the time that the second one is told.
    assert {**left.stats, "peak_memory_mb": 0} == {**right.stats, "peak_memory_mb": 0}
    assert list(left.stats) == list(written)
    assert {key: value for key, value in left.stats.items() if key not in measured} == {
        key: value for key, value in written.items() if key not in measured
    }
    assert left.stats["stereo"]["parallax"]["nearest"] < left.stats["stereo"]["parallax"]["farthest"]
    assert left.stats["write_ms"] == 0
    assert 0 < left.stats["kernel_ms"] < left.stats["wall_ms"]
    json.dumps(left.stats)


def test_the_counts_of_a_film_are_its_rays(framebuffer: clfractal.Framebuffer) -> None:
    assert framebuffer.stats["rays"] == 36 * 40
    assert (framebuffer.stats["width"], framebuffer.stats["height"]) == (40, 36)
    assert framebuffer.stats["samples"] == 1
    assert framebuffer.stats["steps_per_ray"] > 1
    assert clfractal.Framebuffer().stats == {}


def test_a_refinement_counts_all_its_passes() -> None:
    with clfractal.Engine() as engine:
        rays = [framebuffer.stats["rays"] for framebuffer in engine.refine(SCENE, samples=4)]
        once = engine.render(SCENE, samples=4).stats
    coarse = [5 * 5, 10 * 9, 20 * 18]
    whole = 40 * 36
    assert rays == np.cumsum([*coarse, whole, whole, 2 * whole]).tolist()
    assert once["rays"] == 4 * whole


def test_parallax_is_unknown_without_depth() -> None:
    pair = clfractal.render(PAIR.replace("0.7}", "0.7, mode: anaglyph}"), channels=["R", "G", "B"])
    assert pair.stats["stereo"]["parallax"] is None
    assert pair.stats["stereo"]["mode"] == "anaglyph"


def test_a_film_goes_to_another_process_and_back(framebuffer: clfractal.Framebuffer, tmp_path: Path) -> None:
    size = sum(framebuffer[name].nbytes for name in framebuffer)
    written = pickle.dumps(framebuffer)
    assert len(written) < 1.2 * size + 20_000  # each channel once
    again = pickle.loads(written)
    assert (again.channels, again.region, again.display, again.stage) == (
        framebuffer.channels,
        framebuffer.region,
        framebuffer.display,
        "",
    )
    for name in framebuffer:
        np.testing.assert_array_equal(again[name], framebuffer[name])
    assert again.stats == framebuffer.stats
    assert again.done.all()
    again["R"][0, 0] = 5
    assert np.asarray(again)[0, 0, 0] == 5  # channels and data are one
    assert repr(again) == repr(framebuffer)
    again.save(tmp_path / "a.png")
    assert clfractal.load_scene(tmp_path / "a.png") == clfractal.load_scene(framebuffer.header["scene"])
    stream = io.BytesIO()
    framebuffer.to_image().save(stream, "PNG")
    assert stream.getvalue()
