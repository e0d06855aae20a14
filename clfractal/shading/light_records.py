"""The record of a light, and how a scene's lights fill it; what differs from kind to kind, classes say."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping

import numpy as np
import numpy.typing as npt

from clfractal.device.orbit import Record
from clfractal.device.source import kinds
from clfractal.device.structs import Field, Precision, Struct
from clfractal.elements.lights.directional import DirectionalLight
from clfractal.scene.model import Scene
from clfractal.schema.kinds import members
from clfractal.schema.light import SingleLight
from clfractal.schema.record import all_numbers
from clfractal.shading.air_lights import ball_tree
from clfractal.shading.emitter_tree import shining_of
from clfractal.shading.light_tree import lamps_of, single_lights

Floats = npt.NDArray[np.float32]
LIGHT_KINDS = kinds("elements/lights")
_SINGLE = [kind for kind in members("lights") if issubclass(kind, SingleLight)]
_NUMBERS = all_numbers(kind.numbers for kind in _SINGLE)

LIGHT = Struct(
    "Light",
    [
        Field(
            "vector", "real", 3, "of a far light where it travels to, length 1; else its place, scene units"
        ),
        Field("color", "real", 3, "linear Rec. 709"),
        Field("intensity", "real", 0, "factor on the colour"),
        Field("kind", "int", 0, "LIGHT_"),
        Field("far", "int", 0, "1: infinitely far away"),
        Field("seen", "int", 0, "1: it has a place and a size, and rays meet it"),
        Field("inverse_square", "int", 0, "1: weakens with the square of the distance"),
        Field("shadow", "int", 0, "1: blocked by the set"),
        Field("spread", "real", 0, "1 - cos of half its angular size"),
        Field("rays", "int", 0, "shadow rays of a shot"),
        Field("share", "real", 0, "one over that"),
        Field("visible", "int", 0, "1: the eye sees it"),
        Field(
            "table", "int", 0, "where what it has read of a file begins among the tables; below 0: nowhere"
        ),
        *(Field(each.name, each.type, each.count, each.meaning) for each in _NUMBERS),
    ],
)


def light_rays(scene: Scene) -> int:
    """Most shadow rays of a shot that a light has."""
    return max((light.used_rays for light in single_lights(scene)), default=1)


def _light_row(light: SingleLight, table: int) -> Mapping[str, object]:
    row: dict[str, object] = {
        **{each.name: each.nothing for each in _NUMBERS},
        "color": light.used_color,
        "intensity": light.intensity,
        "kind": LIGHT_KINDS[light.tag],
        "far": int(light.stands_at is None),
        "seen": int(light.is_seen),
        "inverse_square": 0,
        "shadow": int(light.shadow),
        "spread": 0.0,
        "rays": light.used_rays,
        "share": 1 / light.used_rays,
        "visible": 0,
        "table": table,
        **light.packed(),
    }
    vector = np.array(row["vector"], float)
    row["vector"] = vector / np.linalg.norm(vector) if light.stands_at is None else vector
    return row


def light_records(scene: Scene, precision: Precision, begin: int = 0) -> Record:
    """The lights, and a white one that stands for those on the set (and for none, since no buffer is empty).

    Args:
        begin: how many numbers stand before those of `light_tables`.
    """
    places = {}
    for key, table in scene.light_tables.items():
        places[key] = begin
        begin += table.numbers.size
    rows = [
        _light_row(light, -1 if light.reads is None else places[light.tag, light.reads])
        for light in (*lamps_of(scene).lights, DirectionalLight())
    ]
    return LIGHT.array(precision, rows)


def light_tables(scene: Scene) -> Floats:
    """What the lights have read of files, one after the other, and the nodes of trees: of lamps, balls, and what shines."""
    tables = [table.numbers for table in scene.light_tables.values()]
    return np.concatenate([*tables, *(nodes.reshape(-1) for nodes in _trees(scene))])


def _trees(scene: Scene) -> tuple[Floats, Floats, Floats]:
    return lamps_of(scene).nodes, ball_tree(scene), shining_of(scene).nodes


def tree_begins(scene: Scene) -> int:
    """The number of `light_tables` at which the nodes begin."""
    return sum(table.numbers.size for table in scene.light_tables.values())


def ball_tree_begins(scene: Scene) -> int:
    """The same of the balls' tree."""
    return tree_begins(scene) + lamps_of(scene).nodes.size


def emitter_tree_begins(scene: Scene) -> int:
    """The same of the tree of what shines."""
    return ball_tree_begins(scene) + ball_tree(scene).size


def has_tables(scene: Scene) -> bool:
    """Whether `light_tables` has any numbers."""
    return bool(scene.light_tables) or any(nodes.size for nodes in _trees(scene))


def tables_key(scene: Scene) -> str:
    """A text that differs for different tables."""
    digests = (table.digest for table in scene.light_tables.values())
    return " ".join(["lights", *digests, *map(digest_of, _trees(scene))])


def digest_of(nodes: Floats) -> str:
    """A text that differs for different nodes."""
    return hashlib.sha256(nodes.tobytes()).hexdigest()
