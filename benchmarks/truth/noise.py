"""Noise of pictures with one sample to a pixel, and their flicker when they move by half a pixel, in display light.

A picture is held against the mean of pictures of the same kind, each moved by part of a pixel: what a camera would see
whose pixels gather the light of all their places. (A picture of many samples is not that: it shows light nearer to the
set than one of a single sample.)

The figures on record are those of the commit before the march landed on the set, by this very measure:

    git worktree add ../before 4e9a3c2
    cp benchmarks/truth/*.py benchmarks/truth/noise.yaml ../before/benchmarks/truth/
    cd ../before
    python -m benchmarks.truth --part noise
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.truth.rays import Floats
from clfractal.files.srgb import encode
from clfractal.optics.view import scene_view
from clfractal.pictures.film import Film
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.work.engine import Engine

SLACK = 1.01
"""Figures may be so many times those on record: the means have some noise of their own."""
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
        before: noise, flicker and what is within, as on record; None if there are none.
    """

    scene: str
    noise: float
    flicker: float
    within: float
    before: tuple[float, float, float] | None

    @property
    def met(self) -> bool:
        """Whether noise and flicker are no worse than on record."""
        if self.before is None:
            return True
        return self.noise <= SLACK * self.before[0] and self.flicker <= SLACK * self.before[1]


def scenes(overrides: Sequence[str] = ()) -> Mapping[str, Scene]:
    """The six scenes, small."""
    found: Mapping[str, Any] = yaml.safe_load(_SCENES.read_text(encoding="utf-8"))
    image = {"width": _SIZE[0], "height": _SIZE[1]}
    return {name: load_scene({**data, "image": image}, overrides=overrides) for name, data in found.items()}


def measure_noise(
    engine: Engine,
    before: Mapping[str, tuple[float, float, float]],
    overrides: Sequence[str] = (),
    *,
    side: int = SIDE,
) -> Iterator[Noise]:
    """Renders every scene, still and half a pixel on, in its place and in `side` x `side` others around that."""
    for name, scene in scenes(overrides).items():
        error, coverage = _error(scene, engine, side)
        error_moved, coverage_moved = _error(moved(scene, 0.5, 0.5), engine, side)
        shown = (coverage > 0) & (coverage_moved > 0)
        recorded = before.get(name)
        yield Noise(
            name,
            _rms(error[shown]),
            _rms((error_moved - error)[shown]),
            _rms(error[coverage == 1]),
            None if recorded is None else (recorded[0], recorded[1], recorded[2]),
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


def _error(scene: Scene, engine: Engine, side: int) -> tuple[Floats, Floats]:
    """A picture minus the mean of it over a pixel, shape (height, width, 3), and which share of that shows the set."""
    places = (np.arange(side) + 0.5) / side - 0.5
    around = [engine.render(moved(scene, x, y), samples=1) for y in places for x in places]
    mean = np.mean([_light(film) for film in around], axis=0)
    coverage: Floats = np.mean([film["A"] > 0 for film in around], axis=0)
    return _codes(_light(engine.render(scene, samples=1))) - _codes(mean), coverage


def _light(film: Film) -> Floats:
    """A film's light as a screen can show it, shape (height, width, 3)."""
    return np.clip(np.asarray(film, np.float64), 0.0, 1.0)


def _codes(light: Floats) -> Floats:
    """Light as codes of sRGB, without rounding."""
    return 255 * encode(light)


def _rms(error: Floats) -> float:
    return float(np.sqrt(np.mean(error**2)))
