"""`clfractal vary`: scene files to choose from and their pictures, all of them or none at a time."""

from __future__ import annotations

from itertools import chain, repeat
from pathlib import Path
from typing import Any

import numpy as np
import png
import pytest
from PIL import Image

import clfractal
from clfractal.cli import vary
from clfractal.files.environment_map import read_environment
from tests.shell import SCENE, InProcess, works

SMALL = ("--size", "32x18", "--count", "3")


def names(folder: str = ".") -> list[str]:
    return sorted(path.name for path in Path(folder).iterdir() if path.name != "scene.yaml")


def pixels(path: str) -> Any:
    width, height, rows, _ = png.Reader(filename=path).asRGB8()
    return np.vstack([np.array(row) for row in rows]).reshape(height, width, 3)


def test_scenes_pictures_and_a_sheet(clf: InProcess) -> None:
    ended = works(
        clf(
            "vary", "scene.yaml", *SMALL, "-o", "out", "--sheet", "sheet.png", "--set", "formula.iterations=7"
        )
    )
    assert ended.out == ""
    assert names() == ["out", "sheet.png"]
    assert names("out") == [f"scene-0{n}.{kind}" for n in (1, 2, 3) for kind in ("png", "yaml")]
    original = clfractal.load_scene(Path("scene.yaml"), overrides=["formula.iterations=7"])
    found = [clfractal.load_scene(Path(f"out/scene-0{number}.yaml")) for number in (1, 2, 3)]
    for number, scene in enumerate(found, start=1):
        # Their own size is the scene's; the pictures are small, and hold the scene that they show.
        assert scene.image == original.image
        assert scene.formula.iterations == 7
        assert scene != original
        assert clfractal.load_scene(Path(f"out/scene-0{number}.png")) == scene
        picture = pixels(f"out/scene-0{number}.png")
        assert picture.shape == (18, 32, 3)
        assert picture.std() > 3
        whole = clfractal.render(scene)
        assert (whole.width, whole.height) == (40, 36)
        assert f"out/scene-0{number}.yaml: " in ended.err
    assert len({scene.model_dump_json() for scene in found}) == 3
    assert pixels("sheet.png").shape == (18 + 16, 3 * 40 + 8, 3)
    assert "# Variation 1 of scene.yaml (medium, seed 0)" in Path("out/scene-01.yaml").read_text()
    # Short files: what nobody gave or changed is not in them.
    assert "stereo" not in Path("out/scene-01.yaml").read_text()


def test_a_sheet_with_the_scenes_beside_it(clf: InProcess) -> None:
    Path("there").mkdir()
    ended = works(clf("vary", "scene.yaml", "-n", "3", "--size", "32x18", "-o", "there/sheet.png"))
    assert names("there") == ["scene-01.yaml", "scene-02.yaml", "scene-03.yaml", "sheet.png"]
    sheet = pixels("there/sheet.png")
    assert sheet.shape == (18 + 16, 3 * 40 + 8, 3)
    works(clf("vary", "scene.yaml", "-n", "3", "--size", "32x18", "-o", "pictures"))
    for number in (1, 2, 3):
        name = f"scene-0{number}"
        assert Path(f"there/{name}.yaml").read_text() == Path(f"pictures/{name}.yaml").read_text()
        # Below its number in the sheet each picture is the one that a folder holds.
        shown = sheet[8 + 14 : 8 + 18, 8 + 40 * (number - 1) : 8 + 40 * (number - 1) + 32]
        np.testing.assert_array_equal(shown, pixels(f"pictures/{name}.png")[14:])
    ended = clf("vary", "scene.yaml", "-n", "1", "-o", "there/sheet.png")
    assert ended.is_one_line(2, "there/sheet.png: exists already and is not replaced")


def test_the_same_options_give_the_same_files(clf: InProcess) -> None:
    for folder in ("a", "b"):
        assert clf("vary", "scene.yaml", *SMALL, "-o", folder, "--quiet", "--seed", "4").err == ""
    for number in (1, 2, 3):
        name = f"scene-0{number}"
        assert Path(f"a/{name}.yaml").read_text() == Path(f"b/{name}.yaml").read_text()
        # (The picture's file also tells how long it took.)
        np.testing.assert_array_equal(pixels(f"a/{name}.png"), pixels(f"b/{name}.png"))
    clf("vary", "scene.yaml", *SMALL, "-o", "c", "--seed", "5")
    assert Path("a/scene-01.yaml").read_text() != Path("c/scene-01.yaml").read_text()


def test_small_pictures_have_the_scenes_proportions(clf: InProcess) -> None:
    works(
        clf(
            "vary", "scene.yaml", "--count", "1", "--only", "camera", "--set", "image={width: 90, height: 45}"
        )
    )
    assert pixels("scene-01.png").shape == (160, 320, 3)
    found = clfractal.load_scene(Path("scene-01.yaml"))
    assert found.lights == clfractal.load_scene(Path("scene.yaml")).lights


