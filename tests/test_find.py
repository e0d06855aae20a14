"""Views that are found: outside the set with room, different ones, the same ones again; files that hold them."""

from __future__ import annotations

import signal
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clfractal
from clfractal.engine import finding
from clfractal.engine.finding import find
from clfractal.engine.found import FoundView
from clfractal.engine.view_score import CHANNELS, looked_at
from clfractal.errors import SceneError
from clfractal.formulas import reference
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.tiles import Region
from clfractal.scene.model import Scene
from tests.shell import InProcess, Running, works

# A closed hall: a ball is cut out of a box, with columns in it and a lamp.
HALL = """\
version: 1
formula: none
image: {width: 64, height: 36}
camera: {position: [0, -1, 0]}
lights: [{type: point, position: [0, 0, 0.6], falloff: none, shadow: false}]
background: [0, 0, 0]
objects:
"""
COLUMNS = [(0.5, 0.2), (-0.4, 0.5), (-0.3, -0.6), (0.2, -0.3)]
HALL += "".join(
    f"  column{n}: {{type: cylinder, radius: 0.06, height: 3, position: [{x}, {y}, 0]}}\n"
    for n, (x, y) in enumerate(COLUMNS)
)
WALLS = {"north": [0, 1.05, 0], "south": [0, -1.05, 0], "east": [1.05, 0, 0], "west": [-1.05, 0, 0]}
HALL += "".join(
    f"  {name}: {{type: box, size: [{2.2 if not x else 0.1}, {2.2 if not y else 0.1}, 1.6], position: [{x}, {y}, {z}]}}\n"
    for name, (x, y, z) in WALLS.items()
)
HALL += "  ceiling: {type: plane, position: [0, 0, 0.75], normal: [0, 0, -1]}\n"
HALL += "  floor: {type: plane, position: [0, 0, -0.75]}\n"
SPONGE = (
    "version: 1\nformula: {name: menger_sponge, iterations: 4}\nimage: {width: 64, height: 36}\ncamera: {}\n"
)


def cameras(found: list[FoundView]) -> list[Any]:
    return [each.scene.camera for each in found]


@pytest.fixture
def few_places(monkeypatch: pytest.MonkeyPatch) -> None:
    """A quarter of the places that are tried, where the views themselves do not matter."""
    monkeypatch.setattr(finding, "_PLACES", (3, 12, 36))


@pytest.fixture(scope="module")
def sponge() -> tuple[Scene, list[FoundView]]:
    scene = clfractal.load_scene(SPONGE)
    return scene, find(scene, count=4)


def test_cameras_stand_outside_the_set_with_room(sponge: tuple[Scene, list[FoundView]]) -> None:
    scene, found = sponge
    places = np.array([camera.position for camera in cameras(found)])
    assert len(places) == 4
    assert not reference.escape(scene.chain, places, 4)[1].any()
    away = reference.distance(scene.chain, places, 4)[0]
    assert (away > 0.005 * scene.bounds[1]).all()
    assert [each.room for each in found] == pytest.approx(away.tolist(), rel=1e-6)
    assert (np.linalg.norm(places, axis=1) < 1.2 * scene.bounds[1]).all()


def test_they_show_much_and_differ(sponge: tuple[Scene, list[FoundView]]) -> None:
    scene, found = sponge
    assert [each.score for each in found] == sorted((each.score for each in found), reverse=True)
    assert found[0].score > 0.4
    for each in found:
        assert "score" in each.remark
        picture = clfractal.render(each.scene, samples=1, channels=("R", "G", "B", "A", "Z"))
        assert (picture["A"] > 0.5).mean() > 0.3
        near, far = np.percentile(picture["Z"][picture["A"] > 0.5], (5, 95))
        assert far > 1.5 * near
        # What else the scene has stays.
        assert each.scene.lights == scene.lights
        assert each.scene.image == scene.image
    for one, other in combinations(cameras(found), 2):
        apart = np.linalg.norm(np.subtract(one.position, other.position))
        ways = [np.subtract(each.target, each.position) for each in (one, other)]
        cosine = ways[0] @ ways[1] / np.prod([np.linalg.norm(way) for way in ways])
        assert apart > 0.05 or cosine < 0.9


