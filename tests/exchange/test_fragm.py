"""Fragments of FragM as scenes: the distance is what the text says, and what is taken over of presets."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.errors import ClfractalError, FileError
from clfractal.exchange.fragm import import_fragment, import_fragment_text
from clfractal.exchange.mandelbulber import Imported
from clfractal.files.file_kinds import kind_of
from clfractal.formulas.catalog import resolve
from clfractal.formulas.chain import Chain
from clfractal.formulas.reference import distance, own_distance
from clfractal.scene.load import load_scene
from clfractal.viewer.sources import is_protected, open_source
from tests.exchange.files import check_line
from tests.exchange.fragments import BULB, HEAD, MEANINGS, SPONGE, Float, fragment, julia_bulb
from tests.shell import InProcess

POINTS = 300


def imported(text: str, **options: Any) -> Imported:
    return import_fragment_text(text, "x.frag", **options)


def chain_of(found: Imported, **parameters: float) -> tuple[Chain, int]:
    formula = dict(found.scene["formula"])
    iterations = int(formula.pop("iterations"))
    return resolve({**formula, **({"parameters": parameters} if parameters else {})}), iterations


def some_points(reach: float) -> Float:
    generator = np.random.default_rng(7)
    return generator.uniform(-reach, reach, size=(POINTS, 3))


class TestMeaning:
    @pytest.mark.parametrize("name", MEANINGS)
    def test_the_distance_is_that_of_the_text(self, name: str) -> None:
        meaning = MEANINGS[name]
        found = imported(meaning.text)
        load_scene(found.scene)
        points = some_points(meaning.reach)
        expected = np.maximum(meaning.distance(points), 0)
        measured = own_distance(*_of(found, points))
        assert (expected > 0).sum() > POINTS / 10
        np.testing.assert_allclose(measured, expected, rtol=1e-9, atol=1e-12)

    def test_parameters_change_it_as_they_change_the_text(self) -> None:
        points = some_points(1.2)
        constant = np.array([0.3, -0.2, 0.4])
        chain, iterations = chain_of(imported(BULB), Julia=1, JuliaC_x=0.3, JuliaC_y=-0.2, JuliaC_z=0.4)
        measured = own_distance(chain, points, iterations)
        np.testing.assert_allclose(measured, np.maximum(julia_bulb(points, constant), 0), rtol=1e-9)

    @pytest.mark.parametrize("name", ["box", "sponge", "loops", "ball"])
    def test_the_gradient_is_that_of_differences(self, name: str) -> None:
        meaning = MEANINGS[name]
        points = some_points(meaning.reach)[:80]
        points = points[meaning.distance(points) > 0.01]
        chain, iterations = chain_of(imported(meaning.text))
        _, gradient = distance(chain, points, iterations)
        step = 1e-6
        moved = [
            (meaning.distance(points + step * axis) - meaning.distance(points - step * axis)) / (2 * step)
            for axis in np.eye(3)
        ]
        differences = np.stack(moved, axis=1)
        # Where a fold lies between, there is no gradient.
        near = np.abs(gradient - differences).max(axis=1) < 1e-4 * (1 + np.abs(gradient).max(axis=1))
        assert near.mean() > 0.95

    def test_a_bulb_grows_by_its_parameter(self) -> None:
        formula = imported(BULB).scene["formula"]["inline"]
        assert formula["degree"] == "max(Power, 1)"
        assert formula["bailout"] == "max(Bailout, 0.001)"
        assert formula["bounds"]["radius"] < 2
        # The set, by the Jacobian alone: the formula without the text's own distance.
        own = {key: value for key, value in formula.items() if key != "distance"}
        chain = resolve({"inline": own})
        points = some_points(1.3)
        inside = distance(chain, points, 6)[0] == 0
        by_text = julia_bulb(points) == 0
        assert (inside == by_text).all()

    def test_what_turns_do_not_change_is_computed_once(self) -> None:
        text = fragment("""
