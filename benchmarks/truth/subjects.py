"""What is measured: every formula of the library in a scene, and formulas of users' kind."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clfractal.errors import ClfractalError, Where, unknown_name
from clfractal.files import resources
from clfractal.formulas import catalog
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

SIDE = 480
"""Pixels of a picture's width and height."""

# Where another scene than the formula's own, or the first that shows it, tells more.
_CHOSEN = {"hast": "hast_above"}

_CHAIN = {
    "chain": [{"name": "hast", "count": 2}, {"name": "burning_ship", "count": 1}],
    "iterations": 9,
}
_FOLD = {
    "inline": {
        "variables": ["x", "y", "z"],
        "let": {
            "fx": "abs(x + 1) - abs(x - 1) - x",
            "fy": "abs(y + 1) - abs(y - 1) - y",
            "fz": "abs(z + 1.2) - abs(z - 1.2) - z",
            "k": "2/clamp(fx*fx + fy*fy + fz*fz, 0.3, 1)",
        },
        "map": ["fx*k", "fy*k", "fz*k"],
        "add": "point",
        "degree": 1,
        "bounds": {"center": [0, 0, 0], "radius": 12.5},
        "bailout": 21.6,
    },
    "iterations": 9,
}
_FOUR = {
    "inline": {
        "variables": ["x", "y", "z", "w"],
        "map": [
            "x*x - y*y - z*z - 0.5*w*w",
            "2*x*y + 0.7*z*w",
            "2*x*z - 0.4*y*w",
            "x*w + 0.6*y*z",
        ],
        "slice": {"w": "0.15 + 0.3*x"},
        "add": "point",
        "degree": 2,
        "bounds": {"center": [0, 0, 0], "radius": 2},
        "bailout": 4,
    },
    "iterations": 9,
}
_OWN: Mapping[str, tuple[Mapping[str, Any], Mapping[str, Any]]] = {
    "user chain": (_CHAIN, {"position": [-1.9, -2.9, 1.5], "target": [-0.35, 0, 0], "fov": 40}),
    "user fold": (_FOLD, {"position": [12, -21, 13], "target": [0, 0, 0], "fov": 40}),
    "user four": (_FOUR, {"position": [-1.9, -2.9, 1.5], "target": [-0.35, 0, 0], "fov": 40}),
}


@dataclass(frozen=True, slots=True)
class Subject:
    """A formula in a scene: `source` says which scene it comes from."""

    name: str
    source: str
    scene: Scene


def names() -> list[str]:
    """Of everything that is measured."""
    return [*catalog.names(), *_OWN]


def subjects(
    wanted: Sequence[str] = (), *, side: int = SIDE, overrides: Sequence[str] = ()
) -> Iterator[Subject]:
    """The wanted ones, or all, with a bare picture of `side` x `side` pixels; `overrides` as of `load_scene`.

    Raises:
        ClfractalError: there is no such one, or an override is wrong.
    """
    for name in wanted:
        if name not in names():
            raise ClfractalError(unknown_name("formula", name, names()), Where("--formula"))
    shown = _scenes()
    for name in wanted or names():
        if name in _OWN:
            formula, camera = _OWN[name]
            yield Subject(
                name, "-", bare({"formula": dict(formula), "camera": dict(camera)}, side, overrides)
            )
        elif name in shown:
            yield Subject(name, shown[name][0], stripped(shown[name][1], side, overrides))
        else:
            data = {"formula": {"name": name, "iterations": 8}, "camera": {"frame": "all"}}
            yield Subject(name, "-", bare(data, side, overrides))


def stripped(scene: Scene, side: int, overrides: Sequence[str] = ()) -> Scene:
    """A scene's formula, camera and bounds, and nothing else of it, as a square picture."""
    camera = scene.camera.model_dump(mode="json", exclude_none=True)
    kept = ("projection", "position", "target", "up", "fov", "height")
    own = getattr(scene.renderer, "bounds", None)
    data: dict[str, Any] = {
        "formula": scene.formula.mapping(),
        "camera": {key: value for key, value in camera.items() if key in kept},
    }
    if own is not None:
        data["renderer"] = {"bounds": own.model_dump(mode="json")}
    return bare(data, side, overrides, scene.folder)


def bare(
    data: Mapping[str, Any], side: int, overrides: Sequence[str] = (), folder: Path | None = None
) -> Scene:
    """A scene without light, one ray to a pixel through its middle, hits as near as `detail: 1` says."""
    whole = {"version": 1, "image": {"width": side, "height": side}, "lights": [], **data}
    return load_scene(whole, overrides=overrides, folder=folder)


def _scenes() -> dict[str, tuple[str, Scene]]:
    """By formula: the scene that shows its surface, and that scene's name."""
    found: dict[str, tuple[str, Scene]] = {}
    for path in sorted(resources.folder("scenes").glob("*.yaml")):
        scene = load_scene(path)
        name = scene.formula.name
        if name is None or scene.renderer.type != "surface" or scene.layout is not None:
            continue
        best = _CHOSEN.get(name, name)
        if name not in found or path.stem == best:
            found[name] = (path.stem, scene)
    return found
