"""Texts and numbers of formulas of the program that is installed, or of a folder like its own."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.errors import FileError
from clfractal.exchange.c_text import read_formula
from clfractal.exchange.installed import Installed
from clfractal.exchange.parameters import Parameters
from clfractal.exchange.settings import Section
from clfractal.exchange.symbols import Symbols, written
from clfractal.exchange.translate import Space, apply, first_state
from tests.exchange.files import BULB, check_line, program, settings


def test_the_installed_texts() -> None:
    """Each fourth text that is installed becomes formulas, or is refused with its line."""
    from clfractal.exchange.installed import find_installed

    installed = find_installed()
    if installed is None:
        pytest.skip("Mandelbulber 2 is not installed")
    made = 0
    refused: list[str] = []
    for path in sorted((installed.folder / "formula" / "opencl").glob("*.cl"))[::4]:
        symbols, section = Symbols(), Section("x", "fractal_1")
        parameters = Parameters(section, installed.choices)
        space = Space()
        try:
            text = read_formula(path.read_text(encoding="utf-8", errors="replace"), path.name)
            done = apply(
                text,
                path.name,
                parameters,
                symbols,
                0,
                first_state(symbols, parameters, space),
                installed.choices,
                space=space,
            )
            written(done.z, "v")
            made += 1
        except FileError as error:
            check_line(error)
            refused.append(str(error))
    assert made > 50, refused


def test_installed_numbers_come_from_its_own_pictures(tmp_path: Path) -> None:
    folder = program(tmp_path, own_text=BULB, transf_own=BULB)
    images = folder / "formula" / "img"
    images.mkdir()
    (images / "own_text.fract").write_text(settings("formula_1 500;"), encoding="utf-8")
    (images / "transf_own.fract").write_text(settings("formula_1 500;\nformula_2 1500;"), encoding="utf-8")
    (images / "broken.fract").write_text("nothing", encoding="utf-8")
    installed = Installed(folder)
    own, transform = installed.text(500), installed.text(1500)
    assert own is not None
    assert own[1].name == "own_text.cl"
    assert transform is not None
    assert transform[1].name == "transf_own.cl"
    assert installed.text(501) is None
