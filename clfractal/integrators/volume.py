"""The volume renderer: the data that rays read besides the grid, and the transfer tables."""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from functools import cached_property
from itertools import pairwise
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.orbit import ORBIT
from clfractal.device.source import FlatText
from clfractal.device.structs import Field, Precision, Struct
from clfractal.geometry.planes import CUT_PLANE, plane_count, plane_palettes, plane_records, zoom_of
from clfractal.geometry.solids import Body
from clfractal.integrators import records
from clfractal.integrators.kernel import KernelArgument, ProgramText, Stage, TileKernel, flat_text
from clfractal.integrators.passes import SAMPLING, pass_defines
from clfractal.integrators.path_state import path_state_text
from clfractal.integrators.plan import Plan
from clfractal.scene.checks import used_boxes
from clfractal.scene.given import GivenGrid
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.scene.sampled import Sampled
from clfractal.scene.told_set import told_set
from clfractal.scene.volume import VolumeRenderer
from clfractal.shading.environment import PackedEnvironment, packed_map
from clfractal.shading.kind_numbers import kind_text
from clfractal.shading.light_records import (
    LIGHT,
    light_records,
    light_tables,
    tables_key,
    tree_begins,
)
from clfractal.shading.light_tree import tree_fields
from clfractal.shading.transfer import (
    MOST_OPACITY,
    SHINING_RATE,
    TRANSFER_SIZE,
    Floats,
    extinction,
    medium_table,
    mixed,
    table_bounds,
    value_limits,
)
from clfractal.voxels.blocks import brick_ranges, seen_blocks
from clfractal.voxels.dense import grid_from_dense
from clfractal.voxels.fill import fill_grid, shows_outside
from clfractal.voxels.grid import Grid

# Shadow rays leave the surface by this many voxels, so that they do not meet the voxel that they start from.
SHADOW_LIFT = 1.5
# From one place to the next where the formula's surface is looked for, in voxels (`volume_exact.h`).
NORMAL_STEP = 0.125

GRID = Struct(
    "Grid",
    [
        Field("corner", "real", 3, "its first corner, in the picture's scene units"),
        Field(
            "own_x",
            "real",
            3,
            "from scene units to voxels along its own axes, which may be turned and oblique",
        ),
        Field("own_y", "real", 3, ""),
        Field("own_z", "real", 3, ""),
        Field("sides", "int", 3, "voxels along x, y and z"),
        Field("bricks", "int", 3, "bricks along x, y and z"),
        Field("pool_bricks", "int", 0, "stored bricks in each buffer"),
        Field("pools", "int", 0, "buffers"),
        Field("plain", "int", 0, "1: there is one buffer, and values are blended"),
        Field("floats", "int", 0, "1: values are floats; 0: bytes"),
        Field("nearest", "int", 0, "1: a place has the value of the nearest voxel; 0: values are blended"),
    ],
)

VOLUME = Struct(
    "Volume",
    [
        Field("step", "real", 0, "from one place of a ray to the next, scene units"),
        Field("level", "real", 0, "value of the surface, as it is kept"),
        Field("low", "real", 0, "first value of the transfer table, as it is kept"),
        Field("range", "real", 0, "one over the width of its values"),
        Field("value_scale", "real", 0, "a kept value's worth ..."),
        Field("value_offset", "real", 0, "... and what the kept value 0 stands for"),
        Field("opacity_limit", "real", 0, "a ray ends once it is that opaque"),
        Field("shadow_lift", "real", 0, "where shadow rays start above the surface, scene units"),
        Field("environment_weight", "real", 0, "about the irradiance that the environment brings"),
        Field("firefly_limit", "real", 0, "most light that one bounce of a sample may add"),
        Field("anisotropy", "real", 0, "Henyey and Greenstein's g"),
        Field("seed", "uint", 0, "chooses where paths go"),
        Field("bounces", "int", 0, "most bounces of a path after the first place that scatters it"),
        Field("roulette", "int", 0, "bounces after which Russian roulette ends paths"),
        Field("max_steps", "int", 0, "most places of a ray"),
        Field("light_count", "int", 0, "number of lights"),
        Field("single_lights", "int", 0, "of these, beside the tree of lamps"),
        Field("tree_nodes", "int", 0, "nodes of that tree"),
        Field("light_tree", "int", 0, "where it begins among the tables"),
        Field("plane_count", "int", 0, "number of cut planes"),
        Field("shadows", "int", 0, "1: some light is blocked by the grid"),
        Field("shines", "int", 0, "1: the grid adds light by itself"),
        Field("tinted", "int", 0, "1: values have colours of their own; 0: the material's"),
        Field("exact_normals", "int", 0, "1: surfaces have the formula's normals where rays meet them"),
        Field("zoom", "real", 0, "from the picture to where the formula is evaluated: a factor, ..."),
        Field("zoom_origin", "real", 3, "... and what is added"),
        Field(
            "normal_step",
            "real",
            0,
            "how far apart the formula's surface is looked for: an eighth of a voxel there",
        ),
    ],
)

