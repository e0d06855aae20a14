"""A scene that is written is the scene that is read: as YAML, as JSON and as plain data."""

from __future__ import annotations

import json
import pickle
import subprocess
import sys
from typing import Any, get_args

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from clfractal.errors import FormulaError, SceneError
from clfractal.files.channels import RAY_CHANNELS
from clfractal.formulas import catalog
from clfractal.scene import environment
from clfractal.scene.load import dump_scene, load_scene, schema
from clfractal.scene.model import Scene
from clfractal.scene.stereo import Mode


def optional(**values: st.SearchStrategy[Any]) -> st.SearchStrategy[dict[str, Any]]:
    """A mapping with any part of the keys."""
    return st.fixed_dictionaries({}, optional=values)


coordinate = st.floats(-1e6, 1e6) | st.integers(-1000, 1000) | st.sampled_from([1e-300, -0.0, 5e-324])
amount = st.floats(0, 1e6)
fraction = st.floats(0, 1)
positive = st.floats(0, 1e6, exclude_min=True)
rays = st.integers(1, 1024)
vector = st.lists(coordinate, min_size=3, max_size=3)
color = st.lists(amount, min_size=3, max_size=3)
# Lights stand outside of every formula's bounds.
far = vector.map(lambda v: [1e5 + abs(v[0]) / 2, v[1], v[2]])
direction = vector.filter(lambda v: sum(x * x for x in v) > 1e-6)
places = {"position": vector, "target": vector, "up": direction}
cameras = optional(
    **places,
    projection=st.just("perspective"),
    fov=st.floats(1e-6, 179.999),
    f_number=st.none() | st.floats(0.01, 1e6),
    focus_distance=st.none() | positive,
    sensor_height=positive,
) | st.fixed_dictionaries(
    {"projection": st.just("orthographic")}, optional={**places, "height": st.floats(1e-12, 1e6)}
)
common = {
    "color": color,
    "intensity": amount,
    "shadow": st.booleans(),
    "angular_size": st.floats(0, 170),
    "rays": st.none() | rays,
}
lights = optional(**common, type=st.just("directional"), direction=direction) | st.fixed_dictionaries(
    {"type": st.just("point"), "position": far},
    optional={**common, "falloff": st.sampled_from(["none", "inverse_square"])},
)
stops = st.lists(st.tuples(fraction, color), min_size=2, max_size=4).map(
    lambda found: [{"at": at, "color": c} for at, c in sorted(found, key=lambda stop: stop[0])]
)
inline = st.fixed_dictionaries(
    {
        "variables": st.just(["x", "y", "z"]),
        "map": st.just(["x*x - y*y + 1e-3", "2*x*y", "z*z"]),
        "degree": st.just(2),
        "bounds": st.fixed_dictionaries({"radius": st.floats(0.1, 10)}),
    },
    optional={"title": st.text(max_size=20), "description": st.text(max_size=20)},
)
SINGLE = [name for name in catalog.names() if not catalog.is_chain(name)]
TRIPLE = [name for name in SINGLE if len(catalog.load(name).variables) == 3]


def _named(name: str, live: int) -> dict[str, Any]:
    """A formula of the library; some of its parameters are live."""
    chosen = [parameter.name for parameter in catalog.load(name).parameters][:live]
    return {"name": name, "live": chosen} if chosen else {"name": name}


def sources(names: list[str]) -> st.SearchStrategy[dict[str, Any]]:
    """A formula of the library or one written in the scene."""
    named = st.builds(_named, st.sampled_from(names), st.integers(0, 2))
    return named | inline.map(lambda mapping: {"inline": mapping})


links = st.builds(lambda s, count: {**s, "count": count}, sources(TRIPLE), st.integers(1, 5))
formulas = st.builds(
    lambda s, rest: {**s, **rest},
    sources(SINGLE) | st.fixed_dictionaries({"chain": st.lists(links, min_size=1, max_size=3)}),
    optional(
        iterations=st.integers(1, 1_000_000), bailout=st.floats(1, 100), distance_bailout=st.floats(1, 1e6)
    ),
)
points = st.builds(
    lambda pattern, count, side: {"pattern": pattern, "count": side**2 if pattern == "grid" else count},
    st.sampled_from(["grid", "stochastic"]),
    st.integers(4, 64),
    st.integers(2, 8),
)
# A step through the bounds: they and it are given together, a part of the diameter.
search = st.builds(
    lambda name, ball, part: {"search": name, "bounds": ball, "step": 2 * ball["radius"] * part},
    st.sampled_from(["distance", "steps"]),
    st.fixed_dictionaries({"center": vector, "radius": st.floats(1e-6, 1e5)}),
    st.floats(1e-5, 0.999),
)
normals = st.builds(
    lambda name, side, given: {"normal": name, "points": given if name == "least_squares" else side},
    st.sampled_from(["one_triangle", "eight_triangles_shading", "eight_triangles_normal", "least_squares"]),
    st.none() | st.sampled_from([9, 25, 49]).map(lambda count: {"count": count}),
    st.none() | points,
)
adaptive = st.builds(
    lambda samples, noise, fewer: {
        "samples": samples,
        "noise": noise,
        "min_samples": fewer and min(fewer, samples),
    },
    st.integers(4, 65_536),
    st.none() | st.floats(0, 1, exclude_min=True),
    st.none() | st.integers(4, 65_536),
)


