"""Cut planes in the picture of an object: quads by depth, and planes that cut it open, for surfaces and volumes.

The object is the ball of radius BALL_RADIUS, the planes' colours are those of the escape counts of z^2, whose bailout
spheres of radius 4^(2^-n) make rings.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.formulas import reference
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.plan import choose_precision
from clfractal.scene.model import Scene
from tests.devices import check_usable
from tests.render.planes import mandelbrot, sure
from tests.render.quads import BACKGROUND, COLORS, LOOK, TINT, alpha_of, escape_tint, met, plane
from tests.render.shots import (
    BALL,
    BALL_RADIUS,
    CAMERAS,
    PERSPECTIVE,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    normals_of,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
    view_of,
)
from tests.render.volumes import keep, middles
from tests.scenes import BALL_ITERATIONS, scene_of

POSITION = [1.5, -2.5, 1.2]
RENDERERS: dict[str, dict[str, Any]] = {
    "surface": {"type": "surface", "detail": 0.05},
    "volume": {
        "type": "volume",
        "box": {"center": [0, 0, 0.1], "size": 2.7},
        "resolution": 64,
        "value": "coverage",
        "shadows": True,
    },
}
# How far from the ball a renderer may find its surface.
OFF = {"surface": 0.004, "volume": 0.04}
# Planes of a test are filled up to as many, by some that are not seen: each number of planes is a program.
PLANES = 4


def picture(
    renderer: str,
    camera: dict[str, Any],
    planes: list[dict[str, Any]],
    *,
    folder: Path | None = None,
    settings: dict[str, Any] | None = None,
    formula: dict[str, Any] = BALL,
    iterations: int = BALL_ITERATIONS,
    **sections: Any,
) -> Scene:
    more = PLANES - sum(each.get("count", 1) for each in planes)
    filled = planes + [plane([0, 0, 9], [0, 0, 1], 0.0)] * more
    usual = {"renderer": settings or RENDERERS[renderer], **LOOK, "cut_planes": filled, **sections}
    return scene_of(formula, camera, (56, 56), iterations=iterations, folder=folder, **usual)


def layered(scene: Scene, renderer: str) -> tuple[Floats, Floats, npt.NDArray[np.bool_]]:
    """Colour and coverage of each pixel: quads over the ball and the background, by depth; and where both are certain."""
    origin, direction, _ = rays(scene)
    ball, nearest = to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)
    sure = np.abs(nearest - BALL_RADIUS) > OFF[renderer]
    slack = OFF[renderer] / np.sqrt(np.maximum(1 - (nearest / BALL_RADIUS) ** 2, 1e-3))
    layers: list[tuple[Any, Any, Floats]] = [
        (np.where(np.isfinite(ball), ball, 1e9), np.isfinite(ball) * 1.0, TINT + 0 * direction)
    ]
    for index, each in enumerate(scene.cut_planes):
        for number in range(each.count):
            seen, t, room = met(scene, index, number)
            limit = each.iterations or BALL_ITERATIONS
            tint, rim = escape_tint(scene, origin + t[..., None] * direction, limit)
            sure &= (~seen | (rim > 1e-4)) & (room > 1e-4) & (~seen | (np.abs(t - ball) > slack))
            layers.append((np.where(seen, t, 1e9), seen * alpha_of(each, tint), tint))
    depth = np.stack([layer[0] for layer in layers])
    order = np.argsort(depth, axis=0, kind="stable")
    through, color = np.ones(nearest.shape), np.zeros((*nearest.shape, 3))
    for rank in order:
        alpha = np.take_along_axis(np.stack([layer[1] for layer in layers]), rank[None], 0)[0]
        tint = np.take_along_axis(np.stack([layer[2] for layer in layers]), rank[None, ..., None], 0)[0]
        color += (through * alpha)[..., None] * tint
        through = through * (1 - alpha)
    return color + through[..., None] * BACKGROUND, 1 - through, sure


def check_layers(
    framebuffer: Framebuffer, scene: Scene, renderer: str, least: float
) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Gives the coverage, and where it is certain."""
    color, coverage, sure = layered(scene, renderer)
    assert sure.mean() > least
    np.testing.assert_allclose(framebuffer["A"][sure], coverage[sure], atol=1e-5)
    np.testing.assert_allclose(stacked(framebuffer, "RGB")[sure], color[sure], atol=2e-4)
    return coverage, sure