STRUCTS = (records.VIEW, SAMPLING, LIGHT, records.MATERIAL, ORBIT, CUT_PLANE, GRID, VOLUME)


def settings_of(scene: Scene) -> VolumeRenderer:
    """The renderer of a volume scene."""
    assert isinstance(scene.renderer, VolumeRenderer)
    return scene.renderer


def program_text(scene: Scene, plan: Plan) -> FlatText:
    """The whole text of the program; the scene's formula is part of it only where pictures ask it."""
    defines = {
        **pass_defines(plan),
        "REAL_IS_DOUBLE": int(ray_precision(scene, plan) == "float64"),
        "PALETTE_SIZE": 256,
        "TRANSFER_SIZE": TRANSFER_SIZE,
    }
    generated = {
        "structs.h": kind_text() + "".join(struct.c_text() for struct in STRUCTS),
        "path_state.h": path_state_text(),
    }
    if asks_formula(scene):
        generated |= Body.of(scene).texts(turns=True)
    return flat_text(f"integrators/volume/{kernel_of(scene)}.cl", generated=generated, defines=defines)


def kernel_of(scene: Scene) -> str:
    """The kernel that renders a scene; each has a program of its own."""
    if has_paths(scene):
        return "volume_paths"
    shown = "surface" if settings_of(scene).transfer.opacity is None else "medium"
    return f"volume_formula_{shown}" if asks_formula(scene) else f"volume_{shown}"


def has_exact_normals(scene: Scene) -> bool:
    """Whether the surface has the formula's normals where rays meet it."""
    settings = settings_of(scene)
    return settings.normals == "exact" and settings.transfer.opacity is None and scene.given is None


def asks_formula(scene: Scene) -> bool:
    """Whether pictures evaluate the formula themselves."""
    return bool(scene.cut_planes) or has_exact_normals(scene)


def ray_precision(scene: Scene, plan: Plan) -> Precision:
    """The number type of rays: rays use the grid's own coordinates, whatever number type filled it.

    Only what evaluates the formula where a zoom has led wants what filling wants.
    """
    return plan.precision if asks_formula(scene) else "float32"