def together(*parts: st.SearchStrategy[dict[str, Any]]) -> st.SearchStrategy[dict[str, Any]]:
    """One mapping with the keys of several; what comes later wins."""
    return st.builds(lambda *found: {key: v for each in found for key, v in each.items()}, *parts)


usual_renderer = optional(
    type=st.just("surface"),
    points=st.none() | points,
    detail=st.floats(0.01, 100),
    max_steps=st.integers(1, 100_000),
    over_relaxation=st.floats(1, 1.99),
    step_scale=st.none() | st.floats(0.01, 1),
    bounds=st.none() | st.fixed_dictionaries({"center": vector, "radius": st.floats(1e-6, 1e6)}),
    bounces=st.integers(0, 16),
    ambient_occlusion=st.none() | optional(rays=rays, distance=st.none() | positive),
    samples=st.integers(1, 65_536),
    filter=st.sampled_from(["box", "tent", "blackman_harris"]),
    filter_width=st.none() | st.floats(0.1, 16),
    firefly_limit=st.none() | positive,
    seed=st.integers(0, 2**32 - 1),
)
nothing: st.SearchStrategy[dict[str, Any]] = st.just({})
renderers = together(usual_renderer, nothing | search, nothing | normals, nothing | adaptive)
# Measures of the real world are in one unit: none is more than some ten thousand times another.
measure = st.floats(0.05, 50)
stereo = optional(
    mode=st.sampled_from(get_args(Mode)),
    screen_width=measure,
    screen_distance=measure,
    interpupillary_distance=measure,
    swap=st.booleans(),
    plane=st.none()
    | optional(
        center=vector,
        normal=direction.filter(lambda v: abs(v[2]) < abs(v[0]) + abs(v[1])),  # not along the default of `up`
        width=st.floats(1e-12, 1e6),
        height=st.none() | st.floats(1e-12, 1e6),
    ),
    separation=st.floats(0, 10),
    budget=st.floats(0, 10, exclude_min=True),
    method=st.sampled_from(["color", "half_color", "gray", "dubois"]),
    glasses=st.sampled_from(["red_cyan", "green_magenta", "amber_blue"]),
    colors=st.lists(st.lists(fraction, min_size=3, max_size=3), min_size=2, max_size=2),
)
# A fit is for eyes that look at one rectangle.
stereos = stereo | together(
    stereo,
    st.fixed_dictionaries({"convergence": st.sampled_from(["off_axis", "parallel", "toe_in"])})
    | st.fixed_dictionaries({"fit": st.just("auto")}),
)
environments = st.builds(
    lambda source, rest: {**source, **rest},
    st.sampled_from(environment.names()).map(lambda name: {"name": name}),
    optional(
        intensity=amount, rotation=st.floats(-360, 360), background=st.booleans(), rays=st.integers(0, 1024)
    ),
)
sections = optional(
    image=optional(width=st.integers(1, 16384), height=st.integers(1, 16384)),
    renderer=renderers,
    lights=st.lists(lights, max_size=4),
    material=optional(
        color=st.lists(fraction, min_size=3, max_size=3),
        ambient=amount,
        diffuse=amount,
        specular=amount,
        shininess=st.floats(0.1, 1e5),
        reflection=fraction,
    ),
    coloring=optional(
        by=st.sampled_from(["solid", "normal", "iterations", "thickness", "layer_distance", "trap"]),
        palette=st.sampled_from(["viridis", "magma", "glacier", "opal_r"]) | stops,
        scale=coordinate,
        offset=coordinate,
        repeat=st.booleans(),
        along=st.sampled_from(["view", "normal"]),
        layer=st.integers(1, 1_000_000),
        trap=optional(
            shape=st.sampled_from(["point", "axis", "plane", "sphere"]),
            center=vector,
            direction=direction,
            radius=positive,
        ),
    ),
    environment=st.none() | environments,
    fog=st.none() | optional(color=color, density=amount, background=st.booleans()),
    stereo=st.none() | stereos,
    background=st.just("transparent") | optional(top=color, bottom=color),
    output=optional(
        exposure=st.floats(-100, 100),
        channels=st.lists(st.sampled_from(RAY_CHANNELS), min_size=1, unique=True),
        precision=st.dictionaries(st.sampled_from(RAY_CHANNELS), st.sampled_from(["half", "float"])),
        png_bits=st.sampled_from([8, 16]),
    ),
)


