"""Stereo scenes from the shell: every mode, its files, what is told of them, and what is wrong with one."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any, get_args

import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image

from clfractal.errors import STATUS_BAD_INPUT
from clfractal.files.exr import read_exr
from clfractal.files.png import read_texts
from clfractal.images.compose import compose
from clfractal.images.modes import picture_size
from clfractal.scene.load import load_scene
from clfractal.scene.stereo import APART, Mode, Stereo
from tests.scene.errors import cases
from tests.shell import SCENE as PLAIN
from tests.shell import InProcess, works

MONO = PLAIN + "output:\n  precision: {R: float, G: float, B: float}\n"
SCENE = MONO + "stereo: {separation: 0.3}\n"
SIZE = (40, 36)
COMPOSED = [mode for mode in get_args(Mode) if mode not in APART]
Planes = dict[str, npt.NDArray[Any]]


@pytest.fixture(scope="module")
def eyes(tmp_path_factory: pytest.TempPathFactory) -> tuple[Planes, Planes]:
    """Both eyes' channels, as `mode: pair` writes them."""
    from clfractal.cli import run
    from clfractal.cli.shell import Shell

    folder = tmp_path_factory.mktemp("eyes")
    (folder / "scene.yaml").write_text(SCENE)
    arguments = ["render", folder / "scene.yaml", "-o", folder / "a.exr", "--set", "stereo.mode=pair"]
    assert run([str(each) for each in arguments], Shell(owns_process=False)) == 0
    assert {path.name for path in folder.iterdir()} == {"scene.yaml", "a_L.exr", "a_R.exr"}
    left, right = (read_exr(folder / f"a_{letter}.exr")[0] for letter in "LR")
    return left, right


def rendered(clf: InProcess, source: str, output: str, *options: str) -> None:
    ended = clf("render", source, "-o", output, "--quiet", *options)
    assert (ended.status, ended.err) == (0, "")


def pixels(path: Path) -> dict[str, bytes]:
    """The bytes of every channel of an EXR, or of a PNG."""
    if path.suffix == ".exr":
        return {name: np.ascontiguousarray(plane).tobytes() for name, plane in read_exr(path)[0].items()}
    with Image.open(path) as picture:
        return {picture.mode: picture.tobytes()}


def added(here: Path) -> set[str]:
    return {path.name for path in here.iterdir()} - {"scene.yaml"}


@pytest.mark.parametrize("mode", COMPOSED)
def test_every_mode_as_png_and_exr(
    here: Path, clf: InProcess, eyes: tuple[Planes, Planes], mode: str
) -> None:
    """`image` is one eye's size, but of the squeezed modes; what is shown are the pixels of both eyes' pictures."""
    ended = works(clf("render", "scene.yaml", "-o", "a.png", "-o", "a.exr", "--set", f"stereo.mode={mode}"))
    assert ended.err.splitlines()[-1].startswith("a.png, a.exr: ")
    assert added(here) == {"a.png", "a.exr"}
    width, height = SIZE
    expected = {"split": (2 * width, height), "over_under": (width, 2 * height)}.get(mode, SIZE)
    with Image.open(here / "a.png") as picture:
        assert picture.size == expected
    planes, header = read_exr(here / "a.exr")
    assert header["displayWindow"] == header["dataWindow"] == (0, 0, expected[0] - 1, expected[1] - 1)
    assert planes["R"].shape == expected[::-1]
    assert ("worldToCamera" in header) == (mode in ("left", "right"))
    assert header.get("view") == (mode if mode in ("left", "right") else None)
    if mode.endswith("_half"):
        return  # of other pixels than the eyes' own, see below
    stereo = Stereo.model_validate({"mode": mode})
    assert expected == picture_size(stereo, SIZE)
    composed = compose(stereo, *eyes)
    for name in composed:
        np.testing.assert_array_equal(planes[name], composed[name].astype(planes[name].dtype))


