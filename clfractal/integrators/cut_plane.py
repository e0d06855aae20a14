"""The cut-plane renderer: its program, and the program's data."""

from __future__ import annotations

from collections.abc import Mapping

from clfractal.device.orbit import ORBIT
from clfractal.device.source import FlatText
from clfractal.geometry.planes import CUT_PLANE, only_plane
from clfractal.geometry.solids import Body
from clfractal.integrators.kernel import KernelArgument, ProgramText, TileKernel, flat_text
from clfractal.integrators.passes import SAMPLING, pass_defines
from clfractal.integrators.path_state import path_state_text
from clfractal.integrators.plan import Plan
from clfractal.integrators.records import VIEW
from clfractal.integrators.surface import PALETTE_SIZE
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.shading.escape_colors import escape_palette


def renderer_of(scene: Scene) -> CutPlaneRenderer:
    """The cut-plane renderer's settings, of a scene that has them."""
    assert isinstance(scene.renderer, CutPlaneRenderer)
    return scene.renderer


def program_text(scene: Scene, plan: Plan, formula: Mapping[str, str] | None = None) -> FlatText:
    """The whole text of the scene's program, or with another text of the formula."""
    if formula is None:
        formula = Body.of(scene).texts(turns=True)
    structs = "".join(struct.c_text() for struct in (VIEW, SAMPLING, ORBIT, CUT_PLANE))
    defines = {
        **pass_defines(plan),
        "PALETTE_SIZE": PALETTE_SIZE,
    }
    generated = {
        **formula,
        "structs.h": structs,
        "path_state.h": path_state_text(),
    }
    return flat_text("integrators/cut_plane.cl", generated=generated, defines=defines)


class CutPlaneKernel(TileKernel):
    """One plane through a formula's set, coloured by escape counts."""

    name = "cut_plane"

    @property
    def has_alpha(self) -> bool:
        return False

    def texts(self) -> list[ProgramText]:
        return [self._program()]

    def possible_texts(self) -> list[ProgramText]:
        return [self._program(formula) for formula in Body.of(self.scene).possible_texts(turns=True)]

    def _program(self, formula: Mapping[str, str] | None = None) -> ProgramText:
        return ProgramText(self.name, program_text(self.scene, self.plan, formula), (self.name,))

    def own_arguments(self) -> list[KernelArgument]:
        scene, precision = self.scene, self.precision
        renderer = renderer_of(scene)
        iterations = renderer.iterations if renderer.iterations is not None else scene.formula.iterations
        body = Body.of(scene)
        return [
            body.records(precision),
            body.constants(precision),
            only_plane(renderer, iterations, precision),
            escape_palette(renderer.colors),
        ]


KERNEL = CutPlaneKernel
