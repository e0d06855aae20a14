"""The structs that the kernels read, declared once, and how a scene fills them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from clfractal.camera.views import View
from clfractal.device.orbit import Record
from clfractal.device.orbit import orbit_record as orbit_record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.formulas.names import name_number
from clfractal.geometry.objects import mirrors
from clfractal.integrators.plan import Plan
from clfractal.scene.coloring import Coloring
from clfractal.scene.glow import Glow
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.mist import MAX_STOPS, Mist
from clfractal.scene.model import Scene
from clfractal.scene.parts import Gradient, Image
from clfractal.schema.base import unit
from clfractal.schema.mapped import Map
from clfractal.shading.environment import PackedEnvironment, material_fields
from clfractal.shading.kind_numbers import ALONG, COLORINGS, KNOWN, TRAPS
from clfractal.shading.maps import asked_maps

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
        Field("side", "real", 3, "the picture's right, length 1"),
        Field("up", "real", 3, "the picture's up, length 1"),
        Field("has_lens", "int", 0, "1: rays leave a lens; 0: a pinhole"),
        Field("lens_radius", "real", 0, "half the lens's diameter, scene units; 0 for a pinhole"),
        Field("focus_distance", "real", 0, "of the plane that is sharp, along the axis, scene units"),
        Field("pixel_size", "real", 0, "height of a pixel of the reference on the plane, scene units"),
        Field("perspective", "int", 0, "1: rays leave the eye; 0: rays are parallel to the axis"),
        Field("height", "int", 0, "height of the picture, pixels"),
        Field("spans", "int", 0, "between the poses of a view that moves; else 0"),
        Field("region_left", "int", 0, "first column to render"),
        Field("region_top", "int", 0, "first row to render"),
        Field("region_right", "int", 0, "first column right of the region"),
        Field("region_bottom", "int", 0, "first row below the region"),
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
        Field("coloring", "int", 0, "what chooses the colour, or is asked for a map, COLORING_"),
        Field("known", "int", 0, "when that is known, KNOWN_"),
        Field("of_objects", "int", 0, "1: the formula has an answer on objects, too"),
        Field("of_volumes", "int", 0, "1: it colours volumes"),
        Field("along", "int", 0, "the way of thickness or layer distance, ALONG_"),
        Field("coloring_step", "real", 0, "step along the way of thickness or layer distance, scene units"),
        Field("coloring_limit", "real", 0, "longest way, scene units"),
        Field("coloring_tests", "int", 0, "most inside tests for one end of a way"),
        Field("layer", "int", 0, "iterations of the other layer"),
        Field("carried", "int", 0, "the number of the name of what the formula carries; 0: none"),
        Field("trap_center", "real", 3, "a point of the trap, in z"),
        Field("trap_direction", "real", 3, "its axis' or normal's direction, length 1"),
        Field("trap_radius", "real", 0, "a sphere's radius, in z"),
        Field("trap_shape", "int", 0, "of the trap, TRAP_"),
        Field("reflection", "real", 0, "part that is mirrored sharply"),
        Field("fog_color", "real", 3, "linear Rec. 709"),
        Field("fog_density", "real", 0, "per scene unit"),
        Field(
            "fog_height", "real", 0, "in which its density falls to 1/e, scene units; 0: the same everywhere"
        ),
        Field("fog_base", "real", 0, "how far up it has this density, scene units"),
        Field("fog_up", "real", 3, "the direction in which it is thinner, length 1"),
        Field("fog_scattering", "real", 3, "part of each light that it scatters"),
        Field("fog_anisotropy", "real", 0, "of that, Henyey and Greenstein's g"),
        Field("fog_background", "int", 0, "1: the fog covers what is past the set"),
        Field("glow_color", "real", 3, "times its intensity"),
        Field("glow_width", "real", 0, "distance over which it fades to 1/e, scene units"),
        Field("glow_reach", "real", 0, "distance from its trap over which it fades to 1/e, in z"),
        Field("glow_trap", "int", 0, "its shape, TRAP_; 0: it has none"),
        Field("glow_center", "real", 3, "of its trap, as for colours"),
        Field("glow_direction", "real", 3, ""),
        Field("glow_radius", "real", 0, ""),
        Field("mist_by_count", "int", 0, "1: where it is dense follows escape counts; 0: distances"),
        Field("mist_density", "real", 0, "where it is densest, per scene unit"),
        Field("mist_width", "real", 0, "how far from there it is half as dense, scene units"),
        Field("mist_distance", "real", 0, "how far from the set that is"),
        Field("mist_start", "real", 0, "escape count up to which there is none"),
        Field("mist_rise", "real", 0, "1 / the counts from there to where it is densest"),
        Field("mist_at", "real", MAX_STOPS, "distance or count of each stop of its colours; all there are"),
        Field(
            "mist_slope", "real", MAX_STOPS, "1 / what lies between a stop and the one before; 0: it is none"
        ),
        Field("mist_colors", "real", 3 * MAX_STOPS, "linear Rec. 709"),
        Field("environment_seen", "int", 0, "1: the environment is seen past the set"),
        Field("transparent", "int", 0, "1: no background is composited under"),
        Field("environment_intensity", "real", 0, "factor on the environment's light"),
        Field("environment_turn", "real", 2, "cosine and sine of its turn about z"),
        Field("environment_width", "int", 0, "size of the map, pixels"),
        Field("environment_sun", "int", 0, "1: a sun is before it"),
        Field("environment_height", "int", 0, ""),
        Field("environment_columns", "int", 0, "size of its tables, cells"),
        Field("environment_rows", "int", 0, ""),
    ],
    kinds=[("MIST_STOPS", MAX_STOPS)],
)

# Inside tests of a way through the set besides its full steps: the growing ones at its start, and the bisection.
EXTRA_TESTS = 64


def view_records(poses: Sequence[View], image: Image, plan: Plan, precision: Precision) -> Record:
    """The poses of a view for a picture, of which the plan's region is rendered.

    With a divider d pixel (x, y) of the plan is the picture's pixel (d x + d / 2, d y + d / 2), with the very same ray: a
    coarse picture shows what the finished one will show there. A ray is as wide as a pixel of the image's reference.
    """
    coarse, region = plan.divider, plan.region
    width, height = image.width, image.height

    def values(view: View) -> dict[str, object]:
        return {
            "center": view.center,
            "right": view.side * (view.width / width * coarse),
            "down": view.up * (-view.height / height * coarse),
            "eye": view.origin,
            "axis": view.axis,
            "side": view.side,
            "up": view.up,
            "has_lens": int(any(pose.lens_radius > 0 for pose in poses)),
            "lens_radius": view.lens_radius,
            "focus_distance": view.focus_distance,
            "center_x": ((width - (coarse > 1)) / 2 - plan.offset[0]) / coarse,
            "center_y": ((height - (coarse > 1)) / 2 - plan.offset[1]) / coarse,
            "pixel_size": view.pixel_size(image.reference),
            "perspective": int(view.eye is not None),
            "height": -(-height // coarse),
            "spans": len(poses) - 1,
            "region_left": region.x,
            "region_top": region.y,
            "region_right": region.right,
            "region_bottom": region.bottom,
        }

    return VIEW.array(precision, [values(view) for view in poses])


def firefly_limit(scene: Scene) -> float | None:
    """The most light that one part of a sample may add."""
    lighting = scene.lighting
    return lighting.clamp if isinstance(lighting, PathLighting) else scene.surface.firefly_limit


def environment_weight(scene: Scene, packed: PackedEnvironment | None) -> float:
    """About the irradiance that an environment brings: pi times its mean luminance."""
    if scene.environment is None or packed is None:
        return 0.0
    return math.pi * scene.environment.intensity * packed.mean


def bounces(scene: Scene) -> int:
    """Most mirror reflections of a path, or its bounces."""
    if isinstance(scene.lighting, PathLighting):
        return scene.lighting.bounces
    return scene.surface.bounces if scene.material.reflection > 0 or mirrors(scene) else 0


@dataclass(frozen=True, slots=True)
class HemisphereRays:
    """Rays of a sample into the hemisphere: spread like the cosine, like the environment's light, and whether that
    lights.
    """

    cosine: int
    map: int
    lit: bool


def hemisphere_rays(scene: Scene) -> HemisphereRays:
    """Ambient occlusion and the environment's light share the rays that are spread like the cosine."""
    if isinstance(scene.lighting, PathLighting):
        return HemisphereRays(0, 0, lit=False)
    occlusion = scene.surface.ambient_occlusion
    open_rays = occlusion.rays if occlusion is not None else 0
    lit_rays = scene.environment.rays if scene.environment is not None else 0
    return HemisphereRays(max(open_rays, (lit_rays + 1) // 2), lit_rays // 2, lit_rays > 0)


def material_record(
    scene: Scene, precision: Precision, environment: PackedEnvironment | None = None
) -> Record:
    """Material, colouring, background, and the packed environment's layout; behind it what maps ask the formula."""
    material, background, fog = scene.material, scene.background, scene.fog
    gradient = background if isinstance(background, Gradient) else None
    shafts = fog.scattering if fog else None
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
        "palette_repeat": int(scene.coloring.repeat),
        **_way_and_trap(scene, scene.coloring),
        "reflection": material.reflection,
        "fog_color": fog.color if fog else (0.0, 0.0, 0.0),
        "fog_density": fog.density if fog else 0.0,
        "fog_height": (fog.height or 0.0) if fog else 0.0,
        "fog_base": fog.base if fog else 0.0,
        "fog_up": unit(fog.up) if fog else (0.0, 0.0, 1.0),
        "fog_scattering": shafts.color if shafts else (0.0, 0.0, 0.0),
        "fog_anisotropy": shafts.anisotropy if shafts else 0.0,
        "fog_background": int(fog is not None and fog.background and fog.density > 0),
        **_glow(scene),
        **_mist(scene),
        "environment_seen": int(scene.environment is not None and scene.environment.background),
        "transparent": int(gradient is None),
        **material_fields(scene.environment, environment),
    }
    asked = [{**values, **_way_and_trap(scene, each)} for each in asked_maps(scene)]
    return MATERIAL.array(precision, [values, *asked])


def _glow(scene: Scene) -> dict[str, object]:
    """The fields of a Material for `kernels/integrators/glow.cl`."""
    glow = scene.glow or Glow()
    return {
        "glow_color": tuple(glow.intensity * part for part in glow.color),
        "glow_width": glow.used_width(scene.size),
        "glow_reach": glow.reach,
        "glow_trap": TRAPS[glow.trap.shape] if glow.by == "trap" else 0,
        "glow_center": glow.trap.center,
        "glow_direction": unit(glow.trap.direction),
        "glow_radius": glow.trap.radius,
    }


def _mist(scene: Scene) -> dict[str, object]:
    """The fields of a Material for `kernels/integrators/mist.cl`."""
    mist, radius = scene.mist or Mist(), scene.size
    places = [stop.at for stop in mist.colors]
    more = MAX_STOPS - len(places)
    # (Where a colour changes at once, the slope only has to be too steep to be seen.)
    slopes = [0.0, *(1 / max(after - before, 1e-9) for before, after in pairwise(places))]
    return {
        "mist_by_count": int(mist.by == "iterations"),
        "mist_density": mist.used_density(radius),
        "mist_width": mist.used_width(radius),
        "mist_distance": mist.distance,
        "mist_start": mist.start,
        "mist_rise": 1 / max(mist.used_end(scene.formula.iterations) - mist.start, 1e-6),
        "mist_at": [*places, *[0.0] * more],
        "mist_slope": [*slopes, *[0.0] * more],
        "mist_colors": [part for stop in mist.colors for part in stop.color] + [0.0] * (3 * more),
    }


def _carried(scene: Scene, coloring: Coloring | Map) -> int:
    """The number of the name of what is carried; without a name of the first that the formulas carry."""
    if coloring.by != "carried":
        return 0
    return name_number(coloring.number or next(iter(scene.carried)))


def _way_and_trap(scene: Scene, coloring: Coloring | Map) -> dict[str, object]:
    """The fields of a Material for `kernels/shading/coloring.h`."""
    radius = scene.size
    step = coloring.step if coloring.step is not None else radius / 100
    kind = coloring.kind
    assert kind is not None
    direction = np.array(coloring.trap.direction, float)
    return {
        "coloring": COLORINGS[kind.tag],
        "known": KNOWN[kind.known],
        "of_objects": int(kind.of_objects),
        "of_volumes": int(kind.of_volumes),
        "along": ALONG[coloring.along] if isinstance(coloring, Coloring) else ALONG["normal"],
        "coloring_step": step,
        "coloring_limit": 2 * radius,
        "coloring_tests": math.ceil(2 * radius / step) + EXTRA_TESTS,
        "layer": coloring.layer,
        "carried": _carried(scene, coloring),
        "trap_center": coloring.trap.center,
        "trap_direction": direction / np.linalg.norm(direction),
        "trap_radius": coloring.trap.radius,
        "trap_shape": TRAPS[coloring.trap.shape],
    }