@pytest.mark.parametrize(
    ("mode", "whole", "size"), [("split_half", "split", "20x36"), ("over_under_half", "over_under", "40x18")]
)
def test_squeezed_pictures_show_all_of_the_screen(
    here: Path, clf: InProcess, mode: str, whole: str, size: str
) -> None:
    """They are those of half as many pixels, with the whole picture's plane for their screen."""
    rendered(clf, "scene.yaml", "a.exr", "--set", f"stereo.mode={mode}")
    high = 2 * 3 * float(np.tan(np.radians(22.5)))  # the camera's default is 45 degrees
    plane = f"{{width: {high * SIZE[0] / SIZE[1]!r}, height: {high!r}}}"
    options = ["--set", f"stereo.mode={whole}", "--set", f"stereo.plane={plane}"]
    for side, pixels_there in zip(("width", "height"), size.split("x"), strict=True):
        options += ["--set", f"image.{side}={pixels_there}"]
    rendered(clf, "scene.yaml", "b.exr", *options)
    assert pixels(here / "a.exr") == pixels(here / "b.exr")


def test_the_right_eye_first(here: Path, clf: InProcess, eyes: tuple[Planes, Planes]) -> None:
    """As two projectors need it that cross, or rows whose first is the right eye's."""
    for mode in ("split", "rows"):
        rendered(clf, "scene.yaml", "a.exr", "--set", f"stereo.mode={mode}", "--set", "stereo.swap=true")
        planes = read_exr(here / "a.exr")[0]
        expected = compose(Stereo.model_validate({"mode": mode}), eyes[1], eyes[0])
        np.testing.assert_array_equal(planes["R"], expected["R"])


def test_a_pair_as_two_files(here: Path, clf: InProcess, eyes: tuple[Planes, Planes]) -> None:
    ended = works(clf("render", "scene.yaml", "-o", "a.png", "-o", "b.exr", "--set", "stereo.mode=pair"))
    assert ended.err.startswith("a_L.png, a_R.png, b_L.exr, b_R.exr: ")
    assert added(here) == {"a_L.png", "a_R.png", "b_L.exr", "b_R.exr"}
    for letter, view, expected in zip("LR", ("left", "right"), eyes, strict=True):
        planes, header = read_exr(here / f"b_{letter}.exr")
        assert header["view"] == view
        assert sorted(planes) == sorted(expected)
        for name in planes:
            np.testing.assert_array_equal(planes[name], expected[name])
    cameras = [read_exr(here / f"b_{letter}.exr")[1]["worldToCamera"] for letter in "LR"]
    # The left eye is to the left: what is at x in its coordinates is farther left in the right one's.
    assert cameras[0][3][0] > cameras[1][3][0]
    np.testing.assert_allclose(np.delete(cameras[0][3] - cameras[1][3], 0), 0, atol=1e-6)


def test_both_views_in_one_file(here: Path, clf: InProcess, eyes: tuple[Planes, Planes]) -> None:
    """A PNG has room for one: of those there are two."""
    ended = works(
        clf("render", "scene.yaml", "-o", "a.exr", "-o", "a.png", "--set", "stereo.mode=multi_view")
    )
    assert ended.err.startswith("a.exr, a_L.png, a_R.png: ")
    assert added(here) == {"a.exr", "a_L.png", "a_R.png"}
    planes, header = read_exr(here / "a.exr")
    assert header["multiView"] == ("left", "right")
    for name in "RGBAZ":
        np.testing.assert_array_equal(planes[name], eyes[0][name])
        np.testing.assert_array_equal(planes[f"right.{name}"], eyes[1][name])
    assert not np.array_equal(header["left.worldToNDC"], header["right.worldToNDC"])
    np.testing.assert_array_equal(header["worldToCamera"], header["left.worldToCamera"])


