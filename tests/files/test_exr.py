"""OpenEXR files, read back with the library's other interface (`OpenEXR.File`); damaged ones are told in a line each."""

from __future__ import annotations

import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import FileError
from clfractal.files import exr
from clfractal.files.channels import CHANNELS, VIEWS, in_view, without_view
from clfractal.files.exr import read_exr, to_half, write_exr
from clfractal.files.exr_header import MAGIC, Attribute, read_header, read_scene_text
from tests.calls import failure
from tests.files.limits import rewrite

WORLD_TO_CAMERA = np.arange(16, dtype=np.float32).reshape(4, 4) / 7


def planes(height: int, width: int, names: str = "RGBAZ") -> dict[str, np.ndarray]:
    source = np.random.default_rng(3)
    return {name: source.random((height, width), dtype=np.float32) for name in names}


def bands(whole: Mapping[str, np.ndarray], rows: int = 32) -> Iterator[dict[str, np.ndarray]]:
    for first in range(0, len(next(iter(whole.values()))), rows):
        yield {name: plane[first : first + rows] for name, plane in whole.items()}


def write(
    path: Path, whole: Mapping[str, np.ndarray], *, rows: int = 32, half: str = "RGBA", **header: Any
) -> None:
    height, width = next(iter(whole.values())).shape
    write_exr(
        path,
        bands(whole, rows),
        display=(width, height),
        region=(0, 0, width, height),
        channels=list(whole),
        half=half,
        header=header,
    )


@pytest.mark.parametrize("rows", [1, 7, 16, 32, 1000])
def test_half_and_float_channels_come_back(tmp_path: Path, rows: int) -> None:
    whole = planes(300, 37)
    write(tmp_path / "a.exr", whole, rows=rows)
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        found = {name: channel.pixels for name, channel in file.channels().items()}
    assert sorted(found) == sorted("RGBAZ")
    for name in "RGBA":
        assert found[name].dtype == np.float16
        assert np.array_equal(found[name], whole[name].astype(np.float16))
    assert found["Z"].dtype == np.float32
    assert np.array_equal(found["Z"], whole["Z"])


def test_names_with_dots_and_single_channels(tmp_path: Path) -> None:
    whole = {name: np.full((5, 4), index, np.float32) for index, name in enumerate(["N.X", "N.Y", "steps"])}
    write(tmp_path / "a.exr", whole, half="")
    found, _ = read_exr(tmp_path / "a.exr")
    assert {name: float(plane[0, 0]) for name, plane in found.items()} == {"N.X": 0, "N.Y": 1, "steps": 2}
    write(tmp_path / "b.exr", {"Z": whole["steps"]})
    assert list(read_exr(tmp_path / "b.exr")[0]) == ["Z"]


def test_region_is_the_data_window_in_the_full_display_window(tmp_path: Path) -> None:
    whole = planes(20, 30)
    path = tmp_path / "a.exr"
    write_exr(path, bands(whole), display=(200, 100), region=(40, 50, 30, 20), channels="RGBAZ", half="")
    with OpenEXR.File(str(path), separate_channels=True) as file:
        header = file.header()
        assert [corner.tolist() for corner in header["dataWindow"]] == [[40, 50], [69, 69]]
        assert [corner.tolist() for corner in header["displayWindow"]] == [[0, 0], [199, 99]]
        assert np.array_equal(file.channels()["R"].pixels, whole["R"])


def test_attributes_are_of_the_standard_types(tmp_path: Path) -> None:
    write(
        tmp_path / "a.exr",
        planes(4, 4),
        clfractal="version: 1\n# Grüße\n",
        clfractalSeconds=1.5,
        empty="",
        worldToCamera=WORLD_TO_CAMERA,
        worldToNDC=(WORLD_TO_CAMERA + 1).tolist(),
    )
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        header = dict(file.header())
    ours = read_exr(tmp_path / "a.exr")[1]
    for found in (header, ours):
        assert found["clfractal"] == "version: 1\n# Grüße\n"
        assert found["clfractalSeconds"] == 1.5
        assert found["empty"] == ""
        assert np.array_equal(found["worldToCamera"], WORLD_TO_CAMERA)
        assert np.array_equal(found["worldToNDC"], WORLD_TO_CAMERA + 1)
        assert found["chromaticities"] == pytest.approx((0.64, 0.33, 0.3, 0.6, 0.15, 0.06, 0.3127, 0.329))
    assert header["compression"] == OpenEXR.ZIP_COMPRESSION


