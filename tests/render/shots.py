"""Scenes whose pictures are known from mathematics, and rendering them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, camera_view
from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.engine.engine import Engine
from clfractal.engine.job import Identity, Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.run import Progress, WorkItem, run
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.tiled import TiledStore
from clfractal.images.tiles import TILE, Tile
from clfractal.integrators.lanes import best_lanes
from clfractal.integrators.plan import Plan, PlannedView, make_plan
from clfractal.scene.model import Scene
from clfractal.scene.stereo import MIDDLE, Eye
from tests.scenes import BALL_ITERATIONS

Floats = npt.NDArray[np.float64]

CHANNELS = (
    "R",
    "G",
    "B",
    "A",
    "Z",
    "N.X",
    "N.Y",
    "N.Z",
    "P.X",
    "P.Y",
    "P.Z",
    "iterations",
    "steps",
    "samples",
)

BALL_RADIUS = 4.0 ** (2.0**-BALL_ITERATIONS)
BALL: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x*x - y*y - z*z", "2*x*y", "2*x*z"],
    "add": "none",
    "degree": 2,
    "bounds": {"center": [0, 0, 0], "radius": 1.5},
    "bailout": 4,
}
# A map that does nothing, and a solid whose distance is known.
SOLID_RADIUS = 0.8
SOLID_SPHERE: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "shape": f"sqrt(x*x + y*y + z*z) - {SOLID_RADIUS}",
    "bounds": {"center": [0, 0, 0], "radius": 1},
    "bailout": 30,
}
# With a scalar derivative the march takes its other way, without the proof of hits.
QUICK_BALL = {**BALL, "derivative": "2*sqrt(x*x + y*y + z*z)*dr"}
# A box with its top at z = 0 and a sphere that hovers over it, as the last solid of a map that does nothing.
SPHERE_CENTER, SPHERE_RADIUS = np.array([0.2, -0.1, 0.9]), 0.3
SOLIDS: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x", "y", "z"],
    "add": "none",
    "degree": 1,
    "let": {"qx": "abs(x) - 1.2", "qy": "abs(y) - 1.2", "qz": "abs(z + 0.25) - 0.25"},
    "shape": "min(sqrt((x - 0.2)**2 + (y + 0.1)**2 + (z - 0.9)**2) - 0.3,"
    " sqrt(max(qx, 0)**2 + max(qy, 0)**2 + max(qz, 0)**2) + min(max(qx, qy, qz), 0))",
    "bounds": {"center": [0, 0, 0], "radius": 2},
    "bailout": 10,
}

PERSPECTIVE = {"position": [1.5, -2.5, 1.2], "target": [0.1, 0.05, 0], "up": [0.1, 0, 1], "fov": 48}
ORTHOGRAPHIC = {"projection": "orthographic", "position": [1, -2, 1.5], "target": [0, 0.1, 0], "height": 2.6}
CAMERAS = {"perspective": PERSPECTIVE, "orthographic": ORTHOGRAPHIC}


def plan_of(scene: Scene, device: Device, precision: Precision = "float32", **settings: Any) -> Plan:
    settings = {"lanes": None, "channels": CHANNELS, **settings}
    if settings["lanes"] is None:
        settings["lanes"] = best_lanes(device, precision)
    return make_plan(scene, precision=precision, **settings)


_executors: dict[Device, LocalExecutor] = {}
_engines: dict[Device, Engine] = {}


def job_of(scene: Scene, plan: Plan, device: Device, eye: Eye = MIDDLE) -> Job:
    """A job of one view, planned as one likes."""
    return Job(scene, (PlannedView(scene, plan, eye),), Identity(0), plan.channels, device.info, "")


def executor_of(device: Device, budget_seconds: float | None = None) -> LocalExecutor:
    """An executor that all tests share, or one of its own with another budget."""
    if budget_seconds is not None:
        return LocalExecutor(device, budget_seconds=budget_seconds)
    return _executors.setdefault(device, LocalExecutor(device))


def render_planned(
    scene: Scene,
    plan: Plan,
    device: Device,
    store: TiledStore,
    eye: Eye = MIDDLE,
    *,
    budget_seconds: float | None = None,
    **settings: Any,
) -> Progress:
    """Renders what a store lacks of a scene with one view; settings as for `run`."""
    executor = executor_of(device, budget_seconds)
    return run(job_of(scene, plan, device, eye), [store], executor, **settings)


def render_tile(scene: Scene, plan: Plan, device: Device, tile: Tile) -> npt.NDArray[np.float32]:
    """One tile on its own, by an executor that knows nothing of the others: shape (channels, height, width)."""
    item = WorkItem(0, np.array([tile.index], np.int32), (0, plan.samples))
    results = list(executor_of(device).execute(job_of(scene, plan, device), [item]))
    (whole,) = [result for result in results if len(result.tiles)]
    assert whole.tiles.tolist() == [tile.index]
    top, left = tile.y % TILE, tile.x % TILE
    return np.asarray(whole.framebuffer[0][:, top : top + tile.height, left : left + tile.width])


def shoot(
    scene: Scene | tuple[Scene, Eye], device: Device, precision: Precision = "float32", **settings: Any
) -> Framebuffer:
    """The picture of a scene, or of one as an eye sees it; settings as for `make_plan`, and a budget."""
    scene, eye = scene if isinstance(scene, tuple) else (scene, MIDDLE)
    budget_seconds = settings.pop("budget_seconds", None)
    plan = plan_of(scene, device, precision, **settings)
    framebuffer = Framebuffer(plan.channels, (scene.image.width, scene.image.height), plan.region)
    render_planned(scene, plan, device, framebuffer, eye, budget_seconds=budget_seconds)
    return framebuffer


def shoot_whole(scene: Scene, device: Device, **settings: Any) -> Framebuffer:
    """The picture of a scene of several views, all of whose channels are made; settings as for `Engine.render`."""
    return engine_of(device).render(scene, **{"precision": "float32", "channels": CHANNELS, **settings})


def engine_of(device: Device) -> Engine:
    """An engine that all tests share."""
    return _engines.setdefault(device, Engine(device))


def stacked(framebuffer: Framebuffer, names: Sequence[str] = CHANNELS) -> npt.NDArray[np.float32]:
    """Channels as one array of shape (height, width, channels)."""
    return np.stack([framebuffer[name] for name in names], axis=-1)


def points_of(framebuffer: Framebuffer) -> Floats:
    return stacked(framebuffer, ("P.X", "P.Y", "P.Z")).astype(float)


def normals_of(framebuffer: Framebuffer) -> Floats:
    return stacked(framebuffer, ("N.X", "N.Y", "N.Z")).astype(float)


def rays(
    scene: Scene, across: float | Floats = 0.5, below: float | Floats = 0.5
) -> tuple[Floats, Floats, Floats]:
    """Origins, directions (length 1) and pixel footprints per unit of distance (perspective) or absolute
    (orthographic), written down from the definition of a pinhole and a parallel camera; shapes (height, width, 3)
    and (height, width)."""
    camera, width, height = scene.camera, scene.image.width, scene.image.height
    position, target = np.array(camera.position), np.array(camera.target)
    forward = (target - position) / np.linalg.norm(target - position)
    right = np.cross(forward, camera.up)
    right /= np.linalg.norm(right)
    up = np.cross(right, forward)
    x = (np.arange(width)[None, :] + across - width / 2) / height + np.zeros((height, 1))
    y = (height / 2 - np.arange(height)[:, None] - below) / height + np.zeros((1, width))
    if camera.projection == "perspective":
        side = 2 * np.tan(np.radians(camera.fov) / 2)
        toward = forward + side * (x[..., None] * right + y[..., None] * up)
        length = np.linalg.norm(toward, axis=-1)
        return np.broadcast_to(position, toward.shape), toward / length[..., None], side / height / length
    origin = position + camera.height * (x[..., None] * right + y[..., None] * up)
    footprint = np.full((height, width), camera.height / height)
    return origin, np.broadcast_to(forward, origin.shape), footprint


def to_sphere(
    origin: Floats, direction: Floats, center: npt.ArrayLike, radius: float
) -> tuple[Floats, Floats]:
    """Distance along rays to a sphere (inf where they miss), and the least distance of each ray from its centre."""
    offset = origin - np.asarray(center)
    middle = -(offset * direction).sum(-1)
    nearest = np.linalg.norm(offset + middle[..., None] * direction, axis=-1)
    half = np.sqrt(np.maximum(radius**2 - nearest**2, 0))
    return np.where(nearest < radius, middle - half, np.inf), nearest


def view_of(scene: Scene) -> View:
    return camera_view(scene.camera, scene.image.width, scene.image.height)


def colors(framebuffer: Framebuffer) -> Floats:
    return stacked(framebuffer, ("R", "G", "B")).astype(float)


def degrees(a: npt.NDArray[Any], b: npt.NDArray[Any]) -> Floats:
    """The angle between vectors of length 1, however small."""
    return np.asarray(np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1))))


@dataclass(frozen=True)
class Beside:
    """A picture beside what its rays meet by an oracle, in pixels in which both find something.

    Attributes:
        hit: the pixels of the picture that show something.
        both: those in which the oracle does, too.
        points: of the oracle, in all pixels.
        off: how far the picture's places are from these.
        turned: how far its normals, of length 1, are from the oracle's.
        deep: how far its depths are from the oracle's, across a surface with that normal.
        facing: the cosine between that normal and the ray.
    """

    hit: npt.NDArray[np.bool_]
    both: npt.NDArray[np.bool_]
    points: Floats
    off: Floats
    turned: Floats
    deep: Floats
    facing: Floats


def beside(framebuffer: Framebuffer, scene: Scene, t: Floats, normal: Floats, most: int = 3) -> Beside:
    """Distances t along rays, infinite where they meet nothing, and normals there. At a rim rays may go to either side: of
    so many pixels one finds something, and the other does not."""
    origin, direction, _ = rays(scene)
    hit, right = framebuffer["A"] == 1, np.isfinite(t)
    assert (hit != right).sum() <= most
    both, view = hit & right, view_of(scene)
    points = origin + np.where(both, t, 0)[..., None] * direction
    depth = np.abs((points - view.origin) @ view.axis - framebuffer["Z"])
    facing = np.abs((normal * direction).sum(-1))[both]
    return Beside(
        hit,
        both,
        points,
        np.linalg.norm(points_of(framebuffer) - points, axis=-1)[both],
        np.linalg.norm(normals_of(framebuffer) - normal, axis=-1)[both],
        depth[both] * facing,
        facing,
    )
