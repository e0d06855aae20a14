"""Volumes, meshes and distances from Python and the shell, compared with mathematics; what is told of files and grids."""

from __future__ import annotations

import io
import pickle
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from numpy.linalg import norm

import clfractal
from clfractal.device.structs import Precision
from clfractal.files.file_kinds import Kind, kind_of
from clfractal.files.volume_file import SCENE_KEY, Volume, read_volume, write_volume
from clfractal.scene.grid_values import finite_range, in_words, is_finite_somewhere, lacking
from tests.calls import failure, raising
from tests.devices import check_usable
from tests.shell import SCENE, InProcess, works

# z stays where it is: the set is the ball of the bailout's radius, 0.8 around the origin.
BALL = {
    "version": 1,
    "formula": {
        "inline": {
            "title": "a ball",
            "reference": "test",
            "variables": ["x", "y", "z"],
            "map": ["x", "y", "z"],
            "add": "none",
            "degree": 1,
            "bounds": {"center": [0, 0, 0], "radius": 1},
            "bailout": 0.8,
        },
        "iterations": 2,
    },
    "camera": {"position": [0, -3, 0]},
    "image": {"width": 32, "height": 32},
    "renderer": {"type": "volume", "resolution": 24},
    "coloring": {"by": "solid"},
    "material": {"color": [0.25, 0.5, 1.0]},
}


@pytest.fixture(scope="module")
def ball() -> clfractal.Volume:
    return clfractal.voxelize(BALL)


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> InProcess:
    monkeypatch.chdir(tmp_path)
    return InProcess(capsys)


def middles(volume: clfractal.Volume) -> npt.NDArray[np.float64]:
    """The middles of all voxels, shape (nz, ny, nx, 3)."""
    z, y, x = np.indices(volume.values.shape)
    places: npt.NDArray[np.float64] = volume.origin + np.stack([x, y, z], axis=-1) @ volume.directions
    return places


def test_a_volume_knows_where_its_voxels_are(ball: clfractal.Volume) -> None:
    inside = ball.values >= 128
    away = np.abs(norm(middles(ball), axis=-1) - 0.8) > norm(ball.spacing)
    np.testing.assert_array_equal(inside[away], (norm(middles(ball), axis=-1) < 0.8)[away])
    assert inside.sum() * np.prod(ball.spacing) == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.05)
    assert max(ball.values.shape) == 24
    assert np.asarray(ball) is ball.values
    assert clfractal.load_scene(ball.texts[SCENE_KEY]).renderer.type == "volume"


def test_arguments_replace_the_scenes(ball: clfractal.Volume) -> None:
    stages: list[tuple[str, float]] = []
    fine = clfractal.voxelize(
        BALL,
        progress=lambda stage, part: stages.append((stage, part)),
        resolution=np.int64(16),  # type: ignore[arg-type]
    )
    assert max(fine.values.shape) == 16
    assert fine.spacing[0] == pytest.approx(1.5 * ball.spacing[0])
    assert stages
    assert all(0 <= part <= 1 for _, part in stages)

    with pytest.raises(TimeoutError):
        clfractal.voxelize(BALL, progress=raising(TimeoutError))
    with pytest.raises(clfractal.SceneError, match=r"renderer.resolution: .* are left"):
        clfractal.voxelize({**BALL, "renderer": {"type": "volume", "store": "float"}}, resolution=16384)


def test_a_scene_without_a_volume_gets_one() -> None:
    surface = clfractal.load_scene({**BALL, "renderer": {"type": "surface"}, "coloring": {"by": "normal"}})
    found = clfractal.voxelize(surface, resolution=16)
    np.testing.assert_array_equal(found.values, clfractal.voxelize(BALL, resolution=16).values)


EMPTY = {"type": "volume", "resolution": 8, "box": {"center": [0.6, 0.6, 0.6], "size": 0.2}}
BEYOND = {"type": "volume", "resolution": 8, "box": {"center": [5, 0, 0], "size": 2}}
FULL = {"type": "volume", "resolution": 8, "box": {"size": 0.2}}


