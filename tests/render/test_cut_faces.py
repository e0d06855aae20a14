"""Planes that cut what they name, and the faces of their cuts, against NumPy: in both lights, and in mirrors."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.formulas import reference
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.cut_oracle import BODIES, WHITE, Met, face_tint, first_met, scene_of
from tests.render.shots import CHANNELS as EVERY
from tests.render.shots import Floats, normals_of, points_of, rays, shoot, stacked

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
def test_each_plane_cuts_what_it_names(device: Device, mode: str) -> None:
    """The set has the first plane's face only, though the other passes it; the crate has the other's; the egg, in front of
    both, is whole. Places, normals, counts, colours and things, pixel by pixel."""
    scene = scene_of(**MODES[mode])
    framebuffer = framebuffer_of(scene, device)
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
