"""All that makes up a scene's set, as plain data: what is made of the set alone follows from it."""

from typing import Any

from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject


def told_set(scene: Scene) -> dict[str, Any]:
    """The formula and the place of its space that is shown, and what is joined to it."""
    joined = {}
    for name, each in scene.joined.items():
        joined[name] = each.model_dump(mode="json", exclude={"material"})
        if isinstance(each, FormulaObject):
            joined[name]["formula"] = each.formula.mapping()
    told = {"formula": scene.formula.mapping(), "joined": joined}
    return told if scene.deep is None else {**told, "deep": scene.deep.model_dump(mode="json")}
