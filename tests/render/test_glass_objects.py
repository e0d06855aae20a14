"""Objects and sets of glass along paths: light absorbed, glass in glass, colours spread, other things inside."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import yaml

import clfractal
from clfractal.errors import SceneError
from clfractal.files.channels import CHANNELS, NOISY
from clfractal.scene.model import Scene
from tests.render.glass_scenes import BODIES, FAR_OFF, Floats, ball, colors_of, glass, scene
from tests.render.path_scenes import BALL, GREY, path, scene_of, seen
from tests.variants import one_of

pytestmark = pytest.mark.light


def plain_scene(objects: dict[str, Any]) -> dict[str, Any]:
    """As a file has it, with objects of glass."""
    return {
        "version": 1,
        "formula": BALL,
        "camera": {},
        "lighting": {"mode": "path"},
        "materials": {"glass": glass()},
        "objects": objects,
    }


def joined_glass(objects: dict[str, Any], material: dict[str, Any], **sections: Any) -> Scene:
    return scene_of(
        objects=objects,
        materials={"glass": material},
        material={"name": "glass"},
        lighting=path(64),
        image={"width": 96, "height": 96},
        background=GREY,
        **sections,
    )


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_media_absorb_along_the_way(precision: str) -> None:
    """Glass that bends nothing: a slab leaves what Beer and Lambert's law says, also with the eye in it."""
    color, depth = np.array([0.9, 0.5, 0.1]), 0.8
    materials = {"glass": glass(0, 1.0, color=list(color), depth=depth)}
    slab = {"type": "box", "size": [9, 1.2, 9], "material": "glass"}
    colors = colors_of(scene({"slab": slab}, materials), 16, precision=precision)
    assert np.abs(colors[16, 16] - color ** (1.2 / depth)).max() < 0.003
    around = {"type": "box", "size": [9, 9, 9], "position": [0, -4, 0], "material": "glass"}
    colors = colors_of(scene({"around": around}, materials), 16, precision=precision)
    assert np.abs(colors[16, 16] - color ** (4.5 / depth)).max() < 0.003


def test_a_lamp_in_a_medium_is_dimmed_on_both_of_its_ways() -> None:
    """A ground of Lambert's law under a lamp in a medium that bends nothing, seen from inside it and from outside."""
    color, depth = np.array([0.9, 0.6, 0.3]), 2.0
    materials = {
        "glass": glass(0, 1.0, color=list(color), depth=depth),
        "white": {"base": {"color": [0.8, 0.8, 0.8]}, "specular": {"weight": 0}},
    }
    ground = {"type": "plane", "position": [0, 1, 0], "normal": [0, -1, 0], "material": "white"}
    lamp = {"type": "sphere", "position": [0, 44, 0.7], "radius": 0.05, "intensity": 1}
    dark = {"top": [0, 0, 0], "bottom": [0, 0, 0]}
    clear = colors_of(scene({"ground": ground}, materials, lights=[lamp], background=dark, bounces=0), 64)
    around = {"type": "box", "size": [9, 9, 9], "position": [0, -3.4, 0], "material": "glass"}
    both = {"ground": ground, "around": around}
    found = colors_of(scene(both, materials, lights=[lamp], background=dark, bounces=0), 64)
    place = (12, 16)
    # From the lamp to the middle of the ground and to the eye; what lies between in this pixel.
    up = (16 - place[0] - 0.5) / 16 * np.tan(np.radians(15)) * 5
    eye, spot = np.array([0, 40, 0]), np.array([0, 45, up])
    way = np.linalg.norm(spot - eye) + np.linalg.norm(spot - np.array([0, 44, 0.7]))
    expected = clear[place] * color ** (way / depth)
    assert clear[place].min() > 0.001
    np.testing.assert_allclose(found[place], expected, rtol=0.03)


