"""What lies at one pixel of a picture."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from clfractal.camera.views import View

Triple = tuple[float, float, float]

CHANNELS = ("Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "iterations", "steps")
"""The channels that it is made of."""


@dataclass(frozen=True, slots=True)
class Probe:
    """What lies at one pixel. Numbers that describe a point are None where nothing is hit.

    Attributes:
        x, y: the pixel, from the top left of the whole picture.
        view: number of the layout's view that shows the pixel; None without a layout.
        eye: whose picture it is in a stereo scene, `left` or `right`; else None.
        hit: whether anything is there.
        point: in scene units.
        normal: of length 1, outwards; (0, 0, 0) where the channels do not know one.
        depth: along the view axis, scene units: the `focus_distance` that makes the point sharp.
        distance: from the eye (of an orthographic camera: from its plane), scene units.
        iterations: smooth escape count; of a volume the voxel's value.
        steps: distance evaluations of the ray.
    """

    x: int
    y: int
    view: int | None
    eye: str | None
    hit: bool
    point: Triple | None
    normal: Triple | None
    depth: float | None
    distance: float | None
    iterations: float | None
    steps: float

    def plain(self) -> dict[str, Any]:
        """As plain data, for JSON."""
        return asdict(self)


def probe_of(
    values: Mapping[str, float],
    camera: View,
    *,
    x: int,
    y: int,
    view: int | None = None,
    eye: str | None = None,
) -> Probe:
    """The probe of a pixel from its values of CHANNELS, seen by a camera."""
    depth, steps = float(values["Z"]), float(values["steps"])
    if not np.isfinite(depth):
        return Probe(x, y, view, eye, False, None, None, None, None, None, steps)
    point, normal = ([float(values[f"{name}.{axis}"]) for axis in "XYZ"] for name in "PN")
    distance = depth if camera.eye is None else float(np.linalg.norm(np.array(point) - camera.eye))
    return Probe(
        x,
        y,
        view,
        eye,
        True,
        (point[0], point[1], point[2]),
        (normal[0], normal[1], normal[2]),
        depth,
        distance,
        float(values["iterations"]),
        steps,
    )