@pytest.mark.parametrize(
    ("renderer", "remark"),
    [
        (EMPTY, "the volume holds nothing of the set; a finer renderer.resolution or another renderer.box"),
        (
            BEYOND,
            "the volume lies beyond the set; renderer.box must reach into its bounds, a ball of radius 1",
        ),
        (FULL, "all of the volume is inside the set; a larger renderer.box shows its surface"),
        ({**FULL, "store": "float", "value": "coverage"}, "all of the volume is inside the set"),
        ({**EMPTY, "value": "iterations"}, ""),
        ({**FULL, "box": {"size": 1.8}}, ""),
    ],
    ids=str,
)
def test_grids_that_hold_little_are_told(
    renderer: dict[str, Any], remark: str, tmp_path: Path, shell: InProcess
) -> None:
    scene = clfractal.load_scene({**BALL, "renderer": renderer})
    found = clfractal.voxelize(scene).remarks
    assert len(found) == bool(remark)
    assert all(line.startswith(remark) for line in found)
    (tmp_path / "ball.yaml").write_text(clfractal.dump_scene(scene))
    ended = works(shell("voxelize", tmp_path / "ball.yaml", "-o", tmp_path / "a.nrrd"))
    assert [line for line in ended.err.splitlines() if f"ball.yaml: {remark}" in line] or not remark
    assert ("inside the set" in ended.err or "the volume" in ended.err) == bool(remark)
    if "inside" in remark:  # its faces are a surface
        assert clfractal.mesh(scene).remarks == found
        assert f"ball.yaml: {found[0]}" in shell("mesh", tmp_path / "ball.yaml", "-o", tmp_path / "a.ply").err
    elif remark:
        with pytest.raises(clfractal.SceneError, match="nothing of the set lies in the box"):
            clfractal.mesh(scene)


def test_a_grid_of_nothing_but_nan_is_told(tmp_path: Path, shell: InProcess) -> None:
    np.save(tmp_path / "lost.npy", np.full((4, 4, 4), np.nan, np.float32))
    plain = {**BALL, "renderer": {"type": "volume", "file": "lost.npy"}}
    scene = clfractal.load_scene(plain, folder=tmp_path)
    remark = "the volume holds nothing but NaN; renderer.file has no value to show"
    assert clfractal.voxelize(scene).remarks == (remark,)
    (tmp_path / "lost.yaml").write_text(clfractal.dump_scene(scene))
    ended = works(shell("voxelize", tmp_path / "lost.yaml", "-o", tmp_path / "a.nrrd"))
    assert f"lost.yaml: {remark}" in ended.err
    for source in ("lost.yaml", "lost.npy"):
        ended = shell("mesh", tmp_path / source, "-o", tmp_path / "a.ply")
        assert ended.status == 2
        assert "has no surface" in ended.err
        assert "it holds nothing but NaN" in ended.err
    assert not (tmp_path / "a.ply").exists()


def test_files_are_those_of_the_shell(ball: clfractal.Volume, tmp_path: Path, shell: InProcess) -> None:
    (tmp_path / "ball.yaml").write_text(clfractal.dump_scene(clfractal.load_scene(BALL)))
    assert shell("voxelize", tmp_path / "ball.yaml", "-o", tmp_path / "shell.nrrd").status == 0
    ball.save(tmp_path / "python.nrrd")
    written = read_volume(tmp_path / "shell.nrrd")
    np.testing.assert_array_equal(written.values, ball.values)
    assert (tmp_path / "shell.nrrd").read_bytes() == (tmp_path / "python.nrrd").read_bytes()
    for suffix in (".ply", ".glb"):
        assert shell("mesh", tmp_path / "ball.yaml", "-o", tmp_path / f"shell{suffix}").status == 0
        clfractal.mesh(BALL).save(tmp_path / f"python{suffix}")
        assert (tmp_path / f"shell{suffix}").read_bytes() == (tmp_path / f"python{suffix}").read_bytes()


def test_a_mesh_is_the_surface(ball: clfractal.Volume) -> None:
    parts: list[float] = []
    mesh = clfractal.mesh(BALL, progress=lambda stage, part: parts.append(part))
    assert mesh.normals is not None
    assert mesh.colors is not None
    radii = norm(mesh.vertices, axis=1)
    assert np.abs(radii - 0.8).max() < ball.spacing[0]
    np.testing.assert_allclose(mesh.normals, mesh.vertices / radii[:, None], atol=0.03)
    np.testing.assert_allclose(mesh.colors, np.broadcast_to([0.25, 0.5, 1.0], mesh.colors.shape), atol=1e-6)
    corners = mesh.vertices[mesh.triangles]
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(4 / 3 * np.pi * 0.8**3, rel=0.05)  # positive: seen from outside
    assert parts[-1] == 1
    again = clfractal.mesh(ball)
    np.testing.assert_array_equal(again.vertices, mesh.vertices)
    np.testing.assert_array_equal(again.normals, mesh.normals)


