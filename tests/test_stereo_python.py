"""Stereo scenes from Python: one composed film, or both eyes'."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clfractal
from clfractal.engine.comfort import fitted
from clfractal.files.srgb import encode8
from clfractal.files.tone import toned
from clfractal.images.compose import compose
from clfractal.scene import given
from clfractal.scene.stereo import Stereo
from tests.calls import counted
from tests.render.volumes import keep
from tests.shell import SCENE

COLORS = ("R", "G", "B", "A", "Z")


def stereo(mode: str, **settings: Any) -> dict[str, Any]:
    scene = clfractal.load_scene(SCENE).resolved()
    return {**scene, "stereo": {"mode": mode, **settings}}


@pytest.mark.parametrize("mode", ["split", "checkerboard", "anaglyph", "right"])
def test_a_composed_film(mode: str) -> None:
    """Of both eyes' films what the mode makes of them; a region is a part of it."""
    film = clfractal.render(stereo(mode), channels=COLORS)
    left, right = clfractal.render_pair(stereo(mode), channels=COLORS)
    section = Stereo.model_validate({"mode": mode})
    eyes = [{name: film[name] for name in film.channels} for film in (left, right)]
    expected = compose(section, eyes[0], eyes[1])
    assert sorted(film.channels) == sorted(expected)
    for name in film.channels:
        np.testing.assert_array_equal(film[name], expected[name])
    region = (9, 5, 25, 21)
    part = clfractal.render(stereo(mode), channels=COLORS, region=region)
    np.testing.assert_array_equal(part["G"], film["G"][5:26, 9:34])
    assert part.header["seconds"] > 0
    assert (film._repr_png_() or b"")[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("mode", ["anaglyph", "anaglyph_chessboard", "split"])
def test_each_eye_goes_through_the_curve_before_they_are_mixed(mode: str, tmp_path: Path) -> None:
    """As display light, so that a filter lets the same colour pass however the curve bends it."""
    scene = {**stereo(mode), "output": {"tone": "reinhard", "exposure": 1.5}}
    film = clfractal.render(scene, channels=COLORS)
    linear = clfractal.render({**scene, "output": {"exposure": 1.5}}, channels=COLORS)
    for name in film.channels:
        np.testing.assert_array_equal(film[name], linear[name])
    eyes = []
    for eye in clfractal.render_pair(scene, channels=COLORS):
        lit = [eye[name] * np.float32(2**1.5) for name in "RGB"]
        bent = toned(lit[0], lit[1], lit[2], "reinhard")
        eyes.append({name: eye[name] for name in eye.channels} | dict(zip("RGB", bent, strict=True)))
    shown = compose(Stereo.model_validate({"mode": mode}), eyes[0], eyes[1])
    wanted = encode8(np.stack([shown[name] for name in "RGB"], axis=-1))
    np.testing.assert_array_equal(film.to_rgb8(), wanted)
    film.save(tmp_path / "a.png")
    with Image.open(tmp_path / "a.png") as image:
        np.testing.assert_array_equal(np.asarray(image), wanted)
    np.testing.assert_array_equal(linear.to_rgb8(tone="reinhard"), wanted)


@pytest.mark.parametrize("mode", ["left", "pair", "multi_view", "over_under_half"])
def test_both_films(tmp_path: Path, mode: str) -> None:
    films = clfractal.render_pair(stereo(mode))
    assert [film.header["view"] for film in films] == ["left", "right"]
    shape = (18, 40) if mode == "over_under_half" else (36, 40)
    assert [film["R"].shape for film in films] == [shape, shape]
    assert (films[0]["R"] != films[1]["R"]).any()
    films[1].save(tmp_path / "right.exr")
    np.testing.assert_array_equal(clfractal.load_scene(tmp_path / "right.exr").image.width, 40)


def test_what_is_no_single_film() -> None:
    for mode in ("pair", "multi_view"):
        with pytest.raises(
            clfractal.SceneError,
            match=rf"stereo\.mode: {mode} keeps the two eyes. pictures apart; use render_pair",
        ):
            clfractal.render(stereo(mode))
    with pytest.raises(clfractal.SceneError, match="stereo: a pair needs a scene with a stereo section"):
        clfractal.render_pair(SCENE)
    with pytest.raises(clfractal.SceneError, match=r"output\.channels: anaglyph needs the channels R, G, B"):
        clfractal.render(stereo("anaglyph"), channels=["R", "A"])
    with pytest.raises(clfractal.SceneError, match=r"^region: must lie inside the picture of 80 x 36"):
        clfractal.render(stereo("split"), region=(70, 0, 11, 1))


def test_a_volumes_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """By both eyes, and by the preview that a fit takes before: what is rendered is what was checked."""
    places = np.stack(np.meshgrid(*[np.linspace(-1.2, 1.2, 24)] * 3, indexing="ij"))
    ball = (np.linalg.norm(places, axis=0) < 1).astype(np.uint8) * 255
    keep(tmp_path / "ball.nrrd", ball, [-1.2] * 3, [0.1] * 3)
    reads = counted(monkeypatch, given, "read_grid")
    renderer = {"type": "volume", "file": "ball.nrrd"}
    for mode in ("split", "split_half"):
        reads.clear()
        plain = {**stereo(mode, fit="auto"), "renderer": renderer}
        scene = clfractal.load_scene(plain, folder=tmp_path)
        film = clfractal.render(scene)
        assert 0.1 < (film["A"] > 0).mean() < 1
        assert film["R"].shape == (36, 80 if mode == "split" else 40)
        fitted(scene, clfractal.Engine().preview)
        assert len(reads) == 1
