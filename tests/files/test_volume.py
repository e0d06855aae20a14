"""Volumes in files: what is written is read back, by independent readers too; NRRD files of other programs.

Of those the spaces that they know, and the ways in which they write values down.
"""

from __future__ import annotations

import bz2
import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import nrrd as pynrrd
import numpy as np
import numpy.typing as npt
import pytest
import SimpleITK
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

import clfractal
from clfractal.files import volume_file as module
from clfractal.files import voxel_data
from clfractal.files.volume_file import SCENE_KEY, Volume, read_volume, write_slabs, write_volume
from tests.files.limits import rewrite
from tests.scenes import scene_of

SCENE = 'version: 1\nformula: {name: hast}\nnote: "back\\\\slash, := and \\n"\n'
TYPES = ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f4", "f8")
# A turned, stretched and sheared grid; no two of its numbers are the same.
DIRECTIONS = np.array([[0.25, 0.01, 0.0], [-0.02, 0.5, 0.03], [0.0, -0.125, 2.0]])
ORIGIN = np.array([-1.5, 2.25, 1e-3])


def ramp(dtype: str, shape: tuple[int, int, int] = (4, 3, 5)) -> npt.NDArray[Any]:
    """Different values everywhere, the type's ends among them."""
    kind = np.dtype(dtype)
    values = np.arange(np.prod(shape)).astype(kind).reshape(shape)
    limits = np.finfo(kind) if kind.kind == "f" else np.iinfo(kind)
    values[0, 0, 0], values[-1, -1, -1] = limits.min, limits.max
    return values


def box(values: npt.NDArray[Any]) -> Volume:
    return Volume(values, ORIGIN, np.diag([0.25, 0.5, 2.0]), {SCENE_KEY: SCENE})


geometry = st.floats(-1e6, 1e6, allow_subnormal=False)
volumes = st.builds(
    Volume,
    arrays.arrays(
        st.sampled_from(TYPES).map(np.dtype),
        st.tuples(st.integers(1, 5), st.integers(1, 5), st.integers(1, 5)),
    ),
    arrays.arrays(np.float64, 3, elements=geometry),
    # Far from flat, whatever the numbers beside the diagonal.
    arrays.arrays(np.float64, (3, 3), elements=st.floats(-0.3, 0.3)).map(lambda some: some + np.eye(3)),
    st.dictionaries(
        st.sampled_from((SCENE_KEY, "note", "a.b-c d")),
        st.text(st.characters(exclude_characters="\r", exclude_categories=["Cs"]), max_size=60),
    ),
)


def same(one: Volume, other: Volume) -> bool:
    return (
        one.values.dtype == other.values.dtype
        and np.array_equal(one.values, other.values, equal_nan=one.values.dtype.kind == "f")
        and np.array_equal(one.origin, other.origin)
        and np.array_equal(one.directions, other.directions)
        and one.texts == other.texts
    )


@pytest.mark.parametrize("name", ["v.nrrd", "v.npy", "packed.nrrd"])
@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(volume=volumes)
def test_round_trip(name: str, tmp_path: Path, volume: Volume) -> None:
    path = tmp_path / name
    for written in (path, Path(f"{path}.json")):
        written.unlink(missing_ok=True)
    # Spaces at the end of a line are no part of a NRRD header.
    texts = {key: text.rstrip() if name.endswith("nrrd") else text for key, text in volume.texts.items()}
    volume = Volume(volume.values, volume.origin, volume.directions, texts)
    write_volume(path, volume, compress=name.startswith("packed"))
    assert same(read_volume(path), volume)


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("compress", [False, True])
def test_another_reader_finds_the_same(dtype: str, compress: bool, tmp_path: Path) -> None:
    path, values = tmp_path / "v.nrrd", ramp(dtype)
    write_volume(path, Volume(values, ORIGIN, DIRECTIONS, {SCENE_KEY: SCENE}), compress=compress)
    found, header = pynrrd.read(str(path), index_order="C")
    assert found.dtype == values.dtype
    assert np.array_equal(found, values)
    assert np.array_equal(header["space directions"], DIRECTIONS)
    assert np.array_equal(header["space origin"], ORIGIN)
    assert header["space"] == "left-posterior-superior"
    assert header["kinds"] == ["domain"] * 3
    assert header["encoding"] == ("gzip" if compress else "raw")


