"""White before white is not seen: of light that is reflected, bent and scattered nothing is lost or made."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from typing import Any

import numpy as np
import pytest

from clfractal.scene.model import Scene
from tests.render.glass_scenes import BODIES, ball, colors_of, glass, scene
from tests.render.path_scenes import BALL, GREY, Floats, path, scene_of, seen
from tests.variants import combinations

pytestmark = pytest.mark.light

WHITE: dict[str, Any] = {"color": [1, 1, 1]}
MATT: dict[str, Any] = {"base": WHITE, "specular": {"weight": 0}}
# Materials of the set, a ball.
MATERIALS: dict[str, dict[str, Any]] = {
    "clay": {"base": {**WHITE, "diffuse_roughness": 0.7}, "specular": {"weight": 0}},
    "gloss": {"base": WHITE, "specular": {"roughness": 0.4}},
    "metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0.6}},
    "coat": {"base": WHITE, "coat": {"weight": 1, "roughness": 0.3}},
    "mapped_roughness": {
        "base": {**WHITE, "metalness": {"by": "height", "range": [-1, 1]}},
        "specular": {"roughness": {"by": "normal", "curve": [[0, 0.1], [1, 0.9]]}},
    },
    "mapped_layers": {
        "base": {**WHITE, "diffuse_roughness": {"by": "normal"}},
        "coat": {"weight": {"by": "height", "range": [-1, 1]}, "roughness": {"by": "normal"}},
        "specular": {"ior": {"by": "normal", "curve": [[0, 1], [1, 2]]}},
    },
    "blend": {
        "blend": ["mapped_roughness", "mapped_layers"],
        "mask": {"by": "normal", "range": [-0.5, 0.5]},
    },
}
# Steep reliefs lose no light, and make none.
STEEP = {"by": "height", "range": [0, 0.5], "repeat": True, "curve": [[0, 0], [0.5, 0.3], [1, 0]]}
RELIEFS: dict[str, dict[str, Any]] = {
    "clay": {"base": {**WHITE, "diffuse_roughness": 0.4}, "specular": {"weight": 0}},
    "metal": {"base": {**WHITE, "metalness": 1}, "specular": {"roughness": 0.4}},
    "lacquer": {"base": WHITE, "coat": {"weight": 1, "roughness": 0.1}, "fuzz": {"weight": 0.3}},
}
RELIEF_OF_GLASS = {
    **glass(0.2, 1.4),
    "bump": {"height": {**STEEP, "curve": [[0, 0], [0.5, 0.1], [1, 0]]}, "width": 0.05},
}
HOLES: dict[str, Any] = {
    "hole": {"type": "sphere", "radius": 0.5, "position": [0.2, -0.9, 0.3], "join": "cut"},
    "hollow": {
        "type": "formula",
        "formula": BALL,
        "scale": 0.4,
        "position": [-0.5, -0.7, 0.2],
        "join": "cut",
    },
    "drop": {"type": "sphere", "radius": 0.4, "position": [0.9, -0.5, -0.4], "join": "smooth_union"},
}
CLOSE = {"position": [1.4, -2.6, 1.1], "fov": 40}


def milk(ior: float = 1.5, roughness: float = 0, **transmission: Any) -> dict[str, Any]:
    """A medium that absorbs nothing."""
    return glass(roughness, ior, **{"depth": 0.5, "scatter": [1, 1, 1], **transmission})


def skin(roughness: float, **values: Any) -> dict[str, Any]:
    """A medium below its boundary, of which nothing is absorbed; `base` is not seen."""
    return {
        "base": {"color": [0, 0, 0]},
        "specular": {"roughness": roughness},
        "subsurface": {"weight": 1, **WHITE, **values},
    }


def set_of(material: dict[str, Any], bounces: int = 2, **sections: Any) -> Scene:
    """The set of a material, unless the sections say otherwise."""
    parts = {name: MATERIALS[name] for name in material.get("blend", ())}
    usual = {"materials": {**parts, "m": material}, "lighting": path(bounces)}
    return scene_of(background=GREY, material={"name": "m"}, **{**usual, **sections})


def body_of(material: dict[str, Any], body: str, bounces: int = 48) -> Scene:
    return scene({"body": {**BODIES[body], "material": "m"}}, {"m": material}, bounces=bounces)


# What is seen of the set alone: scene, samples, and how far from 1 the mean may be.
SETS: dict[str, tuple[Callable[[], Scene], int, float]] = {
    **{name: (partial(set_of, m), 64, 0.01) for name, m in MATERIALS.items()},
    "relief of clay": (lambda: set_of({**RELIEFS["clay"], "bump": {"height": STEEP}}), 64, 0.01),
    **{
        f"glass, {roughness}, {weight}": (
            partial(ball, roughness, transmission={"weight": weight}),
            16,
            0.01,
        )
        for roughness, weight in ((0, 0.5), (0.3, 1), (0.7, 0.5), (1, 1))
    },
    # However rough the set; hast is dust where pixels are as wide as here.
    **{
        f"glass of {name}": (
            partial(
                ball,
                0.1,
                bounces=64,
                formula={"name": name, "iterations": iterations},
                camera=CLOSE,
                renderer={"search": "steps"},
            ),
            16,
            error,
        )
        for name, iterations, error in (
            ("mandelbulb", 4, 0.01),
            ("menger_sponge", 2, 0.01),
            ("hast", 12, 0.03),
        )
    },
    # Two materials flow into each other, of which one's base is black but never seen; a hole is cut into both.
    "joined skin": (
        lambda: set_of(
            skin(0.3, radius=0.1),
            32,
            materials={"m": skin(0.3, radius=0.1), "n": {"base": WHITE}},
            objects={
                "drop": {**HOLES["drop"], "radius": 0.6, "position": [0.9, 0, 0.2], "material": "n"},
                "hole": {"type": "box", "size": [0.5, 3, 0.5], "join": "cut", "material": "m"},
            },
        ),
        96,
        0.012,
    ),
    "skin under layers": (lambda: layered_skin(0.05), 32, 0.01),
}
MORE_SETS: dict[str, tuple[Callable[[], Scene], int, float]] = {
    **{
        f"relief of {name}": (partial(set_of, {**RELIEFS[name], "bump": {"height": STEEP}}), 64, 0.01)
        for name in ("metal", "lacquer")
    },
    "relief of glass": (
        lambda: set_of(
            RELIEF_OF_GLASS,
            64,
            lighting=path(64, roulette=64),
            renderer={"samples": 1, "search": "steps"},
        ),
        64,
        0.015,
    ),
    **{
        f"glass of {name} by distance": (
            partial(ball, 0.1, bounces=64, formula={"name": name, "iterations": iterations}, camera=CLOSE),
            16,
            0.01,
        )
        for name, iterations in (("mandelbulb", 4), ("menger_sponge", 2))
    },
    # Within a set each scattering is a bounce.
    **{
        f"milk, {ior}": (
            partial(
                ball,
                0,
                ior,
                bounces=64,
                transmission={"depth": 1.0, "scatter_anisotropy": 0.3, "scatter": [1, 1, 1]},
            ),
            32,
            0.01,
        )
        for ior in (1.5, 1.005)
    },
    "thin skin under layers": (lambda: layered_skin(0.5), 32, 0.01),
    "dense skin under layers": (lambda: layered_skin(0.004), 32, 0.01),
    "what stands in skin": (
        lambda: set_of(
            {},
            64,
            materials={
                "m": skin(0.3, radius=0.2),
                "glass": glass(0.1),
                "white": {"base": WHITE},
            },
            objects={
                "glass": {"type": "sphere", "radius": 0.4, "position": [0.5, -0.9, 0.3], "material": "glass"},
                "core": {"type": "sphere", "radius": 0.5, "position": [-0.4, -0.8, 0], "material": "white"},
            },
        ),
        32,
        0.015,
    ),
}


def layered_skin(radius: float) -> Scene:
    """With a boundary, a coat and fuzz over it, and beside a diffuse part of the body. (Each path brings more and more of
    one colour where they scatter unlike, so all colours together are looked at.)"""
    layers = {"coat": {"weight": 0.5, "roughness": 0.3}, "fuzz": {"weight": 0.3}}
    return set_of({"base": WHITE, **layers, "subsurface": {**WHITE, "weight": 0.7, "radius": radius}}, 16)


def lake(height: float) -> Scene:
    """A white ground under water, from above the waves and from below."""
    objects = {
        "ground": {"type": "plane", "position": [0, 0, -1.5], "material": "white"},
        "lake": {"type": "water", "waves": {"height": 0.1, "length": 1.5}, "material": "lake"},
    }
    camera = {"position": [0, 40, height], "target": [0, 44, -1], "fov": 30}
    return scene(objects, {"white": MATT, "lake": glass(0, 1.33)}, camera=camera, bounces=64)


def glossy_objects() -> Scene:
    """A floor, and what stands and hovers over it."""
    parts: dict[str, dict[str, Any]] = {
        "floor": {"type": "plane", "position": [0, 0, -0.5]},
        "ball": {"type": "sphere", "position": [0.2, -0.1, 0.3], "radius": 0.4},
        "box": {"type": "box", "size": [0.4, 0.4, 1], "position": [-0.8, 0.4, 0], "rotation": [0, 0, 30]},
    }
    objects = {name: {**each, "material": "gloss"} for name, each in parts.items()}
    camera = {"position": [1, 42.2, 2], "target": [0.1, 44, 0], "fov": 48}
    return scene(objects, {"gloss": MATERIALS["gloss"]}, camera=camera, bounces=32)


def holes(roughness: float) -> Scene:
    """Glass of which something is cut out, and into which something flows."""
    return scene_of(
        objects=HOLES,
        materials={"glass": glass(roughness)},
        material={"name": "glass"},
        lighting=path(64),
        image={"width": 96, "height": 96},
        background=GREY,
        camera={"position": [0.6, -4, 1], "fov": 36},
    )


def glass_in_glass() -> Scene:
    """Whichever is the denser, and whether it is an object or the set; and where three stand in each other."""
    objects = {
        "box": {"type": "box", "size": [3, 3, 3], "position": [0, -44, 0], "material": "box"},
        "ball": {"type": "sphere", "radius": 0.9, "position": [0.9, -44.6, 0], "material": "ball"},
    }
    materials = {"box": glass(0.2, 1.3), "ball": glass(0, 1.6), "set": glass(0.1, 1.2)}
    eye = {"position": [1, -5, 1.5], "fov": 32}
    return scene(objects, materials, camera=eye, material={"name": "set"}, bounces=64)


def in_milk(eye: list[float]) -> Scene:
    """A white ball, a bubble of air's index, and milk in milk; the eye outside and inside."""
    materials = {"milk": milk(1.3), "cream": milk(1.5, 0.3, depth=0.2), "air": glass(0, 1.0), "white": MATT}
    parts = {
        "milk": {"type": "box", "size": [3, 3, 3], "material": "milk"},
        "core": {"type": "sphere", "radius": 0.5, "position": [0.6, -0.5, 0.4], "material": "white"},
        "cream": {"type": "sphere", "radius": 0.6, "position": [-0.7, -0.8, -0.3], "material": "cream"},
        "bubble": {"type": "sphere", "radius": 0.4, "position": [0.5, -1, -0.7], "material": "air"},
    }
    return scene(parts, materials, camera={"position": eye, "target": [0, 44, 0], "fov": 50}, bounces=64)


