"""Which lights shine into fog that scatters them, and a tree of the balls on the set for it.

`kernels/shading/air_lights.h` asks them.
"""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt

from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.schema.shape import Solid
from clfractal.shading.emitters import emitters_of, may_seek
from clfractal.shading.light_tree import LUMINANCE, NODE_NUMBERS, lamps_of, tree
from clfractal.shading.set_lights import SetLights, set_lights_of

Floats = npt.NDArray[np.float32]


def scatters(scene: Scene) -> bool:
    """Whether fog sends light on to the eye."""
    fog = scene.fog
    return fog is not None and fog.scattering is not None and fog.density > 0


def has_air_sun(scene: Scene) -> bool:
    """Whether the sun of a sky shines into it."""
    environment = scene.environment
    if not scatters(scene) or environment is None or not environment.has_sun:
        return False
    return environment.rays > 0 or isinstance(scene.lighting, PathLighting)


def has_air_others(scene: Scene) -> bool:
    """Whether lamps of the tree, things that shine or balls on the set do, one of which is asked."""
    if not scatters(scene):
        return False
    lamps, on_set = lamps_of(scene), len(scene.lights) > len(lamps_of(scene).lights)
    return on_set or len(lamps.nodes) > 0 or bool(emitters_of(scene))


def seeks_in_air(scene: Scene) -> bool:
    """Whether light has to be sought there: of things that do not shine the same everywhere, whose shape is not known, or
    that the eye is within.
    """
    if not has_air_others(scene) or not may_seek(scene):
        return False
    return any(each.sought or _is_around(scene, each.thing) for each in emitters_of(scene))


def _is_around(scene: Scene, thing: int) -> bool:
    """Whether the eye is inside of an object, such as a room."""
    it = list(scene.objects.values())[thing - 1]
    return isinstance(it, Solid) and it.holds(scene.camera.position)


def air_turns(scene: Scene) -> int:
    """Rays that leave the fog before the first interaction: one to each single light, to the sun, to one of all others."""
    return lamps_of(scene).single + wide_air_turns(scene) if scatters(scene) else 0


def wide_air_turns(scene: Scene) -> int:
    """Those of them whose light has a colour of its own."""
    return int(has_air_sun(scene)) + int(has_air_others(scene))


def ball_tree(scene: Scene) -> Floats:
    """The nodes of the balls' tree, shape (n, NODE_NUMBERS), where fog asks for it; each leaf has the number of a ball."""
    return scene.derived(_ball_tree)


def _ball_tree(scene: Scene) -> Floats:
    found = set_lights_of(scene) if has_air_others(scene) else None
    return np.zeros((0, NODE_NUMBERS), np.float32) if found is None else tree_of_balls(found)


def tree_of_balls(found: SetLights) -> Floats:
    """The same of any balls."""
    balls = found.balls
    rows = np.zeros((len(balls), NODE_NUMBERS))
    rows[:, 0:4] = balls[:, 0:4]
    rows[:, 4] = math.pi * (balls[:, 4:7] @ LUMINANCE) * balls[:, 3] ** 2
    rows[:, 6:12] = 0, 0, 1, -1, 0, 1
    rows[:, 12:15], rows[:, 15:18] = balls[:, :3] - balls[:, 3:4], balls[:, :3] + balls[:, 3:4]
    rows[:, 20] = 1
    order, nodes = tree(rows)
    single = nodes[:, 18] == np.arange(len(nodes)) + 1
    nodes[single, 19] = order
    return nodes


def air_fields(scene: Scene, begin: int) -> dict[str, object]:
    """The fields of March for the fog.

    Args:
        begin: the number of the tables at which the balls' tree begins.
    """
    return {
        "air_sun": int(has_air_sun(scene)),
        "air_others": int(has_air_others(scene)),
        "ball_nodes": len(ball_tree(scene)),
        "ball_tree": begin,
    }
