"""A scene's environment map: found, checked when the scene is loaded, kept with it; and the program's own maps."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.errors import ClfractalError, FileError, SceneError
from clfractal.files import resources
from clfractal.files.environment_map import read_environment
from clfractal.files.exr import write_exr
from clfractal.scene.environment import names
from clfractal.scene.lighting import Environment
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from tests.environment_maps import write_map
from tests.makers import maker
from tests.scene.errors import cases
from tests.shell import SCENE, InProcess, process

OUR_OWN = ("dusk", "overcast", "studio")


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A folder of scenes, with a map in it and one that is out of reach."""
    inside = tmp_path / "scenes"
    write_map(tmp_path / "secret.exr")
    write_map(inside / "sky.exr")
    write_map(inside / "maps" / "grey.exr", 0.25)
    return inside


def scene_file(folder: Path, environment: str) -> Path:
    path = folder / "scene.yaml"
    path.write_text(f"{SCENE}environment:\n  intensity: 2\n  {environment}\n")
    return path


def refusal(path: Path, overrides: Sequence[str] = ()) -> ClfractalError:
    with pytest.raises(ClfractalError) as caught:
        load_scene(path, overrides=overrides)
    assert "\n" not in str(caught.value)
    assert caught.value.status == 2
    return caught.value


def environment_map(scene: Scene) -> Any:
    """The pixels of the scene's environment, which it must have."""
    assert scene.surroundings is not None
    return scene.surroundings.pixels


@pytest.mark.parametrize(("file", "value"), [("sky.exr", 0.5), ("maps/grey.exr", 0.25), ("./sky.exr", 0.5)])
def test_a_map_beside_the_scene(folder: Path, file: str, value: float) -> None:
    scene = load_scene(scene_file(folder, f"file: {file}"))
    pixels = environment_map(scene)
    assert pixels.shape == (4, 8, 3)
    assert (pixels == value).all()
    assert scene.resolved()["environment"]["file"] == file


@pytest.mark.parametrize(
    ("environment", "message"),
    cases(
        """
file: none.exr => file: {0}/none.exr cannot be read: No such file or directory
file: scene.yaml => file: {0}/scene.yaml is not an EXR, HDR, PNG, JPEG, WebP, TIFF or BMP, or is damaged
file: maps => file: {0}/maps is a folder, not a file
file: ../secret.exr => file: must be a path inside the scene's folder, got '../secret.exr'
file: /etc/passwd => file: must be a path inside the scene's folder, got '/etc/passwd'
file: link.exr => file: leads out of the scene's folder: 'link.exr'
name: studoi => name: unknown environment 'studoi'; did you mean 'studio'?
name: xyz => name: unknown environment 'xyz'; known: dusk, overcast, studio
"""
    ),
)
def test_what_is_wrong_stands_at_its_line_and_column(folder: Path, environment: str, message: str) -> None:
    (folder / "link.exr").symlink_to("../secret.exr")
    path = scene_file(folder, environment)
    line = len(path.read_text().splitlines())
    assert str(refusal(path)) == f"{path}:{line}:9: environment.{message.format(folder)}"


@pytest.mark.parametrize(
    ("value", "size", "message"),
    [
        (
            np.nan,
            (8, 4),
            "has 32 pixels of NaN, the first in column 0, row 0 (counted from 0 at the top left)",
        ),
        (
            0.5,
            (8, 5),
            "must be twice as wide as high, as latitude-longitude maps are, got 8 x 5 pixels"
            "; stretch: true takes any shape",
        ),
    ],
)
def test_a_bad_map_is_found_by_check(
    folder: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
    value: float,
    size: tuple[int, int],
    message: str,
) -> None:
    write_map(folder / "bad.exr", value, size)
    scene_file(folder, "file: bad.exr")
    monkeypatch.chdir(folder)
    ended = InProcess(capsys)("check", "scene.yaml")
    assert ended.is_one_line(2, f"scene.yaml:7:9: environment.file: bad.exr {message}")


def test_the_library_that_reads_maps_is_silent(folder: Path) -> None:
    """It writes to the process's standard error when it meets damage."""
    path = folder / "sky.exr"
    plane = np.random.default_rng(2).integers(0, 9, (64, 128)).astype(np.float32)
    bands = [dict.fromkeys("RGB", plane)]
    write_exr(path, bands, display=(128, 64), region=(0, 0, 128, 64), channels="RGB", half="")
    content = bytearray(path.read_bytes())
    content[-2000:-1000] = bytes(1000)
    path.write_bytes(content)
    scene_file(folder, "file: sky.exr")
    for arguments in (["check", "scene.yaml"], ["render", "scene.yaml", "-o", "a.png"]):
        ended = process(arguments, folder)
        assert ended.is_one_line(2, "environment.file: sky.exr is damaged: its pixels cannot be read")