@pytest.mark.parametrize(
    ("mode", "output", "written", "again", "fit"),
    [
        ("split", "a.exr", ["a.exr"], ["b.exr"], "auto"),
        ("over_under_half", "a.png", ["a.png"], ["b.png"], "null"),
        ("anaglyph", "a.png", ["a.png"], ["b.png"], "auto"),
        ("right", "a.exr", ["a.exr"], ["b.exr"], "null"),
        ("multi_view", "a.exr", ["a.exr"], ["b.exr"], "null"),
        ("pair", "a.exr", ["a_L.exr", "a_R.exr"], ["b_L.exr", "b_R.exr"], "auto"),
        ("pair", "a.png", ["a_L.png", "a_R.png"], ["b_L.png", "b_R.png"], "null"),
    ],
)
def test_a_picture_renders_itself_again(
    here: Path, clf: InProcess, mode: str, output: str, written: list[str], again: list[str], fit: str
) -> None:
    """Bit for bit, from the header of any of its files; what was fitted is written there, and not fitted again."""
    rendered(
        clf,
        "scene.yaml",
        output,
        *("--set", f"stereo.mode={mode}", "--set", f"stereo.fit={fit}", "--set", "stereo.budget=0.4"),
    )
    before = {name: pixels(here / name) for name in written}
    told = load_scene(here / written[-1]).stereo
    assert told is not None
    assert told.fit is None
    assert (told.plane is not None) == (fit == "auto")
    (here / "scene.yaml").unlink()
    rendered(clf, written[-1], f"b{Path(output).suffix}")
    assert [pixels(here / name) for name in again] == list(before.values())


@pytest.mark.parametrize("mode", ["split", "over_under", "rows", "anaglyph", "multi_view"])
def test_a_region_is_the_part_of_the_whole(here: Path, clf: InProcess, mode: str) -> None:
    """One across the seam with odd corners, and one in a single eye's half."""
    chosen = ("--set", f"stereo.mode={mode}")
    both = ("-o", "whole.png") if mode in ("split", "anaglyph") else ()
    rendered(clf, "scene.yaml", "whole.exr", *both, *chosen)
    whole, header = read_exr(here / "whole.exr")
    width, height = header["displayWindow"][2] + 1, header["displayWindow"][3] + 1
    x, y = width // 2 - 7, height // 2 - 5
    for region in ((x, y, 15, 13), (1, 3, 11, 9)):
        both = ("-o", "part.png") if (here / "whole.png").exists() else ()
        rendered(clf, "scene.yaml", "part.exr", *both, "--region", ",".join(map(str, region)), *chosen)
        part, header = read_exr(here / "part.exr")
        left, top, wide, high = region
        assert header["dataWindow"] == (left, top, left + wide - 1, top + high - 1)
        assert header["displayWindow"] == (0, 0, width - 1, height - 1)
        for name in whole:
            np.testing.assert_array_equal(part[name], whole[name][top : top + high, left : left + wide])
        if both:
            with Image.open(here / "whole.png") as picture, Image.open(here / "part.png") as cut:
                expected = np.asarray(picture)[top : top + high, left : left + wide]
                np.testing.assert_array_equal(np.asarray(cut), expected)


def test_size_samples_and_statistics(here: Path, clf: InProcess) -> None:
    options = ("--size", "24x20", "--samples", "3", "--stats", "stats.json")
    rendered(clf, "scene.yaml", "a.png", *options)
    with Image.open(here / "a.png") as picture:
        assert picture.size == (48, 20)
    told = json.loads((here / "stats.json").read_text())
    assert (told["width"], told["height"], told["samples"]) == (48, 20, 3)
    assert told["rays"] == 2 * 24 * 20 * 3
    assert told["tiles"] == 2
    stereo = told["stereo"]
    assert (stereo["mode"], stereo["separation"]) == ("split", 0.3)
    plane_width = 2 * 3 * np.tan(np.radians(22.5)) * 24 / 20  # fov is 45 by default
    assert stereo["plane"]["width"] == pytest.approx(plane_width)
    np.testing.assert_allclose(stereo["plane"]["center"], 0, atol=1e-12)
    np.testing.assert_allclose(stereo["eye"], [0, -0.6 / 0.52 * plane_width, 0], atol=1e-12)
    comfort = stereo["parallax"]
    # The set reaches from about -1.2 to 1.2, and nothing is as far before the plane as its bounds.
    eye = 0.6 / 0.52 * plane_width
    least = 0.063 * 0.3 * (1 - eye / (eye - 1.3))
    assert least < comfort["nearest"] < 0.4 * least < 0
    assert comfort["nearest"] <= comfort["farthest"] < 0.063 * 0.3
    for end in ("nearest", "farthest"):
        angles = [2 * np.arctan((0.063 - p) / 2 / 0.6) for p in (0, comfort[end])]
        assert comfort[f"{end}_degrees"] == pytest.approx(np.degrees(angles[0] - angles[1]))


