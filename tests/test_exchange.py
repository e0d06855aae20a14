"""`clfractal voxelize` and `clfractal mesh`: a ball whose every number is known, out of the program and back."""

from __future__ import annotations

import importlib.util
import signal
import time
from pathlib import Path
from typing import Any

import nrrd as pynrrd
import numpy as np
import pytest
import trimesh

from clfractal.cli import voxelize as voxelize_command
from clfractal.files.srgb import encode
from clfractal.files.volume_file import SCENE_KEY, Volume, read_volume, write_volume
from clfractal.integrators.vertices import on_faces
from clfractal.scene import given
from clfractal.scene import load as load_module
from clfractal.scene.load import load_scene
from tests.calls import counted
from tests.long_renders import LIMIT_SECONDS
from tests.shell import InProcess, Running, python, works

# Squaring quaternions without adding anything: inside is the unit ball, of which the slice is one, too.
SCENE = """version: 1
formula: {name: quaternion_julia, iterations: 12, julia: [0, 0, 0, 0]}
camera: {position: [0, -3, 0]}
coloring: {by: normal}
"""
BOX = "renderer.box={center: [0.1, -0.05, 0], size: [3, 2.5, 2.25]}"
# Voxels of 1/12: 36 x 30 x 27.
STEP = 1 / 12
SHAPE = (27, 30, 36)
CORNER = np.array([0.1, -0.05, 0]) - np.array([3, 2.5, 2.25]) / 2
COMMON = ("--resolution", "36", "--set", BOX)


def load(path: str) -> Any:
    found: Any = trimesh.load(path, process=False)
    return next(iter(found.geometry.values())) if path.endswith(".glb") else found


def middles() -> Any:
    """The voxels' places, (z, y, x, 3)."""
    z, y, x = np.indices(SHAPE)
    return CORNER + (np.stack([x, y, z], axis=-1) + 0.5) * STEP


def test_a_scene_becomes_a_volume(clf: InProcess) -> None:
    ended = works(clf("voxelize", "scene.yaml", "-o", "ball.nrrd", *COMMON))
    assert "scene.yaml: 36 x 30 x 27 voxels need 29.2 kB of memory," in ended.err
    assert "ball.nrrd: 36 x 30 x 27 voxels, " in ended.err
    values, header = pynrrd.read("ball.nrrd", index_order="C")
    radius = np.linalg.norm(middles(), axis=-1)
    assert values.dtype == np.uint8
    assert np.array_equal(values[np.abs(radius - 1) > 1e-3], 255 * (radius < 1)[np.abs(radius - 1) > 1e-3])
    assert np.allclose(header["space directions"], STEP * np.eye(3), atol=1e-15)
    assert np.allclose(header["space origin"], CORNER + STEP / 2, atol=1e-15)
    text = read_volume("ball.nrrd").texts[SCENE_KEY]
    assert text.isascii()
    assert "\n" not in text
    assert ": " not in text
    scene = load_scene(text)
    assert scene.renderer.type == "volume"
    assert scene.renderer.resolution == 36


def test_npy_gzip_and_other_values(clf: InProcess) -> None:
    more = ("--set", "renderer.value=iterations", "--set", "renderer.store=float", "-q")
    works(clf("voxelize", "scene.yaml", "-o", "ball.npy", *COMMON, *more))
    works(clf("voxelize", "scene.yaml", "-o", "ball.nrrd", "--gzip", *COMMON, *more))
    plain, packed = read_volume("ball.npy"), read_volume("ball.nrrd")
    assert np.array_equal(np.load("ball.npy"), packed.values)
    assert np.array_equal(plain.origin, packed.origin)
    assert plain.texts == packed.texts
    assert plain.texts["range"] == "0 12"
    assert plain.values.dtype == np.float32
    radius = np.linalg.norm(middles(), axis=-1)
    assert (plain.values[radius < 0.99] == 12).all()  # floats are the counts themselves
    assert (plain.values[radius > 1.2] < 7).all()