class VolumeKernel(TileKernel):
    """Rays through a grid of voxels, which is filled at its first use."""

    name = "volume"

    @property
    def precision(self) -> Precision:
        return ray_precision(self.scene, self.plan)

    @property
    def grid(self) -> Grid:
        """The grid; of an earlier picture if that had the same.

        Raises:
            DeviceError, KernelBuildError: it cannot be filled.
            Stopped: its filling was cancelled.
            NotReady: it would have to be filled, and is not waited for.
        """
        # (Not a cached property: in Python 3.11 one that is computed holds up all others of its name, in any thread.)
        if self._grid is None:
            self._grid = self.resources.once(self._grid_key, self._fill)
        return self._grid

    _grid: Grid | None = None

    def texts(self) -> list[ProgramText]:
        return [ProgramText(self.name, program_text(self.scene, self.plan), (kernel_of(self.scene),))]

    def stages(self, samples: tuple[int, int]) -> Iterator[Stage]:
        yield Stage(kernel_of(self.scene))

    def own_arguments(self) -> list[KernelArgument]:
        scene, grid, precision = self.scene, self.grid, self.precision
        unseen = unseen_sample(scene, grid)
        blocks = self.resources.once(
            f"{self._grid_key} {unseen}",
            lambda: seen_blocks(grid, unseen, self.resources.on_compile),
            quick=True,
        )
        four = (0, 1, 2, 3)
        return [
            volume_record(scene, grid, precision, self._environment),
            grid_record(scene, grid, precision),
            records.material_record(scene, precision, self._environment),
            light_records(scene, precision),
            np.ascontiguousarray(transfer_table(scene, value_range(scene, grid)).T),
            grid.table,
            blocks,
            *(_one_of(grid.values, pool) for pool in four),
            *(_one_of(grid.normals, pool) for pool in four),
            *_formula_arguments(scene, precision),
            *self._path_arguments(),
            self._light_tables(),
            *_plane_arguments(scene, precision),
        ]

    @cached_property
    def _environment(self) -> PackedEnvironment | None:
        found = self.scene.surroundings if has_paths(self.scene) else None
        if found is None:
            return None
        return self.resources.once(f"environment {found.digest}", lambda: packed_map(found))

    def _path_arguments(self) -> list[KernelArgument]:
        """The bricks' bounds, and the environment; nothing where light does not go along paths."""
        if not has_paths(self.scene):
            return [np.zeros(1, np.float32), np.zeros(1, np.float32)]
        grid, packed = self.grid, self._environment
        ranges = self.resources.once(
            f"{self._grid_key} ranges",
            lambda: brick_ranges(grid, self.resources.on_compile),
            quick=True,
        )
        return [
            brick_bounds(self.scene, grid, ranges),
            np.zeros(1, np.float32) if packed is None else packed.data,
        ]

    def _light_tables(self) -> npt.NDArray[np.float32]:
        """What lights have read; without such lights a stand-in."""
        found = self.resources.once(tables_key(self.scene), lambda: light_tables(self.scene))
        return found if found.size else np.zeros(1, np.float32)

    @cached_property
    def _grid_key(self) -> str:
        return grid_key(self.scene, self.plan)

    def _fill(self) -> Grid:
        given, device, on_compile = self.scene.given, self.resources.device, self.resources.on_compile
        settings = settings_of(self.scene)
        if given is None:
            return fill_grid(
                self.scene,
                settings,
                device,
                lanes=self.plan.lanes,
                precision=self.plan.precision,
                on_compile=on_compile,
                token=self.resources.token,
            )
        return grid_from_dense(
            given.values,
            device,
            place=given.place,
            threshold=least_visible(settings, given),
            normal_radius=settings.normal_radius,
            on_compile=on_compile,
        )


def grid_key(scene: Scene, plan: Plan) -> str:
    """What the grid follows from: the solid, and how it is filled; of the transfer only what decides what is stored."""
    settings, given = settings_of(scene), scene.given
    shown = settings.model_dump(
        mode="json",
        exclude={
            *Sampled.model_fields,
            "transfer",
            "level",
            "step",
            "shadows",
            "opacity_limit",
            "anisotropy",
        },
    )
    solid = told_set(scene) if given is None else given.digest
    seen = shows_outside(settings) if given is None else least_visible(settings, given)
    return json.dumps([solid, shown, seen, plan.precision, plan.lanes])


def least_visible(settings: VolumeRenderer, given: GivenGrid) -> float | None:
    """The largest value at which a grid's voxels are invisible; None if even the least is visible."""
    stops = settings.transfer.visible
    if not stops:
        return float(
            np.nextafter(np.float32(settings.used_level(given.low, given.high)), np.float32(-np.inf))
        )
    if stops[0][1]:
        return None
    return next((at for (at, _), (_, seen) in pairwise(stops) if seen), stops[-1][0])


