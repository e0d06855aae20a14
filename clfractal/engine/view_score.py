"""How much a small picture shows of a place: layers of depth, forms, light; for views that are looked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

if TYPE_CHECKING:
    from clfractal.images.framebuffer import Framebuffer

Floats = npt.NDArray[np.float64]

CHANNELS = ("R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z")
"""What it is asked of."""

# Part of the picture that something has to cover, at least and better.
_COVERED = (0.35, 0.75)
# Background below the middle of the picture looks as if there were no ground: what part of that half may be.
_GROUNDLESS = (0.15, 0.6)
# What is nearest (the twentieth), parts of the size of all: nearer things are walls before the eye.
_NEAREST = (0.008, 0.04)
# Standard deviation of the logarithm of depth: of walls straight ahead, and where a picture is deep; bins of it whose
# evenness makes layers.
_FLAT, _DEEP, _LAYERS = (0.05, 0.4), 0.75, 8
# Angle between neighbouring normals, degrees: that of grain (the median), and that of edges and their part of pixels.
_GRAIN, _EDGE, _EDGES = (22.0, 50.0), 10.0, 0.3
# How much directions of normals differ: 0 all are one, 1 they cancel out.
_TURNED = 0.6
# Lightness of what is lit, in parts of what is light in this scene; what part of what is seen is, at least and better.
_LIT, _LIT_PART = 0.45, (0.15, 0.55)
# A scene in which nothing is lighter than this is dark.
_DIMMEST = 0.15
# Lightness that is too much, 0 to 1, and of what part.
_BLOWN, _BLOWN_PART = 0.97, 0.12
# Spread of lightness, of pixels and of larger parts of the picture, likewise.
_CONTRAST, _MASSES = 0.3, 0.2
# What is far lies in the picture and not at its rim: parts of its half sides from the middle.
_OFF = (0.35, 0.9)
COARSE = (6, 10)
"""Rows and columns of a glance."""


@dataclass(frozen=True, slots=True, eq=False)
class Looked:
    """What a small picture tells.

    Attributes:
        score: 0 nothing to see, 1 the best.
        depth: the median along the view axis, scene units; infinite where nothing is seen.
        layers: how many times farther away the farthest twentieth is than the nearest.
        glance: the picture in some numbers, to tell two views apart; of mean 0 and length 1.
    """

    score: float
    depth: float
    layers: float
    glance: Floats


def lightness(framebuffer: Framebuffer) -> Floats:
    """Of each pixel, as a screen shows it, 0 to 1."""
    return np.asarray(framebuffer.to_rgb8().astype(np.float64) @ np.array([0.2126, 0.7152, 0.0722]) / 255)


def light_of(pictures: Sequence[Framebuffer]) -> float:
    """What is light in a scene, by pictures of some of its places."""
    lightest = [
        float(np.percentile(lightness(each)[hit], 95))
        for each in pictures
        if (hit := _hit(each)).mean() > 0.1
    ]
    return max(float(np.percentile(lightest, 90)), _DIMMEST) if lightest else 1.0


def _hit(framebuffer: Framebuffer) -> npt.NDArray[np.bool_]:
    depth = framebuffer["Z"]
    return np.asarray(np.isfinite(depth) & (depth > 0) & (framebuffer["A"] > 0.5))


def looked_at(framebuffer: Framebuffer, size: float, bright: float) -> Looked:
    """Judges a picture with `CHANNELS`.

    Args:
        size: of all that could be seen, scene units.
        bright: what is light in the scene.
    """
    depth = np.asarray(framebuffer["Z"], np.float64)
    hit, light = _hit(framebuffer), lightness(framebuffer)
    covered = float(hit.mean())
    if covered < _COVERED[0]:
        return Looked(0.0, np.inf, 1.0, _glance(light, np.where(hit, 1.0, 0.0)))
    far = np.log(depth[hit])
    near, middle, end = (float(each) for each in np.percentile(far, (5, 50, 95)))
    whole = np.where(hit, far.max() + 0.2, 0)
    whole[hit] = far
    gates = (
        _rise(covered, _COVERED)
        * _rise(float(np.exp(near)) / size, _NEAREST)
        * (0.4 + 0.6 * _rise(float(far.std()), _FLAT))
        * _forms(framebuffer, hit)
        * _rise(float((light[hit] > _LIT * bright).mean()), _LIT_PART)
        * (1 - 0.7 * _rise(1 - float(hit[hit.shape[0] // 2 :].mean()), _GROUNDLESS))
        * (1 - min(1.0, float((light > _BLOWN).mean()) / _BLOWN_PART) ** 2)
        * _in_picture(whole)
    )
    masses = _parts(light)
    worth = (
        0.3 * min(1.0, float(far.std()) / _DEEP)
        + 0.2 * _evenness(far)
        + 0.15 * min(1.0, float(light[hit].std()) / (_CONTRAST * bright))
        + 0.15 * min(1.0, float(masses.std()) / (_MASSES * bright))
        + 0.2 * _turned(framebuffer, hit)
    )
    return Looked(gates * worth, float(np.exp(middle)), float(np.exp(end - near)), _glance(light, whole))


def _rise(value: float, between: tuple[float, float]) -> float:
    """0 below the first of two values, 1 above the second, smooth between."""
    part = min(max((value - between[0]) / (between[1] - between[0]), 0.0), 1.0)
    return part * part * (3 - 2 * part)


def _evenness(far: Floats) -> float:
    """How evenly things stand in all depths: foreground, middle, background."""
    counts = np.histogram(far, _LAYERS, np.percentile(far, (1, 99)) + np.array([-1e-9, 1e-9]))[0]
    shares = counts[counts > 0] / counts.sum()
    return float(-(shares * np.log(shares)).sum() / np.log(_LAYERS))


def vectors_of(framebuffer: Framebuffer, name: str) -> Floats:
    """A channel that has an X, a Y and a Z, shape (height, width, 3)."""
    return np.stack([framebuffer[f"{name}.{axis}"] for axis in "XYZ"], axis=-1).astype(np.float64)


def roughness(normals: Floats, reach: int) -> Floats:
    """How much normals up to some pixels around each one differ: 0 all are one, 1 they cancel out; nothing is (0, 0, 0)."""
    size, (height, width) = 2 * reach + 1, normals.shape[:2]
    padded = np.pad(normals, ((reach, reach), (reach, reach), (0, 0)))
    total = sum(padded[y : y + height, x : x + width] for y in range(size) for x in range(size))
    return np.asarray(1 - np.linalg.norm(total / size**2, axis=-1))


def _turned(framebuffer: Framebuffer, hit: npt.NDArray[np.bool_]) -> float:
    mean = np.linalg.norm(vectors_of(framebuffer, "N")[hit].mean(axis=0))
    return min(1.0, float(1 - mean) / _TURNED)


def _forms(framebuffer: Framebuffer, hit: npt.NDArray[np.bool_]) -> float:
    """1 for forms that are seen as such: less for grain, and for bare walls without an edge."""
    normals = vectors_of(framebuffer, "N")
    cosines = [
        (normals[1:] * normals[:-1]).sum(axis=-1)[hit[1:] & hit[:-1]],
        (normals[:, 1:] * normals[:, :-1]).sum(axis=-1)[hit[:, 1:] & hit[:, :-1]],
    ]
    angles = np.degrees(np.arccos(np.clip(np.concatenate(cosines), -1, 1)))
    if not len(angles):
        return 0.0
    grain = 1 - _rise(float(np.median(angles)), _GRAIN)
    edges = min(1.0, float((angles > _EDGE).mean()) / _EDGES)
    return grain * (0.25 + 0.75 * edges)


def _in_picture(far: Floats) -> float:
    """Whether the eye is led into the picture: where what is far lies in it."""
    rows, columns = np.nonzero(far >= np.percentile(far, 85))
    x, y = (2 * (rows.mean() + 0.5) / far.shape[0] - 1, 2 * (columns.mean() + 0.5) / far.shape[1] - 1)
    return 1 - 0.6 * _rise(float(np.hypot(x, y)), _OFF)


def _parts(values: Floats) -> Floats:
    """Means of the parts of a picture."""
    rows = np.array_split(values, COARSE[0], axis=0)
    return np.array([[part.mean() for part in np.array_split(row, COARSE[1], axis=1)] for row in rows])


def _glance(light: Floats, far: Floats) -> Floats:
    def level(values: Floats) -> Floats:
        flat = values.ravel() - values.mean()
        return np.asarray(flat / max(float(np.linalg.norm(flat)), 1e-9))

    both = np.concatenate([level(_parts(light)), level(_parts(far))])
    return np.asarray(both / max(float(np.linalg.norm(both)), 1e-9))
