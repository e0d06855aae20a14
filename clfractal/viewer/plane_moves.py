"""Moves of a cut plane: along and about its own axes and those of space, by fields and by a pointer.

Every move returns a valid plane: one that would leave the range of sizes and coordinates, or that is not finite, returns
the plane unchanged. A plane keeps the keys that it is written with: corners stay corners, a list of transformations gets
one more step, and a plane by its middle and normal keeps its words where they still hold.
"""

from __future__ import annotations

from math import atan2, degrees, isfinite

import numpy as np
from pydantic import ValidationError

from clfractal.camera.views import plane_view
from clfractal.errors import SceneError
from clfractal.scene.rectangle import Axis, Placed, Plane, Transform, moved, rotated, scaled
from clfractal.viewer.pointer import Size

# A plane with more steps than this is written by its middle and normal instead: pointers make a step a frame.
MOST_STEPS = 16
# Corners nearer to each other than this part of their coordinates no longer tell a right angle.
_LEAST_CORNERS = 1e-9
# A drag across the picture's smaller side turns by half a turn.
_DRAG_DEGREES = 180.0
_MOST_DEGREES = 36_000.0
_MOVES = ("move_normal", "move_side", "move_up", "scale")


def shift(plane: Plane, *, normal: float = 0.0, side: float = 0.0, up: float = 0.0) -> Plane:
    """The plane, moved along its own axes, scene units: towards its viewer, to its right, to its top."""
    steps = {"move_normal": normal, "move_side": side, "move_up": up}
    return _changed(plane, moved(plane.placed, normal=normal, side=side, up=up), steps)


def scale(plane: Plane, factor: float) -> Plane:
    """The plane, wider and higher by a factor about its middle."""
    if not (isfinite(factor) and factor > 0):
        return plane
    return _changed(plane, scaled(plane.placed, factor), {"scale": factor})


def rotate(plane: Plane, axis: Axis, angle: float) -> Plane:
    """The plane, rotated by the right-hand rule, degrees: for its own axes about its middle, for x, y and z about the
    origin of space."""
    if not isfinite(angle):
        return plane
    return _changed(plane, rotated(plane.placed, axis, angle), {f"rotate_{axis}": angle})


def rotate_in_place(plane: Plane, axis: Axis, angle: float) -> Plane:
    """As `rotate`, but about the plane's own middle for every axis."""
    turned = rotate(plane, axis, angle)
    if axis not in ("x", "y", "z") or turned is plane:
        return turned
    away = np.array(plane.placed.center) - turned.placed.center
    frame = turned.placed
    back = {name: float(away @ np.array(getattr(frame, name))) for name in ("normal", "side", "up")}
    return shift(turned, **back)


# By a pointer in the plane's own picture (that of a `cut_plane` renderer)


def pan(plane: Plane, dx: float, dy: float, size: Size) -> Plane:
    """The plane, moved so that its picture follows a drag by (dx, dy) pixels."""
    pixel = _pixel(plane, size)
    return shift(plane, side=-dx * pixel, up=dy * pixel)


def zoom_to(plane: Plane, x: float, y: float, size: Size, factor: float) -> Plane:
    """The plane, scaled by a factor (below 1 magnifies), about the point that its picture shows at (x, y), pixels."""
    if not (isfinite(factor) and factor > 0):
        return plane
    pixel, part = _pixel(plane, size), 1 - factor
    side, up = part * (x - size[0] / 2) * pixel, -part * (y - size[1] / 2) * pixel
    placed = scaled(moved(plane.placed, side=side, up=up), factor)
    return _changed(plane, placed, {"move_side": side, "move_up": up, "scale": factor})


def spin(plane: Plane, start: tuple[float, float], end: tuple[float, float], size: Size) -> Plane:
    """The plane, rotated about its normal so that its picture turns about its middle with the pointer, from `start` to
    `end`, pixels."""
    before, after = (atan2(size[1] / 2 - y, x - size[0] / 2) for x, y in (start, end))
    return rotate(plane, "normal", degrees(before - after))


