"""The surface renderer: its program, and the program's data."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clfractal.device.source import FlatText
from clfractal.formulas.opencl import write_formula
from clfractal.renderers import records
from clfractal.renderers.environment import packed_map
from clfractal.renderers.kernel import KernelArgument, TileKernel, flat_text
from clfractal.renderers.passes import pass_defines
from clfractal.renderers.plan import Plan
from clfractal.renderers.planes import CUT_PLANE, plane_defines, plane_orbits, plane_palettes, plane_records
from clfractal.scene.coloring import Coloring
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera

PALETTE_SIZE = 256
COLORINGS = {
    name: number
    for number, name in enumerate(
        ("solid", "normal", "iterations", "residual", "thickness", "layer_distance", "trap")
    )
}
ALONG = {"view": 0, "normal": 1, "reflection": 2}
TRAPS = {"point": 0, "axis": 1, "plane": 2, "sphere": 3}
NORMALS = ("gradient", "one_triangle", "eight_triangles_shading", "eight_triangles_normal", "least_squares")
# Distance evaluations that bring a point to a fixed part of its footprint from the set.
POLISH = 4

Floats = npt.NDArray[np.float32]


def defines(scene: Scene, plan: Plan) -> dict[str, object]:
    """The defines that determine the program's text, besides the formula."""
    return {
        **pass_defines(plan),
        "PALETTE_SIZE": PALETTE_SIZE,
        "LIGHT_DIRECTIONAL": records.LIGHT_DIRECTIONAL,
        **feature_defines(scene),
        **coloring_defines(scene.coloring),
        **plane_defines(scene),
    }


def feature_defines(scene: Scene) -> dict[str, object]:
    """How the surface is searched and shaded, as far as the program's text depends on it."""
    renderer = scene.surface
    points = renderer.used_points
    normal_counts = {"gradient": points.count, "eight_triangles_shading": 8}
    positions = points.count > 1 and (renderer.normal != "gradient" or scene.coloring.by == "residual")
    rays = records.hemisphere_rays(scene)
    return {
        "SEARCH_DISTANCE": 0,
        "SEARCH_STEPS": 1,
        "SEARCH": int(renderer.search == "steps"),
        "POINTS": points.count,
        "POINT_PATTERN": int(points.pattern == "stochastic"),
        "POINT_SIDE": math.isqrt(points.count),
        **{f"NORMAL_{name.upper()}": number for number, name in enumerate(NORMALS)},
        "NORMAL": NORMALS.index(renderer.normal),
        "NORMAL_COUNT": normal_counts.get(renderer.normal, 1),
        "GEOMETRIC": int(positions),
        # A binary search ends where the surface is; a march, somewhere within the point's footprint.
        "POLISH": POLISH if positions and renderer.search == "distance" else 0,
        "HAS_LENS": int(isinstance(scene.camera, PerspectiveCamera) and scene.camera.lens_radius > 0),
        "HAS_AMBIENT": int(rays.cosine + rays.map > 0),
        "HAS_ENVIRONMENT": int(scene.environment is not None),
        "HAS_SOFT_LIGHT": int(any(light.angular_size > 0 for light in scene.lights)),
        "HAS_FOG": int(scene.fog is not None),
        "ADAPTIVE": int(renderer.noise is not None),
    }


def coloring_defines(coloring: Coloring) -> dict[str, object]:
    """The defines that `kernels/coloring.h` and `shade.h` need."""
    families = (
        ("COLORING", COLORINGS, coloring.by),
        ("ALONG", ALONG, coloring.along),
        ("TRAP", TRAPS, coloring.trap.shape),
    )
    result: dict[str, object] = {}
    for family, numbers, chosen in families:
        result.update({f"{family}_{name.upper()}": number for name, number in numbers.items()})
        result[family] = numbers[chosen]
    return result


class SurfaceKernel(TileKernel):
    """The surface of a formula's set, found by marching rays."""

    name = "surface"

    def text(self) -> FlatText:
        return program_text(self.scene, self.plan)

    @property
    def footprint(self) -> int:
        # The points of a pixel lie all over the block that a coarse picture's pixel stands for, and their shared march has
        # to be as wide.
        return self.plan.divider if self.scene.surface.used_points.count > 1 else 1

    def own_arguments(self) -> list[KernelArgument]:
        scene, precision, kept = self.scene, self.precision, self.resources.kept
        formula = write_formula(scene.chain)
        surroundings = scene.surroundings
        packed = None
        if surroundings is not None:
            packed = kept.once(f"environment {surroundings.digest}", lambda: packed_map(surroundings))
        return [
            records.march_record(scene, precision),
            np.stack(
                [
                    records.orbit_record(scene.chain, scene.formula.iterations, precision),
                    *plane_orbits(scene, precision),
                ]
            ),
            np.array(formula.constants, precision),
            records.material_record(scene, precision, packed),
            records.light_records(scene, precision),
            self._palette(),
            packed.data if packed is not None else np.zeros(4, np.float32),
            *([plane_records(scene, precision), plane_palettes(scene)] if scene.cut_planes else []),
        ]

    def _palette(self) -> Floats:
        coloring = self.scene.coloring
        if not coloring.uses_palette:
            return np.zeros(3, np.float32)
        from clfractal.scene.palette import palette_table

        key = f"palette {coloring.model_dump_json()}"
        return self.resources.kept.once(
            key, lambda: np.ascontiguousarray(palette_table(coloring), np.float32)
        )


def program_text(scene: Scene, plan: Plan) -> FlatText:
    """The whole text of the scene's program."""
    formula = write_formula(scene.chain)
    generated = {"formula.h": formula.text, "structs.h": records.struct_text() + CUT_PLANE.c_text()}
    return flat_text("surface.cl", generated=generated, defines=defines(scene, plan))
