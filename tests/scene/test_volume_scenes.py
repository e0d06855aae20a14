"""Scenes of volumes, cut planes and layouts: what is wrong with them, in one line; and what is written is what is read."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.device.select import choose
from clfractal.engine.engine import Engine
from clfractal.errors import DeviceError
from clfractal.files.volume_file import Volume, write_volume
from clfractal.scene.load import dump_scene, load_scene
from tests.scene.errors import cases, error_of, marked
from tests.scenes import HEAD, scene_of

VOLUME = "renderer: {type: volume, "
PLANE = "cut_planes: [{"

# In the texts below the sign § stands where the message must point to.
CASES = [
    *cases(
        """
# The box and its zooms.
«VOLUME»box: {size: §0}} => renderer.box.size: must be above 0, got 0
«VOLUME»box: {size: §-2}} => renderer.box.size: must be above 0, got -2
«VOLUME»box: {size: [1, §0, 1]}} => renderer.box.size.1: must be above 0, got 0
«VOLUME»box: {size: [1, 1, §-1]}} => renderer.box.size.2: must be above 0, got -1
«VOLUME»box: {size: §[1, 2]}} => renderer.box.size: must be a list of 3 numbers, got a list of 2
«VOLUME»box: {§centre: [0, 0, 0]}} => renderer.box: unknown key 'centre'; did you mean 'center'?
«VOLUME»box: {size: 2}, zoom: [{center: §[0.6, 0, 0], scale: 2}]}
=> renderer.zoom.0.center: the box must lie within the one before, -1 to 1, got 0.099999999999999978 to
    1.1000000000000001
«VOLUME»box: {size: 4}, zoom: [{center: [1, 0, 0], scale: 4}, {center: §[1, 0.4375, 0], scale: 4}]}
=> renderer.zoom.1.center: the box must lie within the one before, -0.5 to 0.5, got 0.3125 to 0.5625
«VOLUME»zoom: [{center: [0, 0, 0], scale: §0.5}]} => renderer.zoom.0.scale: must be at least 1, got 0.5
«VOLUME»zoom: [§{scale: 2}]} => renderer.zoom.0.center: is missing
# Resolution, steps, values.
«VOLUME»resolution: §1} => renderer.resolution: must be at least 2, got 1
«VOLUME»resolution: [64, 64, §1]} => renderer.resolution.2: must be at least 2, got 1
«VOLUME»value: §insides} => renderer.value: must be inside, coverage or iterations, got 'insides'
«VOLUME»normals: §exactly} => renderer.normals: must be gradient, least_squares or exact, got 'exactly'
# What values look like.
«VOLUME»transfer: {opacity: [{at: 1, opacity: 0}, {at: §0.5, opacity: 1}]}}
=> renderer.transfer.opacity.1.at: must be at least 1, the value at the stop before, got 0.5
«VOLUME»transfer: {color: [{at: 3, color: [0, 0, 0]}, {at: 4, color: [1, 1, 1]}, {at: §-1, color: [0, 0, 0]}]}}
=> renderer.transfer.color.2.at: must be at least 4, the value at the stop before, got -1
«VOLUME»transfer: {opacity: [{at: 0, opacity: §1.5}]}} => renderer.transfer.opacity.0.opacity: must be at most 1, got 1.5
«VOLUME»transfer: {opacity: [§{at: 0}]}} => renderer.transfer.opacity.0.opacity: is missing
«VOLUME»resolution: 64}
coloring: {by: §iterations}
=> coloring.by: must be solid or normal for a volume, got iterations; renderer.transfer.color colours values
# The level of a surface.
«VOLUME»level: §0} => renderer.level: must be above 0 and at most 1, the ends of the grid's values, got 0
«VOLUME»level: §1.5, value: coverage}
=> renderer.level: must be above 0 and at most 1, the ends of the grid's values, got 1.5
renderer: {type: volume, value: iterations, level: §30.5}
=> renderer.level: must be above 0 and at most 30, the ends of the grid's values, got 30.5
«VOLUME»level: §0.5, transfer: {opacity: [{at: 0, opacity: 0}]}}
=> renderer.level: applies to a surface, but transfer.opacity shows all values; remove one of them
«VOLUME»level: §.nan} => renderer.level: must be a finite number, got .nan
# Cut planes.
«PLANE»colors: {palette: §magmaa}}] => cut_planes.0.colors.palette: unknown palette 'magmaa'; did you mean 'magma'?
cut_planes: §[{count: 60}, {count: 5}] => cut_planes: must be at most 64 planes in total, got 65
renderer: {type: cut_plane}
cut_planes: §[{}] => cut_planes: are for surface and volume renderers; remove them
«PLANE»count: §0}] => cut_planes.0.count: must be at least 1, got 0
«PLANE»plane: {normal: §[0, 0, 0]}}] => cut_planes.0.plane.normal: must not be zero
«PLANE»plane: {normal: [0, 0, 1], up: §[0, 0, 2]}}] => cut_planes.0.plane.up: must not be parallel to the normal
«PLANE»colors: {palette: [{at: 1, color: [0, 0, 0]}, {at: §0, color: [0, 0, 0]}]}}]
=> cut_planes.0.colors.palette.1.at: must be at least 1, the value at the stop before, got 0
# Files.
«VOLUME»file: §''} => renderer.file: must not be empty, got ''
""",
        PLANE=PLANE,
        VOLUME=VOLUME,
    ),
    ("cut_planes: §[" + "{}, " * 65 + "]", "cut_planes: must have at most 64 entries, got 65"),
]


@pytest.mark.parametrize(("lines", "message"), CASES)
def test_scene(lines: str, message: str) -> None:
    text, place = marked(HEAD + lines)
    assert error_of(text) == f"{place}: {message}"


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A scene's folder with good and bad grids, and one beside it."""
    path = tmp_path_factory.mktemp("grids") / "scene"
    path.mkdir()
    volume = Volume(np.zeros((5, 6, 7), np.float32), np.zeros(3), np.eye(3))
    write_volume(path / "good.nrrd", volume)
    write_volume(path.parent / "beside.nrrd", volume)
    data = (path / "good.nrrd").read_bytes()
    (path / "short.nrrd").write_bytes(data[:-10])
    (path / "text.nrrd").write_text("no volume")
    (path / "hostile.nrrd").write_bytes(
        b"NRRD0004\ntype: float\ndimension: 3\nsizes: 99999 99999 99999\nencoding: raw\nendian: little\n\n1234"
    )
    (path / "other.nrrd").symlink_to(path.parent / "beside.nrrd")
    return path


