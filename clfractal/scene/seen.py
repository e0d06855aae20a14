"""How far what is seen of a scene reaches, for cameras that frame it; without a device, and without rays.

A picture's sides touch what is seen in it, so a camera has to know how far this reaches in a few directions. Cubes that the
formulas' distances leave a chance to hold some of it are divided, again and again, where they lie farthest out.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import reduce
from itertools import product
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.formulas import reference
from clfractal.scene.cut_plane import CutPlane
from clfractal.scene.object_grids import placed
from clfractal.scene.objects import FormulaObject, VolumeObject, ball_of_both
from clfractal.scene.stance import Extent, Ways
from clfractal.schema.base import Vector
from clfractal.schema.shape import Ball, Joined, Level, ObjectBase, Simple, Solid, turned_axes

if TYPE_CHECKING:
    from clfractal.formulas.language import Chain
    from clfractal.scene.given import GivenGrid
    from clfractal.scene.materials import PbrMaterial

Floats: TypeAlias = npt.NDArray[np.float64]
Away: TypeAlias = Callable[[Floats], Floats]

# Cubes along each side of the box that is searched, at first, and how they are shifted in parts of their sides.
_FIRST, _ASKEW = 8, (0.237, -0.171, 0.093)
_CORNERS = np.array(list(product((-0.5, 0.5), repeat=3)))
# What part of it is fine enough; how many cubes are divided at once of each direction; after how many the search ends: a
# face along a side of the picture has more than need to be looked at.
_FINE, _DIVIDED, _MOST_CUBES = 0.005, 20, 16_000
# The surface is at most so many distances away by the estimates, which are less than the distances.
_LOOSE = 12.0
# Applications that are enough for where a set ends: they bound the time.
_MOST_APPLICATIONS = 60


class Shown(Protocol):
    """What is looked at of a scene."""

    @property
    def has_set(self) -> bool: ...
    @property
    def chain(self) -> Chain: ...
    @property
    def joined(self) -> Mapping[str, Joined]: ...
    @property
    def joined_chains(self) -> Mapping[str, Chain]: ...
    @property
    def objects(self) -> Mapping[str, ObjectBase]: ...
    @property
    def grids(self) -> Mapping[str, GivenGrid]: ...
    @property
    def materials(self) -> Mapping[str, PbrMaterial]: ...
    @property
    def cut_planes(self) -> Sequence[CutPlane]: ...
    @property
    def bounds(self) -> Ball: ...
    @property
    def formula(self) -> Any: ...
    @property
    def renderer(self) -> Any: ...


class Seen:
    """What is seen of a scene: the set and all that has an end, as far as planes leave it.

    It is the `Framed` of a camera. Where nothing is seen at all it is the bounds.

    Attributes:
        center, radius: of a ball around it.
    """

    has_middle: ClassVar[bool] = False

    def __init__(self, scene: Shown, eye: Vector, bounds: Extent) -> None:
        """What is seen from a side of it.

        Args:
            eye: where the camera is, as far as that is known: floors hide what is on their other side.
            bounds: what is framed if nothing is seen.
        """
        self._otherwise = bounds
        # Volumes among the objects are looked at as a whole.
        self._blocks = [
            placed(each, scene.grids[each.file]).place.extent
            for each in scene.objects.values()
            if isinstance(each, VolumeObject)
        ]
        self._bodies: list[Away] = []
        balls = [(block.center, block.radius) for block in self._blocks]
        if scene.has_set:
            self._bodies.append(_cut(_set_of(scene), [p for p in scene.cut_planes if p.cuts_set]))
            balls.append(scene.bounds)
        for name, each in scene.objects.items():
            if isinstance(each, Solid) and name not in scene.joined:
                planes = [plane for plane in scene.cut_planes if name in plane.cut_objects]
                self._bodies.append(_cut(each.away, planes))
                balls.append(each.ball)
        self._floors = [_on_side(each, eye) for each in scene.objects.values() if _hides(each, scene)]
        ball = reduce(ball_of_both, balls) if balls else (bounds.center, bounds.radius)
        self.center, self.radius = ball

    def away(self, points: Floats) -> Floats:
        """How far points of shape (n, 3) are from it, or less."""
        nearest = reduce(np.minimum, (body(points) for body in self._bodies))
        return np.asarray(reduce(np.maximum, (floor(points) for floor in self._floors), nearest))

    def room(self, points: Floats) -> Floats:
        """How far points are from all that hides, or less: below 0 where no camera can be, also behind floors."""
        parts = [body(points) for body in self._bodies] + [-floor(points) for floor in self._floors]
        return np.asarray(reduce(np.minimum, parts, np.full(len(points), np.inf)))

    def reaches(self, along: tuple[Vector, Vector, Vector], ways: Ways) -> list[float]:
        """As of every `Framed`."""
        towards = np.array(ways) @ np.array(along)
        found = self._searched(towards) if self._bodies else np.full(len(ways), -np.inf)
        blocks = self._blocks
        if not blocks and not np.isfinite(found).all():
            blocks = [self._otherwise]
        for block in blocks:
            offset = towards @ (np.array(block.center) - self.center)
            found = np.maximum(found, offset + block.reaches(along, ways))
        return [float(each) for each in found]

    def _searched(self, towards: Floats) -> Floats:
        """How far it reaches from the middle of its ball, times the lengths of these vectors; -inf: there is nothing.

        They are pairs, of opposite sides.
        """
        # Cubes of which none can hold anything are left out; the others are divided, those first that reach farthest.
        lengths = np.linalg.norm(towards, axis=1)
        side = 2 * self.radius / _FIRST
        # Not where formulas are symmetrical, since they fold there and their slopes cancel out.
        steps = side * (np.arange(_FIRST + 1)[:, None] - _FIRST / 2 + np.array(_ASKEW))
        open_cubes = self._near(np.array(list(product(*steps.T))), np.array(side))
        least: Floats = np.full(len(towards), -np.inf)
        tried = 0
        while True:
            cubes, sides, away = open_cubes
            if not len(cubes):
                # (If there never was anything, opposite sides lie in the wrong order.)
                there = bool((least.reshape(-1, 2).sum(axis=1) > 0).all())
                return least if there else np.full(len(towards), -np.inf)
            out, around = cubes @ towards.T, sides[:, None] * (np.sqrt(3) / 2) * lengths
            surely = out - _LOOSE * away[:, None] * lengths
            least = np.maximum(least, surely.max(axis=0))
            width = np.repeat(least.reshape(-1, 2).sum(axis=1), 2)
            farther = out + around > least + _FINE * width
            if tried > _MOST_CUBES or not farther.any():
                return least
            chosen = np.zeros(len(cubes), bool)
            for column in range(len(lengths)):
                places = np.flatnonzero(farther[:, column])
                for order in (out + around, surely):
                    chosen[places[np.argsort(-order[places, column], kind="stable")[:_DIVIDED]]] = True
            kept, halves = farther.any(axis=1) & ~chosen, sides[chosen] / 2
            parts = (cubes[chosen][:, None] + halves[:, None, None] * _CORNERS).reshape(-1, 3)
            tried += len(parts)
            more = self._near(parts, np.repeat(halves, len(_CORNERS)))
            open_cubes = tuple(
                np.concatenate([old[kept], new]) for old, new in zip(open_cubes, more, strict=True)
            )

    def _near(self, cubes: Floats, sides: Floats) -> tuple[Floats, ...]:
        """Those cubes that may hold some of it: middles, sides, and how far the middles are away."""
        with np.errstate(all="ignore"):
            away = self.away(cubes + self.center)
        sides = np.broadcast_to(sides, away.shape)
        near = away < sides * (np.sqrt(3) / 2)
        return cubes[near], sides[near], np.maximum(away[near], 0)


def _set_of(scene: Shown) -> Away:
    """The scene's formula and what is joined to it, within the bounds."""
    center, radius = scene.bounds
    own = getattr(scene.renderer, "step_scale", None)
    ball = (
        scene.bounds
        if getattr(scene.renderer, "bounds", None) is not None
        else (scene.chain.center, scene.chain.radius)
    )
    found = _formula(scene.chain, scene.formula.iterations, own, ball, lambda points: points, 1.0)
    for name, each in scene.joined.items():
        if isinstance(each, FormulaObject):
            chain = scene.joined_chains[name]
            around = each.ball(chain.center, chain.radius)
            more = _formula(chain, each.formula.iterations, own, around, _own_places(each), each.scale)
        elif isinstance(each, Level) and each.join in ("union", "smooth_union"):
            continue  # a floor without an end
        else:
            assert isinstance(each, Simple)
            more = each.away
        alone = [plane for plane in scene.cut_planes if name in plane.cut_objects and not plane.set]
        found = _joined(found, _cut(more, alone), each)
    box = getattr(scene.renderer, "box", None)
    if box is not None:
        found = _within_box(found, np.array(box.center), np.array(box.sides) / 2)
    return _within_ball(found, np.array(center), radius)


