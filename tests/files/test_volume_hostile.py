"""Volume files that are damaged or meant to harm: one line each, and no memory before the size is known."""

from __future__ import annotations

import bz2
import gzip
import json
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st

from clfractal.errors import FileError
from clfractal.files import nrrd
from clfractal.files.volume_file import Volume, read_volume, write_volume
from tests.calls import failure
from tests.files.limits import rewrite

GOOD = {
    "type": "short",
    "dimension": "3",
    "sizes": "2 3 4",
    "endian": "little",
    "encoding": "raw",
    "space": "left-posterior-superior",
    "space directions": "(1,0,0) (0,1,0) (0,0,1)",
    "space origin": "(0,0,0)",
}
DATA = np.arange(24, dtype="<i2").tobytes()


def header(**changed: str | None) -> bytes:
    """A header with fields replaced; None takes one away."""
    fields = {**GOOD, **{name.replace("_", " "): value for name, value in changed.items()}}
    lines = [f"{name}: {value}" for name, value in fields.items() if value is not None]
    return "\n".join(["NRRD0004", *lines, "", ""]).encode()


def message(path: Path, limit: int | None = None) -> str:
    """How reading a file fails; one line, that begins with the file."""
    told = str(failure(FileError, read_volume, path, limit=limit))
    assert len(told) < 400
    return told


def test_the_good_one(tmp_path: Path) -> None:
    (tmp_path / "v.nrrd").write_bytes(header() + DATA)
    assert read_volume(tmp_path / "v.nrrd").values.reshape(-1).tolist() == list(range(24))


