"""Meshes in files: an independent reader finds the same; whole files or none."""

from __future__ import annotations

import json
import struct
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from clfractal.errors import FileError
from clfractal.files import mesh as module
from clfractal.files.mesh import Mesh, write_mesh
from clfractal.files.srgb import encode

SCENE = "version: 1\nformula: {name: hast}  # ä\n"


def ball(count: int = 3) -> Mesh:
    """A sphere around a point off the origin, no two axes alike."""
    sphere: Any = trimesh.creation.icosphere(subdivisions=count)
    normals = np.asarray(sphere.vertices, np.float64)
    vertices = normals * (1.0, 2.0, 0.5) + (3.0, -1.0, 0.25)
    colors = 0.5 + 0.5 * normals
    return Mesh(
        vertices, np.asarray(sphere.faces, np.int32), normals.astype(np.float32), colors.astype(np.float32)
    )


def load(path: Path) -> Any:
    """The mesh of a file as it is: nothing joined, nothing sorted."""
    found: Any = trimesh.load(path, process=False)
    return next(iter(found.geometry.values())) if path.suffix == ".glb" else found


def colors_of(found: Any) -> Any:
    """RGB, 0 to 1, as stored."""
    colors = (
        found.visual.vertex_attributes["color"]
        if found.visual.kind == "texture"
        else found.visual.vertex_colors
    )
    return colors[:, :3] / np.iinfo(colors.dtype).max


