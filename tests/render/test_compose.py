"""The compositor against pixel-by-pixel loops, and views in their places against one paste, whole and in regions."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.errors import SceneError
from clfractal.images.compose import Composed, compose, composed_channels, eye_regions
from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.modes import eye_size, picture_size
from clfractal.images.paste import Pasted
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiled import Picture
from clfractal.images.tiles import TILE, Region
from clfractal.scene.layout import Place
from tests.render.eyes import CHANNELS, COMPOSED, PICKED, PLACED, eyes, filled, framebuffers, stereo


def by_loops(mode: str, swap: bool, left: np.ndarray, right: np.ndarray, x: int, y: int) -> tuple[Any, bool]:
    """The pixel (x, y) of the finished picture, and whether it lies in the second eye's place."""
    height, width = left.shape
    second = {
        "split": x >= width,
        "split_half": x >= width,
        "over_under": y >= height,
        "over_under_half": y >= height,
        "rows": y % 2 == 1,
        "columns": x % 2 == 1,
        "checkerboard": (x + y) % 2 == 1,
        "anaglyph_chessboard": (x + y) % 2 == 1,
    }[mode]
    beside, below = mode.startswith("split"), mode.startswith("over_under")
    from_x, from_y = (width if second and beside else 0), (height if second and below else 0)
    right_eye = second != swap
    return (right if right_eye else left)[y - from_y, x - from_x], second


@pytest.mark.parametrize("swap", [False, True])
@pytest.mark.parametrize("mode", [*PLACED, *PICKED])
def test_modes_pixel_by_pixel(mode: str, swap: bool) -> None:
    scene = stereo(mode, swap=swap, colors=[[0.75, 0.5, 0.0], [0.25, 1.0, 0.125]])
    image = (46, 38)
    planes = eyes(eye_size(scene, image))
    composed = Composed(scene, image, *framebuffers(scene, image, None, planes))
    framebuffer = in_memory(composed)
    width, height = picture_size(scene, image)
    assert (framebuffer.width, framebuffer.height) == composed.display == (width, height)
    assert framebuffer.channels == CHANNELS
    for name in CHANNELS:
        for y in range(height):
            for x in range(width):
                found, second = by_loops(mode, swap, planes[0][name], planes[1][name], x, y)
                if mode == "anaglyph_chessboard" and name in "RGB":
                    found *= np.float32(scene.colors[int(second)]["RGB".index(name)])
                assert framebuffer[name][y, x] == found, (name, x, y)


@pytest.mark.parametrize(
    ("mode", "size", "eye"),
    [
        ("left", (40, 30), (40, 30)),
        ("right", (40, 30), (40, 30)),
        ("pair", (40, 30), (40, 30)),
        ("multi_view", (40, 30), (40, 30)),
        ("split", (80, 30), (40, 30)),
        ("over_under", (40, 60), (40, 30)),
        ("split_half", (40, 30), (20, 30)),
        ("over_under_half", (40, 30), (40, 15)),
        ("rows", (40, 30), (40, 30)),
        ("columns", (40, 30), (40, 30)),
        ("checkerboard", (40, 30), (40, 30)),
        ("anaglyph_chessboard", (40, 30), (40, 30)),
        ("anaglyph", (40, 30), (40, 30)),
    ],
)
def test_sizes(mode: str, size: tuple[int, int], eye: tuple[int, int]) -> None:
    assert picture_size(stereo(mode), (40, 30)) == size
    assert eye_size(stereo(mode), (40, 30)) == eye
    # The thesis's chessboard: the left eye's pixels times red, the right one's times cyan.
    np.testing.assert_array_equal(stereo(mode).colors, [[1, 0, 0], [0, 1, 1]])


def test_odd_sizes_cannot_be_halved() -> None:
    assert picture_size(stereo("split_half"), (40, 31)) == (40, 31)
    assert picture_size(stereo("over_under_half"), (41, 30)) == (41, 30)
    for mode, image in (("split_half", (41, 30)), ("over_under_half", (40, 31))):
        with pytest.raises(ValueError, match="cannot be halved"):
            picture_size(stereo(mode), image)