@pytest.mark.parametrize("renderer", RENDERERS)
@pytest.mark.parametrize("camera", CAMERAS)
@pytest.mark.parametrize("distance", [-1.3, -0.4, 1.3])
def test_one_quad(device: Device, renderer: str, camera: str, distance: float) -> None:
    """In front of the ball, through it, behind it: its extents, its colours, and what shows through."""
    position = np.array(CAMERAS[camera]["position"], float)
    toward = position / np.linalg.norm(position)
    place = [float(x) for x in -distance * toward + [0.1, 0, 0.05]]
    scene = picture(renderer, CAMERAS[camera], [plane(place, [0.2, -1, 0.5], 0.7)])
    framebuffer = shoot(scene, device)
    _, sure = check_layers(framebuffer, scene, renderer, 0.85)
    if distance > 0:
        return
    # The data channels tell of a quad that stops half of the light or more.
    seen, t, _ = met(scene, 0)
    origin, direction, _ = rays(scene)
    front = seen & sure & (t < to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)[0])
    assert front.sum() > 20
    points = origin + t[..., None] * direction
    np.testing.assert_allclose(points_of(framebuffer)[front], points[front], atol=1e-5)
    np.testing.assert_allclose(
        framebuffer["Z"][front], (points - scene.camera.position)[front] @ view_of(scene).axis, atol=1e-5
    )
    np.testing.assert_allclose(
        normals_of(framebuffer)[front], scene.cut_planes[0].plane.placed.normal + 0 * points[front], atol=1e-6
    )
    count = reference.escape(scene.chain, points[front], BALL_ITERATIONS)[0]
    np.testing.assert_array_equal(framebuffer["iterations"][front], count)


@pytest.mark.parametrize("renderer", RENDERERS)
@pytest.mark.parametrize("opacity", [0.499, 0.5])
def test_a_quad_that_stops_exactly_half(device: Device, renderer: str, opacity: float) -> None:
    """Half of the light is enough for the data channels; less is not."""
    scene = picture(renderer, PERSPECTIVE, [plane([0.0, -1.3, 0.3], [0.2, -1, 0.5], opacity)])
    framebuffer = shoot(scene, device)
    seen, t, room = met(scene, 0)
    origin, direction, _ = rays(scene)
    # Past the ball there is nothing else that the channels could tell of.
    alone = seen & (room > 1e-4) & (to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)[1] > 1.1)
    assert alone.sum() > 20
    points = (origin + t[..., None] * direction)[alone]
    if opacity < 0.5:
        assert np.isposinf(framebuffer["Z"][alone]).all()
        assert not points_of(framebuffer)[alone].any()
    else:
        np.testing.assert_allclose(points_of(framebuffer)[alone], points, atol=1e-5)
        assert np.isfinite(framebuffer["Z"][alone]).all()


STACKED = [
    plane([0.0, -1.2, 0.1], [0.1, -1, 0.1], 0.5, count=2, spacing=0.3, iterations=3),
    plane([0.1, 0, 0], [1, 1, 0.3], 0.3, width=3.0),
    plane([0, 1.3, 0], [0, -1, 0.2], 1.0),
]
PLACE = ([0.0, -1.3, 0.1], [0.1, -1, 0.1])
AT_ONE_DISTANCE = [
    plane(*PLACE, 0.5, iterations=3),
    plane(*PLACE, 0.4, iterations=5, width=1.2),
    plane(*PLACE, 0.7, iterations=8),
    plane([0, 1.3, 0], [0, -1, 0.2], 1.0),
]


@pytest.mark.parametrize("renderer", RENDERERS)
@pytest.mark.parametrize(
    ("planes", "side"),
    [(STACKED, 1), (STACKED, -1), (AT_ONE_DISTANCE, 1)],
    ids=["stacked", "from behind", "at one distance"],
)
def test_several_quads_by_depth(
    device: Device, renderer: str, planes: list[dict[str, Any]], side: int
) -> None:
    """Stacked and crossing planes, seen from both sides: each pixel has its own order; at one distance all are seen,
    the list's first in front."""
    scene = picture(renderer, {**PERSPECTIVE, "position": [side * x for x in POSITION]}, planes)
    coverage, sure = check_layers(shoot(scene, device), scene, renderer, 0.7)
    assert len(np.unique(np.round(coverage[sure], 4))) >= 4