def test_a_matrix_of_another_shape_is_a_mistake(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="4 x 4"):
        write(tmp_path / "a.exr", planes(4, 4), worldToCamera=np.eye(3))
    assert not list(tmp_path.iterdir())


def test_half_limits_colours_and_keeps_infinite_depth() -> None:
    values = np.array([[1e9, -1e9, 65504, 65519, 65520, np.inf, -np.inf, 1e-9, 0.5]], dtype=np.float32)
    assert to_half(values, data=False)[0].tolist() == [
        65504,
        -65504,
        65504,
        65504,
        65504,
        65504,
        -65504,
        0,
        0.5,
    ]
    with_infinite = to_half(values, data=True)[0].tolist()
    assert with_infinite == [65504, -65504, 65504, 65504, 65504, np.inf, -np.inf, 0, 0.5]


@pytest.mark.parametrize("half", ["RGBAZ", ""])
def test_extreme_values_in_a_file(tmp_path: Path, half: str) -> None:
    whole = planes(3, 3)
    whole["R"][0, 0] = 1e30
    whole["Z"][:] = np.inf
    write(tmp_path / "a.exr", whole, half=half)
    found, _ = read_exr(tmp_path / "a.exr")
    assert found["R"][0, 0] == (65504 if half else np.float32(1e30))
    assert np.isposinf(found["Z"]).all()


