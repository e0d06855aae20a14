"""Mitsuba 3 in a process of its own, and how alike its pictures and ours have to be.

Regions of the pictures are compared: they may differ by the standard errors of both, found from several pictures with other
seeds, times the factor that Bonferroni's correction asks for, and by 1 % for what a surface's footprint is wide.
"""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.stats import t

import clfractal

Floats = npt.NDArray[np.float64]

_HEAD = """
import json, sys
import mitsuba as mi
import numpy as np
mi.set_variant("scalar_rgb")
from mitsuba import ScalarTransform4f as T
told = json.load(sys.stdin)

def pictures(bodies):
    width, height = told["size"]
    scene = mi.load_dict({
        "type": "scene",
        "integrator": {"type": told.get("integrator", "path"), "max_depth": told["bounces"] + 2, "rr_depth": 1000},
        "sensor": {
            "type": "perspective", "fov": told["fov"], "fov_axis": "y",
            "to_world": T().look_at(origin=told["eye"], target=told["target"], up=[0, 0, 1]),
            "film": {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}},
            "sampler": {"type": "independent", "sample_count": told["samples"]},
        },
        **bodies,
    })
    return np.stack([np.array(mi.render(scene, seed=1 + seed))[..., :3] for seed in range(told.get("seeds", 1))])
"""


def by_mitsuba(text: str, told: dict[str, Any], folder: Path) -> Floats:
    """What a text, which knows `told` and makes `pictures` of bodies, says that its `found` is."""
    path = folder / "theirs.npy"
    subprocess.run(
        [sys.executable, "-c", f"{_HEAD}\n{text}\nnp.save({str(path)!r}, found)"],
        input=json.dumps(told),
        text=True,
        check=True,
        timeout=300,
    )
    return np.asarray(np.load(path), np.float64)


def by_us(seeds: int, renderer: dict[str, Any], *, folder: Path | None = None, **sections: Any) -> Floats:
    """Pictures of a scene with files in a folder, one of each seed, shape (seeds, height, width, 3)."""
    scenes = [
        clfractal.load_scene(
            {"version": 1, "renderer": {**renderer, "seed": seed}, **sections}, folder=folder
        )
        for seed in range(seeds)
    ]
    films = [clfractal.render(scene) for scene in scenes]
    return np.stack([np.stack([film[name] for name in "RGB"], axis=-1) for film in films]).astype(float)


def assert_alike(ours: Floats, theirs: Floats, down: int, across: int) -> Floats:
    """In so many regions, of which one fails in a thousand runs; gives the light of each, shape (down, across, 3)."""
    seeds, height, width, _ = ours.shape
    one, other = (
        each.reshape(seeds, down, height // down, across, width // across, 3).mean(axis=(2, 4))
        for each in (ours, theirs)
    )
    error = np.sqrt((one.var(axis=0, ddof=1) + other.var(axis=0, ddof=1)) / seeds)
    difference, scale = one.mean(axis=0) - other.mean(axis=0), other.mean(axis=0)
    factor = t.ppf(1 - 0.001 / 2 / scale.size, 2 * seeds - 2)
    assert (np.abs(difference) <= 0.01 * scale + factor * error + 1e-4).all()
    # And on the whole, beside the noise of both.
    whole, theirs_whole = one.mean(axis=(1, 2, 3)), other.mean(axis=(1, 2, 3))
    noise = np.sqrt((whole.var(ddof=1) + theirs_whole.var(ddof=1)) / seeds)
    assert abs(difference.mean()) < 0.005 * scale.mean() + 3 * noise
    return np.asarray(scale)