def test_the_horizon_is_level_and_up_is_the_scenes(sponge: tuple[Scene, list[FoundView]]) -> None:
    for camera in cameras(sponge[1]):
        assert camera.up == (0, 0, 1)
        assert abs(camera.angles[1]) <= 33
    turned = clfractal.load_scene(SPONGE, overrides=["camera.up=[0, 1, 0]", "camera.position=[0, 0, 3]"])
    (found,) = find(turned, count=1)
    assert found.scene.camera.up == (0, 1, 0)
    assert abs(found.scene.camera.angles[1]) <= 33


@pytest.mark.usefixtures("few_places")
def test_the_seed_chooses_and_no_more() -> None:
    found = cameras(find(SPONGE, count=2))
    assert found
    assert cameras(find(SPONGE, count=2)) == found
    assert cameras(find(SPONGE, count=2, seed=1)) != found


def test_a_token_ends_the_search() -> None:
    token = clfractal.CancelToken()
    token.cancel()
    with pytest.raises(clfractal.Stopped):
        find(SPONGE, count=1, token=token)
    with pytest.raises(clfractal.SceneError, match="token: must be a CancelToken"):
        find(SPONGE, token=1)  # type: ignore[arg-type]


def test_a_closed_hall_is_seen_from_inside() -> None:
    found = find(HALL, count=4, seed=3)
    assert found
    for camera in cameras(found):
        x, y, z = camera.position
        assert max(abs(x), abs(y)) < 1
        assert abs(z) < 0.75
        assert min(np.hypot(x - a, y - b) for a, b in COLUMNS) > 0.06


@pytest.mark.usefixtures("few_places")
def test_dark_places_and_empty_ones_are_none() -> None:
    with pytest.raises(SceneError, match="no view was found: nowhere near what is seen"):
        find(SPONGE.replace("camera: {}", "camera: {}\nlights: []"), count=2)
    with pytest.raises(SceneError, match="no view was found"):
        find("version: 1\nformula: none\nimage: {width: 64, height: 36}\ncamera: {}\n")


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ("renderer: {type: cut_plane}\n", "renderer.type: views are found of surfaces, got a cut_plane"),
        ("renderer: {type: volume}\n", "renderer.type: views are found of surfaces, got a volume"),
        ("layout: {columns: 2, views: [{}, {}]}\n", "layout: has views of its own; remove it to look for others"),
        (
            "stereo: {plane: {}}\n",
            "stereo.plane: decides where the viewer is; remove it to look for views",
        ),
    ],
)  # fmt: skip
def test_scenes_without_views_to_look_for(clf: InProcess, more: str, message: str) -> None:
    Path("scene.yaml").write_text(SPONGE + more)
    assert clf("find", "scene.yaml").is_one_line(2, f"scene.yaml: {message}")