def test_overrides_find_the_map_again(folder: Path) -> None:
    path = scene_file(folder, "file: sky.exr")
    scene = load_scene(path, overrides=["environment.file=maps/grey.exr"])
    assert (environment_map(scene) == 0.25).all()
    again = load_scene(scene.resolved(), overrides=["camera.fov=20"], folder=scene.folder)
    assert (environment_map(again) == 0.25).all()
    assert str(refusal(path, overrides=["environment.file=none.exr"])).startswith("--set environment.file: ")
    with pytest.raises(FileError):
        load_scene(scene.resolved(), overrides=["environment.file=none.exr"], folder=scene.folder)


def test_copies_stay_in_the_folder(folder: Path) -> None:
    scene = load_scene(scene_file(folder, "file: sky.exr"))
    assert (environment_map(scene.model_copy()) == 0.5).all()
    other = scene.model_copy(update={"environment": Environment.model_validate({"file": "maps/grey.exr"})})
    assert (environment_map(other) == 0.25).all()
    assert (environment_map(scene) == 0.5).all()
    assert scene.model_copy(update={"environment": None}).surroundings is None


def test_where_a_scene_comes_from_is_no_part_of_it(folder: Path, tmp_path: Path) -> None:
    scene = load_scene(scene_file(folder, "file: sky.exr"))
    shutil.copytree(folder, tmp_path / "elsewhere")
    moved = load_scene(tmp_path / "elsewhere" / "scene.yaml")
    assert moved == scene
    assert load_scene(dump_scene(scene), folder=folder) == scene
    assert moved.surroundings is not None
    assert scene.surroundings is not None
    assert moved.surroundings.digest == scene.surroundings.digest


def test_plain_data_finds_its_map_in_the_current_folder(
    folder: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(folder)
    data = {"version": 1, "formula": {"name": "hast"}, "camera": {}, "environment": {"file": "sky.exr"}}
    assert (environment_map(load_scene(data)) == 0.5).all()
    assert (environment_map(Scene.model_validate(data)) == 0.5).all()
    with pytest.raises(FileError, match=r"^environment\.file: .*none\.exr cannot be read"):
        environment_map(Scene.model_validate({**data, "environment": {"file": "none.exr"}}))
    with pytest.raises(SceneError, match=r"^environment\.name: unknown environment"):
        environment_map(Scene.model_validate({**data, "environment": {"name": "nothing"}}))


def test_a_picture_finds_the_map_in_its_own_folder(folder: Path) -> None:
    scene = load_scene(scene_file(folder, "file: maps/grey.exr"))
    picture = folder / "picture.exr"
    plane = np.zeros((2, 2), np.float32)
    header = {"clfractal": dump_scene(scene)}
    bands = [dict.fromkeys("RGB", plane)]
    write_exr(picture, bands, display=(2, 2), region=(0, 0, 2, 2), channels="RGB", half="RGB", header=header)
    found = load_scene(picture)
    assert found == scene
    assert (environment_map(found) == 0.25).all()
    away = picture.rename(folder.parent / "picture.exr")
    assert "environment.file: " in str(refusal(away))


def test_a_scene_without_one() -> None:
    scene = load_scene("{version: 1, formula: {name: hast}, camera: {}}")
    assert scene.surroundings is None


# --- the program's own ---


def test_their_names() -> None:
    assert names() == OUR_OWN


@pytest.mark.parametrize("name", OUR_OWN)
def test_they_travel_light(name: str) -> None:
    assert (resources.folder("environments") / f"{name}.exr").stat().st_size <= 300_000
    scene = load_scene(
        f"{{version: 1, formula: {{name: hast}}, camera: {{}}, environment: {{name: {name}}}}}"
    )
    pixels = environment_map(scene)
    assert pixels.shape == (256, 512, 3)
    assert not pixels.flags.writeable
    # Nothing so small and bright that few rays would find it.
    latitude = np.pi * (np.arange(256) + 0.5) / 256
    light = pixels @ [0.2126, 0.7152, 0.0722]
    mean = (light.mean(axis=1) * np.sin(latitude)).sum() / np.sin(latitude).sum()
    assert 0.1 < mean < 1.5
    assert light.max() < 400 * mean
    assert pixels.min() > 0


@pytest.mark.parametrize("name", OUR_OWN)
def test_they_are_what_their_maker_makes(name: str) -> None:
    """At an eighth of the size: the same means, but for lamps' and hills' edges."""
    shipped = read_environment(resources.folder("environments") / f"{name}.exr")
    small = shipped.reshape(32, 8, 64, 8, 3).mean(axis=(1, 3))
    made = maker("make_environment").picture(name, 64, finer=4)
    difference = np.abs(np.log((small + 0.01) / (made + 0.01)))
    assert np.median(difference) < 0.01
    assert (difference < 0.25).mean() > 0.95
