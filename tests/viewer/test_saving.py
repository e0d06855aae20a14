"""A saved scene is the present one, in the text that it came from; and no file is overwritten that must stay."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from clfractal.errors import FileError
from clfractal.files import resources
from clfractal.files.png import SCENE_KEY, write_png_pixels
from clfractal.files.volume_file import Volume, write_volume
from clfractal.scene.load import dump_scene, load_scene
from clfractal.viewer.saving import (
    SceneSource,
    is_protected,
    open_source,
    save_scene,
    scene_text,
    suggested_name,
)
from tests.environment_maps import write_map
from tests.exchange.files import settings
from tests.viewer.scene_files import FORMULA, SCENE, SCENES, with_camera


def opened(path: Path) -> tuple[SceneSource, Any]:
    """A scene's source, and the scene that its text stands for."""
    source = open_source(path)
    return source, source.loaded


# --- saving where it came from ---


def test_comments_formula_file_and_order_stay(desk: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    assert source.kind == "scene"
    assert source.watched == (desk / "scene.yaml", desk / "own.yaml")
    present = with_camera(loaded, fov=35.5)
    formula = present.formula.model_copy(update={"parameters": {"a": 0.5}})
    present = present.model_copy(update={"formula": formula, "lights": present.lights[1:]})
    saved = save_scene(source, present, desk / "scene.yaml")
    expected = SCENE.replace("fov: 30", "fov: 35.5").replace("12}", "12, parameters: {a: 0.5}}")
    expected = expected.replace("  # the key light\n  - {direction: [0, 0, -1], intensity: 2}\n", "")
    assert (desk / "scene.yaml").read_text() == expected == saved.text
    assert load_scene(desk / "scene.yaml") == present == saved.loaded
    assert (saved.kind, saved.path) == ("scene", desk / "scene.yaml")
    assert (desk / "own.yaml").read_text() == FORMULA
    assert sorted(path.name for path in desk.iterdir()) == ["own.yaml", "scene.yaml"]


def test_settings_of_another_program_are_opened_and_never_overwritten(tmp_path: Path) -> None:
    path = tmp_path / "bulb.fract"
    path.write_text(settings("N 9;\nnever_seen 1;"), encoding="utf-8")
    source, loaded = opened(path)
    assert source.kind == "picture"
    assert "# line 6: never_seen = 1 is not taken over" in source.text
    assert is_protected(path)
    assert suggested_name(source, tmp_path) == tmp_path / "bulb-2.yaml"
    with pytest.raises(FileError, match=r"bulb\.fract"):
        save_scene(source, with_camera(loaded, fov=35.5), path)
    saved = save_scene(source, with_camera(loaded, fov=35.5), tmp_path / "bulb-2.yaml")
    assert load_scene(tmp_path / "bulb-2.yaml") == saved.loaded
    assert "never_seen" in saved.text
    assert path.read_text(encoding="utf-8") == settings("N 9;\nnever_seen 1;")


def test_an_edited_formula_is_written_into_the_scene(desk: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    formula = loaded.formula
    new = {**formula.inline, "map": ["x*x - y*y", "3*a*x*y", "z*z"]}
    present = loaded.model_copy(update={"formula": formula.model_copy(update={"inline": new})})
    saved = save_scene(source, present, desk / "scene.yaml")
    assert "file:" not in saved.text
    assert "# my own" in saved.text
    assert load_scene(desk / "scene.yaml") == present
    assert (desk / "own.yaml").read_text() == FORMULA
    # The next edit changes the formula in its place.
    newer = {**new, "degree": 3}
    present = present.model_copy(update={"formula": formula.model_copy(update={"inline": newer})})
    again = scene_text(saved, present)
    assert [(a, b) for a, b in zip(saved.text, again, strict=True) if a != b] == [("2", "3")]


def test_a_formula_file_that_has_changed_since_does_not_change_what_is_saved(desk: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    (desk / "own.yaml").write_text(FORMULA.replace("2*a*x*y", "a*x*y"))
    save_scene(source, loaded, desk / "scene.yaml")
    assert load_scene(desk / "scene.yaml") == loaded


def test_links_of_a_chain_keep_their_files(desk: Path) -> None:
    (desk / "scene.yaml").write_text(
        "version: 1\ncamera: {}\nformula:\n  chain:\n    - {file: own.yaml}  # mine\n    - {name: mandelbulb}\n"
    )
    source, loaded = opened(desk / "scene.yaml")
    links = loaded.formula.chain
    twice = (links[1], links[0], links[0].model_copy(update={"count": 3}))
    present = loaded.model_copy(update={"formula": loaded.formula.model_copy(update={"chain": twice})})
    text = scene_text(source, present)
    assert "inline" not in text
    assert text.count("file: own.yaml") == 2
    assert load_scene(text, folder=desk) == present


@pytest.mark.parametrize("text", ['{"version": 1, "formula": {"name": "hast"}, "camera": {"fov": 30.5}}'])
def test_a_scene_in_json(tmp_path: Path, text: str) -> None:
    path = tmp_path / "scene.json"
    path.write_text(text)
    source, loaded = opened(path)
    save_scene(source, with_camera(loaded, fov=20.0), path)
    assert path.read_text() == text.replace("30.5", "20.0")
    with pytest.raises(FileError, match=r"unknown extension '.json'"):
        save_scene(source, loaded, tmp_path / "other.json")


def test_values_of_options_are_saved(desk: Path) -> None:
    source = open_source(desk / "scene.yaml")
    present = load_scene(desk / "scene.yaml", overrides=["camera.fov=12", "fog={}"])
    save_scene(source, present, desk / "scene.yaml")
    assert load_scene(desk / "scene.yaml") == present


def test_a_scene_from_nowhere(tmp_path: Path) -> None:
    scene = load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {"fov": 20}})
    saved = save_scene(SceneSource(), scene, tmp_path / "new.yaml")
    assert saved.text == "version: 1\nformula: {name: hast}\ncamera: {fov: 20}\n"
    assert load_scene(tmp_path / "new.yaml") == scene


def test_a_file_that_somebody_else_has_changed(desk: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    assert not source.changed_on_disk
    (desk / "scene.yaml").write_text(SCENE + "fog: {}\n")
    assert source.changed_on_disk
    with pytest.raises(FileError, match="has changed on the disk since it was read") as error:
        save_scene(source, loaded, desk / "scene.yaml")
    assert "\n" not in str(error.value)
    assert (desk / "scene.yaml").read_text().endswith("fog: {}\n")
    save_scene(source, loaded, desk / "scene.yaml", even_if_changed=True)
    assert (desk / "scene.yaml").read_text() == SCENE


def test_a_write_that_fails_leaves_the_old_file(desk: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    source, loaded = opened(desk / "scene.yaml")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(FileError, match="No space left on device"):
        save_scene(source, with_camera(loaded, fov=20.0), desk / "scene.yaml")
    assert (desk / "scene.yaml").read_text() == SCENE
    assert sorted(path.name for path in desk.iterdir()) == ["own.yaml", "scene.yaml"]


# --- what is never overwritten ---


def test_scenes_of_the_program_are_protected(tmp_path: Path) -> None:
    shipped = SCENES[0]
    content = shipped.read_bytes()
    source, loaded = opened(shipped)
    assert source.kind == "shipped"
    (tmp_path / "link.yaml").symlink_to(shipped)
    (tmp_path / "folder").symlink_to(shipped.parent)
    for target in (shipped, tmp_path / "link.yaml", tmp_path / "folder" / shipped.name):
        assert is_protected(target)
        with pytest.raises(FileError, match="comes with the program and is never overwritten"):
            save_scene(source, with_camera(loaded, fov=20.0), target)
    assert shipped.read_bytes() == content
    assert is_protected(resources.folder("formulas/library") / "hast.yaml")
    assert not is_protected(tmp_path / "new.yaml")
    saved = save_scene(source, with_camera(loaded, fov=20.0), suggested_name(source, tmp_path))
    assert saved.path == tmp_path / f"{shipped.stem}-2.yaml"
    assert saved.kind == "scene"
    assert suggested_name(saved, tmp_path) == tmp_path / f"{shipped.stem}-3.yaml"


def test_pictures_are_protected_and_their_scene_is_saved_elsewhere(tmp_path: Path) -> None:
    scene = load_scene(SCENES[0])
    picture = tmp_path / "picture.png"
    write_png_pixels(picture, np.zeros((2, 2, 3), np.uint8), {SCENE_KEY: dump_scene(scene)})
    (tmp_path / "picture.yaml").symlink_to(picture)
    source, loaded = opened(picture)
    assert source.kind == "picture"
    for target in (picture, tmp_path / "picture.yaml"):
        assert is_protected(target)
        with pytest.raises(FileError):
            save_scene(source, loaded, target)
    saved = save_scene(source, with_camera(loaded, fov=20.0), tmp_path / "new.yaml")
    assert saved.loaded == load_scene(tmp_path / "new.yaml") == with_camera(scene, fov=20.0)


def test_files_that_the_scene_names_are_protected(desk: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    with pytest.raises(FileError, match="is a file that the scene names"):
        save_scene(source, loaded, desk / "own.yaml")
    assert (desk / "own.yaml").read_text() == FORMULA


# --- saving in another folder ---


@pytest.fixture
def other(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("other")


def files(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_a_formula_file_goes_along(desk: Path, other: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    saved = save_scene(source, loaded, other / "copy.yaml")
    assert saved.text == SCENE
    assert files(other) == ["copy.yaml", "own.yaml"]
    assert (other / "own.yaml").read_text() == FORMULA
    assert saved.loaded is not None
    assert saved.loaded.folder == other
    assert load_scene(other / "copy.yaml") == loaded
    # The same file is there by now, so it is used.
    save_scene(source, loaded, other / "second.yaml")
    assert files(other) == ["copy.yaml", "own.yaml", "second.yaml"]


def test_another_file_of_that_name_is_left_alone(desk: Path, other: Path) -> None:
    (other / "own.yaml").write_text("theirs")
    source, loaded = opened(desk / "scene.yaml")
    saved = save_scene(source, loaded, other / "copy.yaml")
    assert "file: own-2.yaml," in saved.text
    assert (other / "own.yaml").read_text() == "theirs"
    assert load_scene(other / "copy.yaml") == loaded
    # Nor is the copy put where the scene goes.
    renamed = save_scene(source, loaded, desk.parent / other.name / "own-3.yaml")
    assert load_scene(other / "own-3.yaml") == loaded
    assert renamed.text == saved.text


def test_the_scene_and_its_formula_never_get_one_name(desk: Path, other: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    save_scene(source, loaded, other / "own.yaml")
    assert files(other) == ["own-2.yaml", "own.yaml"]
    assert load_scene(other / "own.yaml") == loaded


def test_formula_files_that_name_others(desk: Path, other: Path) -> None:
    (desk / "both.yaml").write_text("chain: [{file: own.yaml}, {name: mandelbulb}]\n")
    (desk / "scene.yaml").write_text(SCENE.replace("own.yaml", "both.yaml"))
    source, loaded = opened(desk / "scene.yaml")
    assert source.watched == (desk / "scene.yaml", desk / "both.yaml", desk / "own.yaml")
    save_scene(source, loaded, other / "copy.yaml")
    assert files(other) == ["both.yaml", "copy.yaml", "own.yaml"]
    assert load_scene(other / "copy.yaml") == loaded
    (other / "own.yaml").write_text("theirs")
    (other / "both.yaml").unlink()
    saved = save_scene(source, loaded, other / "second.yaml")
    assert "file:" not in saved.text
    assert files(other) == ["copy.yaml", "own.yaml", "second.yaml"]
    assert load_scene(other / "second.yaml") == loaded


def test_from_a_folder_above_files_are_reached_below(desk: Path) -> None:
    source, loaded = opened(desk / "scene.yaml")
    target = desk.parent / f"above-{desk.name}.yaml"
    saved = save_scene(source, loaded, target)
    assert f"file: {desk.name}/own.yaml" in saved.text
    assert load_scene(target) == loaded
    target.unlink()


def test_maps_go_along_also_those_of_views(tmp_path: Path, other: Path) -> None:
    write_map(tmp_path / "maps" / "sky.exr")
    write_map(tmp_path / "grey.exr", 0.25)
    write_map(other / "grey.exr", 0.75)
    text = (
        "version: 1\nformula: {name: hast}\ncamera: {}\nenvironment: {file: maps/sky.exr}  # sky\n"
        "layout:\n  views:\n    - {}\n    - environment: {file: grey.exr}  # grey\n"
    )
    (tmp_path / "scene.yaml").write_text(text)
    source, loaded = opened(tmp_path / "scene.yaml")
    saved = save_scene(source, loaded, other / "copy.yaml")
    assert saved.text == text.replace("grey.exr", "grey-2.exr")
    assert files(other) == ["copy.yaml", "grey-2.exr", "grey.exr", "maps/sky.exr"]
    again = load_scene(other / "copy.yaml")
    assert again == saved.loaded
    assert again.surroundings.digest == loaded.surroundings.digest  # type: ignore[union-attr]
    for old, new in zip(loaded.views, again.views, strict=True):
        assert old[0].surroundings.digest == new[0].surroundings.digest  # type: ignore[union-attr]


def test_textures_go_along(tmp_path: Path, other: Path) -> None:
    (tmp_path / "wood").mkdir()
    Image.new("RGB", (4, 4), (200, 100, 50)).save(tmp_path / "wood" / "oak.png")
    Image.new("L", (4, 4), 77).save(tmp_path / "grey.png")
    (other / "grey.png").write_bytes(b"theirs")
    text = (
        "version: 1\nformula: {name: hast}\ncamera: {}\nmaterials:\n  oak:  # old\n    base:\n"
        "      color: {texture: wood/oak.png, scale: 0.5}\n      weight: {texture: grey.png}  # grey\n"
    )
    (tmp_path / "scene.yaml").write_text(text)
    source, loaded = opened(tmp_path / "scene.yaml")
    saved = save_scene(source, loaded, other / "copy.yaml")
    assert saved.text == text.replace("grey.png", "grey-2.png")
    assert files(other) == ["copy.yaml", "grey-2.png", "grey.png", "wood/oak.png"]
    again = load_scene(other / "copy.yaml")
    assert again == saved.loaded
    assert sorted(again.textures) == ["grey-2.png", "wood/oak.png"]
    old = [each.digest for each in loaded.textures.values()]
    assert [each.digest for each in again.textures.values()] == old


@pytest.mark.parametrize("kind", ["nrrd", "nhdr", "npy"])
def test_grids_go_along_with_what_belongs_to_them(tmp_path: Path, other: Path, kind: str) -> None:
    values = np.linspace(0, 1, 24, dtype=np.float32).reshape(2, 3, 4)
    volume = Volume(values, directions=np.diag([1.0, 2.0, 3.0]))
    path = tmp_path / f"grid.{kind}"
    if kind == "nhdr":
        path.write_text(
            "NRRD0004\ntype: float\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: raw\ndata file: grid.raw\n"
        )
        (tmp_path / "grid.raw").write_bytes(values.astype("<f4").tobytes())
    else:
        write_volume(path, volume)
    (tmp_path / "scene.yaml").write_text(
        f"version: 1\nformula: {{name: hast}}\ncamera: {{}}\nrenderer: {{type: volume, file: grid.{kind}}}\n"
    )
    source, loaded = opened(tmp_path / "scene.yaml")
    expected = {
        "nrrd": ["grid.nrrd"],
        "nhdr": ["grid.nhdr", "grid.raw"],
        "npy": ["grid.npy", "grid.npy.json"],
    }
    for number in (1, 2):
        saved = save_scene(source, loaded, other / "copy.yaml")
        again = load_scene(other / "copy.yaml")
        assert again == saved.loaded
        assert (again.given.digest, again.given.place) == (loaded.given.digest, loaded.given.place)  # type: ignore[union-attr]
        if number == 1:
            assert files(other) == sorted(["copy.yaml", *expected[kind]])
            # Now another grid has the name.
            (other / expected[kind][-1]).write_bytes(b"theirs")
    assert (other / expected[kind][-1]).read_bytes() == b"theirs"


def test_a_missing_map_is_told_and_nothing_is_left(tmp_path: Path, other: Path) -> None:
    write_map(tmp_path / "sky.exr")
    (tmp_path / "own.yaml").write_text(FORMULA)
    (tmp_path / "scene.yaml").write_text(SCENE + "environment: {file: sky.exr}\n")
    source, loaded = opened(tmp_path / "scene.yaml")
    (tmp_path / "sky.exr").unlink()
    with pytest.raises(FileError, match=r"sky\.exr: is missing, so it cannot go along"):
        save_scene(source, loaded, other / "copy.yaml")
    assert files(other) == []


def test_suggested_names(tmp_path: Path) -> None:
    assert suggested_name(SceneSource(), tmp_path) == tmp_path / "scene.yaml"
    (tmp_path / "scene.yaml").symlink_to("nowhere")
    assert suggested_name(SceneSource(), tmp_path) == tmp_path / "scene-2.yaml"
    assert suggested_name(SceneSource("picture", Path("x/a-b.exr")), tmp_path) == tmp_path / "a-b-2.yaml"
    assert suggested_name(SceneSource("scene", Path("x/a-9.yaml")), tmp_path) == tmp_path / "a-10.yaml"


def test_a_window_that_keeps_the_scene_of_the_old_folder(desk: Path, other: Path) -> None:
    write_map(desk / "sky.exr")
    (desk / "scene.yaml").write_text(SCENE + "environment: {file: sky.exr}\n")
    source, loaded = opened(desk / "scene.yaml")
    saved = save_scene(source, loaded, other / "copy.yaml")
    again = save_scene(saved, with_camera(loaded, fov=20.0), other / "copy.yaml")
    assert again.text == saved.text.replace("fov: 30", "fov: 20")
    assert files(other) == ["copy.yaml", "own.yaml", "sky.exr"]
    assert load_scene(other / "copy.yaml") == with_camera(loaded, fov=20.0)
