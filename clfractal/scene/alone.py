"""What needs a formula, and is refused in a scene of `formula: none` without formulas among its objects."""

from collections.abc import Iterator

from clfractal.elements.lights.set import SetLight
from clfractal.errors import SceneError, Where
from clfractal.scene.model import Scene
from clfractal.scene.renderer import Renderer
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.mapped import maps_of
from clfractal.schema.quantity import colorings
from clfractal.schema.shape import Joined


def check_alone(scene: Scene) -> None:
    """Raises SceneError, with a dotted path, for what needs a formula where there is none."""
    if not scene.chain.alone:
        return
    renderer, name = scene.renderer, scene.chain.first.formula.name
    if not isinstance(renderer, SurfaceRenderer) and not _shows_a_file(renderer):
        message = f"{name} is for surface renderers, got a {renderer.type}; name a formula"
        raise SceneError(message, Where(path="formula"))
    if scene.has_set:
        return
    for path, what, way_out in _asking(scene):
        raise SceneError(f"{what} a formula, and the scene's is {name}; {way_out}".lstrip(), Where(path=path))


def _shows_a_file(renderer: Renderer) -> bool:
    return isinstance(renderer, VolumeRenderer) and renderer.file is not None


def _asking(scene: Scene) -> Iterator[tuple[str, str, str]]:
    """Where anything needs the formula, what that is and does, and what to do about it."""
    if scene.coloring.kind.needs_set():
        *others, last = (kind.tag for kind in colorings() if not kind.needs_set())
        yield "coloring.by", f"{scene.coloring.by} needs", f"use {', '.join(others)} or {last}"
    for name, material in scene.materials.items():
        for key, each in maps_of(material):
            if each.kind is not None and each.kind.needs_set():
                yield f"materials.{name}.{key}.by", f"{each.by} needs", "use another quantity, or a texture"
    for key, given in (("deep", scene.deep), ("glow", scene.glow), ("mist", scene.mist)):
        if given is not None:
            yield key, "needs", "remove it"
    for number, light in enumerate(scene.lights):
        if isinstance(light, SetLight):
            yield f"lights.{number}.type", "set needs", "remove this light"
    for number, plane in enumerate(scene.cut_planes):
        for key, opacity in (("opacity", plane.opacity), ("inside_opacity", plane.inside_opacity)):
            if opacity is not None and opacity > 0:
                yield f"cut_planes.{number}.{key}", "shows counts of", "0 only cuts objects"
    for name, item in scene.objects.items():
        if isinstance(item, Joined) and item.join != "union":
            yield f"objects.{name}.join", f"{item.join} needs", "remove it, and the object stands for itself"
