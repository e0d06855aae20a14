"""The header of a NRRD file: reading those of others with distrust, and writing ours.

Format: "Definition of NRRD File Format" (teem.sourceforge.net/nrrd/format.html), versions 1 to 5. pynrrd is
not used for reading: it takes the memory that a header asks for before it looks at the file, inflates a
compressed file to its end, and follows `data file` out of the folder. The tests compare with it.
"""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NoReturn, TypeVar

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, Where, nearest, unknown_name

Doubles = npt.NDArray[np.float64]
Encoding = Literal["raw", "ascii", "hex", "gzip", "bzip2"]
Meaning = TypeVar("Meaning")

MAGIC = b"NRRD000"
LARGEST_HEADER = 8 << 20
"""Bytes; a scene has at most one million, which escapes may double."""
LARGEST_NUMBER = 1e30
"""Of a position or a step: squares of larger ones would leave the range of float64 in what follows."""

_ALIGNED = 64  # bytes; data that begin at such a place can be mapped and copied in whole vectors

_TYPES = {
    "i1": ("signed char", "int8", "int8_t"),
    "u1": ("unsigned char", "uchar", "uint8", "uint8_t"),
    "i2": ("short", "short int", "signed short", "signed short int", "int16", "int16_t"),
    "u2": ("unsigned short", "ushort", "unsigned short int", "uint16", "uint16_t"),
    "i4": ("int", "signed int", "int32", "int32_t"),
    "u4": ("unsigned int", "uint", "uint32", "uint32_t"),
    "i8": (
        *("int64", "longlong", "long long", "long long int", "signed long long", "signed long long int"),
        "int64_t",
    ),
    "u8": ("uint64", "ulonglong", "unsigned long long", "unsigned long long int", "uint64_t"),
    "f4": ("float",),
    "f8": ("double",),
}
_KIND_OF_TYPE = {name: kind for kind, names in _TYPES.items() for name in names}
_ENCODINGS: dict[str, Encoding] = {
    "raw": "raw",
    **dict.fromkeys(("ascii", "text", "txt"), "ascii"),
    "hex": "hex",
    **dict.fromkeys(("gzip", "gz"), "gzip"),
    **dict.fromkeys(("bzip2", "bz2"), "bzip2"),
}
COMPRESSED: tuple[Encoding, ...] = ("gzip", "bzip2")
"""Encodings whose data are compressed."""


@dataclass(frozen=True, slots=True)
class _Space:
    """A space: the signs that bring its coordinates to ours, and how many there are: four with a time."""

    signs: tuple[int, int, int]
    dimension: int


# Ours is left-posterior-superior, as in ITK and 3D Slicer: x to the left, y to the back, z up. Spaces that know nothing of
# a body are taken as ours if they are right-handed; a left-handed one has x reversed, so that nothing is mirrored.
_SIGNS: dict[tuple[str, ...], tuple[int, int, int]] = {
    ("right-anterior-superior", "ras"): (-1, -1, 1),
    ("left-anterior-superior", "las"): (1, -1, 1),
    ("left-posterior-superior", "lps"): (1, 1, 1),
    ("scanner-xyz",): (1, 1, 1),
    ("3d-right-handed",): (1, 1, 1),
    ("3d-left-handed",): (-1, 1, 1),
}
_SPACES = {
    **{name: _Space(signs, 3) for names, signs in _SIGNS.items() for name in names},
    # The names of the same with a time, such as left-posterior-superior-time and LPST.
    **{
        f"{name}{'t' if len(name) == 3 else '-time'}": _Space(signs, 4)
        for names, signs in _SIGNS.items()
        for name in names
    },
}
_KNOWN_SPACES = (
    "known: RAS, LAS, LPS or whole names, scanner-xyz, 3D-right-handed, 3D-left-handed, and these with -time"
)
_SAME = {
    "axismins": "axis mins",
    "axismaxs": "axis maxs",
    "centers": "centerings",
    "datafile": "data file",
    "lineskip": "line skip",
    "byteskip": "byte skip",
    "blocksize": "block size",
    "oldmin": "old min",
    "oldmax": "old max",
    "sampleunits": "sample units",
}
_USED = (
    *("type", "dimension", "sizes", "endian", "encoding", "data file", "line skip", "byte skip", "space"),
    *("space dimension", "space directions", "space origin", "spacings", "axis mins", "axis maxs"),
    "centerings",
)
_IGNORED = (
    *("content", "number", "block size", "min", "max", "old min", "old max", "sample units", "kinds"),
    *("labels", "units", "thicknesses", "space units", "measurement frame"),
)
_VECTOR = re.compile(r"\s*(?:\(([^()]*)\)|(none))")


