"""The camera and the size of the picture of a settings file.

Space is ours: right-handed, z up. The camera looks from `camera` to `target`, `camera_top` is up in the picture; the
angles `camera_rotation` say the same once more. `fov` is the height of the picture at the distance 1, not an angle.
"""

from __future__ import annotations

import math
from typing import Any

from clfractal.exchange.settings import Section, Settings

PROJECTIONS = {1: "fish eye", 2: "equirectangular", 3: "fish eye, cut"}
_WORDS = ("three_point", "fish_eye", "equirectangular", "fish_eye_cut")
"""As old files have it."""
_LENS = 0.0015
SENSOR = 0.024
"""Height of our sensor by default."""
MOST_PIXELS = 65_536
NEAR = 1e-6
"""A target that is nearer than this part of the camera's distance from the origin is moved away, along the view: rays go
through a plane there, whose places would be rounded to parts of pixels. Deep zooms have targets 1e-13 away."""


def view_of(settings: Settings, remarks: list[str]) -> dict[str, Any]:
    """The sections `image` and `camera`.

    Raises:
        FileError: a value is none of its kind.
    """
    main = settings.main
    main.without(("camera_distance_to_target", "camera_rotation"))
    return {"image": _image(main, remarks), "camera": _camera(main, remarks)}


def _image(main: Section, remarks: list[str]) -> dict[str, int]:
    size = {"width": main.whole("image_width", 800), "height": main.whole("image_height", 600)}
    largest = max(size.values())
    if largest > MOST_PIXELS:
        remarks.append(f"image: {size['width']} x {size['height']} pixels are made smaller")
        size = {side: value * MOST_PIXELS // largest for side, value in size.items()}
    return {side: max(value, 1) for side, value in size.items()}


def _camera(main: Section, remarks: list[str]) -> dict[str, Any]:
    position = main.vector("camera", (3, -6, 2))
    target = main.vector("target")
    up = main.vector("camera_top", (-0.1277753, 0.2555506, 0.958314))
    fov = main.number("fov", 1.0)
    word = main.text("perspective_type")
    kind = _WORDS.index(word) if word in _WORDS else main.whole("perspective_type", 0)
    if kind != 0:
        name = PROJECTIONS.get(kind, str(kind))
        remarks.append(f"perspective_type: {name} is not there yet; the picture is in perspective")
    away = math.dist(position, target)
    if away == 0:
        remarks.append("target: is where the camera is; the camera looks along y")
        target = (position[0], position[1] + 1, position[2])
    elif away < NEAR * math.hypot(*position):
        farther = NEAR * math.hypot(*position) / away
        target = tuple(a + farther * (b - a) for a, b in zip(position, target, strict=True))
    if _parallel(up, [a - b for a, b in zip(target, position, strict=True)]):
        remarks.append("camera_top: is along the view; z is up")
        up = (
            (0.0, 0.0, 1.0)
            if not _parallel((0.0, 0.0, 1.0), [a - b for a, b in zip(target, position, strict=True)])
            else (0.0, 1.0, 0.0)
        )
    degrees = math.degrees(2 * math.atan(fov / 2)) if fov > 0 else 45.0
    if kind in PROJECTIONS:
        degrees = 90.0
    return {
        "position": list(position),
        "target": list(target),
        "up": list(up),
        "fov": min(max(degrees, 1e-6), 179.0),
        **_lens(main, fov),
    }


def _lens(main: Section, fov: float) -> dict[str, float]:
    """Depth of field: their lens has a radius of 0.0015 `DOF_radius` times the distance that is sharp."""
    focus, radius = main.number("DOF_focus", 6.0), main.number("DOF_radius", 10.0)
    lens = _LENS * radius * focus
    if not main.flag("DOF_enabled", False):
        main.without(main.beginning("DOF_"))
        return {}
    main.without(("DOF_monte_carlo", "DOF_samples", "DOF_HDR"))
    if lens <= 0 or fov <= 0 or focus <= 0:
        return {}
    f_number = SENSOR / fov / (2 * lens)
    return {"f_number": min(max(f_number, 0.01), 1e6), "focus_distance": min(focus, 1e6)}


def is_mirrored(settings: Settings) -> bool:
    """Whether the picture is upside down: that of old files, where an axis of space pointed the other way.

    A picture that is mirrored is one of mirrored space: z points the other way in our scene, see `placing.mirror`.
    """
    return settings.main.flag("legacy_coordinate_system", False)


def _parallel(one: Any, other: Any) -> bool:
    cross = (
        one[1] * other[2] - one[2] * other[1],
        one[2] * other[0] - one[0] * other[2],
        one[0] * other[1] - one[1] * other[0],
    )
    return math.hypot(*cross) <= 1e-9 * math.hypot(*one) * math.hypot(*other)
