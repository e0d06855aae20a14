"""The programs that fill and store a grid: one for each kernel, so that each is kept ready to run."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import pyopencl as cl

from clfractal.device import program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.kernels import Lease
from clfractal.device.launch import run_in_parts
from clfractal.device.orbit import ORBIT
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision
from clfractal.device.threads import ending_together
from clfractal.geometry.solids import Body
from clfractal.scene.volume import VolumeRenderer
from clfractal.voxels.grid import Kind
from clfractal.voxels.lattice import BRICK, EXTENT, LATTICE

Source = Literal["bits", "bricks", "slab"]

# Instead of a brick's number: all its voxels are outside, or inside as a whole.
ALL_OUTSIDE, ALL_INSIDE = -1, -2
FILL_KINDS = ("inside", "coverage", "iterations")
# Of each of them the entry point and the kernel.
_FILLS = (
    ("voxels/voxels_fill.cl", "fill_bricks"),
    ("voxels/voxels_cover.cl", "cover_bricks"),
    ("voxels/voxels_counts.cl", "count_bricks"),
)
NORMALS = ("gradient", "least_squares", "exact")
SOURCES: tuple[Source, ...] = ("bits", "bricks", "slab")
C_TYPES: dict[Kind, str] = {"byte": "uchar", "float": "float"}
# Work-items of a group that take a brick each, or a packet of nodes.
BRICK_GROUP = (1, 16)
# Where a work-item takes 9 places of a brick, one x and one y: 81 of them, in whole groups.
ALONE_ITEMS, ALONE_GROUP = 96, (32, 1)
NODE_POINTS = 64
# Packets of a work-item side by side, where packets have lanes: as in `kernels/voxels/voxels.h`.
PACKETS = 2

_BUFFER = Argument("buffer", 8192)
_INT = Argument("scalar", dtype="int32")
_FLOAT = Argument("scalar", dtype="float32")


@dataclass(frozen=True, slots=True)
class Recipe:
    """A program to build: its entry file, defines and generated texts, its kernel, and the groups that it runs in."""

    entry: str
    kernel: str
    defines: dict[str, object]
    precision: Precision
    texts: Mapping[str, str]
    items: int
    group: tuple[int, int]
    arguments: tuple[Argument, ...]


@dataclass(frozen=True, slots=True)
class Built:
    """A program's kernel, which is this object's as long as it is kept, and how it is launched."""

    kernel: cl.Kernel
    items: int
    group: tuple[int, int]
    build_ms: float
    lease: Lease

    def run(
        self, device: Device, doing: str, arguments: Sequence[Any], first: int, count: int, **settings: Any
    ) -> float:
        """Sets the kernel's arguments and runs it over `count` bricks or packets; gives milliseconds on the device.

        Args:
            first: the argument that tells a part's first one; this and `settings` as of `run_in_parts`.
        """
        with device.failures(doing):
            self.kernel.set_args(*arguments)
        return run_in_parts(
            device,
            self.kernel,
            first,
            count,
            doing=doing,
            items=self.items,
            group=self.group,
            **settings,
        )


def build_all(
    device: Device,
    recipes: Sequence[Recipe],
    on_compile: Callable[[str], None] | None = None,
    stopped: Callable[[], bool] | None = None,
) -> list[Built]:
    """Builds programs, beside each other where they have to be compiled.

    Raises:
        KernelBuildError: a program does not compile.
        DeviceError: the driver failed.
        Stopped: `stopped`, which is asked from other threads, answered True.
    """
    announced: list[str] = []

    def announce(line: str) -> None:
        if on_compile is not None and not announced:
            announced.append(line)
            on_compile(line)

    def build(recipe: Recipe) -> Built:
        text = program_text(recipe)
        warm = Warm(recipe.kernel, (recipe.items, recipe.group[1]), recipe.group, recipe.arguments)
        flags = program.math_flags(recipe.precision)
        built = program.build(
            device,
            text.text,
            flags=flags,
            sources=text.sources,
            warm=[warm],
            on_compile=announce,
            stopped=lambda: ended() or (stopped is not None and stopped()),
        )
        lease = Lease(device, [(built, (recipe.kernel,))])
        return Built(lease.kernel(recipe.kernel), recipe.items, recipe.group, built.build_ms, lease)

    with ending_together(max(len(recipes), 1)) as (pool, ended):
        # (One alone is built in this thread.)
        return list(map(build, recipes) if len(recipes) == 1 else pool.map(build, recipes))


def takes_parts(device: Device) -> bool:
    """Whether work-items take parts of bricks where they are stored: vectors of 16 numbers would fill a GPU's memory."""
    return device.info.kind == "gpu"


