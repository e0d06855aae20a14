"""The scene's `deep`: a place of any depth that it shows, told exactly, and how much it is magnified."""

from __future__ import annotations

import re
from fractions import Fraction
from typing import Annotated, Any

from pydantic import BeforeValidator, Field, WithJsonSchema

from clfractal.formulas.place import Place
from clfractal.schema.base import Section, problem
from clfractal.schema.fields import EXACT, SCALE
from clfractal.schema.shape import Ball

MOST_DIGITS = 1000
"""Of a coordinate."""
LARGEST = 1e6
"""Of coordinates; that of other positions of a scene, too."""
REACH = 1e6
"""How far around the picture the set is looked for, in times of its own radius."""
LARGEST_MAGNIFICATION = 1e120
"""Squares of distances to the whole set, and of derivatives, are numbers of float64."""
_DECIMAL = re.compile(r"[+-]?(\d+(\.\d*)?|\.\d+)([eE][+-]?\d{1,4})?")


def _decimal(value: Any) -> str:
    """A number, or one in text, as text of the same value."""
    if isinstance(value, bool) or not isinstance(value, (int, float, str)):
        raise problem("must be a number, or one in quotes")
    text = (repr(value) if not isinstance(value, str) else value).strip()
    if len(text) > MOST_DIGITS + 10 or not _DECIMAL.fullmatch(text):
        shown = f"{text[:40]!r}{'...' if len(text) > 40 else ''}"
        raise problem(f"must be a decimal number of at most {MOST_DIGITS} digits, got {shown}")
    if abs(Fraction(text)) > LARGEST:
        raise problem(f"must be from {-LARGEST:,.0f} to {LARGEST:,.0f}, got {text[:40]}")
    return text


DECIMAL_SCHEMA = {"anyOf": [{"type": "number", "minimum": -LARGEST, "maximum": LARGEST}, {"type": "string"}]}
Decimal = Annotated[str, BeforeValidator(_decimal), WithJsonSchema(DECIMAL_SCHEMA, mode="validation")]
"""A number of any number of digits; in YAML in quotes, where it has more than 17."""
ExactPosition = Annotated[tuple[Decimal, Decimal, Decimal], Field(strict=False)]


class Deep(Section):
    """A place of the formula's space that the scene shows, magnified.

    The scene's origin is `center`, and what is one scene unit there is `magnification` of them in the picture. All else of
    the scene, its camera, lights and objects, is told in the picture's units, as without it.
    """

    center: Annotated[ExactPosition, EXACT] = Field(
        ("0", "0", "0"),
        description="the place in the formula's space; numbers of more than 17 digits stand in quotes",
    )
    magnification: Annotated[
        float, Field(strict=True, ge=1, le=LARGEST_MAGNIFICATION, allow_inf_nan=False), SCALE
    ] = Field(1.0, description="how many times larger it is shown")

    def searched(self, ball: Ball, radius: float) -> Ball:
        """The part of the set's ball that rays search, scene units; `radius`: the set's own.

        Far beyond the picture, structures of all larger sizes would shut out every light of the scene, and rays would pass
        through those that are too thin for their steps.
        """
        return ball if ball[1] <= REACH * radius else ((0.0, 0.0, 0.0), REACH * radius)

    def place(self, applications: int) -> Place:
        """The place, as formulas know it; orbits have at most so many applications."""
        return Place(self.center, self.magnification, applications)


def check_frames(scene: Any) -> None:
    """Refuses cameras of a scene that look for what is seen: a magnified set has no end in the picture."""
    if scene.deep is None:
        return
    views = scene.layout.views if scene.layout is not None else ()
    cameras = [
        ("camera", scene.camera),
        *((f"layout.views.{number}.camera", view.camera) for number, view in enumerate(views)),
        *((f"bookmarks.{name}", getattr(mark, "camera", mark)) for name, mark in scene.bookmarks.items()),
    ]
    for path, camera in cameras:
        if camera is not None and camera.frame == "seen":
            raise problem("seen cannot be combined with deep; use all", f"{path}.frame")
