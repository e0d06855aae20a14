"""Planes in a picture: which rays meet them, their colours and their opacity."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.formulas import reference
from clfractal.scene.cut_plane import CutPlane, EscapeColors
from clfractal.scene.model import Scene
from clfractal.scene.palette import named_table
from tests.render.shots import Floats, rays
from tests.scenes import BALL_ITERATIONS

COLORS = {"mode": "stepped", "palette": "magma", "inside": [0.9, 0.1, 0.3], "scale": 1.5}

TINT = np.array([0.25, 0.5, 0.75])

LOOK: dict[str, Any] = {
    "material": {"ambient": 1, "diffuse": 0, "specular": 0, "color": list(TINT)},
    # A shadow, of which ambient light shows nothing: tests with shadows have the same program.
    "lights": [{"direction": [0, 1, -0.5], "shadow": True}],
    "background": {"top": [0.5, 0.25, 0.125], "bottom": [0.5, 0.25, 0.125]},
}

BACKGROUND = np.array(LOOK["background"]["top"])


def plane(center: list[float], normal: list[float], opacity: float = 0.8, **keys: Any) -> dict[str, Any]:
    place = {"center": center, "normal": normal, "up": [0.1, 0.2, 1], "width": 2.4, "height": 1.6}
    place |= {name: keys.pop(name) for name in list(keys) if name in place}
    return {"plane": place, "colors": COLORS, "opacity": opacity, **keys}


def escape_tint(
    scene: Scene, points: Floats, limit: int = BALL_ITERATIONS, colors: Any = None
) -> tuple[Floats, Floats]:
    """The planes' colours at points, magma's or white, and how near to the rim of a ring they are, in parts of the
    radius."""
    colors = colors or EscapeColors.checked(COLORS)
    flat = np.where(np.isfinite(points), points, 9).reshape(-1, 3)
    count, inside = reference.escape(scene.chain, flat, limit)
    at = np.clip(colors.scale * count / limit, 0, 1) * 255
    table = named_table("magma").astype(float) if colors.palette == "magma" else np.ones((256, 3))
    tint = np.stack([np.interp(at, np.arange(256), table[:, i]) for i in range(3)], -1)
    tint[inside] = colors.inside
    rims = 4.0 ** (2.0 ** -np.arange(limit + 1))
    rim = np.abs(np.linalg.norm(flat, axis=-1)[:, None] / rims - 1).min(-1)
    return tint.reshape(points.shape), rim.reshape(points.shape[:-1])


def alpha_of(each: CutPlane, tint: Floats) -> Floats:
    """A quad's opacity at points of these colours."""
    inside = (tint == np.array(COLORS["inside"])).all(-1)
    return np.where(inside & (each.inside_opacity is not None), each.inside_opacity or 0.0, each.opacity)


def met(scene: Scene, index: int, number: int = 0) -> tuple[npt.NDArray[np.bool_], Floats, Floats]:
    """Which rays meet a plane's rectangle, at which distance; and how near to its rim, scene units."""
    origin, direction, _ = rays(scene)
    part = scene.cut_planes[index]
    placed = part.plane.placed
    center = np.array(placed.center) + number * part.spacing * np.array(placed.normal)
    with np.errstate(divide="ignore"):
        t = ((center - origin) @ placed.normal) / (direction @ placed.normal)
    there = origin + t[..., None] * direction - center
    room = np.minimum(
        placed.width / 2 - np.abs(there @ placed.side), placed.height / 2 - np.abs(there @ placed.up)
    )
    return (room > 0) & (t > 0), t, np.abs(room)