uniform int Iterations; slider[0,6,20]
float DE(vec3 p) {
	float a = sin(p.x) * exp(p.y);
	vec3 z = p;
	for (int i = 0; i < Iterations; i++) { z = abs(z) * 1.5 - 0.3 * a; }
	return length(z) / pow(1.5, float(Iterations)) - 0.01;
}""")
        formula = imported(text).scene["formula"]["inline"]
        assert "sin" not in str(formula["do"])
        assert [each["start"] for each in formula["state"].values()] == ["0.3*(sin(x)*exp(y))"]


def _of(found: Imported, points: Float) -> tuple[Chain, Float, int]:
    chain, iterations = chain_of(found)
    return chain, points, iterations


class TestSliders:
    def test_sliders_are_parameters_with_ranges(self) -> None:
        formula = imported(SPONGE.replace("#endpreset", "Scale = 5\n#endpreset")).scene["formula"]
        assert formula["iterations"] == 5
        assert formula["inline"]["parameters"] == {
            "Offset_x": {"default": 1, "minimum": 0, "maximum": 1},
            "Offset_y": {"default": 0.9, "minimum": 0, "maximum": 1},
            "Offset_z": {"default": 0.8, "minimum": 0, "maximum": 1},
            "Scale": {"default": 5, "minimum": 1, "maximum": 5},
        }

    def test_checkboxes_and_whole_numbers(self) -> None:
        parameters = imported(BULB).scene["formula"]["inline"]["parameters"]
        assert parameters["Julia"] == {"default": 0, "type": "int", "minimum": 0, "maximum": 1}

    def test_presets_by_name(self) -> None:
        text = BULB + "#preset Other one\nEye = 0,0,9\nIterations = 11\nPower = 3\n#endpreset\n"
        assert imported(text).scene["formula"]["iterations"] == 6
        other = imported(text, preset="Other one")
        assert other.scene["formula"]["iterations"] == 11
        assert other.scene["camera"]["position"] == [0, 0, 9]
        assert any("there are others: Default" in each for each in other.remarks)
        with pytest.raises(FileError, match="did you mean 'Other one'"):
            imported(text, preset="Other on")

    def test_without_a_preset_sliders_begin(self) -> None:
        found = imported(SPONGE.partition("#preset")[0])
        assert "there is no preset; parameters have the first values of their sliders" in found.remarks
        assert found.scene["formula"]["iterations"] == 5


class TestLook:
    def test_the_camera(self) -> None:
        scene = load_scene(imported(SPONGE).scene)
        assert scene.camera.position == (1, -6, 2)
        assert scene.camera.target == (0, 1, 0.5)
        # FOV is half of the height at the distance 1.
        assert math.tan(math.radians(imported(SPONGE).scene["camera"]["fov"] / 2)) == pytest.approx(0.5)

    def test_light_floor_fog_and_colours(self) -> None:
        preset = (
            "SpotLightDir = 0.5,0\nSpotLight = 1,0.5,0,0.8\nHardShadow = 0.4 NotLocked\nFog = 0.5\nGlow = 1,1,1,0.2\n"
            "EnableFloor = true NotLocked\nFloorNormal = 0,0,2\nFloorHeight = -2\nFudgeFactor = 0.6\nGamma = 2.2\n"
            "BackgroundColor = 0.2,0.4,1\nDetail = -3\nToneMapping = 4\nExposure = 2\nContrast = 1.4\nReflection = 0,0,0"
        )
        found = imported(SPONGE.replace("#endpreset", preset + "\n#endpreset"))
        scene = found.scene
        load_scene(scene)
        assert scene["lights"][0]["direction"] == [-1, 0, 0]
        assert scene["lights"][0]["intensity"] == pytest.approx(0.8)
        assert "shadow" not in scene["lights"][0]
        assert scene["lights"][1]["position"] == [1, -6, 2]
        # Half of the light is gone where exp(-(fog^2 d)^2) is 1/2.
        half = math.sqrt(math.log(2)) / 0.25
        assert math.exp(-scene["fog"]["density"] * half) == pytest.approx(0.5, rel=1e-5)
        assert scene["objects"]["floor"]["position"] == [0, 0, -2]
        assert scene["formula"]["inline"]["step_scale"] == 0.6
        assert scene["output"] == {"exposure": 1, "tone": "reinhard"}
        assert "Contrast = 1.4 is not taken over" in found.remarks
        assert any("how their rays find the surface" in each for each in found.remarks)

    def test_traps_colour(self) -> None:
        preset = "OrbitStrength = 0.5\nX = 1,0,0,0\nY = 0,0,0,0\nZ = 0,0,0,0\nR = 1,1,1,1\nBaseColor = 0,0,0"
        text = MEANINGS["box"].text.replace("#endpreset", preset + "\n#endpreset")
        coloring = imported(text).scene["coloring"]
        assert coloring["trap"] == {"shape": "point"}
        assert coloring["palette"][0]["color"] == [0, 0, 0]
        assert coloring["palette"][-1]["color"] == [1, 1, 1]
        assert "coloring" not in imported(SPONGE.replace("#endpreset", preset + "\n#endpreset")).scene


REFUSED = [
    ("float DE(vec3 p) { return noise(p.x); }", "6:27: unknown function 'noise'"),
    ("float DE(vec3 p) { return length(q); }", "6:34: unknown name 'q'"),
    ("float DE(vec3 p) { return length(p) }", "6:37: ';' is missing before '}'"),
    ("float DE(vec3 p) { return length(p); ", "is missing"),
    ("float DE(vec3 p) { return p; }", "a vector, a matrix, an array or nothing as a number"),
    ("float DE(vec3 p) { return p.w; }", "6:28: the member .w"),
    ("float DE(vec3 p) { return p.xy + p; }", "these values together"),
    ("float DE(vec3 p) { while (p.x > 0.0) p.x *= 0.99; return p.x; }", "turns"),
    ("float DE(vec3 p) { for (int i = 0; i < 1000000; i++) p.x += 1.0; return p.x; }", "turns"),
    ("float DE(vec3 p) { return length(p) / 0.0; }", "a division by 0"),
    ("float DE(vec3 p) { return DE(p); }", "functions call each other too deep"),
    ("float dE(vec3 p) { return length(p); }", "a function float DE(vec3) is missing"),
    ("bool inside(vec3 p) { return length(p) < 1.0; }", "tells what is inside, not a distance"),
    ("uniform float S; slider[0,1]\nfloat DE(vec3 p) { return S; }", "6:18: slider of float must have"),
    (
        "uniform sampler2D t; file[a.png]\nfloat DE(vec3 p) { return texture2D(t, p.xy).x; }",
        "unknown name 't'",
    ),
    ("struct A { float b; };\nfloat DE(vec3 p) { return 1.0; }", "6:1: struct is outside"),
    ("float DE(vec3 p) { return length(p) @ 2.0; }", "6:37: the character '@'"),
    ("#if A + 1\n#endif\nfloat DE(vec3 p) { return length(p); }", "6:1: #if A + 1"),
    ('#include "2D.frag"\nfloat DE(vec3 p) { return length(p); }', "draws in the plane"),
    ("float DE(vec3 p) { discard; return 1.0; }", "6:20: discard"),
]


class TestRefused:
    @pytest.mark.parametrize(("code", "message"), REFUSED, ids=[message for _, message in REFUSED])
    def test_with_its_place(self, code: str, message: str) -> None:
        with pytest.raises(FileError) as caught:
            imported(fragment("\n" + code))
        check_line(caught.value)
        assert message in str(caught.value)
        assert str(caught.value).startswith("x.frag:")

    def test_presets_that_are_none(self) -> None:
        for line, message in (
            ("Scale = big", "must be 1 number, got 'big'"),
            ("Offset = 1,2", "must be 3 numbers"),
        ):
            with pytest.raises(FileError) as caught:
                imported(SPONGE.replace("#endpreset", f"{line}\n#endpreset"))
            assert message in str(caught.value)
            assert str(caught.value).startswith("x.frag:28:")

    def test_fewer_numbers_are_carried_than_there_are(self) -> None:
        names = ", ".join(f"a{i} = p.x" for i in range(17))
        turns = " ".join(f"a{i} = sin(a{i} + p.y);" for i in range(17))
        total = " + ".join(f"a{i}" for i in range(17))
        code = f"""uniform int N; slider[0,5,9]