@pytest.mark.parametrize("dtype", TYPES)
def test_itk_finds_the_same(dtype: str, tmp_path: Path) -> None:
    """What 3D Slicer reads files with."""
    path, values = tmp_path / "v.nrrd", ramp(dtype)
    write_volume(path, box(values), compress=dtype == "f4")
    image: Any = SimpleITK.ReadImage(str(path))
    assert image.GetSize() == (5, 3, 4)
    assert image.GetSpacing() == (0.25, 0.5, 2.0)
    assert image.GetOrigin() == tuple(ORIGIN)
    assert image.GetDirection() == (1, 0, 0, 0, 1, 0, 0, 0, 1)
    assert np.array_equal(SimpleITK.GetArrayFromImage(image), values)


def test_directions_of_a_turned_grid_in_itk(tmp_path: Path) -> None:
    turn = np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]])
    spacing = np.array([0.25, 0.5, 2.0])
    write_volume(tmp_path / "v.nrrd", Volume(ramp("u1"), ORIGIN, spacing[:, None] * turn))
    image: Any = SimpleITK.ReadImage(str(tmp_path / "v.nrrd"))
    assert np.allclose(image.GetSpacing(), spacing, atol=1e-12)
    # The place of a voxel (i, j, k) is what both have to agree on.
    for index in ((4, 0, 0), (0, 2, 0), (1, 2, 3)):
        expected = ORIGIN + np.array(index) @ (spacing[:, None] * turn)
        assert np.allclose(image.TransformIndexToPhysicalPoint(index), expected, atol=1e-12)


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize(
    "turned", [np.array([[0.6, 0.8, 0.0], [-0.8, 0.6, 0.0], [0.0, 0.0, 1.0]]), np.eye(3)]
)
def test_files_of_others(turned: npt.NDArray[np.float64], compress: bool, tmp_path: Path) -> None:
    path, values = tmp_path / "theirs.nrrd", ramp("i2")
    image: Any = SimpleITK.GetImageFromArray(values)
    image.SetSpacing((0.5, 0.25, 2.0))
    image.SetOrigin((1.0, -2.0, 3.0))
    image.SetDirection(turned.T.reshape(-1).tolist())
    SimpleITK.WriteImage(image, str(path), useCompression=compress)
    volume = read_volume(path)
    assert np.array_equal(volume.values, values)
    assert np.allclose(volume.origin, (1.0, -2.0, 3.0))
    assert np.allclose(volume.spacing, (0.5, 0.25, 2.0))
    for index in ((1, 0, 0), (0, 1, 0), (0, 0, 1)):
        place = volume.origin + np.array(index) @ volume.directions
        assert np.allclose(image.TransformIndexToPhysicalPoint(index), place)


@pytest.mark.parametrize("compress", [False, True])
@pytest.mark.parametrize("dtype", ["i2", "u4", "i8", "f4", "f8"])
def test_big_endian_and_detached(dtype: str, compress: bool, tmp_path: Path) -> None:
    values = ramp(dtype)
    data = values.astype(values.dtype.newbyteorder(">")).tobytes()
    (tmp_path / "data").mkdir()
    (tmp_path / "data" / "v.raw").write_bytes(gzip.compress(b"skip" + data) if compress else b"skip" + data)
    names = {"i2": "short", "u4": "unsigned int", "i8": "long long", "f4": "float", "f8": "double"}
    (tmp_path / "v.nhdr").write_text(
        f"NRRD0001\r\n# old\r\ntype: {names[dtype]}\r\ndimension: 3\r\nsizes: 5 3 4\r\nspacings: 1 nan 3\r\n"
        f"axis mins: 10 nan 30\r\nendian: BIG\r\nbyteskip: 4\r\nencoding: {'gz' if compress else 'raw'}\r\n"
        "datafile: data/v.raw\r\n"
    )
    volume = read_volume(tmp_path / "v.nhdr")
    assert volume.values.dtype == np.dtype(dtype)
    assert np.array_equal(volume.values, values)
    assert volume.origin.tolist() == [10.5, 0, 31.5]  # the middle of a cell, half a step from its side
    assert volume.directions.tolist() == [[1, 0, 0], [0, 1, 0], [0, 0, 3]]