@pytest.mark.parametrize("suffix", [".ply", ".obj", ".glb"])
def test_a_scene_becomes_a_mesh(suffix: str, clf: InProcess) -> None:
    ended = works(
        clf("mesh", "scene.yaml", "-o", f"ball{suffix}", *COMMON, "--set", "renderer.value=coverage")
    )
    mesh = load(f"ball{suffix}")
    assert f"ball{suffix}: {len(mesh.vertices):,} vertices, {len(mesh.faces):,} triangles, " in ended.err
    points, normals = np.asarray(mesh.vertices), np.asarray(mesh.vertex_normals)
    if suffix == ".glb":
        points, normals = (
            np.stack([each[:, 0], -each[:, 2], each[:, 1]], axis=1) for each in (points, normals)
        )
    radius = np.linalg.norm(points, axis=1)
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(4 / 3 * np.pi, rel=0.02)
    assert np.abs(radius - 1).max() < 0.5 * STEP
    # From the Jacobian: the direction of the point itself, not of a grid of 36 voxels.
    assert np.sum(normals * points / radius[:, None], axis=1).min() > 1 - 1e-4
    colors = mesh.visual.vertex_attributes["color"] if suffix == ".glb" else mesh.visual.vertex_colors
    expected = 0.5 + 0.5 * normals.astype(np.float64)
    wanted = expected if suffix == ".glb" else encode(expected)
    assert np.abs(colors[:, :3] / np.iinfo(colors.dtype).max - wanted).max() < 1 / 200


def test_a_volume_of_ours_remembers_its_formula(clf: InProcess) -> None:
    works(clf("voxelize", "scene.yaml", "-o", "ball.nrrd", *COMMON, "-q"))
    works(clf("mesh", "ball.nrrd", "-o", "from_volume.ply", "-q"))
    works(clf("mesh", "scene.yaml", "-o", "from_scene.ply", *COMMON, "-q"))
    assert Path("from_volume.ply").read_bytes() == Path("from_scene.ply").read_bytes()


def test_other_colors(clf: InProcess) -> None:
    common = ("mesh", "scene.yaml", "-o", "ball.ply", *COMMON)
    works(clf(*common, "--set", "coloring.by=solid", "-q"))
    color = encode(np.array(load_scene(SCENE).material.color))
    assert np.abs(load("ball.ply").visual.vertex_colors[:, :3] / 255 - color).max() < 1 / 500
    ended = works(clf(*common, "--set", "coloring.by=trap"))
    assert "coloring.by: trap cannot be computed for vertices; they get the material's colour\n" in ended.err
    assert np.abs(load("ball.ply").visual.vertex_colors[:, :3] / 255 - color).max() < 1 / 500
    # A palette over smooth counts, of which a sphere around a ball has one: all vertices get nearly the same.
    ends = "{at: 0, color: [0, 0, 0]}, {at: 1, color: [1, 0, 0]}"
    stops = f"coloring={{by: iterations, scale: 0.05, repeat: false, palette: [{ends}]}}"
    works(clf(*common, "--set", stops, "--set", "renderer.value=coverage", "-q"))
    red = load("ball.ply").visual.vertex_colors[:, 0] / 255
    # One voxel out |z| is 1 + STEP, and grows to its square with each step until it is beyond the distance bailout.
    count = np.log2(np.log(load_scene(SCENE).chain.distance_bailout) / np.log(1 + STEP))
    assert np.median(red) == pytest.approx(float(encode(np.array([0.05 * count]))[0]), abs=0.03)


def test_a_volume_of_others(clf: InProcess) -> None:
    x, y, z = np.moveaxis(middles(), -1, 0)
    depth = ((1 - np.sqrt(x * x + y * y + z * z)) * 1000).astype(np.int16)
    volume = Volume(depth, CORNER + STEP / 2, STEP * np.eye(3))
    write_volume("theirs.nrrd", volume)
    works(clf("mesh", "theirs.nrrd", "-o", "theirs.stl", "--level", "200"))
    found: Any = trimesh.load("theirs.stl")
    assert found.is_watertight
    assert found.volume == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.02)
    works(clf("mesh", "theirs.nrrd", "-o", "open.ply", "--level=-2000"))
    assert clf("mesh", "theirs.nrrd", "-o", "open.ply", "--level=-2000", "--no-close").status == 2


