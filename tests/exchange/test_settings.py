"""Settings files as they are read: sections, values, limits, and the line of every mistake."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from clfractal.errors import FileError
from clfractal.exchange import settings as settings_module
from clfractal.exchange.settings import Section, parse_settings, read_settings
from clfractal.files.file_kinds import kind_of
from tests.exchange.files import HEAD, settings


def read(text: str) -> Section:
    return parse_settings(text, "x.fract").main


def test_values_of_every_kind() -> None:
    main = read(settings("a 1,5;\nb 1e-3 -2 .5;\nc true;\nd 0;\ne ff00 00ff 0;\nf words of a name;\ng 7;"))
    assert main.number("a", 0.0) == 1.5
    assert main.vector("b") == (1e-3, -2.0, 0.5)
    assert main.flag("c", False)
    assert not main.flag("d", True)
    assert main.color("e", (0, 0, 0)) == (0xFF00 / 0xFFFF, 0x00FF / 0xFFFF, 0.0)
    assert main.text("f") == "words of a name"
    assert main.whole("g", 0) == 7
    assert main.numbers("a", (0.0, 3.0)) == (1.5, 3.0)  # what is missing is the default's
    assert (main.number("z", 4.0), main.flag("z", True), main.vector("z", (1, 2, 3))) == (
        4.0,
        True,
        (1, 2, 3),
    )


def test_what_was_not_read_is_told_in_order() -> None:
    main = read(settings("a 1;\nb 2;\nc 3;"))
    main.number("b", 0.0)
    assert [(key, entry.line) for key, entry in main.unread()] == [("a", 5), ("c", 7)]
    main.without(["c"])
    assert [key for key, _ in main.unread()] == ["a"]


def test_version_sections_and_films() -> None:
    text = settings(
        "a 1;", more="[keyframes]\nframe;main_camera_x\n0;1\n[description]\nAny text; at all\n[other]\n"
    )
    found = parse_settings(text, "x.fract")
    assert found.version == (2, 20)
    assert [name for name, _ in found.tables] == ["keyframes"]
    assert found.remarks == ["line 13: section [other] is not known"]
    newer = parse_settings(text.replace("2.20", "2.41"), "x.fract")
    assert "newer than 2.34" in newer.remarks[0]


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "",
            "x.fract:1: is no settings file of Mandelbulber 2, which begin with '# Mandelbulber settings file'",
        ),
        ("version: 1\n", "x.fract:1: is no settings file"),
        ("Mandelbulber 1.21;\n", "x.fract:1: is of Mandelbulber 1; version 2 opens it"),
        (f"{HEAD}camera 1 2 3;\n", "x.fract:4: must stand in a section, such as [main_parameters]"),
        (settings("camera 1 2 3"), "x.fract:5: must end with ';', as in `key value;`"),
        (settings("a-b 1;"), "x.fract:5: must be `key value;`, got 'a-b 1;'"),
        (settings("k" * 300 + " 1;"), "x.fract:5: must be `key value;`"),
    ],
)
def test_mistakes_of_the_format(text: str, message: str) -> None:
    with pytest.raises(FileError) as caught:
        parse_settings(text, "x.fract")
    assert str(caught.value).startswith(message)


@pytest.mark.parametrize(
    ("value", "read_as", "message"),
    [
        ("one", "number", "x.fract:5: a: must be a number, got 'one'"),
        ("nan", "number", "x.fract:5: a: must be a number, got 'nan'"),
        ("1e40", "number", "x.fract:5: a: must be a number, got '1e40'"),
        ("1_0", "number", "x.fract:5: a: must be a number, got '1_0'"),
        ("1 2", "number", "x.fract:5: a: must be one number, got 2"),
        ("1.5", "whole", "x.fract:5: a: must be a whole number, got '1.5'"),
        ("yes", "flag", "x.fract:5: a: must be true or false, got 'yes'"),
        ("12 34", "color", "x.fract:5: a: must be three hexadecimal numbers, got 2"),
        ("12 34 1ffff", "color", "x.fract:5: a: must be hexadecimal, 0 to ffff, got '1ffff'"),
        ("12 34 -1", "color", "x.fract:5: a: must be hexadecimal, 0 to ffff, got '-1'"),
    ],
)
def test_mistakes_of_values(value: str, read_as: str, message: str) -> None:
    main = read(settings(f"a {value};"))
    defaults = {"number": 0.0, "whole": 0, "flag": False, "color": (0, 0, 0)}
    with pytest.raises(FileError) as caught:
        getattr(main, read_as)("a", defaults[read_as])
    assert str(caught.value) == message


def test_limits(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setattr(settings_module, "MAX_LINES", 20)
    monkeypatch.setattr(settings_module, "MAX_KEYS", 3)
    monkeypatch.setattr(settings_module, "MAX_VALUE", 10)
    for text, message in (
        (settings("\n" * 30), "has more than 20 lines"),
        (settings("a 1;\nb 1;\nc 1;\nd 1;"), "has more than 3 keys"),
        (settings(f"a {'1' * 11};"), "is too long: at most 10 characters"),
    ):
        with pytest.raises(FileError, match=message):
            parse_settings(text, "x.fract")
    large = tmp_path / "large.fract"
    with open(large, "wb") as stream:
        stream.truncate(settings_module.MAX_BYTES + 1)
    with pytest.raises(FileError, match="is too large"):
        read_settings(large)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_only_regular_files_are_read(tmp_path: Path) -> None:
    os.mkfifo(tmp_path / "pipe.fract")
    with pytest.raises(FileError, match="is not a regular file"):
        read_settings(tmp_path / "pipe.fract")
    with pytest.raises(FileError, match="cannot be read"):
        read_settings(tmp_path / "none.fract")


def test_a_key_that_is_there_twice_is_told() -> None:
    found = parse_settings(settings("a 1;\na 2;"), "x.fract")
    assert found.main.number("a", 0.0) == 2
    assert found.remarks == ["line 6: a is there twice; the last one counts"]


def test_a_scene_may_speak_of_the_program_in_its_first_line(tmp_path: Path) -> None:
    scene = tmp_path / "mine.yaml"
    scene.write_text("# Mandelbulber settings as a scene\nversion: 1\n", encoding="utf-8")
    assert kind_of(scene) is None
    scene.write_text("# Mandelbulber settings file\n# version 2.20\n", encoding="utf-8")
    assert kind_of(scene) == "settings"


def test_one_number_is_that_of_all_three() -> None:
    main = parse_settings(settings("fractal_constant_factor 1.5;\njulia_c 1 2;"), "x.fract").main
    assert main.vector("fractal_constant_factor", (1, 1, 1)) == (1.5, 1.5, 1.5)
    assert main.vector("julia_c") == (1, 2, 0)
