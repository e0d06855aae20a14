"""Planes that cut what they name, and the faces of their cuts, against NumPy: in both lights, and in mirrors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.device.select import Device
from clfractal.formulas import reference
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject
from tests import scenes
from tests.render.cut_oracle import BODIES, MIRROR, PLANES, WHITE, Met, face_tint, first_met, scene_of
from tests.render.shots import CHANNELS as EVERY
from tests.render.shots import Floats, normals_of, points_of, rays, shoot, stacked
from tests.variants import one_of
from tests.voxels.joined import EVERY_JOIN, belongs, held_by, own_places

ALBEDO = ("albedo.R", "albedo.G", "albedo.B")
CHANNELS = (*(name for name in EVERY if name not in ("steps", "samples")), "object", *ALBEDO)
MODES: dict[str, dict[str, Any]] = {"direct": {}, "path": {"lighting": {"mode": "path", "bounces": 0}}}


def framebuffer_of(scene: Scene, device: Device, **settings: Any) -> Framebuffer:
    return shoot(scene, device, **{"channels": CHANNELS, **settings})


def met_by_eye(scene: Scene) -> tuple[Met, Floats, Floats]:
    """What the pixels' middles see first, where that is, and the directions there."""
    origin, direction, _ = rays(scene)
    found = first_met(scene, origin, direction)
    with np.errstate(invalid="ignore"):
        return found, origin + found.t[..., None] * direction, direction


@pytest.mark.parametrize("mode", MODES)
@pytest.mark.parametrize("lanes", one_of(None, 1))
def test_each_plane_cuts_what_it_names(device: Device, mode: str, lanes: int | None) -> None:
    """The set has the first plane's face only, though the other passes it; the crate has the other's; the egg, in front of
    both, is whole. Places, normals, counts, colours and things, pixel by pixel."""
    scene = scene_of(**MODES[mode])
    framebuffer = framebuffer_of(scene, device, lanes=lanes)
    found, at, _ = met_by_eye(scene)
    sure = found.sure & (found.body >= 0)
    assert (~found.sure).mean() < 0.15
    faces = {body: sure & (found.body == body) & (found.plane >= 0) for body in range(len(BODIES))}
    assert [int(faces[body].sum() > 80) for body in range(len(BODIES))] == [1, 1, 0, 0]
    assert (found.plane[faces[0]] == 0).all()
    assert (found.plane[faces[1]] == 1).all()
    assert (sure & (found.body == 2)).sum() > 60
    np.testing.assert_allclose(points_of(framebuffer)[sure], at[sure], atol=4e-3)
    face = sure & (found.plane >= 0)
    np.testing.assert_allclose(points_of(framebuffer)[face], at[face], atol=2e-5)
    np.testing.assert_allclose(normals_of(framebuffer)[face], found.normal[face], atol=1e-6)
    beside = sure & (found.body > 0)
    np.testing.assert_allclose(normals_of(framebuffer)[beside], found.normal[beside], atol=1e-4)
    tint, certain = face_tint(scene, found, at)
    face &= certain
    np.testing.assert_allclose(stacked(framebuffer, ALBEDO)[face], tint[face], atol=2e-4)
    np.testing.assert_array_equal(np.unique(framebuffer["iterations"][faces[1]]), [3])
    counts = reference.escape(scene.chain, at[faces[0] & certain], 8)[0]
    np.testing.assert_array_equal(framebuffer["iterations"][faces[0] & certain], counts)
    assert {4, 5, 6, 7, 8} == set(counts.tolist())
    for body in range(len(BODIES)):
        assert len(np.unique(framebuffer["object"][sure & (found.body == body)])) == 1
    assert not framebuffer["A"][found.sure & (found.body < 0)].any()


def test_faces_have_no_light_in_phongs(device: Device) -> None:
    """They show their colours, and a mirror shows the same."""
    scene = scene_of(renderer={"detail": 0.05, "bounces": 1}, lights=[{"direction": [0.2, 1, -1]}])
    framebuffer = framebuffer_of(scene, device)
    found, at, direction = met_by_eye(scene)
    tint, certain = face_tint(scene, found, at)
    face = found.sure & certain & (found.plane >= 0)
    np.testing.assert_allclose(stacked(framebuffer, "RGB")[face], tint[face], atol=2e-4)
    check_mirrored(scene, framebuffer, found, at, direction, lambda tint, normal: tint)