def grid_record(scene: Scene, grid: Grid, precision: Precision) -> npt.NDArray[Any]:
    """Where the grid lies in the picture: in the first box, whatever is zoomed to."""
    place = grid.place
    if scene.given is None:
        shown, _ = used_boxes(scene, settings_of(scene))
        # A resolution that does not divide the box evenly goes past it a little.
        place = place.moved(shown.center, settings_of(scene).magnification)
    values = {
        "corner": place.corner,
        **dict(zip(("own_x", "own_y", "own_z"), place.inverse, strict=True)),
        "sides": grid.shape,
        "bricks": grid.bricks,
        "pool_bricks": grid.parts.part_slots,
        "pools": len(grid.values),
        "plain": int(len(grid.values) == 1 and settings_of(scene).interpolation != "nearest"),
        "floats": int(grid.kind == "float"),
        "nearest": int(settings_of(scene).interpolation == "nearest"),
    }
    return GRID.value(precision, values)


def volume_record(
    scene: Scene, grid: Grid, precision: Precision, environment: PackedEnvironment | None = None
) -> npt.NDArray[Any]:
    """How rays go through the grid and how pixels are put together."""
    settings = settings_of(scene)
    voxel = float(min(grid.spacing)) * settings.magnification
    zoom, origin = zoom_of(scene)
    # Paths count in sides of a voxel.
    step = voxel if has_paths(scene) else settings.step * voxel
    longest = grid.place.diagonal * settings.magnification
    per_sample = (grid.range[1] - grid.range[0]) / full_sample(grid)
    low, high = ((value - grid.range[0]) / per_sample for value in value_range(scene, grid))
    least, most = grid.range if scene.given is None else (scene.given.low, scene.given.high)
    values = {
        "step": step,
        "level": (settings.used_level(least, most) - grid.range[0]) / per_sample,
        "low": low,
        "range": 1 / (high - low),
        "value_scale": per_sample,
        "value_offset": grid.range[0],
        "opacity_limit": settings.opacity_limit,
        "shadow_lift": SHADOW_LIFT * voxel,
        **_path_fields(scene, environment),
        "max_steps": int(np.ceil(longest / step)) + 2,
        **tree_fields(scene, tree_begins(scene)),
        "plane_count": plane_count(scene),
        "shadows": int(settings.shadows and any(light.shadow for light in scene.lights)),
        "shines": int(settings.transfer.emission is not None),
        "tinted": int(settings.transfer.color is not None),
        "exact_normals": int(has_exact_normals(scene)),
        "zoom": zoom,
        "zoom_origin": origin,
        "normal_step": NORMAL_STEP * voxel * zoom,
    }
    return VOLUME.value(precision, values)


def has_paths(scene: Scene) -> bool:
    """Whether light goes along paths."""
    return isinstance(scene.lighting, PathLighting)


def _path_fields(scene: Scene, environment: PackedEnvironment | None) -> dict[str, object]:
    """The fields of a Volume for `kernels/integrators/volume/volume_paths.h`."""
    settings, lighting = settings_of(scene), scene.lighting
    largest = float(np.finfo(np.float32).max) / 16
    if not isinstance(lighting, PathLighting):
        names = ("environment_weight", "firefly_limit", "anisotropy", "seed", "bounces", "roulette")
        return dict.fromkeys(names, 0)
    return {
        "environment_weight": records.environment_weight(scene, environment),
        "firefly_limit": largest if lighting.clamp is None else min(lighting.clamp, largest),
        "anisotropy": settings.anisotropy,
        "seed": settings.seed,
        "bounces": lighting.bounces,
        "roulette": lighting.roulette,
    }


def brick_bounds(scene: Scene, grid: Grid, ranges: Floats) -> Floats:
    """A bound of the extinction in each brick, per side of a voxel; where something shines at least SHINING_RATE.

    Args:
        ranges: the least and the largest sample of each slot, see `brick_ranges`.
    """
    record = volume_record(scene, grid, "float32")
    table = transfer_table(scene, value_range(scene, grid))
    most = table[:, 0].astype(np.float64)
    most = np.where((table[:, 4:] > 0).any(axis=1), np.maximum(most, SHINING_RATE), most)
    return table_bounds(most, ranges, float(record["low"]), float(record["range"]))


def full_sample(grid: Grid) -> float:
    """The sample that stands for `grid.range[1]`."""
    return 255.0 if grid.kind == "byte" else grid.range[1]