@pytest.mark.parametrize(
    ("changed", "part"),
    [
        ({"sizes": "1000000000 1000000000 1000000000"}, "is cut short: 1,000,000,000 x 1,000,000,000 x"),
        ({"sizes": "4294967296 4294967296 2"}, "is cut short"),  # 2**64 times two bytes is 0 in 64 bits
        ({"sizes": "999999999999999999 999999999999999999 999999999999999999"}, "is cut short"),
        ({"sizes": "9" * 5000 + " 1 1"}, "sizes: must be 3 whole numbers"),
        ({"sizes": "-2 3 4"}, "4: sizes: must be at least 1, got -2"),
        ({"sizes": "0 3 4"}, "4: sizes: must be at least 1, got 0"),
        ({"sizes": "2 3"}, "sizes: must be 3 whole numbers, got '2 3'"),
        ({"sizes": "2 3 1e9"}, "sizes: must be 3 whole numbers"),
        ({"sizes": None}, "its header has no field 'sizes'"),
        ({"dimension": "4"}, "3: dimension: must be 3"),
        ({"dimension": "9" * 100}, "dimension: must be a whole number"),
        ({"type": "block"}, "type: unsupported type 'block'; known: signed char"),
        ({"type": "complex double"}, "type: unsupported type 'complex double'"),
        ({"endian": "middle"}, "endian: unknown endian 'middle'"),
        ({"endian": None}, "its header has no field 'endian'"),
        (
            {"encoding": "zrl"},
            "encoding: unknown encoding 'zrl'; known: ascii, bz2, bzip2, gz, gzip, hex, raw",
        ),
        ({"encoding": "bzip2"}, "is damaged: its compressed data are wrong"),
        ({"encoding": "txt"}, "is damaged: its number 1 is "),
        ({"encoding": "hex"}, "is cut short: 2 x 3 x 4 voxels need 96 digits, it has 48 characters"),
        ({"encoding": "hex", "type": "uchar"}, "is damaged: its data are not hexadecimal"),
        (
            {"encoding": "ascii", "sizes": "9 9 9"},
            "is cut short: 9 x 9 x 9 voxels need 1,457 characters or more",
        ),
        ({"encoding": "gzip"}, "is damaged: its compressed data are wrong"),
        (
            {"space": "4D"},
            "space: unknown space '4D'; known: RAS, LAS, LPS or whole names, scanner-xyz",
        ),
        ({"space_dimension": "2"}, "space dimension: must be 3 in the space left-posterior-superior"),
        ({"space": None, "space_dimension": "4"}, "space dimension: must be 3"),
        ({"space": "LPST"}, "space directions: must be 4 numbers, got 3"),
        (
            {"space": "LPST", "space_directions": "(1,0,0,0) (0,1,0,0) (0,0,0,1)", "space_origin": None},
            "space directions: must be three directions in space: none may go along the time",
        ),
        ({"space": "LPs3"}, "unknown space 'LPs3'; did you mean 'lps'?"),
        ({"space": "right-up"}, "space: unknown space 'right-up'"),
        ({"space_directions": "(1,0,0) (0,1,0)"}, "space directions: must be 3 vectors"),
        ({"space_directions": "(1,0,0) (0,1,0) (0,0,1) (1,1,1)"}, "space directions: must be 3 vectors"),
        ({"space_directions": "(1,0,0) (0,1,0) (0,1,0)"}, "8: space directions: must be three steps"),
        ({"space_directions": "(1,0,0) (0,1,0) (0,0,0)"}, "space directions: must be three steps"),
        ({"space_directions": "(1,0,0) (0,1,0) (0,0,nan)"}, "has a position or direction beyond"),
        ({"space_directions": "(1,0,0) (0,1e300,0) (0,0,1)"}, "has a position or direction beyond"),
        ({"space_directions": "(1,0) (0,1) (0,0)"}, "space directions: must be 3 numbers, got 2"),
        ({"space_directions": "none (0,1,0) (0,0,1)"}, "only volumes of one value per voxel"),
        ({"space_directions": "(a,0,0) (0,1,0) (0,0,1)"}, "space directions: must be numbers, got 'a'"),
        ({"space_origin": "(0,0,0"}, "space origin: must be a vector (x,y,z)"),
        ({"space_origin": "(inf,0,0)"}, "has a position or direction beyond"),
        ({"space_directions": None, "spacings": "0 1 1"}, "spacings: must be three steps"),
        ({"space_directions": None, "axis_maxs": "1 1 1", "axis_mins": "1 0 0"}, "axis maxs: must be three"),
        ({"byte_skip": "-2"}, "byte skip: must be at least -1"),
        ({"byte_skip": "999999999999999999"}, "is cut short"),
        ({"line_skip": "-1"}, "line skip: must be at least 0"),
        ({"line_skip": "999999999999999999"}, "fewer lines than its header skips"),
        ({"encoding": "gzip", "line_skip": "1"}, "line skip: must be 0 before compressed data"),
        ({"encoding": "gzip", "byte_skip": "999999999999999999"}, "is cut short"),
        ({"spacngs": "1 1 1"}, "unknown field 'spacngs'; did you mean 'spacings'?"),
        ({"data_file": "/etc/passwd"}, "data file: must be a path inside the header's folder"),
        ({"data_file": "../secret"}, "data file: must be a path inside the header's folder"),
        ({"data_file": "LIST"}, "data in several files"),
        ({"data_file": "slice%03d.raw 1 9 1"}, "data in several files"),
        ({"data_file": "missing.raw"}, "missing.raw: cannot be read: No such file"),
        ({"data_file": ""}, "data file: must be a path"),
        ({"data_file": "v.nrrd"}, "v.nrrd:10: data file: must be another file: this one is the header"),
    ],
)
def test_a_wrong_header_in_one_line(changed: dict[str, str | None], part: str, tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    path.write_bytes(header(**changed) + DATA)
    told = message(path)
    assert part in told
    assert told.startswith(str(tmp_path))


def test_a_way_out_of_the_folder_by_a_link(tmp_path: Path) -> None:
    inside = tmp_path / "inside"
    inside.mkdir()
    (tmp_path / "secret.raw").write_bytes(DATA)
    (inside / "link.raw").symlink_to(tmp_path / "secret.raw")
    (inside / "v.nhdr").write_bytes(header(data_file="link.raw"))
    assert "inside its folder" in message(inside / "v.nhdr")


def test_a_flipped_bit_of_compressed_data_is_seen(tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    write_volume(path, Volume(np.arange(60.0).reshape(3, 4, 5)), compress=True)
    content = bytearray(path.read_bytes())
    content[-6] ^= 1  # of the check sum
    rewrite(path, bytes(content))
    assert "compressed data are wrong" in message(path)


def test_a_bomb_takes_no_memory(tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    bomb = gzip.compress(bytes(50_000_000))
    path.write_bytes(header(sizes="1000000 1000000 1000", encoding="gzip") + bomb)
    tracemalloc.start()
    assert "is cut short" in message(path)
    # As large as it says, but more than there is room for.
    rewrite(path, header(sizes="1000000 25 1", encoding="gzip") + bomb)
    told = message(path, limit=49_000_000)
    assert "is too large: 1,000,000 x 25 x 1 voxels need 50 MB of memory, 49 MB are left" in told
    # Larger than it says: only what was said is unpacked.
    rewrite(path, header(encoding="gzip") + bomb)
    assert not read_volume(path).values.any()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert peak < 20_000_000


@pytest.mark.parametrize("link", ["v.nrrd", "other.nhdr"])
def test_data_that_would_be_the_header(link: str, tmp_path: Path) -> None:
    """By another name, too: a link to the header has no voxels either."""
    path = tmp_path / "v.nrrd"
    path.write_bytes(header(data_file=link) + bytes(1000))
    if link != "v.nrrd":
        (tmp_path / link).hardlink_to(path)
    assert "data file: must be another file" in message(path)


@pytest.mark.parametrize(
    ("kind", "data", "part"),
    [
        ("uchar", b"1 2 3 256", "its number 4 is '256', which is no uint8"),
        ("uchar", b"1 2 -3 4", "its number 3 is '-3', which is no uint8"),
        ("uint64", b"1 2 -3 4", "its number 3 is '-3', which is no uint64"),
        ("short", b"1 2.5 3 4", "its number 2 is '2.5', which is no int16"),
        ("float", b"1 2 three 4", "its number 3 is 'three', which is no float32"),
        ("float", b"1 2 1_0 4", "its number 3 is '1_0', which is no float32"),
        ("float", b"1 2 3     ", "is cut short: 4 x 1 x 1 voxels, but 3 numbers"),
        ("float", b"1 2 \xff\xfe 4", "its number 3 is"),
        ("float", b"1 2 " + b"9" * 3_000_000, "its number 3 is '9999999999999999999999999999999999999999'"),
    ],
)
def test_text_that_is_no_numbers(kind: str, data: bytes, part: str, tmp_path: Path) -> None:
    (tmp_path / "v.nrrd").write_bytes(header(encoding="text", endian=None, sizes="4 1 1", type=kind) + data)
    assert part in message(tmp_path / "v.nrrd")


def test_a_header_without_an_end(tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    path.write_bytes(b"NRRD0004\n" + b"#" * (nrrd.LARGEST_HEADER + 5) + b"\n\n")
    assert "its header is longer than 8,388,608 bytes" in message(path)
    rewrite(path, header()[:-1])
    assert "is cut short: the file ends in its header" in message(path)
    rewrite(path, header(sizes="2 3 4\nsizes: 2 3 4") + DATA)
    assert "5: sizes: is given twice" in message(path)
    rewrite(path, header(sizes="2 3 4\nwhat is this") + DATA)
    assert ":5: is not a line of a NRRD header" in message(path)


def test_what_is_no_volume(tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    for content in (b"", b"NRRD", b"version: 1\n", b"NRRD0009\n\n", b"\x89PNG\r\n\x1a\n"):
        rewrite(path, content)
        assert "NRRD" in message(path)
    assert "is a folder" in message(tmp_path)


def npy(
    shape: str = "(2, 3, 4)", descr: str = "'<i2'", order: str = "False", version: bytes = b"\1\0"
) -> bytes:
    text = f"{{'descr': {descr}, 'fortran_order': {order}, 'shape': {shape}, }}\n".encode()
    return b"\x93NUMPY" + version + len(text).to_bytes(2 if version == b"\1\0" else 4, "little") + text


@pytest.mark.parametrize(
    ("content", "part"),
    [
        (npy("(1000000000, 1000000000, 1000000000)"), "is cut short"),
        (npy("(-2, 3, 4)"), "its header is not understood"),
        (npy("(0, 3, 4)"), "must be an array of three axes"),
        (npy("(2, 12)"), "must be an array of three axes, got 2 x 12"),
        (npy("()"), "must be an array of three axes, got one number"),
        (npy("(" + "1," * 3000 + ")"), "must be an array of three axes"),
        (npy("(" + "9" * 400 + ",1,1)"), "its header is not understood"),
        (npy(descr="'|O'"), "its header is not understood"),
        (npy(descr="'<c8'"), "unsupported type '<c8'"),
        (npy(descr="[('a', '<i2')]"), "its header is not understood"),
        (npy(order="__import__('os')"), "its header is not understood"),
        (npy(version=b"\7\0"), "is not an NPY file of version 1 to 3"),
        (b"\x93NUMPY\2\0\xff\xff\xff\x7f", "is damaged: a header of 2,147,483,647 bytes"),
        (npy()[:-9], "its header is not understood"),
    ],
)
def test_a_wrong_npy_in_one_line(content: bytes, part: str, tmp_path: Path) -> None:
    (tmp_path / "v.npy").write_bytes(content + DATA)
    assert part in message(tmp_path / "v.npy")


@pytest.mark.parametrize(
    ("notes", "part"),
    [
        ("", "does not say where the voxels are"),
        ("[" * 100_000, "does not say"),
        ("[]", "does not say"),
        (json.dumps({"shape": [2, 3, 4]}), "does not say"),
        (
            '{"shape": [2, 3, 4], "origin": [1e999, 0, 0], "directions": 3}',
            "must have an origin of 3 numbers",
        ),
        ('{"shape": [2, 3, 5], "origin": [0, 0, 0], "directions": []}', "is for another array: (2, 3, 5)"),
        (
            '{"shape": [2, 3, 4], "origin": [0, 0, 0], "directions": [[1, 0, 0], [1, 0, 0], [0, 0, 1]]}',
            "must have directions that are not zero and not equal",
        ),
    ],
)
def test_wrong_notes_beside_a_npy(notes: str, part: str, tmp_path: Path) -> None:
    (tmp_path / "v.npy").write_bytes(npy() + DATA)
    (tmp_path / "v.npy.json").write_text(notes)
    told = message(tmp_path / "v.npy")
    assert part in told
    assert told.startswith(f"{tmp_path}/v.npy.json: ")


def is_read_or_refused(path: Path) -> bool:
    """Whether there is a volume, or one line; no other error."""
    try:
        return read_volume(path, limit=100_000).values.ndim == 3
    except FileError as error:
        return "\n" not in str(error)


TEXT = " ".join(map(str, range(24))).encode()
STARTS = (
    header() + DATA,
    npy() + DATA,
    header(encoding="gzip") + gzip.compress(DATA),
    header(encoding="bzip2") + bz2.compress(DATA),
    header(encoding="ascii", endian=None) + TEXT,
    header(encoding="hex") + DATA.hex().encode(),
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    start=st.sampled_from(STARTS),
    changes=st.lists(st.tuples(st.integers(0, 400), st.binary(max_size=12), st.integers(0, 12)), max_size=6),
)
@example(start=STARTS[0], changes=[(0, b"", 0)])
def test_mutated_files_are_read_or_refused(
    start: bytes, changes: list[tuple[int, bytes, int]], tmp_path: Path
) -> None:
    content = bytearray(start)
    for place, new, taken in changes:
        content[place : place + taken] = new
    path = tmp_path / "v.nrrd"
    rewrite(path, bytes(content))
    assert is_read_or_refused(path)


words = st.sampled_from(
    [
        "1",
        "-1",
        "0",
        "nan",
        "1e999",
        "9" * 30,
        "(1,0,0)",
        "none",
        "(",
        ")",
        ",",
        "raw",
        "gzip",
        "big",
        "%d",
        "hex",
    ]
)


@settings(max_examples=200, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    fields=st.dictionaries(
        st.sampled_from(
            [*GOOD, "spacings", "axis mins", "axis maxs", "byte skip", "line skip", "data file", ":="]
        ),
        st.one_of(st.lists(words, max_size=5).map(" ".join), st.text(max_size=20)),
        max_size=5,
    )
)
def test_mutated_fields_are_read_or_refused(fields: dict[str, str], tmp_path: Path) -> None:
    path = tmp_path / "v.nrrd"
    rewrite(path, header(**{name.replace(" ", "_"): text for name, text in fields.items()}) + DATA)
    assert is_read_or_refused(path)
