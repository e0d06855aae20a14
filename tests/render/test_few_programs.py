"""What a scene has is data: it neither changes a program's text nor, but for stages that it launches, needs another one."""

from __future__ import annotations

import re
from typing import Any

import pytest

from clfractal.device import program
from clfractal.device.select import Device
from clfractal.integrators import cut_plane, volume
from clfractal.integrators.surface import PROGRAMS, program_texts
from clfractal.scene.model import Scene
from tests.makers import maker
from tests.platforms.programs import every_text
from tests.render.shots import PERSPECTIVE, plan_of, shoot_whole
from tests.scenes import scene_of

FORMULA = {"name": "mandelbulb", "iterations": 6}
PLANE = {"center": [0, 0, 0], "normal": [1, -1, 0.2], "width": 2, "height": 2}
BALL = {"type": "sphere", "position": [1.5, 0, 0], "radius": 0.3}
LAMPS = [
    {"type": "sphere", "position": [3, 0, 0], "radius": 0.2},
    {"type": "rectangle", "position": [0, 3, 0], "direction": [0, -1, -0.5], "width": 1, "height": 1},
    {"type": "spot", "position": [0, 0, 3], "direction": [0, 0, -1]},
    {"type": "point", "position": [2, 2, 2]},
    {"direction": [1, 1, -1], "angular_size": 4},
    {"type": "ies", "position": [2, -2, 2]},
]
# Of each feature what a scene says, and the programs that it needs beside those of a plain one.
FEATURES: dict[str, tuple[dict[str, Any], set[str]]] = {
    "points that shine": ({"lights": LAMPS[2:4]}, set()),
    "lights": ({"lights": LAMPS}, {"wide"}),
    "lights on the set": ({"lights": [{"type": "set", "trap": {"shape": "sphere"}}]}, {"wide"}),
    "sky": ({"environment": {"sky": {}, "rays": 2}}, {"wide"}),
    "map": ({"environment": {"name": "studio", "rays": 2, "background": True}}, {"wide"}),
    "occlusion": ({"renderer": {"ambient_occlusion": {"rays": 2}}}, {"wide"}),
    "fog": ({"fog": {"density": 0.1, "height": 2}}, set()),
    "shafts": ({"fog": {"density": 0.1, "scattering": {}}}, {"air"}),
    "mirror": ({"material": {"reflection": 0.5}}, set()),
    "noise": ({"renderer": {"samples": 64, "noise": 0.02}}, set()),
    "lens": ({"camera": {**PERSPECTIVE, "f_number": 2}}, set()),
    "normal colours": ({"coloring": {"by": "normal"}}, set()),
    "counts": ({"coloring": {"by": "iterations"}}, set()),
    "trap": ({"coloring": {"by": "trap", "trap": {"shape": "sphere"}}}, {"colors"}),
    "thickness": ({"coloring": {"by": "thickness", "along": "view"}}, {"colors"}),
    "layer": ({"coloring": {"by": "layer_distance", "along": "reflection"}}, {"colors"}),
    "glow": ({"glow": {"by": "trap"}}, {"glow"}),
    "mist": ({"mist": {"by": "iterations"}}, {"mist"}),
    "objects": ({"objects": {"ball": BALL, "sea": {"type": "water", "position": [0, 0, -2]}}}, {"objects"}),
    "cut": ({"cut_planes": [{"plane": PLANE, "cut": True}]}, {"planes"}),
    "quads": ({"cut_planes": [{"plane": PLANE}]}, {"planes"}),
    "stack": ({"cut_planes": [{"plane": PLANE, "count": 9, "spacing": 0.1}]}, {"planes"}),
}
GLASS: dict[str, Any] = {"transmission": {"weight": 1, "dispersion_scale": 1}}
CLEAR: dict[str, Any] = {"specular": {"roughness": 0}, "transmission": {"weight": 1}}
MILK: dict[str, Any] = {"transmission": {"weight": 1, "depth": 1, "scatter": [1, 1, 1]}}
SKIN: dict[str, Any] = {"subsurface": {"weight": 1}}
PATHS = {"lighting": {"mode": "path"}}
RISES = {"curve": [[0, 0.1], [1, 0.4]]}
LAMP = {"lights": LAMPS[:1]}
GLOW = {"glow": {"emission": {"luminance": 3}}}
# The same of scenes along paths. (Where materials have costly parts, paths are scattered by a stage that knows of them.)
FEATURES_OF_PATHS: dict[str, tuple[dict[str, Any], set[str]]] = {
    "lights": (FEATURES["lights"][0], set()),
    "lights on the set": (FEATURES["lights on the set"][0], set()),
    "map": (FEATURES["map"][0], set()),
    "shining object": ({"objects": {"ball": {**BALL, "material": "glow"}}, "materials": GLOW}, {"objects"}),
    "sought light": ({"material": {"name": "glow"}, "materials": GLOW}, {"sought"}),
    "shafts of sought light": (
        {"material": {"name": "glow"}, "materials": GLOW, **FEATURES["shafts"][0]},
        {"air", "sought"},
    ),
    "map of a material": (
        {
            "material": {"name": "m"},
            "materials": {"m": {"specular": {"roughness": {"by": "height", **RISES}}}},
        },
        {"materials"},
    ),
    "relief": (
        {"material": {"name": "m"}, "materials": {"m": {"bump": {"height": {"by": "height", **RISES}}}}},
        {"materials"},
    ),
    "blend": (
        {
            "material": {"name": "m"},
            "materials": {"m": {"blend": ["glow", "n"], "mask": 0.5}, "n": {}, **GLOW},
        },
        {"materials", "sought"},
    ),
    "tangent": (
        {"materials": {"m": {"specular": {"anisotropy": 0.8}}}, "material": {"name": "m"}},
        {"costly", "scatter"},
    ),
    "film": (
        {"materials": {"m": {"thin_film": {"weight": 1}}}, "material": {"name": "m"}},
        {"costly", "scatter"},
    ),
    "glass": ({"materials": {"m": GLASS}, "material": {"name": "m"}}, {"glass"}),
    "milk": ({"materials": {"m": MILK}, "material": {"name": "m"}}, {"random_walk", "media"}),
    "skin": ({"materials": {"m": SKIN}, "material": {"name": "m"}}, {"random_walk", "media"}),
    "glass that scatters nothing": (
        {
            "materials": {
                "m": {
                    "transmission": {**MILK["transmission"], "scatter": [0, 0, 0], "scatter_anisotropy": 0.5}
                }
            },
            "material": {"name": "m"},
        },
        {"glass"},
    ),
    "light through a ball": (
        {"objects": {"ball": {**BALL, "material": "m"}}, "materials": {"m": CLEAR}, **LAMP},
        {"objects", "bent"},
    ),
    "light through a block": (
        {"objects": {"block": {"type": "box", "material": "m"}}, "materials": {"m": CLEAR}, **LAMP},
        {"objects", "bent_shapes"},
    ),
    # Rays within objects of glass are ordinary rays.
    "object of glass": (
        {"objects": {"ball": {**BALL, "material": "m"}}, "materials": {"m": GLASS}},
        {"objects"},
    ),
    "transmission without weight": (
        {
            "materials": {"m": {"transmission": {**GLASS["transmission"], "weight": 0, "depth": 2}}},
            "material": {"name": "m"},
        },
        set(),
    ),
    "subsurface without weight": (
        {"materials": {"m": {"subsurface": {"weight": 0, "radius": 2}}}, "material": {"name": "m"}},
        set(),
    ),
}
# What may be joined to a formula, and in which ways: beside the formulas all of it is data.
HAST = {"type": "formula", "formula": {"name": "hast", "iterations": 9}, "position": [1, 0, 0]}
JOINED: dict[str, dict[str, Any]] = {
    "cut": {"hole": {"type": "sphere", "join": "cut"}},
    "intersection": {"part": {"type": "cylinder", "join": "intersection"}},
    "flowing": {"drop": {"type": "box", "join": "smooth_union", "smoothness": 0.2}},
    "several": {
        "hole": {"type": "box", "join": "cut"},
        "drop": {"type": "sphere", "join": "smooth_union"},
        "half": {"type": "plane", "join": "intersection"},
    },
    "a hollow": {"mould": {"type": "formula", "formula": FORMULA, "join": "cut"}},
    "twice": {
        "one": {"type": "formula", "formula": FORMULA, "scale": 0.5},
        "other": {"type": "formula", "formula": {**FORMULA, "iterations": 9}, "position": [1, 0, 0]},
        "strong": {"type": "formula", "formula": {**FORMULA, "parameters": {"power": 7.5}}, "scale": 0.8},
    },
}
# Programs that know the formula, and whether anything is joined to it.
OF_FORMULA = {"rays", "point_rays", "steps", "colors", "glow", "mist", "planes", "glass", "random_walk"}


