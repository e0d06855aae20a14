"""Volumes in files: NRRD, which keeps where the voxels are, and NPY with the same in a JSON file beside it.

A header may ask for anything. What it asks for is compared with the size of the file, and with the memory
that is left, before any memory is taken.
"""

from __future__ import annotations

import gzip
import json
import os
import re
from collections.abc import Iterable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, BinaryIO, Literal, cast

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, arguments
from clfractal.files import nrrd, volume_checks, voxel_data
from clfractal.files.atomic import ContentError, atomic_writer, check_output, file_error, reading
from clfractal.files.inputs import refuse_overwriting
from clfractal.files.regular import read_text_file
from clfractal.files.system import flush

Values = npt.NDArray[Any]
Doubles = npt.NDArray[np.float64]
Format = Literal["nrrd", "npy"]

EXTENSIONS = (".nrrd", ".npy")
"""Of the formats that are written, in lower case; `.nhdr` is read, too."""
SCENE_KEY = "clfractal"
"""Under which of a volume's texts the scene stands that made it."""
BESIDE = ".json"
"""What is added to a NPY file's name for the file that keeps what NPY cannot."""

_PIECE = 1 << 20  # bytes written or compressed at once, so that Ctrl-C is heard in between
# Bytes after which the file is flushed to the disk: flushing a large file only at its end takes seconds, in which
# Ctrl-C could not be handled properly.
_FLUSHED = 16 << 20
_NPY_MAGIC = b"\x93NUMPY"
_NPY_HEADER = re.compile(
    r"\{\s*'descr':\s*'([<>|=][a-z]\d{1,2})',\s*'fortran_order':\s*(True|False),"
    r"\s*'shape':\s*\((\s*\d{1,18}L?(?:\s*,\s*\d{1,18}L?)*\s*,?\s*)?\),?\s*\}\s*",
    re.ASCII,
)
_LARGEST_NPY_HEADER = 10_000  # bytes; NumPy's own limit


@dataclass(frozen=True, slots=True, eq=False)
class Volume:
    """Values on a grid.

    Attributes:
        values: shape (nz, ny, nx), of an integer or float type in the machine's byte order. It may be a file
            that is mapped, and then is read only. Anything that NumPy makes such an array of is taken.
        origin: the middle of the first voxel, scene units, shape (3,).
        directions: shape (3, 3), row i the step from a voxel to the next along x, y, z, the last array axis
            being x; scene units.
        texts: what else is told of it, by keys; under `SCENE_KEY` the scene that made it.
        inputs: files that were read for it, which `save` does not replace.
        remarks: on a grid that holds less than it could, one line each; mostly none.

    Raises:
        SceneError: an argument is of another kind or shape, or the directions lie in a plane; its path names it.
    """

    values: Values
    origin: Doubles = field(default_factory=lambda: np.zeros(3))
    directions: Doubles = field(default_factory=lambda: np.eye(3))
    texts: Mapping[str, str] = field(default_factory=dict)
    inputs: tuple[Path, ...] = ()
    remarks: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, checked in (
            ("values", volume_checks.grid_of(self.values)),
            ("origin", volume_checks.doubles("origin", self.origin, (3,), "3 numbers")),
            ("directions", volume_checks.steps(self.directions)),
            ("texts", volume_checks.texts(self.texts)),
            ("inputs", volume_checks.paths(self.inputs)),
            ("remarks", tuple(arguments.words("remarks", self.remarks))),
        ):
            object.__setattr__(self, name, checked)

    @property
    def spacing(self) -> Doubles:
        """Distances between voxels along x, y, z, scene units."""
        return np.asarray(np.linalg.norm(self.directions, axis=1), np.float64)

    def save(self, path: str | Path, *, compress: bool = False) -> None:
        """Writes the volume: .nrrd, or .npy with a .json beside it; see `write_volume`.

        Raises:
            FileError: it cannot be written, or is one of the files that were read for the volume.
        """
        checked = arguments.path_of("path", path)
        check_output(checked, EXTENSIONS)
        refuse_overwriting([checked], self.inputs)
        write_volume(checked, self, compress=arguments.flag("compress", compress))

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> Values:
        """The values; `np.asarray(volume)` calls this, without copying them."""
        if copy is None:
            return np.asarray(self.values, dtype)
        return np.array(self.values, dtype, copy=copy)


def read_volume(path: str | Path, *, limit: int | None = None) -> Volume:
    """Reads a volume, by its content: NRRD (attached or detached, in any of its encodings) or NPY.

    Large data that are stored as this machine wants them are mapped, and take no memory until they are used.

    Args:
        limit: bytes of memory that may be taken; what is left on the machine if None.

    Raises:
        FileError: it cannot be read, is of another kind, damaged, cut short, or too large for memory.
    """
    with reading(path) as stream:
        start = stream.read(8)
        if start.startswith(nrrd.MAGIC):
            return _read_nrrd(path, stream, limit)
        if start.startswith(_NPY_MAGIC):
            return _read_npy(path, stream, limit)
        raise ContentError("is neither a NRRD nor a NPY file")


