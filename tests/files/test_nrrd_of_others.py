"""NRRD files of other programs: the spaces that they know, and the ways in which they write values down.

ITK is asked where voxels are, pynrrd writes data.
"""

from __future__ import annotations

import bz2
import gzip
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nrrd as pynrrd
import numpy as np
import numpy.typing as npt
import pytest
import SimpleITK

from clfractal.files import voxel_data
from clfractal.files.volume_file import read_volume
from clfractal.scene.model import Scene
from tests.scenes import scene_of

STEPS = np.array([[0.5, 0.25, -1.0], [2.0, 0.0, 0.75], [-0.25, 3.0, 1.5]])
ORIGIN = np.array([10.0, -20.0, 30.0])
VALUES = np.arange(24, dtype="<f4").reshape(2, 3, 4)
# From a space to ours.
SIGNS = {
    "right-anterior-superior": (-1, -1, 1),
    "RAS": (-1, -1, 1),
    "ras": (-1, -1, 1),
    "left-anterior-superior": (1, -1, 1),
    "LAS": (1, -1, 1),
    "left-posterior-superior": (1, 1, 1),
    "Left-Posterior-Superior": (1, 1, 1),
    "LPS": (1, 1, 1),
    "scanner-xyz": (1, 1, 1),
    "3D-right-handed": (1, 1, 1),
}
WITH_TIME = {
    "right-anterior-superior-time": (-1, -1, 1),
    "RAST": (-1, -1, 1),
    "left-anterior-superior-time": (1, -1, 1),
    "LAST": (1, -1, 1),
    "left-posterior-superior-time": (1, 1, 1),
    "LPST": (1, 1, 1),
    "scanner-xyz-time": (1, 1, 1),
    "3D-right-handed-time": (1, 1, 1),
    "3D-left-handed-time": (-1, 1, 1),
}


def written(
    path: Path, space: str, steps: npt.NDArray[Any] = STEPS, origin: npt.NDArray[Any] = ORIGIN
) -> Path:
    """A file in a space; `space` is the line that tells it."""
    rows = " ".join(f"({','.join(map(str, row))})" for row in steps.tolist())
    path.write_bytes(
        f"NRRD0005\ntype: float\ndimension: 3\nsizes: 4 3 2\nendian: little\nencoding: raw\n{space}\n"
        f"space directions: {rows}\nspace origin: ({','.join(map(str, origin.tolist()))})\n\n".encode()
        + VALUES.tobytes()
    )
    return path


@pytest.mark.parametrize(
    "space", [*(f"space: {name}" for name in SIGNS), "space dimension: 3"], ids=lambda line: line.split()[-1]
)
def test_voxels_are_where_itk_has_them(space: str, tmp_path: Path) -> None:
    path = written(tmp_path / "v.nrrd", space)
    image: Any = SimpleITK.ReadImage(str(path))
    found = read_volume(path)
    # (ITK makes rotations of directions that are none: so here it is asked for the first voxel alone.)
    np.testing.assert_allclose(image.GetOrigin(), found.origin)
    signs = SIGNS.get(space.removeprefix("space: "), (1, 1, 1))
    np.testing.assert_array_equal(found.directions, STEPS * signs)
    np.testing.assert_array_equal(found.origin, ORIGIN * signs)


@pytest.mark.parametrize("space", SIGNS)
def test_turned_voxels_are_where_itk_has_them(space: str, tmp_path: Path) -> None:
    """All of them, of a grid whose steps stand at right angles, as ITK wants them."""
    turn = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    path = written(tmp_path / "v.nrrd", f"space: {space}", np.diag([0.25, 0.5, 2.0]) @ turn)
    image: Any = SimpleITK.ReadImage(str(path))
    found = read_volume(path)
    for index in np.ndindex(4, 3, 2):
        place = found.origin + np.array(index) @ found.directions
        np.testing.assert_allclose(image.TransformIndexToPhysicalPoint(index), place, atol=1e-9)
        assert image.GetPixel(index) == found.values[index[::-1]]


@pytest.mark.parametrize("space", WITH_TIME)
def test_a_space_with_a_time(space: str, tmp_path: Path) -> None:
    """Its fourth number, the time, says nothing about where voxels are."""
    steps, origin = np.column_stack([STEPS, [0, 0, 0]]), np.append(ORIGIN, 17)
    found = read_volume(written(tmp_path / "v.nrrd", f"space: {space}", steps, origin))
    np.testing.assert_array_equal(found.directions, STEPS * WITH_TIME[space])
    np.testing.assert_array_equal(found.origin, ORIGIN * WITH_TIME[space])


@pytest.mark.parametrize("space", ["", "space dimension: 3", "space: LPS\nspace dimension: 3"])
def test_no_name_of_a_space(space: str, tmp_path: Path) -> None:
    found = read_volume(written(tmp_path / "v.nrrd", space or "content: none"))
    np.testing.assert_array_equal(found.directions, STEPS)
    np.testing.assert_array_equal(found.origin, ORIGIN)


@pytest.mark.parametrize("space", ["3D-left-handed", "3d-LEFT-handed"])
def test_a_left_handed_space_is_mirrored(space: str, tmp_path: Path) -> None:
    """Positions have another sign along x, whichever way the axes of the array run; ours are right-handed."""
    found = read_volume(written(tmp_path / "v.nrrd", f"space: {space}"))
    np.testing.assert_array_equal(found.origin, ORIGIN * [-1, 1, 1])
    np.testing.assert_array_equal(found.directions, STEPS * [-1, 1, 1])