def test_a_mesh_of_somebody_elses_volume() -> None:
    z, y, x = np.indices((20, 20, 20)) - 9.5
    volume = clfractal.Volume(np.sqrt(x * x + y * y + z * z), np.full(3, -9.5))
    found = clfractal.mesh(volume, level=6.0, close=False)
    assert np.abs(norm(found.vertices, axis=1) - 6).max() < 0.05
    assert found.colors is None
    with pytest.raises(clfractal.SceneError, match="resolution: applies to scenes only"):
        clfractal.mesh(volume, resolution=8)
    with pytest.raises(clfractal.SceneError, match="has no surface at the level 99"):
        clfractal.mesh(volume, level=99)
    with pytest.raises(clfractal.SceneError, match="all its values are 1"):
        clfractal.mesh(clfractal.Volume(np.ones((3, 3, 3))))


def test_a_shown_file_is_not_replaced(ball: clfractal.Volume, tmp_path: Path) -> None:
    ball.save(tmp_path / "scan.nrrd")
    shown = {**BALL, "renderer": {"type": "volume", "file": "scan.nrrd"}}
    scene = clfractal.load_scene(shown, folder=tmp_path)
    given = clfractal.voxelize(scene)
    np.testing.assert_array_equal(given.values, ball.values)
    before = (tmp_path / "scan.nrrd").read_bytes()
    with pytest.raises(clfractal.FileError):
        given.save(tmp_path / "scan.nrrd")
    assert (tmp_path / "scan.nrrd").read_bytes() == before
    with pytest.raises(clfractal.SceneError, match="resolution: applies only to grids filled from a formula"):
        clfractal.voxelize(scene, resolution=8)


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_distances_to_a_ball(precision: Precision) -> None:
    check_usable(precision)
    points = np.array([[2.0, 0, 0], [0, -1.0, 0], [0.1, 0.2, 0.3], [1.0, 2.0, -2.0]])
    found = clfractal.distances(BALL["formula"], points, iterations=2, precision=precision)  # type: ignore[arg-type]
    np.testing.assert_allclose(found.full, [1.2, 0.2, 0, 2.2], atol=1e-6)
    assert found.inside.tolist() == [False, False, True, False]
    np.testing.assert_allclose(found.normal[[0, 1, 3]], points[[0, 1, 3]] / [[2], [1], [3]], atol=1e-6)
    assert (found.normal[2] == 0).all()
    assert found.step[2] == 0
    assert clfractal.distances("hast", np.zeros((0, 3))).normal.shape == (0, 3)


def counting(target: int, digit: int) -> dict[str, Any]:
    """A formula that counts in two digits, a and b, and leaves for good when b reaches a number.

    Its applications are known exactly: a runs from 0 to digit - 1, and each time it starts again b grows by one.
    """
    return {
        "title": "a counter",
        "reference": "test",
        "variables": ["a", "b", "c"],
        "map": [
            f"where(a >= {digit - 1}, 0, a + 1)",
            f"where(a >= {digit - 1}, b + 1, b)",
            f"where(b >= {target}, 1e6, 0)",
        ],
        "add": "none",
        "degree": 1,
        "bounds": {"center": [0, 0, 0], "radius": 2},
        "bailout": 1e5,
    }


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_counts_beyond_two_to_the_24th_are_exact(precision: Precision) -> None:
    check_usable(precision)
    target, digit = 4200, 4001
    exact = target * digit + 1  # odd, and above 2^24
    assert exact % 2 == 1
    assert exact > 2**24
    points = np.array([[0.0, 0, 0], [1, 0, 0], [2, 0, 0]])
    # One application fewer than the first point needs: it stays inside, the second one leaves with the last application.
    limit = exact - 1
    counts, inside = clfractal.escape(counting(target, digit), points, iterations=limit, precision=precision)
    assert counts.tolist() == [exact - 1, exact - 1, exact - 2]
    assert inside.tolist() == [True, False, False]


