"""Several views in one picture: each is its own picture, put into its place."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.errors import SceneError
from clfractal.scene.layout import Layout
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from tests.render.layouts import GAP, VIEWS, scene_of
from tests.render.shots import CHANNELS, shoot, shoot_whole, stacked


def alone(scene: Scene, number: int, size: tuple[int, int]) -> Scene:
    """The view as a scene that somebody wrote by itself."""
    plain = scene.resolved()
    plain["layout"] = None
    plain["image"] = {"width": size[0], "height": size[1]}
    view = scene.layout.views[number].model_dump(mode="json") if scene.layout else {}
    return load_scene({**plain, **{k: v for k, v in view.items() if k != "area" and v is not None}})


def check(scene: Scene, places: list[tuple[int, int, int, int]], device: Device) -> None:
    """Each place (x, y, width, height) has the bits of the view alone, later ones over others; all else is the layout's
    background."""
    framebuffer = stacked(shoot_whole(scene, device))
    empty = {**dict(zip("RGB", GAP, strict=True)), "A": 1, "Z": np.inf}
    expected = np.empty_like(framebuffer)
    expected[:] = [empty.get(name, 0) for name in CHANNELS]
    for number, (x, y, width, height) in enumerate(places):
        own = shoot(alone(scene, number, (width, height)), device)
        expected[y : y + height, x : x + width] = stacked(own)
    np.testing.assert_array_equal(framebuffer.view(np.uint32), expected.view(np.uint32))


def test_views_beside_each_other(device: Device) -> None:
    """Cells of a row share what the gaps leave: (91 - 2 * 3) / 3 = 28 and a third."""
    check(scene_of(VIEWS, gap=3), [(0, 0, 28, 50), (31, 0, 28, 50), (62, 0, 29, 50)], device)


def test_a_plane_by_itself_has_no_other_planes_in_it(device: Device) -> None:
    """The scene's planes stand in the views of its object, not in that of a plane; one that asks for some is wrong."""
    glass = [{"plane": {"normal": [0, -1, 0.3], "width": 2}, "opacity": 0.6}]
    scene = scene_of(VIEWS[:2])
    scene = load_scene({**scene.resolved(), "cut_planes": glass})
    assert [len(view.cut_planes) for view, _ in scene.views] == [1, 0]
    framebuffer = stacked(shoot_whole(scene, device))
    bare = stacked(shoot_whole(scene_of(VIEWS[:2]), device))
    np.testing.assert_array_equal(framebuffer[:, 45:].view(np.uint32), bare[:, 45:].view(np.uint32))
    assert (framebuffer[:, :45] != bare[:, :45]).any()
    with pytest.raises(SceneError, match=r"^layout\.views\.0\.cut_planes: are for surface and volume"):
        scene_of([{**VIEWS[1], "cut_planes": glass}])


def test_areas_cover_each_other_in_order(device: Device) -> None:
    """An inset over a view that fills the picture; parts of pixels are rounded."""
    views = [{**VIEWS[0], "area": [0, 0, 1, 1]}, {**VIEWS[1], "area": [0.7, 0.05, 0.25, 0.5]}]
    # 63.7, 2.5 (to even), 86.45 - 63.7, 27.5 (to even) - 2
    check(scene_of(views), [(0, 0, 91, 50), (64, 2, 22, 26)], device)


@pytest.mark.parametrize(
    ("layout", "size", "places"),
    [
        ({"columns": 2}, (10, 6), [(0, 0, 5, 3), (5, 0, 5, 3), (0, 3, 5, 3)]),
        ({"columns": 1, "gap": 1}, (4, 11), [(0, 0, 4, 3), (0, 4, 4, 3), (0, 8, 4, 3)]),
        ({"columns": 2, "gap": 2}, (9, 8), [(0, 0, 3, 3), (5, 0, 4, 3), (0, 5, 3, 3)]),
        ({}, (7, 2), [(0, 0, 2, 2), (2, 0, 2, 2), (4, 0, 3, 2)]),
    ],
)
def test_cells(
    layout: dict[str, Any], size: tuple[int, int], places: list[tuple[int, int, int, int]]
) -> None:
    found = Layout.model_validate({"views": [{}, {}, {}], **layout}).places(*size, reference=size[1])
    assert [(place.x, place.y, place.width, place.height) for place in found] == places


@pytest.mark.parametrize(("times", "gap"), [(0.01, 1), (0.25, 2), (0.5, 3), (1, 6), (2, 12)])
def test_gaps_grow_with_the_picture(times: float, gap: int) -> None:
    """A picture at another size is the same picture: gaps are pixels of the reference, and never vanish."""
    layout = Layout.model_validate({"views": [{}, {}], "gap": 6})
    left, right = layout.places(round(800 * times), round(400 * times), reference=400)
    assert right.x - left.x - left.width == gap
    assert left.x + right.x + right.width == round(800 * times)
