"""Small scenes, and whether two of their pictures are the same."""

from __future__ import annotations

import numpy as np

import clfractal
from tests.scenes import bulb_text

SIZE = (64, 48)

BULB = bulb_text(SIZE)

VOLUME = BULB + "renderer: {type: volume, resolution: 32, value: coverage}\n"


def equal(first: clfractal.Framebuffer, second: clfractal.Framebuffer) -> None:
    assert first.channels == second.channels
    for name in first.channels:
        np.testing.assert_array_equal(first[name], second[name], name)


def changed(text: str, *overrides: str) -> clfractal.Scene:
    return clfractal.load_scene(text, overrides=overrides)


SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 300, height: 200}
camera: {position: [0, -2.4, 0.4], fov: 45}
renderer: {type: surface, samples: 5}
lights: [{direction: [1, 1, -1], shadow: true}]
output: {channels: [R, G, B, A, Z, N.X, P.Y, iterations, steps]}
"""


def same(one: clfractal.Framebuffer, other: clfractal.Framebuffer) -> bool:
    return all(np.array_equal(one[name], other[name], equal_nan=True) for name in one)