@pytest.mark.parametrize(
    ("name", "message"),
    cases(
        """
missing.nrrd => missing.nrrd cannot be read: No such file or directory
short.nrrd => is cut short: 7 x 6 x 5 voxels need 840 bytes, it has 830
text.nrrd => is neither a NRRD nor a NPY file
hostile.nrrd => is cut short: 99,999 x 99,999 x 99,999 voxels need 3,999,880,001,199,996 bytes, it has 4
../beside.nrrd => must be a path inside the scene's folder, got '../beside.nrrd'
other.nrrd => leads out of the scene's folder: 'other.nrrd'
/etc/hostname => must be a path inside the scene's folder, got '/etc/hostname'
"""
    ),
)
def test_files(folder: Path, name: str, message: str) -> None:
    text, place = marked(f"{HEAD}{VOLUME}file: §{name}}}\n")
    found = error_of(text, folder=folder)
    assert found.startswith(f"{place}: renderer.file: ")
    assert message in found


def test_a_level_beyond_a_files_values(folder: Path) -> None:
    """The file's values are all 0, which counts as a range of 1 around it."""
    for level in ("-0.5", "0.75", "300"):
        text, place = marked(f"{HEAD}{VOLUME}file: good.nrrd, level: §{level}}}\n")
        expected = f"must be above -0.5 and at most 0.5, the ends of the grid's values, got {level}"
        assert error_of(text, folder=folder) == f"{place}: renderer.level: {expected}"
    assert load_scene(f"{HEAD}{VOLUME}file: good.nrrd, level: 0.25}}\n", folder=folder).given is not None


def test_a_file_is_not_zoomed(folder: Path) -> None:
    text, place = marked(f"{HEAD}{VOLUME}file: good.nrrd, zoom: §[{{center: [0, 0, 0], scale: 2}}]}}\n")
    expected = f"{place}: renderer.zoom: is not possible in a grid from a file; remove zoom or file"
    assert error_of(text, folder=folder) == expected


@pytest.mark.parametrize(
    "keys",
    [{"value": "iterations", "store": "float"}, {"fill": "brute"}, {"fill": "brute", "value": "coverage"}],
)
def test_a_grid_that_does_not_fit_is_told_before_anything_starts(keys: dict[str, Any]) -> None:
    scene = scene_of(
        {"name": "mandelbulb"}, {}, (8, 8), renderer={"type": "volume", "resolution": 16384, **keys}
    )
    with pytest.raises(DeviceError) as caught:
        Engine(choose()).render(scene, lambda _: pytest.fail("it began"), precision="float32")
    assert caught.value.status == 2
    line = str(caught.value)
    assert "\n" not in line
    assert "a grid of 16384 x 16384 x 16384 voxels" in line
    # What is needed, and what there is.
    numbers = [word for word in line.replace(",", "").split() if word.replace(".", "", 1).isdigit()]
    assert len(numbers) >= 5, line


def test_a_light_within_a_file_s_grid(folder: Path) -> None:
    """The formula, which is not shown, is in nobody's way."""
    light = "\nlights: [{type: point, position: [0, 0.1, 0]}]"
    assert load_scene(f"{HEAD}{VOLUME}file: good.nrrd}}{light}", folder=folder).given is not None
    assert "must be outside the object" in error_of(f"{HEAD}{VOLUME}resolution: 8}}{light}")


