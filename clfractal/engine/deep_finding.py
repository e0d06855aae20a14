"""Deep places of a set that are worth a look: from picture to picture, each a part of the one before."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from clfractal.device.activity import doing
from clfractal.device.cancel import CancelToken
from clfractal.engine.any_engine import AnyEngine
from clfractal.engine.found import FoundView, check_suitable, checked, checked_magnification
from clfractal.engine.variations import small_scene
from clfractal.engine.varied import rounded
from clfractal.engine.view_score import (
    CHANNELS,
    Looked,
    light_of,
    lightness,
    looked_at,
    roughness,
    vectors_of,
)
from clfractal.errors import SceneError
from clfractal.formulas.deep import applications_until_apart, drawn_out, steps_per_pixel
from clfractal.images.framebuffer import Framebuffer
from clfractal.integrators.plan import DEEP_STEPS_PER_PIXEL
from clfractal.scene.deeper import deep_at, exact_point, magnification_of
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.schema.base import Vector, minus

Floats = npt.NDArray[np.float64]

# Pixels of the pictures on the way, and of those that choose the camera at last.
_ON_THE_WAY, _AT_LAST = (64, 40), (112, 70)
# How much a step magnifies, at most; parts of a picture that are looked at more closely, how many pixels they are apart;
# and those of them that are gone back to where the best ends in nothing.
_STEP, _TRIED, _ASIDE, _KEPT = 8.0, 4, 7, 2
# Pictures that are looked at more closely in one dive, for each step that the way down has.
_LOOKS = 3.0
# What scores less is not gone into.
_LEAST = 0.05
# Forms that are so many times as long as they are thick count half; those far longer are threads and sheets.
_DRAWN_OUT = 4.0
# What is farther from the middle of the picture, in times of the camera's distance, is another place.
_NEAR = 1.5
# How much normals within a neighbourhood of pixels differ: 0 all are one, 1 they cancel out. Much is dust.
_ROUGH, _NEIGHBOURS = 0.3, 2
# How much it counts that a part is lit, and chance.
_LIGHT, _CHANCE = 0.25, 0.15
# Dives that are begun for each place that is wanted.
_DIVES = 3
# Cameras that are tried at last, around the place: how many, and how high, degrees; the best are bettered in so many steps.
_AROUND, _HEIGHTS, _BETTERED, _BETTERING = 6, (18.0, 40.0, 65.0), 2, 10
# What scores less at last is no view.
_LEAST_AT_LAST = 0.12


@dataclass(frozen=True, slots=True, eq=False)
class _Look:
    """A place on the way down: the scene there, and what its small picture tells."""

    scene: Scene
    picture: Framebuffer
    seen: Looked

    @property
    def score(self) -> float:
        return self.seen.score


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

    Each is a scene with a `deep` of its own, its camera about as far from what it looks at as the scene's own is, and with
    as many more iterations as it takes until what is seen comes apart: so it has as much detail as the scene.

    Raises:
        SceneError: the scene shows no surface, or nothing was found; at its key.
    """
    count, seed = checked(count, seed)
    wanted = checked_magnification(scene, magnification)
    check_suitable(scene, deeper=True)
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
        raise SceneError(
            f"no place was found at a magnification of {wanted:g}: nothing there that is lit, and neither smooth nor dust"
        )
    return sorted(found, key=lambda view: -view.score)


