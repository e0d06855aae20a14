"""OpenEXR files, read back with the library's other interface (`OpenEXR.File`)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest

from clfractal.errors import FileError
from clfractal.files import exr
from clfractal.files.exr import read_exr, to_half, write_exr
from tests.files.limits import file_size_limit

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


def test_full_disk_leaves_the_earlier_file(tmp_path: Path) -> None:
    path = tmp_path / "a.exr"
    path.write_bytes(b"old")
    # Limits that hit the header, the pixels, and the last bytes.
    whole = planes(200, 100)
    write(tmp_path / "b.exr", whole)
    size = (tmp_path / "b.exr").stat().st_size
    (tmp_path / "b.exr").unlink()
    for limit in (100, 600, 20000, size // 2, size - 4096, size - 1):
        with pytest.raises(FileError, match=r"a\.exr: cannot be written: ") as caught, file_size_limit(limit):
            write(path, whole)
        assert ".tmp" not in str(caught.value)
        assert path.read_bytes() == b"old"
        assert [entry.name for entry in tmp_path.iterdir()] == ["a.exr"]


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
