"""Several views in one picture: each is its own picture in its place; what the header tells, what a region costs."""

from __future__ import annotations

import tracemalloc
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine.run import Progress
from clfractal.errors import SceneError
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.layout import Layout, Place
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from tests.devices import check_usable
from tests.render.bits import same_pictures
from tests.render.layouts import GAP, VIEWS, scene_of
from tests.render.shots import CHANNELS as EVERY
from tests.render.shots import engine_of, shoot, shoot_whole, stacked

SIZE = (140, 80)
PLACES = [Place(0, 0, 44, 80), Place(48, 0, 44, 80), Place(96, 0, 44, 80)]
CHANNELS = ("R", "G", "B", "A", "Z", "N.X", "iterations", "steps", "samples")


def layout() -> Scene:
    """A surface, a cut plane and a volume (of two samples) beside each other, of 2 x 3 tiles each."""
    return scene_of(VIEWS, SIZE, gap=4)


def for_two_eyes() -> Scene:
    """The same, for two eyes; both need a place to look from."""
    near = {**VIEWS[2], "camera": {"position": [1, -3, 1]}}
    plain = scene_of([*VIEWS[:2], near], SIZE, gap=4).resolved()
    return load_scene({**plain, "stereo": {"mode": "split", "separation": 0.5}})


def counted(device: Device, scene: Scene, **settings: Any) -> tuple[Framebuffer, Progress]:
    """The picture, and what it took."""
    seen: list[Progress] = []
    framebuffer = engine_of(device).render(scene, seen.append, channels=CHANNELS, **settings)
    return framebuffer, seen[-1]


class TestHeader:
    """Rendered again from its header, a picture has the same bits."""

    @pytest.mark.parametrize(
        ("settings", "numbers"),
        [({}, [1, 1, 2]), ({"samples": 3}, [3, 3, 3])],
        ids=["its own samples", "samples asked for"],
    )
    def test_once_more(self, device: Device, settings: dict[str, Any], numbers: list[int]) -> None:
        first = engine_of(device).render(layout(), channels=CHANNELS, **settings)
        told = load_scene(first.header["scene"])
        assert told.layout is not None
        renderers = [view.renderer for view in told.layout.views]
        assert [renderer.samples for renderer in renderers if renderer] == numbers
        assert [renderer.type for renderer in renderers if renderer] == ["surface", "cut_plane", "volume"]
        assert [renderer.precision for renderer in renderers if renderer] == ["float32"] * 3
        again = engine_of(device).render(told)
        same_pictures(again, first)
        assert again.header["scene"] == first.header["scene"]

    def test_from_a_file(self, device: Device, tmp_path: Any) -> None:
        first = engine_of(device).render(layout(), channels=("R", "G", "B", "A", "Z"))
        for name in ("a.exr", "a.png"):
            first.save(tmp_path / name)
            same_pictures(clfractal.render(clfractal.load_scene(tmp_path / name)), first)

    def test_each_view_has_the_number_type_it_was_made_with(self, device: Device) -> None:
        """One that looks at a spot of 10^-9 needs float64; it is told, and the others stay."""
        check_usable("float64")
        spot = {"center": [0.1, 0, 0], "width": 1e-9, "height": 1e-9}
        deep = {"renderer": {"type": "cut_plane", "plane": spot}}
        scene = scene_of([{}, deep], SIZE)
        first = engine_of(device).render(scene, channels=CHANNELS)
        told = load_scene(first.header["scene"])
        assert told.layout is not None
        found = [view.renderer.precision for view in told.layout.views if view.renderer]
        assert found == ["float32", "float64"]
        assert first.header["precision"] == "float32, float64"
        same_pictures(engine_of(device).render(told), first)

    def test_of_both_eyes(self, device: Device) -> None:
        scene = for_two_eyes()
        first = engine_of(device).render(scene, channels=CHANNELS, samples=2)
        assert first["R"].shape == (SIZE[1], 2 * SIZE[0])
        assert (first["R"][:, : SIZE[0]] != first["R"][:, SIZE[0] :]).any()
        same_pictures(engine_of(device).render(load_scene(first.header["scene"])), first)


@pytest.fixture(scope="module")
def whole(device: Device) -> Framebuffer:
    """The layout in one go."""
    return counted(device, layout())[0]


