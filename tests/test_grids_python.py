"""Volumes, meshes and distances from Python, compared with mathematics and with the shell's files."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
from numpy.linalg import norm

import clfractal
from clfractal.device.select import choose, has_float64
from clfractal.files.volume_file import SCENE_KEY, read_volume
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

    def stop(stage: str, part: float) -> None:
        raise TimeoutError

    with pytest.raises(TimeoutError):
        clfractal.voxelize(BALL, progress=stop)
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
    renderer: dict[str, Any], remark: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scene = clfractal.load_scene({**BALL, "renderer": renderer})
    found = clfractal.voxelize(scene).remarks
    assert len(found) == bool(remark)
    assert all(line.startswith(remark) for line in found)
    (tmp_path / "ball.yaml").write_text(clfractal.dump_scene(scene))
    shell = InProcess(capsys)
    ended = works(shell("voxelize", tmp_path / "ball.yaml", "-o", tmp_path / "a.nrrd"))
    assert [line for line in ended.err.splitlines() if f"ball.yaml: {remark}" in line] or not remark
    assert ("inside the set" in ended.err or "the volume" in ended.err) == bool(remark)
    pytest.importorskip("skimage")
    if "inside" in remark:  # its faces are a surface
        assert clfractal.mesh(scene).remarks == found
        assert f"ball.yaml: {found[0]}" in shell("mesh", tmp_path / "ball.yaml", "-o", tmp_path / "a.ply").err
    elif remark:
        with pytest.raises(clfractal.SceneError, match="nothing of the set lies in the box"):
            clfractal.mesh(scene)


def test_a_grid_of_nothing_but_nan_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    pytest.importorskip("skimage")
    np.save(tmp_path / "lost.npy", np.full((4, 4, 4), np.nan, np.float32))
    plain = {**BALL, "renderer": {"type": "volume", "file": "lost.npy"}}
    scene = clfractal.load_scene(plain, folder=tmp_path)
    remark = "the volume holds nothing but NaN; renderer.file has no value to show"
    assert clfractal.voxelize(scene).remarks == (remark,)
    (tmp_path / "lost.yaml").write_text(clfractal.dump_scene(scene))
    shell = InProcess(capsys)
    ended = works(shell("voxelize", tmp_path / "lost.yaml", "-o", tmp_path / "a.nrrd"))
    assert f"lost.yaml: {remark}" in ended.err
    for source in ("lost.yaml", "lost.npy"):
        ended = shell("mesh", tmp_path / source, "-o", tmp_path / "a.ply")
        assert ended.status == 2
        assert "has no surface" in ended.err
        assert "it holds nothing but NaN" in ended.err
    assert not (tmp_path / "a.ply").exists()


def test_files_are_those_of_the_shell(
    ball: clfractal.Volume, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    pytest.importorskip("skimage")
    (tmp_path / "ball.yaml").write_text(clfractal.dump_scene(clfractal.load_scene(BALL)))
    shell = InProcess(capsys)
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
    pytest.importorskip("skimage")
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
    pytest.importorskip("skimage")
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
def test_distances_to_a_ball(precision: str) -> None:
    if precision == "float64" and not has_float64(choose().info):
        pytest.skip("the device has no float64")
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
def test_counts_beyond_two_to_the_24th_are_exact(precision: str) -> None:
    if precision == "float64" and not has_float64(choose().info):
        pytest.skip("the device has no float64")
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
    pytest.importorskip("skimage")
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
    with pytest.raises(clfractal.SceneError) as caught:
        clfractal.load_scene(SCENE, overrides=["camera.fov=400"])
    twin = pickle.loads(pickle.dumps(caught.value))
    assert (str(twin), twin.where, twin.message) == (
        str(caught.value),
        caught.value.where,
        caught.value.message,
    )
    assert isinstance(pickle.loads(pickle.dumps(clfractal.Stopped())), clfractal.Stopped)