def test_everything_goes_to_other_processes(ball: clfractal.Volume) -> None:
    twice = pickle.loads(pickle.dumps(ball))
    np.testing.assert_array_equal(twice.values, ball.values)
    assert (twice.origin == ball.origin).all()
    assert twice.texts == ball.texts
    mesh = clfractal.mesh(ball)
    same = pickle.loads(pickle.dumps(mesh))
    np.testing.assert_array_equal(same.triangles, mesh.triangles)
    assert same.text == mesh.text
    scene = clfractal.load_scene(SCENE)
    assert pickle.loads(pickle.dumps(scene)) == scene
    found = clfractal.distances("mandelbulb", [[2, 0, 0]])
    assert pickle.loads(pickle.dumps(found)).full == found.full
    for kind in (
        "ClfractalError",
        "SceneError",
        "FormulaError",
        "FileError",
        "DeviceError",
        "KernelBuildError",
    ):
        error = getattr(clfractal, kind)("is wrong", details="a log", status=3)
        twin = pickle.loads(pickle.dumps(error))
        assert (type(twin), str(twin), twin.details, twin.status) == (type(error), "is wrong", "a log", 3)
    error = failure(clfractal.SceneError, clfractal.load_scene, SCENE, overrides=["camera.fov=400"])
    twin = pickle.loads(pickle.dumps(error))
    assert (str(twin), twin.where, twin.message) == (
        str(error),
        error.where,
        error.message,
    )
    assert isinstance(pickle.loads(pickle.dumps(clfractal.Stopped())), clfractal.Stopped)


# --- the shell ---


Floats = npt.NDArray[np.float32]

VOLUME = (
    "a volume, not a scene: a scene shows it by renderer.file, and `clfractal mesh` makes triangles of it"
)
NO_VOLUME = "is neither a NRRD nor a NPY file"


FILES: list[tuple[str, bytes, Kind | None]] = [
    ("empty.exr", b"", "exr"),
    ("bytes.exr", b"\x76\x2f\x31\x02", "exr"),
    ("latin.exr", b"\xe4\xf6", "exr"),
    # A scene may have any name.
    ("scene.png", b"version: 1\n", None),
    ("cut in a letter.exr", "# Schneeflöcke".encode()[:11], None),
    ("empty.png", b"", "png"),
    ("cut.png", b"\x89PN", "png"),
    ("empty.JPG", b"", "photo"),
    ("empty.nrrd", b"", "volume"),
    ("text.nrrd", b"no volume", "volume"),
    ("empty.nhdr", b"", "volume"),
    ("bytes.npy", b"\x80\x81", "volume"),
    # What a file holds counts more than its name.
    ("nrrd.yaml", b"NRRD0004\n", "volume"),
    ("nrrd.exr", b"NRRD0004\n", "volume"),
    ("npy", b"\x93NUMPY\1\0", "volume"),
    ("exr.yaml", b"\x76\x2f\x31\x01\2\0\0\0", "exr"),
    ("empty.yaml", b"", None),
    ("scene", b"version: 1", None),
]


@pytest.mark.parametrize(("name", "content", "kind"), FILES, ids=[name for name, _, _ in FILES])
def test_what_a_file_is(name: str, content: bytes, kind: Kind | None, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    assert kind_of(tmp_path / name) == kind


@pytest.mark.parametrize(
    ("name", "scene", "mesh"),
    [
        ("empty.exr", "is not an OpenEXR file", "is not an OpenEXR file"),
        ("empty.png", "is not a PNG file", "is not a PNG file"),
        ("cut.png", "is not a PNG file", "is not a PNG file"),
        ("empty.JPG", "is neither a JPEG nor a WebP file", "is neither a JPEG nor a WebP file"),
        ("text.nrrd", VOLUME, NO_VOLUME),
        ("empty.nrrd", VOLUME, NO_VOLUME),
        ("bytes.npy", VOLUME, NO_VOLUME),
        ("nrrd.yaml", VOLUME, "is damaged: its header has no field 'encoding'"),
        ("empty.yaml", "is empty", "is empty"),
    ],
)
def test_who_reads_a_file(name: str, scene: str, mesh: str, shell: InProcess) -> None:
    content = {name: content for name, content, _ in FILES}[name]
    Path(name).write_bytes(content)
    for words in (["render", name, "-o", "o.png"], ["check", name], ["voxelize", name, "-o", "o.nrrd"]):
        assert shell(*words).is_one_line(2, f"{name}:", scene)
    assert shell("mesh", name, "-o", "o.ply").is_one_line(2, f"{name}:", mesh)
    assert [path.name for path in Path().iterdir()] == [name]


def test_a_large_array_on_standard_input(shell: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """Text is limited to a megabyte, grids are not."""
    kept = io.BytesIO()
    np.save(kept, np.linspace(0, 1, 60**3).reshape(60, 60, 60))
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(kept.getvalue())))
    assert shell("mesh", "-", "-o", "o.ply").status == 0
    assert Path("o.ply").stat().st_size > 1000