@pytest.mark.parametrize("renderer", RENDERERS)
@pytest.mark.parametrize("opacities", [(0.3, 0.9), (0.0, 1.0), (0.6, 0.0)])
def test_the_set_on_a_plane_has_its_own_opacity(
    device: Device, renderer: str, opacities: tuple[float, float]
) -> None:
    """A disc of the ball's planes on the glass: opaque in clear glass, alone, or a hole."""
    outside, inside = opacities
    planes = [plane([0.0, -1.0, 0.05], [0.1, -1, 0.1], outside, inside_opacity=inside, iterations=2)]
    scene = picture(renderer, PERSPECTIVE, planes, iterations=BALL_ITERATIONS)
    framebuffer = shoot(scene, device)
    _, sure = check_layers(framebuffer, scene, renderer, 0.8)
    # A quad that stops half of the light or more is what the data channels tell of, where it does.
    seen, t, _ = met(scene, 0)
    origin, direction, _ = rays(scene)
    tint, _ = escape_tint(scene, origin + t[..., None] * direction, 2)
    front = seen & (t < to_sphere(origin, direction, (0, 0, 0), BALL_RADIUS)[0])
    disc = front & sure & (tint == np.array(COLORS["inside"])).all(-1)
    assert disc.sum() > 100
    on_plane = np.abs(framebuffer["iterations"] - 2) < 1e-6
    if outside < 0.5:
        assert on_plane[disc].all()
        assert not on_plane[~seen & sure & np.isfinite(framebuffer["Z"])].any()
    else:
        assert not on_plane[disc].any()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_planes_without_opacity_are_not_seen(device: Device, renderer: str) -> None:
    scene = picture(
        renderer, PERSPECTIVE, [plane([0, -1.3, 0], [0, -1, 0], 0.0), plane([0, 0, 0], [1, 0, 0], 0)]
    )
    bare = scene.model_copy(update={"cut_planes": ()})
    with_planes, without = shoot(scene, device), shoot(bare, device)
    np.testing.assert_allclose(stacked(with_planes, "RGBA"), stacked(without, "RGBA"), atol=1e-5)
    hit = np.isfinite(without["Z"])
    np.testing.assert_array_equal(np.isfinite(with_planes["Z"]), hit)
    np.testing.assert_allclose(with_planes["Z"][hit], without["Z"][hit], atol=1e-5)


def test_a_plane_in_a_deep_zoom(device: Device) -> None:
    """400 million times magnified, hast in the plane z = 0 is the Mandelbrot set, count by count, whether the plane cuts or
    not. None of its few voxels is inside: only the plane is seen."""
    check_usable("float64")
    x, y = -0.743643887037151, 0.131825904205330
    scenes = [
        scene_of(
            {"name": "hast", "iterations": 3000},
            {"projection": "orthographic", "position": [0, 0, 9], "up": [0, 1, 0], "height": 4},
            (40, 40),
            renderer={
                "type": "volume",
                "box": {"size": 4},
                "resolution": 4,
                "zoom": [{"center": [x, y, 0], "scale": 4e8}],
                "shadows": True,
            },
            cut_planes=[
                {"plane": {"width": 4, "height": 4}, "opacity": 1, "cut": cut, "colors": {"mode": "stepped"}}
            ],
        )
        for cut in (False, True)
    ]
    points = (rays(scenes[0])[0] / 4e8 + np.array([x, y, 0])).astype(np.longdouble)
    certain = sure(points[..., 0], points[..., 1], 3000, 4 * 2.0**-52)
    count, _ = mandelbrot(points[..., 0], points[..., 1], 3000)
    assert certain.mean() > 0.9
    assert len(np.unique(count[certain])) > 20
    for scene in scenes:
        precision, remark = choose_precision(scene, "auto", has_float64=True)
        assert (precision, remark) == ("float64", "")
        framebuffer = shoot(scene, device, precision)
        np.testing.assert_array_equal(framebuffer["iterations"][certain], count[certain])


CUT_CENTER, CUT_NORMAL = np.array([0.1, -0.35, 0.15]), np.array([0.3, -1.0, 0.4])


