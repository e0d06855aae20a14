"""The texts of all programs that there are, without a device: what a compiler alone can be asked about."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain
from typing import Any

import clfractal
from clfractal.device import lane_probe as probe
from clfractal.device import peak
from clfractal.device.source import FlatText, SourceMap
from clfractal.device.structs import Precision
from clfractal.engine import canvas, carry, show
from clfractal.formulas import catalog
from clfractal.formulas.opencl import write_formula
from clfractal.geometry.solids import Body
from clfractal.integrators import cut_plane, points, surface, trial, volume
from clfractal.integrators.declarations import STRUCTS
from clfractal.integrators.plan import make_plan
from clfractal.scene.volume import VolumeRenderer
from clfractal.voxels import programs
from tests.device import struct_layout
from tests.portability.pictures import CHANNELS, SIZE, cases, scene_of

Named = tuple[str, FlatText]


PICTURES = tuple(dict.fromkeys(name for name, _ in cases("full")))
"""The pictures that all implementations render: every renderer with all that it can do, and some formulas."""
EVERY_KIND = ("still", "steps", "volumes", "cloud", "plane")
"""Those that differ in more than the formula."""


def every_text(count: int, precision: Precision, pictures: Sequence[str] = PICTURES) -> Iterator[Named]:
    """Names and texts, with packets of `count` lanes: each text once, since pictures share those that know no formula."""
    told: set[str] = set()
    for name, program in chain(
        of_pictures(count, precision, pictures), of_more(count, precision), of_others(count, precision)
    ):
        if program.text not in told:
            told.add(program.text)
            yield name, program


def of_others(count: int, precision: Precision) -> Iterator[Named]:
    """All that is no renderer: grids, lists of points, measurements of the device, the window."""
    yield from of_grids(count, precision)
    yield "probe", probe.program_text(count, precision)
    for name in ("mandelbulb", "hast"):  # by a scalar rule, and by the Jacobian
        yield (
            f"march_probe {name}",
            trial.program_text(write_formula(catalog.load_chain(name)), count, precision),
        )
    if count == 1:  # these know no packets
        yield "structs", FlatText(struct_layout.program_text(STRUCTS, precision), SourceMap())
        yield "peak", FlatText(peak.program_text(precision), SourceMap())
    if count == 1 and precision == "float32":
        yield "canvas", canvas.program_text()
        yield "carry", carry.program_text()
        for to_image in (False, True):
            yield f"show {to_image=}", show.program_text(to_image=to_image)


# What none of the pictures has: fog around the set, exact normals of a grid, a grid along paths, clear glass, costly parts
# of materials, light that water, balls and other shapes bend, light that is sought, and orbits that begin late.
_MORE: dict[str, dict[str, Any]] = {
    "exact": {"renderer": {"type": "volume", "normals": "exact"}},
    "lit": {
        "renderer": {
            "type": "volume",
            "transfer": {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 1}]},
        },
        "lighting": {"mode": "path"},
    },
    "clear": {
        "lighting": {"mode": "path"},
        "materials": {"clear": {"transmission": {"weight": 1}}},
        "material": {"name": "clear"},
    },
    "film": {
        "lighting": {"mode": "path"},
        "materials": {"film": {"thin_film": {"weight": 1}, "specular": {"anisotropy": 0.5}}},
        "material": {"name": "film"},
    },
    "bent": {
        "lighting": {"mode": "path"},
        "materials": {"water": {"specular": {"roughness": 0}, "transmission": {"weight": 1}}},
        "objects": {"sea": {"type": "water", "waves": {"height": 0}, "material": "water"}},
    },
    "bent shapes": {
        "lighting": {"mode": "path"},
        "materials": {"glass": {"specular": {"roughness": 0}, "transmission": {"weight": 1}}},
        "objects": {"block": {"type": "box", "material": "glass"}},
    },
    "mist": {"mist": {"by": "iterations"}},
    "deep": {"deep": {"magnification": 1e6}},
    "deep volume": {"deep": {"magnification": 1e6}, "renderer": {"type": "volume", "normals": "exact"}},
    "deep plane": {
        "deep": {"magnification": 1e6},
        "renderer": {"type": "cut_plane", "plane": {"corners": [[-1, -1, 0], [1, -1, 0], [-1, 1, 0]]}},
    },
    "sought": {
        "lighting": {"mode": "path"},
        "materials": {"embers": {"emission": {"luminance": {"by": "iterations"}}}},
        "material": {"name": "embers"},
    },
}


def of_more(count: int, precision: Precision) -> Iterator[Named]:
    """The programs of renderers that no picture has."""
    camera = {"position": [0, -4, 1], "target": [0, 0, 0]}
    for name, sections in _MORE.items():
        scene = clfractal.load_scene(
            {"version": 1, "formula": {"name": "hast"}, "camera": camera, **sections}
        )
        for part, text in of_scene(scene, count, precision):
            yield f"{part} {name}", text


def of_pictures(count: int, precision: Precision, pictures: Sequence[str]) -> Iterator[Named]:
    """The programs of renderers."""
    for name in pictures:
        for part, text in of_scene(scene_of(name, (16, 16)), count, precision):
            yield f"{part} {name}", text


def of_scene(scene: clfractal.Scene, count: int, precision: Precision) -> Iterator[Named]:
    """The programs that render a scene, each by what it does."""
    plan = make_plan(scene, precision=precision, lanes=count, channels=CHANNELS)
    # What moves meanwhile makes no difference to the texts.
    plan = replace(plan, moving=scene.animation is not None and scene.animation.shutter > 0)
    if scene.renderer.type == "volume":
        yield volume.kernel_of(scene), volume.program_text(scene, plan)
    elif scene.renderer.type == "cut_plane":
        yield "cut_plane", cut_plane.program_text(scene, plan)
    else:
        for text in surface.program_texts(scene, plan):
            yield text.name, text.flat


def of_grids(count: int, precision: Precision) -> Iterator[Named]:
    """All that fills and stores voxels."""
    body = Body(catalog.load_chain("hast"), 12)
    recipes = [programs.nodes_recipe(body, count, precision)]
    for value in programs.FILL_KINDS:
        renderer = VolumeRenderer.model_validate({"type": "volume", "value": value})
        recipes.append(programs.fill_recipe(body, renderer, count, precision))
    recipes.append(programs.normals_recipe(body, count, precision))
    if count == 1 and precision == "float32":  # these know neither packets nor the formula
        for alone in (False, True):
            recipes += [
                programs.classify_recipe("bits", "byte", alone=alone),
                programs.classify_recipe("bricks", "float", alone=alone),
                programs.store_recipe("bits", "byte", 0, alone=alone),
                programs.store_recipe("bits", "byte", 1, alone=alone),
                programs.store_recipe("bricks", "float", 2, alone=alone),
                programs.store_recipe("bricks", "byte", 4, alone=alone),
                programs.store_recipe("slab", "float", 1, alone=alone),
            ]
        recipes += [programs.blocks_recipe(), programs.ranges_recipe()]
    for recipe in recipes:
        yield f"{recipe.kernel} {_choices(recipe.defines)}".strip(), programs.program_text(recipe)
    for recipe in _joined_recipes(count, precision):
        yield f"{recipe.kernel} {_choices(recipe.defines)} joined", programs.program_text(recipe)


def _joined_recipes(count: int, precision: Precision) -> Iterator[programs.Recipe]:
    """Of several solids that are joined: each kernel that asks them."""
    for name in ("filled", "counted"):
        scene = scene_of(name, SIZE)
        assert isinstance(scene.renderer, VolumeRenderer)
        body = Body.of(scene)
        yield programs.fill_recipe(body, scene.renderer, count, precision)
        if name == "filled":
            yield programs.nodes_recipe(body, count, precision)
            yield programs.normals_recipe(body, count, precision)


def _choices(defines: Mapping[str, object]) -> str:
    """What a recipe's defines say beside the number type: `fill_kind=1 sample=float`."""
    said = ("FILL_KIND", "SOURCE", "SAMPLE", "VALUE", "RADIUS", "ALONE")
    return " ".join(f"{name.lower()}={defines[name]}" for name in said if name in defines)


def of_formulas() -> Iterator[Named]:
    """The library's formulas, each in the smallest program with counts, distances and gradients."""
    for name in catalog.names():
        yield name, points.program_text(Body(catalog.load_chain(name), 1), 1, "float32")