def test_a_scene_that_shows_a_volume_of_others(clf: InProcess) -> None:
    """It is converted, and meshed, where the scene's box puts it; its axes are turned along those of space."""
    x, y, z = np.moveaxis(middles(), -1, 0)
    depth = ((1 - np.sqrt(x * x + y * y + z * z)) * 1000).astype(np.int16)
    # Stored against x, and y after x.
    turned = np.ascontiguousarray(depth[:, :, ::-1].transpose(0, 2, 1))
    first = CORNER + STEP / 2 + np.array([35 * STEP, 0, 0])
    write_volume("theirs.nrrd", Volume(turned, first, STEP * np.array([[0, 1, 0], [-1, 0, 0], [0, 0, 1]])))
    Path("theirs.yaml").write_text(
        "version: 1\nformula: {name: mandelbulb}\ncamera: {}\nrenderer: {type: volume, file: theirs.nrrd, level: 200}\n"
    )
    works(clf("voxelize", "theirs.yaml", "-o", "along.npy"))
    along = read_volume("along.npy")
    np.testing.assert_array_equal(along.values, depth)
    np.testing.assert_allclose(along.origin, CORNER + STEP / 2, atol=1e-12)
    np.testing.assert_allclose(along.directions, STEP * np.eye(3), atol=1e-12)
    assert SCENE_KEY not in along.texts
    ended = works(clf("mesh", "theirs.yaml", "-o", "theirs.ply"))
    assert "theirs.yaml: 36 x 30 x 27 voxels, 58.3 kB, level 200\n" in ended.err
    found = load("theirs.ply")
    assert found.is_watertight
    assert found.volume == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.02)
    # The gradient's normals: of the ball, not of the scene's formula.
    points = np.asarray(found.vertices)
    outward = points / np.linalg.norm(points, axis=1)[:, None]
    assert np.sum(np.asarray(found.vertex_normals) * outward, axis=1).min() > 0.99
    twice = ("--set", "renderer.box={center: [5, 0, 0], size: 6}")
    works(clf("mesh", "theirs.yaml", "-o", "large.ply", "--level", "0", *twice, "-q"))
    assert load("large.ply").volume == pytest.approx(8 * 4 / 3 * np.pi, rel=0.02)
    told = clf("voxelize", "theirs.yaml", "-o", "no.nrrd", "--resolution", "20")
    assert told.is_one_line(
        2, "--resolution: applies only to grids filled from a formula; the scene shows a file"
    )
    told = clf("mesh", "theirs.yaml", "-o", "no.ply", "--level", "5000", "-q")
    assert told.is_one_line(2, "theirs.yaml: has no surface at the level 5000: its values are from ")


def test_the_level_of_the_scene(clf: InProcess) -> None:
    """Of smooth counts, which are log2(log R / log r) at the radius r; also in a volume that was made before."""
    bailout = load_scene(SCENE).chain.distance_bailout
    radius = bailout ** (2.0**-4.5)
    settings = ("--set", "renderer.value=iterations", "--set", "renderer.level=4.5", "-q")
    box = ("--resolution", "40", "--set", "renderer.box={size: 4}")
    for store in ("float", "byte"):
        more = (*box, *settings, "--set", f"renderer.store={store}")
        works(clf("mesh", "scene.yaml", "-o", "level.ply", *more))
        away = np.linalg.norm(load("level.ply").vertices, axis=1)
        assert np.abs(away - radius).max() < 0.02
        works(clf("voxelize", "scene.yaml", "-o", "level.nrrd", *more))
        works(clf("mesh", "level.nrrd", "-o", "again.ply", "-q"))
        assert Path("again.ply").read_bytes() == Path("level.ply").read_bytes()
    works(clf("mesh", "level.nrrd", "-o", "other.ply", "-q", "--level", "127.5"))
    assert len(load("other.ply").vertices) != len(load("level.ply").vertices)


