"""The surface renderer: its programs, and their data."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
import numpy.typing as npt

from clfractal.geometry.eye_body import eye_body
from clfractal.geometry.object_grids import ObjectGrids
from clfractal.geometry.objects import object_defines, object_records
from clfractal.geometry.planes import CUT_PLANE, plane_palettes, plane_records
from clfractal.geometry.solids import Body
from clfractal.integrators import records
from clfractal.integrators.declarations import struct_text
from clfractal.integrators.kept import Resources
from clfractal.integrators.kernel import (
    LANE_SHARE,
    OBJECT_NUMBERS,
    RAY_NUMBERS,
    STATE_PADDING,
    KernelArgument,
    Over,
    ProgramText,
    Stage,
    TileKernel,
    WaveNeeds,
    flat_text,
)
from clfractal.integrators.march import march_record
from clfractal.integrators.passes import pass_defines
from clfractal.integrators.path_state import path_state_text
from clfractal.integrators.plan import Plan, PlannedView
from clfractal.integrators.state import state_numbers, state_places, state_text
from clfractal.integrators.waves import (
    OF_SINGLE_LANES,
    OVER,
    meets_objects,
    met_numbers,
    most_turns,
    surface_stages,
)
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.shading.environment import packed_map
from clfractal.shading.light_records import (
    has_tables,
    light_records,
    light_tables,
    tables_key,
)
from clfractal.shading.maps import MAP, MAP_DEFINES, MappedMaterials, has_glass, mapped_materials
from clfractal.shading.materials import PBR, pbr_text, scattering_defines, weighed_text
from clfractal.shading.scattering import albedo_tables, glass_tables
from clfractal.shading.set_lights import set_light_data, set_lights_of

PALETTE_SIZE = 256
Floats = npt.NDArray[np.float32]


def march_defines(scene: Scene, plan: Plan) -> dict[str, object]:
    """The defines of programs that march, and know nothing of what is kept between stages."""
    return dict(pass_defines(plan))


def state_defines(scene: Scene, plan: Plan) -> dict[str, object]:
    """The defines of all programs that read what is kept between stages (`kernels/integrators/state.h`)."""
    return {
        **pass_defines(plan),
        "PALETTE_SIZE": PALETTE_SIZE,
        "STATE_PADDING": STATE_PADDING,
        "LANE_SHARE": LANE_SHARE,
        **object_defines(scene),
        **MAP_DEFINES,
    }


def path_defines(scene: Scene, plan: Plan) -> dict[str, object]:
    """The defines of stages of paths."""
    return {**state_defines(scene, plan), **scattering_defines()}


class SurfaceKernel(TileKernel):
    """The surface of a formula's set, found by marching rays."""

    name = "surface"
    waves = True

    def __init__(self, view: PlannedView, resources: Resources) -> None:
        super().__init__(view, resources)
        x, y, z = map(float, view.camera.origin)
        self.plan = replace(self.plan, eye_body=eye_body(self.scene, (x, y, z)))

    def texts(self) -> list[ProgramText]:
        return program_texts(self.scene, self.plan)

    def possible_texts(self) -> list[ProgramText]:
        return program_texts(self.scene, self.plan, all_stages=True)

    def stages(self, samples: tuple[int, int]) -> Iterator[Stage]:
        return surface_stages(self.scene, self.plan, samples)

    def over(self, kernel: str) -> Over:
        return OVER.get(kernel, "pixels")

    def wave_needs(self) -> WaveNeeds:
        ray = RAY_NUMBERS + OBJECT_NUMBERS * meets_objects(self.scene)
        return WaveNeeds(
            state_numbers(self.scene, self.plan), most_turns(self.scene), ray, met_numbers(self.scene)
        )

    def own_arguments(self) -> list[KernelArgument]:
        scene, precision, once = self.scene, self.precision, self.resources.once
        surroundings = scene.surroundings
        packed = None
        if surroundings is not None:
            packed = once(f"environment {surroundings.digest}", lambda: packed_map(surroundings))
        on_set, body = set_lights_of(scene), Body.of(scene)
        of_maps, before, tables = self._tables()
        return [
            march_record(
                scene,
                precision,
                self.plan.divider,
                packed,
                on_set,
                state_places(scene, self.plan),
                before,
                eye_body=self.plan.eye_body,
                counts_waits=self.resources.counts_waits,
            ),
            body.records(precision),
            body.constants(precision),
            records.material_record(scene, precision, packed),
            light_records(scene, precision, before),
            self._palette(),
            packed.data if packed is not None else np.zeros(4, np.float32),
            *(
                [plane_records(scene, precision), plane_palettes(scene)]
                if scene.cut_planes
                else [np.zeros(4, np.float32)] * 2
            ),
            *self._materials(),
            tables,
            set_light_data(on_set, precision),
            object_records(scene, precision, of_maps),
        ]

    def _materials(self) -> list[KernelArgument]:
        """The materials, the tables of their lobes, and their maps."""
        no_maps = np.zeros(1, MAP.dtype(self.precision))
        if not isinstance(self.scene.lighting, PathLighting):
            return [np.zeros(1, PBR.dtype(self.precision)), np.zeros(4, np.float32), no_maps]
        albedos = albedo_tables()
        if has_glass(self.scene):
            albedos = np.concatenate([albedos, glass_tables()])
        found = mapped_materials(self.scene)
        records_of = MappedMaterials(self.scene).records(self.precision)
        return [records_of, albedos, no_maps if found is None else found.map_records(self.precision)]

    def _tables(self) -> tuple[int, int, Floats]:
        """How many numbers the tables of maps have, how many with objects' grids, and these, with what lights have read."""
        once, found, grids = self.resources.once, mapped_materials(self.scene), ObjectGrids(self.scene)
        key, tables = "maps", np.zeros(0, np.float32)
        if found is not None:
            key = f"maps {found.key}"
            tables = once(key, found.tables)
        of_maps = tables
        if grids.volumes:
            key = f"{grids.key} {'' if found is None else found.key}"
            tables = once(key, lambda: np.concatenate([of_maps, grids.data()]))
        before = tables
        if has_tables(self.scene):
            key = f"{key} {tables_key(self.scene)}"
            tables = once(key, lambda: np.concatenate([before, light_tables(self.scene)]))
        return of_maps.size, before.size, tables if tables.size else np.zeros(4, np.float32)

    def _palette(self) -> Floats:
        coloring = self.scene.coloring
        if not coloring.uses_palette:
            return np.zeros(3, np.float32)
        from clfractal.scene.palette import palette_table

        key = f"palette {coloring.model_dump_json()}"
        return self.resources.once(
            key, lambda: np.ascontiguousarray(palette_table(coloring), np.float32), quick=True
        )


