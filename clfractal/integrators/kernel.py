"""A renderer of tiles: turns a planned view into texts of programs, their data, and the order of kernels.

`kernels/integrators/passes.h` has what all their kernels have in common. A renderer does not decide
how many pixels a launch has, or where the results go.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar, Literal, TypeAlias

import numpy.typing as npt
import pyopencl as cl

from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision
from clfractal.integrators.kept import Resources
from clfractal.integrators.passes import sampling_record, slots
from clfractal.integrators.plan import PlannedView
from clfractal.integrators.records import view_records

KernelArgument: TypeAlias = npt.NDArray[Any] | cl.Buffer


# Numbers of a sent ray, of what it met, and of the object that it met (`queue.h`).
RAY_NUMBERS, MET_NUMBERS, OBJECT_NUMBERS = 12, 13, 5
# Numbers between two columns of what is kept between stages: a power of 2 apart, all would lie in one place of a cache.
STATE_PADDING = 80
# Pixels or rays of which a work-item takes those for which there is something to do (`lane_shares.h`).
LANE_SHARE = 256
BLOCK = 8
"""Side of a block of pixels that share a cone, in pixels (`kernels/integrators/tiles.h`)."""
WAVE_NUMBERS = ("first_tile", "wave", "queue_stride", "turns", "slice")
"""Arguments of a stage's kernel that follow from the launch, after those that every kernel has."""
STAGE_NUMBERS = ("next_turns", "goal", "bounce", "sample")
"""The last arguments of a stage's kernel, in the order of `kernels/integrators/arguments.h`."""


@dataclass(frozen=True, slots=True)
class ProgramText:
    """The whole text of a program, what it is for, and the names of its kernels."""

    name: str
    flat: FlatText
    kernels: tuple[str, ...]


Over: TypeAlias = Literal["pixels", "shares of pixels", "rays", "packets of rays", "shares of rays"]


@dataclass(frozen=True, slots=True)
class Stage:
    """One kernel of a launch.

    Attributes:
        kernel: its name.
        over: what each work-item does: a packet of pixels; LANE_SHARE of a tile's; some rays of the queue; a packet of
            rays; LANE_SHARE of them. With single lanes shares are of one.
        turns: rays of each pixel in the queue that it reads.
        numbers: its last arguments, see `STAGE_NUMBERS`; 0 where they are missing.
        of: what has sent the rays of the queue: pixels, or blocks of BLOCK x BLOCK pixels.
    """

    kernel: str
    over: Over = "pixels"
    turns: int = 0
    numbers: Mapping[str, int] = field(default_factory=dict)
    of: Literal["pixels", "blocks"] = "pixels"


@dataclass(frozen=True, slots=True)
class WaveNeeds:
    """What is kept of each pixel of a launch between its stages: numbers of its state, rays, and numbers of a ray and of
    what it has met.
    """

    state: int
    turns: int
    ray: int = RAY_NUMBERS
    met: int = MET_NUMBERS


class TileKernel(ABC):
    """The kernels that render tiles of one view, all with the same arguments. Nothing is compiled or uploaded here.

    The texts follow from the formula, the scene and the plan's number type and lanes, so that every executor uses the same.
    """

    name: ClassVar[str]
    waves: ClassVar[bool] = False
    """Whether pixels go from stage to stage: then the kernels have the arguments of stages, too (`arguments.h`)."""

    def __init__(self, view: PlannedView, resources: Resources) -> None:
        self.view, self.resources = view, resources
        self.scene, self.plan = view.scene, view.plan

    @property
    def precision(self) -> Precision:
        """The number type of the kernel's `real`."""
        return self.plan.precision

    @abstractmethod
    def texts(self) -> list[ProgramText]:
        """The programs."""

    def possible_texts(self) -> list[ProgramText]:
        """These, and those of all stages that other scenes with the same formula launch."""
        return self.texts()

    def stages(self, samples: tuple[int, int]) -> Iterator[Stage]:
        """The kernels of a launch, in order, for samples from the first up to the second."""
        yield Stage(self.name)

    def over(self, kernel: str) -> Over:
        """What each work-item of one of its kernels does, see `Stage`."""
        return "pixels"

    def wave_needs(self) -> WaveNeeds:
        """What pixels need between stages."""
        return WaveNeeds(0, 0)

    @abstractmethod
    def own_arguments(self) -> list[KernelArgument]:
        """The kernel's own arguments, in its order: constants, or buffers that are on the device already."""

    def arguments(self) -> list[KernelArgument]:
        """All arguments that stay the same from one launch to the next, in the kernel's order."""
        transparent = self.scene.background == "transparent"
        return [
            view_records(self.view.poses or (self.view.camera,), self.scene.image, self.plan, self.precision),
            sampling_record(
                self.scene.renderer,
                self.plan.samples,
                self.precision,
                transparent=transparent and self.has_alpha,
            ),
            *self.own_arguments(),
            slots(self.plan, self.scene.renderer),
        ]

    @property
    def has_alpha(self) -> bool:
        """Whether pixels may be partly covered, so that coverage has its own noise."""
        return True


def flat_text(entry: str, *, generated: Mapping[str, str], defines: Mapping[str, object]) -> FlatText:
    """The text of a renderer's program: as `flatten`, and the formula is the user's."""
    return flatten(entry, generated=generated, defines=defines, user=["formula.h"])