def test_statistics_without_depth_take_a_quick_look(here: Path, clf: InProcess) -> None:
    """The numbers are nearly those of the picture's own depth."""
    found = []
    for channels in ("[R, G, B]", "[R, G, B, Z]"):
        rendered(clf, "scene.yaml", "a.exr", "--stats", "s.json", "--set", f"output.channels={channels}")
        found.append(json.loads((here / "s.json").read_text())["stereo"]["parallax"])
    assert found[0]["nearest"] == pytest.approx(found[1]["nearest"], rel=0.02)
    assert found[0]["nearest"] != 0


def test_a_warning_past_one_degree(here: Path, clf: InProcess) -> None:
    ended = works(clf("render", "scene.yaml", "-o", "a.png", "--set", "stereo.separation=1"))
    assert told_parallax(ended.err.splitlines()[-1]) == pytest.approx(3, abs=0.1)
    assert "eyes tire beyond 1" in ended.err
    assert "tire" not in clf("render", "scene.yaml", "-o", "a.png").err
    assert clf("render", "scene.yaml", "-o", "a.png", "--set", "stereo.separation=1", "--quiet").err == ""
    told = clf("render", "scene.yaml", "-o", "a.png", "--verbose").err
    assert "in the screen's unit" in told
    checked = clf("check", "scene.yaml", "--parallax", "--set", "stereo.separation=1")
    assert told_parallax(checked.err) == pytest.approx(3, abs=0.1)


def told_parallax(message: str) -> float:
    """Degrees that a warning tells."""
    told = re.match(r"scene\.yaml: parallax reaches ([\d.]+) degrees, but", message)
    assert told is not None
    return float(told[1])


