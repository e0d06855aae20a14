"""Pictures of docs/: as good as 200 KB allow; each that a page shows is there, small, made as it says; measured normals."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.devices import check_usable
from tests.makers import DOCS, maker, pictured


@pytest.fixture(scope="module")
def gallery() -> Any:
    """docs/make_gallery.py"""
    return maker("make_gallery")


def noise(amount: float, size: tuple[int, int] = (720, 1280), components: int = 3) -> Any:
    """A slope with noise over it: the more noise, the larger the file."""
    random = np.random.default_rng(1)
    slope = np.linspace(0, 0.5, size[1], dtype=np.float32)[None, :, None]
    return np.clip(slope + amount * random.random((*size, components), np.float32), 0, 1)


@pytest.mark.parametrize("amount", [0.0, 0.05, 0.2])
def test_the_best_quality_that_is_small_enough(gallery: Any, amount: float) -> None:
    shown = gallery.picture(noise(amount), np.ones((720, 1280, 1), np.float32))
    content, quality = gallery.small_enough(shown)
    assert len(content) <= gallery.LARGEST_FILE == 200_000
    assert quality in gallery.QUALITIES
    assert quality == gallery.QUALITIES[-1] or len(gallery.webp(shown, quality + 1)) > gallery.LARGEST_FILE
    with Image.open(io.BytesIO(content)) as read:
        assert (read.format, read.size, read.mode) == ("WEBP", (1280, 720), "RGB")


def test_what_cannot_be_made_small_enough(gallery: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gallery, "LARGEST_FILE", 2_000)
    shown = gallery.picture(noise(0.5), np.ones((720, 1280, 1), np.float32))
    with pytest.raises(ValueError, match="is larger than 2 kB even at quality 25"):
        gallery.small_enough(shown)


def test_transparent_pictures_stay_so(gallery: Any) -> None:
    coverage = np.ones((720, 1280, 1), np.float32)
    coverage[:, :640] = 0
    content, _ = gallery.small_enough(gallery.picture(noise(0.05) * coverage, coverage))
    with Image.open(io.BytesIO(content)) as read:
        alpha = np.asarray(read.convert("RGBA"))[..., 3]
    assert (alpha[:, :600] == 0).all()
    assert (alpha[:, 680:] == 255).all()


@pytest.mark.parametrize(
    ("rows", "columns", "shape"),
    [(1080, 1920, (720, 1280)), (2048, 2048, (1280, 1280)), (300, 400, (300, 400))],
)
def test_reduced_in_linear_light(gallery: Any, rows: int, columns: int, shape: tuple[int, int]) -> None:
    linear = np.zeros((rows, columns, 3), np.float32)
    linear[:, ::2] = (1, 0.5, 0.25)
    found = gallery.reduced(linear, gallery.WIDTH)
    assert found.shape == (*shape, 3)
    assert found.dtype == np.float32
    assert found.mean(axis=(0, 1)) == pytest.approx([0.5, 0.25, 0.125], rel=0.01)
    assert (found >= 0).all()
    assert (found <= 1).all()


def test_pages_show_the_format_that_is_there(
    gallery: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(gallery, "PICTURES", tmp_path)
    (tmp_path / "old.png").touch()
    for name in ("new.webp", "both.webp", "both.png"):
        (tmp_path / name).touch()
    text = "![a](docs/pictures/old.png) ![b](pictures/new.png) ![c](pictures/both.png) `a.png`"
    assert gallery.relinked(text) == (
        "![a](docs/pictures/old.png) ![b](pictures/new.webp) ![c](pictures/both.webp) `a.png`"
    )
    assert gallery.file_of("never_made").name == "never_made.webp"


def test_the_pages_are_made_of_the_scenes(gallery: Any) -> None:
    """Their pictures are there, in one of the formats; those made since the size rule holds follow it."""
    pages = {name: (DOCS / name).read_text("utf-8") for name in gallery.pages()}
    assert pages == gallery.pages()
    for scene in gallery.scene_paths():
        page = pages["figures.md" if gallery.is_figure(scene) else "gallery.md"]
        file = gallery.file_of(scene.stem)
        if file.exists():
            assert f"](pictures/{file.name})" in page
        if file.suffix == ".webp" and file.exists():
            assert file.stat().st_size <= gallery.LARGEST_FILE
            with Image.open(file) as shown:
                assert shown.width == gallery.WIDTH


def test_the_showcase_tells_how_each_print_is_made() -> None:
    page = (DOCS / "showcase.md").read_text("utf-8")
    parts = page.split("\n## ")[1:]
    assert len(parts) >= 3
    for part in parts:
        (scene,) = re.findall(r"\]\(\.\./scenes/(\w+)\.yaml\)", part)
        assert (DOCS.parent / "scenes" / f"{scene}.yaml").is_file()
        assert f"](pictures/{scene}.webp)" in part
        (command,) = re.findall(r"```text\n(.*)\n```", part)
        told = re.fullmatch(rf"clfractal render scenes/{scene}\.yaml -o \w+\.png --size (\d+)x(\d+)", command)
        assert told, command
        assert int(told[1]) >= 3840
        assert int(told[2]) >= 2160


# --- what settings do ---


each_picture = pytest.mark.parametrize(
    "picture", maker("make_pictures").table(), ids=lambda picture: str(picture.name)
)


@pictured
@each_picture
def test_it_is_there_and_small(picture: Any) -> None:
    assert picture.path.stat().st_size <= maker("make_gallery").LARGEST_FILE == 200_000
    with Image.open(picture.path) as shown:
        assert shown.size == picture.size


@each_picture
def test_its_page_shows_it(picture: Any) -> None:
    assert f"](pictures/{picture.name}.webp)" in (DOCS / picture.page).read_text("utf-8")


@each_picture
def test_its_panels_differ(picture: Any) -> None:
    assert (
        len({(str(panel.scene.resolved()), panel.show) for panel in picture.panels})
        == len(picture.panels)
        > 1
    )


# --- the tutorial ---


PAGE = (DOCS / "tutorial.md").read_text("utf-8")
NAMES = re.findall(r"\]\(pictures/tutorial_(\w+)\.webp\)", PAGE)


def test_the_tutorial_has_pictures() -> None:
    assert len(NAMES) >= 10
    assert len(set(NAMES)) == len(NAMES)


@pictured
@pytest.mark.parametrize("name", NAMES)
def test_a_picture_of_the_tutorial(name: str) -> None:
    assert f"-o {name}.png" in PAGE
    file = DOCS / "pictures" / f"tutorial_{name}.webp"
    assert file.stat().st_size <= 200_000
    with Image.open(file) as shown:
        assert shown.width <= 1280


@pictured
def test_no_picture_is_left_over() -> None:
    assert {file.stem for file in (DOCS / "pictures").glob("tutorial_*")} == {
        f"tutorial_{name}" for name in NAMES
    }


# --- docs/normals.md against what its script measures, on a ball, and on figure 13 at one size ---

# Both ways of eight triangles have the same normal, so one of them is measured; and on the ball, where each takes a program
# that nothing else needs, the worst and the most usual one: the others are combinations. The times on the page are those of
# one machine, and are not compared.

NORMALS = ("one_triangle", "eight_triangles_shading", "eight_triangles_normal", "least_squares", "gradient")
# Of the printed figure, for its two digits and another device's rounding; and degrees.
RELATIVE, ABSOLUTE = 0.15, 0.006
SIZE = 512
MEASURED = tuple(name for name in NORMALS if name != "eight_triangles_shading")


def printed(heading: str) -> dict[str, list[float]]:
    """The table under a heading of the page: the numbers of each normal."""
    page = (DOCS / "normals.md").read_text("utf-8")
    part = page.split(f"### {heading}\n")[1].split("###")[0]
    rows = re.findall(r"^\| `(\w+)` \| ([\d. |]+) \|$", part, re.MULTILINE)
    return {name: [float(cell) for cell in cells.split("|")] for name, cells in rows}


@pytest.mark.parametrize(
    "normal",
    [
        "one_triangle",
        "least_squares",
        *(
            pytest.param(name, marks=pytest.mark.combination)
            for name in ("eight_triangles_normal", "gradient")
        ),
    ],
)
def test_errors_on_a_ball(normal: str) -> None:
    errors = list(maker("make_normals").ball_errors(normal).values())
    assert printed("On a ball")[normal] == pytest.approx(errors, rel=RELATIVE, abs=ABSOLUTE)


def test_errors_on_the_mandelbulb() -> None:
    check_usable("float64")  # or there is nothing true to compare with
    true, whole = maker("make_normals").true_normals(SIZE)
    assert whole.mean() > 0.9
    table = printed("On the Mandelbulb")
    place = 2 * maker("make_normals").SIZES.index(SIZE)
    for normal in MEASURED:
        errors = maker("make_normals").fractal_errors(normal, SIZE, true, whole)
        assert table[normal][place : place + 2] == pytest.approx(errors, rel=RELATIVE, abs=ABSOLUTE)


@pictured
def test_the_page_is_whole() -> None:
    page = (DOCS / "normals.md").read_text("utf-8")
    assert maker("make_normals").NORMALS == NORMALS
    for heading in ("On a ball", "On the Mandelbulb"):
        table = printed(heading)
        assert tuple(table) == NORMALS
        assert table["eight_triangles_shading"] == table["eight_triangles_normal"]
    times = printed("Time")
    assert times["one_triangle"][0] > 1
    for normal in NORMALS:
        assert f"](pictures/normals_{normal}.webp)" in page
        with Image.open(DOCS / "pictures" / f"normals_{normal}.webp") as picture:
            assert picture.size == maker("make_normals").CROP[2:]


def test_numbers_have_two_digits() -> None:
    number = maker("make_normals").number
    assert [number(value) for value in (0.0, 0.0004, 0.00512, 0.0351, 0.298, 2.54, 12.4)] == [
        "0", "0", "0.005", "0.035", "0.30", "2.5", "12",
    ]  # fmt: skip