SOFT = skin(0.4, radius=0.2, scatter_anisotropy=0.4)
# What is seen of whole pictures.
PICTURES: dict[str, tuple[Callable[[], Scene], int, float]] = {
    "box of rough glass": (lambda: body_of(glass(0.5), "box"), 256, 0.005),
    "box of milk": (lambda: body_of(milk(1.3, scatter_anisotropy=-0.5), "box", 64), 16, 0.01),
    "sphere of skin": (lambda: body_of(SOFT, "sphere", 16), 32, 0.01),
    "lake from above": (lambda: lake(2), 16, 0.01),
    "lake from below": (lambda: lake(-0.8), 16, 0.01),
    "glossy objects": (glossy_objects, 32, 0.01),
    "holes in glass": (lambda: holes(0), 32, 0.01),
}
MORE_PICTURES: dict[str, tuple[Callable[[], Scene], int, float]] = {
    **{
        f"{body} of glass, {roughness}": (
            partial(body_of, glass(roughness), body),
            256 if roughness else 16,
            0.005,
        )
        for body, roughness in (
            ("sphere", 0),
            ("cylinder", 0),
            ("box", 0),
            ("sphere", 0.5),
            ("cylinder", 0.5),
        )
    },
    **{
        f"{body} of milk, {ior}, {g}": (
            partial(body_of, milk(ior, scatter_anisotropy=g), body, 64),
            16,
            0.01,
        )
        for body, ior, g in (("sphere", 1.005, 0.0), ("sphere", 1.5, 0.8), ("cylinder", 1.5, 0.0))
    },
    **{f"{body} of skin": (partial(body_of, SOFT, body, 16), 32, 0.01) for body in ("box", "cylinder")},
    "glass in glass": (glass_in_glass, 16, 0.01),
    "holes in rough glass": (lambda: holes(0.4), 32, 0.01),
    "in milk, from outside": (lambda: in_milk([0, 39, 0]), 64, 0.015),
    "in milk, from inside": (lambda: in_milk([0.1, 42.7, 0.5]), 64, 0.015),
}


