"""What Python programs pass is checked as the shell's options are: our own errors, one line, that name the argument."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal import camera
from clfractal.scene.bookmarks import view_of
from tests.calls import failure
from tests.shell import SCENE

POINTS = [[0.0, 0.0, 0.0], [2.0, 2.0, 2.0]]

RENDER: list[tuple[dict[str, Any], str]] = [
    ({"samples": 2.7}, "samples: must be a whole number, got 2.7"),
    ({"samples": True}, "samples: must be a whole number, got true"),
    ({"samples": "3"}, "samples: must be a whole number, got '3'"),
    ({"samples": np.int64(0)}, "samples: must be from 1 to 65536, got 0"),
    ({"samples": np.float32(2.0)}, "samples: must be a whole number, got 2.0"),
    ({"region": (0, 0, 8)}, "region: must be 4 whole numbers, x, y, width, height in pixels; got (0, 0, 8)"),
    ({"region": (0, 0, 8, 8.5)}, "region: must be 4 whole numbers, "),
    ({"region": 7}, "region: must be 4 whole numbers, "),
    ({"region": (0, 0, 41, 1)}, "region: must lie inside the picture of 40 x 36 pixels, got 0,0,41,1"),
    ({"precision": 64}, "precision: must be auto, float32 or float64, got 64"),
    (
        {"precision": "flot32"},
        "precision: must be auto, float32 or float64, got 'flot32'; did you mean 'float32'?",
    ),
    ({"channels": "RGB"}, "channels: must be a list of texts, got 'RGB'"),
    ({"channels": ["R", 3]}, "channels: must be a list of texts, got 3"),
    ({"channels": ["R", "Q"]}, "channels: unknown channel 'Q'"),
    ({"channels": []}, "channels: a picture needs at least one channel"),
    ({"quality": ["good"]}, "quality: must be a word such as good, got a list of 1"),
    ({"quality": "god"}, "quality: unknown quality 'god'; did you mean 'good'?"),
    ({"device": "nosuch"}, "unknown device 'nosuch'"),
    ({"device": 3}, "device: must be text such as cpu, gpu, 0:0 or part of a name, got 3"),
    ({"progress": 3}, "progress: must be a function, got 3"),
]


def refused(
    call: Callable[[], object], message: str, kind: type[clfractal.ClfractalError] = clfractal.ClfractalError
) -> None:
    text = str(failure(kind, call))
    assert text.startswith(message), text


@pytest.mark.parametrize(("settings", "message"), RENDER, ids=[message for _, message in RENDER])
def test_wrong_arguments_of_a_render(settings: dict[str, Any], message: str) -> None:
    refused(lambda: clfractal.render(SCENE, **settings), message)


def test_wrong_arguments_of_an_engine() -> None:
    with clfractal.Engine() as engine:
        wrong: Any = "stop"
        refused(lambda: engine.render(SCENE, token=wrong), "token: must be a CancelToken, got 'stop'")
        refused(lambda: engine.refine(SCENE, token=wrong), "token: must be a CancelToken")
        refused(lambda: next(engine.refine(SCENE, samples=wrong)), "samples: must be a whole number")
        assert engine.render(SCENE, samples=np.int64(1))["R"].shape == (36, 40)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"bits": 7}, "bits: must be 8 or 16, got 7"),
        ({"bits": 8.0}, "bits: must be a whole number, got 8.0"),
        ({"exposure": float("nan")}, "exposure: must be a finite number, got nan"),
        ({"exposure": 1e6}, "exposure: must be at most 100, got 1000000.0"),
        ({"exposure": "bright"}, "exposure: must be a number, got 'bright'"),
        ({"transparent": "no"}, "transparent: must be true or false, got 'no'"),
        ({"half": "R"}, "half: must be a list of texts, got 'R'"),
        ({"half": ["Q"]}, "half: unknown channel 'Q'"),
    ],
)
def test_a_film_is_saved_as_asked_or_not_at_all(
    settings: dict[str, Any], message: str, tmp_path: Path
) -> None:
    framebuffer = clfractal.Framebuffer(("R", "G", "B", "A"), (4, 4))
    refused(lambda: framebuffer.save(tmp_path / "a.png", **settings), message)
    assert list(tmp_path.iterdir()) == []
    refused(lambda: framebuffer.save(3), "path: must be a path, got 3")  # type: ignore[arg-type]
    refused(lambda: framebuffer.to_rgb8(exposure=float("inf")), "exposure: must be a finite number, got inf")


def test_numbers_of_numpy_are_numbers(tmp_path: Path) -> None:
    framebuffer = clfractal.render(SCENE, samples=np.int64(2), region=np.array([4, 4, 8, 8]))  # type: ignore[arg-type]
    assert clfractal.load_scene(framebuffer.header["scene"]).renderer.samples == 2
    assert framebuffer["R"].shape == (8, 8)
    framebuffer.save(
        tmp_path / "a.png", bits=np.int16(16), exposure=np.float32(0.5), transparent=np.bool_(False)
    )
    assert (tmp_path / "a.png").read_bytes()[24] == 16
    assert framebuffer.to_rgb8(exposure=np.float64(1)).shape == (8, 8, 3)
    counts, _ = clfractal.escape(
        {"name": "mandelbulb", "parameters": {"power": np.int32(2)}},
        np.array(POINTS, np.float32),
        iterations=np.uint8(12),  # type: ignore[arg-type]
        bailout=np.float32(2),  # type: ignore[arg-type]
    )
    assert counts.tolist() == [12, 1]


def test_numbers_of_numpy_in_scenes() -> None:
    plain: dict[str, Any] = {
        "version": 1,
        "formula": {"name": "mandelbulb", "iterations": 9, "parameters": {"power": 6}},
        "image": {"width": 32, "height": 24},
        "camera": {"position": [0.5, -3.0, 0.25], "fov": 30.0},
        "lights": [{"direction": [1.0, 1.0, -1.0], "shadow": False}],
    }
    numpy: dict[str, Any] = {
        "version": np.int8(1),
        "formula": {
            "name": np.str_("mandelbulb"),
            "iterations": np.int64(9),
            "parameters": {"power": np.uint16(6)},
        },
        "image": {"width": np.int32(32), "height": np.array(24)},
        "camera": {"position": np.array([0.5, -3, 0.25], np.float32), "fov": np.float32(30)},
        "lights": [{"direction": (np.float32(1), np.int64(1), np.float64(-1)), "shadow": np.bool_(False)}],
    }
    scene = clfractal.load_scene(plain)
    assert clfractal.load_scene(numpy) == scene
    assert clfractal.load_scene(clfractal.load_scene(numpy).resolved()) == scene
    changed = scene.camera.model_copy(update={"position": np.array([1, 2, 3]), "fov": np.float32(40)})
    assert changed.position == (1, 2, 3)
    assert isinstance(changed.position[0], float)
    wider = scene.model_copy(update={"image": {"width": np.int64(64), "height": np.int64(48)}})
    assert (wider.image.width, type(wider.image.width)) == (64, int)
    marked = scene.model_copy(update={"bookmarks": {"a": {"position": np.zeros(3) + 2}}})
    assert view_of(marked.bookmarks["a"])[0].position[0] == 2


@pytest.mark.parametrize(
    ("update", "message"),
    [
        ({"camera": {"fov": 400}}, "camera.fov: must be below 180, got 400"),
        ({"camera": {"fob": 40}}, "camera: unknown key 'fob'; did you mean 'fov'?"),
        ({"image": {"width": 2.5}}, "image.width: must be a whole number, got 2.5"),
        ({"kamera": {}}, "unknown key 'kamera'; did you mean 'camera'?"),
        ({"lights": [{"direction": [0, 0]}]}, "lights.0.direction: must be a list of 3 numbers"),
    ],
)
def test_a_copy_of_a_scene_is_checked(update: Mapping[str, Any], message: str) -> None:
    scene = clfractal.load_scene(SCENE)
    refused(lambda: scene.model_copy(update=update), message, clfractal.SceneError)


def test_a_copy_of_a_section_is_checked() -> None:
    scene = clfractal.load_scene(SCENE)
    refused(lambda: scene.camera.model_copy(update={"fov": 400}), "fov: must be below 180, got 400")
    refused(lambda: scene.image.model_copy(update={"width": 0}), "width: must be at least 1, got 0")
    plane = clfractal.load_scene(SCENE + "renderer: {type: cut_plane}\n").renderer
    from clfractal.scene.cut_plane import CutPlaneRenderer
    from clfractal.scene.rectangle import moved

    assert isinstance(plane, CutPlaneRenderer)
    refused(lambda: moved(plane.plane, normal=1e9), "center", clfractal.SceneError)


def test_a_section_that_is_made_by_hand_is_checked() -> None:
    """With the errors of a file; sections and classes of sections may stand for their mappings."""
    from clfractal.scene.parts import Image, OrthographicCamera, PerspectiveCamera

    least: dict[str, Any] = {"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}}
    for change, message in (
        ({"camera": {"fov": 400}}, "camera.fov: must be below 180, got 400"),
        ({"kamera": {}}, "unknown key 'kamera'; did you mean 'camera'?"),
        ({"camera": {"projection": "fisheye"}}, "camera.projection: unknown projection 'fisheye'"),
        ({"formula": {}}, "formula: needs one of name, file, inline or chain"),
    ):
        refused(lambda change=change: clfractal.Scene(**{**least, **change}), message, clfractal.SceneError)  # type: ignore[misc]
    refused(clfractal.Scene, "version: is missing")
    refused(lambda: PerspectiveCamera(fov=400), "fov: must be below 180, got 400")
    made = clfractal.Scene(
        **{**least, "camera": OrthographicCamera(height=2), "image": Image(width=np.int64(8))}
    )
    assert made == clfractal.load_scene(
        {**least, "camera": {"projection": "orthographic", "height": 2}, "image": {"width": 8}}
    )
    assert list(inspect.signature(clfractal.Scene).parameters)[:3] == ["version", "formula", "camera"]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"formula": "mandelbul"}, "name: unknown formula 'mandelbul'; did you mean 'mandelbulb'"),
        ({"parameters": {"powr": 3}}, "parameters.powr: "),
        ({"iterations": 1.5}, "iterations: must be"),
        ({"points": [0, 0, 0]}, "points: must have shape"),
        ({"points": [[0, 0]]}, "points: must have shape"),
        ({"points": np.zeros((2, 3, 1))}, "points: must have shape"),
        ({"formula": 5}, "formula: must be a name of the library, a path or a mapping, got 5"),
        ({"formula": None}, "formula: must be a name of the library, a path or a mapping, got nothing"),
        ({"parameters": [8]}, "parameters: must be a mapping, got a list of 1"),
        ({"bailout": 0}, "bailout: must be above 0, got 0"),
        ({"bailout": float("nan")}, "bailout: must be a finite number, got nan"),
        ({"bailout": "far"}, "bailout: must be a number, got 'far'"),
        ({"bailout": 1e12}, "bailout: must be at most 1e+09, got 1000000000000.0"),
        ({"iterations": -1}, "iterations: must be from 0 to 2000000000, got -1"),
        ({"iterations": 2**32}, "iterations: must be from 0 to 2000000000, got 4294967296"),
        ({"iterations": True}, "iterations: must be a whole number, got true"),
        ({"precision": "auto"}, "precision: must be float32 or float64, got 'auto'"),
        ({"points": [[0, 0, float("inf")]]}, "points: must be finite"),
        ({"points": [["a", "b", "c"]]}, "points: must be numbers of shape (n, 3)"),
        ({"points": [[0, 0], [1]]}, "points: must be numbers of shape (n, 3)"),
        ({"points": None}, "points: must be numbers of shape (n, 3)"),
        ({"device": 3}, "device: must be text"),
    ],
)
def test_wrong_questions_about_points(settings: dict[str, Any], message: str) -> None:
    asked = {"formula": "mandelbulb", "points": POINTS, "iterations": 5, **settings}
    refused(lambda: clfractal.escape(**asked), message)
    if "bailout" not in settings and settings.get("iterations") not in (-1, 2**32):
        refused(lambda: clfractal.distances(**asked), message)


WRONG: Any = 5
SOURCE: Any = clfractal.load_scene(SCENE)
CALLS: list[tuple[Callable[[], object], str]] = [
    (lambda: clfractal.load_scene(WRONG), "scene: must be a path, YAML text or a mapping, got 5"),
    (lambda: clfractal.load_scene(SCENE, overrides="camera.fov=3"), "overrides: must be a list of texts"),
    (lambda: clfractal.load_scene(SCENE, folder=WRONG), "folder: must be a path, got 5"),
    (lambda: clfractal.render(WRONG), "scene: must be a path"),
    (lambda: clfractal.dump_scene(WRONG), "scene: must be a Scene, got 5"),
    (lambda: clfractal.variations(WRONG), "scene: must be a path, YAML text or a mapping, got 5"),
    (lambda: clfractal.variations(SOURCE, count=WRONG / 2), "count: must be a whole number"),
    (lambda: clfractal.variations(SOURCE, seed=WRONG / 2), "seed: must be a whole number, got 2.5"),
    (
        lambda: clfractal.variations(SOURCE, strength=WRONG),
        "strength: must be slight, medium or heavy, got 5",
    ),
    (
        lambda: clfractal.variations(SOURCE, strength="hevy"),  # type: ignore[arg-type]
        "strength: must be slight, medium or heavy, got 'hevy'; did you mean 'heavy'?",
    ),
    (
        lambda: clfractal.variations(SOURCE, kinds=["colours"]),  # type: ignore[list-item]
        "kinds: unknown kind 'colours'; did you mean 'colors'?",
    ),
    (lambda: clfractal.variations(SOURCE, count=0), "count: must be from 1 to 100000, got 0"),
    (lambda: clfractal.variations(SOURCE, locked="camera"), "locked: must be a list of texts"),
    (lambda: clfractal.voxelize(WRONG), "scene: must be a path"),
    (lambda: clfractal.voxelize(SOURCE, resolution=WRONG / 2), "resolution: must be"),
    (
        lambda: clfractal.voxelize(SOURCE, precision=WRONG),
        "precision: must be auto, float32 or float64, got 5",
    ),
    (lambda: clfractal.mesh(SOURCE, level=float("nan")), "level: must be a finite number"),
    (lambda: clfractal.mesh(SOURCE, close=WRONG), "close: must be true or false, got 5"),
    (
        lambda: clfractal.distances("mandelbulb", POINTS, iterations=0),
        "iterations: must be from 1 to 1000000",
    ),
    (lambda: clfractal.Engine(WRONG), "device: must be text"),
    (lambda: clfractal.Engine(budget_seconds=0), "budget_seconds: must be at least 0.0001, got 0"),
    (lambda: clfractal.Engine(tell=WRONG), "tell: must be a function"),
    (lambda: camera.frame(WRONG), "scene: must be a Scene, as load_scene gives it, got 5"),
    (lambda: camera.angles(WRONG), "scene: must be a Scene, as load_scene gives it, got 5"),
    (lambda: camera.turn(SOURCE, azimuth="a"), "azimuth: must be a number, got 'a'"),  # type: ignore[arg-type]
    (
        lambda: camera.turn(SOURCE, elevation=float("nan")),
        "elevation: must be a finite number, got nan",
    ),
    (lambda: camera.roll(SOURCE, "a"), "camera.roll: must be a number, got 'a'"),  # type: ignore[arg-type]
]


@pytest.mark.parametrize(("call", "message"), CALLS)
def test_other_functions_name_their_arguments(call: Callable[[], object], message: str) -> None:
    refused(call, message)


def test_moves_of_a_camera_take_numbers_of_numpy() -> None:
    scene = SOURCE
    turned = camera.turn(scene, azimuth=np.float32(90))  # type: ignore[arg-type]
    assert camera.angles(turned)[0] == pytest.approx(camera.angles(scene)[0] + 90)


# --- volumes ---

GRID = np.zeros((2, 3, 4), np.float32)


@pytest.mark.parametrize(
    ("values", "more", "message"),
    [
        (None, {}, "values: must be an array of integers or floats of up to 64 bits, got nothing"),
        ("bulb.nrrd", {}, "values: must be an array of integers or floats of up to 64 bits, got <U9"),
        (
            [[[1, 2], [3]]],
            {},
            "values: must be an array of integers or floats of up to 64 bits, got a list of 1",
        ),
        (
            GRID.astype(complex),
            {},
            "values: must be an array of integers or floats of up to 64 bits, got complex",
        ),
        (
            GRID.astype(object),
            {},
            "values: must be an array of integers or floats of up to 64 bits, got a list",
        ),
        (GRID[0], {}, "values: must have the shape (nz, ny, nx), with at least one voxel, got (3, 4)"),
        (GRID[:0], {}, "values: must have the shape (nz, ny, nx), with at least one voxel, got (0, 3, 4)"),
        (GRID, {"origin": [0, 0]}, "origin: must be 3 numbers, all finite, got a list of 2"),
        (GRID, {"origin": "here"}, "origin: must be 3 numbers, all finite, got 'here'"),
        (GRID, {"origin": [0, 0, float("nan")]}, "origin: must be 3 numbers, all finite"),
        (GRID, {"directions": 0.5}, "directions: must be 3 steps of 3 numbers each, all finite, got 0.5"),
        (
            GRID,
            {"directions": np.eye(2)},
            "directions: must be 3 steps of 3 numbers each, all finite, got an array",
        ),
        (GRID, {"directions": np.zeros((3, 3))}, "directions: must be steps that do not lie in one plane"),
        (GRID, {"directions": np.diag([1, 1, 0])}, "directions: must be steps that do not lie in one plane"),
        (GRID, {"texts": "a"}, "texts: must be a mapping of texts, got 'a'"),
        (GRID, {"texts": {"a": 3}}, "texts: must be texts by keys that are texts, got 3"),
        (GRID, {"inputs": "a.nrrd"}, "inputs: must be a list of paths, got 'a.nrrd'"),
        (GRID, {"inputs": [3]}, "inputs: must be a path, got 3"),
        (GRID, {"remarks": "a"}, "remarks: must be a list of texts"),
    ],
)
def test_a_volume_is_made_of_numbers(values: Any, more: dict[str, Any], message: str) -> None:
    refused(lambda: clfractal.Volume(values, **more), message, clfractal.SceneError)


def test_a_volume_takes_what_numpy_makes_an_array_of(tmp_path: Path) -> None:
    volume = clfractal.Volume(
        GRID.tolist(),  # type: ignore[arg-type]
        (1, 2, 3),  # type: ignore[arg-type]
        1e-200 * np.eye(3),
        inputs=["a.nrrd"],  # type: ignore[arg-type]
    )
    assert volume.values.shape == (2, 3, 4)
    assert volume.values.dtype == np.float64
    assert volume.origin.dtype == volume.directions.dtype == np.float64
    assert volume.inputs == (Path("a.nrrd"),)
    swapped = np.arange(24, dtype=">f4").reshape(2, 3, 4)
    own = clfractal.Volume(swapped)
    assert own.values.dtype.isnative
    np.testing.assert_array_equal(own.values, swapped)
    own.save(tmp_path / "a.nrrd")
    assert clfractal.Volume(GRID).values is GRID


def test_variations_take_what_render_takes(tmp_path: Path) -> None:
    scene = clfractal.load_scene(SCENE)
    (tmp_path / "a.yaml").write_text(SCENE)
    for source in (SCENE, scene.resolved(), tmp_path / "a.yaml", str(tmp_path / "a.yaml")):
        wanted = clfractal.variations(clfractal.load_scene(source), count=2)
        assert [each.changes for each in clfractal.variations(source, count=2)] == [
            each.changes for each in wanted
        ]


@pytest.mark.parametrize("precision", ["float32", "float64"])
@pytest.mark.parametrize("formula", ["mandelbulb", "mandelbox", "apollonian", "menger_sponge"])
def test_points_may_be_as_far_away_as_numbers_go(formula: str, precision: str) -> None:
    """Without a warning (which is an error here): they escape as points that are merely far away do."""
    directions = np.array([[1, 0, 0], [-1, 2, -3], [0.3, -0.7, 0.2], [1, 1, 1]])
    far, inside = clfractal.escape(formula, directions * 5e307, iterations=20, precision=precision)
    assert not inside.any()
    near = clfractal.escape(formula, directions * 1e15, iterations=20, precision=precision)
    np.testing.assert_array_equal(far, near[0])
    assert np.isfinite(
        clfractal.distances("mandelbulb", directions * 5e307, precision=precision).smooth
    ).all()
