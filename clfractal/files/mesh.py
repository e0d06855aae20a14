"""Meshes in files: PLY, STL, OBJ and GLB, written piece by piece.

They are written by hand. trimesh, which the tests read them back with, builds a whole file in memory: for a
million vertices and two million triangles it takes 230 MB (PLY) to 1 GB (OBJ) beside the mesh, where 1 to 64
suffice, and twice the time; and it writes colours into a GLB as sRGB, where the format says linear.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import accumulate
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
import numpy.typing as npt

from clfractal.errors import arguments
from clfractal.files.atomic import atomic_writer, check_output, file_error
from clfractal.files.inputs import refuse_overwriting
from clfractal.files.srgb import encode

EXTENSIONS = (".ply", ".stl", ".obj", ".glb")
"""Of the formats, in lower case."""
SINGLE_PRECISION = (".stl", ".glb")
"""Those whose coordinates are 32-bit numbers, always."""

_ROWS = 1 << 17  # vertices or triangles at once
_LARGEST_GLB = (1 << 32) - 1
# glTF 2.0, section 5.1: types of components and targets of buffer views.
_FLOAT, _USHORT, _UINT, _ARRAY, _ELEMENTS = 5126, 5123, 5125, 34962, 34963


@dataclass(frozen=True, slots=True, eq=False)
class Mesh:
    """Triangles.

    Attributes:
        vertices: (n, 3), scene units, right-handed, z up.
        triangles: (m, 3), indices of vertices, counter-clockwise seen from outside.
        normals: (n, 3), unit length, or None.
        colors: (n, 3), linear Rec. 709, 0 to 1, or None.
        text: the scene that made it, kept in files; or empty.
        inputs: files that were read for it, which `save` does not replace.
        remarks: those on the volume that it is the surface of; mostly none.
    """

    vertices: npt.NDArray[np.float64]
    triangles: npt.NDArray[np.int32]
    normals: npt.NDArray[Any] | None = None
    colors: npt.NDArray[Any] | None = None
    text: str = ""
    inputs: tuple[Path, ...] = ()
    remarks: tuple[str, ...] = ()

    def save(self, path: str | Path) -> None:
        """Writes the mesh: .ply, .stl, .obj or .glb; see `write_mesh`.

        Raises:
            FileError: it cannot be written, is one of the files that were read for the mesh, or it has no triangle.
        """
        checked = arguments.path_of("path", path)
        check_output(checked, EXTENSIONS)
        refuse_overwriting([checked], self.inputs)
        write_mesh(checked, self)


def write_mesh(path: str | Path, mesh: Mesh) -> None:
    """Writes a mesh in the format of the path's extension; it appears complete or not at all.

    PLY and OBJ have 64-bit coordinates where 32 bits are too few. Colours are sRGB in PLY (8 bits) and OBJ
    (after the coordinates, as most programs read them), linear in GLB (16 bits); STL has neither colours nor
    normals of vertices. GLB is y up: a point (x, y, z) is (x, z, -y) there. The mesh's text is kept as comments in PLY
    and OBJ, in `asset.extras.clfractal` of GLB, not in STL.

    Raises:
        FileError: the file cannot be written; an unknown extension; a mesh without triangles, or one that is too
            fine or too large for the format.
    """
    suffix = Path(path).suffix.lower()
    writers: dict[str, Callable[[BinaryIO, Mesh, str], None]] = {
        ".ply": _write_ply,
        ".stl": _write_stl,
        ".obj": _write_obj,
        ".glb": _write_glb,
    }
    if suffix not in writers:
        raise file_error(path, f"unknown extension {suffix!r}; known: {', '.join(EXTENSIONS)}", "")
    if not len(mesh.triangles):
        raise file_error(path, "cannot be written: the mesh has no triangle", "")
    if suffix in SINGLE_PRECISION and _is_fine(mesh):
        raise file_error(path, f"cannot be written: {TOO_FINE}", "")
    glb_length = sum(size * count for _, size, _, _, count in _glb_parts(mesh))
    if suffix == ".glb" and glb_length + 65_536 + 4 * len(mesh.text) > _LARGEST_GLB:
        raise file_error(path, "cannot be written: the mesh is too large for GLB, which ends at 4 GB", "")
    with atomic_writer(path) as beside, open(beside, "wb", buffering=1 << 20) as stream:
        writers[suffix](stream, mesh, mesh.text)


TOO_FINE = "its 32-bit coordinates cannot hold so small triangles so far from the origin; .ply and .obj can"


def is_too_fine(step: float, reach: float) -> bool:
    """Whether 32-bit numbers as large as `reach` have less than 64 places in a `step`."""
    return step < 64 * 2.0**-23 * reach


def _is_fine(mesh: Mesh) -> bool:
    some = mesh.vertices[mesh.triangles[:: 1 + len(mesh.triangles) // 10_000]]
    lengths = np.linalg.norm(some[:, 1] - some[:, 0], axis=1)
    reach = max(abs(float(mesh.vertices.min())), abs(float(mesh.vertices.max())))
    return is_too_fine(float(np.median(lengths)), reach)


def _pieces(count: int) -> Iterator[slice]:
    for start in range(0, count, _ROWS):
        yield slice(start, min(start + _ROWS, count))


def _srgb(colors: npt.NDArray[Any]) -> npt.NDArray[np.float64]:
    return encode(np.clip(np.nan_to_num(colors.astype(np.float64)), 0, 1))


def _comments(text: str, mark: str) -> str:
    """The lines of a text, each behind a mark; in ASCII, which is all that PLY allows."""
    plain = text.encode("ascii", "backslashreplace").decode("ascii")
    return "".join(f"{mark} {line}\n" for line in plain.splitlines())


# --- PLY: Greg Turk, "The PLY Polygon File Format", 1994 ---


_PLY_TYPES = {"<f8": "double", "<f4": "float", "u1": "uchar"}


def _write_ply(stream: BinaryIO, mesh: Mesh, text: str) -> None:
    kind = "<f8" if _is_fine(mesh) else "<f4"
    fields = [
        *((name, kind) for name in "xyz"),
        *((name, "<f4") for name in ("nx", "ny", "nz") if mesh.normals is not None),
        *((name, "u1") for name in ("red", "green", "blue") if mesh.colors is not None),
    ]
    lines = [f"property {_PLY_TYPES[kind]} {name}" for name, kind in fields]
    head = (
        f"ply\nformat binary_little_endian 1.0\n{_comments(text, 'comment')}"
        f"element vertex {len(mesh.vertices)}\n" + "\n".join(lines) + "\n"
        f"element face {len(mesh.triangles)}\nproperty list uchar int vertex_indices\nend_header\n"
    )
    stream.write(head.encode("ascii"))
    for part in _pieces(len(mesh.vertices)):
        rows = np.empty(part.stop - part.start, fields)
        columns = [
            mesh.vertices[part].T,
            *([mesh.normals[part].T] if mesh.normals is not None else []),
            *([np.rint(255 * _srgb(mesh.colors[part])).T] if mesh.colors is not None else []),
        ]
        for (name, _), column in zip(fields, np.concatenate(columns), strict=True):
            rows[name] = column
        stream.write(rows.tobytes())
    for part in _pieces(len(mesh.triangles)):
        faces = np.empty(part.stop - part.start, [("count", "u1"), ("corners", "<i4", 3)])
        faces["count"], faces["corners"] = 3, mesh.triangles[part]
        stream.write(faces.tobytes())


# --- STL: 3D Systems, "StereoLithography Interface Specification", 1989 ---


def _write_stl(stream: BinaryIO, mesh: Mesh, _text: str) -> None:
    # Must not begin with "solid", which marks the format's text form.
    stream.write(b"clfractal, binary STL".ljust(80, b"\0") + struct.pack("<I", len(mesh.triangles)))
    for part in _pieces(len(mesh.triangles)):
        corners = mesh.vertices[mesh.triangles[part]]
        flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        flat /= np.maximum(np.linalg.norm(flat, axis=1), 1e-300)[:, None]
        rows = np.zeros(
            len(corners), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")]
        )
        rows["normal"], rows["corners"] = flat, corners
        stream.write(rows.tobytes())


# --- OBJ: Wavefront, "Advanced Visualizer Manual", appendix B1 ---


def _write_obj(stream: BinaryIO, mesh: Mesh, text: str) -> None:
    stream.write(_comments(text, "#").encode("ascii"))
    number = "%.17g" if _is_fine(mesh) else "%.9g"
    line = f"v {number} {number} {number}" + (" %.4g %.4g %.4g" if mesh.colors is not None else "") + "\n"
    for part in _pieces(len(mesh.vertices)):
        rows = mesh.vertices[part]
        if mesh.colors is not None:
            rows = np.concatenate([rows, _srgb(mesh.colors[part])], axis=1)
        _write_lines(stream, line, rows)
    if mesh.normals is not None:
        for part in _pieces(len(mesh.vertices)):
            _write_lines(stream, "vn %.5g %.5g %.5g\n", mesh.normals[part])
    for part in _pieces(len(mesh.triangles)):
        corners = mesh.triangles[part].astype(np.int64) + 1
        if mesh.normals is not None:
            _write_lines(stream, "f %d//%d %d//%d %d//%d\n", np.repeat(corners, 2, axis=1))
        else:
            _write_lines(stream, "f %d %d %d\n", corners)


def _write_lines(stream: BinaryIO, line: str, rows: npt.NDArray[Any]) -> None:
    stream.write("".join([line % tuple(row) for row in rows.tolist()]).encode("ascii"))


# --- GLB: Khronos, "glTF 2.0 Specification", sections 3.6, 3.7 and 4.4 ---


def _glb_parts(mesh: Mesh) -> list[tuple[str, int, int, str, int]]:
    """Attribute, bytes of an element, type of its components, its shape, and how many; the indices last."""
    count = len(mesh.vertices)
    return [
        ("POSITION", 12, _FLOAT, "VEC3", count),
        *([("NORMAL", 12, _FLOAT, "VEC3", count)] if mesh.normals is not None else []),
        *([("COLOR_0", 8, _USHORT, "VEC4", count)] if mesh.colors is not None else []),
        ("", 4, _UINT, "SCALAR", 3 * len(mesh.triangles)),
    ]


def _y_up(vectors: npt.NDArray[Any]) -> npt.NDArray[np.float32]:
    return np.stack(
        [vectors[:, 0], vectors[:, 2], -vectors[:, 1]], axis=1, dtype=np.float32, casting="same_kind"
    )


def _write_glb(stream: BinaryIO, mesh: Mesh, text: str) -> None:
    parts = _glb_parts(mesh)
    *offsets, length = accumulate((size * count for _, size, _, _, count in parts), initial=0)
    ends = _y_up(np.stack([mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)]))
    more: dict[str, dict[str, Any]] = {
        "POSITION": {"min": ends.min(axis=0).tolist(), "max": ends.max(axis=0).tolist()},
        "COLOR_0": {"normalized": True},
    }
    views = [
        {
            "buffer": 0,
            "byteOffset": offset,
            "byteLength": size * count,
            "target": _ARRAY if name else _ELEMENTS,
        }
        for (name, size, _, _, count), offset in zip(parts, offsets, strict=True)
    ]
    accessors = [
        {"bufferView": number, "componentType": kind, "count": count, "type": shape, **more.get(name, {})}
        for number, (name, _, kind, shape, count) in enumerate(parts)
    ]
    attributes = {name: number for number, (name, *_) in enumerate(parts) if name}
    scene = {
        "asset": {
            "version": "2.0",
            "generator": "clfractal",
            **({"extras": {"clfractal": text}} if text else {}),
        },
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": len(parts) - 1, "material": 0}]}],
        "materials": [
            {"pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 0.6}, "doubleSided": True}
        ],
        "buffers": [{"byteLength": length}],
        "bufferViews": views,
        "accessors": accessors,
    }
    words = json.dumps(scene).encode()
    words += b" " * (-len(words) % 4)
    stream.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(words) + 8 + length))
    stream.write(struct.pack("<I4s", len(words), b"JSON") + words)
    stream.write(struct.pack("<I4s", length, b"BIN\0"))
    for vectors in (mesh.vertices, mesh.normals):
        if vectors is not None:
            for part in _pieces(len(vectors)):
                stream.write(_y_up(vectors[part]).astype("<f4").tobytes())
    if mesh.colors is not None:
        for part in _pieces(len(mesh.vertices)):
            rows = np.full((part.stop - part.start, 4), 65_535, "<u2")
            rows[:, :3] = np.rint(65_535 * np.clip(np.nan_to_num(mesh.colors[part]), 0, 1))
            stream.write(rows.tobytes())
    for part in _pieces(len(mesh.triangles)):
        stream.write(mesh.triangles[part].astype("<u4").tobytes())
