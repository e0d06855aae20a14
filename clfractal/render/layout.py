"""The structs that the kernels read, declared once, and how a scene fills them."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np

from clfractal.device.structs import Field, Precision, Struct
from clfractal.formulas.language import Chain
from clfractal.render.tiles import Region
from clfractal.render.view import View
from clfractal.scene.checks import used_bounds
from clfractal.scene.lighting import PointLight
from clfractal.scene.model import Scene
from clfractal.scene.parts import Gradient

VIEW = Struct(
    "View",
    [
        Field("center", "real", 3, "middle of the view plane, scene units"),
        Field("right", "real", 3, "one pixel to the right on the plane, scene units"),
        Field("down", "real", 3, "one pixel down on the plane, scene units"),
        Field("eye", "real", 3, "the eye; of an orthographic view a point of its plane, scene units"),
        Field("axis", "real", 3, "view direction, length 1"),
        Field("center_x", "real", 0, "the plane's middle in the picture, pixels from the left"),
        Field("center_y", "real", 0, "the same, pixels from the top"),
        Field("pixel_size", "real", 0, "height of a pixel on the plane, scene units"),
        Field("perspective", "int", 0, "1: rays leave the eye; 0: rays are parallel to the axis"),
        Field("height", "int", 0, "height of the picture, pixels"),
        Field("region_left", "int", 0, "first column to render"),
        Field("region_top", "int", 0, "first row to render"),
        Field("region_right", "int", 0, "first column right of the region"),
        Field("region_bottom", "int", 0, "first row below the region"),
    ],
)

ORBIT = Struct(
    "Orbit",
    [
        Field("iterations", "int", 0, "most applications of the formula"),
        Field("longest", "int", 0, "applications allowed to get from the bailout to the distance bailout"),
        Field("bailout_square", "real", 0, "|z|^2 beyond which a point has escaped"),
        Field("distance_square", "real", 0, "|z|^2 beyond which distances are exact enough"),
        Field("log_bailout", "real", 0, "natural logarithm of the bailout"),
        Field("log_distance_bailout", "real", 0, "natural logarithm of the distance bailout"),
        Field("log2_degree", "real", 0, "binary logarithm of the degree of one application"),
        Field("solid_radius", "real", 0, "radius in z that holds the last solid, for degree 1"),
    ],
)

MARCH = Struct(
    "March",
    [
        Field("bounds_center", "real", 3, "centre of the sphere that holds the set, scene units"),
        Field("bounds_radius", "real", 0, "its radius, scene units"),
        Field("step_scale", "real", 0, "part of a distance that is safe to step"),
        Field("relaxation", "real", 0, "factor on steps, taken back where spheres do not touch"),
        Field("detail", "real", 0, "distance that counts as a hit, in pixel footprints"),
        Field("shadow_lift", "real", 0, "where shadow rays start, in footprints above the surface"),
        Field("shadow_detail", "real", 0, "hit distance of shadow rays, in footprints over detail"),
        Field("max_steps", "int", 0, "most distance evaluations along a ray"),
        Field("samples", "int", 0, "rays per pixel"),
        Field("seed", "uint", 0, "chooses the places of the samples"),
        Field("light_count", "int", 0, "number of lights"),
    ],
)

LIGHT = Struct(
    "Light",
    [
        Field(
            "vector",
            "real",
            3,
            "directional: where the light travels to, length 1; point: its place, scene units",
        ),
        Field("color", "real", 3, "linear Rec. 709"),
        Field("intensity", "real", 0, "factor on the colour"),
        Field("kind", "int", 0, "LIGHT_DIRECTIONAL or LIGHT_POINT"),
        Field("inverse_square", "int", 0, "1: weakens with the square of the distance"),
        Field("shadow", "int", 0, "1: blocked by the set"),
    ],
)

MATERIAL = Struct(
    "Material",
    [
        Field("color", "real", 3, "linear Rec. 709"),
        Field("ambient", "real", 0, "Eq. 5's coefficients"),
        Field("diffuse", "real", 0, ""),
        Field("specular", "real", 0, ""),
        Field("shininess", "real", 0, "exponent of the highlight"),
        Field("background_top", "real", 3, "linear Rec. 709"),
        Field("background_bottom", "real", 3, ""),
        Field("palette_scale", "real", 0, "palettes per unit of the quantity that chooses the colour"),
        Field("palette_offset", "real", 0, "start in the palette"),
        Field("palette_repeat", "int", 0, "1: the palette begins again after its end; 0: its ends go on"),
        Field("coloring_step", "real", 0, "step along the way of thickness or layer distance, scene units"),
        Field("coloring_limit", "real", 0, "longest way, scene units"),
        Field("coloring_tests", "int", 0, "most inside tests for one end of a way"),
        Field("layer", "int", 0, "iterations of the other layer"),
        Field("trap_center", "real", 3, "a point of the trap, in z"),
        Field("trap_direction", "real", 3, "its axis' or normal's direction, length 1"),
        Field("trap_radius", "real", 0, "a sphere's radius, in z"),
        Field("transparent", "int", 0, "1: no background is composited under"),
    ],
)

STRUCTS = (VIEW, ORBIT, MARCH, LIGHT, MATERIAL)

LIGHT_DIRECTIONAL, LIGHT_POINT = 0, 1
# Applications past the iteration limit that get a lane from the bailout to the distance bailout. Degree 2 needs four
# from 4 to 1000, degree 1.1 in a chain some twenty.
EXTRA_APPLICATIONS = 24
# In footprints, tuned on spheres (no acne at any angle) and fractals (no light leaking into pores).
SHADOW_LIFT, SHADOW_DETAIL = 3.0, 0.5
# Inside tests of a way through the set besides its full steps: the growing ones at its start, and the bisection.
EXTRA_TESTS = 64

Record = np.ndarray[Any, np.dtype[np.void]]


def struct_text() -> str:
    """The declarations in C, for inclusion after `lanes.h`."""
    return "".join(struct.c_text() for struct in STRUCTS)


def view_record(view: View, width: int, height: int, region: Region, precision: Precision) -> Record:
    """A View for a picture of `width` x `height` pixels of which `region` is rendered."""
    values = {
        "center": view.center,
        "right": view.side * (view.width / width),
        "down": view.up * (-view.height / height),
        "eye": view.origin,
        "axis": view.axis,
        "center_x": width / 2,
        "center_y": height / 2,
        "pixel_size": view.pixel_size(height),
        "perspective": int(view.eye is not None),
        "height": height,
        "region_left": region.x,
        "region_top": region.y,
        "region_right": region.right,
        "region_bottom": region.bottom,
    }
    return VIEW.value(precision, values)


def orbit_record(chain: Chain, iterations: int, precision: Precision, bailout: float | None = None) -> Record:
    """The limits of an orbit; `bailout` replaces the formula's own."""
    inner = bailout if bailout is not None else chain.bailout
    outer = max(inner, chain.distance_bailout)
    # Linear maps measure the solid of exactly `iterations` applications; one more would be a smaller solid.
    linear = chain.degree <= 1
    values = {
        "iterations": iterations,
        "longest": iterations if linear or outer == inner else iterations + EXTRA_APPLICATIONS,
        "bailout_square": inner**2,
        "distance_square": outer**2,
        "log_bailout": math.log(inner),
        "log_distance_bailout": math.log(outer),
        "log2_degree": math.log2(chain.degree) / chain.cycle_length if chain.degree > 1 else 0.0,
        "solid_radius": chain.solid_radius,
    }
    return ORBIT.value(precision, values)