@pytest.mark.parametrize(
    ("space", "expected"),
    [("LPS", (-0.25, 0.5, -0.4)), ("RAS", (0.25, -0.5, -0.4)), ("LAS", (-0.25, -0.5, -0.4))],
)
def test_one_block_in_three_spaces(space: str, expected: tuple[float, ...], tmp_path: Path) -> None:
    """The middle of what is inside, as a scene has it."""
    values = np.zeros((20, 24, 30), "<f4")
    values[4:9, 13:18, 5:11] = 100
    (tmp_path / "v.nrrd").write_bytes(
        f"NRRD0004\ntype: float\ndimension: 3\nsizes: 30 24 20\nendian: little\nencoding: raw\nspace: {space}\n"
        "space directions: (0.1,0,0) (0,0.1,0) (0,0,0.1)\nspace origin: (-1,-1,-1)\n\n".encode()
        + values.tobytes()
    )
    scene: Scene = scene_of(
        {"name": "mandelbulb"}, {}, None, folder=tmp_path, renderer={"type": "volume", "file": "v.nrrd"}
    )
    grid = scene.given
    assert grid is not None
    middle = np.argwhere(grid.values > 50).mean(0)[::-1] + 0.5
    np.testing.assert_allclose(grid.place.corner + middle @ np.array(grid.place.steps), expected, atol=1e-12)


# --- encodings ---


def as_text(values: npt.NDArray[Any], between: str) -> bytes:
    return between.join(repr(number) for number in values.reshape(-1).tolist()).encode()


ENCODINGS: dict[str, tuple[str, Callable[[npt.NDArray[Any]], bytes]]] = {
    "ascii": ("ascii", lambda values: as_text(values, " ") + b"\n"),
    "text, lines": ("text", lambda values: as_text(values, "\r\n")),
    "txt, commas": ("TXT", lambda values: as_text(values, ", ")),
    "more than asked for": ("ascii", lambda values: as_text(values, "\t") + b" and more"),
    "hex": ("hex", lambda values: values.tobytes().hex().encode()),
    "hex, lines": ("hex", lambda values: values.tobytes().hex("\n", 7).upper().encode() + b"\n"),
    "bzip2": ("bzip2", lambda values: bz2.compress(values.tobytes())),
    "bz2, in two streams": (
        "bz2",
        lambda values: bz2.compress(values.tobytes()[:11]) + bz2.compress(values.tobytes()[11:]),
    ),
    "gz": ("gz", lambda values: gzip.compress(values.tobytes())),
}
TYPES = {
    "i1": "signed char",
    "u1": "uchar",
    "<i2": "short",
    ">u2": "ushort",
    "<i4": "int",
    ">i8": "int64",
    "<u8": "uint64",
    "<f4": "float",
    ">f8": "double",
}


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("name", ENCODINGS)
@pytest.mark.parametrize("piece", [7, 1 << 20])
def test_all_encodings(
    name: str, dtype: str, piece: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The type's ends among the values, read in pieces of any size."""
    monkeypatch.setattr(voxel_data, "_PIECE", piece)
    kind = np.dtype(dtype)
    values = np.arange(24).astype(kind).reshape(2, 3, 4)
    limits = np.finfo(kind) if kind.kind == "f" else np.iinfo(kind)
    values[0, 0, 0], values[1, 2, 3] = limits.min, limits.max
    if kind.kind == "f":
        values[0, 0, 1:4] = np.nan, np.inf, -np.inf
    encoding, packed = ENCODINGS[name]
    order = (
        "" if encoding in ("ascii", "text", "TXT") else f"endian: {'big' if dtype[0] == '>' else 'little'}\n"
    )
    head = f"NRRD0004\ntype: {TYPES[dtype]}\ndimension: 3\nsizes: 4 3 2\n{order}encoding: {encoding}\n\n"
    (tmp_path / "v.nrrd").write_bytes(head.encode() + packed(values))
    found = read_volume(tmp_path / "v.nrrd")
    assert found.values.dtype == kind.newbyteorder("=")
    np.testing.assert_array_equal(found.values, values)


@pytest.mark.parametrize("encoding", ["ascii", "text", "txt", "gzip", "gz", "bzip2", "bz2", "raw"])
@pytest.mark.parametrize("detached", [False, True])
def test_what_pynrrd_writes(encoding: str, detached: bool, tmp_path: Path) -> None:
    values = np.random.default_rng(1).normal(size=(5, 6, 7)).astype(np.float32)
    path = tmp_path / ("v.nhdr" if detached else "v.nrrd")
    header = {"encoding": encoding, "space": "right-anterior-superior", "space directions": STEPS}
    pynrrd.write(str(path), values, header, detached_header=detached, index_order="C")
    found = read_volume(path)
    np.testing.assert_allclose(found.values, values, rtol=1e-6)
    np.testing.assert_array_equal(found.directions, STEPS * [-1, -1, 1])
    if not encoding.startswith("bz"):  # which ITK's reader leaves out
        image: Any = SimpleITK.ReadImage(str(path))
        np.testing.assert_allclose(SimpleITK.GetArrayFromImage(image), found.values)


def test_lines_and_bytes_before_text(tmp_path: Path) -> None:
    head = (
        "NRRD0004\ntype: short\ndimension: 3\nsizes: 2 1 1\nencoding: ascii\nline skip: 1\nbyte skip: 4\n\n"
    )
    (tmp_path / "v.nrrd").write_bytes(head.encode() + b"a line\n1 2 3 -4")
    assert read_volume(tmp_path / "v.nrrd").values.tolist() == [[[3, -4]]]