def scene(formula: dict[str, Any] = FORMULA, camera: dict[str, Any] = PERSPECTIVE, **sections: Any) -> Scene:
    return scene_of(formula, camera, **sections)


def texts(given: Scene, device: Device, **plan: Any) -> dict[str, str]:
    return {each.name: each.flat.text for each in program_texts(given, plan_of(given, device, **plan))}


@pytest.mark.parametrize(
    ("common", "sections", "more"),
    [*(({}, *each) for each in FEATURES.values()), *((PATHS, *each) for each in FEATURES_OF_PATHS.values())],
    ids=[*FEATURES, *(f"{name} of paths" for name in FEATURES_OF_PATHS)],
)
def test_a_feature_is_data(
    common: dict[str, Any], sections: dict[str, Any], more: set[str], device: Device
) -> None:
    """Programs have the same texts and kernels: what is kept of them would else have to be made again."""
    plain, found = (
        {each.name: each for each in program_texts(given, plan_of(given, device))}
        for given in (scene(FORMULA, **common), scene(FORMULA, **common, **sections))
    )
    assert set(found) ^ set(plain) == more
    for name in found.keys() & plain.keys():
        assert (found[name].flat.text, found[name].kernels) == (plain[name].flat.text, plain[name].kernels)


# Of a feature kinds that are one program, and settings that are numbers.
POWERS = [1.5, *(2 + 0.5 * step for step in range(45)), 2.71, 8.001, 31.5, 32]
KINDS: dict[str, list[dict[str, Any]]] = {
    "colours": [FEATURES[each][0] for each in ("trap", "thickness", "layer")],
    "planes": [FEATURES[each][0] for each in ("cut", "quads", "stack")],
    "objects that move": [
        {
            "formula": {"name": "hast"},
            "objects": {
                "ball": {**BALL, "position": [place, 0, place], "radius": place},
                "sea": {"type": "water", "position": [0, 0, -2 - place], "waves": {"time": place}},
                "twin": {
                    "type": "formula",
                    "formula": {**FORMULA, "parameters": {"power": 4 + place}},
                    "position": [3, place, 0],
                    "scale": place,
                },
            },
        }
        for place in (0.25, 0.75)
    ],
    "normals and points": [
        {"renderer": each}
        for each in (
            {"points": {"pattern": "grid", "count": 9}},
            {"points": {"pattern": "stochastic", "count": 4}},
            {"normal": "least_squares"},
            {"normal": "one_triangle"},
            {"normal": "eight_triangles_shading"},
            {"normal": "eight_triangles_normal"},
        )
    ],
    "points by steps": [{"renderer": {"search": "steps", **more}} for more in ({}, {"points": {"count": 4}})],
    "a hybrid's turns": [
        {"formula": {"chain": members, "iterations": 9}, "coloring": FEATURES["trap"][0]["coloring"]}
        for members in (
            [{"name": "mandelbulb"}, {"name": "mandelbox"}, {"name": "menger_sponge"}],
            [{"name": "menger_sponge"}, {"name": "mandelbulb"}, {"name": "mandelbox"}],
            [
                {"name": "mandelbox", "count": 3},
                {"name": "mandelbulb", "start": 1, "stop": 4},
                {"name": "menger_sponge", "start": 2},
            ],
        )
    ],
    "what colours follow": [
        {"formula": {"name": "sphereflake"}, "coloring": {"by": "trap"}},
        *(
            {"formula": {"name": "sphereflake"}, "coloring": {"by": "carried", "number": name}}
            for name in ("near", "size")
        ),
    ],
    "powers, of programs that know the formula too": [
        {
            "formula": {**FORMULA, "parameters": {"power": power}},
            "coloring": {"by": "trap", "trap": {"shape": "sphere"}},
            "glow": {"by": "trap"},
            "mist": {"width": power / 100, "colors": [{"at": power, "color": [1, 1, 1]}]},
        }
        for power in POWERS
    ],
}