class TestRegion:
    @pytest.mark.parametrize(
        ("region", "tiles"),
        [
            ((0, 0, 140, 80), 3 * 6),
            ((0, 0, 44, 80), 6),  # one view
            ((50, 10, 20, 20), 1),  # one tile of one view
            (
                (40, 30, 20, 4),
                2 + 2,
            ),  # columns 40 to 44 of the first and 0 to 12 of the second, two rows of tiles
            ((92, 40, 10, 20), 1),  # a gap, and the rim of the third
            ((79, 31, 2, 2), 4),  # around a corner of the second one's tiles
        ],
    )
    def test_it_is_the_part_of_the_whole(
        self,
        device: Device,
        whole: Framebuffer,
        region: tuple[int, int, int, int],
        tiles: int,
    ) -> None:
        """And only the tiles that it shows are rendered, of the views that it shows; rays are those of its pixels."""
        x, y, width, height = region
        framebuffer, state = counted(device, layout(), region=region)
        assert (framebuffer.display, framebuffer["R"].shape) == (SIZE, (height, width))
        for name in CHANNELS:
            cut = np.ascontiguousarray(whole[name][y : y + height, x : x + width])
            np.testing.assert_array_equal(framebuffer[name].view(np.uint32), cut.view(np.uint32), name)
        assert (state.tiles, state.tiles_done, state.tiles_before) == (tiles, tiles, 0)
        shown = np.zeros(SIZE[::-1], int)
        for place, samples in zip(PLACES, (1, 1, 2), strict=True):
            shown[place.y : place.y + place.height, place.x : place.x + place.width] = samples
        assert state.rays == shown[y : y + height, x : x + width].sum()

    def test_a_gap_alone(self, device: Device, tmp_path: Any) -> None:
        """Nothing is rendered, and it can be written, and shown again."""
        seen: list[Progress] = []
        framebuffer = engine_of(device).render(
            layout(), seen.append, region=(44, 3, 4, 50), channels=CHANNELS
        )
        assert seen == []
        assert [set(framebuffer[name].flat) for name in "RGB"] == [{value} for value in GAP]
        assert set(framebuffer["A"].flat) == {1}
        framebuffer.save(tmp_path / "gap.exr")
        assert clfractal.load_scene(tmp_path / "gap.exr").layout is not None

    def test_of_the_largest_picture(self, device: Device) -> None:
        """Memory and time are those of the region: its tiles at the rims of two views of 8192 x 16384 pixels."""
        scene = scene_of([{}, VIEWS[1]], (16384, 16384))
        tracemalloc.start()
        framebuffer, state = counted(device, scene, region=(8180, 8190, 30, 20), precision="float32")
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        # Rows 8190 to 8210 lie in two rows of tiles.
        assert (state.tiles, state.rays) == (2 + 2, 30 * 20)
        assert framebuffer["R"].shape == (20, 30)
        assert set(framebuffer["samples"].flat) == {1}
        assert peak < 20e6

    def test_of_both_eyes(self, device: Device) -> None:
        """Of a picture of two layouts beside each other: of the left eye its last view, of the right one its first."""
        scene = for_two_eyes()
        whole = engine_of(device).render(scene, channels=CHANNELS)
        part, state = counted(device, scene, region=(130, 20, 24, 30))
        for name in CHANNELS:
            np.testing.assert_array_equal(part[name], whole[name][20:50, 130:154], name)
        assert (state.tiles, state.tiles_done) == (2 + 2, 4)


class TestAsked:
    """`samples` and `precision` are every view's, also of one that has a renderer of its own."""

    def test_samples(self, device: Device) -> None:
        framebuffer, state = counted(device, layout(), samples=3)
        for place in PLACES:
            part = framebuffer["samples"][:, place.x : place.x + place.width]
            assert set(part.flat) == {3}
        assert state.rays == 3 * sum(place.width * place.height for place in PLACES)

    def test_samples_below_the_fewest_of_a_noise(self, device: Device) -> None:
        """A view that stops by its noise, after at least 16 samples: asked for fewer, it takes these."""
        noisy = {"renderer": {"type": "surface", "samples": 64, "noise": 0.01, "min_samples": 16}}
        scene = scene_of([noisy, {}], SIZE)
        framebuffer = engine_of(device).render(scene, samples=8, channels=CHANNELS)
        assert framebuffer["samples"].max() == 8
        same_pictures(engine_of(device).render(load_scene(framebuffer.header["scene"])), framebuffer)

    @pytest.mark.parametrize("precision", ["float32", "float64"])
    def test_precision(self, device: Device, precision: Precision) -> None:
        """Views that ask for the other one are overruled; the bits are those of views that ask for it themselves."""
        check_usable(precision)
        other = "float32" if precision == "float64" else "float64"

        def with_precision(wanted: str) -> Scene:
            views = [
                {**view, "renderer": {**view.get("renderer", {"type": "surface"}), "precision": wanted}}
                for view in VIEWS
            ]
            return scene_of(views, SIZE, gap=4)

        job = engine_of(device).prepare(with_precision(other), precision=precision)
        assert [view.plan.precision for view in job.views] == [precision] * 3
        found = engine_of(device).render(with_precision(other), precision=precision, channels=CHANNELS)
        assert found.header["precision"] == precision
        same_pictures(found, engine_of(device).render(with_precision(precision), channels=CHANNELS))


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
    expected[:] = [empty.get(name, 0) for name in EVERY]
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
