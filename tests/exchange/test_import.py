"""Settings files as scenes: formula, camera, light, colours, what is told, and files that mean harm."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.camera.views import camera_view
from clfractal.errors import ClfractalError, FileError
from clfractal.exchange.installed import find_installed
from clfractal.exchange.mandelbulber import Imported, import_settings, import_text
from clfractal.scene.load import load_scene
from tests.exchange.files import FOLD, check_line, program, settings
from tests.render.traps import carried_by_numpy
from tests.shell import InProcess

CAMERA = (
    "camera 3 -5 2;\ntarget 0 1 0.5;\ncamera_top -0.2 0.3 1;\nfov 0.8;\nimage_width 64;\nimage_height 48;"
)

# A fold that counts itself for colours.
_FOLDED = """REAL4 OwnIteration(REAL4 z, __constant sFractalCl *fractal, sExtendedAuxCl *aux)
{
	REAL4 oldZ = z;
	if (z.x > 1.0f) z.x = 2.0f - z.x;
	if (z.x != oldZ.x) aux->color += fractal->mandelbox.color.factor.x;
	return z * 2.0f;
}
"""


def imported(main_keys: str = "", fractal: str = "", **options: Any) -> Imported:
    return import_text(settings(main_keys, fractal), "x.fract", **options)


class TestScenes:
    def test_what_every_file_gives(self) -> None:
        found = imported(CAMERA)
        scene = load_scene(found.scene)
        assert (scene.image.width, scene.image.height) == (64, 48)
        assert scene.camera.position == (3, -5, 2)
        assert scene.camera.target == (0, 1, 0.5)
        assert math.tan(math.radians(found.scene["camera"]["fov"] / 2)) == pytest.approx(0.4)
        assert found.scene["formula"] == {
            "name": "cosine_mandelbulb",
            "parameters": {"power": 9, "z_sign": 1},
            "iterations": 251,
        }
        assert found.remarks == ()
        assert load_scene(found.text("x.fract")) == scene

    @pytest.mark.parametrize(
        ("main_keys", "fractal", "formula"),
        [
            ("formula_1 8;\nN 20;", "mandelbox_scale -1.5;", {"name": "mandelbox", "iterations": 21}),
            ("formula_1 7;\nN 20;", "", {"name": "menger_sponge", "iterations": 20}),
            (
                "julia_mode true;\njulia_c 0.1 0.2 0.3;\nN 20;",
                "power 4;",
                {"iterations": 20, "julia": [0.1, 0.2, 0.3]},
            ),
            ("formula_1 3;\ndont_add_c_constant_1 true;\nN 5;", "", {"iterations": 5, "julia": [0, 0, 0]}),
            ("formula_1 5;\nN 5;", "", {"name": "quaternion_mandelbrot", "iterations": 6}),
            (
                "formula_1 19;\nN 5;",
                "cadd 0.5;",
                {"name": "aexion", "parameters": {"plus": 0.5}, "iterations": 6},
            ),
        ],
    )
    def test_formulas_of_the_library(
        self, main_keys: str, fractal: str, formula: dict[str, Any], tmp_path: Path
    ) -> None:
        # Without texts: what is found is found in the library.
        found = imported(main_keys, fractal, formulas=program(tmp_path)).scene["formula"]
        assert {key: found[key] for key in formula} == formula
        load_scene({"version": 1, "formula": found, "camera": {}})

    def test_what_the_library_has_not_without_texts(self, tmp_path: Path) -> None:
        folder = program(tmp_path)
        for main_keys, fractal, reason in (
            ("formula_1 8;", "mandelbox_folding_limit 1.5;", "it folds at 1.5 by 2, not at 1 by 2"),
            ("", "power 2.5;", "its power is 2.5; ours are whole, 2 to 16"),
            (
                "formula_1 7;\ndont_add_c_constant_1 true;",
                "",
                "our library has it, but not with what is added here",
            ),
        ):
            with pytest.raises(FileError) as caught:
                imported(f"N 4;\n{main_keys}", fractal, formulas=folder)
            assert reason in str(caught.value)
            assert str(caught.value).startswith("x.fract")

    def test_the_picture_of_an_old_file_is_upside_down(self) -> None:
        plain, old = (
            load_scene(imported(f"{CAMERA}\nlegacy_coordinate_system {word};").scene)
            for word in ("false", "true")
        )
        rays = []
        for scene in (plain, old):
            view = camera_view(scene.camera, 64, 48)
            corners = [
                view.center + 0.5 * (sx * view.width * view.side + sy * view.height * view.up) - view.origin
                for sx, sy in ((-1, 1), (1, 1), (-1, -1))
            ]
            rays.append([corner / np.linalg.norm(corner) for corner in corners])
        flip = np.diag([1.0, 1.0, -1.0])
        for corner, other in ((0, 2), (2, 0)):
            np.testing.assert_allclose(flip @ rays[0][corner], rays[1][other], atol=1e-12)

    def test_light(self) -> None:
        # From behind the camera, from its left, from above; and in space.
        for keys, direction in (
            ("main_light_alpha 0;\nmain_light_beta 0;", (0, 1, 0)),
            ("main_light_alpha -90;\nmain_light_beta 0;", (1, 0, 0)),
            ("main_light_beta 90;", (0, 0, -1)),
        ):
            camera = "camera 0 -5 0;\ntarget 0 0 0;\ncamera_top 0 0 1;"
            (light,) = imported(f"{camera}\n{keys}").scene["lights"]
            assert light["direction"] == pytest.approx(direction, abs=1e-9)
        # What comes from the right in space comes from the left of a camera that looks the other way.
        behind = "camera 0 5 0;\ntarget 0 0 0;\ncamera_top 0 0 1;\nmain_light_alpha 90;\nmain_light_beta 0;"
        assert imported(behind).scene["lights"][0]["direction"] == pytest.approx((1, 0, 0), abs=1e-9)
        fixed = imported(f"{behind}\nmain_light_position_relative false;").scene["lights"][0]
        assert fixed["direction"] == pytest.approx((-1, 0, 0), abs=1e-9)
        lamps = "main_light_enable false;\naux_light_enabled_2 true;\naux_light_position_2 1 2 3;\nshadows_enabled false;"
        (lamp,) = imported(f"{CAMERA}\n{lamps}").scene["lights"]
        assert (lamp["type"], lamp["position"]) == ("point", [1, 2, 3])

    def test_colours(self) -> None:
        scene = imported(
            "mat1_surface_color_gradient 0 ff0000 2500 00ff00;\nmat1_coloring_speed 2;\nglow_enabled 0;"
        ).scene
        assert scene["coloring"]["palette"] == [
            {"at": 0, "color": "#ff0000"},
            {"at": 0.25, "color": "#00ff00"},
            {"at": 1, "color": "#ff0000"},
        ]
        assert scene["coloring"]["scale"] == pytest.approx(2 * 5000 / 2560, rel=1e-5)
        old = imported(
            "surface_color_palette 5500 94ce5e ;\ncoloring_speed 3;\nformula_1 10;", "IFS_scale 3;"
        )
        assert [stop["color"] for stop in old.scene["coloring"]["palette"]] == [
            "#005500",
            "#94ce5e",
            "#005500",
        ]
        single = imported("mat1_use_colors_from_palette false;\nmat1_surface_color ffff 0 8000;").scene
        assert "coloring" not in single
        assert single["material"]["color"][:2] == [1, 0]
        # Theirs is weak by default: nobody sees it.
        assert "glow" not in single
        strong = imported("glow_intensity 15;\nglow_color_2 ffff 0 8000;").scene["glow"]
        assert strong["color"][:2] == [1, 0]
        assert strong["intensity"] == pytest.approx((15 * 8 / 512) ** 2.2, rel=1e-4)
        most = imported(f"{CAMERA}\nglow_intensity 90;").scene["glow"]["intensity"]
        assert most == pytest.approx(0.3**2.2, rel=1e-4)
        assert "glow" not in scene

    def test_colours_by_what_a_text_sums_up(self, tmp_path: Path) -> None:
        folder = program(tmp_path, abox_mod1=_FOLDED, xenodreambuie=_FOLDED)
        keys = "mat1_surface_color_gradient 0 ff0000 2500 00ff00;\nmat1_coloring_speed 2;\nN 3;"
        keys += "\ndont_add_c_constant_1 true;"
        fractal = "mandelbox_color 0.3 0 0;"
        found = imported(f"{keys}\nformula_1 64;", fractal, formulas=folder)
        coloring = found.scene["coloring"]
        assert (coloring["by"], coloring["number"]) == ("carried", "kept_color")
        assert coloring["scale"] == pytest.approx(2 * 100 / 2560, rel=1e-5)
        assert not [each for each in found.remarks if "folds" in each]
        scene = load_scene(found.scene)
        points = np.array([[0.4, 0.1, 0.2], [1.2, 0.3, 0.1]])
        # x is folded where it is beyond 1, and doubled: 1 and 0.3 for each time.
        expected = []
        for x, _, _ in points:
            color, z = 1.0, x
            for _ in range(3):
                color += 0.3 * (z > 1)
                z = 2 * (2 - z if z > 1 else z)
            expected.append(color)
        got = carried_by_numpy(scene.chain, points, scene.formula.iterations)["kept_color"]
        np.testing.assert_allclose(got, expected, rtol=1e-6)
        assert len(set(expected)) == 2
        # Others follow the orbit's distance from the origin, and so does this one where a file asks for other colours.
        for other in (
            "formula_1 11;",
            "formula_1 64;\nmat1_fractal_coloring_algorithm 2;",
            "formula_1 64;\nhybrid_fractal_enable true;\nformula_2 0;",
        ):
            scene_of_other = imported(f"{keys}\n{other}", fractal, formulas=folder).scene
            assert scene_of_other["coloring"]["by"] == "trap"
            assert "kept_color" not in str(scene_of_other["formula"])

    def test_background_is_what_is_seen_above_and_below(self) -> None:
        level = "camera 0 -5 0;\ntarget 0 0 0;\ncamera_top 0 0 1;\nfov 2;"
        colors = "background_color_1 ffff 0 0;\nbackground_color_2 0 ffff 0;\nbackground_color_3 0 0 ffff;"
        background = imported(f"{level}\n{colors}").scene["background"]
        part = math.sqrt(0.5)  # a ray at 45 degrees
        decoded = [((each + 0.055) / 1.055) ** 2.4 for each in (part, 1 - part)]
        assert background["top"] == pytest.approx([decoded[0], decoded[1], 0], abs=1e-5)
        assert background["bottom"] == pytest.approx([0, decoded[1], decoded[0]], abs=1e-5)

    def test_fog_limits_and_output(self) -> None:
        keys = (
            "basic_fog_enabled true;\nbasic_fog_visibility 4;\nlimits_enabled true;\nlimit_min -1 -2 -3;\n"
            "limit_max 1 0 3;\nbrightness 2;\nhdr true;\ngamma 0.5;"
        )
        found = imported(f"{CAMERA}\n{keys}")
        assert found.scene["fog"]["density"] == 0.25
        assert found.scene["objects"]["limits"]["position"] == [0, -1, 0]
        assert found.scene["objects"]["limits"]["size"] == [2, 2, 6]
        assert found.scene["output"] == {"exposure": 4.4, "tone": "reinhard"}
        assert found.remarks == ()
        load_scene(found.scene)

    def test_rays_end_where_theirs_do(self) -> None:
        # The camera is 6.2 from the middle.
        joined = "boolean_operators true;\nformula_2 7;\nformula_position_2 0 -5 2;\nformula_scale_2 0.1;"
        for keys, bounded in (
            ("", False),
            ("view_distance_max 8;", False),
            ("view_distance_max 6;", True),
            (f"view_distance_max 8;\n{joined}", False),
            (f"view_distance_max 3;\nfractal_position 0 -9 3;\n{joined}", True),
        ):
            scene = load_scene(imported(f"{CAMERA}\n{keys}\nN 9;").scene)
            assert (scene.surface.bounds is not None) == bounded
            if bounded:
                assert scene.bounds == (scene.camera.position, float(keys.split()[1].rstrip(";")))

    def test_a_bailout_of_what_does_not_escape(self) -> None:
        keys = "N 9;\nuse_default_bailout false;\n"
        for more, radius in (
            ("", None),
            ("iteration_threshold_mode true;", 100),
            ("iteration_threshold_mode true;\nbailout 20,5;", 20.5),
            ("iteration_threshold_mode true;\nformula_1 7;\nbailout 20,5;", None),  # it has a shape
        ):
            found = imported(f"{CAMERA}\n{keys}{more}").scene
            assert found["formula"].get("bailout") == radius
            load_scene(found)

    def test_gamma_is_that_of_all_colours(self) -> None:
        keys = "background_3_colors_enable false;\nbackground_color_1 8000 ffff 0;\ngamma 0.5;\nshadows_enabled false;"
        scene = imported(f"{CAMERA}\n{keys}\nmat1_surface_color_gradient 0 800000 5000 00ff00;").scene
        # Half of the screen's white is a quarter with this gamma, which sRGB shows of 0.0509 of the light.
        assert scene["background"]["top"] == pytest.approx([0.0513, 1, 0], abs=5e-4)
        assert scene["coloring"]["palette"][0]["color"][0] == pytest.approx(0.0513, abs=5e-4)
        brighter = imported(f"{CAMERA}\n{keys}\nmain_light_intensity 2;").scene["lights"][0]["intensity"]
        assert brighter / scene["lights"][0]["intensity"] == pytest.approx(2**4.4, rel=1e-4)

    def test_fog_in_front_of_the_background(self) -> None:
        keys = "basic_fog_enabled true;\nbasic_fog_visibility 4;\nbasic_fog_color ffff 0 0;\nview_distance_max 4;"
        black = "".join(f"background_color_{number} 0 0 0;\n" for number in (1, 2, 3))
        scene = imported(f"{CAMERA}\n{black}{keys}").scene
        assert scene["background"]["top"] == pytest.approx([1 - math.exp(-1), 0, 0], abs=1e-5)
        assert scene["fog"]["background"] is False

    def test_fog_around_the_set(self) -> None:
        """What pictures of theirs show of a plane, a ball and counts that are known (`docs/import.md`)."""
        keys = (
            "volumetric_fog_enabled true;\nvolumetric_fog_density 2;\nvolumetric_fog_distance_factor 0.1;\n"
            "volumetric_fog_distance_from_surface 0.3;\nvolumetric_fog_colour_1_distance 0.5;\n"
            "volumetric_fog_colour_2_distance 1;\nfog_color_1 ffff 0 0;\nfog_color_2 0 ffff 0;\nfog_color_3 0 0 ffff;\n"
        )
        black = "".join(f"background_color_{number} 0 0 0;\n" for number in (1, 2, 3))
        scene = imported(f"{CAMERA}\n{black}{keys}").scene
        mist = load_scene(scene).mist
        assert mist is not None
        assert (mist.by, mist.width, mist.distance) == ("closeness", 0.1, 0.3)
        # Seen at distances of 0.25, 0.5 and 1 over a plane, as parts of the screen's white.
        for at, seen in (
            (0, (1, 0, 0)),
            (0.25, (0.4375, 0.4375, 0.125)),
            (0.5, (0, 0.5, 0.5)),
            (1, (0, 0, 1)),
        ):
            (stop,) = (each for each in mist.colors if each.at == at)
            linear = [part / 12.92 if part <= 0.04045 else ((part + 0.055) / 1.055) ** 2.4 for part in seen]
            assert stop.color == pytest.approx(linear, abs=1e-5)
        # A way straight down has 0.3 * 2 * pi / 2 of theirs; as bright as theirs where fog of one colour is before black.
        even = "".join(f"fog_color_{number} ffff ffff ffff;\n" for number in (1, 2, 3))
        mist = load_scene(imported(f"{CAMERA}\n{black}{keys}{even}").scene).mist
        assert mist is not None
        assert mist.density is not None
        shown = (1 - math.exp(-mist.density * 0.1 * math.pi / 2)) ** (1 / 2.2)
        assert shown == pytest.approx(1 - math.exp(-0.3 * math.pi), rel=1e-4)
        assert "mist" not in imported(f"{CAMERA}\n{black}{keys}", look="ours").scene
        # Dark fog before white would have to be denser than anything may be.
        thick = f"{CAMERA}\nvolumetric_fog_enabled true;\nvolumetric_fog_density 1000000;\n"
        thick += "volumetric_fog_distance_factor 0.5;\nbackground_3_colors_enable false;\n"
        dark = "".join(f"fog_color_{number} 0 0 0;\n" for number in (1, 2, 3))
        most = load_scene(imported(f"{thick}{dark}background_color_1 ffff ffff ffff;").scene).mist
        assert most is not None
        assert most.density == 1e6

    def test_fog_by_iterations(self) -> None:
        """Their counts end at 10 of a power, ours at another radius; squares of a ball get there log2(log ratio) later."""
        keys = "formula_1 2;\njulia_mode true;\njulia_c 0 0 0;\nN 20;\niteration_fog_enable true;\n"
        keys += "iteration_fog_opacity 4;\niteration_fog_opacity_trim 5;\niteration_fog_color_1 ffff 0 0;\n"
        found = imported(f"{CAMERA}\n{keys}", "power 2;")
        scene = load_scene(found.scene)
        assert scene.mist is not None
        later = math.log2(math.log(scene.chain.distance_bailout) / math.log(10)) - 0.5
        # (By random places.)
        assert scene.mist.start == pytest.approx(5 + later, abs=0.1)
        assert scene.mist.end == pytest.approx(20 + later, abs=0.1)
        assert [stop.at for stop in scene.mist.colors] == pytest.approx(
            [5 + later, 8 + later, 12 + later], abs=0.1
        )
        assert found.remarks == ()
        both = imported(f"{CAMERA}\n{keys}volumetric_fog_enabled true;", "power 2;")
        assert both.scene["mist"].get("by") is None
        assert both.remarks == ("iteration_fog_enable: there is fog by distances already",)

    def test_light_from_everywhere(self) -> None:
        occluded = "ambient_occlusion_enabled true;\nambient_occlusion 0.8;\ncamera_distance_to_target 1;"
        scene = imported(f"{CAMERA}\n{occluded}").scene
        (light,) = scene["lights"]
        # A flat surface sees half of it: 0.4 of the screen's white, beside the light as it is at a cosine of 3/4.
        assert scene["material"]["ambient"] * light["intensity"] == pytest.approx(0.4**2.2, rel=1e-4)
        whole = scene["material"]["ambient"] * light["intensity"] + 0.75 * light["intensity"]
        assert whole == pytest.approx((0.75 + 0.4) ** 2.2, rel=1e-4)
        assert 0 < scene["renderer"]["ambient_occlusion"]["distance"] < 2
        # Without a lamp it is there all the same, from behind.
        alone = imported(f"{CAMERA}\n{occluded}\nmain_light_enable false;").scene
        (behind,) = alone["lights"]
        forward = np.subtract(alone["camera"]["target"], alone["camera"]["position"])
        assert np.dot(behind["direction"], forward) == pytest.approx(-np.linalg.norm(forward))
        assert alone["material"]["ambient"] * behind["intensity"] == pytest.approx(0.4**2.2, rel=1e-4)
        load_scene(alone)

    def test_mirrors_of_old_files(self) -> None:
        keys = "raytraced_reflections true;\nreflect 0.9;"
        assert imported(f"{CAMERA}\n{keys}").scene["material"]["reflection"] == 0.9

    def test_depth_of_field(self) -> None:
        scene = load_scene(imported(f"{CAMERA}\nDOF_enabled true;\nDOF_focus 4;\nDOF_radius 5;").scene)
        assert scene.camera.lens_radius == pytest.approx(0.0015 * 5 * 4)  # type: ignore[union-attr]
        assert scene.camera.focus_distance == 4  # type: ignore[union-attr]
        sharp = imported(f"{CAMERA}\nDOF_focus 4;")
        assert "f_number" not in sharp.scene["camera"]
        assert sharp.remarks == ()

    def test_another_look(self) -> None:
        scene = load_scene(imported(CAMERA, look="ours").scene)
        assert scene.lighting.mode == "path"
        assert scene.environment is not None

    def test_everything_else_is_told(self) -> None:
        keys = (
            "DE_delta 1;\nclouds_density 3;\nstereo_enabled true;\nflight_speed 2;\n"
            "DE_factor 0.5;\nnever_seen 1;"
        )
        found = imported(f"{CAMERA}\nfractal_constant_factor 1 1 1;\n{keys}\nperspective_type 2;")
        assert found.remarks == (
            "perspective_type: equirectangular is not there yet; the picture is in perspective",
            "line 13: clouds_density = 3 is not taken over",
            "line 14: stereo_enabled = true is not taken over",
            "line 17: never_seen = 1 is not taken over",
            "2 keys of how their rays find the surface: ours find it by themselves",
            "1 key of windows, films and files: not a part of the picture",
        )


class TestShell:
    @pytest.fixture
    def clf(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> InProcess:
        monkeypatch.chdir(tmp_path)
        return InProcess(capsys)

    def test_import(self, clf: InProcess, tmp_path: Path) -> None:
        Path("bulb.fract").write_text(settings(f"{CAMERA}\nnever_seen 1;"), encoding="utf-8")
        ended = clf("import", "bulb.fract")
        assert ended.status == 0
        assert "bulb.fract: line 11: never_seen = 1 is not taken over" in ended.err
        assert "bulb.yaml: 1 thing is not taken over" in ended.err
        assert load_scene("bulb.yaml") == load_scene("bulb.fract")
        ended = clf("import", "bulb.fract")
        message = "bulb.yaml: exists already and is not replaced; name another file by -o\n"
        assert (ended.status, ended.err) == (2, message)
        assert clf("import", "bulb.fract", "-o", "bulb.yaml", "--look", "ours").status == 0
        assert load_scene("bulb.yaml").lighting.mode == "path"
        for arguments, message in (
            (
                ["bulb.fract", "-o", "x.yaml", "--look", "our"],
                "--look: unknown look 'our'; did you mean 'ours'?",
            ),
            (["bulb.yaml", "-o", "x.yaml"], "bulb.yaml:1: is no settings file of Mandelbulber 2"),
            (["none.fract"], "none.fract: cannot be read: No such file or directory"),
            (["bulb.fract", "-o", "x.png"], "x.png: "),
            (["bulb.fract", "-o", "x.yaml", "--formulas", "none"], "none: is no folder"),
        ):
            ended = clf("import", *arguments)
            assert ended.status == 2
            assert ended.err.startswith(message)
            assert ended.err.count("\n") == 1
        assert sorted(each.name for each in tmp_path.iterdir()) == ["bulb.fract", "bulb.yaml"]

    def test_a_folder_of_formulas(self, clf: InProcess, tmp_path: Path) -> None:
        program(tmp_path / "theirs", menger_mod1=FOLD)
        Path("fold.fract").write_text(settings("formula_1 61;\nN 6;"), encoding="utf-8")
        assert clf("import", "fold.fract", "--formulas", "theirs").status == 0
        scene = load_scene("fold.yaml")
        assert scene.chain.links[0].bound.formula.title == "Formula 61 of Mandelbulber"
        made_of = Path("theirs") / "formula" / "opencl" / "menger_mod1.cl"
        assert f"formula_1, 61, is made of {made_of}" in Path("fold.yaml").read_text(encoding="utf-8")


def test_the_examples_that_are_installed() -> None:
    """Each becomes a scene, or is refused in one line."""
    installed = find_installed()
    if installed is None:
        pytest.skip("Mandelbulber 2 is not installed")
    made = 0
    examples = sorted((installed.folder / "examples").glob("*.fract"))[::5]
    for path in examples:
        try:
            load_scene(import_settings(path).scene)
            made += 1
        except ClfractalError as error:
            check_line(error)
    assert made > 0.6 * len(examples)


class TestSolids:
    def test_solids_planes_and_water(self) -> None:
        keys = (
            "primitive_sphere_1_enabled true;\nprimitive_sphere_1_position 3 0 0;\nprimitive_box_2_enabled true;\n"
            "primitive_box_2_size 1 2 3;\nprimitive_box_2_material_id 2;\nmat2_surface_color ffff 0 0;\n"
            "primitive_cone_1_enabled true;\nprimitive_cone_1_height 2;\nprimitive_water_1_enabled true;\n"
            "primitive_water_1_length 0.5;\nprimitive_rectangle_1_enabled true;\nprimitive_rectangle_1_width 3;\n"
            "primitive_circle_1_enabled true;\nprimitive_prism_1_enabled true;\nprimitive_torus_1_radius 3;"
        )
        found = imported(f"{CAMERA}\nlegacy_coordinate_system false;\n{keys}")
        scene = load_scene(found.scene)
        assert found.scene["objects"] == {
            "box 2": {"type": "box", "position": [0, 0, 0], "size": [1, 2, 3], "material": "material 2"},
            "circle 1": {"type": "cylinder", "position": [0, 0, 0], "radius": 1, "height": 1e-4},
            "cone 1": {"type": "cone", "position": [0, 0, 1], "radius": 1, "height": 2},
            "rectangle 1": {"type": "box", "position": [0, 0, 0], "size": [3, 1, 4e-4]},
            "sphere 1": {"type": "sphere", "position": [3, 0, 0], "radius": 1},
            "water 1": {"type": "water", "position": [0, 0, 0], "waves": {"height": 0.27, "length": 3}},
        }
        assert scene.materials["material 2"].base.color == (1, 0, 0)
        assert found.remarks == ("primitive_prism_1_enabled: there is no prism among our objects",)

    def test_waves_of_old_files_have_a_height_in_scene_units(self) -> None:
        water = "primitive_water_1_enabled true;\nprimitive_water_1_length 8;\n"
        for key, amplitude in (("", 1.6), ("amplitude 0.5", 0.5), ("relative_amplitude 0.05", 0.4)):
            more = f"primitive_water_1_{key};" if key else ""
            found = imported(f"{CAMERA}\n{water}{more}")
            assert found.scene["objects"]["water 1"]["waves"]["height"] == pytest.approx(2.7 * amplitude)
            assert found.remarks == ()

    def test_a_rotation_turns_as_their_matrix_does(self) -> None:
        from clfractal.elements.shapes.box import BoxObject
        from clfractal.exchange.parameters import rotation

        keys = (
            "primitive_box_1_enabled true;\nprimitive_box_1_rotation 20 -35 50;\nprimitive_box_1_size 1 2 3;"
        )
        box = load_scene(imported(f"{CAMERA}\n{keys}").scene).objects["box 1"]
        assert isinstance(box, BoxObject)
        theirs = np.array(rotation((20.0, -35.0, 50.0, 0.0)))
        for point in np.random.default_rng(1).normal(size=(200, 3)):
            inside = bool(np.all(np.abs(theirs @ point) <= np.array([0.5, 1, 1.5])))
            assert box.holds(tuple(point)) == inside

    def test_joined_formulas(self) -> None:
        keys = (
            "boolean_operators true;\nN 6;\nformula_1 7;\nformula_2 2;\nformula_3 8;\nboolean_operator_1 2;\n"
            "formula_position_2 1 2 3;\nformula_scale_2 4;\nboolean_operator_2 0;\n"
            "julia_mode_2 true;\njulia_c_2 0.1 0.2 0.3;"
        )
        found = imported(f"{CAMERA}\n{keys}")
        scene = load_scene(found.scene)
        assert found.scene["formula"]["name"] == "menger_sponge"
        cut, common = (found.scene["objects"][f"formula {slot}"] for slot in (2, 3))
        assert (cut["join"], cut["position"], cut["scale"]) == ("cut", [1, 2, 3], 4)
        assert cut["formula"]["julia"] == [0.1, 0.2, 0.3]
        assert (common["join"], common["formula"]["name"]) == ("intersection", "mandelbox")
        assert len(scene.joined) == 2

    def test_lamps_within_solids_are_left_out(self) -> None:
        keys = "aux_light_enabled_1 true;\naux_light_position_1 0.1 0 0;\naux_light_enabled_2 true;\nN 9;"
        found = imported(f"{CAMERA}\n{keys}")
        assert [light.get("type") for light in found.scene["lights"]] == [None, "point"]
        assert found.remarks == ("a lamp at 0.1, 0, 0 is within a solid; left out",)
        load_scene(found.scene)
