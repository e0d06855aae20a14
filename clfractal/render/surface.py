"""The surface renderer: its program, its buffers, and launching batches of tiles."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.files.channels import CHANNELS
from clfractal.formulas.opencl import write_formula
from clfractal.render import layout
from clfractal.render.environment import pack_environment
from clfractal.render.plan import Plan
from clfractal.render.tiles import TILE
from clfractal.render.view import camera_view
from clfractal.scene.coloring import Coloring
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera

TILE_PIXELS = TILE * TILE
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
POLISH = 5
# Work-items of a group: enough for a GPU's wave, and one part of a tile for a CPU thread.
GROUP_PIXELS = {1: 64, 4: 256, 8: 256, 16: 256}

Floats = npt.NDArray[np.float32]


def defines(scene: Scene, plan: Plan) -> dict[str, object]:
    """What shapes the program's text besides the formula."""
    names = {"CHANNEL_" + name.replace(".", "").upper(): place for place, name in enumerate(CHANNELS)}
    return {
        "LANES": plan.lanes,
        "REAL_IS_DOUBLE": int(plan.precision == "float64"),
        "TILE": TILE,
        "PALETTE_SIZE": PALETTE_SIZE,
        "LIGHT_DIRECTIONAL": layout.LIGHT_DIRECTIONAL,
        **feature_defines(scene),
        **coloring_defines(scene.coloring),
        **names,
    }


def feature_defines(scene: Scene) -> dict[str, object]:
    """How the surface is searched and shaded, as far as the program's text depends on it."""
    renderer = scene.renderer
    points = renderer.used_points
    normal_counts = {"gradient": points.count, "eight_triangles_shading": 8}
    positions = points.count > 1 and (renderer.normal != "gradient" or scene.coloring.by == "residual")
    rays = layout.hemisphere_rays(scene)
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
    """What `kernels/coloring.h` and `shade.h` need to know when they are compiled."""
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


def program_text(scene: Scene, plan: Plan) -> FlatText:
    """The whole text of the scene's program."""
    formula = write_formula(scene.chain)
    generated = {"formula.h": formula.text, "structs.h": layout.struct_text()}
    return flatten("surface.cl", generated=generated, defines=defines(scene, plan), user=["formula.h"])


@dataclass(frozen=True, slots=True)
class Batch:
    """Tiles on their way: their indices, the part of each tile's packets, and the event that ends them."""

    tiles: npt.NDArray[np.int32]
    packets: tuple[int, int]
    event: cl.Event
    slot: int