@dataclass(frozen=True, slots=True)
class _Program:
    """A program: its entry point, the kernels that it may have, and the defines of its text.

    Attributes:
        formula: whether it asks the formula.
        turns: and the defines that depend on the formula's turns.
    """

    name: str
    entry: str
    kernels: tuple[str, ...]
    defines: Callable[[Scene, Plan], dict[str, object]]
    formula: bool = False
    turns: bool = False


# A scene needs those whose stages it launches.
PROGRAMS = (
    _Program(
        "rays", "integrators/march/march.cl", ("march_rays", "look_at_surfaces"), march_defines, formula=True
    ),
    _Program(
        "point_rays",
        "integrators/march/march_points.cl",
        ("march_points", "look_at_points"),
        march_defines,
        formula=True,
    ),
    _Program(
        "steps",
        "integrators/march/march_steps.cl",
        ("step_rays", "look_where_steps_end"),
        march_defines,
        formula=True,
    ),
    _Program("begin", "integrators/begin_samples.cl", ("send_cones", "begin_samples"), state_defines),
    _Program("points", "integrators/march/pixel_points.cl", ("send_points", "join_points"), state_defines),
    _Program("interactions", "integrators/find_interactions.cl", ("find_interactions",), state_defines),
    _Program("objects", "geometry/objects.cl", ("meet_objects", "look_at_objects"), state_defines),
    _Program("light", "integrators/light_interactions.cl", ("light_interactions",), state_defines),
    _Program(
        "wide", "integrators/wide_lights.cl", ("send_to_lights", "gather_light", "meet_lights"), state_defines
    ),
    _Program("air", "integrators/air_rays.cl", ("send_air", "gather_air"), state_defines),
    _Program("materials", "integrators/find_materials.cl", ("find_materials",), state_defines),
    _Program("scatter", "integrators/scatter_paths.cl", ("scatter_paths",), path_defines),
    _Program("costly", "integrators/scatter_costly.cl", ("scatter_costly",), path_defines),
    _Program("gather", "integrators/gather_paths.cl", ("gather_paths", "end_paths"), path_defines),
    _Program("bent", "integrators/bent_light.cl", ("bend_light", "end_bent_light"), path_defines),
    _Program("bent_shapes", "integrators/bent_shapes.cl", ("bend_shapes", "end_bent_shapes"), path_defines),
    _Program(
        "sought",
        "integrators/sought_light.cl",
        ("find_sought", "gather_sought", "gather_sought_air", "find_last", "end_sought"),
        path_defines,
    ),
    _Program("media", "integrators/media.cl", ("cross_media",), path_defines),
    _Program("clouds", "integrators/walk_clouds.cl", ("walk_clouds", "pass_clouds"), path_defines),
    _Program(
        "glass",
        "integrators/march/glass.cl",
        ("march_inside", "look_inside_set"),
        march_defines,
        formula=True,
    ),
    _Program(
        "random_walk",
        "integrators/random_walk.cl",
        ("walk_inside", "look_where_walks_end"),
        state_defines,
        formula=True,
    ),
    _Program(
        "colors", "integrators/color_interactions.cl", ("color_interactions",), state_defines, formula=True
    ),
    _Program("glow", "integrators/glow.cl", ("add_glow",), state_defines, formula=True),
    _Program("mist", "integrators/mist.cl", ("find_mist",), state_defines, formula=True),
    _Program(
        "planes",
        "geometry/see_planes.cl",
        ("find_faces", "find_planes"),
        state_defines,
        formula=True,
        turns=True,
    ),
)


