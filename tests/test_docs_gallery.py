"""The gallery's pictures: 1280 pixels wide, at most 200 KB each, as good as that allows."""

from __future__ import annotations

import io
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from tests.makers import DOCS, maker


@pytest.fixture(name="maker", scope="module")
def gallery() -> Any:
    """docs/make_gallery.py"""
    return maker("make_gallery")


def noise(amount: float, size: tuple[int, int] = (720, 1280), components: int = 3) -> Any:
    """A slope with noise over it: the more noise, the larger the file."""
    random = np.random.default_rng(1)
    slope = np.linspace(0, 0.5, size[1], dtype=np.float32)[None, :, None]
    return np.clip(slope + amount * random.random((*size, components), np.float32), 0, 1)


@pytest.mark.parametrize("amount", [0.0, 0.05, 0.2])
def test_the_best_quality_that_is_small_enough(maker: Any, amount: float) -> None:
    shown = maker.picture(noise(amount), np.ones((720, 1280, 1), np.float32))
    content, quality = maker.small_enough(shown)
    assert len(content) <= maker.LARGEST_FILE == 200_000
    assert quality in maker.QUALITIES
    assert quality == maker.QUALITIES[-1] or len(maker.webp(shown, quality + 1)) > maker.LARGEST_FILE
    with Image.open(io.BytesIO(content)) as read:
        assert (read.format, read.size, read.mode) == ("WEBP", (1280, 720), "RGB")


def test_what_cannot_be_made_small_enough(maker: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(maker, "LARGEST_FILE", 2_000)
    shown = maker.picture(noise(0.5), np.ones((720, 1280, 1), np.float32))
    with pytest.raises(ValueError, match="is larger than 2 kB even at quality 25"):
        maker.small_enough(shown)


def test_transparent_pictures_stay_so(maker: Any) -> None:
    coverage = np.ones((720, 1280, 1), np.float32)
    coverage[:, :640] = 0
    content, _ = maker.small_enough(maker.picture(noise(0.05) * coverage, coverage))
    with Image.open(io.BytesIO(content)) as read:
        alpha = np.asarray(read.convert("RGBA"))[..., 3]
    assert (alpha[:, :600] == 0).all()
    assert (alpha[:, 680:] == 255).all()


@pytest.mark.parametrize(
    ("rows", "columns", "shape"),
    [(1080, 1920, (720, 1280)), (2048, 2048, (1280, 1280)), (300, 400, (300, 400))],
)
def test_reduced_in_linear_light(maker: Any, rows: int, columns: int, shape: tuple[int, int]) -> None:
    linear = np.zeros((rows, columns, 3), np.float32)
    linear[:, ::2] = (1, 0.5, 0.25)
    found = maker.reduced(linear, maker.WIDTH)
    assert found.shape == (*shape, 3)
    assert found.dtype == np.float32
    assert found.mean(axis=(0, 1)) == pytest.approx([0.5, 0.25, 0.125], rel=0.01)
    assert (found >= 0).all()
    assert (found <= 1).all()


def test_pages_show_the_format_that_is_there(
    maker: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(maker, "PICTURES", tmp_path)
    (tmp_path / "old.png").touch()
    for name in ("new.webp", "both.webp", "both.png"):
        (tmp_path / name).touch()
    text = "![a](docs/pictures/old.png) ![b](pictures/new.png) ![c](pictures/both.png) `a.png`"
    assert maker.relinked(text) == (
        "![a](docs/pictures/old.png) ![b](pictures/new.webp) ![c](pictures/both.webp) `a.png`"
    )
    assert maker.file_of("never_made").name == "never_made.webp"


def test_the_page_is_made_of_the_scenes(maker: Any) -> None:
    """Its pictures are there, in one of the formats; those made since the size rule holds follow it."""
    page = (DOCS / "gallery.md").read_text("utf-8")
    for scene in maker.scene_paths():
        file = maker.file_of(scene.stem)
        if file.exists():
            assert f"](pictures/{file.name})" in page
        if file.suffix == ".webp" and file.exists():
            assert file.stat().st_size <= maker.LARGEST_FILE
            with Image.open(file) as shown:
                assert shown.width == maker.WIDTH


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
