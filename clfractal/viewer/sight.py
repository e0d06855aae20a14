"""What a picture shows, as places in space: where to put things, and what orbits turn about.

Places in the picture are pixels from its upper left corner, lengths scene units.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import isfinite
from typing import cast

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View, scene_view
from clfractal.integrators.plan import PlannedView
from clfractal.scene.model import Scene
from clfractal.scene.stance import Extent
from clfractal.viewer.display import Shown
from clfractal.viewer.pointer import Floats, Size, point_at, project, ray_at

Area = tuple[float, float, float, float]
"""Left, top, right and bottom."""

# Of a picture a grid of so many places in each direction is looked at.
_GRID = 48
# A new light: how far aside, and from the rim, parts of the free part; it is before all that is seen but this part, by so
# much of the way to the eye.
_ASIDE, _RIM, _NEARLY, _TOWARDS = 0.33, 0.06, 0.1, 0.25
# A floor is seen in so much of the free part of a picture.
_LEAST_FLOOR, _MOST_FLOOR = 0.04, 0.85


@dataclass(frozen=True, slots=True, eq=False)
class Sight:
    """A picture and what it shows.

    Attributes:
        view: from where it is seen.
        size: width and height, pixels.
        depths: along the view's axis from its origin, shape (rows, columns), infinite where nothing is; None: nothing is
            known yet.
        free: the part that no panel covers.
        body: what the scene shows.
        divider: pixels, in each direction, that one depth stands for.
    """

    view: View
    size: Size
    depths: Floats | None
    free: Area
    body: Extent
    divider: int = 1

    @property
    def middle(self) -> tuple[float, float]:
        """The middle of the free part."""
        left, top, right, bottom = self.free
        return (left + right) / 2, (top + bottom) / 2

    def depth_at(self, x: float, y: float) -> float:
        """The depth that a place shows; infinite outside the picture."""
        if self.depths is None or not 0 <= x < self.size[0] or not 0 <= y < self.size[1]:
            return float("inf")
        rows, columns = self.depths.shape
        row, column = int(y / self.divider), int(x / self.divider)
        return float(self.depths[min(row, rows - 1), min(column, columns - 1)])

    def nearest(self, x: float, y: float, radius: float) -> float:
        """The least depth in a disc about a place, which is so many pixels in radius; infinite where nothing is."""
        if self.depths is None or not 0 <= x < self.size[0] or not 0 <= y < self.size[1]:
            return float("inf")
        rows, columns = self.depths.shape
        (left, top), (right, bottom) = (
            np.clip((np.array([x, y]) + sign * radius) / self.divider, 0, (columns - 1, rows - 1)).astype(int)
            for sign in (-1, 1)
        )
        across = (np.arange(left, right + 1) + 0.5) * self.divider - x
        down = (np.arange(top, bottom + 1) + 0.5) * self.divider - y
        # A coarse pixel counts if any of it may lie in the disc.
        reach = radius + 0.71 * self.divider
        inside = across[None, :] ** 2 + down[:, None] ** 2 <= reach**2
        return float(self.depths[top : bottom + 1, left : right + 1][inside].min(initial=np.inf))

    def pixel(self, depth: float) -> float:
        """The length of a pixel at a depth."""
        size = self.view.height / self.size[1]
        if self.view.eye is None:
            return size
        plane = float((self.view.center - self.view.eye) @ self.view.axis)
        return size * self._from_eye(depth) / plane

    @property
    def usual_depth(self) -> float:
        """Where nothing else is known: the depth of the body's middle, or of the view's plane if that is not in front."""
        depth = float((np.array(self.body.center) - self.view.origin) @ self.view.axis)
        return depth if self._from_eye(depth) > 0.05 * self.body.radius else self._plane_depth

    # Places

    def beside(self, x: float, y: float, radius: float) -> tuple[Floats, float]:
        """Middle and radius of a ball that is seen whole at a place, so many pixels large: right before what is there."""
        ahead = self.nearest(x, y, radius)
        if not isfinite(ahead):
            depth = self.usual_depth
        elif self.view.eye is None:
            depth = ahead - radius * self.pixel(ahead)
        else:
            # depth + radius = ahead, of which the radius grows with the depth.
            slope = radius * self.pixel(ahead) / self._from_eye(ahead)
            depth = ahead - self._from_eye(ahead) * slope / (1 + slope)
        return point_at(self.view, x, y, self.size, depth), radius * self.pixel(depth)

    def subject(self) -> Floats:
        """What the picture is about: what is seen at the body's middle, else in the free part's, else in the picture's."""
        x, y, _ = project(self.view, self.body.center, self.size)
        for place in ((x, y), self.middle, (self.size[0] / 2, self.size[1] / 2)):
            depth = self.depth_at(*place)
            if isfinite(depth):
                return point_at(self.view, *place, self.size, depth)
        return self.center()

    def center(self) -> Floats:
        """The middle of the body if it is in the picture; else of what is seen; else, in an empty picture, of the body."""
        middle = np.array(self.body.center, float)
        x, y, depth = project(self.view, middle, self.size)
        if 0 <= x <= self.size[0] and 0 <= y <= self.size[1] and self._from_eye(depth) > 0:
            return middle
        seen = self.points((0.0, 0.0, float(self.size[0]), float(self.size[1])))
        return cast(Floats, seen.mean(axis=0) if len(seen) else middle)

    def pivot(self) -> Floats:
        """What is turned about where the pointer shows nothing: what is at the picture's middle, else `center`."""
        x, y = self.size[0] / 2, self.size[1] / 2
        depth = self.depth_at(x, y)
        return point_at(self.view, x, y, self.size, depth) if isfinite(depth) else self.center()

    def points(self, area: Area) -> Floats:
        """Points that are seen in a part of the picture, shape (n, 3)."""
        x, y = _grid(area)
        depth = np.array([self.depth_at(*place) for place in zip(x, y, strict=True)])
        there = np.isfinite(depth)
        return self.view.points_at(x[there], y[there], self.size, depth[there])

    def floor(self, up: npt.ArrayLike = (0.0, 0.0, 1.0)) -> float:
        """How high a level plane is that is seen, and does not hide all else, along a unit vector from the origin.

        It is below the body; or below what is seen of it; or it fills, as water would, the deeper parts of that.
        """
        above = np.asarray(up, float)
        heights = [float(above @ self.body.center) - self.body.radius]
        seen = self.points(self.free) @ above
        if len(seen):
            # A little beyond, so that the plane does not lie in what it is to be beside.
            beyond = 0.01 * float(np.ptp(seen))
            heights += [float(seen.min()) - beyond, *map(float, np.quantile(seen, (0.25, 0.5, 0.75)))]
            heights.append(float(seen.max()) + beyond)
        shares = [self._share_of_plane(height, above) for height in heights]
        fit = [n for n, share in enumerate(shares) if _LEAST_FLOOR <= share <= _MOST_FLOOR]
        return heights[fit[0] if fit else 0]

    def light(self) -> tuple[Floats, Floats]:
        """Where a light is that is seen and lights what is seen: its place, and a point that it looks at.

        It is to the upper left of the free part's middle, and before nearly all that is seen.
        """
        point, (left, top, right, bottom) = self.subject(), self.free
        seen = (self.points(self.free) - self.view.origin) @ self.view.axis
        depth = float(np.quantile(seen, _NEARLY)) if len(seen) else self.usual_depth
        aside = _ASIDE * (bottom - top)
        x = max(self.middle[0] - aside, left + _RIM * (right - left))
        y = max(self.middle[1] - aside, top + _RIM * (bottom - top))
        for _ in range(20):
            away = self._from_eye(depth) if self.view.eye is not None else self.pixel(depth) * self.size[1]
            depth -= _TOWARDS * away
            if depth < self.nearest(x, y, _RIM * self.size[1]):
                break
        return point_at(self.view, x, y, self.size, depth), point

    def _share_of_plane(self, height: float, up: Floats) -> float:
        """How much of the free part would show a plane."""
        x, y = _grid(self.free)
        count = 0
        for place in zip(x, y, strict=True):
            origin, way = ray_at(self.view, *place, self.size)
            along = float(way @ up)
            far = (height - float(origin @ up)) / along if along != 0 else -1.0
            depth = float((origin + far * way - self.view.origin) @ self.view.axis)
            # What is very far away is but a line at the horizon.
            near = depth < self.usual_depth + 8 * self.body.radius
            count += far > 0 and near and depth < self.depth_at(*place)
        return count / len(x)

    @property
    def _plane_depth(self) -> float:
        return float((self.view.center - self.view.origin) @ self.view.axis) or self.body.radius

    def _from_eye(self, depth: float) -> float:
        """A depth, measured from the eye's plane."""
        if self.view.eye is None:
            return depth
        return depth - float((self.view.eye - self.view.origin) @ self.view.axis)


