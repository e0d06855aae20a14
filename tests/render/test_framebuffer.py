"""The framebuffer in memory: tiles in, channels and pictures out; tiles cover a region once, from the centre outwards."""

from __future__ import annotations

import io

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from clfractal.errors import SceneError
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS, check_channels
from clfractal.files.srgb import encode8
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.tiles import TILE, Region, TileGrid

ALL = tuple(CHANNELS)


def pattern(framebuffer: Framebuffer) -> np.ndarray:
    """A different number in every pixel of every channel, shape (channels, height, width)."""
    region = framebuffer.region
    y, x = np.mgrid[region.y : region.bottom, region.x : region.right]
    planes = [(x + 1000.0 * y + 0.25 * index) / 3e5 for index in range(len(framebuffer.channels))]
    return np.array(planes, dtype=np.float32)


def fill(framebuffer: Framebuffer) -> np.ndarray:
    wanted = pattern(framebuffer)
    for index in framebuffer.grid.order_from_center().tolist():
        tile = framebuffer.grid.tile(index)
        top, left = tile.y - framebuffer.region.y, tile.x - framebuffer.region.x
        framebuffer.put(index, wanted[:, top : top + tile.height, left : left + tile.width])
    return wanted


def test_the_table_of_channels() -> None:
    assert " ".join(ALL) == (
        "R G B A Z N.X N.Y N.Z P.X P.Y P.Z iterations steps samples albedo.R albedo.G albedo.B emission.R emission.G"
        " emission.B direct.R direct.G direct.B indirect.R indirect.G indirect.B normal.X normal.Y normal.Z object"
        " material "
        + " ".join(
            f"Crypto{things}0{pair}.{part}"
            for things in ("Object", "Material")
            for pair in range(3)
            for part in "RGBA"
        )
        + " noisy.R noisy.G noisy.B"
    )
    assert DEFAULT_CHANNELS == ("R", "G", "B", "A", "Z")
    colors = [name for name in ALL if CHANNELS[name].kind == "color"]
    assert [name for name in colors if "." not in name] == ["R", "G", "B", "A"]
    assert {name.split(".")[0] for name in colors[4:]} == {
        "albedo",
        "emission",
        "direct",
        "indirect",
        "normal",
        "noisy",
    }


@pytest.mark.parametrize(
    ("names", "message"),
    [
        (["R", "iteration"], r"unknown channel 'iteration'; did you mean 'iterations'\?"),
        (["R", "Z", "R"], "channel 'R' is given twice"),
        ([], "at least one channel"),
    ],
)
def test_wrong_channel_names(names: list[str], message: str) -> None:
    for take in (check_channels, lambda names: Framebuffer(names, (4, 4))):
        with pytest.raises(SceneError, match=message):
            take(names)


def test_an_empty_film_holds_the_fill_values() -> None:
    framebuffer = Framebuffer(ALL, (5, 3))
    for name in ALL:
        assert framebuffer[name].shape == (3, 5)
        assert framebuffer[name].dtype == np.float32
        assert (framebuffer[name] == (np.inf if name == "Z" else 0)).all()
    assert not framebuffer.done.any()


@pytest.mark.parametrize("region", [None, Region(0, 0, 1, 1), Region(31, 33, 70, 40), Region(64, 64, 32, 32)])
def test_tiles_become_channels(region: Region | None) -> None:
    framebuffer = Framebuffer(("R", "Z", "steps"), (150, 100), region)
    wanted = fill(framebuffer)
    assert framebuffer.done.all()
    for plane, name in zip(wanted, framebuffer, strict=True):
        assert np.array_equal(framebuffer[name], plane)


def test_a_tile_of_the_wrong_shape_is_a_mistake() -> None:
    framebuffer = Framebuffer(("R", "Z"), (40, 40))
    for wrong in ((2, 32, 32), (1, 8, 8), (2, 8, 9)):
        with pytest.raises(ValueError, match="shape"):
            framebuffer.put(3, np.zeros(wrong, np.float32))
    with pytest.raises(IndexError):
        framebuffer.put(4, np.zeros((2, 8, 8), np.float32))
    framebuffer.put(3, np.zeros((2, 8, 8), np.float32))
    assert framebuffer.done.tolist() == [False, False, False, True]


def test_a_region_outside_the_picture_is_a_mistake() -> None:
    with pytest.raises(ValueError, match="not inside"):
        Framebuffer(("R",), (40, 40), Region(10, 10, 31, 5))