@settings(max_examples=300, deadline=None, derandomize=True)
@given(st.data())
def test_a_region_is_the_same_part_of_the_whole(data: st.DataObject) -> None:
    mode = data.draw(st.sampled_from(COMPOSED))
    scene = stereo(mode, swap=data.draw(st.booleans()))
    wide, high = scene.squeeze
    image = (data.draw(st.integers(1, 50)) * wide, data.draw(st.integers(1, 70)) * high)
    width, height = picture_size(scene, image)
    x, y = data.draw(st.integers(0, width - 1)), data.draw(st.integers(0, height - 1))
    region = Region(x, y, data.draw(st.integers(1, width - x)), data.draw(st.integers(1, height - y)))
    planes = eyes(eye_size(scene, image))
    whole = in_memory(Composed(scene, image, *framebuffers(scene, image, None, planes)))
    part = Composed(scene, image, *framebuffers(scene, image, region, planes), region)
    check_bands(part, whole, (width, height), region)


def check_bands(
    picture: Picture, whole: Framebuffer | Mapping[str, np.ndarray], size: tuple[int, int], region: Region
) -> None:
    """They are the region's part of the whole, from top to bottom, however often they are read."""
    assert (picture.display, picture.region) == (size, region)
    for _ in range(2):
        row = region.y
        for first, band in picture.bands():
            assert first == row
            assert tuple(band) == picture.channels
            rows = band["R"].shape[0]
            assert 1 <= rows <= TILE
            for name, plane in band.items():
                assert plane.dtype == np.float32
                np.testing.assert_array_equal(plane, whole[name][row : row + rows, region.x : region.right])
            row += rows
        assert row == region.bottom


def test_eyes_that_a_region_does_not_need() -> None:
    for mode, region, left, right in (
        ("split", Region(0, 5, 40, 9), Region(0, 5, 40, 9), None),
        ("split", Region(40, 0, 1, 1), None, Region(0, 0, 1, 1)),
        ("split", Region(39, 2, 3, 4), Region(39, 2, 1, 4), Region(0, 2, 2, 4)),
        ("split_half", Region(15, 0, 10, 30), Region(15, 0, 5, 30), Region(0, 0, 5, 30)),
        ("over_under", Region(3, 20, 5, 20), Region(3, 20, 5, 10), Region(3, 0, 5, 10)),
        ("over_under_half", Region(0, 15, 40, 15), None, Region(0, 0, 40, 15)),
        ("rows", Region(0, 4, 40, 1), Region(0, 4, 40, 1), None),
        ("rows", Region(0, 5, 40, 1), None, Region(0, 5, 40, 1)),
        ("columns", Region(7, 0, 1, 30), None, Region(7, 0, 1, 30)),
        ("checkerboard", Region(3, 4, 1, 1), None, Region(3, 4, 1, 1)),
        ("checkerboard", Region(3, 4, 2, 1), Region(3, 4, 2, 1), Region(3, 4, 2, 1)),
        ("anaglyph", Region(3, 4, 1, 1), Region(3, 4, 1, 1), Region(3, 4, 1, 1)),
        ("left", Region(3, 4, 5, 6), Region(3, 4, 5, 6), None),
        ("right", Region(3, 4, 5, 6), None, Region(3, 4, 5, 6)),
        ("multi_view", Region(3, 4, 5, 6), Region(3, 4, 5, 6), Region(3, 4, 5, 6)),
    ):
        assert eye_regions(stereo(mode), (40, 30), region) == {"left": left, "right": right}, (mode, region)
        same = mode in ("left", "right", "multi_view")
        exchanged = {"left": left, "right": right} if same else {"left": right, "right": left}
        assert eye_regions(stereo(mode, swap=True), (40, 30), region) == exchanged, (mode, region)
    with pytest.raises(ValueError, match="not inside"):
        eye_regions(stereo("rows"), (40, 30), Region(0, 0, 41, 30))