@pytest.mark.parametrize("renderer", RENDERERS)
@pytest.mark.parametrize("camera", CAMERAS)
def test_a_cut_ball(device: Device, renderer: str, camera: str) -> None:
    """The face is the disc in which the plane meets the ball, to the pixel, with the rings of the plane's own count;
    nothing is left in front of it."""
    ball = 4.0**0.125  # of three applications
    cut = plane(list(CUT_CENTER), list(CUT_NORMAL), 0.0, cut=True, iterations=8)
    scene = picture(renderer, CAMERAS[camera], [cut], iterations=3)
    framebuffer = shoot(scene, device)
    origin, direction, _ = rays(scene)
    normal = CUT_NORMAL / np.linalg.norm(CUT_NORMAL)
    t = ((CUT_CENTER - origin) @ normal) / (direction @ normal)
    there = origin + t[..., None] * direction
    radius = np.linalg.norm(there, axis=-1)
    face = (radius < ball) & (direction @ normal < 0)
    tint, rim = escape_tint(scene, there, 8)
    certain = rim > 1e-5
    assert face.sum() > 250
    count = reference.escape(scene.chain, there[face & certain], 8)[0]
    assert {5, 6, 7, 8} <= set(count.tolist())
    np.testing.assert_array_equal(framebuffer["iterations"][face & certain], count)
    picture_, points = stacked(framebuffer, "RGB"), points_of(framebuffer)
    np.testing.assert_allclose(picture_[face & certain], tint[face & certain], atol=2e-4)
    np.testing.assert_allclose(points[face & certain], there[face & certain], atol=1e-5)
    np.testing.assert_allclose(
        normals_of(framebuffer)[face & certain], normal + 0 * there[face & certain], atol=1e-6
    )
    np.testing.assert_array_equal(framebuffer["A"][face & certain], 1)
    # The rest of the ball, behind the plane; and no face anywhere else.
    others = certain & ~face & (framebuffer["A"] > 0)
    assert others.sum() > 15
    assert ((points[others] - CUT_CENTER) @ normal < 0.02).all()
    assert np.abs(np.linalg.norm(points[others], axis=-1) - ball).max() < 2 * OFF[renderer]
    np.testing.assert_allclose(picture_[others], TINT + 0 * there[others], atol=1e-5)
    # A ray that meets the plane off the disc is at its way's nearest to the middle only in what is gone.
    beyond = (
        (radius > ball + 2 * OFF[renderer]) & (direction @ normal < 0) & ((there * direction).sum(-1) > 0)
    )
    assert beyond.sum() > 5
    assert not framebuffer["A"][beyond].any()


@pytest.mark.parametrize("renderer", RENDERERS)
def test_what_is_cut_away_throws_no_shadow(device: Device, tmp_path: Path, renderer: str) -> None:
    """A sphere over a box, lit from above; without the sphere the box has no shadow. The volume is a file's, beside the
    formula's ball, which shows nothing then."""
    look: dict[str, Any] = {
        "material": {"ambient": 0.25, "diffuse": 0.5, "specular": 0, "color": [1, 1, 1]},
        "lights": [{"direction": [0, 0, -1], "shadow": True}],
    }
    middle = np.zeros(3)
    if renderer == "volume":
        middle[0] = 5
        side, voxels = 2.7, 64
        corner, spacing = middle + np.array([0, 0, 0.1]) - side / 2, [side / voxels] * 3
        keep(tmp_path / "solids.nrrd", solids(corner - middle, voxels, side / voxels), corner, spacing)
        look["settings"] = {"type": "volume", "file": "solids.nrrd", "shadows": True}
    else:
        look["formula"] = SOLIDS
    camera = {
        "projection": "orthographic",
        "position": list(middle + np.array([0, -3, 6])),
        "target": list(middle),
        "height": 2.6,
    }
    framebuffers = {}
    for cut in (False, True):
        planes = [plane(list(middle + np.array([0, 0, 0.3])), [0, 0, 1], 0.0, cut=cut, up=[0, 1, 0])]
        framebuffers[cut] = shoot(picture(renderer, camera, planes, folder=tmp_path, **look), device)
    places = {cut: points_of(framebuffer) - middle for cut, framebuffer in framebuffers.items()}
    top = {
        cut: (np.abs(framebuffer["P.Z"]) < 0.03) & (framebuffer["A"] == 1) & (framebuffer["N.Z"] > 0.999)
        for cut, framebuffer in framebuffers.items()
    }
    both = top[True] & top[False] & (np.abs(places[True][..., :2]).max(-1) < 1.1)
    assert both.sum() > 700
    away = np.linalg.norm(places[True][..., :2] - SPHERE_CENTER[:2], axis=-1)
    shadow = both & (away < SPHERE_RADIUS - 0.05)
    assert shadow.sum() > 20
    np.testing.assert_allclose(framebuffers[True]["R"][both], 0.75, atol=0.01)
    np.testing.assert_allclose(framebuffers[False]["R"][shadow], 0.25, atol=0.01)
    np.testing.assert_allclose(
        framebuffers[False]["R"][both & (away > SPHERE_RADIUS + 0.05)], 0.75, atol=0.01
    )
    # The sphere itself is gone.
    assert (framebuffers[False]["P.Z"] > 1).any()
    assert (framebuffers[True]["P.Z"] < 0.1).all()


def solids(corner: Floats, voxels: int, spacing: float) -> npt.NDArray[np.uint8]:
    """`SOLIDS` as a grid: shares of voxels, of 255."""
    places = middles((voxels, voxels, voxels), corner, [spacing] * 3)
    sphere = np.linalg.norm(places - SPHERE_CENTER, axis=-1) - SPHERE_RADIUS
    box = np.max(np.abs(places + np.array([0, 0, 0.25])) - [1.2, 1.2, 0.25], axis=-1)
    share = np.clip(0.5 - np.minimum(sphere, box) / spacing, 0, 1)
    return np.asarray(np.rint(255 * share), np.uint8)