def test_an_unknown_channel_of_a_film() -> None:
    framebuffer = Framebuffer(("R", "Z"), (4, 4))
    assert "Z" in framebuffer
    assert "G" not in framebuffer
    with pytest.raises(KeyError, match="unknown channel 'G'"):
        framebuffer["G"]


def test_rgb8_is_what_a_png_shows() -> None:
    framebuffer = Framebuffer(("R", "G", "B", "A"), (70, 50), Region(3, 5, 60, 40))
    wanted = fill(framebuffer)
    colors = wanted[:3].transpose(1, 2, 0)
    assert np.array_equal(framebuffer.to_rgb8(), encode8(colors, origin=(3, 5)))
    assert np.array_equal(framebuffer.to_rgb8(exposure=-1), encode8(colors * np.float32(0.5), origin=(3, 5)))
    with pytest.raises(KeyError):
        Framebuffer(("Z",), (4, 4)).to_rgb8()


@pytest.mark.parametrize(("transparent", "mode"), [(False, "RGB"), (True, "RGBA")])
def test_notebooks_show_a_picture(transparent: bool, mode: str) -> None:
    header = {"scene": "version: 1\n", "transparent": transparent}
    framebuffer = Framebuffer(("R", "G", "B", "A"), (70, 50), header=header)
    fill(framebuffer)
    with Image.open(io.BytesIO(framebuffer._repr_png_() or b"")) as image:
        assert image.mode == mode
        assert transparent or np.array_equal(np.asarray(image), framebuffer.to_rgb8())
    assert Framebuffer(("Z",), (4, 4))._repr_png_() is None


def test_repr_tells_size_and_progress() -> None:
    framebuffer = Framebuffer(("R", "Z"), (40, 40))
    assert repr(framebuffer) == "<Framebuffer 40x40, channels R Z, 0% done>"
    framebuffer.put(3, np.zeros((2, 8, 8), np.float32))
    assert repr(framebuffer) == "<Framebuffer 40x40, channels R Z, 25% done>"


regions = st.builds(
    Region, st.integers(0, 200), st.integers(0, 200), st.integers(1, 300), st.integers(1, 300)
)


@given(regions)
def test_every_pixel_is_in_one_tile(region: Region) -> None:
    grid = TileGrid(region)
    covered = np.zeros((region.bottom, region.right), dtype=int)
    for index in range(grid.count):
        tile = grid.tile(index)
        covered[tile.y : tile.y + tile.height, tile.x : tile.x + tile.width] += 1
        assert tile.index == index
        assert 1 <= tile.width <= TILE
        assert tile.x // TILE == (tile.x + tile.width - 1) // TILE
        assert tile.y // TILE == (tile.y + tile.height - 1) // TILE
    inside = covered[region.y :, region.x :]
    assert (inside == 1).all()
    assert covered.sum() == region.pixels


@given(regions)
def test_boxes_are_the_tiles(region: Region) -> None:
    grid = TileGrid(region)
    wanted = [(tile.x, tile.y, tile.width, tile.height) for tile in map(grid.tile, range(grid.count))]
    assert [tuple(box) for box in grid.boxes().tolist()] == wanted
    chosen = list(range(0, grid.count, 3))
    assert [tuple(box) for box in grid.boxes(chosen).tolist()] == wanted[::3]
    # Row by row.
    assert sorted(wanted, key=lambda box: (box[1], box[0])) == wanted


@given(regions)
def test_order_goes_from_the_centre_outwards(region: Region) -> None:
    grid = TileGrid(region)
    order = grid.order_from_center()
    assert sorted(order.tolist()) == list(range(grid.count))
    boxes = grid.boxes()[order].astype(float)
    x = boxes[:, 0] + boxes[:, 2] / 2 - (region.x + region.width / 2)
    y = boxes[:, 1] + boxes[:, 3] / 2 - (region.y + region.height / 2)
    distances = np.hypot(x, y)
    assert (np.diff(distances) >= -1e-9).all()


def test_the_largest_picture() -> None:
    grid = TileGrid(Region(0, 0, 16384, 16384))
    assert grid.count == 262_144
    first = grid.tile(int(grid.order_from_center()[0]))
    assert (first.x, first.y) == (8160, 8160)
    assert grid.tile(grid.count - 1).x == 16384 - TILE


def test_wrong_regions_and_indices() -> None:
    for wrong in ((-1, 0, 1, 1), (0, -1, 1, 1), (0, 0, 0, 1), (0, 0, 1, 0)):
        with pytest.raises(ValueError, match="region"):
            Region(*wrong)
    grid = TileGrid(Region(0, 0, 33, 33))
    for index in (-1, 4):
        with pytest.raises(IndexError):
            grid.tile(index)
