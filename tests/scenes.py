"""Small scenes of a formula, a camera and whatever else a test wants."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import clfractal

# Squaring the quaternion x + iy + jz squares its length, so after n applications |z| <= 4 is the ball of radius
# 4^(2^-n) exactly.
BALL_ITERATIONS = 8
HEAD = "version: 1\nformula: {name: mandelbulb}\ncamera: {}\n"
"""The least that the text of a scene has; further sections may follow."""
STEREO = "stereo={mode: anaglyph, screen_width: 0.5, screen_distance: 0.7}"
"""Two eyes before a screen, as an override."""


def bulb_text(size: tuple[int, int], more: str = "") -> str:
    """The text of a small scene of a Mandelbulb, with further lines."""
    width, height = size
    return (
        f"version: 1\nformula: {{name: mandelbulb, iterations: 8}}\nimage: {{width: {width}, height: {height}}}\n"
        f"camera: {{position: [0, -2.8, 0.6]}}\n{more}"
    )


def sections_of(
    formula: Mapping[str, Any] | str = "mandelbulb",
    camera: Mapping[str, Any] | None = None,
    size: tuple[int, int] | None = (64, 64),
    *,
    iterations: int | None = None,
    **sections: Any,
) -> dict[str, Any]:
    """What a scene's file has: a formula, a camera, a picture's size and other sections, each of which replaces those.

    Args:
        formula: one of the library, a whole section, or an inline formula.
        size: None: that of all scenes that do not say one.
        iterations: None: the section's own, and of an inline formula enough for a ball.
    """
    section: dict[str, Any] = {"name": formula} if isinstance(formula, str) else dict(formula)
    if "map" in section:
        section = {"inline": section, "iterations": BALL_ITERATIONS}
    if iterations is not None:
        section["iterations"] = iterations
    image = {} if size is None else {"image": {"width": size[0], "height": size[1]}}
    return {"version": 1, "formula": section, **image, "camera": dict(camera or {}), **sections}


def scene_of(
    formula: Mapping[str, Any] | str = "mandelbulb",
    camera: Mapping[str, Any] | None = None,
    size: tuple[int, int] | None = (64, 64),
    *,
    folder: Path | None = None,
    overrides: Sequence[str] = (),
    **sections: Any,
) -> clfractal.Scene:
    """The scene of such sections, with values replaced as by `--set`; the files that it names lie in `folder`."""
    return clfractal.load_scene(
        sections_of(formula, camera, size, **sections), folder=folder, overrides=overrides
    )
