"""The JSON Schema of scenes, asked as an editor asks it: it takes what loads, and marks what does not."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from jsonschema import Draft202012Validator

from clfractal.errors import ClfractalError
from clfractal.scene.load import load_scene, read_scene, schema
from tests.pictures import scene_paths

LEAST: dict[str, Any] = {"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}}

# Keys and short forms that shipped scenes do not use, or of which only one kind of a section has them.
TAKEN: list[dict[str, Any]] = [
    {},
    {"camera": {"projection": "perspective"}},
    {"camera": {"projection": "orthographic"}},
    {"camera": {"projection": "orthographic", "height": 2, "frame": "all"}},
    {"camera": {"orbit": {"azimuth": 35, "elevation": 20, "distance": 3}, "roll": -8, "fov": 30}},
    {"camera": {"frame": "all", "orbit": {"azimuth": -40}, "shift": {"right": 0.1, "forward": -1}}},
    {"camera": {"f_number": 8, "focus": "auto", "focus_on": [0.25, 0.5]}},
    {"camera": {"f_number": 8, "focus_distance": 2.5}},
    {"bookmarks": {"left": {}, "flat": {"projection": "orthographic"}, "all": {"frame": "all"}}},
    {"renderer": {}},
    {"renderer": {"type": "surface", "samples": 2}},
    {"renderer": {"type": "volume"}},
    {"renderer": {"type": "volume", "resolution": [8, 16, 32], "box": {"size": [1, 2, 3]}}},
    {"renderer": {"type": "volume", "resolution": 64, "box": {"size": 2}}},
    {"renderer": {"type": "volume", "transfer": {"color": [{"at": 0, "color": "#f80"}]}}},
    {"renderer": {"type": "cut_plane", "colors": {"palette": ["#123456", [0, 0, 2]]}}},
    {"lights": []},
    {"lights": [{}, {"color": "#ffe2c4"}, {"type": "point", "position": [9, 9, 9], "color": [9, 0, 0]}]},
    {"material": {"color": "#8a5a2b"}, "fog": {"color": "#abc"}},
    {"coloring": {"by": "trap", "palette": ["#000", "#d95a1f", "#fdeabc"]}},
    {
        "coloring": {
            "by": "iterations",
            "palette": [{"at": 0, "color": "#000"}, {"at": 1, "color": [1, 1, 1]}],
        }
    },
    {"coloring": {"by": "iterations", "palette": [[0, 0, 0], "#fff"]}},
    {"background": "transparent"},
    {"background": "#0c0e13"},
    {"background": [0, 0, 1]},
    {"background": {"top": "#fff", "bottom": [0, 0, 0]}},
    {"output": {"exposure": "auto", "tone": "agx", "quality": 80, "png_bits": 16}},
    {"output": {"exposure": -1.5, "tone": "reinhard", "precision": {"Z": "half"}}},
    {"environment": {"name": "dusk", "rotation": 90, "rays": 0}},
    {"stereo": {"mode": "anaglyph", "screen_width": 0.6, "screen_distance": 0.7}},
    {"stereo": {"screen_width": 0.6, "screen_distance": 0.7, "fit": "auto"}},
    {"layout": {"columns": 2, "views": [{"camera": {}}, {"renderer": {"type": "cut_plane"}}, {}]}},
    {"cut_planes": [{"plane": {"normal": [0, 0, 1], "transform": [{"rotate_x": 30}]}, "cut": True}]},
    {"formula": {"name": "mandelbulb", "iterations": 6, "parameters": {"power": 7.5}, "live": ["power"]}},
    {"formula": {"name": "mandelbulb", "julia": [0.1, 0.2, 0.3]}},
    {"formula": "none"},
    {"formula": {"name": "none"}, "objects": {"ball": {}}},
    {
        "formula": {
            "chain": [
                {"name": "mandelbulb", "count": 2, "stop": 4},
                {"name": "amazing_surf", "start": 2, "parameters": {}},
            ]
        }
    },
]

REFUSED: list[tuple[dict[str, Any], str]] = [
    ({"kamera": {}}, "$"),
    ({"camera": {"fob": 30}}, "$.camera"),
    ({"camera": {"projection": "orthographic", "fov": 30}}, "$.camera"),
    ({"camera": {"height": 3}}, "$.camera"),
    ({"camera": {"fov": 400}}, "$.camera"),
    ({"camera": {"projection": "fisheye"}}, "$.camera"),
    ({"camera": {"orbit": {"elevation": 91}}}, "$.camera"),
    ({"camera": {"focus": "near"}}, "$.camera"),
    ({"camera": {"frame": "some"}}, "$.camera"),
    ({"renderer": {"resolution": 64}}, "$.renderer"),
    ({"renderer": {"type": "volume", "resolution": [8, 8]}}, "$.renderer"),
    ({"lights": [{"position": [9, 9, 9]}]}, "$.lights[0]"),
    ({"lights": [{"type": "point"}]}, "$.lights[0]"),
    ({"material": {"color": "#12345"}}, "$.material.color"),
    ({"material": {"color": "red"}}, "$.material.color"),
    ({"coloring": {"palette": ["#000"]}}, "$.coloring.palette"),
    ({"background": "white"}, "$.background"),
    ({"background": "#ff"}, "$.background"),
    ({"output": {"exposure": "bright"}}, "$.output.exposure"),
    ({"output": {"tone": "filmic"}}, "$.output.tone"),
    ({"output": {"channels": ["Q"]}}, "$.output.channels[0]"),
    ({"formula": {"chain": [{"name": "mandelbulb", "begin": 2}]}}, "$.formula.chain"),
]


@cache
def validator() -> Draft202012Validator:
    found = schema()
    Draft202012Validator.check_schema(found)
    return Draft202012Validator(found)


def places(plain: Any) -> list[str]:
    """Where the schema finds mistakes, as paths of JSON."""
    return [error.json_path for error in validator().iter_errors(plain)]


@pytest.mark.parametrize("path", scene_paths(), ids=lambda path: path.stem)
def test_every_shipped_scene_is_valid(path: Path) -> None:
    """As it is written, and with every default filled in."""
    assert places(read_scene(path).document.plain()) == []
    assert places(json.loads(json.dumps(load_scene(path).resolved()))) == []


@pytest.mark.parametrize("sections", TAKEN, ids=json.dumps)
def test_what_loads_is_valid(sections: dict[str, Any]) -> None:
    plain = {**LEAST, **sections}
    scene = load_scene(plain)
    assert places(plain) == []
    assert places(json.loads(json.dumps(scene.resolved()))) == []


@pytest.mark.parametrize(("sections", "at"), REFUSED, ids=json.dumps)
def test_mistakes_are_marked_where_they_are(sections: dict[str, Any], at: str) -> None:
    plain = {**LEAST, **sections}
    with pytest.raises(ClfractalError):
        load_scene(plain)
    found = places(plain)
    assert found
    assert all(place.startswith(at) for place in found), found


def test_a_mapping_without_its_word_is_one_thing_alone() -> None:
    """Else an editor offers the keys of all kinds, and says that one value is two things."""
    for key in ("camera", "renderer"):
        kinds = validator().schema["properties"][key]["oneOf"]
        bare = [kind for kind in kinds if "required" not in kind]
        assert len(bare) == 1
        words = {"camera": ["projection"], "renderer": ["type"]}[key]
        assert [kind["required"] for kind in kinds if kind not in bare] == [words] * (len(kinds) - 1)


def test_equal_scenes_have_equal_hashes() -> None:
    """Wherever they were loaded from, and however numbers and orders were written."""
    text = (
        "version: 1\nformula: {name: mandelbulb, parameters: {power: 8, theta_phase: 0.5}}\ncamera: {}\n"
        "lights: [{direction: [1, 0, 0]}, {type: point, position: [9, 0, 0]}]\nmaterials: {a: {}, b: {}}\n"
        "coloring: {palette: ['#fff', '#000']}\nbookmarks: {here: {fov: 30}}\n"
    )
    scene = load_scene(text)
    same = load_scene(
        text.replace("power: 8, theta_phase: 0.5", "theta_phase: 0.5, power: 8.0").replace(
            "a: {}, b: {}", "b: {}, a: {}"
        )
    )
    assert scene == same
    assert hash(scene) == hash(same) == hash(load_scene(scene.resolved()))
    assert hash(scene.lights[0]) == hash(same.lights[0])
    changed = scene.model_copy(update={"camera": {"fov": 30}})
    assert len({scene, same, changed}) == 2
    assert {scene: "mine"}[same] == "mine"
    for file in scene_paths():
        assert isinstance(hash(load_scene(file)), int)
