"""Steps of a scene's point of view: round the target, nearer, wider; of a cut plane, its place."""

from __future__ import annotations

import math
from collections.abc import Collection
from random import Random
from typing import Any

from clfractal.engine.varied import Step, is_locked, rounded, signed
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.model import Scene
from clfractal.scene.parts import Camera, OrthographicCamera, PerspectiveCamera
from clfractal.scene.rectangle import moved, rotated, scaled
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.base import Vector, cross, dot, length, minus, turn, unit

# The boldest steps: degrees round the target and up or down, logarithms of distance and of the angle of view; of a plane:
# degrees, its size's logarithm, shifts as parts of its size.
_ROUND, _RISE, _DOLLY, _ANGLE = 75.0, 32.0, 0.35, 0.3
_TILT, _ZOOM, _SHIFT = 40.0, 0.9, 0.3
# Degrees that stay between the view and `up`, so that the picture cannot turn over.
_POLE = 8.0
_WIDEST, _NARROWEST = 100.0, 12.0


def closeness(scene: Scene) -> float:
    """1 where the picture shows all of the set, less where it shows a part: the root of their ratio."""
    radius = scene.bounds[1]
    if isinstance(scene.renderer, CutPlaneRenderer):
        plane = scene.renderer.plane.placed
        shown = max(plane.width, plane.height) / 2
    else:
        shown = _half_height(scene.camera)
    return math.sqrt(min(1.0, max(shown / radius, 1e-12)))


def camera_step(scene: Scene, rng: Random, amount: float, *, locked: Collection[str]) -> Step:
    """Another point of view; empty where the scene's camera is not what shows it, or is locked."""
    step = Step()
    near = math.sqrt(closeness(scene))
    if isinstance(scene.renderer, CutPlaneRenderer):
        if not is_locked("renderer.plane", locked):
            _move_plane(step, scene.renderer, rng, amount)
        return step
    if scene.stereo is None or scene.stereo.plane is None:
        _move_camera(step, scene.camera, rng, amount * near, locked)
    return step


def following_step(before: Scene, after: Scene, locked: Collection[str]) -> Step | None:
    """Lets the view follow the set where a new formula's bounds are larger or smaller; None if they differ too much."""
    (old, old_radius), (new, new_radius) = before.bounds, after.bounds
    ratio = new_radius / old_radius
    if not 0.5 <= ratio <= 2.0:
        return None
    step = Step()
    if abs(ratio - 1) < 0.01 and old == new:
        return step

    def follow(point: Vector, fine: float) -> list[float]:
        return [rounded(n + ratio * (p - o), fine) for p, o, n in zip(point, old, new, strict=True)]

    camera = before.camera
    fine = 0.01 * length(minus(camera.position, camera.target))
    step.changes |= {
        "camera.position": follow(camera.position, fine),
        "camera.target": follow(camera.target, fine),
    }
    if isinstance(camera, OrthographicCamera):
        step.changes["camera.height"] = rounded(ratio * camera.height, 0.01 * camera.height)
    elif camera.focus_distance is not None:
        step.changes["camera.focus_distance"] = ratio * camera.focus_distance
    renderer = before.renderer
    if isinstance(renderer, VolumeRenderer) and renderer.box is not None and not renderer.zoom:
        sides = [rounded(ratio * side, 0.01 * side) for side in renderer.box.sides]
        step.changes |= {
            "renderer.box.center": follow(renderer.box.center, 0.01 * max(sides)),
            "renderer.box.size": sides,
        }
    step.changes = {path: value for path, value in step.changes.items() if not is_locked(path, locked)}
    return step