@cache
def _structs() -> dict[str, str]:
    """The declarations that stand in every program."""
    return {
        "structs.h": struct_text() + CUT_PLANE.c_text(),
        "path_state.h": path_state_text() + state_text(),
        "pbr.h": pbr_text(),
        "weighed.h": weighed_text(),
    }


def program_texts(scene: Scene, plan: Plan, *, all_stages: bool = False) -> list[ProgramText]:
    """The texts of the programs whose stages the scene launches, or of all, with joined solids and without."""
    body = Body.of(scene)
    launched = {stage.kernel for stage in surface_stages(scene, plan, (0, 1))}
    defines = cache(lambda of: of(scene, plan))
    texts = []
    for each in PROGRAMS:
        if not all_stages and launched.isdisjoint(each.kernels):
            continue
        # All that there are: what is kept of a program has every kernel that any scene may launch.
        kernels = tuple(name for name in each.kernels if plan.lanes == 1 or name not in OF_SINGLE_LANES)
        formulas: list[dict[str, str]] = [{}]
        if each.formula:
            formulas = body.possible_texts(turns=each.turns) if all_stages else [body.texts(turns=each.turns)]
        for formula in formulas:
            flat = flat_text(each.entry, generated={**formula, **_structs()}, defines=defines(each.defines))
            texts.append(ProgramText(each.name, flat, kernels))
    return texts


KERNEL = SurfaceKernel