def program_text(recipe: Recipe) -> FlatText:
    """The whole text of a program."""
    structs = ORBIT.c_text() + LATTICE.c_text() if recipe.texts else EXTENT.c_text()
    generated = {"structs.h": structs, **recipe.texts}
    return flatten(recipe.entry, generated=generated, defines=recipe.defines, user=["formula.h"])


def nodes_recipe(body: Body, lanes: int, precision: Precision) -> Recipe:
    """`classify_nodes`: which nodes of the octree are outside or inside as a whole."""
    return Recipe(
        "voxels/voxels_nodes.cl",
        "classify_nodes",
        _number_defines(lanes, precision),
        precision,
        body.texts(turns=True),
        1,
        (1, max(NODE_POINTS // lanes, 1)),
        (_BUFFER, _BUFFER, _INT, _INT, _INT, *[_BUFFER] * 4),
    )


def fill_recipe(body: Body, renderer: VolumeRenderer, lanes: int, precision: Precision) -> Recipe:
    """`fill_bricks`, `cover_bricks` or `count_bricks`: the values of bricks' voxels."""
    items = BRICK**3 // max(lanes * (1 if lanes == 1 else PACKETS), 8)
    return Recipe(
        *_FILLS[FILL_KINDS.index(renderer.value)],
        _number_defines(lanes, precision),
        precision,
        body.texts(turns=True),
        items,
        (items, 1),
        (_BUFFER, _BUFFER, _INT, _BUFFER, _INT, _FLOAT, *[_BUFFER] * 4),
    )


def classify_recipe(source: Source, sample: Kind, *, alone: bool = False) -> Recipe:
    """`classify_bricks`: which bricks are outside or inside as a whole; `alone`: see `store_recipe`."""
    return Recipe(
        "voxels/voxels_classes.cl",
        "classify_bricks",
        {**_source_defines(source, sample, alone), "RADIUS": 0},
        "float32",
        {},
        1,
        BRICK_GROUP,
        (_BUFFER, _BUFFER, _INT, _INT, *[_BUFFER] * 3),
    )


def store_recipe(source: Source, sample: Kind, radius: int, *, alone: bool = False) -> Recipe:
    """`store_bricks`: samples and gradient normals of stored bricks.

    `alone`: a work-item takes one x and one y of a brick, for GPUs (`voxels_alone.h`); else a brick.
    """
    items, group = (ALONE_ITEMS, ALONE_GROUP) if alone else (1, BRICK_GROUP)
    defines = {
        **_source_defines(source, sample, alone),
        "RADIUS": radius,
    }
    arguments = (*[_BUFFER] * 3, _INT, _INT, _INT, *[_BUFFER] * 3)
    return Recipe("voxels/voxels_bricks.cl", "store_bricks", defines, "float32", {}, items, group, arguments)


def blocks_recipe() -> Recipe:
    """`seen_blocks`: which parts of stored bricks may be seen."""
    arguments = (_BUFFER, _BUFFER, *[_INT] * 4, _FLOAT)
    return Recipe("voxels/voxels_blocks.cl", "seen_blocks", {}, "float32", {}, 1, BRICK_GROUP, arguments)


def ranges_recipe() -> Recipe:
    """`brick_ranges`: the least and the largest sample of stored bricks."""
    arguments = (_BUFFER, _BUFFER, *[_INT] * 4)
    return Recipe("voxels/voxels_blocks.cl", "brick_ranges", {}, "float32", {}, 1, BRICK_GROUP, arguments)


def normals_recipe(body: Body, lanes: int, precision: Precision) -> Recipe:
    """`refine_normals`: normals of samples at the surface by `least_squares` or `exact`."""
    return Recipe(
        "voxels/voxels_normals.cl",
        "refine_normals",
        _number_defines(lanes, precision),
        precision,
        body.texts(turns=True),
        1,
        (1, 1),
        (_BUFFER, _BUFFER, _INT, _INT, _INT, *[_BUFFER] * 4),
    )


def _number_defines(lanes: int, precision: Precision) -> dict[str, object]:
    return {"LANES": lanes, "REAL_IS_DOUBLE": int(precision == "float64")}


def _source_defines(source: Source, sample: Kind, alone: bool) -> dict[str, object]:
    return {
        "ALONE": int(alone),
        **{f"SOURCE_{name.upper()}": number for number, name in enumerate(SOURCES)},
        "SOURCE": SOURCES.index(source),
        "ALL_OUTSIDE": f"({ALL_OUTSIDE})",
        "ALL_INSIDE": f"({ALL_INSIDE})",
        "SAMPLE": C_TYPES[sample],
    }
