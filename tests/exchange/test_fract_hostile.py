"""Settings files with mistakes: each ends in a scene or in one line."""

from __future__ import annotations

import random

from clfractal.errors import ClfractalError
from clfractal.exchange.mandelbulber import import_text
from clfractal.scene.load import load_scene
from tests.exchange.files import check_line, settings

MUTATIONS = 1100
WORDS = (
    "nan",
    "1e30",
    "-1e30",
    "",
    "true",
    "0 0 0",
    "999999999999",
    "ffff ffff ffff",
    "1,5",
    "1;2",
    "é",
    "type2",
    "combo_mode1",
    "-1",
    "1 nan -1e30",
)
CAMERA = "camera 3 -6 2;\ntarget 0 0 0;\ncamera_top 0 0 1;\nfov 1;"
LIGHT = (
    "limits_enabled true;\nbasic_fog_enabled true;\nmat1_surface_color_gradient 0 ff0000 5000 00ff00;\n"
    "iteration_fog_enable true;\niteration_fog_opacity 3;\niteration_fog_opacity_trim 2;\n"
    "iteration_fog_color_1_maxiter 4;\n"
    "volumetric_fog_enabled true;\nvolumetric_fog_distance_factor 0.1;\nvolumetric_fog_colour_1_distance 0.2;\n"
    "aux_light_enabled_1 true;\nmain_light_alpha 10;\nbackground_color_1 0 0 ffff;"
)
FILES = (
    settings(
        f"{CAMERA}\n{LIGHT}\nformula_1 8;\nformula_2 7;\nhybrid_fractal_enable true;\nformula_iterations_1 2;\n"
        "formula_weight_2 0;\nN 6;",
        "mandelbox_scale -1.5;",
        "[fractal_2]\ntransf_scale_3 3;",
    ),
    settings(
        f"{CAMERA}\n{LIGHT}\nboolean_operators true;\nformula_1 7;\nformula_2 8;\nboolean_operator_1 2;\n"
        "formula_position_2 1 2 3;\nformula_rotation_2 10 20 30;\nformula_scale_2 0.2;\njulia_mode_2 true;\nN 6;",
        "IFS_rotation 10 20 30;",
    ),
    settings(
        f"{CAMERA}\nfractal_rotation 10 20 30;\nfractal_position 1 0 0;\nprimitive_box_1_enabled true;\n"
        "primitive_box_1_rotation 1 2 3;\nprimitive_water_1_enabled true;\nlegacy_coordinate_system true;\nN 6;",
        "power 8;",
    ),
)


def mutated(text: str, chance: random.Random) -> str:
    """A file with one to four mistakes."""
    lines = text.split("\n")
    for _ in range(chance.randint(1, 4)):
        place = chance.randrange(len(lines))
        line = lines[place]
        match chance.randrange(6):
            case 0:
                lines[place] = f"{line.partition(' ')[0]} {chance.choice(WORDS)};"
            case 1:
                lines[place] = ""
            case 2:
                lines.insert(place, line)
            case 3 if line:
                at = chance.randrange(len(line))
                lines[place] = line[:at] + chr(chance.randrange(1, 0x2FFF)) + line[at + 1 :]
            case 4:
                lines[place] = line[: len(line) // 2]
            case _:
                other = chance.randrange(len(lines))
                lines[place], lines[other] = lines[other], line
    return "\n".join(lines)


def test_mutations_end_in_a_scene_or_in_one_line() -> None:
    """With the 900 of fragments two thousand."""
    opened = 0
    for number in range(MUTATIONS):
        chance = random.Random(number)
        text = mutated(FILES[number % len(FILES)], chance)
        try:
            found = import_text(text, "x.fract")
            assert all("\n" not in remark for remark in found.remarks)
            load_scene(found.text("x.fract"))
            opened += 1
        except ClfractalError as error:
            check_line(error)
    assert 0.2 * MUTATIONS < opened < MUTATIONS