def test_scores_prefer_depth_and_light() -> None:
    def picture(depth: Any, light: Any) -> Framebuffer:
        size = (40, 24)
        made = Framebuffer(CHANNELS, size, Region(0, 0, *size))
        rows, columns = np.mgrid[0:24, 0:40]
        values = {"Z": depth, "A": np.ones((24, 40))} | dict.fromkeys("RGB", light)
        # Steps that are turned to several sides.
        turned = (columns // 4 + rows // 4) % 3
        values |= {f"N.{axis}": turned == number for number, axis in enumerate("XYZ")}
        for name, value in values.items():
            made[name][:] = value
        return made

    columns = np.broadcast_to(np.arange(40), (24, 40))
    deep, flat = np.exp(np.abs(columns - 20) / -8.0) * 3 + 0.2, np.ones((24, 40))
    lit = 0.1 + 0.5 * ((columns // 8) % 2)
    best = looked_at(picture(3.4 - deep, lit), 5.0, 0.8).score
    assert best > looked_at(picture(flat, lit), 5.0, 0.8).score
    assert best > looked_at(picture(3.4 - deep, 0.001 * lit), 5.0, 0.8).score
    assert looked_at(picture(np.full((24, 40), np.inf), lit), 5.0, 0.8).score == 0


SMALL = ("-n", "2", "--size", "32x18")


@pytest.mark.usefixtures("few_places")
def test_scenes_with_their_pictures(clf: InProcess) -> None:
    Path("scene.yaml").write_text(SPONGE)
    ended = works(clf("find", "scene.yaml", *SMALL, "-o", "out", "--sheet", "sheet.png"))
    assert ended.out == ""
    assert sorted(path.name for path in Path("out").iterdir()) == [
        f"scene-0{number}.{kind}" for number in (1, 2) for kind in ("png", "yaml")
    ]
    assert "# View 1 of scene.yaml (seed 0)" in Path("out/scene-01.yaml").read_text()
    scenes = [clfractal.load_scene(Path(f"out/scene-0{number}.yaml")) for number in (1, 2)]
    assert scenes[0].camera != scenes[1].camera
    for number, scene in enumerate(scenes, start=1):
        assert scene.image.width == 64
        assert clfractal.load_scene(Path(f"out/scene-0{number}.png")) == scene
        assert Image.open(f"out/scene-0{number}.png").size == (32, 18)
    assert Path("sheet.png").exists()
    assert clf("find", "scene.yaml", *SMALL, "-o", "out").is_one_line(2, "out/scene-01.yaml: exists already")


@pytest.mark.usefixtures("few_places")
def test_one_scene_with_bookmarks(clf: InProcess) -> None:
    Path("scene.yaml").write_text(SPONGE + "bookmarks: {mine: {}}\n")
    works(clf("find", "scene.yaml", "-n", "2", "-o", "views.yaml", "--quiet"))
    found = clfractal.load_scene(Path("views.yaml"))
    assert list(found.bookmarks) == ["mine", "view 1", "view 2"]
    assert found.camera == found.bookmarks["view 1"]
    assert [path.name for path in Path().iterdir() if "view" in path.name] == ["views.yaml"]
    # A second round keeps the first one's.
    works(clf("find", "views.yaml", "-n", "1", "--seed", "1", "-o", "more.yaml", "--quiet"))
    more = clfractal.load_scene(Path("more.yaml"))
    assert list(more.bookmarks) == ["mine", "view 1", "view 2", "view 3"]
    assert {name: more.bookmarks[name] for name in found.bookmarks} == found.bookmarks
    assert more.camera == more.bookmarks["view 3"]


REFUSED = {
    ("--count", "0"): "--count: must be from 1 to 100, got 0",
    ("--count", "101"): "--count: must be from 1 to 100, got 101",
    ("--seed", "-1"): "--seed: must be",
    ("-o", "none/there"): "none/there: cannot be made: No such file or directory",
    ("-o", "scene.yaml"): "scene.yaml: exists already and is not replaced; choose another name",
    ("-o", "sheet.gif"): "sheet.gif: unknown extension '.gif'",
    ("-o", "-"): "standard output: cannot be written to: views are several files",
    ("-o", "views.yaml", "--sheet", "views.yaml"): "views.yaml: unknown extension",
    ("--set", "lights=[]"): "scene.yaml: no view was found",
    ("--device", "abacus"): "abacus",
    ("--device", "abacus", "-o", "new"): "abacus",
    ("--set", "lights=[]", "-o", "new"): "scene.yaml: no view was found",
    ("--set", "lights=[]", "--set", "output.exposure=auto"): "scene.yaml: no view was found",
}


@pytest.mark.usefixtures("few_places")
@pytest.mark.parametrize("options", REFUSED, ids=" ".join)
def test_what_is_refused(clf: InProcess, options: tuple[str, ...]) -> None:
    Path("scene.yaml").write_text(SPONGE)
    assert clf("find", "scene.yaml", "--quiet", *options).is_one_line(2, REFUSED[options])
    assert [path.name for path in Path().iterdir()] == ["scene.yaml"]


def test_an_interrupt_leaves_nothing_behind(tmp_path: Path) -> None:
    (tmp_path / "scene.yaml").write_text(SPONGE)
    running = Running(tmp_path, "find", "scene.yaml", "-n", "100", "-o", "new")
    running.wait_until((tmp_path / "new").exists)
    running.wait_until_it_listens()
    status, told = running.ended_by(signal.SIGINT)
    assert status == 130
    assert told.endswith("clfractal: interrupted; nothing was written\n")
    assert [path.name for path in tmp_path.iterdir()] == ["scene.yaml"]
