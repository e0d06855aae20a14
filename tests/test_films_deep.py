"""Films that zoom into a place of any depth: even, exact, and with one reference orbit for many frames."""

from __future__ import annotations

from fractions import Fraction
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from PIL import Image

import clfractal
from clfractal.errors import ClfractalError
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from tests.shell import InProcess, works

START = ["0", "0", "0"]
END = [
    "0.3661113824053921475032874780983216",
    "-0.6581940346532352767992043313105555",
    "0.38367727753667079744",
]
DEPTH = 1e12


def zoom(
    frames: int = 24, centers: dict[float, Any] | None = None, tracks: dict[str, Any] | None = None
) -> Scene:
    """A film from the whole set to a place on it; its centre moves as well, unless there are no `centers`."""
    last = frames - 1
    moving = {
        "deep.magnification": {
            "keys": [{"frame": 0, "value": 1}, {"frame": last, "value": DEPTH}],
            "interpolation": "linear",
        }
    }
    if centers is None:
        centers = {0: START, last: END}
    if centers:
        keys = [{"frame": frame, "value": value} for frame, value in centers.items()]
        moving["deep.center"] = {"keys": keys}
    return load_scene(
        {
            "version": 1,
            "formula": {"name": "mandelbulb", "iterations": 34},
            "deep": {"center": START if centers else END, "magnification": 1},
            "camera": {"position": [1.28, -2.34, 1.38], "target": [0, 0, 0]},
            "image": {"width": 96, "height": 54},
            "renderer": {"type": "surface", "max_steps": 4000},
            "animation": {"frames": frames, "tracks": {**moving, **(tracks or {})}},
        }
    )


def exact(center: Any) -> list[Fraction]:
    return [Fraction(part) for part in center]


def test_the_centre_moves_as_the_magnification_lets_it() -> None:
    """One point of the space stays where it is in the picture: that at which an even zoom is aimed."""
    scene, m1 = zoom(), Fraction(DEPTH)
    movement = movement_of(scene)
    start, end = exact(START), exact(END)
    # With c = B + (A - B) k, k = (1/m - 1/m1) / (1 - 1/m1), this is the point p for which (p - c) m is constant.
    aimed = [b + (a - b) * (-1 / m1) / (1 - 1 / m1) for a, b in zip(start, end, strict=True)]
    seen = []
    for frame in (0, 1, 7.5, 15, 22.9, 23):
        deep = movement.scene(frame).deep
        assert deep is not None
        factor = Fraction(deep.magnification)
        seen.append([float((p - c) * factor) for p, c in zip(aimed, exact(deep.center), strict=True)])
    np.testing.assert_allclose(seen, [seen[0]] * len(seen), atol=1e-15)
    values = movement.values(23)
    assert values["deep.center"] == tuple(END)
    assert movement.values(0)["deep.center"] == tuple(START)


@settings(max_examples=30)
@given(depth=st.integers(-300, 300), digits=st.integers(30, 60), frame=st.floats(0, 10))
def test_without_a_zoom_it_goes_straight(depth: int, digits: int, frame: float) -> None:
    ends = [f"0.{'1234567890' * 6}"[: digits + 2], f"{abs(depth)}.5e-3", "-0.25"], ["0.5", "0", "-0.25"]
    track = {
        "keys": [{"frame": 0, "value": ends[0]}, {"frame": 10, "value": ends[1]}],
        "interpolation": "linear",
    }
    scene = zoom(11, {}, {"deep.center": track, "deep.magnification": {"expression": "1e25"}})
    found = exact(movement_of(scene).values(frame)["deep.center"])
    share = Fraction(frame) / 10
    for one, start, end in zip(found, exact(ends[0]), exact(ends[1]), strict=True):
        assert abs(one - (start + (end - start) * share)) < Fraction(1, 10**15)


