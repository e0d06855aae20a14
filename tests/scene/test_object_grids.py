"""Volumes among the objects: what wrong ones get, where they are, and how their files go along."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from clfractal.errors import ClfractalError
from clfractal.scene import objects
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.scene.named_files import volumes_of
from clfractal.scene.object_grids import placed
from clfractal.scene.objects import MAX_VOLUMES
from tests.render.objects_oracle import rotation_of
from tests.render.volumes import keep, value_at
from tests.scene.errors import cases, error_of, marked
from tests.scenes import HEAD

VALUES = np.random.default_rng(1).uniform(2, 7, (4, 5, 6)).astype(np.float32)
VALUES[0, 0, 0], VALUES[3, 4, 5] = 2, 7
PATHS = "lighting: {mode: path}\n"
STOPS = "transfer: {opacity: [{at: 0, opacity: 0.5}]}"
FULL = ", ".join(f"v{n}: {{type: volume, file: v.nrrd}}" for n in range(MAX_VOLUMES))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("scenes")
    keep(path / "v.nrrd", VALUES, [1, 2, 3], [0.1, 0.2, 0.3])
    keep(path / "nan.nrrd", np.full((2, 2, 2), np.nan, np.float32), [0, 0, 0], [1, 1, 1])
    (path / "text.nrrd").write_text("no grid")
    return path


# In the texts below the sign § stands where the message must point to.
CASES = [
    *cases(
        """
objects: {v: §{type: volume}} => objects.v.file: is missing
objects: {v: {type: volume, file: §none.nrrd}}
=> objects.v.file: {folder}/none.nrrd cannot be read: No such file or directory
objects: {v: {type: volume, file: §text.nrrd}} => objects.v.file: {folder}/text.nrrd is neither a NRRD nor a NPY file
objects: {v: {type: volume, file: §../v.nrrd}}
=> objects.v.file: must be a path inside the scene's folder, got '../v.nrrd'
objects: {v: {type: volume, file: §nan.nrrd}}
=> objects.v.file: nan.nrrd holds nothing but NaN, so there is no value to show
objects: {v: {type: volume, file: v.nrrd, level: §7.5}}
=> objects.v.level: must be above 2 and at most 7, the ends of the grid's values, got 7.5
objects: {v: {type: volume, file: v.nrrd, join: §cut}}
=> objects.v.join: is not for volumes, which stand beside the set; remove it
objects: {«FULL», last: {type: §volume, file: v.nrrd}}
=> objects.last.type: at most «MAX_VOLUMES» objects can be volumes, and this is one more
objects: {v: {type: volume, file: v.nrrd, transfer: {color: §[{at: 0, color: [1, 1, 1]}]}}}
=> objects.v.transfer.color: needs opacity, since a surface has its material's color
«PATHS»materials: {a: {}}
objects: {v: {type: volume, file: v.nrrd, «STOPS», material: §a}}
=> objects.v.material: is for surfaces; a cloud, which transfer.opacity makes, has none
«PATHS»fog: {density: 0.1, scattering: §{}}
objects: {v: {type: volume, file: v.nrrd, «STOPS»}}
=> fog.scattering: cannot be combined with a cloud, objects.v; remove it, and the fog has its colour alone
«PATHS»materials: {ice: {transmission: {weight: 1}}}
objects: {v: {type: volume, file: v.nrrd, material: §ice}}
=> objects.v.material: 'ice' is glass, which volumes cannot be; name another material
renderer: {type: volume}
objects: {v: {type: §volume, file: v.nrrd}}
=> objects.v.type: cannot be volume with renderer volume: its values are in a file, not in a formula; use the surface
    renderer
objects: {v: {type: volume, file: v.nrrd}}
cut_planes: [{cut: true, objects: [§v]}]
=> cut_planes.0.objects.0: 'v' cannot be cut: it is a volume, which no plane opens
lights: [{type: point, position: §[3, 0, 0]}]
objects: {v: {type: volume, file: v.nrrd, position: [3, 0, 0], level: 2.5}}
=> lights.0.position: must be outside the object 'v', where its light reaches something, got [3, 0, 0]
""",
        FULL=FULL,
        MAX_VOLUMES=MAX_VOLUMES,
        PATHS=PATHS,
        STOPS=STOPS,
    ),
    (
        f"objects: {{v: {{type: volume, file: v.nrrd, {STOPS.replace('[{', '§[{')}}}}}",
        "objects.v.transfer.opacity: makes a cloud, which needs lighting.mode: path; without it a surface at `level` is"
        " shown",
    ),
]


@pytest.mark.parametrize(("text", "expected"), CASES, ids=[expected[:60] for _, expected in CASES])
def test_messages(folder: Path, text: str, expected: str) -> None:
    plain, place = marked(HEAD + text)
    assert error_of(plain, folder=folder) == f"{place}: {expected.format(folder=folder)}"


def test_grids_together_may_not_be_too_large(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("clfractal.scene.object_grids.MAX_VALUES", 100)
    with pytest.raises(
        ClfractalError, match=r"objects.v.file: has too many values: .* 100, and these are 120"
    ):
        load_scene(HEAD + "objects: {v: {type: volume, file: v.nrrd}}", folder=folder)
    assert objects.MAX_VALUES == 2**28


def loaded(folder: Path, more: str = "") -> Scene:
    text = (
        "objects:\n  v: {type: volume, file: v.nrrd, position: [3, 1, -2], rotation: [20, -35, 50],"
        f" scale: [1, 2, 0.5], size: 3}}\n{more}"
    )
    return load_scene(HEAD + text, folder=folder)


def test_a_volume_is_placed_by_its_middle_and_its_longest_side(folder: Path) -> None:
    scene = loaded(folder)
    (each,) = volumes_of(scene.objects).values()
    found = placed(each, scene.grids["v.nrrd"])
    place = found.place
    assert place.shape == (6, 5, 4)
    # 0.6 x 1 x 1.2: the longest side becomes 3, then each its own factor.
    half = np.array([1.5, 2.5, 3.0]) * [1, 2, 0.5] / 2
    np.testing.assert_allclose(place.edges / 2, (rotation_of((20, -35, 50)) * half).T, atol=1e-12)
    assert found.voxel == pytest.approx(min(2 * half / [6, 5, 4]))
    random = np.random.default_rng(2)
    for own in random.uniform(-1, 1, (20, 3)):
        x, y, z = np.array([3, 1, -2]) + own @ place.edges / 2
        expected = value_at(VALUES, (own + 1) * [3, 2.5, 2])
        assert found.value((x, y, z)) == pytest.approx(float(expected), abs=1e-5)
    assert found.value((30.0, 0.0, 0.0)) is None


def test_a_scene_with_a_volume_is_written_and_read_again(folder: Path) -> None:
    scene = loaded(folder)
    again = load_scene(dump_scene(scene), folder=folder)
    assert again == scene
    assert folder / "v.nrrd" in {path.absolute() for path in scene.files}


def test_a_moved_volume_is_not_read_again(folder: Path) -> None:
    tracks = (
        "animation: {frames: 9, tracks: {objects.v.size: {keys: [{frame: 0, value: 1}, {frame: 8, value: 4}]},"
        " objects.v.position.2: {expression: t}}}\n"
    )
    scene = loaded(folder, tracks)
    middle = movement_of(scene).scene(4)
    moved = volumes_of(middle.objects)["v"]
    assert moved.size == pytest.approx(2)  # a factor
    assert middle.grids["v.nrrd"] is scene.grids["v.nrrd"]