@pytest.mark.parametrize("kind", KINDS)
def test_kinds_of_a_feature_are_one_program(kind: str, device: Device) -> None:
    first, *others = (texts(scene(**each), device) for each in KINDS[kind])
    for other in others:
        # Points of the search by steps are made by stages of their own.
        assert other["steps"] == first["steps"] if kind == "points by steps" else other == first


def test_layers_and_cryptomatte_are_data(device: Device) -> None:
    every = ("R", "albedo.R", "direct.G", "object", "CryptoObject00.R")
    plain, found = (texts(scene(FORMULA), device, channels=names) for names in (("R", "A"), every))
    assert found == plain


GRID = {"type": "volume", "box": {"center": [0, 0, 0], "size": 2.4}, "resolution": 16}
MEDIUM = {"opacity": [{"at": 0, "opacity": 0}, {"at": 1, "opacity": 0.5}]}
SHINES = {
    **MEDIUM,
    "color": [{"at": 0, "color": [1, 0, 0]}],
    "emission": [{"at": 0.5, "emission": [0, 1, 0]}],
}


@pytest.mark.parametrize(
    ("one", "other", "kernel"),
    [
        (
            {"renderer": GRID},
            {
                "renderer": {
                    **GRID,
                    "interpolation": "nearest",
                    "value": "coverage",
                    "store": "float",
                    "step": 0.7,
                },
                "lights": [{"direction": [1, 1, -1], "shadow": True}],
                "coloring": {"by": "normal"},
                "formula": {"name": "hast"},
            },
            "volume_surface",
        ),
        (
            {"renderer": {**GRID, "transfer": MEDIUM}},
            {"renderer": {**GRID, "transfer": SHINES, "shadows": False}},
            "volume_medium",
        ),
        (
            {"renderer": {**GRID, "transfer": MEDIUM}, "lighting": {"mode": "path"}},
            {
                "renderer": {**GRID, "transfer": SHINES},
                "lighting": {"mode": "path"},
                "environment": {"sky": {}},
                "lights": LAMPS[3:],
            },
            "volume_paths",
        ),
        (
            {"renderer": {**GRID, "normals": "exact"}},
            {"renderer": GRID, "cut_planes": [{"plane": PLANE, "count": 3, "spacing": 0.1}]},
            "volume_formula_surface",
        ),
        (
            {"renderer": {**GRID, "transfer": MEDIUM}, "cut_planes": [{"plane": PLANE, "cut": True}]},
            {
                "renderer": {**GRID, "transfer": SHINES},
                "cut_planes": [{"plane": PLANE, "count": 3, "spacing": 0.1}],
            },
            "volume_formula_medium",
        ),
    ],
)
def test_what_a_grid_shows_is_data(
    one: dict[str, Any], other: dict[str, Any], kernel: str, device: Device
) -> None:
    """Only a program that asks the formula knows it."""
    scenes = [scene(**each) for each in (one, other)]
    assert [volume.kernel_of(each) for each in scenes] == [kernel] * 2
    found = [volume.program_text(each, plan_of(each, device)).text for each in scenes]
    assert found[0] == found[1]


