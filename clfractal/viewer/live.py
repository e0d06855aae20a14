"""Parameters that are dragged: one program for all their values, instead of compiling while a slider moves."""

from __future__ import annotations

from collections.abc import Collection

from clfractal.errors import ClfractalError
from clfractal.formulas.opencl import write_formula
from clfractal.scene.model import Scene


def with_live(scene: Scene, names: Collection[str]) -> Scene:
    """The scene with parameters of its formula made live; as it is if no one text serves all their values.

    Such a picture differs from the scene's own in the last bits only, and is shown only while something moves.
    """
    spec = scene.formula
    if spec.chain is not None:
        return scene
    added = tuple(name for name in names if name not in spec.live)
    if not added:
        return scene
    try:
        changed = scene.model_copy(update={"formula": spec.model_copy(update={"live": (*spec.live, *added)})})
        write_formula(changed.chain)
    except ClfractalError:
        return scene
    return changed
