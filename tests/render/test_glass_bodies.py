"""Bodies of glass in, beside and against each other: slabs seen straight, of which sums of reflections are known."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from tests.render.glass_scenes import Floats, colors_of, glass, scene
from tests.render.path_scenes import path, scene_of
from tests.variants import one_of

pytestmark = pytest.mark.light

COLOR, DEPTH = np.array([0.9, 0.5, 0.2]), 1.0
ASIDE = 6.0  # so that no ray meets the set
MATERIALS: dict[str, Any] = {
    "clear": glass(0, 1.5),
    "amber": glass(0, 1.5, color=COLOR.tolist(), depth=DEPTH),
    "water": glass(0, 1.33, color=COLOR[::-1].tolist(), depth=2 * DEPTH),
    "flint": glass(0, 1.8, color=[0.8, 0.8, 0.8], depth=DEPTH),
    "air": glass(0, 1.0),
    "dye": glass(0, 1.0, color=COLOR.tolist(), depth=DEPTH),
    "white": {"base": {"color": [1, 1, 1]}, "specular": {"weight": 0}},
}


def slab(material: str, begin: float, end: float, width: float = 9) -> dict[str, Any]:
    """Across the view, between two places along it."""
    middle = [0, (begin + end) / 2, ASIDE]
    return {"type": "box", "size": [width, end - begin, width], "position": middle, "material": material}


def seen_straight(layers: list[tuple[str, float]]) -> Floats:
    """What is seen of layers (material, thickness) in a white surrounding: what they reflect, and what comes through."""
    indices = [1.0, *(MATERIALS[name]["specular"]["ior"] for name, _ in layers), 1.0]
    reflected, through = np.zeros(3), np.ones(3)
    for number in reversed(range(len(layers) + 1)):
        before, beyond = indices[number], indices[number + 1]
        mirror = ((before - beyond) / (before + beyond)) ** 2
        passes: Any = 1.0
        if number < len(layers):
            name, thickness = layers[number]
            inner = MATERIALS[name]["transmission"]
            passes = np.array(inner.get("color", [1, 1, 1])) ** (thickness / inner.get("depth", 1))
        again = 1 / (1 - mirror * passes**2 * reflected)
        through = (1 - mirror) * passes * through * again
        reflected = mirror + (1 - mirror) ** 2 * passes**2 * reflected * again
    found: Floats = reflected + through
    return found


# Objects, and the layers that they are.
CASES: dict[str, tuple[dict[str, Any], list[tuple[str, float]]]] = {
    "nested": (
        {
            "a": slab("amber", 0, 1.6, 9),
            "b": slab("water", 0.2, 1.3, 8),
            "c": slab("flint", 0.4, 1.1, 7),
            "d": slab("air", 0.7, 0.9, 6),
        },
        [
            ("amber", 0.2),
            ("water", 0.2),
            ("flint", 0.3),
            ("air", 0.2),
            ("flint", 0.2),
            ("water", 0.2),
            ("amber", 0.3),
        ],
    ),
    "equal": ({"a": slab("amber", 0, 0.4), "b": slab("amber", 0.4, 0.7)}, [("amber", 0.7)]),
    "turned round": ({"b": slab("amber", 0.4, 0.7), "a": slab("amber", 0, 0.4)}, [("amber", 0.7)]),
    "overlapping": ({"a": slab("amber", 0, 0.5), "b": slab("amber", 0.3, 0.7)}, [("amber", 0.7)]),
    "touching": (
        {"a": slab("water", 0, 0.4), "c": slab("flint", 0.7, 0.9), "b": slab("amber", 0.4, 0.7)},
        [("water", 0.4), ("amber", 0.3), ("flint", 0.2)],
    ),
    "one index": (
        {"a": slab("clear", 0, 1), "b": slab("amber", 0.3, 0.5, 6)},
        [("clear", 0.3), ("amber", 0.2), ("clear", 0.5)],
    ),
    "no index": ({"a": slab("dye", 0, 0.8)}, [("dye", 0.8)]),
    "flush": (
        {"tumbler": slab("clear", 0, 1), "drink": slab("water", 0.4, 1, 7)},
        [("clear", 0.4), ("water", 0.6)],
    ),
}


def middle_of(objects: dict[str, Any], **sections: Any) -> Floats:
    """The mean colour that is seen straight."""
    camera = {"position": [0, 34, ASIDE], "target": [0, 44, ASIDE], "fov": 1}
    shown = scene(
        objects, MATERIALS, camera=camera, background={"top": [1] * 3, "bottom": [1] * 3}, **sections
    )
    found: Floats = colors_of(shown, 64).mean(axis=(0, 1))
    return found


@pytest.mark.parametrize("case", one_of("nested", *(name for name in CASES if name != "nested")))
def test_slabs_are_as_the_sum_of_all_reflections(case: str) -> None:
    objects, layers = CASES[case]
    np.testing.assert_allclose(middle_of(objects), seen_straight(layers), rtol=0.006)


def plane(place: float, out: float, **more: Any) -> dict[str, Any]:
    """A plane that takes away what is beyond a place along the view, `out` 1, or before it, -1."""
    return {
        "plane": {"center": [0, place, ASIDE], "normal": [0, out, 0]},
        "cut": True,
        "opacity": 0,
        **more,
    }


@pytest.mark.parametrize("of_set", one_of(True, False))
def test_planes_open_glass(of_set: bool) -> None:
    """Of a ball of glass two planes leave a slab: of one beside the set, and of the set."""
    at = 0.0 if of_set else 44.0
    planes = [plane(at - 0.3, -1), plane(at + 0.4, 1)]
    if of_set:
        image = {"width": 16, "height": 16}
        shown = scene_of(
            materials=MATERIALS,
            material={"name": "amber"},
            lighting=path(48),
            image=image,
            camera={"position": [0, -4, 0], "target": [0, 0, 0], "fov": 1},
            background=[1, 1, 1],
            cut_planes=[
                {**each, "plane": {**each["plane"], "center": [0, each["plane"]["center"][1], 0]}}
                for each in planes
            ],
        )
        found = colors_of(shown, 64).mean(axis=(0, 1))
    else:
        ball = {"type": "sphere", "radius": 2, "position": [0, 0, ASIDE], "material": "amber"}
        named = [{**each, "set": False, "objects": ["ball"]} for each in planes]
        found = middle_of({"ball": ball}, cut_planes=named)
    np.testing.assert_allclose(found, seen_straight([("amber", 0.7)]), rtol=0.006)


def test_fog_is_not_in_the_body_that_the_eye_is_in() -> None:
    """All that is white stays white through air that is a body; in the open fog would have dimmed it."""
    fog = {"density": 0.2, "color": [0, 0, 0]}
    np.testing.assert_allclose(middle_of({"a": slab("air", -20, 1)}, fog=fog), 1, atol=1e-3)
    assert middle_of({"a": slab("air", 0, 1)}, fog=fog).max() < np.exp(-0.2 * 9)
