"""Pictures that show less than they could are told, one line each; pictures as people want them are not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.cli.progress import Reporter
from clfractal.device.select import Device
from clfractal.files.volume_file import Volume, write_volume
from tests.pictures import scene_paths, small_framebuffers
from tests.render.shots import BALL, engine_of
from tests.scenes import scene_of
from tests.shell import Ended, InProcess, works

CAMERA: dict[str, Any] = {"position": [0, -4, 0]}
AWAY: dict[str, Any] = {"position": [0, -4, 0], "target": [0, -8, 0]}
SIZE = (48, 32)
STEREO = {"screen_width": 0.6, "screen_distance": 0.7}
VOLUME = {"type": "volume", "resolution": 16}


@pytest.fixture
def engine(device: Device) -> clfractal.Engine:
    return engine_of(device)


def of(
    engine: clfractal.Engine, formula: Any = BALL, camera: Any = CAMERA, **sections: Any
) -> tuple[str, ...]:
    """The remarks on a whole picture."""
    scene = scene_of(formula, camera, SIZE, **sections)
    if scene.stereo is not None:
        left, right = engine.render_pair(scene)
        assert left.remarks == right.remarks
        return left.remarks
    return engine.render(scene).remarks


def one(remarks: tuple[str, ...], *parts: str) -> None:
    (line,) = remarks
    assert "\n" not in line
    assert [part for part in parts if part not in line] == [], line


def test_a_usual_picture_needs_no_remark(engine: clfractal.Engine) -> None:
    framebuffer = engine.render(scene_of(BALL, CAMERA, SIZE))
    assert framebuffer.remarks == ()
    assert framebuffer.stats["remarks"] == []
    assert clfractal.Framebuffer().remarks == ()


def test_a_key_without_an_effect(engine: clfractal.Engine) -> None:
    formula = {"name": "mandelbulb", "iterations": 3}
    assert of(engine, formula) == ()
    one(of(engine, {**formula, "live": ["power"]}), "formula.live has no effect")


# The scenes whose programs other tests build anyway, of each renderer, with layouts and stereo; all were looked at.
@pytest.mark.parametrize("name", ["mandelbulb", "cut_mandelbrot", "four_views", "stereo_hall"])
def test_shipped_scenes_need_none(name: str) -> None:
    (path,) = [path for path in scene_paths() if path.stem == name]
    assert [framebuffer.remarks for framebuffer in small_framebuffers(path)] == [()] * len(
        small_framebuffers(path)
    )


def test_no_ray_meets_the_set(engine: clfractal.Engine) -> None:
    bounds = "a ball of radius 1.5 around [0, 0, 0], are not in the picture: turn camera.target"
    one(of(engine, camera=AWAY), "no ray meets the set", bounds)
    one(of(engine, camera=AWAY, background="transparent"), "the set, so alpha is 0 everywhere;", bounds)
    # Two eyes see the same nothing, once.
    one(of(engine, camera=AWAY, stereo=STEREO), "no ray meets the set")
    # Far away, but a ray in the middle of a pixel hits the bounds beside the ball.
    beside = {"position": [1.3, -4, 0], "target": [1.3, 0, 0], "fov": 2}
    one(of(engine, camera=beside), "although rays go through its bounds", "formula.iterations")
    cut = [{"plane": {"center": [0, 3, 0], "normal": [0, -1, 0]}, "cut": True, "opacity": 0}]
    one(of(engine, cut_planes=cut), "although rays go through its bounds; cut_planes may have removed it")


def test_no_ray_meets_objects_alone(engine: clfractal.Engine) -> None:
    ball, floor = {"type": "sphere", "radius": 0.5}, {"type": "plane", "position": [0, 0, -1]}

    def seen(camera: Any, **objects: Any) -> tuple[str, ...]:
        return engine.render(scene_of("none", camera, SIZE, objects=objects)).remarks

    one(
        seen(AWAY, ball=ball),
        "no ray meets the objects",
        "around [0, 0, 0]: turn camera.target",
    )
    assert seen(CAMERA, ball=ball) == seen(AWAY, ball=ball, floor=floor) == seen(AWAY) == ()


@pytest.mark.parametrize("channels", [["R", "G", "B"], ["Z"]])
def test_channels_are_not_needed(channels: list[str], engine: clfractal.Engine) -> None:
    scene = scene_of(BALL, AWAY, SIZE)
    one(engine.render(scene, channels=channels).remarks, "no ray meets the set")
    assert engine.render(scene_of(BALL, CAMERA, SIZE), channels=channels).remarks == ()


def test_a_region_may_show_only_background(engine: clfractal.Engine) -> None:
    """But not if the whole picture misses the set."""
    corner = (0, 0, 8, 8)
    framebuffer = engine.render(scene_of(BALL, CAMERA, SIZE), region=corner)
    assert framebuffer.stats["hits"] == 0
    assert framebuffer.remarks == ()
    one(engine.render(scene_of(BALL, AWAY, SIZE), region=corner).remarks, "no ray meets the set")


def test_a_view_of_a_layout_is_named(engine: clfractal.Engine) -> None:
    remarks = of(engine, layout={"views": [{}, {"camera": AWAY}]})
    one(remarks, "layout.views.1: no ray meets the set")


def test_the_camera_is_inside(engine: clfractal.Engine) -> None:
    inside = {"position": [0, -0.2, 0], "target": [0, 0, 0]}
    one(of(engine, camera=inside), "the camera is inside the set; move camera.position")
    # Where a plane has removed the set around it, it may be there.
    cut = [{"plane": {"center": [0, 0.3, 0], "normal": [0, -1, 0]}, "cut": True, "opacity": 0}]
    assert of(engine, camera=inside, cut_planes=cut) == ()
    one(of(engine, camera=inside, renderer=VOLUME), "the camera is inside the set")
    # A picture full of the set is no mistake.
    assert of(engine, camera={"position": [0, -1.3, 0], "fov": 10}) == ()


STILL = {**BALL, "map": ["0.5*x", "0.5*y", "0.5*z"], "degree": 1}


def test_a_formula_that_never_escapes(engine: clfractal.Engine) -> None:
    one(of(engine, STILL), "never escapes", "plain ball", "formula.bailout")
    one(of(engine, STILL, renderer=VOLUME), "never escapes", "plain box")


def test_steps_that_end_inside(engine: clfractal.Engine) -> None:
    """Of a derivative that is told to grow too slowly, distances are six times too long; smaller steps mend it."""
    bold = {**BALL, "derivative": "1.6*sqrt(x*x + y*y + z*z)*dr"}
    rough = {"type": "surface", "step_scale": 1.0}
    remarks = of(engine, bold, renderer=rough)
    one(remarks, "% of the steps ended inside the set", "a renderer.step_scale below 1, such as 0.5, helps")
    assert of(engine, bold, renderer={**rough, "step_scale": 0.1}) == ()


def test_steps_that_are_too_few(engine: clfractal.Engine) -> None:
    def limited(steps: int, **more: Any) -> tuple[str, ...]:
        return of(engine, renderer={"type": "surface", "max_steps": steps}, **more)

    for steps in (1, 3):
        one(limited(steps), f"of at most {steps} steps", "a larger renderer.max_steps shows more")
    one(limited(1, camera={"position": [0, -4, 0], "fov": 5}), "renderer.max_steps")
    assert limited(60) == ()


def test_volumes_that_show_nothing(engine: clfractal.Engine, tmp_path: Path) -> None:
    beyond = {**VOLUME, "box": {"center": [5, 0, 0], "size": 2}}
    one(
        of(engine, renderer=beyond),
        "the volume lies beyond the set; renderer.box",
        "radius 1.5 around [0, 0, 0]",
    )
    one(of(engine, camera=AWAY, renderer=VOLUME), "no ray meets the volume; its box is not in the picture")
    # A bar along the diagonal of the picture, which would be in it if it went along its axis.
    bar = Volume(
        np.ones((4, 4, 40), np.float32),
        np.array([-5.0, -5.0, -0.2]),
        np.array([[0.25, 0.25, 0], [-0.1, 0.1, 0], [0, 0, 0.1]]),
    )
    write_volume(tmp_path / "bar.nrrd", bar)
    plain = scene_of(
        BALL, {"position": [3, -4, 9], "target": [3, -4, 0], "up": [0, 1, 0], "fov": 30}, SIZE
    ).resolved()
    plain["renderer"] = {"type": "volume", "file": "bar.nrrd"}
    beside: clfractal.Scene = clfractal.load_scene(plain, folder=tmp_path)
    one(engine.render(beside).remarks, "its box is not in the picture: turn camera.target to [-0.2")
    clear = {**VOLUME, "transfer": {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0}]}}
    hidden = of(engine, renderer=clear, background="transparent")
    one(hidden, "nothing of the volume is visible, so alpha is 0 everywhere; renderer.transfer.opacity is 0")
    corner = {**VOLUME, "box": {"center": [1.2, 1.2, 1.2], "size": 1}}
    facing = {"position": [1.2, -4, 1.2], "target": [1.2, 1.2, 1.2]}
    one(of(engine, camera=facing, renderer=corner), "the volume holds nothing of the set")
    np.save(tmp_path / "lost.npy", np.full((8, 8, 8), np.nan, np.float32))
    plain = scene_of(BALL, CAMERA, SIZE).resolved()
    plain["renderer"] = {"type": "volume", "file": "lost.npy"}
    lost: clfractal.Scene = clfractal.load_scene(plain, folder=tmp_path)
    one(engine.render(lost).remarks, "the volume holds nothing but NaN; renderer.file")


def test_planes_of_one_color(engine: clfractal.Engine) -> None:
    """A plane within the ball, and one far from it."""

    def plane(**place: Any) -> dict[str, Any]:
        return {"type": "cut_plane", "plane": {"normal": [0, -1, 0], **place}}

    one(of(engine, renderer=plane(width=0.2, height=0.2)), "all of the plane is inside the set")
    far = plane(center=[0, 90, 0], width=1, height=1)
    one(of(engine, renderer=far), "so far from the set")
    assert of(engine, renderer=plane(width=4, height=4)) == ()


def test_a_plane_that_is_too_large(engine: clfractal.Engine) -> None:
    """Its middle is inside the set, which is less than a pixel of it."""
    scene = clfractal.load_scene(
        "version: 1\nformula: {name: mandelbulb, iterations: 60}\nimage: {width: 200, height: 200}\ncamera: {}\n"
        "renderer: {type: cut_plane, plane: {width: 1e+6, height: 1e+6}}\n"
    )
    one(engine.render(scene).remarks, "the plane of 1e+06 x 1e+06 is so large", "a smaller renderer.plane")


def test_a_picture_made_again_has_the_same_remarks(engine: clfractal.Engine, tmp_path: Path) -> None:
    """Its header holds every key, also those that nobody wrote; only what differs from the default would be missed."""
    scene = clfractal.load_scene(
        "version: 1\nformula: {name: hast, iterations: 3}\nimage: {width: 32, height: 24}\n"
        "camera: {position: [1.7, -2.9, 1.4]}\nlighting: {mode: path}\nlights: []\nbackground: [1, 1, 1]\n"
        "materials: {m: {base: {color: [1, 1, 1]}}}\nmaterial: {name: m}\nrenderer: {samples: 4}\n"
    )
    framebuffer = engine.render(scene)
    assert framebuffer.remarks == ()
    framebuffer.save(tmp_path / "a.png")
    assert engine.render(tmp_path / "a.png").remarks == ()
    shiny = scene.model_copy(update={"material": {"name": "m", "shininess": 50}})
    for source in (shiny, shiny.resolved()):
        one(engine.render(source).remarks, "lighting.mode path does not use material.shininess")


def test_refined_pictures_have_them_at_the_end(engine: clfractal.Engine) -> None:
    adaptive = {"type": "surface", "samples": 8, "noise": 1.0, "min_samples": 4}
    framebuffers = list(engine.refine(scene_of(BALL, CAMERA, SIZE, renderer=adaptive)))
    assert framebuffers[-1].remarks == ()
    framebuffers = list(engine.refine(scene_of(BALL, AWAY, SIZE)))
    one(framebuffers[-1].remarks, "no ray meets the set")


SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 96, height: 64}
camera: {position: [0, -3, 0]}
"""


