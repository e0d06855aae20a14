"""Developing: from a framebuffer's light to light that a screen shows, by exposure and a tone curve.

Both are linear Rec. 709.

Each eye's picture is developed before two are mixed in one. Files of display light (PNG, JPEG, WebP) and notebooks show
developed pictures, and by the same steps the window does (`show.h`); an EXR holds the framebuffer's own light.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import SceneError, Where, arguments, unknown_name
from clfractal.files.srgb import encode8
from clfractal.files.tone import toned
from clfractal.files.tone_names import TONES, Tone
from clfractal.images.tiled import Bands, Floats, Picture
from clfractal.images.tiles import Region


@dataclass(frozen=True, slots=True)
class Development:
    """How light becomes display light.

    Attributes:
        exposure: stops (powers of two) by which it is made lighter first.
        tone: the curve; `linear` leaves light above 1 to be cut off.
        premultiplied: whether colours are multiplied by their coverage A; a curve bends the colours without it.

    Raises:
        SceneError: there is no such curve.
    """

    exposure: float = 0.0
    tone: Tone = "linear"
    premultiplied: bool = False

    def __post_init__(self) -> None:
        if self.tone not in TONES:
            raise SceneError(unknown_name("tone", str(self.tone), TONES), Where("tone"))

    @classmethod
    def of(
        cls, header: Mapping[str, Any], exposure: float | None = None, tone: Tone | None = None
    ) -> Development:
        """What a picture's header says, with other values where they are given.

        Raises:
            SceneError: the exposure is no number from -100 to 100, or there is no such curve.
        """
        return cls(
            float(header.get("exposure", 0.0))
            if exposure is None
            else arguments.number("exposure", exposure, -100, 100),
            header.get("tone", "linear") if tone is None else tone,
            bool(header.get("transparent", False)),
        )

    @property
    def gain(self) -> float:
        """What light is multiplied by."""
        return float(2.0**self.exposure)

    def colors(self, planes: Mapping[str, Floats]) -> dict[str, Floats]:
        """R, G and B of some channels, developed; arrays of one shape in, and of the same shape out.

        Raises:
            KeyError: a colour is missing; or coverage, where colours are premultiplied and a curve bends them.
        """
        gain = np.float32(self.gain)
        with np.errstate(over="ignore", invalid="ignore"):
            lit = [planes[name] * gain for name in "RGB"]
            if self.tone == "linear":
                return dict(zip("RGB", lit, strict=True))
            if not self.premultiplied or "A" not in planes:
                return dict(zip("RGB", toned(lit[0], lit[1], lit[2], self.tone), strict=True))
            # Where nothing covers, as where all is covered, colours are as they are.
            cover: Floats = np.where(planes["A"] > 0, np.fmin(planes["A"], np.float32(1)), np.float32(1))
            bare: list[Floats] = [plane / cover for plane in lit]
            bent = toned(bare[0], bare[1], bare[2], self.tone)
            return {name: plane * cover for name, plane in zip("RGB", bent, strict=True)}


class Developed:
    """A picture whose colours are developed as they are read; see `Framebuffer` for its attributes."""

    def __init__(self, picture: Picture, development: Development) -> None:
        self.picture, self.development = picture, development
        self.channels: tuple[str, ...] = picture.channels
        self.display: tuple[int, int] = picture.display
        self.region: Region = picture.region

    @property
    def header(self) -> dict[str, Any]:
        """The picture's own."""
        return self.picture.header

    def bands(self) -> Bands:
        """The picture from top to bottom, some rows at a time: (first_row, channel -> rows)."""
        for row, band in self.picture.bands():
            yield row, {**band, **self.development.colors(band)}


def developed(picture: Picture, development: Development) -> Picture:
    """A picture with its colours developed; of one that is mixed of two eyes' pictures, each of these before."""
    parts = getattr(picture, "developed_parts", None)
    mixed: Picture | None = parts(development) if parts is not None else None
    return mixed if mixed is not None else Developed(picture, development)


def rgb8(picture: Picture, development: Development) -> npt.NDArray[np.uint8]:
    """A picture as a screen shows it: sRGB, uint8 of shape (height, width, 3).

    Raises:
        KeyError: it has no R, G, B.
    """
    shown = developed(picture, development)
    bands = [np.stack([planes[name] for name in "RGB"], axis=-1) for _, planes in shown.bands()]
    return encode8(np.concatenate(bands), origin=(picture.region.x, picture.region.y))
