"""What a place of any depth cannot be together with: whatever has its own place in the formula's space."""

from collections.abc import Iterator

from clfractal.elements.lights.set import SetLight
from clfractal.errors import SceneError, Where
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject


def check_deep(scene: Scene) -> None:
    """Raises SceneError, with a dotted path, for the first thing that has no place at depth."""
    if scene.deep is not None:
        for path, what in _without_place(scene):
            raise SceneError(f"{what} cannot be combined with deep; remove one of them", Where(path=path))


def _without_place(scene: Scene) -> Iterator[tuple[str, str]]:
    for name, each in scene.joined.items():
        if isinstance(each, FormulaObject):
            yield f"objects.{name}.type", "formula"
        if each.join != "union":
            yield f"objects.{name}.join", each.join
        yield f"objects.{name}", f"an object in a {scene.renderer.type}"
    for number, light in enumerate(scene.lights):
        if isinstance(light, SetLight):
            yield f"lights.{number}.type", "set"
