"""A recorded flight as few keys: those of which the film's own curves come back to where the camera was."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import dist
from typing import TypeAlias

from clfractal.scene.animation import Animation, Key, Track
from clfractal.scene.model import Scene
from clfractal.scene.movement import Movement
from clfractal.scene.parts import AnyCamera
from clfractal.schema.base import Vector
from clfractal.viewer.timeline_edits import NEAR

TOLERANCE = 0.01
"""How far a thinned flight may be beside the recorded one: parts of the camera's distance from its target."""
_TURN = 1e-6  # of `up`, below which it counts as fixed
_NAMES = ("position", "target", "up")


@dataclass(frozen=True, slots=True)
class Sample:
    """Where a camera was: at a time, in frames from the flight's beginning."""

    frame: float
    position: Vector
    target: Vector
    up: Vector

    @classmethod
    def of(cls, frame: float, camera: AnyCamera) -> Sample:
        """That of a camera."""
        return cls(frame, camera.position, camera.target, camera.up)


Values: TypeAlias = Mapping[str, Vector]


def at_frames(samples: Sequence[Sample]) -> list[Sample]:
    """A recording, whose samples came when they could, at whole frames: on straight lines between the samples."""
    found: list[Sample] = []
    place = 0
    for frame in range(int(samples[-1].frame + 0.5) + 1):
        while place + 1 < len(samples) and samples[place + 1].frame <= frame:
            place += 1
        here, after = samples[place], samples[min(place + 1, len(samples) - 1)]
        width = after.frame - here.frame
        share = min(max((frame - here.frame) / width, 0.0), 1.0) if width > 0 else 0.0
        mixed = [_between(getattr(here, name), getattr(after, name), share) for name in _NAMES]
        found.append(Sample(float(frame), *mixed))
    return found


def flight(scene: Scene, samples: Sequence[Sample], start: float, tolerance: float = TOLERANCE) -> Animation:
    """The scene's animation with a recorded flight in the camera's tracks, from a frame on; it becomes longer if need be.

    Keys that the tracks had in this time go; those before and after stay. Tracks that follow an expression or a table
    are replaced. As Ramer (1972) and Douglas and Peucker (1973) thin polygons, with the film's curves in the place of
    lines: where the film's camera is farthest from the flight, a key is added, until none is farther than the tolerance.

    Args:
        samples: as they were recorded; frames from the flight's beginning.
        start: the frame at which it begins.
        tolerance: parts of the distance from camera to target.

    Raises:
        SceneError: the film cannot be that long.
    """
    steady = at_frames(samples)
    last = len(steady) - 1
    kept = [0, last] if last > 0 else [0]
    while True:
        animation = _with_keys(scene, steady, kept, start)
        flown = _flown(scene, animation, steady, start)
        errors = [_error(recorded, found) for recorded, found in zip(steady, flown, strict=True)]
        between = [range(first + 1, end) for first, end in pairwise(kept) if end > first + 1]
        worst = [max(numbers, key=errors.__getitem__) for numbers in between]
        added = [number for number in worst if errors[number] > tolerance]
        if not added:
            return animation
        kept = sorted([*kept, *added])


def _with_keys(scene: Scene, steady: Sequence[Sample], kept: Sequence[int], start: float) -> Animation:
    """The scene's animation with some samples as keys of its camera."""
    assert scene.animation is not None
    animation = scene.animation
    rolls = any(dist(sample.up, steady[0].up) > _TURN for sample in steady)
    names = [f"camera.{name}" for name in _NAMES if name != "up" or rolls or "camera.up" in animation.tracks]
    parts = tuple(f"{name}." for name in names)
    tracks = {name: track for name, track in animation.tracks.items() if not name.startswith(parts)}
    end = start + steady[-1].frame
    for name in names:
        part = name.rpartition(".")[2]
        flown = [
            Key(frame=start + steady[number].frame, value=getattr(steady[number], part)) for number in kept
        ]
        before = tracks.get(name)
        others = [
            key
            for key in (before.keys or () if before is not None else ())
            if not start - NEAR <= animation.frame_of(key) <= end + NEAR
        ]
        # (Keys that were there may have had another way; those of a flight are smooth.)
        keys = sorted([*others, *flown], key=animation.frame_of)
        plain = [key.model_copy(update={"interpolation": None, "handles": None}) for key in keys]
        tracks[name] = Track(keys=tuple(plain))
    needed = int(end) + 1 + int(animation.loop)
    update: dict[str, object] = {"tracks": tracks}
    if needed > animation.count:
        update |= {"frames": needed, "duration": None}
    return animation.model_copy(update=update)


def _flown(scene: Scene, animation: Animation, steady: Sequence[Sample], start: float) -> list[Values]:
    """Where the film's camera is at each sample."""
    own = {f"camera.{name}": name for name in _NAMES}
    tracks = {name: track for name, track in animation.tracks.items() if name in own}
    movement = Movement(
        scene.model_copy(update={"animation": animation.model_copy(update={"tracks": tracks})})
    )
    return [
        {own[name]: value for name, value in movement.values(start + sample.frame).items()}
        for sample in steady
    ]


def _error(sample: Sample, found: Values) -> float:
    """How far another camera is from the recorded one, parts of the distance from camera to target."""
    distance = max(dist(sample.position, sample.target), 1e-300)
    moved = max(dist(sample.position, found["position"]), dist(sample.target, found["target"])) / distance
    return max(moved, dist(_unit(sample.up), _unit(found["up"])) if "up" in found else 0.0)


def _unit(a: Vector) -> Vector:
    size = max(dist(a, (0, 0, 0)), 1e-300)
    return (a[0] / size, a[1] / size, a[2] / size)


def _between(a: Vector, b: Vector, share: float) -> Vector:
    return (a[0] + share * (b[0] - a[0]), a[1] + share * (b[1] - a[1]), a[2] + share * (b[2] - a[2]))