@dataclass(frozen=True, slots=True, eq=False)
class Header:
    """What a header says.

    Attributes:
        dtype: of the stored values, in their byte order.
        shape: (nz, ny, nx), x being the fastest axis of the file.
        origin: the middle of the first voxel.
        directions: (3, 3), row i the step to the next voxel along array axis x, y, z.
        length: bytes up to the attached data.
        data_file: name of the file that holds the data, if it is another one; `data_place` is where the header says so.
        line_skip, byte_skip: what comes before the data; -1 bytes: the data are the end of the file.
        texts: keys and values that others, or we, have put in.
    """

    dtype: np.dtype[np.generic]
    shape: tuple[int, int, int]
    origin: Doubles
    directions: Doubles
    encoding: Encoding
    length: int
    data_file: str | None = None
    data_place: Where = field(default_factory=Where)
    line_skip: int = 0
    byte_skip: int = 0
    texts: Mapping[str, str] = field(default_factory=dict)


def parse(start: bytes, path: str | Path, *, whole: bool) -> Header:
    """Reads the header at the start of a file.

    Args:
        start: the first bytes of the file, at most LARGEST_HEADER.
        whole: whether these are all of the file.

    Raises:
        FileError: it is none, is damaged, or asks for what is not read here.
    """
    return _Parser(start, path, whole).header()


def text(header: Header) -> bytes:
    """A header, up to the place where the attached data begin; the values are little-endian."""
    lines = ["NRRD0004", "# Format: http://teem.sourceforge.net/nrrd/format.html"]
    rows = [_vector(row) for row in header.directions]
    lines += [
        f"type: {_TYPES[header.dtype.str[1:]][0]}",
        "dimension: 3",
        # The right-handed space whose coordinates ITK and 3D Slicer use without a change.
        "space: left-posterior-superior",
        "sizes: " + " ".join(str(side) for side in reversed(header.shape)),
        "space directions: " + " ".join(rows),
        "space origin: " + _vector(header.origin),
        "kinds: domain domain domain",
        "centerings: cell cell cell",
        "endian: little",
        f"encoding: {header.encoding}",
    ]
    for key, value in header.texts.items():
        if not re.fullmatch(r"[A-Za-z][\w .-]*", key):
            raise ValueError(f"a key of a NRRD file has letters and digits, got {key!r}")
        lines.append(f"{key}:={_escaped(value)}")
    plain = "\n".join(lines).encode() + b"\n"
    # Padded by a comment, so that the data begin at an offset where they can be mapped.
    missing = -(len(plain) + 3) % _ALIGNED
    return plain + b"#" + b" " * missing + b"\n\n"


def independent(directions: Doubles) -> bool:
    """Whether three steps span a volume: none is zero, and no plane holds them all."""
    lengths = np.linalg.norm(directions, axis=1)
    return bool(lengths.min() > 0 and abs(np.linalg.det(directions / lengths[:, None])) >= 1e-9)


def _vector(numbers: Doubles) -> str:
    return "(" + ",".join(repr(float(number)) for number in numbers) + ")"


def _escaped(value: str) -> str:
    return value.replace("\\", "\\\\").replace("\n", "\\n").replace("\r", "")


def _unescaped(value: str) -> str:
    return re.sub(r"\\([n\\])", lambda found: "\n" if found[1] == "n" else "\\", value)


