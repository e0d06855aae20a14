"""What stands for a number in settings files and texts: words of several lists, and a division by nothing."""

from __future__ import annotations

import numpy as np
import pytest

from clfractal.errors import FileError
from clfractal.exchange.parameters import Parameters
from clfractal.exchange.settings import parse_settings
from clfractal.exchange.symbols import Symbols, written
from tests.exchange.files import settings

LISTS = {"multi_OrderOfXYZCl_zxy": 4, "multi_OrderOfZYXCl_zxy": 1, "multi_SidesCl_left": 2}


def test_a_word_of_two_lists_is_of_the_key_s_own() -> None:
    text = settings("", "mandelbulbMulti_order_of_xyz zxy;\nother_way zxy;\nside left;")
    parameters = Parameters(parse_settings(text, "x.fract").fractal(1), LISTS)
    assert parameters.read("mandelbulbMulti_order_of_xyz") == 4
    assert parameters.read("side") == 2
    with pytest.raises(FileError, match="other_way: must be a number, got 'zxy'"):
        parameters.read("other_way")


def test_a_quotient_of_a_division_by_nothing_is_nothing() -> None:
    symbols = Symbols()
    grown = symbols.call("+", 1.0, symbols.call("/", symbols.name("n"), 0.0))
    _, (found,) = written([symbols.call("/", 1.0, grown)], "v")
    assert abs(eval(found, {"n": np.float64(3)})) < 1e-29