def optional(**values: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    return st.fixed_dictionaries({}, optional=values)


coordinate = st.floats(-1e5, 1e5) | st.sampled_from([0, -0.0, 5e-324, 1e-300])
fraction = st.floats(0, 1)
vector = st.lists(coordinate, min_size=3, max_size=3)
color = st.lists(st.floats(0, 1e6), min_size=3, max_size=3)
at = st.floats(-1e12, 1e12)


def stops(**entry: st.SearchStrategy[Any]) -> st.SearchStrategy[list[dict[str, Any]]]:
    found = st.lists(st.fixed_dictionaries({"at": at, **entry}), min_size=1, max_size=4)
    return found.map(lambda each: sorted(each, key=lambda stop: float(stop["at"])))


side = st.floats(1e-6, 1e5)
zooms = st.lists(st.floats(1, 1e3), max_size=4)
planes = optional(
    center=vector,
    normal=st.just([1, -2, 0.5]),
    up=st.none() | st.just([0.2, 1, 0.1]),
    width=side,
    height=side,
    transform=st.lists(st.sampled_from([{"scale": 0.5}, {"move_side": 0.25}, {"rotate_y": 30}]), max_size=3),
)
palettes = st.sampled_from(["viridis", "opal_r"]) | st.just(
    [{"at": 0, "color": [0, 1, 2]}, {"at": 1, "color": [1, 1, 1]}]
)
colors = optional(
    palette=palettes,
    mode=st.sampled_from(["smooth", "stepped"]),
    curve=st.sampled_from(["linear", "root", "log"]),
    scale=coordinate,
    offset=coordinate,
    repeat=st.booleans(),
    inside=color,
)
cut_planes = st.lists(
    optional(
        plane=planes,
        colors=colors,
        opacity=fraction,
        inside_opacity=st.none() | fraction,
        cut=st.booleans(),
        iterations=st.none() | st.integers(1, 1_000_000),
        count=st.integers(1, 16),
        spacing=coordinate,
    ),
    max_size=4,
)
volumes = st.builds(
    lambda rest, middle, size, scales: {
        "type": "volume",
        **rest,
        # Boxes with one middle are within each other.
        "box": {"center": middle, "size": size},
        "zoom": [{"center": middle, "scale": scale} for scale in scales],
    },
    optional(
        resolution=st.integers(2, 16384) | st.lists(st.integers(2, 16384), min_size=3, max_size=3),
        value=st.sampled_from(["inside", "coverage", "iterations"]),
        sub_points=st.integers(1, 16),
        store=st.sampled_from(["byte", "float"]),
        fill=st.sampled_from(["octree", "brute"]),
        normals=st.sampled_from(["gradient", "least_squares", "exact"]),
        normal_radius=st.integers(0, 4),
        interpolation=st.sampled_from(["trilinear", "nearest"]),
        step=st.floats(0.01, 4),
        opacity_limit=st.floats(0, 1, exclude_min=True),
        transfer=optional(opacity=st.none() | stops(opacity=fraction), color=st.none() | stops(color=color)),
        shadows=st.booleans(),
        samples=st.integers(1, 100),
    ),
    vector,
    side | st.lists(side, min_size=3, max_size=3),
    zooms,
)
cuts = st.fixed_dictionaries(
    {"type": st.just("cut_plane")},
    optional={"plane": planes, "colors": colors, "iterations": st.none() | st.integers(1, 1_000_000)},
)
views = st.lists(
    st.builds(
        lambda looks, area: {**looks, **({"area": area} if area else {})},
        st.builds(lambda renderer, others: {"renderer": renderer, "cut_planes": others}, volumes, cut_planes)
        | cuts.map(lambda renderer: {"renderer": renderer, "cut_planes": []})
        | cuts.map(lambda renderer: {"renderer": renderer})
        | optional(camera=st.just({"position": [1, 2, 3]}), background=st.just("transparent")),
        st.none() | st.sampled_from([[0, 0, 1, 1], [0.25, 0.5, 0.5, 0.3]]),
    ),
    min_size=1,
    max_size=4,
)
layouts = st.none() | st.builds(
    lambda found, rest: {"views": found, **rest},
    views,
    optional(columns=st.none() | st.integers(1, 16), gap=st.integers(0, 20), background=color),
)


@given(volumes, cut_planes, layouts)
def test_what_is_dumped_loads_back(
    renderer: dict[str, Any], planes_: list[dict[str, Any]], layout: dict[str, Any] | None
) -> None:
    data = {
        "version": 1,
        "formula": {"name": "hast"},
        "camera": {},
        "renderer": renderer,
        "cut_planes": planes_,
        "layout": layout,
    }
    scene = load_scene(data)
    assert load_scene(dump_scene(scene)) == scene
    assert load_scene(scene.resolved()).resolved() == scene.resolved()
