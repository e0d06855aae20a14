"""How directions in space lie in a picture of everything around that leans, is turned, or is mirrored.

In the picture +z is the top, +y the middle, and +x the middle of its right half. It leans from +z to `up` the shortest
way, about x where that is -z; then it is turned about `up`, from x towards y where that is +z.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import atan2, cos, degrees, radians, sin

import numpy as np
import numpy.typing as npt

_OPPOSITE = 1e-9  # how near to -1 the z of -z is

Doubles = npt.NDArray[np.float64]


def in_picture(up: Sequence[float], rotation: float, mirrored: bool) -> Doubles:
    """The matrix from directions in space to those in a picture.

    Args:
        up: where the picture's top is, of any length above 0.
        rotation: about `up`, degrees.
        mirrored: whether left and right of the picture change places.
    """
    mirror = np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0])
    return np.asarray(mirror @ about_z(rotation).T @ _leaning(up).T)


def lying(matrix: Doubles) -> tuple[tuple[float, float, float], float, bool]:
    """The up, rotation and mirrored for which a matrix is `in_picture`; it turns space, and may mirror it."""
    mirrored = bool(np.linalg.det(matrix) < 0)
    turning = np.diag([-1.0 if mirrored else 1.0, 1.0, 1.0]) @ matrix
    x, y, z = (float(each) for each in turning[2])
    turned = turning @ _leaning((x, y, z))
    return (x, y, z), degrees(atan2(turned[0, 1], turned[0, 0])), mirrored


def about_z(angle: float) -> Doubles:
    """The matrix that turns space about z, degrees."""
    c, s = cos(radians(angle)), sin(radians(angle))
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _leaning(up: Sequence[float]) -> Doubles:
    """The matrix that turns +z to a direction the shortest way (Rodrigues' formula); to -z about x."""
    x, y, z = np.array(up, np.float64) / np.linalg.norm(up)
    if z < -1 + _OPPOSITE:
        return np.diag([1.0, -1.0, -1.0])
    cross = np.array([[0.0, 0.0, x], [0.0, 0.0, y], [-x, -y, 0.0]])
    return np.asarray(np.eye(3) + cross + cross @ cross / (1 + z))