def z_up(vectors: Any) -> Any:
    """From y up."""
    return np.stack([vectors[:, 0], -vectors[:, 2], vectors[:, 1]], axis=1)


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
@pytest.mark.parametrize("rows", [50, 1 << 17])
def test_what_is_written_is_read_by_trimesh(
    suffix: str, rows: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(module, "_ROWS", rows)
    mesh, path = ball(), tmp_path / f"ball{suffix}"
    write_mesh(path, replace(mesh, text=SCENE))
    found = load(path)
    turn = z_up if suffix == ".glb" else np.asarray
    assert mesh.normals is not None
    assert mesh.colors is not None
    assert np.array_equal(found.faces, mesh.triangles)
    assert np.abs(turn(found.vertices) - mesh.vertices).max() < 1e-6
    assert np.abs(turn(found.vertex_normals) - mesh.normals).max() < 1e-4
    assert found.is_watertight
    assert found.volume == pytest.approx(4 / 3 * np.pi * 1 * 2 * 0.5, rel=0.03)  # turned outward
    expected = mesh.colors if suffix == ".glb" else encode(mesh.colors.astype(np.float64))
    assert np.abs(colors_of(found) - expected).max() < 1 / 250


def test_stl(tmp_path: Path) -> None:
    mesh, path = ball(), tmp_path / "ball.stl"
    write_mesh(path, mesh)
    found: Any = trimesh.load(path, process=True)
    assert len(found.faces) == len(mesh.triangles)
    assert len(found.vertices) == len(mesh.vertices)  # those of the same place are joined
    assert found.is_watertight
    raw = np.frombuffer(path.read_bytes()[84:], [("n", "<f4", 3), ("v", "<f4", (3, 3)), ("a", "<u2")])
    corners = mesh.vertices[mesh.triangles]
    flat = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    flat /= np.linalg.norm(flat, axis=1)[:, None]
    assert np.abs(raw["n"] - flat).max() < 1e-6
    assert np.abs(raw["v"] - corners).max() < 1e-6


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
@pytest.mark.parametrize("without", ["normals", "colors"])
def test_meshes_without_normals_or_colors(suffix: str, without: str, tmp_path: Path) -> None:
    whole = ball(1)
    mesh = Mesh(
        whole.vertices,
        whole.triangles,
        None if without == "normals" else whole.normals,
        None if without == "colors" else whole.colors,
    )
    write_mesh(tmp_path / f"m{suffix}", mesh)
    found = load(tmp_path / f"m{suffix}")
    assert np.array_equal(found.faces, mesh.triangles)
    assert ("vertex_normals" in found._cache) == (without == "colors")
    has_colors = found.visual.kind == "vertex" or "color" in getattr(found.visual, "vertex_attributes", {})
    assert has_colors == (without == "normals")


def test_the_layout_of_glb(tmp_path: Path) -> None:
    """glTF 2.0: lengths, alignment, the box of the positions, 16-bit linear colours, and the scene."""
    mesh, path = ball(2), tmp_path / "m.glb"
    write_mesh(path, replace(mesh, text=SCENE))
    content = path.read_bytes()
    magic, version, length, words, kind = struct.unpack("<4sIII4s", content[:20])
    assert (magic, version, length, kind) == (b"glTF", 2, len(content), b"JSON")
    scene = json.loads(content[20 : 20 + words])
    size, kind = struct.unpack("<I4s", content[20 + words : 28 + words])
    assert kind == b"BIN\0"
    assert words % 4 == size % 4 == 0
    assert size == scene["buffers"][0]["byteLength"] == len(content) - 28 - words
    assert scene["asset"]["extras"]["clfractal"] == SCENE
    attributes = scene["meshes"][0]["primitives"][0]["attributes"]
    position = scene["accessors"][attributes["POSITION"]]
    assert position["max"] == pytest.approx([4.0, 0.75, 3.0])
    assert position["min"] == pytest.approx([2.0, -0.25, -1.0])
    color = scene["accessors"][attributes["COLOR_0"]]
    view = scene["bufferViews"][color["bufferView"]]
    start = 28 + words + view["byteOffset"]
    rows = np.frombuffer(content[start : start + view["byteLength"]], "<u2").reshape(-1, 4)
    assert mesh.colors is not None
    assert np.abs(rows[:, :3] / 65_535 - mesh.colors).max() < 1e-4
    assert (rows[:, 3] == 65_535).all()


def test_the_scene_is_kept_in_comments(tmp_path: Path) -> None:
    write_mesh(tmp_path / "m.ply", replace(ball(1), text=SCENE))
    head = (tmp_path / "m.ply").read_bytes().partition(b"end_header")[0].decode("ascii")
    assert "comment version: 1\ncomment formula: {name: hast}  # \\xe4\n" in head
    write_mesh(tmp_path / "m.obj", replace(ball(1), text=SCENE))
    assert (tmp_path / "m.obj").read_text().startswith("# version: 1\n# formula: {name: hast}  # \\xe4\nv ")


def test_a_mesh_of_a_deep_zoom(tmp_path: Path) -> None:
    """64-bit coordinates where the format has them, else one line."""
    plain = ball(2)
    mesh = Mesh(plain.vertices * 1e-9 + 1.7, plain.triangles)
    for suffix in (".ply", ".obj"):
        write_mesh(tmp_path / f"m{suffix}", mesh)
        assert np.abs(load(tmp_path / f"m{suffix}").vertices - mesh.vertices).max() < 1e-15
    for suffix in (".stl", ".glb"):
        with pytest.raises(FileError, match=r"m\.\w+: cannot be written: its 32-bit coordinates"):
            write_mesh(tmp_path / f"m{suffix}", mesh)
        assert not (tmp_path / f"m{suffix}").exists()


def test_what_cannot_be_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(FileError, match=r"unknown extension '\.fbx'; known: \.ply, \.stl, \.obj, \.glb"):
        write_mesh(tmp_path / "m.fbx", ball(1))
    with pytest.raises(FileError, match="the mesh has no triangle"):
        write_mesh(tmp_path / "m.ply", Mesh(np.zeros((0, 3)), np.zeros((0, 3), np.int32)))
    monkeypatch.setattr(module, "_LARGEST_GLB", 70_000)
    with pytest.raises(FileError, match="too large for GLB"):
        write_mesh(tmp_path / "m.glb", ball())
    assert list(tmp_path.iterdir()) == []
