"""What is asked of every solid, against its distance in NumPy: alone, joined, in voxels, of glass, as a light."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import pytest

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from clfractal.schema.shape import Solid
from tests import scenes
from tests.render.emitter_choices import LUMINANCE, Hits, axes_of, choices, expected, moments, shining
from tests.render.glass_scenes import colors_of, glass
from tests.render.glass_scenes import scene as glass_scene
from tests.render.joined_oracle import Distance, Floats, agree, ball, marched, normal_at
from tests.render.objects_oracle import NOWHERE, rotation_of
from tests.render.shots import (
    BALL,
    CAMERAS,
    PERSPECTIVE,
    Beside,
    beside,
    rays,
    shoot,
)
from tests.variants import combinations, one_of
from tests.voxels.grids import ROUNDED, filled, voxel_points


@dataclass(frozen=True)
class Known:
    """A solid, and how far a point of its own space is from it before it is scaled; below 0 inside."""

    values: dict[str, Any]
    own: Distance
    rotation: list[float] = field(default_factory=lambda: [20.0, -35.0, 50.0])
    position: list[float] = field(default_factory=lambda: [0.1, 0.2, -0.1])
    scale: list[float] = field(default_factory=lambda: [1.0, 1.0, 1.0])

    @property
    def written(self) -> dict[str, Any]:
        """As in a scene."""
        return {**self.values, "rotation": self.rotation, "position": self.position, "scale": self.scale}

    def distance(self, points: Floats) -> Floats:
        """From points of the scene; with unequal scales not more than it is."""
        x, y, z = self.rotation
        turned = (points - self.position) @ rotation_of((x, y, z))
        return min(self.scale) * self.own(turned / self.scale)

    def met(self, origin: Floats, direction: Floats) -> Floats:
        """How far rays go to it, or from inside to its wall; infinite where they do not meet it."""
        begin = np.broadcast_to(origin, direction.shape).reshape(-1, 3)
        ways = direction.reshape(-1, 3)
        t, found = np.zeros(len(ways)), np.full(len(ways), np.inf)
        side = np.sign(self.distance(begin))
        going = np.arange(len(ways))
        for _ in range(1500):
            step = side * self.distance(begin + t[:, None] * ways[going])
            ended = step < 1e-10
            found[going[ended]] = t[ended]
            t = t + step
            left = ~ended & (t < 50)
            going, begin, side, t = going[left], begin[left], side[left], t[left]
        return found.reshape(direction.shape[:-1])


def solid_of(known: Known) -> Solid:
    """The object of a scene."""
    (it,) = scenes.scene_of(NOWHERE, PERSPECTIVE, objects={"it": known.written}).objects.values()
    assert isinstance(it, Solid)
    return it


def check_inside(known: Known) -> None:
    """What it holds, and the ball around it."""
    it = solid_of(known)
    points = np.random.default_rng(5).uniform(-1.3, 1.3, (4000, 3)) @ _axes(it) + known.position
    far = known.distance(points)
    held = np.array([it.holds(tuple(point)) for point in points.tolist()])
    clear = np.abs(far) > 1e-9
    assert held.sum() > 20
    assert (held == (far < 0))[clear].all()
    assert (np.linalg.norm(points[held] - it.ball[0], axis=-1) <= it.ball[1]).all()
    away = it.away(points)
    assert ((away < 0) == held)[clear].all()
    check_away(it, points[~held], far[~held])
    # Nor is a place said to be deeper inside than it is.
    for way in np.random.default_rng(7).normal(size=(40, 3)):
        moved = points[held] + 0.999 * away[held, None] * (way / np.linalg.norm(way))
        assert (known.distance(moved) <= 1e-9).all()


def check_away(it: Solid, points: Floats, far: Floats) -> None:
    """How far it says that points outside are away: no step of that length comes in, and it is no small part of it."""
    away = it.away(points)
    ways = np.random.default_rng(6).normal(size=points.shape)
    ways /= np.linalg.norm(ways, axis=1)[:, None]
    assert (it.away(points + 0.999 * away[:, None] * ways) >= 0).all()
    assert (4 * away >= far - 1e-12).all()


def _axes(it: Solid) -> Floats:
    """Its half axes, as rows."""
    return np.array(it.axes)


def check_alone(
    known: Known, device: Device, camera: str, precision: Precision, lanes: int | None, error: float = 5e-6
) -> None:
    """Where rays meet it, and its normals."""
    scene = scenes.scene_of(
        NOWHERE, CAMERAS[camera], (48, 40), objects={"it": known.written}, background=[0, 0, 0]
    )
    found = met_by(shoot(scene, device, precision, lanes=lanes), scene, known.met, known.distance)
    assert found.both.sum() > 100
    assert found.deep.max() < error
    # (Of rays that do not graze it.)
    assert found.off[found.facing > 0.2].max() < 10 * error
    # At an edge both faces are right.
    assert (found.turned > 1e-3).sum() <= 3 + 0.01 * found.both.sum()


def met_by(framebuffer: Framebuffer, scene: Scene, met: Hits, distance: Distance) -> Beside:
    """A picture beside a march in NumPy, which may not end at a rim."""
    origin, direction, _ = rays(scene)
    t = met(origin, direction)
    points = origin + np.where(np.isfinite(t), t, 0)[..., None] * direction
    return beside(framebuffer, scene, t, normal_at(distance, points))


def check_walls(known: Known, device: Device, eye: list[float]) -> None:
    """From inside its walls are seen."""
    camera = {"position": eye, "target": np.add(eye, [1, 1, 0.3]).tolist(), "fov": 100}
    scene = scenes.scene_of(NOWHERE, camera, (40, 32), objects={"it": known.written})
    found = met_by(shoot(scene, device), scene, known.met, known.distance)
    assert found.both.all()
    assert found.off.max() < 8e-5


def check_opened(known: Known, device: Device) -> None:
    """A plane through its middle takes away what is in front of it, and shows a face where it goes through."""
    normal = np.array([-0.3, -0.8, 0.5]) / np.linalg.norm([-0.3, -0.8, 0.5])
    plane = {
        "plane": {"center": known.position, "normal": normal.tolist()},
        "cut": True,
        "set": False,
        "opacity": 0,
    }
    scene = scenes.scene_of(
        NOWHERE,
        PERSPECTIVE,
        (48, 40),
        objects={"it": known.written},
        cut_planes=[{**plane, "objects": ["it"]}],
    )

    def left(points: Floats) -> Floats:
        return np.asarray(np.maximum(known.distance(points), (points - known.position) @ normal))

    found = met_by(shoot(scene, device), scene, lambda o, d: marched(left, o, d), left)
    assert found.both.sum() > 60
    assert np.percentile(found.off, 98) < 1e-4


def check_joined(known: Known, device: Device, join: str) -> None:
    """As a part of the set: the ball of `tests/render/shots.py`."""

    def distance(points: Floats) -> Floats:
        more = known.distance(points)
        joined = {"cut": np.maximum(ball(points), -more), "intersection": np.maximum(ball(points), more)}
        return joined[join]

    agree(scene=joined_scene(known, join), device=device, distance=distance)


def joined_scene(known: Known, join: str) -> Scene:
    """The ball and the solid."""
    return scenes.scene_of(BALL, PERSPECTIVE, (112, 96), objects={"it": {**known.written, "join": join}})


def check_voxels(known: Known, join: str) -> None:
    """Which voxels are filled."""
    renderer = {"type": "volume", "box": {"size": 4.0}, "resolution": 40}
    scene = scenes.scene_of(
        BALL, PERSPECTIVE, None, renderer=renderer, objects={"it": {**known.written, "join": join}}
    )
    grid = filled(scene)
    at = voxel_points(grid.place)
    one, other = ball(at) < 0, known.distance(at) < 0
    right = one & ~other if join == "cut" else one & other if join == "intersection" else one | other
    assert (one & other).sum() > 30
    assert (grid.dense().astype(bool) != right).mean() <= ROUNDED


def check_glass(known: Known, roughness: float) -> None:
    """Glass that absorbs nothing is not seen before white."""
    body = {**known.written, "position": [0, 0, 0], "material": "glass"}
    found = colors_of(glass_scene({"body": body}, {"glass": glass(roughness)}), 256 if roughness else 16)
    assert abs(found.mean() - 1) < 0.005
    seen = colors_of(glass_scene({"body": body}, {"glass": glass(roughness)}, background=[0, 0, 0]), 4)
    assert seen.max() == 0


def check_choices(known: Known, own: list[float], precision: Precision, lanes: int) -> None:
    """Even light is found in all directions from a place, in half axes; what it hides of itself is in its own shadow."""
    lit = shining(known.written)
    point = np.array(known.position) + np.array(own) @ axes_of(lit)
    right, axis = expected(lit, point, known.met, 1 << 15)
    rows = choices(lit, point, precision, lanes)
    way, density, by_chance = rows[:, :3], rows[:, 3], rows[:, 4]
    far = np.linalg.norm(way, axis=1)
    directions = way / far[:, None]
    first = known.met(np.broadcast_to(point, directions.shape), directions)
    assert (np.abs(known.distance(point + way)) < 1e-5 * (1 + far)).all()
    asked = density > 0
    seen = asked & (np.abs(first / far - 1) < 1e-3)
    # (Beside rims a ray may pass.)
    facing = -(normal_at(known.distance, point + way) * directions).sum(-1)
    assert (asked == (facing > 0))[np.abs(facing) > 0.05].mean() > 0.999
    assert (first < far * (1 + 1e-3))[facing > 0.05].mean() > 0.999
    assert (np.abs(by_chance[seen] / density[seen] - 1) < 1e-2).mean() > 0.98
    brings = np.where(seen, 1 / np.where(asked, density, 1), 0)
    found = (moments(directions, axis) * brings[:, None]).mean(axis=0)
    spread = np.sqrt((moments(directions, axis) ** 2 * brings[:, None] ** 2).mean(axis=0))
    assert (np.abs(found - right) < 0.02 * spread).all(), (found, right)
    assert 0.1 < rows[0, 5] / LUMINANCE / min(right[0], math.pi) < 10


class Checks:
    """Where the kinds of a solid are, alone: tests of an element take them from here."""

    KINDS: ClassVar[dict[str, Known]]

    def pytest_generate_tests(self, metafunc: pytest.Metafunc) -> None:
        """A test has an argument of each table or list of its class, by the name in small letters."""
        for name in ("KINDS", "JOINED", "GLASS", "LAMPS", "POINTS"):
            if name.lower() in metafunc.fixturenames:
                given = getattr(self, name)
                values = given.values() if isinstance(given, dict) else given
                metafunc.parametrize(name.lower(), values, ids=list(given))

    def test_what_it_holds(self, kinds: Known) -> None:
        check_inside(kinds)

    @pytest.mark.parametrize("camera", CAMERAS)
    @pytest.mark.parametrize(
        ("precision", "lanes"), one_of(("float32", None), ("float32", 1), ("float64", 4))
    )
    def test_it_is_where_its_equation_is_zero(
        self, kinds: Known, camera: str, precision: Precision, lanes: int | None, device: Device
    ) -> None:
        check_alone(kinds, device, camera, precision, lanes)

    def test_a_plane_opens_it(self, kinds: Known, device: Device) -> None:
        """Also where the first part of a ray within is taken away, and the second is not."""
        check_opened(kinds, device)


class AllChecks(Checks):
    """And as parts of a set, of glass, and as lights.

    Attributes:
        GLASS, LAMPS: names of kinds.
        POINTS: of half axes, from where those that shine are seen, close to them too.
    """

    JOINED: ClassVar[dict[str, Known]]
    GLASS: ClassVar[tuple[str, ...]]
    LAMPS: ClassVar[tuple[str, ...]]
    POINTS: ClassVar[dict[str, list[float]]]

    @pytest.mark.parametrize("join", ["cut", "intersection"])
    def test_it_is_joined_to_the_set(self, joined: Known, join: str, device: Device) -> None:
        check_joined(joined, device, join)

    @pytest.mark.parametrize("join", ["union", "cut", "intersection"])
    def test_its_voxels(self, joined: Known, join: str) -> None:
        check_voxels(joined, join)

    @pytest.mark.parametrize("roughness", [0.0, *combinations([0.5])])
    def test_glass_is_not_seen_before_white(self, glass: str, roughness: float) -> None:
        check_glass(self.KINDS[glass], roughness)

    @pytest.mark.parametrize(("precision", "lanes"), one_of(("float32", 8), ("float32", 1), ("float64", 8)))
    def test_even_light_is_found_in_all_directions(
        self, lamps: str, points: list[float], precision: Precision, lanes: int
    ) -> None:
        check_choices(self.KINDS[lamps], points, precision, lanes)
