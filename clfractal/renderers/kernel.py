"""A renderer of tiles: turns a planned view into the text of a program and the program's data.

`kernels/passes.h` has what all their kernels have in common. A renderer does not decide
how its kernel is launched, or where the results go.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, TypeAlias

import numpy.typing as npt
import pyopencl as cl

from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Precision
from clfractal.renderers.passes import sampling_record, slots
from clfractal.renderers.plan import PlannedView
from clfractal.renderers.records import view_record
from clfractal.renderers.resources import Resources

KernelArgument: TypeAlias = npt.NDArray[Any] | cl.Buffer


class TileKernel(ABC):
    """A kernel that renders tiles of one view. Nothing is compiled or uploaded here.

    The text follows from the formula, the scene and the plan's number type and lanes, so that every executor uses the same.
    """

    name: ClassVar[str]

    def __init__(self, view: PlannedView, resources: Resources) -> None:
        self.view, self.resources = view, resources
        self.scene, self.plan = view.scene, view.plan

    @property
    def precision(self) -> Precision:
        """The number type of the kernel's `real`."""
        return self.plan.precision

    @abstractmethod
    def text(self) -> FlatText:
        """The whole text of the program."""

    @abstractmethod
    def own_arguments(self) -> list[KernelArgument]:
        """The kernel's own arguments, in its order: constants, or buffers that are on the device already."""

    def arguments(self) -> list[KernelArgument]:
        """All arguments that stay the same from one launch to the next, in the kernel's order."""
        image, transparent = self.scene.image, self.scene.background == "transparent"
        return [
            view_record(
                self.view.camera,
                image.width,
                image.height,
                self.plan,
                self.precision,
                footprint=self.footprint,
            ),
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
    def footprint(self) -> int:
        """How many of the picture's pixels a ray's cone is wide."""
        return 1

    @property
    def has_alpha(self) -> bool:
        """Whether pixels may be partly covered, so that coverage has its own noise."""
        return True


def flat_text(entry: str, *, generated: Mapping[str, str], defines: Mapping[str, object]) -> FlatText:
    """The text of a renderer's program: as `flatten`, and the formula is the user's."""
    return flatten(entry, generated=generated, defines=defines, user=["formula.h"])