def check_mirrored(
    scene: Scene, framebuffer: Framebuffer, found: Met, at: Floats, direction: Floats, shown: Any
) -> None:
    """Where the mirror reflects a face the picture has the face's light; `shown` makes it of its colour and normal."""
    here = found.sure & (found.body == BODIES.index("mirror")) & (found.normal[..., 2] > 0.5)
    start = at[here]
    onward = direction[here] * np.array([1, 1, -1])
    other = first_met(scene, start + 1e-6 * onward, onward)
    there = start + np.where(np.isfinite(other.t), other.t, 0)[..., None] * onward
    tint, certain = face_tint(scene, other, there, rim=1e-3)
    mirrored = other.sure & certain & (other.plane >= 0)
    assert mirrored.sum() > 25
    expected = shown(tint[mirrored], other.normal[mirrored])
    # (Along paths a mirror is a little rough, so that single pixels see another ring.)
    alike = np.isclose(stacked(framebuffer, "RGB")[here][mirrored], expected, atol=2e-3).all(-1)
    assert alike.mean() > 0.97


def test_a_lamp_lights_faces_as_lambert_says(device: Device) -> None:
    """Colour times cosine times intensity, on the set's face and on the crate's; and so in the mirror after one bounce."""
    toward = np.array([-0.1, -0.9, 0.6])
    lamp = {"direction": list(-toward), "intensity": 0.7, "shadow": False}
    toward = toward / np.linalg.norm(toward)
    scene, further = (scene_of(lighting={"mode": "path", "bounces": each}, lights=[lamp]) for each in (0, 1))
    framebuffer = framebuffer_of(scene, device)
    found, at, direction = met_by_eye(scene)
    tint, certain = face_tint(scene, found, at)
    face = found.sure & certain & (found.plane >= 0)
    cosine = np.maximum(found.normal @ toward, 0)
    assert {0, 1} == set(np.unique(found.plane[face]))
    assert cosine[face].min() > 0.3
    expected = 0.7 * tint * cosine[..., None]
    np.testing.assert_allclose(stacked(framebuffer, "RGB")[face], expected[face], atol=2e-4)
    check_mirrored(
        further,
        framebuffer_of(further, device),
        found,
        at,
        direction,
        lambda tint, normal: 0.7 * tint * np.maximum(normal @ toward, 0)[..., None],
    )


def test_faces_have_materials(device: Device) -> None:
    """One that shines, on the set; and one without a colour, which is the plane's, on the crate."""
    lamp = {
        "base": {"weight": 0},
        "specular": {"weight": 0},
        "emission": {"luminance": 2, "color": [0.5, 0.2, 0.1]},
    }
    scene = scene_of(
        lighting={"mode": "path", "bounces": 0},
        materials={"mirror": MIRROR, "lamp": lamp, "half": {"base": {"weight": 0.5}}},
        cut_planes=[{**PLANES[0], "material": "lamp"}, {**PLANES[1], "material": "half"}],
    )
    framebuffer = framebuffer_of(scene, device)
    found, _, _ = met_by_eye(scene)
    set_face, crate_face = (found.sure & (found.body == body) & (found.plane >= 0) for body in (0, 1))
    assert min(set_face.sum(), crate_face.sum()) > 80
    shown = stacked(framebuffer, "RGB")
    np.testing.assert_allclose(
        shown[set_face], np.broadcast_to([1, 0.4, 0.2], shown[set_face].shape), atol=1e-3
    )
    albedo = stacked(framebuffer, ALBEDO)[crate_face]
    np.testing.assert_allclose(albedo, np.broadcast_to([0.05, 0.3, 0.1], albedo.shape), atol=2e-4)


def test_faces_throw_no_shadow_on_themselves(device: Device) -> None:
    """Where a light of intensity 1 shines along the first plane's normal its face has its colours, but in the
    egg's shadow."""
    toward = np.array(PLANES[0]["plane"]["normal"])
    scene = scene_of(**MODES["path"], lights=[{"direction": list(-toward), "shadow": True}])
    light = stacked(framebuffer_of(scene, device), "RGB")
    found, at, _ = met_by_eye(scene)
    tint, certain = face_tint(scene, found, at)
    face = found.sure & certain & (found.plane == 0)
    lit = face & (light.max(-1) > 0)
    assert lit.sum() > 0.8 * face.sum()
    np.testing.assert_allclose(light[lit], tint[lit], atol=2e-4)


