"""Light on known surfaces: Eq. 5 in NumPy, lights with a shape in closed form, shadows where geometry puts them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.device.select import Device
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.elements.lights.point import PointLight
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from tests.render.known_lights import BRIGHT, CASES, SPOT, ground
from tests.render.shots import (
    BALL,
    ORTHOGRAPHIC,
    PERSPECTIVE,
    QUICK_BALL,
    SOLIDS,
    SPHERE_CENTER,
    SPHERE_RADIUS,
    Floats,
    colors,
    points_of,
    rays,
    shoot,
    stacked,
    to_sphere,
)
from tests.scenes import scene_of

MATERIAL: dict[str, Any] = {
    "color": [0.9, 0.5, 0.2],
    "ambient": 0.15,
    "diffuse": 0.7,
    "specular": 0.6,
    "shininess": 12,
}
LIGHTS: dict[str, list[dict[str, Any]]] = {
    "directional": [{"direction": [-1, 2, -1.5], "color": [1, 0.8, 0.6], "intensity": 1.7}],
    "point": [{"type": "point", "position": [1.5, -2, 2], "color": [0.2, 0.4, 1], "intensity": 1.2}],
    "inverse square": [
        {"type": "point", "position": [0.5, -1.8, 1.1], "intensity": 2.5, "falloff": "inverse_square"}
    ],
    "several": [
        {"direction": [-1, 2, -1.5], "color": [1, 0.8, 0.6], "intensity": 0.4},
        {"direction": [1, 0.1, 0], "color": [0.1, 0, 0.9]},
        {
            "type": "point",
            "position": [1.5, -2, 2],
            "color": [0.2, 0.4, 1],
            "intensity": 1.2,
            "shadow": False,
        },
        {"type": "point", "position": [-3, -2, 2], "intensity": 9, "falloff": "inverse_square"},
    ],
    "none": [],
}


def beside_eq5(scene: Scene, device: Device) -> tuple[Floats, Floats, Floats]:
    """Colours of the pixels that hit the ball, Eq. 5, and its highlights alone."""
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    points, directions = points_of(framebuffer)[hit], rays(scene)[1][hit]
    normals = points / np.linalg.norm(points, axis=-1, keepdims=True)
    dull = scene.model_copy(update={"material": scene.material.model_copy(update={"specular": 0.0})})
    full, body = (eq5(each, points, normals, directions) for each in (scene, dull))
    assert hit.sum() > 1000
    return colors(framebuffer)[hit], full, full - body


@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "scalar rule"])
@pytest.mark.parametrize("lights", LIGHTS)
def test_equation_5(device: Device, formula: dict[str, Any], lights: str) -> None:
    """A ball shadows no point that faces the light, so every hit pixel has Eq. 5 with s = 1: no acne at any angle."""
    scene = scene_of(formula, PERSPECTIVE, lights=LIGHTS[lights], material=MATERIAL, renderer={"detail": 0.1})
    found, expected, _ = beside_eq5(scene, device)
    np.testing.assert_allclose(found, expected, atol=1e-3)


@pytest.mark.parametrize("shininess", [0.5, 2.75, 12.5, 3000.0])
def test_any_shininess(device: Device, shininess: float) -> None:
    """Exponents that are no whole numbers, or too large for squaring."""
    lights = [{"direction": [-1.5, 2.4, -1.3]}]  # from beside the camera: its highlight is in the picture
    shiny: dict[str, Any] = {"lights": lights, "material": {**MATERIAL, "shininess": shininess}}
    scene = scene_of(QUICK_BALL, {**PERSPECTIVE, "fov": 20}, renderer={"detail": 0.05}, **shiny)
    found, expected, highlight = beside_eq5(scene, device)
    np.testing.assert_allclose(found, expected, atol=3e-4 + 3e-6 * shininess)
    # The highlight is a good part of what is compared.
    assert highlight.max() > 0.3


@pytest.mark.parametrize("formula", [BALL, QUICK_BALL], ids=["jacobian", "scalar rule"])
@pytest.mark.parametrize("detail", [0.25, 1.0, 4.0])
def test_no_acne(device: Device, formula: dict[str, Any], detail: float) -> None:
    """Lit from everywhere, grazing light included: what faces a light is as bright as without shadows."""
    for direction in ([0, 1, 0], [-1, 0.02, 0], [0.03, 0, -1], [1, 1, 1], [0.3, -0.9, 0.1]):
        for camera in (PERSPECTIVE, ORTHOGRAPHIC):
            pictures = [
                colors(
                    shoot(
                        scene_of(
                            formula,
                            camera,
                            (64, 64),
                            lights=[{"direction": direction, "shadow": shadow}],
                            renderer={"detail": detail},
                        ),
                        device,
                        channels=("R", "G", "B"),
                    )
                )
                for shadow in (True, False)
            ]
            assert np.array_equal(pictures[0], pictures[1])


WAY = [-0.5, 0.3, -1.0]


@pytest.mark.parametrize(
    ("light", "casts"),
    [
        ({"direction": WAY}, True),
        ({"type": "point", "position": [0.5, -0.3, 1.8]}, True),
        ({"type": "point", "position": [0.2, -0.1, 0.4]}, False),
    ],
    ids=["parallel", "above", "between"],
)
def test_shadow_of_a_sphere(device: Device, light: dict[str, Any], casts: bool) -> None:
    """On the box's top a point is dark exactly if its line to the light meets the sphere; footprints decide at the rim. A
    light that stands between sphere and box casts no shadow of the sphere."""
    scene = scene_of(SOLIDS, PERSPECTIVE, (240, 180), lights=[light], material=MATERIAL)
    framebuffer = shoot(scene, device)
    points, top = box_top(framebuffer)
    toward = (
        light["position"] - points if "position" in light else np.broadcast_to(-np.array(WAY), points.shape)
    )
    toward = toward / np.linalg.norm(toward, axis=-1, keepdims=True)
    _, passing = to_sphere(points, toward, SPHERE_CENTER, SPHERE_RADIUS)
    check_shadow(
        framebuffer, scene, points, top, passing if casts else np.full_like(passing, 9.0), some=casts
    )


def test_lights_without_shadow_shine_through(device: Device) -> None:
    light = {"direction": [-0.5, 0.3, -1.0], "shadow": False}
    scene = scene_of(SOLIDS, PERSPECTIVE, (240, 180), lights=[light], material=MATERIAL)
    framebuffer = shoot(scene, device)
    points, top = box_top(framebuffer)
    normals = np.broadcast_to(np.array([0.0, 0, 1]), points.shape)
    np.testing.assert_allclose(
        colors(framebuffer)[top], eq5(scene, points, normals, rays(scene)[1])[top], atol=1e-4
    )


def test_light_from_behind_a_surface(device: Device) -> None:
    """The ambient part alone: where the normal turns away from the light, and beneath the box."""
    scene = scene_of(SOLIDS, PERSPECTIVE, (240, 180), lights=[{"direction": [0, 0, 1]}], material=MATERIAL)
    framebuffer = shoot(scene, device)
    _, top = box_top(framebuffer)
    ambient = np.array(MATERIAL["color"]) * MATERIAL["ambient"]
    np.testing.assert_allclose(colors(framebuffer)[top], np.broadcast_to(ambient, (top.sum(), 3)), atol=1e-6)


def test_coloring_by_normal(device: Device) -> None:
    """The thesis stores (n + 1)/2 as red, green and blue (sec. 3.2.1)."""
    flat = {**MATERIAL, "ambient": 1, "diffuse": 0, "specular": 0}
    scene = scene_of({"name": "hast", "iterations": 8}, PERSPECTIVE, coloring={"by": "normal"}, material=flat)
    framebuffer = shoot(scene, device)
    hit = framebuffer["A"] == 1
    normals = stacked(framebuffer, ("N.X", "N.Y", "N.Z"))
    np.testing.assert_allclose(colors(framebuffer)[hit], (normals[hit] + 1) / 2, atol=1e-6)


def check_shadow(
    framebuffer: Framebuffer,
    scene: Scene,
    points: Floats,
    top: npt.NDArray[np.bool_],
    passing: Floats,
    *,
    some: bool = True,
) -> None:
    """Dark points have the ambient part of Eq. 5 alone. Shadow rays start three footprints above the surface and count
    as blocked within one footprint of it: nearer than six to the rim either is right."""
    footprint = (rays(scene)[2] * np.where(top, framebuffer["Z"], 1)) * 1.1
    dark = top & (passing < SPHERE_RADIUS - 6 * footprint)
    lit = top & (passing > SPHERE_RADIUS + 6 * footprint)
    normals = np.broadcast_to(np.array([0.0, 0, 1]), points.shape)
    full = eq5(scene, points, normals, rays(scene)[1])
    ambient = eq5(scene, points, normals, rays(scene)[1], lit=False)
    assert lit.sum() > 1000
    np.testing.assert_allclose(colors(framebuffer)[lit], full[lit], atol=2e-4)
    np.testing.assert_allclose(colors(framebuffer)[dark], ambient[dark], atol=1e-5)
    if some:
        assert dark.sum() > 150


def box_top(framebuffer: Framebuffer) -> tuple[Floats, npt.NDArray[np.bool_]]:
    """Positions, moved down onto the plane z = 0, and which pixels show the box's top, away from its edges and
    from the sphere."""
    points = points_of(framebuffer)
    top = (framebuffer["A"] > 0) & (np.abs(points[..., 2]) < 0.1) & (np.abs(points[..., :2]).max(-1) < 1.1)
    top &= framebuffer["N.Z"] > 0.9999
    return points, top


def eq5(scene: Scene, points: Floats, normals: Floats, directions: Floats, *, lit: bool = True) -> Floats:
    """Englund 2010, Eq. 5, for arrays of shape (..., 3)."""
    material = scene.material
    body = np.array(material.color)
    total = np.zeros(points.shape)
    for light in scene.lights:
        strength = np.full(points.shape[:-1], light.intensity)
        if not isinstance(light, DirectionalLight):
            assert isinstance(light, PointLight)
            offset = np.array(light.position) - points
            distance = np.linalg.norm(offset, axis=-1)
            toward = offset / distance[..., None]
            if light.falloff == "inverse_square":
                strength = strength / distance**2
        else:
            toward = np.broadcast_to(
                -np.array(light.direction) / np.linalg.norm(light.direction), points.shape
            )
        facing = (normals * toward).sum(-1)
        mirrored = 2 * facing[..., None] * normals - toward
        highlight = np.maximum((mirrored * -directions).sum(-1), 0) ** material.shininess
        shines = lit & (facing > 0)
        diffuse = np.where(shines, material.diffuse * facing, 0.0)
        specular = np.where(shines, material.specular * highlight, 0.0)
        added = (material.ambient + diffuse)[..., None] * body + specular[..., None]
        total += np.array(light.color) * strength[..., None] * added
    return total


@pytest.mark.parametrize(("light", "expected"), CASES, ids=["sphere", "rectangle", "spot"])
@pytest.mark.parametrize("mode", ["direct", "path"])
def test_ground_has_the_irradiance_of_closed_forms(
    device: Device, light: dict[str, Any], expected: Any, mode: str
) -> None:
    path = {"mode": "path", "bounces": 0}
    scene = scene_of(
        SOLIDS,
        {**ORTHOGRAPHIC, "position": [0.4, -2, 1.6]},
        lights=[{**light, "shadow": False, **({} if light is SPOT else {"visible": False})}],
        material={**BRIGHT, "diffuse": 1},
        lighting=path if mode == "path" else {"mode": "direct"},
        renderer={"samples": 16 if mode == "direct" else 64, "detail": 0.25},
        background=[0, 0, 0],
    )
    framebuffer = shoot(scene, device)
    on_ground = ground(framebuffer)
    found, right = colors(framebuffer)[on_ground][:, 0], expected(points_of(framebuffer)[on_ground])
    assert on_ground.sum() > 500
    assert right.mean() > 0.05
    ratio = found.mean() / right.mean()
    assert ratio == pytest.approx(1, abs=0.02)
    if mode == "direct":
        assert np.median(np.abs(found - right)) < 0.03 * right.mean() + 0.002