def test_what_a_cut_plane_shows_is_data(device: Device) -> None:
    shown = [
        {"mode": "smooth", "curve": "log"},
        {"mode": "stepped", "palette": ["#ff0000", "#0000ff"], "repeat": True},
    ]
    scenes = [
        scene(renderer={"type": "cut_plane", "plane": PLANE, "colors": each}, camera={}) for each in shown
    ]
    one, other = (cut_plane.program_text(each, plan_of(each, device)).text for each in scenes)
    assert one == other


MARCHES: dict[str, dict[str, Any]] = {
    "rays": {},
    "point_rays": {"points": {"count": 4}},
    "steps": {"search": "steps"},
}


@pytest.mark.parametrize("lanes", [1, 16])
@pytest.mark.parametrize("march", MARCHES)
def test_marches_are_stages(march: str, lanes: int, device: Device) -> None:
    """Rays, those of a pixel's points, and the search by steps have kernels of their own; what these are told is data."""
    plain, points = (
        texts(scene(FORMULA, renderer={**MARCHES[march], **more}), device, lanes=lanes)
        for more in ({}, {"bounds": {"center": [1, 0, 0], "radius": 4}, "max_steps": 50})
    )
    assert points == plain
    assert set(plain) & set(MARCHES) == {march}


def test_fifty_powers_need_one_compilation(device: Device, monkeypatch: pytest.MonkeyPatch) -> None:
    built = []
    real = program._built

    def counted(*given: Any) -> Any:
        built.append(given)
        return real(*given)

    monkeypatch.setattr(program, "_built", counted)
    pictures, counts = set(), []
    for power in POWERS:
        framebuffer = shoot_whole(scene({**FORMULA, "parameters": {"power": power}}, size=(16, 16)), device)
        pictures.add(framebuffer["Z"].tobytes())
        counts.append(len(built))
    assert counts == counts[:1] * len(POWERS), "the first picture's programs are those of all"
    assert len(pictures) == len(POWERS)