float DE(vec3 p) {{ float {names}; for (int i = 0; i < N; i++) {{ {turns} }} return {total}; }}"""
        with pytest.raises(FileError, match="carries 17 numbers beside z; 16 are allowed"):
            imported(fragment(code))


class TestIncludes:
    def test_files_beside_are_read_and_no_others(self, tmp_path: Path) -> None:
        folder = tmp_path / "inner"
        folder.mkdir()
        (folder / "parts.frag").write_text(
            "float part(vec3 p) { return length(p) - 0.5; }\n", encoding="utf-8"
        )
        (tmp_path / "secret.frag").write_text("float secret() { return 1.0; }\n", encoding="utf-8")
        path = folder / "a.frag"
        code = "float DE(vec3 p) { return part(p); }"
        path.write_text(fragment(code, head=HEAD + '#include "parts.frag"\n'), encoding="utf-8")
        found = import_fragment(path)
        assert found.origins == ("includes parts.frag",)
        assert "sqrt(x*x + y*y + z*z) - 0.5" in found.text("a.frag")
        for name in ("../secret.frag", str(tmp_path / "secret.frag"), "..\\secret.frag", "none.frag"):
            path.write_text(fragment(code, head=f'{HEAD}#include "{name}"\n'), encoding="utf-8")
            with pytest.raises(FileError, match="unknown function 'part'"):
                import_fragment(path)
        (folder / "link.frag").symlink_to(tmp_path / "secret.frag")
        path.write_text(fragment(code, head=HEAD + '#include "link.frag"\n'), encoding="utf-8")
        with pytest.raises(FileError, match="leads out of the"):
            import_fragment(path)

    def test_files_that_include_each_other(self, tmp_path: Path) -> None:
        path = tmp_path / "a.frag"
        path.write_text('#include "a.frag"\nfloat DE(vec3 p) { return length(p); }\n', encoding="utf-8")
        with pytest.raises(FileError, match="includes more than"):
            import_fragment(path)

    def test_renderers_are_not_read(self, tmp_path: Path) -> None:
        (tmp_path / "DE-Raytracer.frag").write_text("this is no GLSL @\n", encoding="utf-8")
        path = tmp_path / "a.frag"
        path.write_text(SPONGE, encoding="utf-8")
        assert import_fragment(path).scene["formula"]["iterations"] == 5


class TestCommands:
    def test_import_and_check(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> None:
        monkeypatch.chdir(tmp_path)
        clf = InProcess(capsys)
        text = MEANINGS["box"].text
        Path("box.frag").write_text(text, encoding="utf-8")
        ended = clf("import", "box.frag")
        assert ended.status == 0
        assert "Iterations: numbers of the formula or its `iterations`, not parameters" in ended.err
        assert load_scene("box.yaml") == load_scene("box.frag")
        assert clf("check", "box.frag").status == 0
        assert Path("box.frag").read_text(encoding="utf-8") == text
        for arguments, message in (
            (("--preset", "Defalt"), "did you mean 'Default'"),
            (("--look", "ours"), "--look: is for settings of Mandelbulber"),
        ):
            refused = clf("import", "box.frag", "-o", "b.yaml", *arguments)
            assert refused.is_one_line(2, message)
            assert not Path("b.yaml").exists()
        assert kind_of(Path("box.frag")) == "fragment"
        assert is_protected(Path("box.frag"))
        assert open_source("box.frag").loaded == load_scene("box.yaml")


def test_errors_are_of_the_program(tmp_path: Path) -> None:
    path = tmp_path / "empty.frag"
    path.write_text("", encoding="utf-8")
    with pytest.raises(ClfractalError, match="a function float DE"):
        load_scene(path)
