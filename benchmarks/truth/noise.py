"""Noise of pictures with one sample to a pixel, and their flicker when they move by half a pixel, in display light.

A picture is held against the mean of pictures of the same kind, each moved by part of a pixel: what a camera would see
whose pixels gather the light of all their places, and what a picture shows whose samples are many enough.

While a picture of one sample is under way a window shows it smoothed: `shown` is the noise of that beside the mean of
such pictures, smoothed as well. So it tells what is left of the noise, and nothing of how sharp the picture is.

The figures on record are those of the commit since which a picture of one sample lights what it shows as one of many
does, by this very measure:

    python -m benchmarks.truth --part noise
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import yaml

from benchmarks.truth.rays import Floats
from clfractal.camera.views import scene_view
from clfractal.engine.engine import Engine
from clfractal.files.srgb import encode
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

Figures = tuple[float, float, float, float]
"""Noise, flicker, the noise within, the noise that is shown."""
SLACK = 1.01
"""Figures may be so many times those on record: the means have some noise of their own."""
LIGHTEST = 1e30
"""What is lighter is not smoothed."""
SIDE = 6
"""A mean is of so many by so many pictures, moved to places spread evenly over a pixel."""
_SIZE = (320, 180)
_SCENES = Path(__file__).with_name("noise.yaml")


@dataclass(frozen=True, slots=True)
class Noise:
    """A scene's figures: codes of sRGB, 0 to 255, root mean squares over the pixels that show the set.

    Attributes:
        scene: its name.
        noise: one sample to a pixel beside the mean of such pictures over the pixel.
        flicker: how much more than the mean the picture changes when the scene moves by half a pixel in both directions.
        within: the noise of those pixels alone that the set covers wholly. Outlines of a sharper surface are rougher, and
            a ray either meets the set or not, so elsewhere nothing but more samples helps.
        shown: the noise of what a window shows of a picture under way.
        before: noise, flicker, what is within and what is shown, as on record; None if there are none.
    """

    scene: str
    noise: float
    flicker: float
    within: float
    shown: float
    before: Figures | None

    @property
    def figures(self) -> Figures:
        """What is measured, in the order of the record."""
        return self.noise, self.flicker, self.within, self.shown

    @property
    def met(self) -> bool:
        """Whether noise, flicker and the noise that is shown are no worse than on record."""
        if self.before is None:
            return True
        pairs = list(zip(self.figures, self.before, strict=True))
        return all(pairs[number][0] <= SLACK * pairs[number][1] for number in (0, 1, 3))


def scenes(overrides: Sequence[str] = ()) -> Mapping[str, Scene]:
    """The six scenes, small."""
    found: Mapping[str, Any] = yaml.safe_load(_SCENES.read_text(encoding="utf-8"))
    image = {"width": _SIZE[0], "height": _SIZE[1]}
    return {name: load_scene({**data, "image": image}, overrides=overrides) for name, data in found.items()}


def measure_noise(
    engine: Engine,
    before: Mapping[str, Sequence[float]],
    overrides: Sequence[str] = (),
    *,
    side: int = SIDE,
) -> Iterator[Noise]:
    """Renders every scene, still and half a pixel on, in its place and in `side` x `side` others around that."""
    for name, scene in scenes(overrides).items():
        error, smooth, coverage = _errors(scene, engine, side)
        error_moved, _, coverage_moved = _errors(moved(scene, 0.5, 0.5), engine, side)
        shown = (coverage > 0) & (coverage_moved > 0)
        recorded = before.get(name)
        yield Noise(
            name,
            _rms(error[shown]),
            _rms((error_moved - error)[shown]),
            _rms(error[coverage == 1]),
            _rms(smooth[shown]),
            None if recorded is None else (recorded[0], recorded[1], recorded[2], recorded[3]),
        )


def moved(scene: Scene, left: float, down: float) -> Scene:
    """The scene whose picture shows everything so many pixels farther to the left and the bottom."""
    view = scene_view(scene)
    shift = view.pixel_size(scene.image.height) * (left * view.side + down * view.up)
    camera = scene.camera
    place = {"target": tuple((np.array(camera.target) + shift).tolist())}
    if view.eye is None:
        place["position"] = tuple((np.array(camera.position) + shift).tolist())
    return scene.model_copy(update={"camera": camera.model_copy(update=place)})


def smoothed(colors: npt.NDArray[Any], coverage: npt.NDArray[Any], strength: float = 1.0) -> npt.NDArray[Any]:
    """What a window shows of a view under way, as light: `diffuse` in `show.cl`, in the same order.

    Args:
        colors: shape (height, width, 3), linear; coverage: shape (height, width). The result has the colours' type.
    """
    height, width = coverage.shape
    number = colors.dtype.type
    is_light = (np.abs(colors) <= LIGHTEST).all(axis=-1)
    gained = np.zeros_like(colors)
    for down in (-1, 0, 1):
        for right in (-1, 0, 1):
            if down == right == 0:
                continue
            own = np.s_[max(-down, 0) : height - max(down, 0), max(-right, 0) : width - max(right, 0)]
            other = np.s_[max(down, 0) : height + min(down, 0), max(right, 0) : width + min(right, 0)]
            share = number(0.03125 if down and right else 0.0625) * number(strength)
            alike = 1 - 4 * np.abs(coverage[own] - coverage[other])
            both = (alike > 0) & is_light[own] & is_light[other]
            with np.errstate(all="ignore"):
                change = (colors[other] - colors[own]) * (share * alike)[..., None]
            gained[own] += np.where(both[..., None], change, number(0))
    found: npt.NDArray[Any] = colors + gained
    return found


def _errors(scene: Scene, engine: Engine, side: int) -> tuple[Floats, Floats, Floats]:
    """A picture minus its mean over a pixel, the same smoothed, both (height, width, 3), and which share shows the set."""
    places = (np.arange(side) + 0.5) / side - 0.5
    around = [engine.render(moved(scene, x, y), samples=1) for y in places for x in places]
    mean = np.mean([_light(framebuffer) for framebuffer in around], axis=0)
    mean_smooth = np.mean([_smooth_light(framebuffer) for framebuffer in around], axis=0)
    coverage: Floats = np.mean([framebuffer["A"] > 0 for framebuffer in around], axis=0)
    found = engine.render(scene, samples=1)
    plain, smooth = _codes(_light(found)), _codes(_smooth_light(found))
    return plain - _codes(mean), smooth - _codes(mean_smooth), coverage


def _light(framebuffer: Framebuffer) -> Floats:
    """A framebuffer's light as a screen can show it, shape (height, width, 3)."""
    return np.clip(np.asarray(framebuffer, np.float64), 0.0, 1.0)


def _smooth_light(framebuffer: Framebuffer) -> Floats:
    """The same of the smoothed framebuffer."""
    found: Floats = np.clip(
        smoothed(np.asarray(framebuffer, np.float64), framebuffer["A"].astype(np.float64)), 0.0, 1.0
    )
    return found


def _codes(light: Floats) -> Floats:
    """Light as codes of sRGB, without rounding."""
    return 255 * encode(light)


def _rms(error: Floats) -> float:
    return float(np.sqrt(np.mean(error**2)))