def test_stages_without_a_formula_are_the_same_for_all(device: Device) -> None:
    """For any formula, alone or joined to others."""
    hole = {"hole": {"type": "sphere", "join": "cut"}, "drop": {"type": "box", "join": "smooth_union"}}
    plain = texts(scene(FORMULA), device)
    for other in (scene({"name": "hast", "iterations": 9}), scene(FORMULA, objects=hole)):
        found = texts(other, device)
        assert {name: text for name, text in found.items() if name not in OF_FORMULA} == {
            name: text for name, text in plain.items() if name not in OF_FORMULA
        }


# What asks the formula: rays, colours, a glow, fog around the set, planes.
ASKING: dict[str, Any] = {
    "coloring": {"by": "trap"},
    "glow": {"by": "trap"},
    "mist": {"by": "iterations"},
    **FEATURES["quads"][0],
}


@pytest.mark.parametrize("joined", JOINED)
def test_joins_are_data(joined: str, device: Device) -> None:
    known, other = (texts(scene(FORMULA, objects=JOINED[each], **ASKING), device) for each in ("cut", joined))
    assert other == known
    assert set(known) >= OF_FORMULA - {"point_rays", "steps", "glass", "random_walk"}


@pytest.mark.parametrize("join", ["union", "cut", "smooth_union", "intersection"])
def test_only_the_formulas_in_a_scene_are_text(join: str, device: Device) -> None:
    objects = {"other": {**HAST, "join": join}, **JOINED["several"], "again": {**HAST, "scale": 0.3}}
    known = texts(scene(FORMULA, objects={"other": HAST}, **ASKING), device)
    assert texts(scene(FORMULA, objects=objects, **ASKING), device) == known
    assert known["rays"] != texts(scene(FORMULA, objects=JOINED["cut"], **ASKING), device)["rays"]


