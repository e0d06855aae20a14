"""The cut-plane renderer: its program, and what it reads."""

from __future__ import annotations

import numpy as np

from clfractal.device.orbit import ORBIT, Record, orbit_record
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Field, Precision, Struct
from clfractal.formulas.opencl import write_formula
from clfractal.optics.view import scene_view
from clfractal.renderers.escape_colors import (
    ESCAPE_COLORS,
    escape_colors_record,
    escape_defines,
    escape_palette,
)
from clfractal.renderers.plan import Plan
from clfractal.renderers.records import FILTER_WIDTHS, FILTERS, VIEW, view_record
from clfractal.renderers.surface import PALETTE_SIZE
from clfractal.renderers.worker import KernelArgument, TileWorker, channel_slots, tile_defines
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene

PLANE_SAMPLES = Struct(
    "PlaneSamples",
    [
        Field("samples", "int", 0, "samples per pixel, at most"),
        Field("min_samples", "int", 0, "samples before the noise is judged"),
        Field("noise", "real", 0, "standard error at which a pixel is done"),
        Field("filter", "int", 0, "FILTER_BOX, FILTER_TENT or FILTER_BLACKMAN_HARRIS"),
        Field("filter_width", "real", 0, "its width, pixels"),
        Field("seed", "uint", 0, "chooses the places of the samples"),
        Field("periodicity", "int", 0, "1: orbits that come back are found early"),
    ],
)


def renderer_of(scene: Scene) -> CutPlaneRenderer:
    """The cut-plane renderer's settings, of a scene that has them."""
    assert isinstance(scene.renderer, CutPlaneRenderer)
    return scene.renderer


def program_text(scene: Scene, plan: Plan) -> FlatText:
    """The whole text of the scene's program."""
    renderer = renderer_of(scene)
    formula = write_formula(scene.chain)
    structs = "".join(struct.c_text() for struct in (VIEW, ORBIT, PLANE_SAMPLES, ESCAPE_COLORS))
    defines = {
        **tile_defines(plan),
        **escape_defines(scene.chain),
        "PALETTE_SIZE": PALETTE_SIZE,
        "SMOOTH": int(renderer.colors.mode == "smooth"),
        "ADAPTIVE": int(renderer.noise is not None),
    }
    generated = {"formula.h": formula.text, "structs.h": structs}
    return flatten("cut_plane.cl", generated=generated, defines=defines, user=["formula.h"])


def samples_record(renderer: CutPlaneRenderer, samples: int, precision: Precision) -> Record:
    """How a pixel is sampled, with at most `samples` samples."""
    width = renderer.filter_width
    values = {
        "samples": samples,
        "min_samples": min(renderer.used_min_samples, samples),
        "noise": renderer.noise or 0.0,
        "filter": FILTERS.index(renderer.filter),
        "filter_width": width if width is not None else FILTER_WIDTHS[renderer.filter],
        "seed": renderer.seed,
        "periodicity": int(renderer.periodicity),
    }
    return PLANE_SAMPLES.value(precision, values)


class CutPlaneWorker(TileWorker):
    """Renders tiles of one plane through a formula's set on one device."""

    kernel_name = "cut_plane"

    def text(self) -> FlatText:
        return program_text(self.scene, self.plan)

    def records(self) -> list[KernelArgument]:
        """The constant arguments, in the kernel's order."""
        scene, plan = self.scene, self.plan
        renderer = renderer_of(scene)
        width, height = scene.image.width, scene.image.height
        iterations = renderer.iterations if renderer.iterations is not None else scene.formula.iterations
        formula = write_formula(scene.chain)
        return [
            view_record(scene_view(scene), width, height, plan.region, plan.precision),
            samples_record(renderer, plan.samples, plan.precision),
            orbit_record(scene.chain, iterations, plan.precision),
            np.array(formula.constants, plan.precision),
            escape_colors_record(renderer.colors, iterations, plan.precision),
            escape_palette(renderer.colors),
            channel_slots(plan),
        ]
