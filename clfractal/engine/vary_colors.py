"""Steps of a look: colours by hue, strength and lightness, palettes, and the lights' places."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from random import Random
from typing import Any

import numpy as np

from clfractal.elements.lights.directional import DirectionalLight
from clfractal.engine.varied import Step, is_locked, rounded, signed
from clfractal.scene.coloring import Coloring
from clfractal.scene.cut_plane import CutPlaneRenderer, EscapeColors
from clfractal.scene.layout import LayoutView
from clfractal.scene.model import Scene
from clfractal.scene.palettes import PALETTES, from_oklab, to_oklab
from clfractal.scene.parts import Gradient
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.base import Vector, cross, length, turn, unit

# The boldest steps: degrees of hue, logarithm of the colourfulness, lightness (1 is from black to white), degrees of lights
# about the vertical and up or down; of a palette: lengths that it is shifted by, if it repeats or not, and its
# scale's logarithm.
_HUE, _CHROMA, _LIGHTNESS = 170.0, 0.6, 0.1
_LIGHT_ROUND, _LIGHT_RISE = 70.0, 25.0
_SHIFT_ROUND, _SHIFT_ENDS, _SCALE = 0.5, 0.15, 0.4
# Greys have no hue to turn; this much colour, by lightness, the boldest step gives them.
_LEAST_CHROMA = 0.09
_SHARE = 0.6


@dataclass(frozen=True, slots=True)
class Grade:
    """How colours change: hue in degrees, a factor on the colourfulness, a sum to the lightness, colour for greys."""

    hue: float
    chroma: float
    lightness: float
    least: float

    def color(self, linear: Sequence[float], *, largest: float = math.inf, part: float = 1.0) -> list[float]:
        """A linear Rec. 709 colour, changed; one beyond `largest` or below 0 becomes paler until it fits.

        Args:
            part: of the change of hue and lightness that is made.
        """
        lightness, a, b = to_oklab(np.asarray(linear, float)).tolist()
        if lightness <= 0:
            return list(linear)
        strength = max(math.hypot(a, b) * self.chroma, self.least * part * lightness)
        angle = math.atan2(b, a) + math.radians(self.hue * part)
        # A dark colour stays dark, and a light one light.
        room = min(lightness, 1.0) * (1.0 - 0.5 * min(lightness, 1.0)) * 2
        lightness += self.lightness * part * room
        for paler in np.linspace(1.0, 0.0, 21):
            lab = np.array([lightness, *(strength * paler * np.array([math.cos(angle), math.sin(angle)]))])
            found = from_oklab(lab)
            if found.min() >= 0 and found.max() <= largest:
                break
        return [float(f"{x:.4g}") for x in np.clip(found, 0.0, largest)]


def colors_step(scene: Scene, rng: Random, amount: float, *, locked: Collection[str]) -> Step:
    """Other colours and lights; views of a layout that have their own change in the same way."""
    grade = Grade(
        hue=_HUE * signed(rng, amount),
        chroma=math.exp(_CHROMA * signed(rng, amount)),
        lightness=_LIGHTNESS * signed(rng, amount),
        least=_LEAST_CHROMA * amount,
    )
    look = _Look(grade, rng, amount, unit(scene.camera.up))
    step = Step(sizes={"hue": grade.hue / _HUE, "lightness": grade.lightness / _LIGHTNESS})
    step.remarks.append(f"hue {grade.hue:+.0f}°")
    for prefix, part in _parts(scene):
        for path, value in look.changes(part):
            if not is_locked(prefix + path, locked):
                step.changes[prefix + path] = value
    if not step.changes:
        return Step()
    step.sizes |= look.sizes
    step.remarks += look.remarks
    return step


def _parts(scene: Scene) -> Iterator[tuple[str, Scene | LayoutView]]:
    yield "", scene
    for number, view in enumerate(scene.layout.views if scene.layout is not None else ()):
        yield f"layout.views.{number}.", view


class _Look:
    """The decisions of one variation, which all views of a picture share."""

    def __init__(self, grade: Grade, rng: Random, amount: float, up: Vector) -> None:
        self.grade, self.up = grade, up
        self.sizes: dict[str, float] = {}
        self.remarks: list[str] = []
        self.turn, self.rise = (signed(rng, amount) for _ in range(2))
        self.shift, self.scale = (signed(rng, amount) for _ in range(2))
        tints, turns, surrounds = (rng.random() < _SHARE for _ in range(3))
        self.tints, self.turns, self.surrounds = tints, turns, surrounds
        # Weak variations keep the palette.
        other = rng.random() < amount**0.7 if amount > 0.2 else False
        self.other = rng.random() if other else None

    def changes(self, part: Scene | LayoutView) -> Iterator[tuple[str, Any]]:
        """The new values of a scene or of a view's own sections, by their paths in it."""
        coloring, material = part.coloring, part.material
        renderer = part.renderer
        transfer = renderer.transfer if isinstance(renderer, VolumeRenderer) else None
        shows_material = transfer is None or transfer.color is None
        if material is not None and shows_material and (coloring is None or coloring.kind.of_material):
            yield "material.color", self.grade.color(material.color, largest=1.0)
        if coloring is not None and coloring.uses_palette:
            yield from self._palette("coloring", coloring)
        if isinstance(renderer, CutPlaneRenderer):
            yield from self._palette("renderer.colors", renderer.colors)
        for index, stop in enumerate((transfer.color if transfer is not None else None) or ()):
            yield f"renderer.transfer.color.{index}.color", self.grade.color(stop.color)
        for index, plane in enumerate(part.cut_planes or ()):
            yield from self._palette(f"cut_planes.{index}.colors", plane.colors)
        if not isinstance(renderer, CutPlaneRenderer):
            yield from self._surroundings(part)
            yield from self._lights(part)

    def _palette(self, path: str, colors: Coloring | EscapeColors) -> Iterator[tuple[str, Any]]:
        palette = colors.palette
        name = self._other_palette(palette if isinstance(palette, str) else "", repeats=colors.repeat)
        if name is not None:
            yield f"{path}.palette", name
        elif not isinstance(palette, str):
            for index, stop in enumerate(palette):
                yield f"{path}.palette.{index}.color", self.grade.color(stop.color)
        shift = (_SHIFT_ROUND if colors.repeat else _SHIFT_ENDS) * self.shift
        yield f"{path}.offset", rounded(colors.offset + shift, shift)
        scale = colors.scale * math.exp(_SCALE * self.scale)
        yield f"{path}.scale", rounded(scale, 0.1 * colors.scale)
        self.sizes |= {"palette.shift": self.shift, "palette.scale": self.scale}
        if isinstance(colors, EscapeColors):
            yield f"{path}.inside", self.grade.color(colors.inside)

    def _other_palette(self, name: str, *, repeats: bool) -> str | None:
        """A palette of the program that suits, or None to keep the present one."""
        if self.other is None:
            return None
        suited = [each for each, it in PALETTES.items() if it.periodic is repeats and each != name]
        chosen = suited[int(self.other * len(suited))]
        self.sizes[f"palette.{chosen}"] = 1.0
        remark = f"palette {chosen}"
        if remark not in self.remarks:
            self.remarks.append(remark)
        return chosen

    def _surroundings(self, part: Scene | LayoutView) -> Iterator[tuple[str, Any]]:
        if not self.surrounds:
            return
        if isinstance(part.background, Gradient) and (
            part.environment is None or not part.environment.background
        ):
            yield "background.top", self.grade.color(part.background.top)
            yield "background.bottom", self.grade.color(part.background.bottom)
            self.sizes["background"] = self.grade.hue / _HUE
        if part.fog is not None:
            yield "fog.color", self.grade.color(part.fog.color)
            self.sizes["fog"] = self.grade.hue / _HUE

    def _lights(self, part: Scene | LayoutView) -> Iterator[tuple[str, Any]]:
        degrees = _LIGHT_ROUND * self.turn
        for index, light in enumerate(part.lights or ()):
            # Half the hue, so that warm and cold light stay a pair.
            if self.tints:
                yield f"lights.{index}.color", self.grade.color(light.color, part=0.5)
                self.sizes["lights.hue"] = self.grade.hue / _HUE
            if self.turns and isinstance(light, DirectionalLight):
                yield f"lights.{index}.direction", self._turned(light.direction)
                self.sizes |= {"lights.turn": self.turn, "lights.rise": self.rise}
        environment = part.environment
        if self.turns and environment is not None:
            angle = (environment.rotation + degrees + 180) % 360 - 180
            yield "environment.rotation", rounded(angle, degrees)
            self.sizes["lights.turn"] = self.turn
        if "lights.turn" in self.sizes and not any("light" in remark for remark in self.remarks):
            self.remarks.append(f"light turned {abs(degrees):.0f}°")

    def _turned(self, direction: Vector) -> list[float]:
        """The direction, turned about `up` and raised or lowered, with its length and three decimals."""
        turned = turn(direction, self.up, _LIGHT_ROUND * self.turn)
        side = cross(self.up, turned)
        if length(side) > 1e-6 * length(turned):
            turned = turn(turned, unit(side), _LIGHT_RISE * self.rise)
        return [round(x, 3) + 0.0 for x in turned]