def test_ones_that_show_nothing_are_left_out(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    judged: list[bool] = []

    def judge(_: Any) -> bool:
        judged.append(len(judged) % 2 == 0)  # the scene itself, then every other variation
        return judged[-1]

    with monkeypatch.context() as patched:
        patched.setattr(vary, "worthwhile", judge)
        works(clf("vary", "scene.yaml", *SMALL, "-o", "some"))
    assert len(judged) == 7
    works(clf("vary", "scene.yaml", "--size", "32x18", "--count", "6", "-o", "all"))
    every = [Path(f"all/scene-0{number}.yaml").read_text().split("\n", 1)[1] for number in (2, 4, 6)]
    assert [Path(f"some/scene-0{n}.yaml").read_text().split("\n", 1)[1] for n in (1, 2, 3)] == every


def test_when_none_shows_anything(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    judged = chain([True], repeat(False))  # the scene itself shows something
    monkeypatch.setattr(vary, "worthwhile", lambda _: next(judged))
    ended = clf("vary", "scene.yaml", "--count", "1", "--quiet")
    assert ended.is_one_line(2, "scene.yaml: no variation shows anything")
    assert names() == []


def test_a_scene_that_is_empty_itself_has_variations(clf: InProcess) -> None:
    works(clf("vary", "scene.yaml", *SMALL, "--set", "camera.target=[0, -9, 0]", "--quiet"))
    assert len(names()) == 6


def test_interrupted_complete_pairs_stay(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    render = clfractal.Engine.render
    large: list[int] = []

    def interrupted(engine: clfractal.Engine, scene: Any, *arguments: Any, **settings: Any) -> Any:
        large.extend([1] if scene.image.width == 32 else [])
        if len(large) == 2:
            raise KeyboardInterrupt
        return render(engine, scene, *arguments, **settings)

    monkeypatch.setattr(clfractal.Engine, "render", interrupted)
    with pytest.raises(KeyboardInterrupt):
        clf("vary", "scene.yaml", *SMALL)
    assert names() == ["scene-01.png", "scene-01.yaml"]


REFUSED = {
    ("--count", "0"): "--count: must be from 1 to 999, got 0",
    ("--count", "1000"): "--count: must be from 1 to 999, got 1000",
    ("--strength", "havy"): "--strength: unknown strength 'havy'; did you mean 'heavy'?",
    ("--only", "camera,color"): "--only: unknown kind 'color'; did you mean 'colors'?",
    ("--size", "big"): "--size: must be WIDTHxHEIGHT",
    ("--set", "camera.fow=3"): "--set camera.fow: unknown key 'fow'; did you mean 'fov'?",
    ("-o", "none/there"): "none/there: cannot be made: No such file or directory",
    ("-o", "scene.yaml"): "scene.yaml: exists already and is not replaced",
    ("-o", "none/sheet.png"): "none/sheet.png: ",
    ("-o", "sheet.gif"): "sheet.gif: unknown extension '.gif'",
    ("--sheet", "sheet.gif"): "sheet.gif: unknown extension '.gif'",
    ("--sheet", "scene-01.png"): "scene-01.png: would be written twice",
    ("--device", "abacus"): "abacus",
}


@pytest.mark.parametrize("options", REFUSED, ids=" ".join)
def test_what_is_refused(clf: InProcess, options: tuple[str, str]) -> None:
    assert clf("vary", "scene.yaml", *options).is_one_line(2, REFUSED[options])
    assert names() == []


@pytest.mark.parametrize("there", ["scene-02.yaml", "scene-02.png", "sheet.png"])
def test_nothing_that_exists_is_replaced(clf: InProcess, there: str) -> None:
    Path(there).write_text("mine")
    ended = clf("vary", "scene.yaml", *SMALL, "--sheet", "sheet.png")
    other = "name" if there == "sheet.png" else "folder with -o"
    assert ended.is_one_line(2, f"{there}: exists already and is not replaced; choose another {other}\n")
    assert names() == [there]
    assert Path(there).read_text() == "mine"


def test_files_that_the_scene_names_stay_reachable(clf: InProcess) -> None:
    import shutil

    from clfractal.files.resources import folder

    Path("maps").mkdir()
    shutil.copy(folder("environments") / "dusk.exr", "maps/sky.exr")
    Path("maps/scene.yaml").write_text(SCENE + "environment: {file: sky.exr}\n")
    works(clf("vary", "maps/scene.yaml", *SMALL, "--quiet"))
    found = clfractal.load_scene(Path("scene-01.yaml"))
    assert found.environment is not None
    assert found.environment.file == "maps/sky.exr"
    assert read_environment("maps/sky.exr") is not None
    ended = clf("vary", "maps/scene.yaml", *SMALL, "-o", "elsewhere")
    assert ended.is_one_line(2, "maps/scene.yaml: uses 'sky.exr', which must")


@pytest.mark.parametrize("name", ["oak", "formula"])
def test_textures_stay_reachable(clf: InProcess, name: str) -> None:
    Path("maps").mkdir()
    Image.new("RGB", (4, 4), (200, 100, 50)).save("maps/oak.png")
    material = f"materials: {{{name}: {{base: {{color: {{texture: oak.png}}}}}}}}\n"
    Path("maps/scene.yaml").write_text(SCENE + material)
    works(clf("vary", "maps/scene.yaml", *SMALL, "--quiet"))
    assert list(clfractal.load_scene(Path("scene-01.yaml")).textures) == ["maps/oak.png"]