# --- what grids hold ---


def of(*values: float) -> Floats:
    """A grid of 40 planes that has all these values, the first most often."""
    found = np.full((40, 4, 4), values[0], np.float32)
    found.reshape(-1)[-len(values) :] = values
    return found


INF, NAN = np.inf, np.nan


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (of(0, 63), "its values are from 0 to 63"),
        (of(3), "all its values are 3"),
        (of(3, NAN), "all its values are 3"),
        (of(2, INF), "all its finite values are 2, others are infinite"),
        (of(2, -INF, NAN, 7), "its finite values are from 2 to 7, others are infinite"),
        (of(NAN), "it holds nothing but NaN"),
        (of(INF), "it holds nothing but infinities"),
        (of(-INF, INF), "it holds nothing but infinities"),
        (of(INF, NAN), "it holds nothing but infinities and NaN"),
        (np.arange(48, dtype=np.uint8).reshape(3, 4, 4), "its values are from 0 to 47"),
    ],
)
def test_values_in_words(values: Floats, told: str) -> None:
    assert in_words(values) == told
    assert (finite_range(values) is None) == (not is_finite_somewhere(values)) == (lacking(values) in told)


def keep(name: str, values: Floats, more: str = "") -> None:
    """A grid, a scene that shows it, and one in which it is an object."""
    head = "version: 1\nformula: {name: mandelbulb}\nimage: {width: 8, height: 8}\ncamera: {position: [20, -90, 30]}\n"
    write_volume(f"{name}.nrrd", Volume(values))
    Path(f"{name}.yaml").write_text(f"{head}renderer: {{type: volume, file: {name}.nrrd{more}}}\n")
    Path(f"{name}_object.yaml").write_text(f"{head}objects: {{v: {{type: volume, file: {name}.nrrd}}}}\n")


@pytest.mark.parametrize(
    ("values", "what"),
    [(of(NAN), "NaN"), (of(INF), "infinities"), (of(-INF, NAN), "infinities and NaN")],
)
def test_grids_without_a_value(values: Floats, what: str, shell: InProcess) -> None:
    keep("v", values)
    told = f"v.yaml: the volume holds nothing but {what}; renderer.file has no value to show\n"
    ended = works(shell("render", "v.yaml", "-o", "o.png"))
    assert told in ended.err
    ended = shell("render", "v_object.yaml", "-o", "o.png")
    assert ended.is_one_line(
        2, f"objects.v.file: v.nrrd holds nothing but {what}, so there is no value to show"
    )
    assert shell("mesh", "v.nrrd", "-o", "o.ply").is_one_line(
        2, f"v.nrrd: has no surface: it holds nothing but {what}"
    )


def test_grids_without_a_surface_say_their_values(shell: InProcess) -> None:
    keep("v", of(1, 63), ", transfer: {opacity: [{at: 100, opacity: 0}, {at: 200, opacity: 1}]}")
    mesh = ("mesh", "v.nrrd", "-o", "o.ply")
    assert (
        "v.nrrd: has no surface at the level 400: its values are from 1 to 63"
        in shell(*mesh, "--level", "400").err
    )
    told = shell(*mesh, "--level", "-5", "--no-close").err
    assert (
        "has no surface: at the level -5 the whole box is inside, as its values are from 1 to 63; closed"
        in told
    )
    told = shell("render", "v.yaml", "-o", "o.png").err
    assert "opacity is 0 for the values that it holds: its values are from 1 to 63\n" in told