def _move_camera(step: Step, camera: Camera, rng: Random, amount: float, locked: Collection[str]) -> None:
    turns, rises = signed(rng, amount), signed(rng, amount)
    dolly, angle = _nearer(signed(rng, amount)), _nearer(signed(rng, amount))
    away = minus(camera.position, camera.target)
    distance = length(away)
    if not is_locked("camera.position", locked):
        factor = math.exp(_DOLLY * dolly) if isinstance(camera, PerspectiveCamera) else 1.0
        orbited = _orbited(away, camera.up, _ROUND * turns, _RISE * rises)
        fine = 0.02 * distance
        place = [rounded(t + factor * a, fine) for t, a in zip(camera.target, orbited, strict=True)]
        remarks = [
            f"{abs(_ROUND * turns):.0f}° to the {'right' if turns > 0 else 'left'}",
            f"{abs(_RISE * rises):.0f}° {'higher' if rises > 0 else 'lower'}",
        ]
        sizes = {"camera.round": turns, "camera.rise": rises, "camera.dolly": dolly}
        step.add(Step({"camera.position": place}, sizes, remarks))
        if isinstance(camera, PerspectiveCamera) and camera.focus_distance is not None:
            step.changes["camera.focus_distance"] = rounded(factor * camera.focus_distance, fine)
    if isinstance(camera, PerspectiveCamera) and not is_locked("camera.fov", locked):
        wide = camera.fov * math.exp(_ANGLE * angle)
        wide = min(max(wide, min(_NARROWEST, camera.fov)), max(_WIDEST, camera.fov))
        wide = rounded(wide, camera.fov * 0.05)
        step.add(Step({"camera.fov": wide}, {"camera.fov": angle}, ["wider" if angle > 0 else "narrower"]))
    elif isinstance(camera, OrthographicCamera) and not is_locked("camera.height", locked):
        height = rounded(camera.height * math.exp(_DOLLY * dolly), camera.height * 0.05)
        step.add(Step({"camera.height": height}, {"camera.dolly": dolly}))


def _nearer(size: float) -> float:
    """Half the step if it makes the object smaller: much space around it is seldom wanted."""
    return size if size < 0 else size / 2


def _orbited(away: Vector, up: Vector, around: float, rise: float) -> Vector:
    """A vector from the target to the camera, turned about `up` and then raised towards it; degrees."""
    axis = unit(up)
    turned = turn(away, axis, around)
    side = unit(cross(axis, turned))
    here = math.degrees(math.acos(max(-1.0, min(1.0, dot(unit(turned), axis)))))
    # From `up` 0 to 180 degrees; a camera that is nearer to a pole than allowed may stay there.
    least, most = min(_POLE, here), max(180 - _POLE, here)
    return turn(turned, side, min(max(here - rise, least), most) - here)


def _move_plane(step: Step, renderer: CutPlaneRenderer, rng: Random, amount: float) -> None:
    place = renderer.plane.placed
    size = max(place.width, place.height)
    tilt, twist, zoom = (signed(rng, amount) for _ in range(3))
    side, up, normal = (signed(rng, amount) for _ in range(3))
    # Towards larger parts as seldom as towards much smaller ones: the set's surroundings are empty.
    factor = math.exp(_ZOOM * (zoom if zoom < 0 else 0.3 * zoom))
    place = scaled(place, factor)
    place = rotated(rotated(place, "side", _TILT * tilt), "up", _TILT * twist)
    place = moved(
        place, side=_SHIFT * side * size / 2, up=_SHIFT * up * size / 2, normal=_SHIFT * normal * size / 2
    )
    fine = 0.02 * size * factor

    def plain(vector: Vector, step: float) -> list[float]:
        return [rounded(x, step) for x in vector]

    plane: dict[str, Any] = {
        "center": plain(place.center, fine),
        "normal": plain(place.normal, 1e-2),
        "up": plain(place.up, 1e-2),
        "width": rounded(place.width, fine),
        "height": rounded(place.height, fine),
    }
    names = ("tilt", "twist", "zoom", "side", "up", "normal")
    sizes = zip(names, (tilt, twist, zoom, side, up, normal), strict=True)
    remark = f"plane {1 / factor:.2g}x, tilted {abs(_TILT * tilt):.0f}° and {abs(_TILT * twist):.0f}°"
    step.add(Step({"renderer.plane": plane}, {f"plane.{name}": each for name, each in sizes}, [remark]))


def _half_height(camera: Camera) -> float:
    """Half of what the picture is high at the target, scene units."""
    if isinstance(camera, OrthographicCamera):
        return camera.height / 2
    return length(minus(camera.target, camera.position)) * math.tan(math.radians(camera.fov) / 2)