class _Diver:
    """Goes down from a scene's own picture."""

    def __init__(self, scene: Scene, engine: AnyEngine, wanted: float, token: CancelToken | None) -> None:
        output = scene.output.model_copy(update={"denoise": False})
        if output.exposure == "auto":
            output = output.model_copy(update={"exposure": engine.settled(scene).output.exposure})
        self.engine, self.wanted, self.token = engine, wanted, token
        self.distance = math.hypot(*minus(scene.camera.position, scene.camera.target))
        self.fov = scene.camera.fov if isinstance(scene.camera, PerspectiveCamera) else 45.0
        # The way begins in the middle of the scene's own picture.
        deep = deep_at(exact_point(scene.camera.target, scene.deep), magnification_of(scene.deep))
        x, y, z = minus(scene.camera.position, scene.camera.target)
        camera = PerspectiveCamera(
            position=(x, y, z), target=(0, 0, 0), up=scene.camera.said["up"], fov=self.fov
        )
        self.scene = scene.model_copy(update={"animation": None, "bookmarks": {}})
        self.plain = self.scene.model_copy(update={"output": output, "deep": deep, "camera": camera})
        self.beside = scene.formula.iterations - applications_until_apart(self.plain.chain)
        self.bright = light_of([self._picture(self.plain, _ON_THE_WAY)])
        steps = math.log(wanted / deep.magnification, _STEP)
        self.looks = math.ceil(_LOOKS * steps) + 2

    def dive(self, random: np.random.Generator) -> FoundView | None:
        """A place, or None where all ways down that are tried end in nothing."""
        # Of each picture on the way the parts that are left, the best last.
        left = [[self._looked(self.plain, _ON_THE_WAY)]]
        for _ in range(self.looks):
            while left and not left[-1]:
                left.pop()
            if not left:
                break
            here = left[-1].pop()
            if magnification_of(here.scene.deep) < self.wanted * (1 - 1e-9):
                left.append(self._parts(here, random))
            elif (view := self._view(here, random)) is not None:
                return view
        return None

    def _picture(self, scene: Scene, size: tuple[int, int]) -> Framebuffer:
        channels = (*CHANNELS, "P.X", "P.Y", "P.Z")
        return self.engine.render(small_scene(scene, *size), samples=1, channels=channels, token=self.token)

    def _looked(self, scene: Scene, size: tuple[int, int]) -> _Look:
        picture = self._picture(scene, size)
        return _Look(scene, picture, looked_at(picture, self.distance, self.bright))

    def _parts(self, here: _Look, random: np.random.Generator) -> list[_Look]:
        """Parts of a picture, magnified, that are lit and neither smooth nor dust; the best last."""
        places, normals = vectors_of(here.picture, "P"), vectors_of(here.picture, "N")
        with np.errstate(invalid="ignore"):
            there = np.isfinite(places).all(axis=-1) & np.isfinite(np.asarray(here.picture["Z"], float))
            middle = np.array(here.scene.camera.target)
            there &= np.linalg.norm(places - middle, axis=-1) < _NEAR * self.distance
        rough = roughness(np.where(there[..., None], normals, 0.0), _NEIGHBOURS)
        light = np.minimum(lightness(here.picture) / self.bright, 1.0)
        worth = -abs(rough - _ROUGH) + _LIGHT * light + _CHANCE * random.normal(size=rough.shape)
        worth = np.where(there, worth, -np.inf)
        found = []
        for _ in range(_TRIED):
            row, column = divmod(int(np.argmax(worth)), worth.shape[1])
            if not there[row, column] or worth[row, column] == -np.inf:
                break
            x, y, z = places[row, column].tolist()
            scene = self._nearer(here.scene, (x, y, z), normals[row, column])
            if steps_per_pixel(scene.chain) >= DEEP_STEPS_PER_PIXEL:
                found.append(self._looked(scene, _ON_THE_WAY))
            worth[max(row - _ASIDE, 0) : row + _ASIDE, max(column - _ASIDE, 0) : column + _ASIDE] = -np.inf
        good = [each for each in found if each.score > _LEAST]
        return sorted(good, key=lambda each: each.score * _shapely(each.scene))[-_KEPT:]

    def _nearer(self, scene: Scene, point: Vector, normal: Floats) -> Scene:
        """The scene with a point in its middle, magnified, seen from where it was, and a little more from before it."""
        magnification = min(magnification_of(scene.deep) * _STEP, self.wanted)
        deep = deep_at(exact_point(point, scene.deep), magnification)
        way = np.array(scene.camera.position) - point
        way = 0.85 * way / np.linalg.norm(way) + 0.15 * normal
        moved = scene.model_copy(update={"deep": deep})
        # (These are asked of more than there will be.)
        most = scene.formula.model_copy(update={"iterations": 4 * scene.formula.iterations + 64})
        apart = applications_until_apart(moved.model_copy(update={"formula": most}).chain)
        formula = scene.formula.model_copy(update={"iterations": max(self.beside + apart, 1)})
        moved = moved.model_copy(update={"formula": formula})
        return self._seen_from(
            moved, self.distance * way / np.linalg.norm(way), np.zeros(3), scene.camera.said["up"]
        )

    def _seen_from(self, scene: Scene, place: Floats, target: Floats, up: Vector) -> Scene:
        fine = 1e-4 * self.distance
        position, looked = (
            tuple(rounded(each, fine) for each in point.tolist()) for point in (place, target)
        )
        camera = PerspectiveCamera(position=position, target=looked, up=up, fov=self.fov)
        return scene.model_copy(update={"camera": camera})

    def _view(self, here: _Look, random: np.random.Generator) -> FoundView | None:
        """The place from where it is seen best, with the iterations that show it best."""
        normals = vectors_of(here.picture, "N")[np.isfinite(here.picture["Z"])]
        above = normals.mean(axis=0) / max(np.linalg.norm(normals.mean(axis=0)), 1e-9)
        tried = [
            self._looked(self._around(here.scene, above, 360 * n / _AROUND, height), _ON_THE_WAY)
            for n in range(_AROUND)
            for height in _HEIGHTS
        ]
        best = sorted([here, *tried], key=lambda each: -each.score)[:_BETTERED]
        better = max((self._bettered(each.scene, random) for each in best), key=lambda each: each.score)
        if better.score < _LEAST_AT_LAST:
            return None
        update = {"deep": better.scene.deep, "camera": better.scene.camera, "formula": better.scene.formula}
        remark = f"score {better.score:.2f}; {self.wanted:g} times magnified; {better.scene.formula.iterations} iterations"
        return FoundView(self.scene.model_copy(update=update), better.score, better.seen.depth, remark)

    def _around(self, scene: Scene, above: Floats, turn: float, height: float) -> Scene:
        """The scene's middle seen from around it, over the ground that it stands on, which is below in the picture."""
        aside = np.cross(above, np.eye(3)[int(np.argmin(abs(above)))])
        aside /= np.linalg.norm(aside)
        a, b = math.radians(turn), math.radians(height)
        level = aside * math.cos(a) + np.cross(above, aside) * math.sin(a)
        x, y, z = (rounded(each, 0.01) for each in above.tolist())
        return self._seen_from(
            scene, self.distance * (level * math.cos(b) + above * math.sin(b)), np.zeros(3), (x, y, z)
        )

    def _bettered(self, scene: Scene, random: np.random.Generator) -> _Look:
        """Small moves that show more: of the camera, and of what it looks at; a few iterations more or less."""
        best, reach = self._looked(scene, _AT_LAST), 1.0
        # (Forms half as large.)
        coarser = max(round(scene.formula.iterations / math.log2(2 * self.wanted)), 1)
        for _ in range(_BETTERING):
            camera, formula = best.scene.camera, best.scene.formula
            target = np.array(camera.target) + 0.08 * reach * self.distance * random.normal(size=3)
            way = np.array(minus(camera.position, camera.target))
            way = way * math.exp(0.3 * reach * random.normal()) + 0.25 * reach * np.linalg.norm(
                way
            ) * random.normal(size=3)
            iterations = max(formula.iterations + coarser * int(random.integers(-1, 2)), 1)
            other = best.scene.model_copy(
                update={"formula": formula.model_copy(update={"iterations": iterations})}
            )
            look = self._looked(self._seen_from(other, target + way, target, camera.said["up"]), _AT_LAST)
            if look.score > best.score:
                best = look
            else:
                reach *= 0.88
        return best


def _shapely(scene: Scene) -> float:
    """1 where forms are as round as those of the whole set, less where they are drawn out to threads and sheets."""
    return 1 / (1 + (math.log(drawn_out(scene.chain)) / math.log(_DRAWN_OUT)) ** 2)