def head(extra: str = "", sizes: str = "2 1 1", dimension: int = 3) -> str:
    return f"NRRD0005\ntype: uchar\ndimension: {dimension}\nsizes: {sizes}\nencoding: raw\nkinds: a b c\n{extra}\n"


@pytest.mark.parametrize(
    ("extra", "origin", "steps"),
    [
        ("", [0, 0, 0], [1, 1, 1]),
        ("spacings: 1 2 3\n", [0, 0, 0], [1, 2, 3]),
        ("axis mins: 0 0 0\naxis maxs: 4 8 3\n", [1, 4, 1.5], [2, 8, 3]),
        ("axis mins: 0 0 0\naxis maxs: 4 8 3\ncenters: node node node\n", [0, 0, 0], [4, 8, 3]),
        (
            "space: lps\nspace directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (5,6,7)\n",
            [5, 6, 7],
            [2, 3, 4],
        ),
        ("space dimension: 3\nspace directions: ( 2, 0, 0 )(0 3 0) (0,0,4)\n", [0, 0, 0], [2, 3, 4]),
        (
            "space: LAS\nspace directions: (2,0,0) (0,3,0) (0,0,4)\nspace origin: (5,6,7)\n",
            [5, -6, 7],
            [2, -3, 4],
        ),
        ("space: RAS\nspacings: 2 3 4\n", [0, 0, 0], [-2, -3, 4]),
    ],
)
def test_where_voxels_are(extra: str, origin: list[float], steps: list[float], tmp_path: Path) -> None:
    (tmp_path / "v.nrrd").write_bytes(head(extra).encode() + b"\x05\x07")
    volume = read_volume(tmp_path / "v.nrrd")
    assert volume.values.tolist() == [[[5, 7]]]
    assert volume.origin.tolist() == origin
    assert volume.directions.tolist() == np.diag(steps).tolist()