@pytest.mark.combination
def test_what_stands_later_in_the_file_displaces_what_it_overlaps() -> None:
    """Two slabs of one glass that overlap look as one does, and water in a slab that stands later is not seen.

    (Equal glasses have a boundary of index 1.005 between them.)
    """
    materials = {"glass": glass(0, 1.5, color=[0.9, 0.5, 0.2], depth=1), "water": glass(0, 1.2)}
    turn = {"rotation": [0, 0, 20], "material": "glass"}
    one = {"slab": {"type": "box", "size": [3, 1.2, 3], **turn}}
    across = 0.2 * np.array([-np.sin(np.radians(20)), np.cos(np.radians(20)), 0])
    two = {
        "front": {"type": "box", "size": [3, 0.8, 3], "position": (-across).tolist(), **turn},
        "back": {"type": "box", "size": [3, 0.8, 3], "position": across.tolist(), **turn},
    }
    behind = {
        "post": {"type": "cylinder", "radius": 0.3, "height": 9, "position": [0, 2, 0], "material": "post"}
    }
    materials["post"] = {"base": {"color": [0.2, 0.3, 0.9]}, "emission": {"luminance": 0.5}}

    def blocks(objects: dict[str, Any]) -> Floats:
        inner = colors_of(scene({**objects, **behind}, materials, bounces=16), 256)[6:-6, 6:-6]
        return np.asarray(inner.reshape(4, 5, 4, 5, 3).mean(axis=(1, 3)))

    alone = blocks(one)
    assert np.std(alone) > 0.05
    assert np.abs(blocks(two) - alone).max() < 0.02
    hidden = {"water": {"type": "box", "size": [1, 0.5, 1], "rotation": [0, 0, 20], "material": "water"}}
    assert np.abs(blocks({**hidden, **one}) - alone).max() < 0.012
    assert np.abs(blocks({**one, **hidden}) - alone).max() > 0.03


def test_objects_within_a_set_of_glass_are_seen() -> None:
    """A ball that shines, in one of clear glass."""
    materials = {
        "glass": glass(0, 1.0),
        "lamp": {"base": {"weight": 0}, "specular": {"weight": 0}, "emission": {"luminance": 3}},
    }
    objects = {"lamp": {"type": "sphere", "radius": 0.4, "position": [0, -44, 0], "material": "lamp"}}
    colors = colors_of(
        scene(objects, materials, camera={"position": [0, -4, 0], "fov": 40}, material={"name": "glass"}), 16
    )
    assert abs(colors[16, 16].mean() - 3) < 0.01
    assert abs(colors[16, 26].mean() - 1) < 0.02


@pytest.mark.parametrize(
    "more",
    one_of({"color": [0.9, 0.9, 0.9], "depth": 1, "scatter": [0.8, 0.8, 0.8]}, {}),
    ids=["milk", "clear"],
)
def test_all_that_pixels_keep_has_room(more: dict[str, Any]) -> None:
    """Glass, clear or not, with a relief and waves in fog that shines, through a lens, with a glow and all channels."""
    relief = {"height": {"by": "trap", "curve": [[0, 0], [1, 0.1]]}}
    found = scene_of(
        materials={"glass": {**glass(0.1, dispersion_scale=1, **more), "bump": relief}},
        material={"name": "glass"},
        lighting=path(2),
        glow={"by": "trap"},
        fog={"density": 0.05, "scattering": {}},
        objects={"sea": {"type": "water", "position": [0, 0, -1], "material": "glass"}},
        lights=[{"direction": [1, 1, -1]}, {"type": "sphere", "position": [3, 0, 3], "radius": 0.2}],
        coloring={"by": "trap"},
        camera={"position": [0, -4, 0], "f_number": 4},
        image={"width": 16, "height": 16},
    )
    film = clfractal.render(found, channels=[name for name in CHANNELS if name not in NOISY])
    assert film["A"].max() == 1
    assert all(np.isfinite(film[name]).all() for name in CHANNELS if name not in ("Z", *NOISY))


def test_only_lamps_with_a_size_may_stand_in_glass() -> None:
    values = plain_scene({"ball": {"type": "sphere", "position": [4, 0, 0], "material": "glass"}})
    lamp = {"position": [4, 0, 0.2]}
    clfractal.load_scene(yaml.safe_dump({**values, "lights": [{"type": "sphere", "radius": 0.1, **lamp}]}))
    with pytest.raises(SceneError, match=r"lights.0.position: must be outside the object 'ball'"):
        clfractal.load_scene(yaml.safe_dump({**values, "lights": [{"type": "point", **lamp}]}))


def test_a_light_without_shadows_is_no_brighter_in_water_that_absorbs() -> None:
    def seen(color: list[float]) -> float:
        objects = {
            "floor": {"type": "plane", "position": [0, 0, -1.5], "material": "floor"},
            "sea": {"type": "plane", "material": "sea"},
        }
        materials = {"sea": glass(ior=1.33, color=color, depth=1), "floor": {"base": {"color": [0.5] * 3}}}
        lights = [{"direction": [0, 0, -1], "shadow": False}]
        dark = {"lights": lights, "background": [0, 0, 0], "bounces": 4}
        found = scene(
            objects, materials, camera={"position": [0, 41, 3], "target": [0, 44, -1], "fov": 30}, **dark
        )
        return float(colors_of(found, 16).mean())

    clear, deep = seen([1, 1, 1]), seen([0.3, 0.3, 0.3])
    assert clear > 0.02
    assert deep < 0.6 * clear