def march_record(scene: Scene, samples: int, precision: Precision) -> Record:
    """The settings of the march."""
    chain, renderer = scene.chain, scene.renderer
    bounds = renderer.bounds
    values = {
        "bounds_center": bounds.center if bounds else chain.center,
        "bounds_radius": bounds.radius if bounds else chain.radius,
        "step_scale": renderer.step_scale if renderer.step_scale is not None else chain.step_scale,
        "relaxation": renderer.over_relaxation,
        "detail": renderer.detail,
        "shadow_lift": SHADOW_LIFT * renderer.detail,
        "shadow_detail": SHADOW_DETAIL,
        "max_steps": renderer.max_steps,
        "samples": samples,
        "seed": renderer.seed,
        "light_count": len(scene.lights),
    }
    return MARCH.value(precision, values)


def light_records(scene: Scene, precision: Precision) -> Record:
    """The lights; one unused record where there are none, since no buffer is empty."""
    rows: list[Mapping[str, object]] = []
    for light in scene.lights:
        point = isinstance(light, PointLight)
        vector = np.array(light.position if isinstance(light, PointLight) else light.direction, float)
        rows.append(
            {
                "vector": vector if point else vector / np.linalg.norm(vector),
                "color": light.color,
                "intensity": light.intensity,
                "kind": LIGHT_POINT if point else LIGHT_DIRECTIONAL,
                "inverse_square": int(isinstance(light, PointLight) and light.falloff == "inverse_square"),
                "shadow": int(light.shadow),
            }
        )
    return LIGHT.array(precision, rows) if rows else np.zeros(1, LIGHT.dtype(precision))


def material_record(scene: Scene, precision: Precision) -> Record:
    """Material, colouring and background."""
    material, background = scene.material, scene.background
    gradient = background if isinstance(background, Gradient) else None
    values = {
        "color": material.color,
        "ambient": material.ambient,
        "diffuse": material.diffuse,
        "specular": material.specular,
        "shininess": material.shininess,
        "background_top": gradient.top if gradient else (0.0, 0.0, 0.0),
        "background_bottom": gradient.bottom if gradient else (0.0, 0.0, 0.0),
        "palette_scale": scene.coloring.scale,
        "palette_offset": scene.coloring.offset,
        **_way_and_trap(scene),
        "transparent": int(gradient is None),
    }
    return MATERIAL.value(precision, values)


def _way_and_trap(scene: Scene) -> dict[str, object]:
    """The fields of a Material for `kernels/coloring.h`."""
    coloring, radius = scene.coloring, used_bounds(scene)[1]
    step = coloring.step if coloring.step is not None else radius / 100
    direction = np.array(coloring.trap.direction, float)
    return {
        "palette_repeat": int(coloring.repeat),
        "coloring_step": step,
        "coloring_limit": 2 * radius,
        "coloring_tests": math.ceil(2 * radius / step) + EXTRA_TESTS,
        "layer": coloring.layer,
        "trap_center": coloring.trap.center,
        "trap_direction": direction / np.linalg.norm(direction),
        "trap_radius": coloring.trap.radius,
    }
