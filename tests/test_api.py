"""The program as a library."""

from __future__ import annotations

import ast
import importlib
import io
import json
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import clfractal
from clfractal.device.select import Device
from clfractal.files.exr import read_exr
from tests.render.shots import engine_of
from tests.shell import SCENE, python, works


def test_everything_public_is_there() -> None:
    """What type checkers see, what is loaded, and what `dir` lists are the same names."""
    tree = ast.parse(Path(clfractal.__file__).read_text(encoding="utf-8"))
    typed = {
        name.asname: (node.module, name.name)
        for node in ast.walk(tree)
        if isinstance(node, ast.ImportFrom) and (node.module or "").startswith("clfractal.")
        for name in node.names
    }
    assert sorted(map(str, typed)) == dir(clfractal)
    for public, (module, name) in typed.items():
        assert getattr(clfractal, str(public)) is getattr(importlib.import_module(str(module)), name)
        assert public == name
    with pytest.raises(AttributeError, match="no attribute 'rendre'"):
        clfractal.rendre  # type: ignore[attr-defined]  # noqa: B018


FUNCTIONS = {
    "at_frame": ["scene", "frame"],
    "devices": [],
    "distances": ["formula", "points"],
    "dump_scene": ["scene"],
    "escape": ["formula", "points", "iterations", "bailout"],
    "find": ["scene", "count", "seed", "device"],
    "frames": ["scene", "device", "progress", "numbers"],
    "load_scene": ["source", "overrides", "folder"],
    "mesh": ["source", "device", "progress", "level"],
    "probe": ["scene", "x", "y"],
    "render": ["scene", "device", "progress", "samples", "region"],
    "render_pair": ["scene", "device", "progress", "samples"],
    "variations": ["scene", "count", "strength", "seed"],
    "voxelize": ["scene", "device", "progress", "resolution"],
}


def test_a_fresh_session_finds_every_function_with_its_help() -> None:
    """As a notebook asks: names, signatures and texts, before anything was called."""
    code = (
        "import inspect, json, pydoc, clfractal\n"
        "names = [n for n in dir(clfractal) if inspect.isfunction(getattr(clfractal, n))]\n"
        "told = {n: [list(inspect.signature(getattr(clfractal, n)).parameters), getattr(clfractal, n).__doc__]"
        " for n in names}\n"
        "pages = [pydoc.plain(pydoc.render_doc(each)) for each in (clfractal, clfractal.render)]\n"
        "print(json.dumps([told, *pages]))"
    )
    told, module, render = json.loads(works(python(code)).out)
    assert sorted(told) == sorted(FUNCTIONS)
    for name, (parameters, text) in told.items():
        assert [each for each in FUNCTIONS[name] if each not in parameters] == [], name
        assert len(text.splitlines()[0]) > 20, name
        assert f"    {name}(" in module
    assert "samples: rays per pixel" in render
    assert "DeviceError: no device" in render


def test_names_that_are_modules_stay_modules() -> None:
    import clfractal.stereo

    assert all(callable(getattr(clfractal.stereo, name)) for name in ("frustum", "attitude", "parallax"))
    assert set(dir(clfractal)) == set(clfractal.__all__)


def test_a_scene_lists_what_is_meant_for_users() -> None:
    scene = clfractal.load_scene(SCENE)
    names = dir(scene)
    assert [name for name in names if name.startswith("_")] == []
    assert {"camera", "renderer", "formula", "bookmarks", "resolved", "folder", "model_copy"} <= set(names)
    assert {"json", "dict", "copy", "parse_obj", "model_fields", "construct", "checked"} & set(names) == set()
    assert all(hasattr(scene, name) for name in names if name not in ("surface", "views"))
    assert set(type(scene.camera).model_fields) < set(dir(scene.camera))


def test_a_film_of_arrays() -> None:
    film = clfractal.render(clfractal.load_scene(SCENE))
    assert film["R"].shape == film["Z"].shape == (36, 40)
    assert film["R"].dtype == np.float32
    covered = film["A"] > 0
    assert 0.1 < covered.mean() < 0.9
    # The camera is 3 away from the origin, the set within 1.3 of it; what is missed is infinitely far.
    assert ((film["Z"] > 1.5) & (film["Z"] < 4.5))[covered].all()
    assert np.isinf(film["Z"][~covered]).all()
    assert (film._repr_png_() or b"")[:8] == b"\x89PNG\r\n\x1a\n"


@pytest.mark.parametrize("name", ["a.exr", "a.png"])
def test_a_picture_renders_itself_again(tmp_path: Path, name: str) -> None:
    """Samples and number type of the render are in the header, not those of the scene it came from."""
    first = clfractal.render(SCENE, samples=3, precision="float64", channels=["R", "G", "B", "A", "N.X"])
    first.save(tmp_path / name)
    scene = clfractal.load_scene(tmp_path / name)
    assert scene.renderer.samples == 3
    assert scene.renderer.precision == "float64"
    again = clfractal.render(scene)
    assert again.channels == first.channels
    for channel in first:
        np.testing.assert_array_equal(again[channel], first[channel])


def test_a_region_is_a_part_of_the_whole(tmp_path: Path) -> None:
    whole = clfractal.render(SCENE)
    part = clfractal.render(SCENE, region=(7, 5, 20, 30))
    assert part["R"].shape == (30, 20)
    for channel in whole:
        np.testing.assert_array_equal(part[channel], whole[channel][5:35, 7:27])
    part.save(tmp_path / "part.exr")
    header = read_exr(tmp_path / "part.exr")[1]
    assert header["dataWindow"] == (7, 5, 26, 34)
    assert header["displayWindow"] == (0, 0, 39, 35)