def unseen_sample(scene: Scene, grid: Grid) -> float:
    """The largest sample that is invisible; NaN if even the least sample is visible."""
    record = volume_record(scene, grid, "float32")
    if settings_of(scene).transfer.opacity is None:
        return float(np.nextafter(np.float32(record["level"]), np.float32(-np.inf)))
    table = transfer_table(scene, value_range(scene, grid))
    seen = np.flatnonzero((table[:, 0] > 0) | (table[:, 4:] > 0).any(axis=1))
    if not len(seen):
        return float(np.inf)
    if seen[0] == 0:
        return float(np.nan)
    # Up to the last entry before the first that is seen, as a kernel finds places in the table.
    low, scale = np.float32(record["low"]), np.float32(record["range"]) * np.float32(TRANSFER_SIZE - 1)
    sample = low + np.float32(seen[0] - 1.01) / scale
    while (sample - low) * scale > seen[0] - 1:
        sample = np.nextafter(sample, np.float32(-np.inf))
    return float(sample)


def value_range(scene: Scene, grid: Grid) -> tuple[float, float]:
    """The values between which the transfer table lies: those of its stops, or of the grid."""
    given = scene.given
    return value_limits(settings_of(scene).transfer, grid.range if given is None else (given.low, given.high))


def transfer_table(scene: Scene, limits: tuple[float, float]) -> Floats:
    """What a kernel needs of values between `limits`; shape (TRANSFER_SIZE, 4 or 7).

    For paths the columns are the extinction per side of a voxel, the colour, and the light that a side adds. Else they
    are the opacity of one step, the colour (linear), and the light that one step adds, if anything shines. With
    dL/ds = j - sigma L, a step of length h adds j (1 - exp(-sigma h)) / sigma (Max 1995, Optical models for direct volume
    rendering, Eq. 5), so that pictures do not depend on the step.
    """
    settings = settings_of(scene)
    transfer = settings.transfer
    if has_paths(scene) and transfer.opacity is not None:
        return medium_table(transfer, limits, scene.material.color)
    values = np.linspace(*limits, TRANSFER_SIZE)
    table = np.empty((TRANSFER_SIZE, 4))
    if transfer.opacity is None:
        table[:, 0] = 1.0
    else:
        opacity = mixed(values, [(stop.at, (stop.opacity,)) for stop in transfer.opacity])[:, 0]
        if transfer.emission is not None:
            opacity = np.minimum(opacity, MOST_OPACITY)
        # An opacity is that of one voxel's side; a step is a part of it (Beer's law).
        table[:, 0] = 1 - (1 - opacity) ** settings.step
    if transfer.color is None:
        table[:, 1:] = scene.material.color
    else:
        table[:, 1:] = mixed(values, [(stop.at, stop.color) for stop in transfer.color])
    if transfer.opacity is not None and transfer.emission is not None:
        shines = mixed(values, [(stop.at, stop.emission) for stop in transfer.emission])
        shines = shines * _shining_length(extinction(values, transfer), settings.step)
        table = np.hstack([table, shines])
    return np.ascontiguousarray(table, np.float32)


def _shining_length(extinctions: npt.NDArray[np.float64], step: float) -> npt.NDArray[np.float64]:
    """The length of a step in sides of a voxel, as its own light is dimmed in it; shape (n, 1)."""
    depth = extinctions * step
    length = step * -np.expm1(-depth) / np.where(depth > 0, depth, 1)
    return np.where(depth > 0, length, step)[:, None]


def _plane_arguments(scene: Scene, precision: Precision) -> list[KernelArgument]:
    """The cut planes, in the kernel's order."""
    if not scene.cut_planes:
        return [np.zeros(1, CUT_PLANE.dtype(precision)), np.zeros(1, np.float32)]
    return [plane_records(scene, precision), plane_palettes(scene)]


def _formula_arguments(scene: Scene, precision: Precision) -> list[KernelArgument]:
    """The solid and the formulas' constants, or nothing where they are not asked."""
    if not asks_formula(scene):
        return [np.zeros(1, np.float32), np.zeros(1, np.float32)]
    body = Body.of(scene)
    return [body.records(precision), body.constants(precision)]


def _one_of(pools: Sequence[cl.Buffer], pool: int) -> cl.Buffer:
    return pools[min(pool, len(pools) - 1)]


KERNEL = VolumeKernel
