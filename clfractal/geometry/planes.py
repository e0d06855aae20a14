"""Cut planes that stand in the picture of an object, as `kernels/geometry/planes.h` reads them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.orbit import Record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.geometry.faces import FACES
from clfractal.scene.checks import used_boxes
from clfractal.scene.cut_plane import CutPlane, CutPlaneRenderer, EscapeColors
from clfractal.scene.model import Scene
from clfractal.scene.rectangle import Placed, moved
from clfractal.scene.volume import VolumeRenderer
from clfractal.shading.escape_colors import ESCAPE_COLORS, escape_colors_values, escape_palette
from clfractal.shading.maps import MappedMaterials

CUT_PLANE = Struct(
    "CutPlane",
    [
        Field("center", "real", 3, "its middle, scene units"),
        Field("normal", "real", 3, "length 1; what lies on this side is in front"),
        Field("side", "real", 3, "to its right, length 1"),
        Field("up", "real", 3, "to its top, length 1"),
        Field("half_width", "real", 0, "scene units"),
        Field("half_height", "real", 0, "scene units"),
        Field("opacity", "real", 0, "of the quad outside the set"),
        Field("inside_opacity", "real", 0, "of the quad in the set"),
        Field("zoom", "real", 0, "the formula is evaluated at zoom_origin + zoom * point"),
        Field("zoom_origin", "real", 3, "scene units"),
        Field("cut", "int", 0, "1: the part of the set in front is removed"),
        Field("objects", "int", 2, "a bit for each object: that of one beside the set is removed likewise"),
        Field("material", "int", 0, "the number of its faces' material along paths; -1: they are matt"),
        Field("smooth", "int", 0, "1: smooth counts"),
        Field("periodicity", "int", 0, "1: orbits that come back are found early"),
        Field("iterations", "int", 0, "most applications of the formula"),
        *ESCAPE_COLORS,
    ],
    kinds=[("FACES", FACES)],
)


def all_planes(scene: Scene) -> Iterator[tuple[CutPlane, Placed]]:
    """Every plane of a scene, those of a stack one by one."""
    for plane in scene.cut_planes:
        for number in range(plane.count):
            yield plane, moved(plane.plane.placed, normal=number * plane.spacing)


def plane_count(scene: Scene) -> int:
    """How many planes stand in the picture."""
    return sum(1 for _ in all_planes(scene))


def has_faces(scene: Scene) -> bool:
    """Whether any plane cuts something, of which faces may be seen."""
    return any(plane.cut for plane in scene.cut_planes)


def plane_records(scene: Scene, precision: Precision) -> npt.NDArray[Any]:
    """The planes, one record each."""
    zoom, origin = zoom_of(scene)
    materials = MappedMaterials(scene).face_numbers
    rows = [
        {
            **_shown(placed, plane.colors, _iterations(scene, plane)),
            "opacity": plane.opacity,
            "inside_opacity": plane.opacity if plane.inside_opacity is None else plane.inside_opacity,
            "zoom": zoom,
            "zoom_origin": origin,
            "cut": int(plane.cuts_set),
            "objects": _cut_objects(scene, plane),
            "material": materials.get(plane.material or "", -1),
        }
        for plane, placed in all_planes(scene)
    ]
    return CUT_PLANE.array(precision, rows)


def only_plane(renderer: CutPlaneRenderer, iterations: int, precision: Precision) -> Record:
    """The plane of a picture that shows nothing else, with counts up to `iterations`."""
    alone = {
        "opacity": 1,
        "inside_opacity": 1,
        "zoom": 1,
        "zoom_origin": (0, 0, 0),
        "cut": 0,
        "objects": (0, 0),
        "material": -1,
    }
    shown = _shown(renderer.plane.placed, renderer.colors, iterations)
    return CUT_PLANE.array(precision, [{**shown, **alone, "periodicity": int(renderer.periodicity)}])


def _shown(placed: Placed, colors: EscapeColors, iterations: int) -> dict[str, object]:
    """Where a plane stands, and what it shows."""
    return {
        "center": placed.center,
        "normal": placed.normal,
        "side": placed.side,
        "up": placed.up,
        "half_width": placed.width / 2,
        "half_height": placed.height / 2,
        "smooth": int(colors.mode == "smooth"),
        "periodicity": 1,
        "iterations": iterations,
        **escape_colors_values(colors, iterations),
    }


def plane_palettes(scene: Scene) -> npt.NDArray[np.float32]:
    """The palettes of all planes, shape (planes, 256, 3), linear Rec. 709."""
    return np.stack([escape_palette(plane.colors) for plane, _ in all_planes(scene)])


def _cut_objects(scene: Scene, plane: CutPlane) -> tuple[int, int]:
    """The objects beside the set that a plane cuts, 32 bits in each number."""
    words = [0, 0]
    for index, name in enumerate(scene.objects):
        if name in plane.cut_objects and name not in scene.joined:
            words[index // 32] |= 1 << index % 32
    low, high = (word - (word >> 31 << 32) for word in words)
    return low, high


def _iterations(scene: Scene, plane: CutPlane) -> int:
    return plane.iterations if plane.iterations is not None else scene.formula.iterations


def zoom_of(scene: Scene) -> tuple[float, npt.NDArray[np.float64]]:
    """From the picture to where the formula is evaluated: a factor, and what is added."""
    if not isinstance(scene.renderer, VolumeRenderer):
        return 1.0, np.zeros(3)
    shown, filled = used_boxes(scene, scene.renderer)
    zoom = 1 / scene.renderer.magnification
    return zoom, np.array(filled.center) - zoom * np.array(shown.center)
