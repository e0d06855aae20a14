"""Views of a set that are worth a look: places near it and within, where no camera stands by itself."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.device.cancel import CancelToken
from clfractal.engine.any_engine import AnyEngine, SceneLike, check_token
from clfractal.engine.engine import engine_on
from clfractal.engine.found import FoundView, check_suitable, checked
from clfractal.engine.variations import small_scene
from clfractal.engine.varied import rounded
from clfractal.engine.view_score import CHANNELS, COARSE, Looked, light_of, looked_at
from clfractal.errors import SceneError
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.load import as_scene
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.scene.seen import Seen
from clfractal.scene.stance import orbited
from clfractal.schema.base import Vector

Floats = npt.NDArray[np.float64]
T = TypeVar("T")

# Points that are drawn for places; places that are tried for each view, at least and at most; directions at each.
_DRAWN, _PLACES, _DIRECTIONS = 12_000, (12, 48, 144), 6
# Room that a camera has around it at least, parts of the radius of all that is seen.
_ROOM = 0.008
# A place is enclosed where the set is near in many directions: points around it, how far in parts of its room.
_AROUND, _AROUND_AT = 8, 3.0
# Part of the places that are the most enclosed ones.
_ENCLOSED = 0.65
# Elevations of the directions, degrees: their spread, and the steepest.
_ELEVATIONS, _STEEPEST = 12.0, 32.0
# Angles of view that are tried, degrees.
_ANGLES = (50.0, 62.0, 76.0)
# Pixels of pictures: of a first look, while a view is bettered, and at last.
_LOOKS = ((64, 36), (96, 54), (160, 90))
# Views that are bettered for each one that is wanted, at least; in so many steps.
_BETTERED, _LEAST_BETTERED, _STEPS = 3, 8, 9
# What scores less, also in parts of the best, is no view. Pictures that are so much alike are the same view; cameras are if
# they stand nearer than this (parts of the radius) and look into directions that differ by less (degrees).
_LEAST_SCORE, _LEAST_SHARE = 0.12, 0.4
_SAME, _APART, _TURN = 0.85, 0.25, 50.0
_CANDIDATES_APART = 0.5


@dataclass(frozen=True, slots=True)
class _Stand:
    """Where a camera is, in degrees and scene units."""

    place: Vector
    azimuth: float
    elevation: float
    fov: float


@dataclass(frozen=True, slots=True, eq=False)
class _Tried:
    stand: _Stand
    seen: Looked

    @property
    def score(self) -> float:
        return self.seen.score


def find(
    scene: SceneLike,
    *,
    count: int = 12,
    seed: int = 0,
    magnification: float | None = None,
    device: str | Sequence[str] | None = None,
    token: CancelToken | None = None,
) -> list[FoundView]:
    """Looks for views of a scene's set that are worth a look: places near it and within, with depth and light.

    Views differ from each other, and the best comes first. Equal arguments find the same ones on one kind of device.
    Their cameras are in perspective and sharp everywhere, whatever the scene's own is; an animation is left out.

    Args:
        scene: a scene with the surface renderer, or what `load_scene` takes. Its camera tells what is up and, where there
            are floors, on which side of them one is.
        count: how many are wanted; fewer are given if no more differ and show as much.
        seed: chooses the places that are tried.
        magnification: places that are so many times magnified, 1 to 1e120, in the place of views of the whole: each has a
            `deep` of its own, a camera and iterations. `room` is then how far the middle of what is seen is.
        device: as of `render`.
        token: ends the search when any thread cancels it; `clfractal.Stopped` is then raised.

    Raises:
        SceneError: the scene is wrong or shows no surface, or nothing was found.
        DeviceError, KernelBuildError: as of a render.
        Stopped: the token was cancelled.
    """
    loaded = as_scene(scene)
    check_token(token)
    with engine_on(device, None) as engine:
        return found_views(loaded, engine, count=count, seed=seed, magnification=magnification, token=token)


def found_views(
    scene: Scene,
    engine: AnyEngine,
    *,
    count: int,
    seed: int,
    magnification: float | None = None,
    token: CancelToken | None = None,
) -> list[FoundView]:
    """As `find`, by an engine."""
    if magnification is not None:
        from clfractal.engine.deep_finding import deep_views  # of few searches

        return deep_views(scene, engine, magnification=magnification, count=count, seed=seed, token=token)
    count, seed = checked(count, seed)
    check_suitable(scene)
    return _Finder(scene, engine, seed, token).views(count)


def _told(things: Sequence[T], begin: int, end: int) -> Iterator[T]:
    """Things, one after the other, while the process says how much of the work is done, percent."""
    for number, thing in enumerate(things):
        with doing(f"looking for views: {(begin + (end - begin) * number // len(things)) // 10 * 10} % done"):
            yield thing


class _Finder:
    """Looks for views of one scene."""

    def __init__(self, scene: Scene, engine: AnyEngine, seed: int, token: CancelToken | None) -> None:
        self.scene = scene.model_copy(update={"animation": None})
        self.engine, self.token = engine, token
        self.random = np.random.default_rng(seed)
        self.seen = Seen(self.scene, scene.camera.position, scene.extent)
        self.bright = 1.0
        self.up = tuple(scene.camera.said["up"])
        output = scene.output.model_copy(update={"denoise": False})
        # What is dark in the scene is dark here, too: no picture has an exposure of its own.
        if output.exposure == "auto":
            output = output.model_copy(update={"exposure": engine.settled(scene).output.exposure})
        plain = self.scene.model_copy(update={"output": output, "bookmarks": {}})
        self.looks = [small_scene(plain, *size) for size in _LOOKS]

    def views(self, count: int) -> list[FoundView]:
        """The best that differ."""
        stands = self._stands(self._places(min(max(_PLACES[0] * count, _PLACES[1]), _PLACES[2])))
        pictures = [self._picture(stand, 0) for stand in _told(stands, 0, 60)]
        self.bright = light_of(pictures)
        first = [self._judged(*each) for each in zip(stands, pictures, strict=True)]
        kept = self._different(
            [each for each in first if each.score > 0], max(_BETTERED * count, _LEAST_BETTERED)
        )
        better = [self._bettered(each) for each in _told(kept, 60, 100)]
        last = [self._tried(each.stand, 2) for each in better]
        least = max(_LEAST_SCORE, _LEAST_SHARE * max((each.score for each in last), default=0.0))
        chosen = self._unlike([each for each in last if each.score >= least], count)
        if not chosen:
            raise SceneError(
                "no view was found: nowhere near what is seen is there room for a camera, and something lit before it"
            )
        return [self._found(each) for each in chosen]

    def _places(self, count: int) -> Floats:
        """Places outside the set with room for a camera, narrow ones and wide ones, and mostly enclosed by the set."""
        points = np.array(self.seen.center) + self.seen.radius * self._in_ball(_DRAWN)
        room = np.minimum(self.seen.room(points), self.seen.radius)
        usable = room > _ROOM * self.seen.radius
        points, room = points[usable], room[usable]
        if not len(points):
            return points
        ways = self._in_ball(_AROUND, on_it=True)
        around = np.array([self.seen.room(points + _AROUND_AT * room[:, None] * way) for way in ways])
        enclosed = (around < 1.5 * room).mean(axis=0)
        # As many of each width, by its logarithm, and of each the most enclosed ones.
        widths = np.digitize(np.log(room), np.quantile(np.log(room), np.linspace(0, 1, 7)[1:-1]))
        chosen: list[int] = []
        for width in range(6):
            these = np.flatnonzero(widths == width)
            ranked = these[np.argsort(-enclosed[these], kind="stable")]
            most = count // 6
            inner = ranked[: round(_ENCLOSED * most)]
            others = ranked[len(inner) :]
            chosen += [*inner, *others[: most - len(inner)]]
        return np.asarray(points[chosen])

    def _in_ball(self, count: int, *, on_it: bool = False) -> Floats:
        """Points in the unit ball, or on it."""
        way = self.random.normal(size=(count, 3))
        far = np.ones(count) if on_it else self.random.uniform(size=count) ** (1 / 3)
        return np.asarray(way * (far / np.linalg.norm(way, axis=1))[:, None])

    def _stands(self, places: Floats) -> list[_Stand]:
        found = []
        for place in places.tolist():
            first = self.random.uniform(0, 360)
            for number in range(_DIRECTIONS):
                elevation = float(np.clip(self.random.normal(-4, _ELEVATIONS), -_STEEPEST, _STEEPEST))
                azimuth = first + 360 / _DIRECTIONS * (number + self.random.uniform(-0.3, 0.3))
                found.append(_Stand(tuple(place), azimuth % 360, elevation, _ANGLES[1]))
        return found

    def _camera(self, stand: _Stand, depth: float = 1.0) -> PerspectiveCamera:
        """A camera there; `depth` is that of its target."""
        # (Seen from the target the camera is on the other side, and as far above it as it looks down.)
        target, _ = orbited(stand.place, self.up, stand.azimuth + 180, stand.elevation, depth)
        fine = 0.01 * depth
        x, y, z = (rounded(each, fine) for each in target)
        return PerspectiveCamera(position=stand.place, target=(x, y, z), up=self.up, fov=stand.fov)

    def _picture(self, stand: _Stand, look: int) -> Framebuffer:
        scene = self.looks[look].model_copy(update={"camera": self._camera(stand, 0.5 * self.seen.radius)})
        return self.engine.render(scene, samples=1, channels=CHANNELS, token=self.token)

    def _judged(self, stand: _Stand, picture: Framebuffer) -> _Tried:
        return _Tried(stand, looked_at(picture, self.seen.radius, self.bright))

    def _tried(self, stand: _Stand, look: int) -> _Tried:
        return self._judged(stand, self._picture(stand, look))

    def _bettered(self, tried: _Tried) -> _Tried:
        """Small moves that show more: turns, steps, and other angles of view."""
        best = self._tried(tried.stand, 1)
        reach = 1.0
        for _ in range(_STEPS):
            stand = best.stand
            turn, rise, size = self.random.normal(size=3) * reach
            step = 0.25 * min(best.seen.depth, self.seen.radius) * self.random.normal(size=3) * reach
            place = np.array(stand.place) + step
            fov = float(self.random.choice(_ANGLES)) if size > 0.7 else stand.fov
            elevation = float(np.clip(stand.elevation + 9 * rise, -_STEEPEST, _STEEPEST))
            if not self._has_room(place):
                continue
            x, y, z = place.tolist()
            other = self._tried(_Stand((x, y, z), (stand.azimuth + 16 * turn) % 360, elevation, fov), 1)
            if other.score > best.score:
                best = other
            else:
                reach *= 0.85
        return best

    def _has_room(self, place: Floats) -> bool:
        return bool(self.seen.room(place[None])[0] > _ROOM * self.seen.radius)

    def _different(self, tried: Sequence[_Tried], count: int) -> list[_Tried]:
        """The best that stand at other places, or look elsewhere."""
        found: list[_Tried] = []
        for each in sorted(tried, key=lambda each: -each.score):
            if len(found) == count:
                break
            if all(self._nearness(each.stand, other.stand) < _CANDIDATES_APART for other in found):
                found.append(each)
        return found

    def _unlike(self, tried: Sequence[_Tried], count: int) -> list[_Tried]:
        """The best one after the other, each with what it is like of those before taken off."""
        left = list(tried)
        found: list[_Tried] = []
        while left and len(found) < count:
            likeness = [max((self._likeness(each, other) for other in found), default=0.0) for each in left]
            left_over = [each for each, like in zip(left, likeness, strict=True) if like < _SAME]
            rest = [like for like in likeness if like < _SAME]
            if not left_over:
                break
            values = [
                each.score * (1 - 0.7 * max(like, 0.0)) for each, like in zip(left_over, rest, strict=True)
            ]
            best = left_over.pop(int(np.argmax(values)))
            found.append(best)
            left = left_over
        return sorted(found, key=lambda each: -each.score)

    def _nearness(self, one: _Stand, other: _Stand) -> float:
        """1 where two cameras stand at one place and look to one side."""
        apart = math.dist(one.place, other.place) / (_APART * self.seen.radius)
        turn = abs((one.azimuth - other.azimuth + 180) % 360 - 180) / _TURN
        return math.exp(-(apart**2) - turn**2)

    def _likeness(self, one: _Tried, other: _Tried) -> float:
        """1 for pictures that are the same, also by symmetries of the set."""
        a, b = one.seen.glance, other.seen.glance.reshape(2, *COARSE)
        turned = (b, b[:, ::-1], b[:, :, ::-1], b[:, ::-1, ::-1])
        like = max(float(a @ each.ravel()) for each in turned)
        return max(like, self._nearness(one.stand, other.stand))

    def _found(self, tried: _Tried) -> FoundView:
        fine = 0.05 * _ROOM * self.seen.radius
        x, y, z = (rounded(each, 100 * fine) for each in tried.stand.place)
        stand = _Stand((x, y, z), tried.stand.azimuth, tried.stand.elevation, tried.stand.fov)
        camera = self._camera(stand, min(tried.seen.depth, 10 * self.seen.radius))
        room = float(self.seen.room(np.array([[x, y, z]]))[0])
        remark = (
            f"score {tried.score:.2f}; {tried.stand.fov:.0f}° high; depth {tried.seen.layers:.1f}-fold,"
            f" room {room / self.seen.radius:.2f} of the radius"
        )
        return FoundView(self.scene.model_copy(update={"camera": camera}), tried.score, room, remark)
