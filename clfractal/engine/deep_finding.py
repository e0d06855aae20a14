"""Deep places of a set that are worth a look: from picture to picture, each a part of the one before, much magnified."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.device.cancel import CancelToken
from clfractal.engine.any_engine import AnyEngine
from clfractal.engine.finding import FoundView, check_suitable, checked
from clfractal.engine.variations import small_scene
from clfractal.engine.view_score import CHANNELS, Looked, looked_at
from clfractal.errors import SceneError, Where, arguments
from clfractal.formulas.deep import applications_until_apart, steps_per_pixel
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.plan import DEEP_STEPS_PER_PIXEL
from clfractal.scene.deep import LARGEST_MAGNIFICATION
from clfractal.scene.deeper import deep_at, exact_point, magnification_of
from clfractal.scene.model import Scene
from clfractal.scene.stance import axes
from clfractal.schema.base import Vector, minus

Floats = npt.NDArray[np.float64]

# Pixels of the pictures on the way, and of those that choose the camera at last.
_ON_THE_WAY, _AT_LAST = (64, 40), (128, 80)
# How much a step magnifies, at most, and parts of a picture that are looked at more closely.
_STEP, _TRIED = 8.0, 3
# What is farther from the middle of the picture, in times of the camera's distance, is another place.
_NEAR = 1.5
# How much normals within a neighbourhood of pixels differ: 0 all are one, 1 they cancel out. Much is dust.
_ROUGH, _NEIGHBOURS = 0.35, 2
# Dives that are begun for each place that is wanted.
_DIVES = 2
# Cameras that are tried at last: turned about `up`, and raised, degrees.
_TURNS, _RISES = (0.0, -35.0, 35.0, 80.0, -80.0), (0.0, 18.0)


@dataclass(frozen=True, slots=True, eq=False)
class _Dive:
    """A place on the way down: the scene there, and where its camera is seen from what it looks at."""

    scene: Scene
    seen: Looked


def deep_views(
    scene: Scene,
    engine: AnyEngine,
    *,
    magnification: float,
    count: int,
    seed: int,
    token: CancelToken | None = None,
) -> list[FoundView]:
    """Places of a set at a magnification, the best first: see `clfractal find --magnification`.

    Each is a scene with a `deep` of its own, its camera as far from what it looks at as the scene's own is, and with as
    many more iterations as it takes until what is seen comes apart: so it has as much detail as the scene.

    Raises:
        SceneError: the scene shows no surface, or nothing was found; at its key.
    """
    count, seed = checked(count, seed)
    least = magnification_of(scene.deep)
    wanted = arguments.number("magnification", magnification, least, LARGEST_MAGNIFICATION)
    check_suitable(scene)
    diver = _Diver(scene, engine, wanted, token)
    found: list[FoundView] = []
    for number in range(_DIVES * count):
        if len(found) == count:
            break
        with doing(f"looking for deep places: {100 * len(found) // count} % done"):
            view = diver.dive(np.random.default_rng((seed, number)))
        if view is not None:
            found.append(view)
    if not found:
        raise SceneError(f"no place was found at a magnification of {wanted:g}", Where(path="formula"))
    return sorted(found, key=lambda view: -view.score)


class _Diver:
    """Goes down from a scene's own picture."""

    def __init__(self, scene: Scene, engine: AnyEngine, wanted: float, token: CancelToken | None) -> None:
        output = scene.output.model_copy(update={"denoise": False})
        if output.exposure == "auto":
            output = output.model_copy(update={"exposure": engine.settled(scene).output.exposure})
        update = {"animation": None, "bookmarks": {}, "output": output}
        self.scene, self.plain = scene.model_copy(update={"animation": None}), scene.model_copy(update=update)
        self.engine, self.wanted, self.token = engine, wanted, token
        self.distance = math.hypot(*minus(scene.camera.position, scene.camera.target))
        if scene.deep is None:
            start = deep_at(exact_point((0.0, 0.0, 0.0), None), 1.0)
            self.plain = self.plain.model_copy(update={"deep": start})
        self.beside = scene.formula.iterations - applications_until_apart(self.plain.chain)

    def dive(self, random: np.random.Generator) -> FoundView | None:
        """A place, or None where the way down ends in nothing."""
        scene = self.plain
        while scene.deep is not None and scene.deep.magnification < self.wanted * (1 - 1e-9):
            tried = [self._tried(each, _ON_THE_WAY) for each in self._parts(scene, random)]
            if not tried:
                return None
            best = max(tried, key=lambda each: each.seen.score)
            scene = best.scene
        turned = [self._turned(scene, turn, rise) for turn in _TURNS for rise in _RISES]
        best = max((self._tried(each, _AT_LAST) for each in turned), key=lambda each: each.seen.score)
        if best.seen.score <= 0 or steps_per_pixel(best.scene.chain) < DEEP_STEPS_PER_PIXEL:
            return None
        update = {"deep": best.scene.deep, "camera": best.scene.camera, "formula": best.scene.formula}
        remark = f"score {best.seen.score:.2f}; {self.wanted:g} times magnified; {update['formula'].iterations} iterations"
        return FoundView(self.scene.model_copy(update=update), best.seen.score, best.seen.depth, remark)

    def _picture(self, scene: Scene, size: tuple[int, int], *more: str) -> Framebuffer:
        small = small_scene(scene, *size)
        return self.engine.render(small, samples=1, channels=(*CHANNELS, *more), token=self.token)

    def _tried(self, scene: Scene, size: tuple[int, int]) -> _Dive:
        return _Dive(scene, looked_at(self._picture(scene, size), self.distance, 1.0))

    def _parts(self, scene: Scene, random: np.random.Generator) -> list[Scene]:
        """Parts of a picture, magnified, that are neither smooth nor dust."""
        picture = self._picture(scene, _ON_THE_WAY, "P.X", "P.Y", "P.Z")
        places = np.stack([np.asarray(picture[f"P.{axis}"], float) for axis in "XYZ"], axis=-1)
        normals = np.stack([np.asarray(picture[f"N.{axis}"], float) for axis in "XYZ"], axis=-1)
        middle = np.array(scene.camera.target)
        with np.errstate(invalid="ignore"):
            there = np.isfinite(places).all(axis=-1) & np.isfinite(np.asarray(picture["Z"], float))
            there &= np.linalg.norm(places - middle, axis=-1) < _NEAR * self.distance
        rough = _roughness(np.where(there[..., None], normals, 0.0))
        worth = np.where(there, -abs(rough - _ROUGH) + 0.1 * random.normal(size=rough.shape), -np.inf)
        chosen = np.argsort(-worth, axis=None)[:_TRIED]
        found = []
        for row, column in zip(*np.unravel_index(chosen, worth.shape), strict=True):
            if there[row, column]:
                x, y, z = places[row, column].tolist()
                found.append(self._nearer(scene, (x, y, z), normals[row, column]))
        return found

    def _nearer(self, scene: Scene, point: Vector, normal: Floats) -> Scene:
        """The scene with a point in its middle, magnified, seen from where it was seen, and a little more from before it."""
        assert scene.deep is not None
        magnification = min(scene.deep.magnification * _STEP, self.wanted)
        deep = deep_at(exact_point(point, scene.deep), magnification)
        way = np.array(scene.camera.position) - point
        way = 0.85 * way / np.linalg.norm(way) + 0.15 * normal
        return self._at(scene.model_copy(update={"deep": deep}), way)

    def _at(self, scene: Scene, way: Floats) -> Scene:
        """The scene seen from a direction, with the iterations that belong to its depth."""
        x, y, z = (self.distance * way / np.linalg.norm(way)).tolist()
        camera = scene.camera.model_copy(update={"position": (x, y, z), "target": (0.0, 0.0, 0.0)})
        # (These are asked of more than there will be.)
        most = scene.formula.model_copy(update={"iterations": 4 * scene.formula.iterations + 64})
        apart = applications_until_apart(scene.model_copy(update={"formula": most}).chain)
        formula = scene.formula.model_copy(update={"iterations": max(self.beside + apart, 1)})
        return scene.model_copy(update={"camera": camera, "formula": formula})

    def _turned(self, scene: Scene, turn: float, rise: float) -> Scene:
        """The scene seen from another side of its middle."""
        forward, right, up = (np.array(each) for each in axes(scene.camera.position, scene.camera.target, scene.camera.up))
        a, b = math.radians(turn), math.radians(rise)
        aside = -forward * math.cos(a) + right * math.sin(a)
        return self._at(scene, aside * math.cos(b) + up * math.sin(b))


def _roughness(normals: Floats) -> Floats:
    """How much normals around each pixel differ: 1 less the length of their mean."""
    reach = range(-_NEIGHBOURS, _NEIGHBOURS + 1)
    padded = np.pad(normals, ((_NEIGHBOURS, _NEIGHBOURS), (_NEIGHBOURS, _NEIGHBOURS), (0, 0)))
    height, width = normals.shape[:2]
    total = sum(
        padded[_NEIGHBOURS + y : _NEIGHBOURS + y + height, _NEIGHBOURS + x : _NEIGHBOURS + x + width]
        for y in reach
        for x in reach
    )
    return np.asarray(1 - np.linalg.norm(total / len(reach) ** 2, axis=-1))