def test_an_anaglyph_has_colours_and_coverage_only() -> None:
    scene = stereo("anaglyph", method="color")
    left, right = eyes((12, 9))
    found = compose(scene, left, right)
    exchanged = compose(stereo("anaglyph", method="color", swap=True), right, left)
    wanted = {"R": left["R"], "G": right["G"], "B": right["B"], "A": np.maximum(left["A"], right["A"])}
    for each in (found, exchanged):
        np.testing.assert_equal(each, wanted)
    assert composed_channels(scene, ("Z", "B", "G", "R")) == ("B", "G", "R")
    for mode in ("anaglyph", "anaglyph_chessboard"):
        with pytest.raises(
            SceneError, match=rf"output\.channels: {mode} needs the channels R, G, B; G, B not among"
        ):
            composed_channels(stereo(mode), ("R", "Z"))


def test_odd_numbers_go_through() -> None:
    odd = np.array([[np.inf, -np.inf, np.nan, 0.0]], np.float32)
    planes = dict.fromkeys(("R", "G", "B", "A", "Z"), odd)
    found = compose(stereo("anaglyph_chessboard"), planes, planes)
    assert found["Z"].tobytes() == odd.tobytes()
    # A filter stops all of a primary, however light it is.
    assert found["R"][0].tolist() == [np.inf, 0, pytest.approx(np.nan, nan_ok=True), 0]
    assert found["G"][0].tolist() == [0, -np.inf, 0, 0]
    for name, plane in compose(stereo("anaglyph"), planes, planes).items():
        assert name == "A" or np.isfinite(plane).all()


def test_an_eye_alone_is_passed_on_as_it_is() -> None:
    cameras = {"worldToCamera": np.eye(4), "view": "right", "scene": "version: 1\n"}
    left, right = eyes((33, 34))
    framebuffer = filled(Framebuffer(CHANNELS, (33, 34), header=cameras), right)
    shown = Composed(stereo("right", swap=True), (33, 34), None, framebuffer)
    assert shown.header.keys() == cameras.keys()
    for name in CHANNELS:
        assert np.array_equal(in_memory(shown)[name], right[name])
    # The other eye's picture is not even looked at.
    other = filled(Framebuffer(CHANNELS, (33, 34)), left)
    assert np.array_equal(in_memory(Composed(stereo("right"), (33, 34), other, framebuffer))["R"], right["R"])


def test_headers_tell_what_both_pictures_do() -> None:
    common = {"scene": "version: 1\n", "device": "PoCL", "transparent": True}
    headers = [
        {
            **common,
            "worldToCamera": np.eye(4),
            "worldToNDC": np.eye(4),
            "view": view,
            "seconds": seconds,
            "tileDevices": "1*1",
        }
        for view, seconds in (("left", 1.0), ("right", 2.0))
    ]
    left, right = (Framebuffer(CHANNELS, (8, 8), header=header) for header in headers)
    composed = Composed(stereo("rows"), (8, 8), left, right, header={"seconds": 3.0})
    assert composed.header == {**common, "seconds": 3.0}


def test_stores_that_do_not_fit_are_mistakes() -> None:
    scene, image = stereo("split"), (20, 10)
    left, right = Framebuffer(CHANNELS, image), Framebuffer(CHANNELS, image)
    small = Framebuffer(CHANNELS, image, Region(0, 0, 20, 9))
    apart = "keeps the two eyes' pictures apart"
    mistakes: list[tuple[str, Callable[[], Any]]] = [
        ("right eye's picture must hold", lambda: Composed(scene, image, left, None)),
        ("left eye's picture must hold", lambda: Composed(scene, image, small, right)),
        ("same channels", lambda: Composed(scene, image, left, Framebuffer(("R",), image))),
        (apart, lambda: Composed(stereo("pair"), image, left, right)),
        (apart, lambda: Composed(stereo("multi_view"), image, left, right)),
        (apart, lambda: compose(stereo("pair"), {}, {})),
        (apart, lambda: compose(stereo("multi_view"), {}, {})),
    ]
    for message, make in mistakes:
        with pytest.raises(ValueError, match=message):
            make()


Planes = dict[str, npt.NDArray[np.float32]]

FILL = {"R": 0.25, "A": 1.0, "Z": np.inf}
FILLED = tuple(FILL)


def planes_of(place: Place, seed: int) -> Planes:
    """A view's whole picture: numbers that no other has."""
    numbers = np.random.default_rng(seed).random((len(FILLED), place.height, place.width), dtype=np.float32)
    return dict(zip(FILLED, numbers + np.float32(seed), strict=True))