def write_volume(path: str | Path, volume: Volume, *, compress: bool = False) -> None:
    """Writes a volume that is in memory; see `write_slabs`."""
    rows = max(1, _PIECE // max(1, volume.values[0].nbytes))
    slabs = (volume.values[start : start + rows] for start in range(0, len(volume.values), rows))
    write_slabs(path, slabs, volume.values.shape, volume.values.dtype, volume, compress=compress)


def write_slabs(
    path: str | Path,
    slabs: Iterable[Values],
    shape: tuple[int, ...],
    dtype: npt.DTypeLike,
    place: Volume,
    *,
    compress: bool = False,
) -> None:
    """Writes a volume slab by slab; it appears complete or not at all, little-endian.

    Args:
        path: .nrrd, or .npy, beside which `.npy.json` keeps the geometry and the texts.
        slabs: arrays (planes, ny, nx), from the lowest z to the highest.
        shape: (nz, ny, nx) of all of them together.
        dtype: what the values are stored as; 16-bit floats become 32-bit ones in NRRD, which has none.
        place: whose geometry and texts are written; its values are not looked at.
        compress: by gzip; NRRD only.

    Raises:
        FileError: the file cannot be written, or its extension is unknown.
    """
    if len(shape) != 3:
        raise ValueError(f"a volume has the shape (nz, ny, nx), got {shape}")
    stored = _stored(np.dtype(dtype), half=_format(path) == "npy")
    origin = np.asarray(place.origin, np.float64)
    directions = np.asarray(place.directions, np.float64)
    with ExitStack() as stack:
        beside = stack.enter_context(atomic_writer(path))
        stream = stack.enter_context(open(beside, "wb"))
        if _format(path) == "npy":
            np.lib.format.write_array_header_1_0(
                stream, {"descr": stored.str, "fortran_order": False, "shape": tuple(shape)}
            )
            notes = {
                "shape": list(shape),
                "origin": origin.tolist(),
                "directions": directions.tolist(),
                "texts": dict(place.texts),
            }
            # Both files get their names only when both are complete.
            other = stack.enter_context(atomic_writer(f"{path}{BESIDE}"))
            other.write_text(json.dumps(notes, indent=1) + "\n", encoding="utf-8")
            _write_values(stream, slabs, shape, stored)
            return
        head = nrrd.Header(
            stored,
            cast(tuple[int, int, int], tuple(shape)),
            origin,
            directions,
            "gzip" if compress else "raw",
            0,
            texts=place.texts,
        )
        stream.write(nrrd.text(head))
        if compress:
            # No name and no time inside: the same volume gives the same file. Level 1: for fractals higher
            # ones take several times as long for a few percent.
            with gzip.GzipFile("", "wb", 1, stream, 0) as packed:
                _write_values(cast(BinaryIO, packed), slabs, shape, stored)
        else:
            _write_values(stream, slabs, shape, stored)


def _format(path: str | Path) -> Format:
    suffix = Path(path).suffix.lower()
    if suffix not in EXTENSIONS:
        raise file_error(path, f"unknown extension {suffix!r}; known: {', '.join(EXTENSIONS)}", "")
    return "npy" if suffix == ".npy" else "nrrd"


def _stored(dtype: np.dtype[Any], *, half: bool) -> np.dtype[Any]:
    """The type of a file's numbers for one in memory."""
    if dtype.kind == "b":
        return np.dtype(np.uint8)
    if dtype.kind not in "iuf" or dtype.itemsize > 8:
        raise ValueError(f"a volume has integers or floats of up to 64 bits, got {dtype}")
    if dtype == np.float16 and not half:
        return np.dtype("<f4")
    return dtype.newbyteorder("<")


def _write_values(
    stream: Any, slabs: Iterable[Values], shape: tuple[int, ...], stored: np.dtype[Any]
) -> None:
    planes, waiting = 0, 0
    for slab in slabs:
        if slab.shape[1:] != tuple(shape[1:]):
            raise ValueError(f"a slab of a volume of shape {shape} has the shape {slab.shape}")
        planes += len(slab)
        plain: Any = np.ascontiguousarray(slab, stored).reshape(-1).view(np.uint8)
        for start in range(0, len(plain), _PIECE):
            piece = memoryview(plain[start : start + _PIECE])
            waiting += len(piece)
            stream.write(piece)
            if waiting >= _FLUSHED:
                flush(stream.fileno())
                waiting = 0
    flush(stream.fileno())
    if planes != shape[0]:
        raise ValueError(f"a volume of {shape[0]} planes got {planes}")


# --- reading ---


def _read_nrrd(path: str | Path, stream: BinaryIO, limit: int | None) -> Volume:
    stream.seek(0)
    start = stream.read(nrrd.LARGEST_HEADER)
    head = nrrd.parse(start, path, whole=len(start) < nrrd.LARGEST_HEADER)
    if head.data_file is None:
        values = voxel_data.read(stream, head, head.length, limit)
    else:
        named = Path(path).parent / head.data_file
        if not os.path.realpath(named).startswith(os.path.realpath(Path(path).parent) + os.sep):
            raise ContentError(f"must have its data inside its folder, got {head.data_file[:80]!r}")
        with reading(named) as data:
            if os.path.samestat(os.fstat(data.fileno()), os.fstat(stream.fileno())):
                raise FileError(
                    "must be another file: this one is the header, and holds no voxels", head.data_place
                )
            values = voxel_data.read(data, head, 0, limit)
    return Volume(values, head.origin, head.directions, head.texts)


def _read_npy(path: str | Path, stream: BinaryIO, limit: int | None) -> Volume:
    """Layout: NumPy Enhancement Proposal 1. The header is a literal of Python; only the canonical form is read."""
    stream.seek(6)
    version = stream.read(2)
    width = {b"\1\0": 2, b"\2\0": 4, b"\3\0": 4}.get(version)
    if width is None:
        raise ContentError("is not an NPY file of version 1 to 3")
    length = int.from_bytes(stream.read(width), "little")
    if length > _LARGEST_NPY_HEADER:
        raise ContentError(f"is damaged: a header of {length:,} bytes")
    found = _NPY_HEADER.fullmatch(stream.read(length).decode("utf-8", "replace"))
    if found is None:
        raise ContentError("is damaged, or holds no plain array: its header is not understood")
    dtype = _npy_dtype(found[1])
    sides = [int(word.strip(" L")) for word in (found[3] or "").split(",") if word.strip()]
    if len(sides) != 3 or 0 in sides:
        shown = " x ".join(f"{side:,}" for side in sides[:8]) or "one number"
        raise ContentError(f"must be an array of three axes, got {shown}")
    offset = 8 + width + length
    if found[2] == "True":
        turned = voxel_data.plain(stream, dtype, (sides[2], sides[1], sides[0]), offset, limit)
        values = voxel_data.room(turned.dtype, (sides[0], sides[1], sides[2]), limit)
        values[...] = turned.T
    else:
        values = voxel_data.plain(stream, dtype, (sides[0], sides[1], sides[2]), offset, limit)
    origin, directions, texts = _notes(path, values.shape)
    return Volume(values, origin, directions, texts)


def _npy_dtype(word: str) -> np.dtype[Any]:
    kind = word[1:]
    if kind == "b1":
        return np.dtype(np.uint8)
    if kind not in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2", "f4", "f8"):
        raise ContentError(f"unsupported type {word!r}; known: integers and floats of up to 64 bits")
    return np.dtype(("=" if word[0] in "=|" else word[0]) + kind)


def _notes(path: str | Path, shape: tuple[int, ...]) -> tuple[Doubles, Doubles, dict[str, str]]:
    """Origin, directions and texts from the file beside; voxels of size 1, from 0 on, without one."""
    beside = Path(f"{path}{BESIDE}")
    if not beside.exists():
        return np.zeros(3), np.eye(3), {}
    try:
        notes = json.loads(read_text_file(beside, limit=nrrd.LARGEST_HEADER))
        origin = np.array(notes["origin"], np.float64)
        directions = np.array(notes["directions"], np.float64)
        texts = {str(key): str(text) for key, text in dict(notes.get("texts", {})).items()}
        sides = tuple(notes["shape"])
    except FileError:
        raise
    except (ValueError, TypeError, KeyError, AttributeError, RecursionError, OverflowError) as error:
        raise file_error(
            beside, "does not say where the voxels are: needs shape, origin, directions", ""
        ) from error
    if sides != shape:
        raise file_error(beside, f"is for another array: {sides!r:.60}, not {shape!r}", "")
    numbers = np.concatenate([origin.reshape(-1), directions.reshape(-1)])
    fits = origin.shape == (3,) and directions.shape == (3, 3)
    if not fits or not np.isfinite(numbers).all() or np.abs(numbers).max() > nrrd.LARGEST_NUMBER:
        raise file_error(beside, "must have an origin of 3 numbers and directions of 3 x 3", "")
    if not nrrd.independent(directions):
        raise file_error(beside, "must have directions that are not zero and not equal", "")
    return origin, directions, texts