@given(formulas, cameras, sections)
def test_what_is_dumped_loads_back(
    formula: dict[str, Any], camera: dict[str, Any], rest: dict[str, Any]
) -> None:
    data = {"version": 1, "formula": formula, "camera": camera, **rest}
    try:
        scene = load_scene(data)
    except SceneError as error:
        # Two random points may coincide, or look along `up`; two eyes want a perspective camera, an anaglyph colours,
        # squeezed eyes even sizes.
        assume(error.where.path not in ("camera.target", "camera.up"))
        wanted = ("camera.projection", "output.channels", "image.width", "image.height")
        assume(not (rest.get("stereo") is not None and error.where.path in wanted))
        raise
    assert load_scene(dump_scene(scene)) == scene
    assert load_scene(scene.resolved()) == scene
    assert json.loads(json.dumps(scene.resolved())) == scene.resolved()
    assert load_scene(scene.resolved()).resolved() == scene.resolved()


@pytest.mark.parametrize("name", catalog.names())
def test_every_formula_of_the_library(name: str) -> None:
    scene = load_scene({"version": 1, "formula": {"name": name}, "camera": {}})
    again = load_scene(dump_scene(scene))
    assert again == scene
    assert again.chain.degree == scene.chain.degree


def test_every_key_but_three_has_a_default() -> None:
    scene = load_scene("{version: 1, formula: {name: mandelbulb}, camera: {}}")
    assert (scene.image.width, scene.image.height) == (1024, 1024)
    assert scene.camera.projection == "perspective"
    assert (scene.camera.position, scene.camera.target, scene.camera.up) == ((0, -3, 0), (0, 0, 0), (0, 0, 1))
    assert [light.tag for light in scene.lights] == ["directional"]
    assert scene.output.half_channels >= {"R", "G", "B", "A"}
    assert "Z" not in scene.output.half_channels
    assert set(schema()["required"]) == {"version", "formula", "camera"}


def test_a_scene_does_not_change() -> None:
    scene = load_scene("{version: 1, formula: {name: mandelbulb}, camera: {}}")
    with pytest.raises(SceneError, match=r"^version: cannot be set; model_copy\(update={'version': "):
        scene.version = 1
    with pytest.raises(SceneError, match=r"^fov: must be below 180, got 400$"):
        scene.camera.model_copy(update={"fov": 400})
    other = scene.model_copy(update={"formula": scene.formula.model_copy(update={"name": "hast"})})
    assert other.chain.links[0].bound.formula.name == "hast"
    assert scene.chain.links[0].bound.formula.name == "mandelbulb"


def test_the_schema_describes_every_key() -> None:
    """An editor can complete and explain each key, and refuses others."""
    found = schema()
    assert set(found["properties"]) == set(Scene.model_fields)
    json.dumps(found)
    for name, model in found["$defs"].items():
        assert model["additionalProperties"] is False, name
        for key, entry in model["properties"].items():
            assert "description" in entry or "const" in entry, f"{name}.{key}"
    assert found["$defs"]["PerspectiveCamera"]["properties"]["fov"]["exclusiveMaximum"] == 180
    assert found["properties"]["background"]["default"] == {
        "top": [0.25, 0.35, 0.5],
        "bottom": [0.02, 0.02, 0.03],
    }


def test_live_parameters_are_kept() -> None:
    links = [{"name": "mandelbulb", "live": ["power"]}, {"name": "mandelbox"}]
    for formula in ({"name": "mandelbulb", "live": ["power", "phi_phase"]}, {"chain": links}):
        scene = load_scene({"version": 1, "formula": formula, "camera": {}})
        assert load_scene(dump_scene(scene)) == scene
        assert load_scene(json.loads(json.dumps(scene.resolved()))) == scene
        first = scene.formula if scene.formula.chain is None else scene.formula.chain[0]
        assert first.live[0] == "power"
    plain = load_scene({"version": 1, "formula": {"name": "mandelbulb", "live": []}, "camera": {}})
    assert "live" not in dump_scene(plain)
    assert "without compiling again" in json.dumps(schema())


def test_a_live_parameter_that_is_none_is_told_with_its_place() -> None:
    text = "version: 1\nformula: {name: mandelbulb,\n          live: [powre]}\ncamera: {}\n"
    with pytest.raises(FormulaError) as caught:
        load_scene(text)
    assert str(caught.value) == "scene:3:18: formula.live.0: unknown parameter 'powre'; did you mean 'power'?"


TOLD = "import pickle, sys; print(pickle.load(sys.stdin.buffer).{}.model_dump_json(), end='')"


@pytest.mark.parametrize("section", ["coloring", "renderer", "camera"])
def test_a_scene_from_another_process_is_told_there(section: str) -> None:
    """One that has made no section of its kind, as a cluster's worker."""
    scene = load_scene({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}})
    ended = subprocess.run(
        [sys.executable, "-c", TOLD.format(section)],
        input=pickle.dumps(scene),
        capture_output=True,
        check=True,
    )
    assert ended.stdout.decode() == getattr(scene, section).model_dump_json()