def test_a_track_of_the_magnification_alone_leaves_the_centre() -> None:
    movement = movement_of(zoom(centers={}))
    places = [movement.scene(frame).deep for frame in range(24)]
    assert {place.center for place in places if place is not None} == {tuple(END)}
    sizes = [place.magnification for place in places if place is not None]
    np.testing.assert_allclose(np.diff(np.log10(sizes)), 12 / 23, rtol=1e-9)


def test_keys_keep_all_digits() -> None:
    scene = zoom()
    again = load_scene(dump_scene(scene))
    assert again == scene
    assert again.animation is not None
    key = (again.animation.tracks["deep.center"].keys or ())[1]
    assert key.texts == tuple(END)
    assert key.values == pytest.approx([0.366, -0.658, 0.384], abs=1e-3)


@pytest.mark.parametrize(
    ("track", "message"),
    [
        ({"keys": [{"frame": 0, "value": ["0", "a", "0"]}]}, "must be a decimal number"),
        ({"keys": [{"frame": 0, "value": ["0", "0"]}]}, "list of 3"),
        ({"keys": [{"frame": 0, "value": 1}]}, "must be a list of 3 numbers"),
        ({"keys": [{"frame": 0, "value": ["9e9", "0", "0"]}]}, "must be from -1,000,000"),
    ],
)
def test_wrong_centres(track: dict[str, Any], message: str) -> None:
    with pytest.raises(ClfractalError, match=message):
        zoom(centers={}, tracks={"deep.center": track})


def test_numbers_in_quotes_are_for_centres_alone() -> None:
    keys = [{"frame": 0, "value": ["0", "0", "1"]}]
    with pytest.raises(ClfractalError, match="must be numbers, without quotes"):
        zoom(tracks={"camera.target": {"keys": keys}})


def test_neighbouring_moments_look_alike() -> None:
    """A fiftieth of a frame apart, some 1 % of the zoom, pictures differ by what 1 % of a zoom changes, at any depth."""
    movement = movement_of(zoom())
    differences = []
    for frame in (2, 5, 8, 11, 14, 17, 20):
        here, there = (clfractal.render(movement.scene(frame + by)) for by in (0.0, 0.02))
        one, other = (np.stack([each[name] for name in "RGB"]).clip(0, 1) for each in (here, there))
        differences.append(float(np.abs(one - other).mean()))
    assert max(differences) < 0.1
    assert max(differences) < 4 * float(np.median(differences))


def test_the_shell_renders_such_a_film(here: Path, clf: InProcess) -> None:
    (here / "scene.yaml").write_text(dump_scene(zoom()))
    works(clf("animate", "scene.yaml", "-o", "f_####.png", "--size", "48x27"))
    files = sorted(here.glob("f_*.png"))
    assert len(files) == 24
    last = clfractal.load_scene(files[-1])
    assert last.deep is not None
    assert (last.deep.center, last.deep.magnification) == (tuple(END), DEPTH)
    pictures = [np.asarray(Image.open(file).convert("RGB"), float) for file in files]
    changes = [float(np.abs(one - other).mean()) for one, other in pairwise(pictures)]
    assert min(changes) > 1  # each frame shows something new
    assert max(changes) < 120


def test_frames_share_orbits() -> None:
    from clfractal.formulas import deep

    asked: list[Any] = []
    movement = movement_of(zoom(centers={}))
    for frame in range(24):
        asked.append(deep.begun_orbits(movement.scene(frame).chain))
    assert len({id(found) for found in asked}) <= 2


def test_a_centre_of_the_command_line_keeps_its_digits(clf: InProcess, here: Path) -> None:
    place = ",".join(f'"{each}"' for each in END)
    values = ("--set", f"deep.center=[{place}]", "--set", "deep.magnification=1e6")
    works(clf("render", "scene.yaml", "-o", "a.png", "--size", "16x16", *values))
    found = clfractal.load_scene(here / "a.png").deep
    assert found is not None
    assert (found.center, found.magnification) == (tuple(END), 1e6)


def test_views_of_the_whole_set_are_not_looked_for_in_a_place() -> None:
    with pytest.raises(ClfractalError, match="deep: shows one place"):
        clfractal.find(zoom())