def test_an_error_while_rendering_leaves_the_earlier_file(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")

    def interrupted() -> Iterator[dict[str, np.ndarray]]:
        yield planes(32, 10)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_exr(path, interrupted(), display=(10, 64), region=(0, 0, 10, 64), channels="RGBAZ", half="")
    assert path.read_bytes() == b"old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["a.exr"]


def test_missing_rows_are_noticed(tmp_path: Path) -> None:
    with pytest.raises((ValueError, FileError)):
        write_exr(
            tmp_path / "a.exr",
            bands(planes(8, 8)),
            display=(8, 9),
            region=(0, 0, 8, 9),
            channels="RGBAZ",
            half="",
        )
    assert not list(tmp_path.iterdir())


def test_tiled_files_are_refused(tmp_path: Path) -> None:
    header = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    with OpenEXR.File(header, {"Z": np.zeros((40, 40), np.float32)}) as file:
        file.write(str(tmp_path / "a.exr"))
    with pytest.raises(FileError, match="holds tiles"):
        read_exr(tmp_path / "a.exr")


def test_a_library_that_keeps_quiet_about_lost_bytes_is_found_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")
    write_pixels = exr._write_pixels

    def lossy(shown: Path, beside: Path, *arguments: Any) -> None:
        write_pixels(shown, beside, *arguments)
        with open(beside, "r+b") as stream:
            stream.truncate(beside.stat().st_size - 1)

    monkeypatch.setattr(exr, "_write_pixels", lossy)
    with pytest.raises(FileError, match=r"a\.exr: cannot be written: the library left it incomplete"):
        write(path, planes(40, 40))
    assert path.read_bytes() == b"old"


# --- several views ---


def view_of(name: str, views: tuple[str, ...] = VIEWS) -> str:
    """The view that a reader takes a channel for: "Storing Multi-View Images in OpenEXR Files", "Channel Naming"."""
    parts = name.split(".")
    if len(parts) == 1:
        return views[0]
    return parts[-2] if parts[-2] in views else ""


@pytest.mark.parametrize("name", CHANNELS)
def test_readers_find_every_channel_in_its_view(name: str) -> None:
    names = [in_view(name, view) for view in VIEWS]
    assert [view_of(found) for found in names] == ["left", "right"]
    assert [without_view(found) for found in names] == [name, name]
    assert without_view(name) == name
    assert max(map(len, names)) <= 31  # the longest that readers of the first version take


def test_names() -> None:
    assert [in_view(name, "left") for name in ("R", "N.X", "a.b.c")] == ["R", "N.left.X", "a.b.left.c"]
    assert [in_view(name, "right") for name in ("R", "N.X", "a.b.c")] == [
        "right.R",
        "N.right.X",
        "a.b.right.c",
    ]
    # A view is looked for before the last part of a name, and nowhere else.
    assert [without_view(name) for name in ("right", "right.N.X", "N.left")] == [
        "right",
        "right.N.X",
        "N.left",
    ]


def write_views(path: Path, **header: object) -> dict[str, np.ndarray]:
    names = [in_view(name, view) for view in VIEWS for name in ("R", "Z", "N.X")]
    source = np.random.default_rng(4)
    planes = {name: source.random((20, 30), dtype=np.float32) for name in names}
    planes["right.Z"][2, 3] = np.inf
    planes["right.R"][2, 3] = np.inf
    write_exr(
        path,
        [planes],
        display=(30, 20),
        region=(0, 0, 30, 20),
        channels=names,
        half={"R", "right.R", "right.Z"},
        header={"multiView": VIEWS, **header},
    )
    return planes


def test_the_library_reads_both_views(tmp_path: Path) -> None:
    camera = np.arange(16, dtype=np.float32).reshape(4, 4)
    planes = write_views(tmp_path / "a.exr", **{"clfractal": "version: 1\n", "right.worldToCamera": camera})
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        header = dict(file.header())
        found = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
        assert len(file.parts) == 1
    assert header["multiView"] == ["left", "right"]
    assert header["clfractal"] == "version: 1\n"
    assert np.array_equal(header["right.worldToCamera"], camera)
    assert sorted(found) == ["N.left.X", "N.right.X", "R", "Z", "right.R", "right.Z"]
    for name in ("N.left.X", "N.right.X", "Z"):
        assert np.array_equal(found[name], planes[name])
    # Infinite depth stays infinite in every view, infinite light does not.
    assert found["right.Z"].dtype == np.float16
    assert found["right.Z"][2, 3] == np.inf
    assert found["right.R"][2, 3] == 65504


def test_our_reader_knows_lists_of_texts(tmp_path: Path) -> None:
    write_views(tmp_path / "a.exr", names=["", "Grüße"], none=[])
    values = read_header(tmp_path / "a.exr").values()
    assert values["multiView"] == ("left", "right")
    assert values["names"] == ("", "Grüße")
    assert values["none"] == ()
    assert sorted(read_exr(tmp_path / "a.exr")[0]) == sorted(read_header(tmp_path / "a.exr").channels)


def test_a_text_is_no_list_of_texts(tmp_path: Path) -> None:
    write_views(tmp_path / "a.exr", view="right")
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert file.header()["view"] == "right"


@given(st.binary(max_size=60) | st.lists(st.binary(max_size=9)).map(b"\x02\0\0\0".join))
def test_damaged_lists_of_texts_do_no_harm(data: bytes) -> None:
    found = Attribute("stringvector", data, 0).value()
    assert isinstance(found, tuple)
    whole = b"".join(struct.pack("<i", len(text)) + text for text in (b"left", b"", b"right"))
    assert Attribute("stringvector", whole, 0).value() == ("left", "", "right")
    assert Attribute("stringvector", whole + struct.pack("<i", -1) + data, 0).value() == ("left", "", "right")


# --- damaged files and their headers ---


SCENE = "version: 1\nformula: {name: hast}\n# Grüße\n"


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> bytes:
    """A file of ours with several chunks."""
    path = tmp_path_factory.mktemp("exr") / "a.exr"
    source = np.random.default_rng(1)
    band = {name: source.random((50, 9), dtype=np.float32) for name in "RZ"}
    header = {"clfractal": SCENE, "worldToCamera": np.eye(4)}
    write_exr(path, [band], display=(9, 50), region=(0, 0, 9, 50), channels="RZ", half="R", header=header)
    return path.read_bytes()


def refusal(path: Path, content: bytes) -> str:
    rewrite(path, content)
    error = failure(FileError, read_scene_text, path)
    assert error.where.file == str(path)
    return error.message


def test_scene_comes_back(tmp_path: Path, whole: bytes) -> None:
    (tmp_path / "a.exr").write_bytes(whole)
    assert read_scene_text(tmp_path / "a.exr") == SCENE
    values = read_header(tmp_path / "a.exr").values()
    assert values["dataWindow"] == (0, 0, 8, 49)
    assert values["screenWindowCenter"] == (0, 0)
    assert values["pixelAspectRatio"] == 1


def test_foreign_pictures_have_no_scene(tmp_path: Path) -> None:
    pixels = {"Z": np.zeros((40, 40), np.float32)}
    tiled = {"type": OpenEXR.tiledimage, "tiles": OpenEXR.TileDescription()}
    for compression in (OpenEXR.NO_COMPRESSION, OpenEXR.PIZ_COMPRESSION, OpenEXR.RLE_COMPRESSION):
        for kind in ({"type": OpenEXR.scanlineimage}, tiled):
            with OpenEXR.File({**kind, "compression": compression}, pixels) as file:
                file.write(str(tmp_path / "a.exr"))
            assert read_scene_text(tmp_path / "a.exr") is None


def test_a_scene_of_another_type_is_none(tmp_path: Path, whole: bytes) -> None:
    old = b"clfractal\0string\0"
    assert old in whole
    (tmp_path / "a.exr").write_bytes(whole.replace(old, b"clfractal\0strinG\0"))
    assert read_scene_text(tmp_path / "a.exr") is None


def attribute(name: bytes, kind: bytes, data: bytes, length: int | None = None) -> bytes:
    size = len(data) if length is None else length
    return name + b"\0" + kind + b"\0" + struct.pack("<i", size) + data


def test_hostile_headers(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    start = MAGIC + struct.pack("<I", 2)
    assert refusal(path, b"v/1\x02" + bytes(100)) == "is not an OpenEXR file"
    assert refusal(path, MAGIC + struct.pack("<I", 3)).startswith("is an OpenEXR file of version 3")
    assert refusal(path, start + b"n" * 1000) == "is damaged: an endless name"
    for length in (-1, 2**31 - 1):
        assert refusal(path, start + attribute(b"a", b"string", b"", length)).startswith("is damaged")
    many = b"".join(attribute(b"%d" % index, b"int", b"1234") for index in range(2000))
    assert refusal(path, start + many + b"\0").startswith("is damaged")
    assert refusal(path, start + b"\0").startswith("is damaged: its header lacks")


def picture(box: tuple[int, int, int, int], compression: int, channels: bytes) -> bytes:
    return (
        MAGIC
        + struct.pack("<I", 2)
        + attribute(b"channels", b"chlist", channels)
        + attribute(b"compression", b"compression", bytes([compression]))
        + attribute(b"dataWindow", b"box2i", struct.pack("<4i", *box))
        + b"\0"
        + bytes(1000)
    )


def test_impossible_pictures(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    one = b"Z\0" + struct.pack("<iIii", 2, 0, 1, 1) + b"\0"
    huge = 2**31 - 1
    for box, compression, channels in (
        ((0, 0, huge, huge), 3, one),
        ((0, 0, huge, huge), 4, one),
        ((-huge, -huge, huge, huge), 0, one),
        ((5, 5, 4, 4), 3, one),
        ((0, 0, 9, 9), 77, one),
        ((0, 0, 9, 9), 3, b""),
        ((0, 0, 9, 9), 3, b"\0"),
        ((0, 0, 9, 9), 3, b"Z\0"),
        ((0, 0, 9, 9), 3, b"Z\0" + struct.pack("<iIii", 9, 0, 1, 1) + b"\0"),
        ((0, 0, 9, 9), 3, b"Z\0" + struct.pack("<iIii", 2, 0, 0, 1) + b"\0"),
        ((0, 0, 9, 9), 3, one),  # a table of zeros: never finished
    ):
        message = refusal(path, picture(box, compression, channels))
        assert message.startswith(("is damaged", "is cut short")), (box, compression)
