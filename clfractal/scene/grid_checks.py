"""Checks of volumes among a scene's objects that need their grids."""

from clfractal.errors import SceneError, Where
from clfractal.scene.grid_values import is_finite_somewhere, lacking
from clfractal.scene.model import Scene
from clfractal.scene.named_files import volumes_of
from clfractal.scene.object_checks import refuse_lights
from clfractal.scene.object_grids import PlacedGrid, placed, used_level
from clfractal.schema.base import Vector


def check_grids(scene: Scene) -> None:
    """Raises FileError or SceneError, with a dotted path, for grids of objects that cannot be read or have no such surface.

    The data are kept in the scene.
    """
    for name, each in volumes_of(scene.objects).items():
        grid = scene.grids[each.file]
        if not is_finite_somewhere(grid.values):
            raise SceneError(
                f"{each.file} {lacking(grid.values)}, so there is no value to show",
                Where(path=f"objects.{name}.file"),
            )
        if each.is_cloud:
            continue
        if each.level is not None and not grid.low < each.level <= grid.high:
            raise SceneError(
                f"must be above {grid.low:g} and at most {grid.high:g}, the ends of the grid's values, got {each.level:g}",
                Where(path=f"objects.{name}.level"),
            )
        _check_lights(scene, name, placed(each, grid), used_level(each, grid))


def _check_lights(scene: Scene, name: str, body: PlacedGrid, level: float) -> None:
    """A light within a solid reaches nothing, but where the eye is in it too."""

    def inside(point: Vector) -> bool:
        value = body.value(point)
        return value is not None and value >= level

    if not inside(scene.camera.position):
        refuse_lights(scene, name, inside)
