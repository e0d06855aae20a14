"""A picture that holds a scene can be given where a scene is asked for."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

import numpy as np
import pytest

from clfractal.errors import FileError, SceneError
from clfractal.files.exr import write_exr
from clfractal.files.png import write_png
from clfractal.scene.load import dump_scene, load_scene

KEY = "clfractal"
SCENE = "{version: 1, formula: {name: mandelbulb, parameters: {power: 5}}, camera: {fov: 30.1}}"


def picture(path: Path, texts: dict[str, str]) -> Path:
    pixels = np.zeros((2, 2, 3), np.float32)
    if path.suffix == ".png":
        write_png(path, [pixels], width=2, height=2, texts=texts)
    else:
        bands = [dict.fromkeys("RGB", pixels[..., 0])]
        region = (0, 0, 2, 2)
        write_exr(path, bands, display=(2, 2), region=region, channels=list("RGB"), half=(), header=texts)
    return path


@pytest.mark.parametrize("name", ["a.png", "a.exr", "no_extension.exr"])
def test_the_scene_in_a_picture(tmp_path: Path, name: str) -> None:
    scene = load_scene(SCENE)
    path = picture(tmp_path / name, {KEY: dump_scene(scene)})
    if name == "no_extension.exr":
        path = path.rename(tmp_path / "a")
    assert load_scene(path) == scene
    assert load_scene(str(path), overrides=["camera.fov=20"]).formula == scene.formula


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_picture_of_another_program(tmp_path: Path, name: str) -> None:
    path = picture(tmp_path / name, {})
    with pytest.raises(FileError) as caught:
        load_scene(path)
    assert str(caught.value) == f"{path}: holds no scene: it was not written by clfractal"


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_wrong_scene_in_a_picture(tmp_path: Path, name: str) -> None:
    path = picture(tmp_path / name, {KEY: "version: 1\nformula: {file: /etc/passwd}\ncamera: {}\n"})
    with pytest.raises(FileError) as caught:
        load_scene(path)
    assert str(caught.value).startswith(f"{path}:2:17: formula.file: must be a path inside")
    path = picture(tmp_path / name, {KEY: "version: 7"})
    with pytest.raises(SceneError) as error:
        load_scene(path)
    assert str(error.value).startswith(f"{path}:1:10: version: must be 1, got 7")


@pytest.mark.parametrize("name", ["a.png", "a.exr"])
def test_a_truncated_picture(tmp_path: Path, name: str) -> None:
    whole = picture(tmp_path / name, {KEY: dump_scene(load_scene(SCENE))}).read_bytes()
    path = tmp_path / "cut"
    for size in {*range(64), *range(64, len(whole), 37)}:
        path.write_bytes(whole[:size])
        # A cut behind the header may still be read.
        with suppress(FileError, SceneError):
            load_scene(path)
    path.write_bytes(whole[:64])
    with pytest.raises((FileError, SceneError)) as caught:
        load_scene(path)
    assert str(caught.value).startswith(str(path))
