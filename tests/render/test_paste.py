"""Views put into their places, a few rows at a time, against one paste in NumPy."""

from __future__ import annotations

import tracemalloc
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.images.framebuffer import Framebuffer, in_memory
from clfractal.images.paste import Pasted
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiled import Picture
from clfractal.images.tiles import TILE, Region
from clfractal.scene.layout import Place
from tests.render.eyes import filled

Planes = dict[str, npt.NDArray[np.float32]]

FILL = {"R": 0.25, "A": 1.0, "Z": np.inf}
CHANNELS = tuple(FILL)


def planes_of(place: Place, seed: int) -> Planes:
    """A view's whole picture: numbers that no other has."""
    numbers = np.random.default_rng(seed).random((len(CHANNELS), place.height, place.width), dtype=np.float32)
    return dict(zip(CHANNELS, numbers + np.float32(seed), strict=True))


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
                filled(Framebuffer(CHANNELS, (place.width, place.height), part), planes_of(place, seed))
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
    """Its bands are the region's part of the whole, from top to bottom, however often they are read."""
    picture, whole = pasted(places, size, region), by_numpy(places, size)
    assert (picture.display, picture.region, picture.channels) == (size, region, CHANNELS)
    for _ in range(2):
        row = region.y
        for first, band in picture.bands():
            assert first == row
            assert tuple(band) == CHANNELS
            rows = band["R"].shape[0]
            assert 1 <= rows <= TILE
            for name, plane in band.items():
                assert plane.dtype == np.float32
                np.testing.assert_array_equal(plane, whole[name][row : row + rows, region.x : region.right])
            row += rows
        assert row == region.bottom


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


LAYOUTS = {
    # The views of a row, with gaps; rows of views whose tiles do not lie on the picture's.
    "row": ((91, 50), [Place(0, 0, 28, 50), Place(31, 0, 28, 50), Place(62, 0, 29, 50)]),
    "grid": (
        (80, 90),
        [Place(0, 0, 39, 43), Place(41, 0, 39, 43), Place(0, 47, 39, 43), Place(41, 47, 39, 43)],
    ),
    "inset": ((91, 50), [Place(0, 0, 91, 50), Place(64, 2, 22, 26)]),
    "covered": ((70, 70), [Place(10, 10, 20, 20), Place(0, 0, 70, 70)]),
    "one over the other": (
        (100, 100),
        [Place(0, 33, 100, 40), Place(20, 1, 50, 97), Place(40, 40, 1, 1), Place(21, 64, 40, 36)],
    ),
    "nothing": ((33, 65), []),
}


@pytest.mark.parametrize(
    "part", [(0, 0, 1, 1), (0.1, 0.3, 0.8, 0.6), (0.34, 0, 0.02, 1), (0.95, 0.9, 0.05, 0.1)]
)
@pytest.mark.parametrize("name", LAYOUTS)
def test_layouts_and_regions(name: str, part: tuple[float, float, float, float]) -> None:
    (width, height), places = LAYOUTS[name]
    left, top = int(part[0] * width), int(part[1] * height)
    region = Region(left, top, max(int(part[2] * width), 1), max(int(part[3] * height), 1))
    check(places, (width, height), region)


def test_headers_tell_what_all_views_do_and_the_time_of_all() -> None:
    places = [Place(0, 0, 4, 4), Place(4, 0, 4, 4)]
    headers = [
        {"scene": "version: 1\n", "worldToCamera": np.eye(4), "seconds": 1.5, "view": "left"},
        {"scene": "version: 1\n", "worldToCamera": np.eye(4), "seconds": 2.0, "view": "right"},
    ]
    stores = [Framebuffer(CHANNELS, (4, 4), header=header) for header in headers]
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
            tmp_path / f"{seed}.partial", {}, CHANNELS, (place.width, place.height)
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