def test_what_the_box_cuts_keeps_its_flat_faces(clf: InProcess) -> None:
    half = "renderer.box={center: [0, 0, 1], size: [2.5, 2.5, 2]}"
    works(clf("mesh", "scene.yaml", "-o", "half.ply", "--resolution", "30", "--set", half, "-q"))
    mesh = load("half.ply")
    assert mesh.is_watertight
    assert mesh.volume == pytest.approx(2 / 3 * np.pi, rel=0.05)
    flat = on_faces(mesh.vertices, np.array([-1.25, -1.25, 0]), np.full(3, 2.5 / 30), (30, 30, 24))
    assert 100 < flat.sum() < len(flat)
    middle = flat & (np.linalg.norm(mesh.vertices, axis=1) < 0.8)
    assert np.allclose(mesh.vertex_normals[middle], (0, 0, -1))
    works(
        clf("mesh", "scene.yaml", "-o", "open.ply", "--resolution", "30", "--set", half, "--no-close", "-q")
    )
    assert not load("open.ply").is_watertight


FAR = "renderer.box={center: [9, 0, 0], size: 1}"
DEEP = "renderer.zoom=[{center: [1.0, 0, 0], scale: 1.0e+7}]"


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (
            ("mesh", "scene.yaml", "-o", "m.ply", "--resolution", "36", "--set", FAR, "-q"),
            ("scene.yaml: nothing of the set lies in the box of 1 x 1 x 1 around [9, 0, 0], at 36 x 36 x 36 voxels",),
        ),
        (("mesh", "scene.yaml", "-o", "m.fbx"), ("unknown extension '.fbx'; known: .ply, .stl, .obj, .glb",)),
        (("voxelize", "scene.yaml", "-o", "v.raw"), ("unknown extension '.raw'; known: .nrrd, .npy",)),
        (("voxelize", "scene.yaml", "-o", "v.npy", "--gzip"), ("v.npy: cannot be compressed: NPY has no compression",)),
        (("voxelize", "scene.yaml", "-o", "no/v.nrrd"), ("no/v.nrrd: cannot be written: there is no folder",)),
        (("voxelize", "scene.yaml", "-o", "v.nrrd", "--resolution", "1"), ("--resolution: must be at least 2",)),
        (("voxelize", "scene.yaml", "-o", "v.nrrd", "--resolution", "3,4"), ("--resolution: must be N or NX,NY,NZ",)),
        (("voxelize", "scene.yaml", "-o", "v.nrrd", "--resolution", "99999"), ("--resolution: must be at most 16384",)),
        (("voxelize", "scene.yaml", "-o", "v.nrrd", "--precision", "half"), ("--precision: ", "half")),
        (
            ("voxelize", "scene.yaml", "-o", "v.nrrd", "--resolution", "16384,16384,16384"),
            ("--resolution: 16384 x 16384 x 16384 voxels need 4.4 TB of memory, ", " are left"),
        ),
        (("voxelize", "scene.yaml", "-o", "v.nrrd", "--set", "renderer.box.size=0"), ("--set renderer.box.size: ",)),
        (("voxelize", "scene.yaml", "-o", "v.nrrd", "--set", "renderer.type=surface"), ("must be volume here",)),
        (
            ("mesh", "scene.yaml", "-o", "m.ply", "--level", "1.5", *COMMON, "-q"),
            ("--level: must be above 0 and at most 1, got 1.5",),
        ),
        (("mesh", "scene.yaml", "-o", "m.ply", "--level", "nan"), ("--level: must be a number, got nan",)),
        (
            ("mesh", "scene.yaml", "-o", "m.stl", "--resolution", "32", "--set", DEEP, "-q"),
            ("m.stl: cannot be written: its 32-bit",),
        ),
        (("mesh", "same.npy", "-o", "m.ply"), ("same.npy: has no surface: all its values are 3",)),
        (
            ("mesh", "ramp.npy", "-o", "m.ply", "--level", "99", "-q"),
            ("ramp.npy: has no surface at the level 99: its values are from 0 to 26",),
        ),
        (("mesh", "ramp.npy", "-o", "m.ply", "--resolution", "9"), ("--resolution: applies to scenes only",)),
        (("mesh", "missing.nrrd", "-o", "m.ply"), ("missing.nrrd: cannot be read: No such file",)),
        (("mesh", "short.nrrd", "-o", "m.ply"), ("short.nrrd: is cut short",)),
    ],
)  # fmt: skip
def test_mistakes_are_one_line(arguments: tuple[str, ...], parts: tuple[str, ...], clf: InProcess) -> None:
    np.save("same.npy", np.full((3, 3, 3), 3.0))
    np.save("ramp.npy", np.arange(27).reshape(3, 3, 3))
    write_volume("short.nrrd", Volume(np.zeros((3, 3, 3))))
    Path("short.nrrd").write_bytes(Path("short.nrrd").read_bytes()[:-1])
    before = sorted(Path().iterdir())
    assert clf(*arguments).is_one_line(2, *parts)
    assert sorted(Path().iterdir()) == before


