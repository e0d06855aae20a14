"""The scene in a frame's header needs no table, and has the same values as the film, to the last bit."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, reject, settings
from hypothesis import strategies as st

import clfractal
from clfractal.errors import SceneError
from clfractal.scene.animation import Animation
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.scene.standing import standing_alone
from tests.shell import InProcess

HEAD = "version: 1\nformula: {name: mandelbulb, iterations: 5}\nimage: {width: 24, height: 16}\n"
CAMERA = "camera: {position: [0, -3, 0]}\n"
Rows = list[tuple[float, float, float]]
ROW = st.tuples(*[st.floats(-1000, 1000) | st.floats(-1e-6, 1e-6)] * 3)


def film(folder: Path, rows: Rows, frames: int, *, tracks: str = "", **others: Any) -> Scene:
    table = "\n".join(",".join(map(repr, row)) for row in rows)
    (folder / "t.csv").write_text(f"a,b,c\n{table}\n")
    words = "".join(f", {key}: {value}" for key, value in others.items())
    moved = tracks or "material.ambient: {file: t.csv, column: a}"
    (folder / "s.yaml").write_text(
        f"{HEAD}{CAMERA}animation: {{frames: {frames}{words}, tracks: {{{moved}}}}}\n"
    )
    return load_scene(folder / "s.yaml")


def alone(scene: Scene, frame: float) -> Scene:
    """The scene of a frame without its table, read from text as a header holds it."""
    own = movement_of(scene).scene(frame)
    animation = standing_alone(own)
    assert animation is not None
    plain = own.resolved() | {"animation": animation.model_dump(mode="json")}
    assert "t.csv" not in str(plain)
    return load_scene(plain)


@settings(max_examples=60, deadline=None)
@given(
    rows=st.lists(ROW, min_size=5, max_size=9),
    loop=st.booleans(),
    shutter=st.sampled_from([0.25, 0.5, 1.0]),
    share=st.floats(0, 1),
    part=st.floats(0, 1),
    factor=st.floats(-100, 100),
)
def test_values_are_the_same_to_the_last_bit(
    tmp_path_factory: pytest.TempPathFactory,
    rows: Rows,
    loop: bool,
    shutter: float,
    share: float,
    part: float,
    factor: float,
) -> None:
    """Numbers, colours, places, directions and scales, in frames that need not be whole."""
    count = len(rows) - 1  # one row more than frames
    tracks = (
        f"coloring.offset: {{file: t.csv, column: a, factor: {factor!r}, offset: 0.1}}, "
        "camera.target: {file: t.csv, column: [a, b, c]}, "
        "camera.focus_distance: {file: t.csv, column: a, factor: 0, offset: 2}"
    )
    folder = tmp_path_factory.mktemp("film")
    try:
        scene = film(folder, rows, count, tracks=tracks, loop=str(loop).lower(), shutter=shutter)
    except SceneError:  # the camera would look along its own up direction
        reject()
    frame = min(share * count, count - (0.001 if loop else 1))
    own = alone(scene, frame)
    (folder / "t.csv").unlink()
    first, last = (
        (frame, frame + shutter) if loop else (max(frame - shutter, 0), min(frame + shutter, count - 1))
    )
    for time in (first, last, first + part * (last - first)):
        assert movement_of(own).values(time) == movement_of(scene).values(time)


def test_a_flight_has_its_keys_targets(tmp_path: Path) -> None:
    """A camera's way round its target is decided by where that is at each of the camera's keys."""
    rows = [(0.01 * row, 0.02 * row * row / 50, -0.01 * row) for row in range(50)]
    keys = "{frame: 0, value: [0, -3, 0]}, {frame: 17, value: [2, -2, 1]}, {frame: 49, value: [2, 1, 0.5]}"
    tracks = f"camera.position: {{keys: [{keys}]}}, camera.target: {{file: t.csv, column: [a, b, c]}}"
    scene = film(tmp_path, rows, 50, tracks=tracks, shutter=0.5)
    own = alone(scene, 30)
    for time in (30.0, 30.2, 30.5):
        assert movement_of(own).values(time) == movement_of(scene).values(time)


def test_only_the_scene_of_a_frame_leaves_its_table(tmp_path: Path) -> None:
    scene = film(tmp_path, [(0.1, 0, 0)] * 5, 5)
    assert standing_alone(scene) is scene.animation
    assert standing_alone(load_scene(f"{HEAD}{CAMERA}")) is None
    expression = load_scene(
        f"{HEAD}{CAMERA}animation: {{frames: 3, frame: 1, tracks: {{camera.fov: {{expression: '40 + u'}}}}}}"
    )
    assert standing_alone(expression) is expression.animation


def test_a_blurred_frame_is_made_again_without_the_table(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    rows = [(0.1 * row, 0.02 * row, -2.6 - 0.1 * row) for row in range(6)]
    tracks = "camera.position.1: {file: t.csv, column: c}, material.ambient: {file: t.csv, column: a}"
    film(tmp_path, rows, 6, tracks=tracks, shutter=0.5)
    clf = InProcess(capfd)
    order = ("animate", "s.yaml", "-o", "f#.exr", "--samples", "4")
    assert clf(*order).status == 0
    assert "all 6 frames were there already" in clf(*order, "--resume").err
    wanted = dict(clfractal.frames("s.yaml", samples=4))
    (tmp_path / "t.csv").unlink()
    for number in (0, 3, 5):
        scene = clfractal.load_scene(f"f{number}.exr")
        assert isinstance(scene.animation, Animation)
        again = clfractal.render(scene)
        for channel in ("R", "G", "B", "Z"):
            np.testing.assert_array_equal(again[channel], wanted[number][channel])
        assert again.header["scene"] == wanted[number].header["scene"]