def rendered(clf: InProcess, *options: str) -> tuple[list[str], Ended]:
    """What `--stats` holds, and how the command ended."""
    ended = works(clf("render", "scene.yaml", "-o", "a.exr", "--stats", "a.json", *options))
    assert ended.out == ""
    return list(json.loads(Path("a.json").read_text())["remarks"]), ended


def test_the_shell_tells_them(clf: InProcess) -> None:
    away = ("--set", "camera.target=[0, -8, 0]")
    remarks, ended = rendered(clf, *away)
    one(tuple(remarks), "no ray meets the set")
    assert f"scene.yaml: {remarks[0]}" in ended.err.splitlines()
    assert rendered(clf, *away, "--quiet")[1].err == ""
    remarks, ended = rendered(clf)
    assert remarks == []
    assert "scene.yaml:" not in ended.err


@pytest.mark.parametrize("channels", ["[R, G, B, A]", "[R, G, B, Z]", "[R, G, B]"])
def test_a_resumed_picture_is_looked_at_as_a_whole(
    channels: str, clf: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The set is in the tiles that the first run has finished; the second run sees but the background around it."""
    small = (
        "camera.position=[0, -9, 0]",
        "camera.fov=120",
        "image.height=352",
        f"output.channels={channels}",
    )
    options = [word for setting in small for word in ("--set", setting)]
    with monkeypatch.context() as patched:
        patched.setattr(Reporter, "__call__", _interrupted)
        with pytest.raises(KeyboardInterrupt):
            clf("render", "scene.yaml", "-o", "a.exr", *options)
    assert Path("a.exr.partial").exists()
    remarks, _ = rendered(clf, *options, "--resume")
    found = json.loads(Path("a.json").read_text())
    assert 0 < found["tiles_resumed"] < found["tiles"]
    assert found["hits"] == 0
    assert remarks == []


def _interrupted(reporter: Reporter, state: clfractal.Progress) -> None:
    """The first tiles, in the picture's middle, are done."""
    if state.tiles_done:
        raise KeyboardInterrupt