class SurfaceWorker:
    """Renders tiles of one scene on one device. Two batches may be under way at a time."""

    def __init__(
        self,
        scene: Scene,
        plan: Plan,
        device: Device,
        *,
        capacity: int,
        on_compile: Callable[[str], None] | None = None,
    ) -> None:
        """`capacity` is the most tiles of a batch; `on_compile` is told a line if the program is compiled first.

        Raises:
            DeviceError: too little memory (status 2), or the device failed.
            KernelBuildError: the program does not compile.
        """
        self.scene, self.plan, self.device = scene, plan, device
        self.packets = TILE_PIXELS // plan.lanes
        self.group = max(GROUP_PIXELS[plan.lanes] // plan.lanes, 1)
        self.capacity = capacity
        records = self._records()
        film_bytes = capacity * len(plan.channels) * TILE_PIXELS * 4
        statistic_bytes = capacity * self.packets * 16
        constant_bytes = [record.nbytes for record in records]
        device.check_memory(
            2 * (film_bytes + statistic_bytes) + sum(constant_bytes),
            "rendering",
            largest=max(film_bytes, *constant_bytes),
        )
        text = program_text(scene, plan)
        self.program = program.build(
            device,
            text.text,
            flags=program.math_flags(plan.precision),
            sources=text.sources,
            warm=self._warm(records),
            on_compile=on_compile,
        )
        self.films = [device.buffer(film_bytes, "the film") for _ in range(2)]
        self.statistics = [device.buffer(statistic_bytes, "statistics") for _ in range(2)]
        self.corners = [device.buffer(capacity * 8, "tile corners", read_only=True) for _ in range(2)]
        self.constants = [self._upload(record) for record in records]
        self.kernels = [self._kernel(slot) for slot in range(2)]
        # Transfers have a queue of their own: in the kernels' queue they would wait for the batch before or after.
        with device.failures("opening a queue"):
            self.transfers = cl.CommandQueue(device.context)

    def start(
        self, tiles: npt.NDArray[np.int32], packets: tuple[int, int] | None = None, *, slot: int = 0
    ) -> Batch:
        """Enqueues tiles (indices in the plan's grid); `packets` (first, count) renders a part of each."""
        first, count = packets or (0, self.packets)
        grid = self._grid
        columns, rows = tiles % grid.columns, tiles // grid.columns
        corners = (
            np.stack([grid.first_column + columns, grid.first_row + rows], axis=1).astype(np.int32) * TILE
        )
        with self.device.failures("rendering"):
            queue = self.device.queue
            cl.enqueue_copy(self.transfers, self.corners[slot], np.ascontiguousarray(corners))
            self.kernels[slot].set_arg(len(self.constants) + 4, np.int32(first))
            event = cl.enqueue_nd_range_kernel(
                queue, self.kernels[slot], (count, len(tiles)), (self.group, 1)
            )
            queue.flush()
        return Batch(tiles, (first, count), event, slot)

    def collect(self, batch: Batch) -> tuple[Floats, npt.NDArray[np.uint64]]:
        """Channels of a finished batch, shape (tiles, channels, TILE, TILE), and its sums of the statistics."""
        shape = (len(batch.tiles), len(self.plan.channels), TILE, TILE)
        film = np.empty(shape, np.float32)
        statistics = np.empty((len(batch.tiles), self.packets, 4), np.uint32)
        with self.device.failures("reading the film"):
            cl.enqueue_copy(self.transfers, statistics, self.statistics[batch.slot])
            cl.enqueue_copy(self.transfers, film, self.films[batch.slot])
        first, count = batch.packets
        used = statistics[:, first : first + count].astype(np.uint64)
        return film, used.sum(axis=(0, 1), dtype=np.uint64)

    @property
    def _grid(self) -> Any:
        from clfractal.render.tiles import TileGrid

        return TileGrid(self.plan.region)

    def _records(self) -> list[npt.NDArray[Any]]:
        """The constant arguments, in the kernel's order."""
        scene, plan = self.scene, self.plan
        width, height = scene.image.width, scene.image.height
        view = camera_view(scene.camera, width, height)
        formula = write_formula(scene.chain)
        surroundings = scene.surroundings
        packed = pack_environment(surroundings.pixels) if surroundings is not None else None
        slots = [plan.channels.index(name) if name in plan.channels else -1 for name in CHANNELS]
        return [
            layout.view_record(view, width, height, plan.region, plan.precision),
            layout.march_record(scene, plan.samples, plan.precision),
            layout.orbit_record(scene.chain, scene.formula.iterations, plan.precision),
            np.array(formula.constants, plan.precision),
            layout.material_record(scene, plan.precision, packed),
            layout.light_records(scene, plan.precision),
            self._palette(),
            packed.data if packed is not None else np.zeros(4, np.float32),
            np.array(slots, np.int32),
        ]

    def _palette(self) -> Floats:
        if not self.scene.coloring.uses_palette:
            return np.zeros(3, np.float32)
        from clfractal.scene.palette import palette_table

        return np.ascontiguousarray(palette_table(self.scene.coloring), np.float32)

    def _upload(self, record: npt.NDArray[Any]) -> cl.Buffer:
        data = np.ascontiguousarray(record).reshape(-1)
        buffer = self.device.buffer(max(data.nbytes, 16), "constants", read_only=True)
        with self.device.failures("uploading constants"):
            cl.enqueue_copy(self.device.queue, buffer, data.view(np.uint8))
        return buffer

    def _kernel(self, slot: int) -> cl.Kernel:
        kernel = self.program.kernel("surface")
        buffers = [self.films[slot], self.statistics[slot], self.corners[slot], *self.constants]
        with self.device.failures("setting arguments"):
            for index, buffer in enumerate(buffers):
                kernel.set_arg(index, buffer)
            kernel.set_arg(len(buffers), np.int32(len(self.plan.channels)))
            kernel.set_arg(len(buffers) + 1, np.int32(0))
        return kernel

    def _warm(self, records: list[npt.NDArray[Any]]) -> Warm:
        """A first launch that renders nothing: with a view of zeros the region is empty."""
        sizes = [TILE_PIXELS * 4 * len(self.plan.channels), self.packets * 16, 8]
        # Of a large environment map a part is enough.
        sizes += [min(max(record.nbytes, 16), 65_536) for record in records]
        arguments = [Argument("buffer", size) for size in sizes]
        arguments += [Argument("scalar", dtype="int32", value=0.0)] * 2
        return Warm("surface", (self.packets, 1), (self.group, 1), tuple(arguments))