def test_shadows_end_where_cuts_begin(device: Device) -> None:
    """The mirror is out of the light of what is left of the bodies, and in that of what planes removed: here, matt and seen
    from the side of a lamp, each of its pixels is lit or not as its own ray to the light says."""
    toward = np.array([0.9, 0.3, 1.2]) / np.linalg.norm([0.9, 0.3, 1.2])
    matt = {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}}
    scene = scene_of(
        lighting={"mode": "path", "bounces": 0},
        lights=[{"direction": list(-toward)}],
        materials={"mirror": matt},
    )
    framebuffer = framebuffer_of(scene, device)
    found, at, _ = met_by_eye(scene)
    here = found.sure & (found.body == BODIES.index("mirror")) & (found.normal[..., 2] > 0.5)
    start = at[here] + [0, 0, 1e-4]
    blocked = first_met(scene, start, np.broadcast_to(toward, start.shape))
    sure = blocked.sure
    dark = framebuffer["R"][here] == 0
    assert ((blocked.body >= 0) & sure).sum() > 80
    # What was there before: whole bodies would have dark places more.
    whole = first_met(
        scene.model_copy(update={"cut_planes": ()}), start, np.broadcast_to(toward, start.shape)
    )
    assert (sure & whole.sure & (whole.body >= 0) & (blocked.body < 0)).sum() > 60
    assert (dark != (blocked.body >= 0))[sure].mean() < 5e-3
    np.testing.assert_allclose(framebuffer["R"][here][sure & ~dark], toward[2], atol=1e-3)


def test_a_white_cut_model_in_a_white_sky_is_white(device: Device) -> None:
    """Faces neither make nor lose light, however often it bounces between them and the mirror."""
    sky = {"top": [1, 1, 1], "bottom": [1, 1, 1]}
    lighting = {"mode": "path", "bounces": 48, "roulette": 48}
    scene = scene_of(
        background=sky, lighting=lighting, cut_planes=WHITE, renderer={"detail": 0.05, "samples": 8}
    )
    framebuffer = framebuffer_of(scene, device)
    found, _, _ = met_by_eye(scene)
    for body in (0, 1):
        face = found.sure & (found.body == body) & (found.plane >= 0)
        assert abs(framebuffer["G"][face].mean() - 1) < 2e-3
    # At the edge of a cut few hits face away from the eye, as at any rim.
    assert abs(framebuffer["G"].mean() - 1) < 1e-3
    assert (abs(framebuffer["G"] - 1) > 0.01).mean() < 0.01


SIDE = 96
OBJECTS = {name: EVERY_JOIN[name] for name in ("egg", "hole", "julia", "box")}


def joined_scene(renderer: dict[str, Any], **plane: Any) -> Any:
    """A plane across the set and all objects at y = 0.1, seen straight on: pixels are 4 / SIDE wide."""
    named = ["egg", "box"] if renderer["type"] == "surface" else []
    place = {"center": [0, 0.1, 0], "normal": [0, -1, 0], "width": 4, "height": 4}
    usual = {"cut": True, "objects": named, "opacity": 1, "colors": {"mode": "stepped"}}
    return scenes.scene_of(
        {"name": "mandelbulb", "iterations": 7},
        {"projection": "orthographic", "position": [0, -5, 0], "height": 4},
        (SIDE, SIDE),
        renderer=renderer,
        objects=OBJECTS,
        cut_planes=[{"plane": place, **usual, **plane}],
    )


def points_of_pixels() -> np.ndarray[Any, np.dtype[np.float64]]:
    along = (np.arange(SIDE) + 0.5) / SIDE * 4 - 2
    x, z = np.meshgrid(along, -along)
    return np.stack([x, np.full_like(x, 0.1), z], axis=-1)


def counts_of(scene: Scene, at: Any, limit: int | None) -> Any:
    """Whole counts: the largest of what is beside each other; the limit inside, also of what the plane names; 0 where
    something is cut out of the set."""
    most = limit or scene.formula.iterations
    found = reference.escape(scene.chain, at.reshape(-1, 3), most)[0].reshape(at.shape[:-1])
    for name, each in scene.joined.items():
        if isinstance(each, FormulaObject):
            chain, own = scene.joined_chains[name], limit or each.formula.iterations
            more, within = reference.escape(chain, own_places(each, at).reshape(-1, 3), own)
            more = np.where(within, most, np.minimum(more, most)).reshape(at.shape[:-1])
        else:
            more = np.where(held_by(each, at), most, 0)
        found = np.where(more < most, found, 0) if each.join == "cut" else np.maximum(found, more)
    return np.where(held_beside(scene, at), most, found)


def held_beside(scene: Scene, at: Any) -> Any:
    """Which points are in what a plane names."""
    named = [scene.objects[name] for plane in scene.cut_planes for name in plane.cut_objects]
    return np.any([np.zeros(at.shape[:-1], bool), *(held_by(each, at) for each in named)], axis=0)