def test_files_are_read_once(clf: InProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The scene, and the grid of others that it shows: such a grid may have a gigabyte."""
    write_volume("theirs.nrrd", Volume(np.pad(np.ones((3, 3, 3)), 2)))
    (tmp_path / "theirs.yaml").write_text(SCENE + "renderer: {type: volume, file: theirs.nrrd}\n")
    scenes, grids = (
        counted(monkeypatch, load_module, "read_document"),
        counted(monkeypatch, given, "read_grid"),
    )
    works(clf("voxelize", "theirs.yaml", "-o", "copy.nrrd"))
    assert (len(scenes), len(grids)) == (1, 1)
    works(clf("mesh", "theirs.yaml", "-o", "copy.ply"))
    assert (len(scenes), len(grids)) == (2, 2)


def test_without_scikit_image(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(importlib.util, "find_spec", lambda name: None)
    told = clf("mesh", "scene.yaml", "-o", "m.ply")
    assert told.is_one_line(2, "clfractal mesh: needs scikit-image: pip install scikit-image")


def test_a_scene_in_a_volume_that_does_not_load(clf: InProcess) -> None:
    """Somebody's file must not stop the mesh: it only knows less."""
    values = np.pad(np.ones((3, 3, 3)), 2)
    write_volume("odd.nrrd", Volume(values, texts={SCENE_KEY: "version: 7\n"}))
    ended = works(clf("mesh", "odd.nrrd", "-o", "odd.ply"))
    assert "odd.nrrd: its scene cannot be used, so normals come from the values: " in ended.err
    assert load("odd.ply").is_watertight


def test_what_is_told_meanwhile(monkeypatch: pytest.MonkeyPatch) -> None:
    told: list[str] = []

    class Told:
        def say(self, line: str) -> None:
            told.append(line)

        def alive(self) -> None:
            """Something was seen; nobody waits here."""

    monkeypatch.setattr(voxelize_command, "LINE_EVERY_SECONDS", 0.0)
    stages = voxelize_command.StageProgress(Told())  # type: ignore[arg-type]
    stages.say("triangles", 0.25)
    stages.say("normals", 1.0)
    assert told == ["triangles:  25%"]


@pytest.mark.usefixtures("interrupts_are_not_ignored")
@pytest.mark.parametrize("name", ["big.nrrd", "big.ply"])
def test_an_interrupt_leaves_nothing(name: str, tmp_path: Path) -> None:
    """In the middle of the work, which takes minutes on any machine; at once."""
    (tmp_path / "scene.yaml").write_text(SCENE.replace("iterations: 12", "iterations: 5000"))
    kind, side = ("voxelize", "600") if name.endswith("nrrd") else ("mesh", "700")
    running = Running(tmp_path, kind, "scene.yaml", "-o", name, "--resolution", side)
    assert running.process.stderr is not None
    assert "voxels need" in running.process.stderr.readline()
    time.sleep(0.5)
    start = time.monotonic()
    status, told = running.ended_by(signal.SIGINT)
    assert time.monotonic() - start < LIMIT_SECONDS
    assert status == 130, told  # 0: it was done before it was interrupted
    assert told.splitlines()[-1] == f"{name}: interrupted, nothing was written"
    assert [path.name for path in tmp_path.iterdir()] == ["scene.yaml"]


def test_meshes_need_no_opencl_until_the_input_is_right() -> None:
    code = (
        "import sys; from clfractal.cli import run; from clfractal.cli.shell import Shell\n"
        "assert run(['mesh', 'missing.yaml', '-o', 'm.ply'], Shell(owns_process=False)) == 2\n"
        "print([m for m in ('pyopencl', 'skimage', 'trimesh', 'OpenEXR') if m in sys.modules])"
    )
    assert works(python(code)).out.splitlines()[-1] == "[]"
