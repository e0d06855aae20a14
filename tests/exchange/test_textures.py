"""Pictures on surfaces of a settings file: what becomes a map of a material, and what is told."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.exchange.mandelbulber import Imported, import_text
from clfractal.scene.load import load_scene
from clfractal.schema.mapped import ColorMap, NumberMap
from tests.exchange.files import settings
from tests.exchange.pictures import install

CAMERA = "camera 0 -5 0;\ntarget 0 0 0;\nfov 1;\nformula_1 7;\nN 3;"
CUBIC = "mat1_texture_mapping_type 1;\nmat1_texture_scale 0.5 0.25 1;"
PLANE = "primitive_plane_1_enabled true;\nprimitive_plane_1_material_id 2;\nmat2_use_color_texture true;"


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    names = ("color_texture.jpg", "displacement_texture.jpg", "luminosity_texture.jpg", "stones.png")
    install(tmp_path / "program", monkeypatch, names)


def imported(keys: str, look: str = "ours") -> Imported:
    return import_text(settings(f"{CAMERA}\n{keys}"), look="ours" if look == "ours" else "same")


def test_colours_reliefs_and_light() -> None:
    uses = "".join(f"mat1_use_{kind}_texture true;\n" for kind in ("color", "displacement", "luminosity"))
    more = "mat1_displacement_texture_height 0.02;\nmat1_luminosity_texture_intensity 3;"
    found = imported(f"{uses}{CUBIC}\n{more}")
    assert found.remarks == ()
    scene = load_scene(found.scene)
    material = scene.materials[scene.material.name or ""]
    color, height = material.base.color, material.bump.height
    assert isinstance(color, ColorMap)
    assert (color.texture, color.scale) == ("mandelbulber:color_texture.jpg", 0.5)
    assert isinstance(height, NumberMap)
    assert height.curve == ((0, 0), (1, 0.02))
    assert material.emission.luminance == 3
    assert isinstance(material.emission.color, ColorMap)
    assert set(scene.textures) == {
        f"mandelbulber:{kind}_texture.jpg" for kind in ("color", "displacement", "luminosity")
    }


def test_objects_have_their_own() -> None:
    keys = f"{PLANE}\nmat2_file_color_texture /home/somebody/stones.png;\nmat2_texture_mapping_type 1;"
    found = imported(keys)
    assert found.remarks == ()
    color = load_scene(found.scene).materials["material 2"].base.color
    assert isinstance(color, ColorMap)
    assert (color.texture, color.scale) == ("mandelbulber:stones.png", 1)
    both = imported(f"{keys}\nmat1_use_color_texture true;\n{CUBIC}").scene
    assert set(both["materials"]) == {"material 2", both["material"]["name"]}


@pytest.mark.parametrize(
    ("keys", "look", "remark"),
    [
        (
            f"mat1_use_color_texture true;\n{CUBIC}",
            "same",
            "mat1_use_color_texture: pictures on surfaces are for light along paths (--look ours)",
        ),
        (
            "mat1_use_color_texture true;",
            "ours",
            "mat1_use_color_texture: pictures that are laid on surfaces in a spherical way are not taken over",
        ),
        (
            f"mat1_use_color_texture true;\nmat1_file_color_texture x.png;\n{CUBIC}",
            "ours",
            "mat1_use_color_texture: 'x.png' was not found beside the file, nor among the program's pictures",
        ),
        (
            PLANE,
            "same",
            "mat2_use_color_texture: pictures on surfaces are for light along paths (--look ours)",
        ),
    ],
)
def test_what_is_told(keys: str, look: str, remark: str) -> None:
    found = imported(keys, look)
    assert found.remarks[0] == remark
    assert load_scene(found.scene).textures == {}


def test_what_is_off_is_not_told() -> None:
    keys = (
        "mat1_use_color_texture false;\nmat1_file_color_texture x.png;\nmat1_displacement_texture_height 1;"
    )
    assert imported(keys, "same").remarks == ()