class _Parser:
    """Fields of a header with their lines, and what is made of them."""

    def __init__(self, start: bytes, path: str | Path, whole: bool) -> None:
        self.path = str(path)
        self.fields: dict[str, tuple[int, str]] = {}
        self.texts: dict[str, str] = {}
        if not re.match(rb"NRRD000[1-5]\r?\n", start):
            self.fail("is not a NRRD file of version 1 to 5")
        found = re.search(rb"\n\r?\n", start)
        if found is None and not whole:
            self.fail(f"is damaged: its header is longer than {LARGEST_HEADER:,} bytes")
        self.length = len(start) if found is None else found.end()
        self.open_ended = found is None
        lines = start[: self.length].decode("utf-8", "replace").split("\n")
        for number, line in enumerate(lines[1:], start=2):
            stripped = line.rstrip("\r").rstrip()
            if stripped and not stripped.startswith("#"):
                self._line(number, stripped)

    def fail(self, message: str, name: str | None = None) -> NoReturn:
        """Raises FileError at the file, or at one of its fields."""
        raise FileError(message, self.place(name))

    def place(self, name: str | None) -> Where:
        """The file, or the line of one of its fields."""
        line = self.fields[name][0] if name in self.fields and name is not None else None
        return Where(self.path, line, None, name)

    def _line(self, number: int, line: str) -> None:
        pair, plain = line.find(":="), line.find(":")
        if 0 < pair <= plain:
            self.texts[line[:pair]] = _unescaped(line[pair + 2 :])
            return
        if plain < 1:
            raise FileError("is not a line of a NRRD header", Where(self.path, number))
        name = line[:plain].strip().lower()
        name = _SAME.get(name, name)
        if name not in _USED and name not in _IGNORED:
            raise FileError(unknown_name("field", name, _USED), Where(self.path, number))
        if name in self.fields:
            raise FileError("is given twice", Where(self.path, number, None, name))
        self.fields[name] = number, line[plain + 1 :].strip()

    def header(self) -> Header:
        encoding = self._word("encoding", _ENCODINGS)
        dtype = self._dtype(encoding)
        if self._whole_number("dimension") != 3:
            shown = self.value("dimension")[:20]
            self.fail(f"must be 3: only volumes of one value per voxel are read, got {shown}", "dimension")
        sizes = self._sizes()
        data_file = self._data_file()
        if data_file is None and self.open_ended:
            self.fail("is cut short: the file ends in its header")
        origin, directions = self._geometry(sizes)
        if (
            not np.isfinite([origin, *directions]).all()
            or np.abs([origin, *directions]).max() > LARGEST_NUMBER
        ):
            self.fail(f"has a position or direction beyond {LARGEST_NUMBER:g}")
        if not independent(directions):
            by = (name for name in ("space directions", "spacings", "axis maxs") if name in self.fields)
            self.fail("must be three steps in different directions, none of them zero", next(by, None))
        line_skip = self._skip("line skip", 0)
        byte_skip = self._skip("byte skip", -1 if encoding == "raw" else 0)
        if line_skip and encoding in COMPRESSED:
            self.fail("must be 0 before compressed data", "line skip")
        return Header(
            dtype=dtype,
            shape=(sizes[2], sizes[1], sizes[0]),
            origin=origin,
            directions=directions,
            encoding=encoding,
            length=self.length,
            data_file=data_file,
            data_place=self.place("data file"),
            line_skip=line_skip,
            byte_skip=byte_skip,
            texts=self.texts,
        )

    def value(self, name: str) -> str:
        if name not in self.fields:
            self.fail(f"is damaged: its header has no field {name!r}")
        return self.fields[name][1]

    def _dtype(self, encoding: Encoding) -> np.dtype[np.generic]:
        name = " ".join(self.value("type").lower().split())
        if name not in _KIND_OF_TYPE:
            known = ", ".join(names[0] for names in _TYPES.values())
            self.fail(f"unsupported type {name[:40]!r}; known: {known}", "type")
        kind = _KIND_OF_TYPE[name]
        if kind[1] == "1" or encoding == "ascii":  # which have no order of bytes
            return np.dtype(kind)
        order = self._word("endian", {"little": "<", "big": ">"})
        return np.dtype(order + kind)

    def _word(self, name: str, meanings: Mapping[str, Meaning]) -> Meaning:
        word = self.value(name).lower()
        if word not in meanings:
            self.fail(unknown_name(name, word, meanings), name)
        return meanings[word]

    def _whole_number(self, name: str) -> int:
        written = self.value(name)
        if not re.fullmatch(r"[+-]?\d{1,18}", written, re.ASCII):
            self.fail(f"must be a whole number, got {written[:40]!r}", name)
        return int(written)

    def _skip(self, name: str, least: int) -> int:
        if name not in self.fields:
            return 0
        count = self._whole_number(name)
        if count < least:
            self.fail(f"must be at least {least}, got {count}", name)
        return count

    def _sizes(self) -> list[int]:
        written = self.value("sizes").split()
        if len(written) != 3 or not all(re.fullmatch(r"[+-]?\d{1,18}", word, re.ASCII) for word in written):
            self.fail(f"must be 3 whole numbers, got {' '.join(written)[:60]!r}", "sizes")
        sizes = [int(word) for word in written]
        if min(sizes) < 1:
            self.fail(f"must be at least 1, got {min(sizes)}", "sizes")
        return sizes

    def _data_file(self) -> str | None:
        if "data file" not in self.fields:
            return None
        name = self.value("data file")
        # A list of files, or a pattern with numbers: one file for each slice.
        if re.match(r"LIST\b", name) or re.search(r"%\d*d", name):
            self.fail("data in several files are not read", "data file")
        parts = Path(name).parts
        if not name or "\0" in name or Path(name).is_absolute() or ".." in parts or "://" in name:
            self.fail(f"must be a path inside the header's folder, got {name[:80]!r}", "data file")
        return name

    def _numbers(self, name: str, count: int) -> list[float]:
        return self._floats(name, self.value(name).split(), count)

    def _floats(self, name: str, words: list[str], count: int) -> list[float]:
        if len(words) != count:
            self.fail(f"must be {count} numbers, got {len(words)}", name)
        numbers = []
        for word in words:
            try:
                numbers.append(float(word[:80]))
            except ValueError:
                self.fail(f"must be numbers, got {word[:40]!r}", name)
        return numbers

    def _vectors(self, name: str, count: int, length: int) -> Doubles:
        """As many vectors, each of so many numbers, in parentheses."""
        rows: list[list[float]] = []
        written, place = self.value(name), 0
        while len(rows) <= count and (found := _VECTOR.match(written, place)):
            if found[2]:
                self.fail("must be three directions: only volumes of one value per voxel are read", name)
            rows.append(self._floats(name, re.split(r"[\s,]+", found[1].strip()), length))
            place = found.end()
        if len(rows) != count or written[place:].strip():
            vector = "(x,y,z)" if length == 3 else "(x,y,z,t)"
            what = f"a vector {vector}" if count == 1 else f"{count} vectors {vector}"
            self.fail(f"must be {what}, got {written[:80]!r}", name)
        return np.array(rows, np.float64)

    def _geometry(self, sizes: list[int]) -> tuple[Doubles, Doubles]:
        """Origin and directions, by the fields of a space or else by those of single axes."""
        space = _Space((1, 1, 1), 3)
        if "space" in self.fields:
            space = self._space(self.value("space"))
        if "space dimension" in self.fields and self._whole_number("space dimension") != space.dimension:
            shown = f" in the space {self.value('space')[:40]}" if "space" in self.fields else ""
            self.fail(f"must be {space.dimension}{shown}", "space dimension")
        origin = np.zeros(3)
        if "space directions" in self.fields:
            found = self._vectors("space directions", 3, space.dimension)
            if found[:, 3:].any():
                self.fail("must be three directions in space: none may go along the time", "space directions")
            directions = found[:, :3]
        else:
            steps, origin = self._axes(sizes)
            directions = np.diag(steps)
        if "space origin" in self.fields:
            origin = self._vectors("space origin", 1, space.dimension)[0, :3]
        # (No -0, which files would show.)
        return origin * space.signs + 0.0, directions * space.signs + 0.0

    def _space(self, name: str) -> _Space:
        known = _SPACES.get(name.lower())
        if known is None:
            near = nearest(name.lower(), _SPACES)
            hint = f"did you mean {near!r}?" if near else _KNOWN_SPACES
            self.fail(f"unknown space {name[:40]!r}; {hint}", "space")
        return known

    def _axes(self, sizes: list[int]) -> tuple[list[float], Doubles]:
        """Steps along the axes and the middle of the first voxel, from the fields of NRRD's first version."""
        steps = self._numbers("spacings", 3) if "spacings" in self.fields else [math.nan] * 3
        low = self._numbers("axis mins", 3) if "axis mins" in self.fields else [math.nan] * 3
        high = self._numbers("axis maxs", 3) if "axis maxs" in self.fields else [math.nan] * 3
        words = self.value("centerings").lower().split() if "centerings" in self.fields else []
        node = [word == "node" for word in words] if len(words) == 3 else [False] * 3
        origin = np.zeros(3)
        for axis in range(3):
            if math.isnan(steps[axis]):  # which the format allows for "unknown"
                parts = max(sizes[axis] - 1, 1) if node[axis] else sizes[axis]
                span = (high[axis] - low[axis]) / parts
                steps[axis] = 1.0 if math.isnan(span) else span
            if not math.isnan(low[axis]):
                origin[axis] = low[axis] + (0.0 if node[axis] else steps[axis] / 2)
        return steps, origin