class TestCheck:
    def test_where_the_camera_moves(self, here: Path, clf: InProcess) -> None:
        """A screen as wide as the plane: one unit is 1, and the eye is a screen's distance before the target."""
        options = (
            *("--set", "camera={position: [0, -3, 0], fov: 90}", "--set", "image={width: 40, height: 40}"),
            *("--set", "stereo={screen_width: 6, screen_distance: 4, interpupillary_distance: 0.5}"),
        )
        ended = clf("check", "scene.yaml", *options)
        assert (ended.status, ended.err) == (0, "")
        told = [line for line in ended.out.splitlines() if line.startswith("#")]
        assert told == [
            "# stereo: the camera is at [0, -4, 0], moved from [0, -3, 0]; the left eye at [-0.25, -4, 0], "
            "the right at [0.25, -4, 0]",
            "# stereo: this plane lies on the screen: center [0, 0, 0], 6 x 6 scene units; "
            "one unit of the screen is 1 scene units",
        ]
        # What is printed is a scene file still.
        (here / "printed.yaml").write_text(ended.out)
        assert load_scene(here / "printed.yaml") == load_scene(
            here / "scene.yaml", overrides=[each for each in options if each != "--set"]
        )

    def test_a_plane_of_its_own_moves_no_camera(self, here: Path, clf: InProcess) -> None:
        ended = clf("check", "scene.yaml", "--set", "stereo.plane={center: [0, 1, 0], width: 0.52}")
        assert "the camera is at [0, 0.4, 0]; the left eye" in ended.out

    def test_parallax_of_a_fit(self, here: Path, clf: InProcess) -> None:
        """The scene that is printed is the one that would be rendered."""
        plain = clf("check", "scene.yaml", "--set", "stereo.fit=auto")
        assert "#" not in plain.out  # nothing is known before the depth is looked at
        ended = clf("check", "scene.yaml", "--parallax", "--set", "stereo.fit=auto")
        scene = load_scene(ended.out)
        assert scene.stereo is not None
        assert scene.stereo.fit is None
        assert scene.stereo.plane is not None
        (here / "fitted.yaml").write_text(ended.out)
        rendered(clf, "fitted.yaml", "a.exr")
        rendered(clf, "scene.yaml", "b.exr", "--set", "stereo.fit=auto")
        assert pixels(here / "a.exr") == pixels(here / "b.exr")

    def test_parallax_of_one_picture(self, here: Path, clf: InProcess) -> None:
        (here / "scene.yaml").write_text(MONO)
        ended = clf("check", "scene.yaml", "--parallax")
        assert ended.is_one_line(STATUS_BAD_INPUT, "--parallax: needs a scene with a stereo section")

    def test_nothing_to_see(self, here: Path, clf: InProcess) -> None:
        away = ("--set", "camera={position: [0, -3, 0], target: [0, -6, 0]}")
        assert "# parallax: the picture is empty\n" in clf("check", "scene.yaml", "--parallax", *away).out
        for command in ("check", "render"):
            options = ("--parallax",) if command == "check" else ("-o", "a.png")
            ended = clf(command, "scene.yaml", *options, *away, "--set", "stereo.fit=auto")
            assert ended.is_one_line(
                STATUS_BAD_INPUT, "scene.yaml: stereo.fit: auto finds nothing to fit to: the picture is empty"
            )
        assert added(here) == set()

    def test_an_eye_inside_the_object_sees_nothing(self, here: Path, clf: InProcess) -> None:
        within = ("--set", "camera={position: [0, -0.2, 0], target: [0, 0, 0]}")
        ended = works(clf("check", "scene.yaml", "--parallax", *within))
        assert "# parallax: the picture is empty\n" in ended.out
        rendered(clf, "scene.yaml", "a.png", "--stats", "s.json", *within)
        assert json.loads((here / "s.json").read_text())["stereo"]["parallax"] is None


class TestFlat:
    """A cut plane has no depth; it lies on the screen."""

    def test_alone(self, here: Path, clf: InProcess) -> None:
        plane = ("--set", "renderer={type: cut_plane}")
        told = clf("check", "scene.yaml", "--parallax", *plane).out
        assert "# stereo: a cut plane by itself is flat; both eyes see it on the screen\n" in told
        assert "# parallax +0 to +0 in the screen's unit" in told
        rendered(clf, "scene.yaml", "a.exr", "--stats", "s.json", *plane)
        planes = read_exr(here / "a.exr")[0]
        np.testing.assert_array_equal(planes["R"][:, :40], planes["R"][:, 40:])
        stereo = json.loads((here / "s.json").read_text())["stereo"]
        assert stereo["eye"] is None
        assert stereo["parallax"]["nearest"] == stereo["parallax"]["farthest"] == 0
        (here / "scene.yaml").write_text(MONO)
        rendered(clf, "scene.yaml", "mono.exr", *plane)
        np.testing.assert_array_equal(planes["R"][:, :40], read_exr(here / "mono.exr")[0]["R"])

    def test_an_orthographic_camera_is_not_used(self, here: Path, clf: InProcess) -> None:
        rendered(
            clf,
            "scene.yaml",
            "a.png",
            *("--set", "renderer={type: cut_plane}", "--set", "camera={projection: orthographic}"),
        )

    def test_beside_a_surface(self, here: Path, clf: InProcess) -> None:
        layout = ("--set", "layout={views: [{}, {renderer: {type: cut_plane}}]}")
        told = clf("check", "scene.yaml", "--parallax", *layout).out
        assert "# layout.views.0: stereo: the camera is at [0, -" in told
        assert "# layout.views.1: stereo: a cut plane by itself is flat" in told
        assert "# parallax -0." in told
        rendered(clf, "scene.yaml", "a.exr", "--stats", "s.json", *layout)
        red = read_exr(here / "a.exr")[0]["R"]
        assert red.shape == (36, 80)
        np.testing.assert_array_equal(red[:, 20:40], red[:, 60:])  # the plane, for both eyes
        assert (red[:, :20] != red[:, 40:60]).any()
        assert json.loads((here / "s.json").read_text())["stereo"]["parallax"]["nearest"] < 0


