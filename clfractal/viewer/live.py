"""Parameters that are dragged: one program for all their values, instead of compiling while a slider moves."""

from __future__ import annotations

from collections.abc import Collection

from clfractal.errors import ClfractalError
from clfractal.formulas.opencl import write_formula
from clfractal.scene.model import Scene


def with_live(scene: Scene, names: Collection[str], before: Scene | None = None) -> Scene:
    """The scene with parameters of its formula made live; as it is if no one text serves all their values.

    Such a picture differs from the scene's own in the last bits only, and is shown only while something moves.

    Args:
        before: a scene whose program is there: one that has the same text needs no other program.
    """
    spec = scene.formula
    if spec.chain is not None:
        return scene
    added = tuple(name for name in names if name not in spec.live)
    if not added:
        return scene
    try:
        if before is not None and write_formula(before.chain).text == write_formula(scene.chain).text:
            return scene
        changed = scene.model_copy(update={"formula": spec.model_copy(update={"live": (*spec.live, *added)})})
        write_formula(changed.chain)
    except ClfractalError:
        return scene
    return changed