def test_a_tone_reaches_what_is_shown_and_not_the_film(tmp_path: Path) -> None:
    plain = clfractal.render(SCENE)
    bent = clfractal.render(SCENE + "output: {tone: agx}\n")
    np.testing.assert_array_equal(plain["R"], bent["R"])
    assert bent.header["tone"] == "agx"
    np.testing.assert_array_equal(plain.to_rgb8(tone="agx"), bent.to_rgb8())
    np.testing.assert_array_equal(plain.to_rgb8(), bent.to_rgb8(tone="linear"))
    assert (plain.to_rgb8() != bent.to_rgb8()).mean() > 0.5
    plain.save(tmp_path / "given.png", tone="agx")
    bent.save(tmp_path / "own.png")
    bent.save(tmp_path / "own.exr")
    with Image.open(tmp_path / "given.png") as given, Image.open(tmp_path / "own.png") as own:
        np.testing.assert_array_equal(np.asarray(given), bent.to_rgb8())
        np.testing.assert_array_equal(np.asarray(own), bent.to_rgb8())
    with Image.open(io.BytesIO(bent._repr_png_() or b"")) as shown:
        np.testing.assert_array_equal(np.asarray(shown), bent.to_rgb8())
    with pytest.raises(clfractal.SceneError, match="unknown tone 'agz'; did you mean 'agx'"):
        plain.save(tmp_path / "none.png", tone="agz")
    planes, header = read_exr(tmp_path / "own.exr")
    np.testing.assert_array_equal(planes["R"], plain["R"].astype(np.float16))
    assert header["clfractalTone"] == "agx"


def test_escape_of_points_known_by_hand() -> None:
    """Power 2 on the z axis is the real quadratic map z -> z^2 + c: -1 and 0.25 stay, 0.5 and 3 leave."""
    points = np.array([[0, 0, -1.0], [0, 0, 0.25], [0, 0, 0.5], [0, 0, 3.0], [0, 0, 0]])
    counts, inside = clfractal.escape("mandelbulb", points, iterations=40, parameters={"power": 2}, bailout=2)
    assert counts.shape == inside.shape == (5,)
    assert np.issubdtype(counts.dtype, np.integer)
    assert inside.dtype == np.bool_
    assert inside.tolist() == [True, True, False, False, True]
    # 0.5 -> 0.75 -> 1.0625 -> 1.6289 -> 3.1533: the fifth is beyond 2; 3 is at once.
    assert counts.tolist() == [40, 40, 5, 1, 40]


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_escape_of_a_formula_of_ones_own(tmp_path: Path, precision: str) -> None:
    formula = {
        "title": "a cube that grows",
        "reference": "test",
        "variables": ["x", "y", "z"],
        "parameters": {"factor": {"type": "real", "default": 2.0}},
        "map": ["factor*x", "factor*y", "factor*z"],
        "add": "none",
        "degree": 1,
        "bounds": {"center": [0, 0, 0], "radius": 2},
        "bailout": 10,
    }
    points = np.array([[1.0, 0, 0], [0, 6, 0], [0, 0, 11]])
    # 1 needs four doublings to exceed 10 (16), 6 one, 11 none.
    counts, inside = clfractal.escape(formula, points, iterations=20, precision=precision)
    assert counts.tolist() == [4, 1, 0]
    assert not inside.any()
    counts, _ = clfractal.escape(
        formula, points, iterations=20, precision=precision, parameters={"factor": 4}
    )
    assert counts.tolist() == [2, 1, 0]
    (tmp_path / "cube.yaml").write_text(
        "title: t\nreference: r\nvariables: [x, y, z]\nmap: [2*x, 2*y, 2*z]\nadd: none\ndegree: 1\n"
        "bounds: {center: [0, 0, 0], radius: 2}\nbailout: 10\n"
    )
    counts, _ = clfractal.escape(tmp_path / "cube.yaml", points, iterations=20, precision=precision)
    assert counts.tolist() == [4, 1, 0]


def test_no_points_are_no_mistake() -> None:
    counts, inside = clfractal.escape("hast", np.zeros((0, 3)), iterations=5)
    assert counts.shape == inside.shape == (0,)


# --- former names, which do the same for one release, with a warning ---


def test_an_engine_has_previews_as_looks(device: Device) -> None:
    engine = engine_of(device)
    with pytest.warns(DeprecationWarning, match="Engine.look is Engine.preview"):
        former = engine.look
    assert type(former) is type(engine.preview)
    assert former.executor is engine.preview.executor


def test_an_engine_says_how_long_previews_were_built(device: Device) -> None:
    engine = engine_of(device)
    with pytest.warns(DeprecationWarning, match="Engine.looks_built_ms is Engine.previews_built_ms"):
        assert engine.looks_built_ms == engine.previews_built_ms


def test_a_film_has_makers() -> None:
    framebuffer = clfractal.Framebuffer(("R",), (8, 8))
    with pytest.warns(DeprecationWarning, match="Framebuffer.makers is Framebuffer.provenance"):
        assert framebuffer.makers is framebuffer.provenance


def test_a_framebuffer_was_a_film() -> None:
    with pytest.warns(DeprecationWarning, match="clfractal.Film is clfractal.Framebuffer"):
        former = clfractal.Film
    assert former is clfractal.Framebuffer