def test_texts_of_a_png(here: Path, clf: InProcess) -> None:
    """What a mono picture's are, and of one eye's its view."""
    rendered(clf, "scene.yaml", "a.png")
    rendered(clf, "scene.yaml", "b.png", "--set", "stereo.mode=pair")
    (here / "scene.yaml").write_text(MONO)
    rendered(clf, "scene.yaml", "mono.png")
    mono = set(read_texts(here / "mono.png"))
    assert set(read_texts(here / "a.png")) == mono
    for letter, view in zip("LR", ("left", "right"), strict=True):
        texts = read_texts(here / f"b_{letter}.png")
        assert set(texts) == {*mono, "view"}
        assert texts["view"] == view


# --- what is wrong ---


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        *cases(
            """
stereo:
  screen_width: 0 => 6:17: stereo.screen_width: must be above 0, got 0
stereo:
  screen_distance: -0.6 => 6:20: stereo.screen_distance: must be above 0, got -0.6
stereo:
  interpupillary_distance: 0.0 => 6:28: stereo.interpupillary_distance: must be above 0, got 0
stereo: {screen_width: .nan} => 5:24: stereo.screen_width: must be a finite number, got .nan
stereo: {screen_width: wide} => 5:24: stereo.screen_width: must be a number, got 'wide'
stereo: {screen_width: 1.0e-9}
=> 5:9: stereo.screen_distance: must be within a factor of 10,000 of screen_width (1e-09), in the same unit, got 0.6
stereo: {interpupillary_distance: 6300}
=> 5:35: stereo.interpupillary_distance: must be within a factor of 10,000 of screen_width (0.52), in the same unit, got
    6300
stereo: {mod: split} => 5:10: stereo: unknown key 'mod'; did you mean 'mode'?
stereo: {separation: -1} => 5:22: stereo.separation: must be at least 0, got -1
stereo: {budget: 0} => 5:18: stereo.budget: must be above 0, got 0
stereo: {fit: yes} => 5:15: stereo.fit: must be auto, got 'yes'
stereo: {mode: split_half}
image: {width: 41, height: 36}
=> 6:16: image.width: must be even for stereo.mode split_half, where each eye gets half of it, got 41
stereo: {mode: over_under_half}
image: {width: 40, height: 35}
=> 6:28: image.height: must be even for stereo.mode over_under_half, where each eye gets half of it, got 35
stereo: {colors: [[1, 0, 1.5], [0, 1, 0]]} => 5:26: stereo.colors.0.2: must be at most 1, got 1.5
stereo: {colors: [[1, 0, 0], [0, -1, 0]]} => 5:34: stereo.colors.1.1: must be at least 0, got -1
stereo: {colors: [[1, 0, 0]]} => 5:18: stereo.colors: must be a list of 2 lists, got a list of 1
stereo: {mode: anaglyph}
output: {channels: [R, Z]} => 6:20: output.channels: anaglyph needs the channels R, G, B; G, B not among them
stereo: {plane: {normal: [0, 0, 0]}} => 5:26: stereo.plane.normal: must not be zero
stereo: {plane: {up: [0, 0, 0]}} => 5:22: stereo.plane.up: must not be zero
stereo: {plane: {normal: [0, -1, 1], up: [0, 2, -2]}} => 5:42: stereo.plane.up: must not be parallel to the normal
stereo: {plane: {width: 0}} => 5:25: stereo.plane.width: must be at least 1e-18, got 0
stereo: {fit: auto}
layout: {views: [{}, {}]} => 5:15: stereo.fit: auto cannot fit several views at once; give plane and separation instead
stereo: {fit: auto}
renderer: {type: cut_plane} => 5:15: stereo.fit: auto needs depth, but the picture of a cut_plane renderer is flat
stereo: {fit: auto, convergence: toe_in}
=> 5:15: stereo.fit: auto needs convergence off_axis, where parallax follows from depth alone, got toe_in
stereo: 3 => 5:9: stereo: must be a mapping, got 3
"""
        ),
        ("stereo: {mode: anaglif}", "5:16: stereo.mode: must be left, right, "),
        (
            "stereo: {}\nlayout: {views: [{}, {camera: {projection: orthographic}}]}",
            "6:44: layout.views.1.camera.projection: must be perspective with stereo: ",
        ),
    ],
)
def test_bad_input(here: Path, clf: InProcess, lines: str, message: str) -> None:
    scene = PLAIN
    if "image:" in lines:
        scene = scene.replace("image: {width: 40, height: 36}\n", "") + "# as many lines\n"
    (here / "scene.yaml").write_text(scene + lines + "\n")
    for command in (("check",), ("render", "-o", "a.png", "-o", "a.exr", "--stats", "s.json")):
        ended = clf(command[0], "scene.yaml", *command[1:])
        assert ended.is_one_line(STATUS_BAD_INPUT, f"scene.yaml:{message}")
        assert added(here) == set()