def tilt(plane: Plane, dx: float, dy: float, size: Size) -> Plane:
    """The plane, rotated about its up and its side as an orbit of its viewer about its middle: what lies in front of it
    follows a drag by (dx, dy) pixels."""
    part = _DRAG_DEGREES / min(size)
    return rotate(rotate(plane, "up", -dx * part), "side", -dy * part)


# Writing a plane with the keys that it had


def _changed(plane: Plane, placed: Placed, steps: dict[str, float]) -> Plane:
    """The plane at another place, which the steps lead to; the plane itself where no plane can be there."""
    if not all(isfinite(value) for value in steps.values()):
        return plane
    if plane.transform:
        try:
            added = _added(plane.transform, steps)
            if len(added) <= MOST_STEPS:
                return plane.model_copy(update={"transform": added})
        except SceneError:
            pass  # joined steps may leave a step's range though the plane stays in its own
    try:
        if not plane.transform and plane.corners is not None and _has_corners(placed):
            return Plane.model_validate({"corners": (placed.at(0, 0), placed.at(1, 0), placed.at(0, 1))})
        return _by_middle(plane, placed)
    except ValidationError:
        return plane


def _has_corners(placed: Placed) -> bool:
    largest = max(abs(x) for x in placed.center)
    return min(placed.width, placed.height) > _LEAST_CORNERS * largest


def _by_middle(plane: Plane, placed: Placed) -> Plane:
    """The placed plane by its middle, normal and size; words of the old plane stay where they mean the same."""
    update: dict[str, object] = {"center": placed.center, "width": placed.width, "height": placed.height}
    for up in (plane.up, None, placed.up):
        for normal in (plane.normal, placed.normal):
            try:
                found = Plane.model_validate({**update, "normal": normal, "up": up})
            except ValidationError:
                continue  # an old `up` may lie along the new normal
            if _same_frame(found.placed, placed):
                return found
    return Plane.model_validate({**update, "normal": placed.normal, "up": placed.up})


def _same_frame(a: Placed, b: Placed) -> bool:
    pairs = [(a.side, b.side), (a.up, b.up), (a.normal, b.normal)]
    return all(abs(x - y) <= 1e-15 for u, v in pairs for x, y in zip(u, v, strict=True))


def _added(before: tuple[Transform, ...], steps: dict[str, float]) -> tuple[Transform, ...]:
    """The transformations and further steps, each joined with an older one where only such follow that commute with it.

    Moves along the plane's axes and scales commute with each other, rotations with nothing but the same one. What
    has become nothing is left out.
    """
    found = list(before)
    for name, amount in steps.items():
        nothing = 1.0 if name == "scale" else 0.0
        if amount == nothing:
            continue
        place = _place_of(found, name)
        if place is None:
            found.append(_step(name, amount))
            continue
        old = getattr(found[place], name)
        both = old * amount if name == "scale" else old + amount
        if both == nothing:
            del found[place]
        else:
            found[place] = _step(name, both)
    return tuple(found)


def _place_of(steps: list[Transform], name: str) -> int | None:
    """Which of the last steps a new one is joined with."""
    for index in range(len(steps) - 1, -1, -1):
        (other,) = steps[index].model_dump(exclude_none=True)
        if other == name:
            return index
        if not (name in _MOVES and other in _MOVES):
            return None
    return None


def _step(name: str, amount: float) -> Transform:
    if name.startswith("rotate") and abs(amount) > _MOST_DEGREES:
        amount = float(np.fmod(amount, 360.0))
    return Transform.checked({name: amount})


def _pixel(plane: Plane, size: Size) -> float:
    """Side of a pixel in the plane's picture, scene units."""
    return plane_view(plane.placed, *size).pixel_size(size[1])