def _formula(
    chain: Chain, iterations: int, step_scale: float | None, ball: Ball, own: Away, scale: float
) -> Away:
    center, radius = np.array(ball[0]), ball[1]
    limit = min(iterations, _MOST_APPLICATIONS)
    factor = scale * (chain.step_scale if step_scale is None else step_scale)

    def away(points: Floats) -> Floats:
        # (What is no number is beyond all that the formula is made for.)
        distance = factor * reference.distance(chain, own(points), limit)[0]
        return np.asarray(np.fmax(distance, np.linalg.norm(points - center, axis=1) - radius))

    return away


def _own_places(each: FormulaObject) -> Away:
    axes, middle = np.array(turned_axes(each.rotation)), np.array(each.position)
    return lambda points: (points - middle) @ axes.T / each.scale


def _within_ball(body: Away, center: Floats, radius: float) -> Away:
    return lambda points: np.maximum(body(points), np.linalg.norm(points - center, axis=1) - radius)


def _within_box(body: Away, center: Floats, half: Floats) -> Away:
    return lambda points: np.maximum(body(points), (np.abs(points - center) - half).max(axis=1))


def _joined(first: Away, second: Away, by: Joined) -> Away:
    if by.join == "cut":
        return lambda points: np.maximum(first(points), -second(points))
    if by.join == "intersection":
        return lambda points: np.maximum(first(points), second(points))
    if by.join == "union":
        return lambda points: np.minimum(first(points), second(points))

    def flowing(points: Floats) -> Floats:
        a, b = first(points), second(points)
        share = np.maximum(by.smoothness - np.abs(a - b), 0) / by.smoothness
        return np.asarray(np.minimum(a, b) - 0.25 * by.smoothness * share**2)

    return flowing


def _cut(body: Away, planes: Sequence[CutPlane]) -> Away:
    """What planes leave of a body."""
    found = body
    for plane in planes:
        placed, rise = plane.plane.placed, min(0.0, (plane.count - 1) * plane.spacing)
        found = _behind(found, np.array(placed.center), np.array(placed.normal), rise)
    return found


def _behind(body: Away, center: Floats, normal: Floats, rise: float) -> Away:
    return lambda points: np.maximum(body(points), (points - center) @ normal - rise)


def _hides(each: ObjectBase, scene: Shown) -> bool:
    """Whether it is a floor through which nothing is seen."""
    if not isinstance(each, Level) or (
        isinstance(each, Joined) and each.join not in ("union", "smooth_union")
    ):
        return False
    material = scene.materials.get(each.material or "")
    return material is None or material.blend is not None or not material.transmission.has("weight")


def _on_side(each: ObjectBase, eye: Vector) -> Away:
    """How far points are on the other side of a floor than the eye."""
    assert isinstance(each, Level)
    normal, position = np.array(each.normal) / np.linalg.norm(each.normal), np.array(each.position)
    side = -1.0 if (np.array(eye) - position) @ normal > 0 else 1.0
    return lambda points: np.asarray(side * ((points - position) @ normal))