def test_an_orthographic_camera(here: Path, clf: InProcess) -> None:
    camera = "camera: {projection: orthographic, position: [0, -3, 0]}"
    (here / "scene.yaml").write_text(PLAIN.replace("camera: {position: [0, -3, 0]}", camera) + "stereo: {}\n")
    ended = clf("render", "scene.yaml", "-o", "a.png")
    assert ended.is_one_line(
        STATUS_BAD_INPUT,
        "scene.yaml:4:22: camera.projection: must be perspective with stereo: parallel rays look the same to both"
        " eyes; use {projection: perspective, position, target, fov}, or remove stereo",
    )


CHANNELS = ("--set", "output.channels=[R, Z]")


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (("--set", "stereo.mode=anaglif"), ("--set stereo.mode: must be ", "did you mean 'anaglyph'?")),
        (("--set", "stereo.mode=spilt"), ("--set stereo.mode: must be ", "did you mean 'split'?")),
        (("--set", "stereo.mode=Over-Under"), ("--set stereo.mode: must be ", "did you mean 'over_under'?")),
        (
            ("--set", "stereo.mode=split_half", "--size", "41x36"),
            ("--size: must be even for stereo.mode split_half",),
        ),
        # A region is one of the finished picture, twice as wide as an eye's.
        (("--region", "41,0,40,1"), ("--region: must lie inside the picture of 80 x 36 pixels",)),
        # Outputs are checked before anything is rendered.
        (("--set", "stereo.mode=pair"), ("a_R.png: cannot be written: it is a folder",)),
        (
            (*CHANNELS, "--set", "stereo.mode=multi_view", "-o", "b.png"),
            ("b_L.png: a PNG needs the channels R, G, B",),
        ),
    ],
)
def test_wrong_options(here: Path, clf: InProcess, options: tuple[str, ...], parts: tuple[str, ...]) -> None:
    (here / "a_R.png").mkdir()
    output = () if "-o" in options else ("-o", "a.png")
    assert clf("render", "scene.yaml", *output, *options).is_one_line(STATUS_BAD_INPUT, *parts)
    assert added(here) == {"a_R.png"}