def test_each_stage_is_of_one_program() -> None:
    """A scene builds the programs that have its stages."""
    kernels = [kernel for each in PROGRAMS for kernel in each.kernels]
    assert len(kernels) == len(set(kernels))


def test_the_drawing_shows_every_stage() -> None:
    drawn: set[str] = maker("make_drawings").drawn_kernels()
    assert drawn == {kernel for each in PROGRAMS for kernel in each.kernels}


# Features that still make texts of their own: none may join them.
LEFT: set[str] = set()
# What is the same in every program: counts, sizes, and numbers of words.
ALIKE = re.compile(
    r"(CHANNEL|KEPT|STATISTIC|OBJECT|LIGHT|TRAP|COLORING|KNOWN|ALONG|NORMAL|FEATURE|STATE|ALBEDO|SMOOTHEST|REPEATED)_\w+"
    r"|TILE|LANE_SHARE|PALETTE_SIZE|CHANNEL_COUNT|RAY_CHANNELS|CRYPTOMATTE_RANKS|STATISTICS|PASS_KEEP|PASS_ADD|WAVES|SPECTRUM_PLACES"
    r"|CHANNELS|(MODE|TABLE|TONE)_\w+|(GREY|LUMINANCE)_[RGB]|TRANSFER_SIZE|CLOUD_COLUMNS|MOST_MATERIALS|\w+_NUMBERS"
)


OF_DEVICE = {"LANES", "REAL_IS_DOUBLE"}
# Of stored bricks of grids: where voxels are read from, of which type they are, how many a work-item takes of them (by
# device); and the literal that pays there, the filter's RADIUS: as data it takes 4 % of a fill's time, a third of a
# store's.
OF_BRICKS = {
    "SOURCE",
    "SOURCE_BITS",
    "SOURCE_BRICKS",
    "SOURCE_SLAB",
    "SAMPLE",
    "ALL_OUTSIDE",
    "ALL_INSIDE",
    "ALONE",
    "RADIUS",
}


def defined(text: str) -> set[str]:
    """What a program is given before its own text."""
    return set(re.findall(r"^#define (\w+)", text.split("#line", 1)[0], re.MULTILINE))


@pytest.mark.parametrize("lanes", [1, 16])
def test_no_other_program_is_given_more(lanes: int) -> None:
    """Of volumes, planes, grids, lists of points, measurements and the window."""
    found: dict[str, set[str]] = {}
    for name, flat in every_text(lanes, "float32"):
        if "#line" not in flat.text:  # its own definitions
            continue
        allowed = OF_DEVICE | (OF_BRICKS if name.startswith(("store_bricks", "classify_bricks")) else LEFT)
        found[name] = {each for each in defined(flat.text) - allowed if not ALIKE.fullmatch(each)}
    assert {name: more for name, more in found.items() if more} == {}


def test_nothing_else_is_defined(device: Device) -> None:
    """A define that stands for a feature is a conditional by another name. (The formula's own are in its text.)"""
    scenes = [
        scene(FORMULA, **FEATURES["objects"][0]),
        scene(FORMULA, lighting={"mode": "path"}),
        scene(FORMULA, renderer={"normal": "least_squares"}),
        scene(FORMULA, renderer={"search": "steps"}, **ASKING),
        scene(FORMULA, material={"name": "m"}, materials={"m": GLASS}, **PATHS),
        scene(FORMULA, material={"name": "m"}, materials={"m": MILK}, **PATHS),
    ]
    for each_scene in scenes:
        for text in texts(each_scene, device).values():
            assert {each for each in defined(text) - OF_DEVICE if not ALIKE.fullmatch(each)} <= LEFT
