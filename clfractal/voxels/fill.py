"""Filling a grid with a formula's values, its normals, and its octree, on a device."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.device.watched import Watched
from clfractal.geometry.solids import Body
from clfractal.scene.checks import used_boxes
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer
from clfractal.voxels import programs
from clfractal.voxels.brick_store import Evaluated, store
from clfractal.voxels.grid import SAMPLE_BYTES, Grid, GridStats, Kind
from clfractal.voxels.lattice import Lattice, Places, all_places, lattice_of, unpack_places
from clfractal.voxels.octree import EMPTY, FULL, Descent, descend
from clfractal.voxels.pool import upload

# Packets of one application that a core does in a second, at the least: chooses how long the first launches are.
SLOW_APPLICATIONS = 1e7
# Part of a distance that is safe to march by which is safe to leave out a node by. Chosen so that of 20 grids of formulas
# and zooms none differs from its brute fill in a voxel of a million.
NODE_SAFETY = 0.55
# Voxels a side of an octant of a brick.
OCTANT = 4


ProgressCallback = Callable[[str, int, int], None]
"""Told the progress of a fill: the stage (`octree`, `fill`, `store` or `normals`), how many bricks of it are done, and of
how many."""


def fill_grid(
    scene: Scene,
    renderer: VolumeRenderer,
    device: Device,
    *,
    lanes: int,
    precision: Precision,
    on_compile: Callable[[str], None] | None = None,
    progress: ProgressCallback | None = None,
    token: CancelToken | None = None,
) -> Grid:
    """The grid of a scene's set in the renderer's last box, with its values, normals and octree.

    `octree` skips regions that distances show to be outside; `brute` evaluates every voxel. Values of kind
    `iterations` know no empty bricks: all are evaluated and stored.

    Args:
        scene: has the formula, and objects that are joined to it.
        renderer: what is filled and how (its `file` is not looked at).
        device: where.
        lanes: points of a packet.
        precision: number type of points and orbits; normals by differences are float32.
        on_compile: told a line if programs have to be compiled first.
        progress: called after each launch; an exception in it, or a KeyboardInterrupt, ends the fill.
        token: ends it between two launches.

    Raises:
        DeviceError: status 2, told before anything is evaluated, if the grid does not fit; status 3, the device failed.
        KernelBuildError: a program does not compile.
        Stopped: the token was set.
    """
    lattice = lattice_of(used_boxes(scene, renderer)[1], renderer.resolution)
    check_grid(lattice, renderer, device)
    return _Filler(scene, renderer, device, lattice, lanes, precision, progress, token).run(on_compile)


def check_grid(lattice: Lattice, renderer: VolumeRenderer, device: Device) -> None:
    """Refuses a grid that cannot fit, whatever it contains.

    Raises:
        DeviceError: status 2, with the least memory needed and the memory available.
    """
    x, y, z = lattice.shape
    what = f"a grid of {x} x {y} x {z} voxels"
    evaluated = int(np.prod(lattice.evaluated_bricks, dtype=object))
    bricks = int(np.prod(lattice.bricks, dtype=object))
    per_brick = 8 + 4 + 4
    largest = 4 * evaluated
    if renderer.value == "iterations":
        sample = SAMPLE_BYTES[renderer.store]
        per_brick += 512 * sample + 736 * (sample + 4)
        largest = 512 * sample * evaluated
    elif renderer.fill == "brute":
        per_voxel = 512 * SAMPLE_BYTES[renderer.store] if renderer.value == "coverage" else 64
        per_brick += per_voxel
        largest = per_voxel * evaluated
    device.check_memory(per_brick * evaluated, what, largest=largest)
    device.check_memory(0, what, largest=4 * bricks)


def shows_outside(renderer: VolumeRenderer) -> bool:
    """Whether a voxel that is outside, of value 0, can be seen."""
    return renderer.transfer.opacity is not None and renderer.transfer.shows(0.0)


class _Filler:
    """One fill: the constants on the device, and the stages."""

    def __init__(
        self,
        scene: Scene,
        renderer: VolumeRenderer,
        device: Device,
        lattice: Lattice,
        lanes: int,
        precision: Precision,
        progress: ProgressCallback | None,
        token: CancelToken | None,
    ) -> None:
        self.scene, self.renderer, self.device, self.lattice = scene, renderer, device, lattice
        self.lanes, self.precision, self.progress, self.token = lanes, precision, progress, token
        self.sub_points = renderer.sub_points if renderer.value == "coverage" else 1
        self.body = Body.of(scene)
        self.decided = 0  # octants
        self.stats = GridStats()

    def run(self, on_compile: Callable[[str], None] | None) -> Grid:
        renderer, body = self.renderer, self.body
        whole = renderer.value == "iterations"
        octree = renderer.fill == "octree" and not whole
        sample: Kind = "byte" if renderer.value == "inside" else renderer.store
        source: programs.Source = "bits" if renderer.value == "inside" else "bricks"
        alone = programs.takes_parts(self.device)
        recipes = [
            programs.fill_recipe(body, renderer, self.lanes, self.precision),
            programs.store_recipe(source, sample, renderer.normal_radius, alone=alone),
        ]
        if octree:
            recipes.append(programs.nodes_recipe(body, self.lanes, self.precision))
        if not whole:
            recipes.append(programs.classify_recipe(source, sample, alone=alone))
        if renderer.normals != "gradient":
            recipes.append(programs.normals_recipe(body, self.lanes, self.precision))
        built = programs.build_all(self.device, recipes, on_compile, self.token)
        kernels = {recipe.kernel: each for recipe, each in zip(recipes, built, strict=True)}
        start = time.perf_counter()
        self._upload()
        every = self.lattice.evaluated_bricks
        if octree:
            descent = self._descend(kernels["classify_nodes"])
        else:
            descent = Descent(all_places(every), np.zeros(0, np.uint64), 0)
        self.stats = replace(self.stats, nodes=descent.looked)
        evaluated = self._fill(built[0], kernels.get("classify_nodes"), descent, source, sample)
        grid = store(
            self.device,
            self.lattice,
            evaluated,
            kept=renderer.store,
            range=(0.0, float(self.scene.formula.iterations)) if whole else (0.0, 1.0),
            classify=kernels.get("classify_bricks"),
            keep=kernels["store_bricks"],
            stats=self.stats,
            tell=self._tell,
            show_outside=shows_outside(renderer),
            token=self.token,
            refine=kernels.get("refine_normals"),
            constants=self.constants,
        )
        stats = replace(
            grid.stats,
            build_ms=sum(each.build_ms for each in built),
            wall_ms=1e3 * (time.perf_counter() - start),
        )
        return replace(grid, stats=stats)

    def _upload(self) -> None:
        body, precision = self.body, self.precision
        # Of several solids each one has its own.
        safe = 1.0 if self.scene.joined else min(body.chain.step_scale, 1.0)
        records: list[npt.NDArray[Any]] = [
            self.lattice.axes(precision, self.sub_points),
            self.lattice.record(
                precision, self.sub_points, NODE_SAFETY * safe, exact_normals=self.renderer.normals == "exact"
            ).reshape(1),
            body.constants(precision),
        ]
        # Watched, because one launch of long orbits may take seconds.
        self.orbit = Watched(self.device, body.records(precision))
        axes, box, constants = (upload(self.device, record) for record in records)
        self.constants = [axes, box, self.orbit.buffer, constants]
        packets = 512 / self.lanes * self.sub_points**3
        units = max(self.device.info.compute_units, 1)
        bricks = 0.05 * units * SLOW_APPLICATIONS / (packets * max(body.iterations, 1))
        self.first_part = int(np.clip(bricks, units, 2048))

    def _descend(self, classify_nodes: programs.Built) -> Descent:
        def classify(nodes: Places, cells: int) -> npt.NDArray[np.uint8]:
            packets = -(-len(nodes) // self.lanes)
            padded = np.zeros(packets * self.lanes, np.uint64)
            padded[: len(nodes)] = nodes
            result = np.empty(len(padded), np.uint8)
            if packets:
                classes = self._look(classify_nodes, upload(self.device, padded), packets, cells)
                cl.enqueue_copy(self.device.queue, result, classes)
            self._tell("octree", len(nodes), len(nodes))
            return result[: len(nodes)]

        return descend(self.lattice, classify)

    def _look(self, classify_nodes: programs.Built, nodes: cl.Buffer, packets: int, cells: int) -> cl.Buffer:
        """The classes of nodes, one byte each, on the device."""
        flags = self.device.buffer(packets * self.lanes, "nodes")
        milliseconds = classify_nodes.run(
            self.device,
            "checking the octree's nodes",
            [flags, nodes, *map(np.int32, (0, packets, cells)), *self.constants],
            2,
            packets,
            first_part=8 * self.first_part,
            token=self.token,
            watched=[self.orbit],
        )
        self.stats = replace(self.stats, octree_ms=self.stats.octree_ms + milliseconds)
        return flags

    def _octants(self, classify_nodes: programs.Built | None, places: Places, bricks: cl.Buffer) -> cl.Buffer:
        """Of each brick two bytes, on the device: which of its octants hold nothing, and which nothing else."""
        packets = -(-8 * len(places) // self.lanes)
        known = np.zeros((max(len(places), 1), 2), np.uint8)
        if classify_nodes is not None and packets:
            found = np.empty(packets * self.lanes, np.uint8)
            cl.enqueue_copy(self.device.queue, found, self._look(classify_nodes, bricks, packets, OCTANT))
            classes = found[: 8 * len(places)]
            for byte, kind in enumerate((EMPTY, FULL)):
                known[:, byte] = np.packbits(classes == kind, bitorder="little")
            self.stats = replace(self.stats, nodes=self.stats.nodes + len(classes))
            self.decided = int(np.count_nonzero(classes))
        return upload(self.device, known)

    def _fill(
        self,
        fill_bricks: programs.Built,
        classify_nodes: programs.Built | None,
        descent: Descent,
        source: programs.Source,
        sample: Kind,
    ) -> Evaluated:
        device, places = self.device, descent.open
        brick_bytes = 64 if source == "bits" else 512 * SAMPLE_BYTES[sample]
        samples = device.buffer(max(len(places), 1) * brick_bytes, "the voxels' values")
        bricks = upload(
            device, np.append(places, np.uint64(0))
        )  # the last packet of octants may go past the end
        known = self._octants(classify_nodes, places, bricks)
        x, y, z = self.lattice.evaluated_bricks
        numbers = np.full(x * y * z, programs.ALL_OUTSIDE, np.int32)
        at, full = unpack_places(places), unpack_places(descent.full)
        numbers[full[:, 0] + x * (full[:, 1] + y * full[:, 2])] = programs.ALL_INSIDE
        numbers[at[:, 0] + x * (at[:, 1] + y * at[:, 2])] = np.arange(len(places), dtype=np.int32)
        scale = 1.0
        if sample == "byte":
            limit = self.scene.formula.iterations if self.renderer.value == "iterations" else 1
            scale = 255.0 / max(limit, 1)
        floats = np.int32(sample == "float")
        milliseconds = fill_bricks.run(
            device,
            "filling the grid",
            [samples, bricks, np.int32(0), known, floats, np.float32(scale), *self.constants],
            2,
            len(places),
            first_part=self.first_part,
            done=lambda done: self._tell("fill", done, len(places)),
            token=self.token,
            watched=[self.orbit],
        )
        points = (8 * len(places) - self.decided) * OCTANT**3 * self.sub_points**3
        self.stats = replace(self.stats, evaluated_voxels=points, fill_ms=milliseconds)
        # What 1 is to the source: a bit, 255 of a byte, or 1 of a share.
        unit = 255.0 if source == "bricks" and sample == "byte" else 1.0
        top = 255.0 if self.renderer.store == "byte" else 1.0
        whole = unit
        if sample == "float" and self.renderer.value == "iterations":
            whole = float(self.scene.formula.iterations)
        return Evaluated(
            places,
            at,
            full,
            samples,
            bricks,
            upload(device, numbers),
            scale=1.0 if source == "bricks" else top,
            whole=whole,
            opaque=whole if self.renderer.value == "iterations" else 0.5 * whole,
        )

    def _tell(self, stage: str, done: int, total: int) -> None:
        if self.progress is not None:
            self.progress(stage, done, total)