@pytest.mark.parametrize("name", [*SETS, *combinations(MORE_SETS)])
def test_sets(name: str) -> None:
    build, samples, error = {**SETS, **MORE_SETS}[name]
    colors = seen(build(), samples)[0]
    assert len(colors) > 100
    # (Under layers all colours together are looked at: see `layered_skin`.)
    means = colors.mean(axis=None if "under layers" in name else 0)
    assert np.abs(means - 1).max() < error


@pytest.mark.parametrize("name", [*PICTURES, *combinations(MORE_PICTURES)])
def test_pictures(name: str) -> None:
    build, samples, error = {**PICTURES, **MORE_PICTURES}[name]
    colors: Floats = colors_of(build(), samples)
    assert np.abs(colors.mean(axis=(0, 1)) - 1).max() < error
    # Light that edges of holes lose is lost in few pixels.
    assert "holes" not in name or np.percentile(colors, 2) > 0.8


@pytest.mark.parametrize(
    ("formula", "position", "bounces", "least"),
    [
        ({"name": "mandelbox", "iterations": 10}, [11, -19, 10], 64, 0.999),
        # Its holes keep light for long: by exact cubes 0.973 of it leaves in 64 bounces, in 256 all but 0.0005;
        # what goes on for so long is rare and weighs much, so that means of these samples are 0.003 off.
        ({"name": "menger_sponge", "iterations": 4}, [1.8, -3, 1.7], 256, 0.99),
    ],
    ids=["mandelbox", "menger_sponge"],
)
def test_light_that_goes_from_wall_to_wall(
    formula: dict[str, Any], position: list[float], bounces: int, least: float
) -> None:
    """Where the surface, as far as it is known, faces away from a path it has light, too: 2 % of all was lost there."""
    hollow = set_of(
        MATT,
        formula=formula,
        renderer={"firefly_limit": None},
        # (Finer, more light is caught for longer.)
        lighting=path(bounces, detail=1),
        camera={"position": position, "fov": 40},
    )
    colors, _, whole = seen(hollow, 24)
    assert whole.mean() > 0.2
    assert np.abs(colors.mean(axis=0) - 1).max() < 1 - least