@pytest.mark.parametrize("limit", [None, 12])
@pytest.mark.parametrize("renderer", one_of("volume", "surface"))
def test_counts_on_the_plane(renderer: str, limit: int | None) -> None:
    settings = {
        "type": renderer,
        **({"resolution": 128, "box": {"size": 4.0}} if renderer == "volume" else {}),
    }
    scene = joined_scene(settings, iterations=limit)
    film = clfractal.render(scene, channels=["iterations", "A", "P.Y"])
    expected = counts_of(scene, points_of_pixels(), limit)
    np.testing.assert_allclose(film["P.Y"], 0.1, atol=1e-5)
    # Of a grid a rim of voxels stands out of the set.
    assert (film["iterations"] != expected).mean() < (3e-3 if renderer == "surface" else 1.5e-2)
    assert len(np.unique(expected)) >= 6


def test_its_face_is_all_of_the_set() -> None:
    """With a rectangle that is not seen, the faces alone are: what belongs to the set, but not to the hole, and
    what the plane names beside it, which is whole there."""
    inside = [0.25, 0.5, 0.75]
    scene = joined_scene({"type": "surface"}, opacity=0, colors={"inside": inside, "mode": "stepped"})
    film = clfractal.render(scene, channels=["R", "G", "B", "P.Y"])
    face = np.abs(film["P.Y"] - 0.1) < 1e-4
    expected = belongs(scene, points_of_pixels()) | held_beside(scene, points_of_pixels())
    assert 0.08 < expected.mean() < 0.6
    assert (face != expected).mean() < 4e-3
    np.testing.assert_allclose(
        np.stack([film[c] for c in "RGB"], -1)[face & expected].mean(0), inside, atol=1e-3
    )


def test_what_is_not_named_stands_whole() -> None:
    named = joined_scene({"type": "surface"}, objects=["box"])
    assert list(named.joined) == ["hole", "julia"]
    film = clfractal.render(named, channels=["P.X", "P.Y", "P.Z", "A"])
    x, z = np.moveaxis(points_of_pixels()[..., [0, 2]], -1, 0)
    at = np.stack([x, np.full_like(x, -0.2), z], axis=-1)
    egg = held_by(named.objects["egg"], at)
    assert egg.sum() > 100
    assert (film["P.Y"][egg] < 0.09).all(), "the egg is in front of the plane"


@pytest.mark.combination
def test_a_named_object_keeps_its_colour_behind_the_plane() -> None:
    """Beside the face it is seen as it was, where the plane's rectangle does not stand."""
    scene = {
        "version": 1,
        "formula": {"name": "mandelbulb", "iterations": 4},
        "camera": {"projection": "orthographic", "position": [0, -3, 4], "target": [0, 0, 0], "height": 4},
        "image": {"width": 128, "height": 128},
        "lights": [{"direction": [0, 1, -1], "shadow": False}],
        "materials": {"red": {"base": {"color": [0.8, 0.1, 0.05]}, "specular": {"weight": 0}}},
        "objects": {"ball": {"type": "sphere", "position": [1.5, 0, 0], "radius": 0.4, "material": "red"}},
        "cut_planes": [{"plane": {"normal": [0, -1, 0]}, "cut": True, "objects": ["ball"], "opacity": 0}],
    }
    film = clfractal.render(scene, channels=["R", "G", "P.X", "P.Y", "P.Z", "A"])
    away = np.linalg.norm(np.stack([film[f"P.{axis}"] for axis in "XYZ"], -1) - [1.5, 0, 0], axis=-1)
    own = (film["A"] == 1) & (np.abs(away - 0.4) < 0.02) & (film["P.Y"] > 0.02)
    assert own.sum() > 60
    np.testing.assert_allclose(film["R"][own] / film["G"][own], 8, rtol=1e-3)
    assert not ((film["P.Y"] < -0.01) & (film["P.X"] > 1.1) & (film["A"] == 1)).any(), "half of it is gone"


@pytest.mark.parametrize("precision", one_of("float32", "float64"))
def test_a_picture_of_the_plane_alone(precision: str) -> None:
    place = {"center": [0, 0.1, 0], "normal": [0, -1, 0], "width": 4, "height": 4}
    renderer = {"type": "cut_plane", "plane": place, "colors": {"mode": "stepped"}, "iterations": 9}
    scene = joined_scene({"type": "surface"}).resolved() | {"renderer": renderer, "cut_planes": []}
    film = clfractal.render(scene, channels=["iterations"], precision=precision)
    expected = counts_of(load_scene(scene), points_of_pixels(), 9)
    assert (film["iterations"] != expected).mean() < 3e-3
    alone = clfractal.render(scene | {"objects": {}}, channels=["iterations"], precision=precision)
    assert (film["iterations"] != alone["iterations"]).mean() > 0.05
