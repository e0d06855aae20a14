"""A first scene of a formula: iterations, a camera that sees all of it, and colours, by small previews."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import scene_view
from clfractal.engine.engine import Engine
from clfractal.engine.preview import points_of_depth
from clfractal.errors import SceneError, Where
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.checks import inside_solid
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.palettes import PALETTES

Floats = npt.NDArray[np.float64]

FOV = 40.0
"""Vertical angle of view, degrees."""
FOV_INSIDE = 60.0
"""The same from within a set that fills its bounds."""
SIZE = (1280, 720)
"""Pixels of the finished picture."""

# Pixels of a preview, which has the proportions of the picture.
_LOOK = (192, 108)
# The forms of a body tell how to frame it, not what is finer than a pixel of a preview.
_SOFTER = 3.67
# From where the set is looked at: azimuth and elevation, degrees.
_PLACES = ((35, 25), (-40, 20), (10, 35), (75, 15), (150, 30), (-100, 30), (25, 60))
# A set fills its bounds if that much of what is seen within wider ones (parts of the radius) lies beyond them: there it was
# only cut off. Of the library's formulas those that do have 0.17 and more, the others 0.08 and less.
_CUT_SHARE, _WIDER = 0.12, 1.1
# Such a set is looked at from among it: azimuth, elevation, and the distance from the middle in parts of the radius.
_INSIDE = ((0, 12), (40, 15), (80, 10), (130, 15), (-50, 20), (-100, 12))
_INSIDE_DISTANCES = (0.56, 0.4)
# What is nearest there: parts of the radius, the twentieth and the median of what is seen.
_NEAREST, _MIDDLE = 0.06, 0.2
# Fog inside: what lies a radius away is seen through so much of it.
_FOG = 0.45
# Part of the picture's height or width that the set fills.
_FILLED = 0.86
# Points of the outline that may lie outside, on each side: fine needles do not count.
_STRAY = 0.004
# Applications that are tried; the largest angle between the normals of neighbouring pixels that still is a form and not
# noise (the median, degrees); and the least part of the picture that the set has to cover: what is less is dust.
_COUNTS = (3, 4, 5, 6, 7, 8, 10, 12)
_ROUGHEST, _LEAST_COVERED = 18.0, 0.015
# Lightness that the lightest parts get.
_BRIGHT = 0.75
_NORMALS = ("A", "Z", "N.X", "N.Y", "N.Z")


@dataclass(frozen=True, slots=True)
class Framing:
    """What was found, scene units and degrees, in numbers that are short to write.

    Attributes:
        iterations: applications of the formula.
        target: the middle of what is seen.
        azimuth, elevation, distance: of the camera, as `camera.orbit`.
        lights: directions of a warm light and of a cool one, from behind the camera and from the side.
        palette: a name.
        scale, offset: of the palette, over the values that a trap at the origin has.
        exposure: stops.
        fog: density of a fog without which one sees the end of what is rendered; 0: the set is seen from outside.
    """

    iterations: int
    target: tuple[float, float, float]
    azimuth: float
    elevation: float
    distance: float
    lights: tuple[tuple[float, float, float], tuple[float, float, float]]
    palette: str
    scale: float
    offset: float
    exposure: float
    fog: float = 0.0

    def sections(self) -> dict[str, Any]:
        """The camera, lights, colours and exposure as plain sections of a scene."""
        warm, cool = (list(direction) for direction in self.lights)
        inside = self.fog > 0
        # Inside, light comes from nowhere that one can see; openness to all sides gives the form.
        shadow = {"shadow": False} if inside else {}
        behind = "#131822" if inside else {"top": "#2a3344", "bottom": "#0c0e13"}
        return {
            "image": {"width": SIZE[0], "height": SIZE[1]},
            "camera": {
                "orbit": {"azimuth": self.azimuth, "elevation": self.elevation, "distance": self.distance},
                "target": list(self.target),
                "fov": FOV_INSIDE if inside else FOV,
            },
            "lights": [
                {"direction": warm, "color": "#ffe2c4", "intensity": 1.6, **shadow},
                {"direction": cool, "color": "#8fb4ff", "intensity": 0.6, "shadow": False},
            ],
            "material": {"ambient": 0.12, "diffuse": 0.9, "specular": 0.25, "shininess": 40},
            "coloring": {
                "by": "trap",
                "palette": self.palette,
                "scale": self.scale,
                "offset": self.offset,
                "repeat": False,
            },
            "renderer": {"samples": 16, "ambient_occlusion": {"rays": 4}},
            "background": behind,
            **({"fog": {"color": behind, "density": self.fog}} if inside else {}),
            "output": {"exposure": self.exposure},
        }


def framed(formula: Mapping[str, Any], folder: Path, engine: Engine, *, name: str = "") -> Framing:
    """Looks at a formula and chooses how it is shown.

    Args:
        formula: a scene's `formula` section without `iterations`.
        folder: where formula files are looked for.
        name: chooses the palette: equal names get equal ones.

    Raises:
        SceneError, FormulaError, FileError: the formula is wrong, or nothing of it is seen.
        DeviceError, KernelBuildError: a preview failed.
    """
    finder = _Finder(formula, folder, engine)
    around = finder.around(*_PLACES[0])
    iterations = finder.iterations(around)
    inside = finder.is_cut(iterations, around)
    found = finder.inside() if inside else None
    if found is None:
        if inside:
            # A cut through fine details is but grain.
            inside, iterations = False, _COUNTS[0]
        found = finder.best(iterations, finder.cameras(iterations))
    if found is None:
        raise SceneError("nothing of it is seen within its bounds", Where("formula"))
    iterations, camera = found
    orbit = camera["orbit"]
    palettes = [each for each, it in PALETTES.items() if not it.periodic]
    scale, offset = finder.trap_range(iterations, camera)
    framing = Framing(
        iterations,
        tuple(camera["target"]),
        orbit["azimuth"],
        orbit["elevation"],
        orbit["distance"],
        _lights(finder.scene(iterations, camera)),
        palettes[sum(map(ord, name)) % len(palettes)],
        scale,
        offset,
        0.0,
        _short(-math.log(1 - _FOG) / finder.radius) if inside else 0.0,
    )
    return finder.exposed(framing)


class _Finder:
    """Looks at one formula."""

    def __init__(self, formula: Mapping[str, Any], folder: Path, engine: Engine) -> None:
        self.formula, self.folder, self.engine = formula, folder, engine
        start = load_scene({"version": 1, "formula": dict(formula), "camera": {}}, folder=folder)
        self.center, self.radius = start.bounds

    def scene(self, iterations: int, camera: Mapping[str, Any], **sections: Any) -> Scene:
        """A scene of the size of a preview."""
        data = {
            "version": 1,
            "formula": {**self.formula, "iterations": iterations},
            "camera": dict(camera),
            **sections,
            "image": {"width": _LOOK[0], "height": _LOOK[1], "reference_height": _LOOK[1] / _SOFTER},
        }
        return load_scene(data, folder=self.folder)

    def preview(self, scene: Scene, *channels: str) -> Framebuffer:
        return self.engine.render(scene, samples=1, channels=channels)

    def iterations(self, camera: Mapping[str, Any]) -> int:
        """The most applications of those that are tried that leave a form: neither noise nor dust."""
        found = _COUNTS[0]
        for count in _COUNTS:
            framebuffer = self.preview(self.scene(count, camera), *_NORMALS)
            if (framebuffer["A"] > 0.5).mean() < _LEAST_COVERED or _roughness(framebuffer) > _ROUGHEST:
                break
            found = count
        return found

    def is_cut(self, iterations: int, camera: Mapping[str, Any]) -> bool:
        """Whether the set goes on beyond its bounds, so that what is seen of them is a cut."""
        wider = {"bounds": {"center": list(self.center), "radius": _WIDER * self.radius}}
        points = self._points(self.scene(iterations, camera, renderer=wider))
        away = np.linalg.norm(points - np.array(self.center), axis=1)
        return bool(len(points)) and float((away > self.radius).mean()) > _CUT_SHARE

    def inside(self) -> tuple[int, dict[str, Any]] | None:
        """The best view from within the bounds, and its iterations; None if there is no room for a camera."""
        fewest = _COUNTS[0]
        for part in _INSIDE_DISTANCES:
            cameras = [
                self.around(azimuth, elevation, part * self.radius, FOV_INSIDE)
                for azimuth, elevation in _INSIDE
            ]
            best = self.best(fewest, filter(lambda camera: self._has_room(fewest, camera), cameras))
            if best is not None:
                # With more applications the set may come nearer to the camera.
                most = self.iterations(best[1])
                counts = [count for count in reversed(_COUNTS) if fewest < count <= most]
                return next((count for count in counts if self._has_room(count, best[1])), fewest), best[1]
        return None

    def best(self, iterations: int, cameras: Iterable[dict[str, Any]]) -> tuple[int, dict[str, Any]] | None:
        """The camera that sees most; None if there is none."""
        found = max(cameras, key=lambda camera: self.interest(iterations, camera), default=None)
        return None if found is None else (iterations, found)

    def _has_room(self, iterations: int, camera: Mapping[str, Any]) -> bool:
        """Whether a camera is outside the set, and not right before it."""
        scene = self.scene(iterations, camera)
        framebuffer = self.preview(scene, "Z", "A")
        depth = framebuffer["Z"][framebuffer["A"] > 0.5] / self.radius
        if inside_solid(scene, [scene.camera.position])[0] or len(depth) < 0.3 * framebuffer["A"].size:
            return False
        near, middle = np.percentile(depth, (5, 50))
        return bool(near > _NEAREST and middle > _MIDDLE)

    def _points(self, scene: Scene) -> Floats:
        framebuffer = self.preview(scene, "Z")
        return points_of_depth(scene_view(scene), framebuffer["Z"], framebuffer.display)

    def cameras(self, iterations: int) -> Iterator[dict[str, Any]]:
        """Cameras from several sides, each so far away that the set fills the picture."""
        for azimuth, elevation in _PLACES:
            camera = self.around(azimuth, elevation)
            # Once more from nearby, where the outline is known better.
            for _ in range(2):
                scene = self.scene(iterations, camera)
                points = self._points(scene)
                if len(points) < 20:
                    break
                camera = _filled(camera, scene, points)
            else:
                yield camera

    def interest(self, iterations: int, camera: Mapping[str, Any]) -> float:
        """How much there is to see: light and shade, and how much of the picture the set covers."""
        scene = self.scene(iterations, camera)
        warm = {"direction": list(_lights(scene)[0])}
        framebuffer = self.preview(self.scene(iterations, camera, lights=[warm]), "R", "G", "B", "A")
        covered = framebuffer["A"] > 0.5
        if covered.mean() < 0.02:
            return 0.0
        light = framebuffer.to_rgb8().astype(float).mean(axis=-1)
        inner = np.abs(np.diff(light, axis=1))[covered[:, 1:] & covered[:, :-1]]
        part = min(1.0, float(covered.mean()) / 0.4)
        return float(light[covered].std() + inner.mean()) * math.sqrt(part)

    def trap_range(self, iterations: int, camera: Mapping[str, Any]) -> tuple[float, float]:
        """Scale and offset of a palette that goes over the values that are seen."""
        widest = 2 * self.radius
        flat = {
            "lights": [{"color": [1, 1, 1]}],
            "material": {"ambient": 1, "diffuse": 0, "specular": 0},
            "coloring": {"by": "trap", "palette": ["#000", "#fff"], "scale": 1 / widest, "repeat": False},
        }
        framebuffer = self.preview(self.scene(iterations, camera, **flat), "R", "A")
        values = framebuffer["R"][framebuffer["A"] > 0.5] * widest
        low, high = np.percentile(values, (3, 97))
        scale = 1 / max(high - low, 1e-3 * widest)
        return _short(scale), _short(-low * scale)

    def exposed(self, found: Framing) -> Framing:
        """With the exposure that makes the lightest parts light."""
        camera = found.sections()["camera"]
        sections = {
            name: section
            for name, section in found.sections().items()
            if name not in ("camera", "image", "renderer")
        }
        framebuffer = self.preview(self.scene(found.iterations, camera, **sections), "R", "G", "B", "A")
        light = np.asarray(framebuffer, np.float64)[framebuffer["A"] > 0.5] @ np.array(
            [0.2126, 0.7152, 0.0722]
        )
        lightest = float(np.percentile(light, 97)) if len(light) else 0.0
        stops = math.log2(_BRIGHT / lightest) if lightest > 0 else 0.0
        return replace(found, exposure=round(min(max(stops, -1.5), 2.0), 1))

    def around(
        self, azimuth: float, elevation: float, distance: float | None = None, fov: float = FOV
    ) -> dict[str, Any]:
        """A camera that looks at the middle of the bounds; without a distance it sees all of them."""
        if distance is None:
            distance = self.radius / math.sin(math.radians(fov) / 2) * 1.02
        fine = 1e-3 * self.radius
        orbit = {"azimuth": azimuth, "elevation": elevation, "distance": _rounded(distance, fine)}
        return {"orbit": orbit, "target": list(self.center), "fov": fov}


def _filled(camera: Mapping[str, Any], scene: Scene, points: Floats) -> dict[str, Any]:
    """The camera, without a turn, where points of shape (n, 3) fill the picture."""
    view = scene_view(scene)
    middle = np.array(camera["target"], float)
    distance = float(camera["orbit"]["distance"])
    high = math.tan(math.radians(FOV) / 2)
    wide = high * _LOOK[0] / _LOOK[1]
    stray = (100 * _STRAY, 100 - 100 * _STRAY)
    for _ in range(12):
        away = points - middle
        depth = np.maximum(distance + away @ view.axis, 0.02 * distance)
        ends = [np.percentile((away @ side) / depth, stray) for side in (view.side, view.up)]
        shift = [distance * float(end.mean()) for end in ends]
        middle = middle + shift[0] * view.side + shift[1] * view.up
        share = max(float(np.ptp(end)) / 2 / most for end, most in zip(ends, (wide, high), strict=True))
        distance *= share / _FILLED
    fine = 0.005 * distance
    target = [_rounded(float(x), fine) for x in middle]
    return {**camera, "target": target, "orbit": {**camera["orbit"], "distance": _rounded(distance, fine)}}


def _roughness(framebuffer: Framebuffer) -> float:
    """The median angle between the normals of pixels beside each other, degrees, where both show the set."""
    normals = np.stack([framebuffer["N.X"], framebuffer["N.Y"], framebuffer["N.Z"]], axis=-1).astype(
        np.float64
    )
    hit = framebuffer["A"] > 0.5
    cosines = np.sum(normals[:, 1:] * normals[:, :-1], axis=-1)[hit[:, 1:] & hit[:, :-1]]
    median = float(np.median(cosines)) if len(cosines) else 1.0
    return math.degrees(math.acos(min(max(median, -1.0), 1.0)))


def _lights(scene: Scene) -> tuple[tuple[float, float, float], tuple[float, float, float]]:
    """Directions of light from the upper left behind the camera, and from its right."""
    view = scene_view(scene)
    warm = 0.75 * view.axis + 0.8 * view.side - 0.9 * view.up
    cool = 0.3 * view.axis - view.side - 0.1 * view.up
    (a, b, c), (d, e, f) = ([round(float(x), 2) + 0.0 for x in each] for each in (warm, cool))
    return (a, b, c), (d, e, f)


def _rounded(value: float, fine: float) -> float:
    """The value without digits below `fine`."""
    return round(value, max(0, 1 - math.floor(math.log10(fine)))) + 0.0


def _short(value: float) -> float:
    return float(f"{value:.3g}") + 0.0
