"""Noise of pictures with one sample to a pixel, and their flicker when they move by half a pixel, in display light."""

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
"""Figures may be so many times those on record: the converged pictures have some noise of their own."""
SAMPLES = 36
"""Samples to a pixel of a picture that counts as converged."""
_SIZE = (320, 180)
_SCENES = Path(__file__).with_name("noise.yaml")


@dataclass(frozen=True, slots=True)
class Noise:
    """A scene's figures: codes of sRGB, 0 to 255, root mean squares over the pixels that show the set.

    Attributes:
        scene: its name.
        noise: one sample to a pixel beside many.
        flicker: how much more than the picture of many samples one of one sample changes when it moves by half a pixel
            in both directions.
        before: noise and flicker on record; None if there are none.
    """

    scene: str
    noise: float
    flicker: float
    before: tuple[float, float] | None

    @property
    def met(self) -> bool:
        """Whether both are no worse than on record."""
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
    before: Mapping[str, tuple[float, float]],
    overrides: Sequence[str] = (),
    *,
    samples: int = SAMPLES,
) -> Iterator[Noise]:
    """Renders every scene four times: still and moved, with one sample and with many."""
    for name, scene in scenes(overrides).items():
        moved = half_a_pixel_on(scene)
        one, many = (engine.render(scene, samples=count) for count in (1, samples))
        one_moved, many_moved = (engine.render(moved, samples=count) for count in (1, samples))
        shown = (many["A"] > 0) & (many_moved["A"] > 0)
        error, error_moved = _codes(one) - _codes(many), _codes(one_moved) - _codes(many_moved)
        recorded = before.get(name)
        yield Noise(
            name,
            _rms(error[shown]),
            _rms((error_moved - error)[shown]),
            None if recorded is None else (recorded[0], recorded[1]),
        )


def half_a_pixel_on(scene: Scene) -> Scene:
    """The scene whose picture shows everything half a pixel farther to the left and the bottom."""
    view = scene_view(scene)
    shift = 0.5 * view.pixel_size(scene.image.height) * (view.side + view.up)
    camera = scene.camera
    place = {"target": tuple((np.array(camera.target) + shift).tolist())}
    if view.eye is None:
        place["position"] = tuple((np.array(camera.position) + shift).tolist())
    return scene.model_copy(update={"camera": camera.model_copy(update=place)})


def _codes(film: Film) -> Floats:
    """A film as a screen shows it, shape (height, width, 3), without rounding."""
    return 255 * encode(np.clip(np.asarray(film, np.float64), 0.0, 1.0))


def _rms(error: Floats) -> float:
    return float(np.sqrt(np.mean(error**2)))