def sight_of(scene: Scene, shown: Shown | None, free: Area = (0.0, 0.0, 1.0, 1.0)) -> Sight:
    """What is seen of a scene; of several views, in the first that shows it in space.

    Args:
        shown: the newest picture; None: there is none yet.
        free: the part that no panel covers, as parts of the picture's width and height.
    """
    if shown is None:
        size = _size(scene)
        return Sight(scene_view(scene), size, None, _part(free, size), scene.extent)
    views = shown.frame.views
    number = next((n for n, each in enumerate(views) if not each.scene.renderer.is_flat), 0)
    return sight_in(scene, views[number], shown.depths[number], free)


def sight_in(
    scene: Scene, view: PlannedView, depths: npt.NDArray[np.float32], free: Area = (0.0, 0.0, 1.0, 1.0)
) -> Sight:
    """What one view of a picture shows; see `sight_of`."""
    size = _size(view.scene)
    known = depths.astype(np.float64)
    return Sight(view.camera, size, known, _part(free, size), scene.extent, view.plan.divider)


def _part(free: Area, size: Size) -> Area:
    return free[0] * size[0], free[1] * size[1], free[2] * size[0], free[3] * size[1]


def _size(scene: Scene) -> Size:
    return scene.image.width, scene.image.height


def _grid(area: Area) -> tuple[Floats, Floats]:
    """Places of a part of the picture, in rows: x and y, each of shape (n,)."""
    left, top, right, bottom = area
    parts = (np.arange(_GRID) + 0.5) / _GRID
    x, y = np.meshgrid(left + parts * (right - left), top + parts * (bottom - top))
    return x.ravel(), y.ravel()