def test_lines_and_bytes_before_the_data(tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    path.write_bytes(head("line skip: 2\nbyte skip: 3\n").encode() + b"one\ntwo\nxyz\x05\x07")
    assert read_volume(path).values.tolist() == [[[5, 7]]]
    rewrite(path, head("byte skip: -1\n").encode() + b"whatever stands here\x05\x07")
    assert read_volume(path).values.tolist() == [[[5, 7]]]


def test_large_data_are_mapped_and_small_ones_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, values = tmp_path / "v.nrrd", ramp("f4", (8, 9, 10))
    write_volume(path, box(values))
    assert not isinstance(read_volume(path).values, np.memmap)
    monkeypatch.setattr(voxel_data, "_MAPPED", 1000)
    found = read_volume(path, limit=0).values
    assert isinstance(found, np.memmap)
    assert found.flags.aligned
    assert not found.flags.writeable
    assert np.array_equal(found, values)


@pytest.mark.parametrize("name", ["v.nrrd", "v.npy"])
def test_a_stream_of_slabs_is_the_same_file(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_PIECE", 100)
    values = ramp("f4", (7, 9, 5))
    write_volume(tmp_path / f"whole{name}", box(values))
    parts = (values[start : start + 3] for start in range(0, 7, 3))
    write_slabs(tmp_path / f"parts{name}", parts, values.shape, "f4", box(values[:1]))
    assert (tmp_path / f"whole{name}").read_bytes() == (tmp_path / f"parts{name}").read_bytes()


def test_fortran_order_of_npy(tmp_path: Path) -> None:
    values = ramp("i4")
    np.save(tmp_path / "v.npy", np.asfortranarray(values.astype(">i4")))
    found = read_volume(tmp_path / "v.npy")
    assert np.array_equal(found.values, values)
    assert found.values.dtype == np.int32
    assert found.directions.tolist() == np.eye(3).tolist()
    np.save(tmp_path / "w.npy", values > 7)
    assert np.array_equal(read_volume(tmp_path / "w.npy").values, (values > 7).astype(np.uint8))


def test_numpy_reads_what_we_write(tmp_path: Path) -> None:
    values = ramp("f8")
    write_volume(tmp_path / "v.npy", box(values))
    assert np.array_equal(np.load(tmp_path / "v.npy"), values)
    assert json.loads((tmp_path / "v.npy.json").read_text())["origin"] == ORIGIN.tolist()


@pytest.mark.parametrize("name", ["v.nrrd", "v.npy", "packed.nrrd"])
def test_a_failure_leaves_the_earlier_file(name: str, tmp_path: Path) -> None:
    path = tmp_path / name
    write_volume(path, box(ramp("u1")))
    before = {each.name: each.read_bytes() for each in tmp_path.iterdir()}
    noise = np.random.default_rng(1).integers(0, 256, (40, 40, 40), np.uint8)

    def broken() -> Any:
        yield noise[:20]
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write_slabs(path, broken(), noise.shape, np.uint8, box(noise), compress=name.startswith("packed"))
    assert {each.name: each.read_bytes() for each in tmp_path.iterdir()} == before


def test_wrong_slabs_are_our_own_mistake(tmp_path: Path) -> None:
    values = ramp("u1")
    for slabs in ([values[:2]], [values, values], [values[:, :2]]):
        with pytest.raises(ValueError, match=r"of shape|planes got"):
            write_slabs(tmp_path / "v.nrrd", slabs, values.shape, "u1", box(values))
    assert list(tmp_path.iterdir()) == []


def test_an_extension_that_is_not_known(tmp_path: Path) -> None:
    with pytest.raises(clfractal.FileError, match=r"unknown extension '\.raw'; known: \.nrrd, \.npy"):
        write_volume(tmp_path / "v.raw", box(ramp("u1")))


# --- files of other programs ---


STEPS = np.array([[0.5, 0.25, -1.0], [2.0, 0.0, 0.75], [-0.25, 3.0, 1.5]])
THEIR_ORIGIN = np.array([10.0, -20.0, 30.0])
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
    path: Path, space: str, steps: npt.NDArray[Any] = STEPS, origin: npt.NDArray[Any] = THEIR_ORIGIN
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
    np.testing.assert_array_equal(found.origin, THEIR_ORIGIN * signs)


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
    steps, origin = np.column_stack([STEPS, [0, 0, 0]]), np.append(THEIR_ORIGIN, 17)
    found = read_volume(written(tmp_path / "v.nrrd", f"space: {space}", steps, origin))
    np.testing.assert_array_equal(found.directions, STEPS * WITH_TIME[space])
    np.testing.assert_array_equal(found.origin, THEIR_ORIGIN * WITH_TIME[space])


@pytest.mark.parametrize(
    ("space", "sign"),
    [
        ("content: none", 1),
        ("space: LPS\nspace dimension: 3", 1),
        ("space: 3D-left-handed", -1),
        ("space: 3d-LEFT-handed", -1),
    ],
)
def test_a_left_handed_space_is_mirrored_and_none_is_ours(space: str, sign: int, tmp_path: Path) -> None:
    """Positions have another sign along x, whichever way the axes of the array run; ours are right-handed."""
    found = read_volume(written(tmp_path / "v.nrrd", space))
    np.testing.assert_array_equal(found.origin, THEIR_ORIGIN * [sign, 1, 1])
    np.testing.assert_array_equal(found.directions, STEPS * [sign, 1, 1])


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
    scene: clfractal.Scene = scene_of(
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
TYPE_NAMES = {
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


@pytest.mark.parametrize("dtype", TYPE_NAMES)
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
    head = f"NRRD0004\ntype: {TYPE_NAMES[dtype]}\ndimension: 3\nsizes: 4 3 2\n{order}encoding: {encoding}\n\n"
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