@pytest.mark.combination
def test_what_is_left_of_a_set_is_as_an_object_of_that_shape() -> None:
    """A ball of which only a box is left is a box of glass: the same light comes through it, dimmed by the same ways."""
    clear = glass(0, 1.4, color=[0.7, 0.4, 0.2], depth=0.5)
    box = {**BODIES["box"], "size": [1, 0.8, 0.6]}
    camera = {"position": [0, -4, 0], "target": [0, 0, 0], "fov": 24}
    left = colors_of(joined_glass({"box": {**box, "join": "intersection"}}, clear, camera=camera), 24)
    beside = scene(
        {"box": {**box, "material": "glass"}},
        {"glass": clear},
        camera={"position": [0, 40, 0], "target": [0, 44, 0], "fov": 24},
        bounces=64,
    ).model_copy(update={"image": joined_glass({}, clear).image})
    whole: Floats = colors_of(beside, 24)
    assert FAR_OFF["position"] == [0, 40, 0]
    np.testing.assert_allclose(left.mean(axis=(0, 1)), whole.mean(axis=(0, 1)), rtol=0.01)
    # The edges of a set are a footprint wide: at a quarter of this size of picture it is 8 %, at twice it 2 %.
    middle = (slice(34, 62), slice(34, 62))
    np.testing.assert_allclose(left[middle].mean(axis=(0, 1)), whole[middle].mean(axis=(0, 1)), rtol=0.05)


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_media_absorb_along_the_chord(precision: str) -> None:
    """Glass that bends nothing: pixels have what Beer and Lambert's law leaves of white on a chord of the ball."""
    color, depth = np.array([0.9, 0.5, 0.1]), 0.8
    scene = ball(0, 1.0, transmission={"color": list(color), "depth": depth})
    found, normals, _ = seen(scene, 16, precision=precision)
    toward = normals - np.array([0, -4, 0])
    toward /= np.linalg.norm(toward, axis=1, keepdims=True)
    chord = -2 * (normals * toward).sum(axis=1)
    expected = color ** (chord[:, None] / depth)
    inner = chord > 1
    assert inner.sum() > 100
    assert np.abs(found[inner] - expected[inner]).max() < 0.03
    # (Where the set begins is known to a part of a footprint.)
    assert abs((found[inner] / expected[inner]).mean() - 1) < 0.008


def test_without_a_depth_boundaries_are_tinted() -> None:
    """Twice on the way through a ball whose index is that of the air."""
    color = np.array([0.9, 0.5, 0.2])
    colors = seen(ball(0, 1.0, transmission={"color": list(color)}), 16)[0]
    assert np.abs(np.median(colors, axis=0) - color**2).max() < 0.005


def test_colours_spread_and_are_white_together() -> None:
    """Under a grey gradient red and blue come from other places only with dispersion; white stays white."""
    grey = {"top": [1, 1, 1], "bottom": [0, 0, 0]}
    plain = seen(ball(0, background=grey), 16)[0]
    assert np.abs(plain[:, 0] - plain[:, 2]).max() < 1e-4
    spread: dict[str, Any] = {"dispersion_scale": 1, "dispersion_abbe_number": 5}
    colors = seen(ball(0, background=grey, transmission=spread), 128)[0]
    apart = colors[:, 0] - colors[:, 2]
    half = len(apart) // 2
    # The picture is upside down: above, blue, which is bent more, comes from deeper.
    assert apart[:half].mean() > 0.01
    assert apart[half:].mean() < -0.01
    white = seen(ball(0, transmission=spread), 128)[0]
    assert np.abs(white.mean(axis=0) - 1).max() < 0.01


def test_a_sun_shines_through_rough_glass() -> None:
    """A light of one direction is asked for where paths leave the glass: behind a ball it is seen."""
    dark = {"top": [0, 0, 0], "bottom": [0, 0, 0]}
    scene = ball(0.6, background=dark, lights=[{"direction": [0, -1, 0]}])
    colors = seen(scene, 64)[0]
    assert colors.mean() > 0.05
    smooth = scene_of(background=dark, lights=[{"direction": [0, -1, 0]}], lighting=path(8))
    assert seen(smooth, 4)[0].mean() < 0.01