def needed(place: Place, region: Region) -> Region | None:
    """The part of a view that a region of the whole shows, in the view's own pixels, pixel by pixel."""
    columns = [x for x in range(place.width) if region.x <= place.x + x < region.right]
    rows = [y for y in range(place.height) if region.y <= place.y + y < region.bottom]
    if not columns or not rows:
        return None
    return Region(columns[0], rows[0], len(columns), len(rows))


def pasted(places: list[Place], size: tuple[int, int], region: Region) -> Pasted:
    """Of framebuffers that hold what the region shows of each view and nothing else."""
    stores: list[Picture] = []
    shown = []
    for seed, place in enumerate(places):
        part = needed(place, region)
        if part is not None:
            stores.append(
                filled(Framebuffer(FILLED, (place.width, place.height), part), planes_of(place, seed))
            )
            shown.append(place)
    return Pasted(stores, shown, size, region, FILL)


def by_numpy(places: list[Place], size: tuple[int, int]) -> Planes:
    """The whole picture at once: later views cover earlier ones."""
    whole = {name: np.full(size[::-1], value, np.float32) for name, value in FILL.items()}
    for seed, place in enumerate(places):
        for name, plane in planes_of(place, seed).items():
            whole[name][place.y : place.y + place.height, place.x : place.x + place.width] = plane
    return whole


def check(places: list[Place], size: tuple[int, int], region: Region) -> None:
    picture = pasted(places, size, region)
    assert picture.channels == FILLED
    check_bands(picture, by_numpy(places, size), size, region)


@st.composite
def pastes(draw: st.DrawFn) -> tuple[list[Place], tuple[int, int], Region]:
    """Up to five views anywhere in a picture of some tiles, which may cover each other, and a region of it."""
    size = (draw(st.integers(1, 120)), draw(st.integers(1, 120)))

    def part() -> tuple[int, int, int, int]:
        x, y = draw(st.integers(0, size[0] - 1)), draw(st.integers(0, size[1] - 1))
        return x, y, draw(st.integers(1, size[0] - x)), draw(st.integers(1, size[1] - y))

    places = [Place(*part()) for _ in range(draw(st.integers(0, 5)))]
    return places, size, Region(*part())


@given(pastes())
def test_any_views_in_any_region(drawn: tuple[list[Place], tuple[int, int], Region]) -> None:
    check(*drawn)


def test_headers_tell_what_all_views_do_and_the_time_of_all() -> None:
    places = [Place(0, 0, 4, 4), Place(4, 0, 4, 4)]
    headers = [
        {
            "scene": "version: 1\n",
            "worldToCamera": np.eye(4),
            "seconds": seconds,
            "view": view,
            "tileDevices": "1*2",
        }
        for seconds, view in ((1.5, "left"), (2.0, "right"))
    ]
    stores = [Framebuffer(FILLED, (4, 4), header=header) for header in headers]
    picture = Pasted(stores, places, (8, 4), Region(0, 0, 8, 4), FILL, {"version": "0.1.0"})
    np.testing.assert_array_equal(picture.header.pop("worldToCamera"), np.eye(4))
    assert picture.header == {"scene": "version: 1\n", "version": "0.1.0", "seconds": 3.5}
    assert Pasted([], [], (8, 4), Region(0, 0, 8, 4), FILL).header == {"seconds": 0}


def test_views_on_disk_need_memory_for_some_rows(tmp_path: Path) -> None:
    """Of two views, each of 4 MiB a channel, one above the other's lower half."""
    size, high = (512, 3072), 2048
    places = [Place(0, 0, 512, high), Place(0, 1024, 512, high)]
    region = Region(0, 0, *size)
    stores = []
    for seed, place in enumerate(places):
        framebuffer = JournalFramebuffer(
            tmp_path / f"{seed}.partial", {}, FILLED, (place.width, place.height)
        )
        stores.append(filled(framebuffer, planes_of(place, seed)))
    disk = Pasted(stores, places, size, region, FILL)
    tracemalloc.start()
    for _ in disk.bands():
        pass
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 2e6
    assert in_memory(disk)["R"].shape == size[::-1]
    for store in stores:
        store.discard()
