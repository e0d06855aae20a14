"""The picture behind the set of a settings file: where it is found, how it lies, and what is told of it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from PIL import Image

from clfractal.cli.proposals import Moved
from clfractal.exchange import program_folder
from clfractal.exchange.mandelbulber import Imported, import_settings, import_text
from clfractal.exchange.parameters import rotation
from clfractal.exchange.surroundings import picture_named
from clfractal.files.map_directions import in_picture
from clfractal.scene.load import load_scene
from clfractal.viewer.named import carried, data_files
from tests.exchange.files import settings
from tests.exchange.pictures import install, picture
from tests.shell import InProcess

CAMERA = "camera 0 -5 0;\ntarget 0 0 0;\ncamera_top 0 0 1;\nfov 1;\nformula_1 7;\nN 3;\nimage_width 16;\nimage_height 12;"
TEXTURED = f"{CAMERA}\ntextured_background true;"


@pytest.fixture(autouse=True)
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A program with two pictures."""
    install(tmp_path / "program", monkeypatch, ("background.jpg", "sea.png"))


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Where the settings file is."""
    inside = tmp_path / "files"
    for name in ("sky.png", "sea.png", "sub/hill.png", "textures/moon.png"):
        picture(inside / name)
    picture(tmp_path / "secret.png")
    (inside / "link.png").symlink_to("../secret.png")
    return inside


def imported(keys: str, **options: Any) -> Imported:
    return import_text(settings(f"{TEXTURED}\n{keys}"), **options)


@pytest.mark.parametrize(
    ("text", "name"),
    [
        ("sky.png", "sky.png"),
        ("sub/hill.png", "sub/hill.png"),
        ("moon.png", "textures/moon.png"),
        ("/home/somebody/pictures/sky.png", "sky.png"),
        (r"C:\Users\somebody\sky.png", "sky.png"),
        ("../elsewhere/moon.png", "textures/moon.png"),
        ("$SHARED_DIR/textures/sea.png", "mandelbulber:sea.png"),
        ("/opt/mandelbulber2/textures/background.jpg", "mandelbulber:background.jpg"),
        ("sea.png", "sea.png"),
        ("$SHARED_DIR/textures/sky.png", "sky.png"),
        ("../secret.png", None),
        ("link.png", None),
        ("sub", None),
        ("/etc/passwd", None),
        ("none.png", None),
        ("", None),
        ("..", None),
        ("/", None),
    ],
)
def test_where_pictures_are_found(text: str, name: str | None, folder: Path) -> None:
    assert picture_named(text, folder) == name


@given(st.text(max_size=300))
def test_any_text_names_a_picture_or_none(text: str) -> None:
    found = picture_named(text, Path(__file__).parent)
    assert found is None or ".." not in Path(found).parts


def test_a_picture_becomes_the_environment() -> None:
    found = imported("background_brightness 0.5;")
    scene = load_scene(found.scene)
    assert found.remarks == ()
    assert scene.environment is not None
    assert (scene.environment.file, scene.environment.rays) == ("mandelbulber:background.jpg", 0)
    assert scene.environment.background
    assert scene.environment.intensity == pytest.approx(0.5**2.2, rel=1e-4)
    ours = load_scene(imported("", look="ours").scene).environment
    assert ours is not None
    assert ours.rays > 0
    assert ours.background


@pytest.mark.parametrize(
    ("keys", "remark"),
    [
        (
            "file_background /home/somebody/hills.jpg;",
            "file_background: '/home/somebody/hills.jpg' was not found beside the file, nor among the program's pictures",
        ),
        (
            "textured_background_map_type 2;",
            "textured_background_map_type: a picture behind the set that is flat is not taken over",
        ),
        (
            "textured_background_map_type 1;",
            "textured_background_map_type: a picture behind the set that is double hemisphere is not taken over",
        ),
    ],
)
def test_what_is_told(keys: str, remark: str) -> None:
    found = imported(keys)
    assert found.remarks == (remark,)
    assert "environment" not in found.scene
    load_scene(found.scene)


def test_what_has_no_counterpart_is_told_beside_the_picture() -> None:
    found = imported("background_v_scale 1.04;\nbackground_texture_offset_y 0.5;")
    assert "environment" in found.scene
    assert [remark.partition(":")[0] for remark in found.remarks] == [
        "background_v_scale",
        "background_texture_offset_y",
    ]


def test_keys_of_a_picture_that_is_off_are_not_told() -> None:
    keys = "file_background x.jpg;\ntextured_background_map_type 2;\nbackground_texture_offset_y 0.2;"
    assert import_text(settings(f"{CAMERA}\n{keys}")).remarks == ()


@pytest.mark.parametrize("legacy", [False, True])
@pytest.mark.parametrize("turned", [False, True])
@pytest.mark.parametrize(("angles", "offset"), [((0, 0, 0), 0), ((40, 20, 30), 0.1), ((0, 90, 0), 0)])
def test_how_it_lies(legacy: bool, turned: bool, angles: tuple[float, ...], offset: float) -> None:
    """Their direction d shows the picture at Rz(a) Rx(b) Ry(c) d, moved by the offset: as pictures of the program show."""
    fractal = (50.0, 20.0, 30.0) if turned else (0.0, 0.0, 0.0)
    keys = f"background_rotation {' '.join(map(str, angles))};\nbackground_texture_offset_x {offset};"
    keys += (
        f"\nfractal_rotation {' '.join(map(str, fractal))};\nlegacy_coordinate_system {str(legacy).lower()};"
    )
    environment = load_scene(imported(keys).scene).environment
    assert environment is not None
    a, b, c = map(float, angles)
    matrix = np.array(rotation((0.0, 0.0, a))) @ rotation((b, 0.0, 0.0)) @ rotation((0.0, c, 0.0))
    for theirs in np.random.default_rng(1).normal(size=(20, 3)):
        ours = np.array(rotation(fractal)) @ theirs
        ours = ours * (1, 1, -1) if legacy else ours
        there = in_picture(environment.up, environment.rotation, environment.mirrored) @ ours
        wanted = matrix @ theirs
        across = [np.arctan2(each[0], each[1]) / (2 * np.pi) for each in (there, wanted)]
        assert (across[0] - across[1] - offset + 0.5) % 1 == pytest.approx(0.5, abs=1e-6)
        assert there[2] == pytest.approx(wanted[2], abs=1e-6)


def test_fog_hides_it_or_leaves_it_as_it_is() -> None:
    for visibility, seen in ((200, True), (5, False)):
        keys = f"basic_fog_enabled true;\nbasic_fog_visibility {visibility};"
        environment = load_scene(imported(keys).scene).environment
        assert environment is not None
        assert environment.background is seen


class TestShell:
    @pytest.fixture
    def clf(
        self, folder: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
    ) -> InProcess:
        (folder / "x.fract").write_text(settings(f"{TEXTURED}\nfile_background sky.png;"), encoding="utf-8")
        (folder.parent / "elsewhere").mkdir()
        monkeypatch.chdir(folder.parent / "elsewhere")
        return InProcess(capsys)

    def test_what_is_seen_past_the_set(self, clf: InProcess) -> None:
        assert clf("render", "../files/x.fract", "-o", "x.png", "--samples", "1", "--quiet").status == 0
        with Image.open("x.png") as seen:
            assert np.abs(np.asarray(seen)[0, 0].astype(int) - (200, 100, 50)).max() <= 1

    def test_the_picture_goes_along(self, clf: InProcess) -> None:
        ended = clf("import", "../files/x.fract")
        assert ended.status == 0
        assert "sky.png: a picture that the scene names, from ../files" in ended.err
        assert load_scene("x.yaml") == load_scene("../files/x.fract")
        assert Path("sky.png").read_bytes() == Path("../files/sky.png").read_bytes()
        # Where it is already, and where another file has its name.
        assert clf("import", "../files/x.fract", "-o", "../files/y.yaml").status == 0
        picture(Path("sky.png"), (1, 2, 3))
        assert clf("import", "../files/x.fract", "-o", "z.yaml").status == 0
        environment = load_scene("z.yaml").environment
        assert environment is not None
        assert environment.file == "sky-2.png"

    def test_a_picture_that_is_none(self, clf: InProcess) -> None:
        Path("../files/sky.png").write_bytes(b"\x89PNG\r\n\x1a\n" + bytes(40))
        for order in (["render", "../files/x.fract", "-o", "x.png"], ["import", "../files/x.fract"]):
            ended = clf(*order)
            assert (ended.status, ended.err.count("\n")) == (2, 1)
            assert ended.err.startswith("../files/x.fract")
            assert "environment.file: ../files/sky.png is " in ended.err
        assert not Path("x.png").exists()
        assert not Path("x.yaml").exists()

    def test_without_the_program(self, clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
        Path("y.yaml").write_text(
            import_settings(Path("../files/x.fract"))
            .text("x.fract")
            .replace("sky.png", "'mandelbulber:sea.png'")
        )
        assert load_scene("y.yaml").surroundings is not None
        monkeypatch.setattr(program_folder, "PLACES", ())
        ended = clf("check", "y.yaml")
        assert ended.is_one_line(
            2,
            "environment.file: is a picture of Mandelbulber 2, which is not installed: 'mandelbulber:sea.png'",
        )

    def test_pictures_of_the_program_stay_where_they_are(self, clf: InProcess) -> None:
        text = settings(f"{TEXTURED}\nfile_background $SHARED_DIR/textures/sea.png;")
        Path("y.fract").write_text(text, encoding="utf-8")
        Path("away").mkdir()
        assert clf("import", "y.fract", "-o", "away/y.yaml").status == 0
        scene = load_scene("away/y.yaml")
        assert scene.environment is not None
        assert scene.environment.file == "mandelbulber:sea.png"
        assert [path.name for path in Path("away").iterdir()] == ["y.yaml"]
        # Variations and the window write it elsewhere.
        here = Moved(Path("away/y.yaml"), scene, Path(), "variations").plain(scene)
        assert here["environment"]["file"] == "mandelbulber:sea.png"
        along = carried(None, Path("away"), data_files(scene), Path("away"), Path("z.yaml"))
        assert (along.names, along.copies) == ({"mandelbulber:sea.png": "mandelbulber:sea.png"}, {})
