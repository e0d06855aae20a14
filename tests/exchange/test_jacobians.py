"""Automatic Jacobians of translated formulas beside finite differences; `make jacobians` looks at all of them."""

from __future__ import annotations

from pathlib import Path
from random import Random
from typing import Any

import pytest

from benchmarks.peers.jacobians import line, looked_at, main
from benchmarks.peers.slopes import AGREED, Slopes, slopes_of
from clfractal.exchange.installed import Installed, find_installed
from clfractal.formulas import catalog
from tests.exchange.files import BULB, FOLD, STATE, program

FOUND = find_installed()


def test_own_texts(tmp_path: Path) -> None:
    installed = Installed(program(tmp_path, own_bulb=BULB, own_fold=FOLD, own_state=STATE, broken="x"))
    records = {
        path.stem: looked_at(path, number, installed, rounds=3, places=4, seed=2)
        for path, number in installed.files.items()
    }
    assert {name: record["verdict"] for name, record in records.items()} == {
        "broken": "not translated",
        "own_bulb": "agree",
        "own_fold": "agree",
        "own_state": "agree",
    }
    assert records["own_fold"]["places"] >= 12
    assert "not translated: broken.cl" in line("broken", records["broken"])


def test_a_wrong_slope_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    from clfractal.formulas import backends

    formula: dict[str, Any] = {
        "variables": ["x", "y", "z"],
        "map": ["sin(x)*y", "where(x > y, z*z, floor(3*z) + x)", "atan2(y, x) + abs(z)**1.5"],
        "bounds": {"radius": 2},
    }
    bound = catalog.resolve({"inline": formula}).first
    right, wrong = Slopes(), Slopes()
    slopes_of(bound, 0, Random(1), 20, right)
    assert right.places == 20
    assert right.largest < AGREED

    class Wrong(backends.DualBackend):
        def call(self, function: str, arguments: list[Any]) -> Any:
            found = super().call(function, arguments)
            if function != "sin" or not isinstance(found, backends.Dual):
                return found
            return backends.Dual(found.value, tuple(part * (1 + 1e-12) for part in found.partials))

    monkeypatch.setattr("benchmarks.peers.slopes.DualBackend", Wrong)
    slopes_of(bound, 0, Random(1), 20, wrong)
    assert 1e-13 < wrong.largest < 1e-11
    assert wrong.where.startswith("d x / d x")


def test_places_where_a_case_changes_are_drawn_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    """A comb that is finer than the step: no place is left, and none is said to differ."""
    monkeypatch.setattr("benchmarks.peers.slopes.STEP", "1e-2")
    formula = {"variables": ["x", "y", "z"], "map": ["abs(mod(300*x, 1))", "y", "z"], "bounds": {"radius": 2}}
    found = Slopes()
    slopes_of(catalog.resolve({"inline": formula}).first, 0, Random(1), 2, found)
    assert (found.places, found.endless) == (0, 0)
    assert found.anew > 10


@pytest.mark.skipif(FOUND is None, reason="Mandelbulber 2 is not installed")
def test_the_installed_texts() -> None:
    """Each sixth text, with its defaults and with random parameters."""
    assert FOUND is not None
    verdicts: dict[str, str] = {}
    for path, number in list(FOUND.files.items())[::6]:
        record = looked_at(path, number, FOUND, rounds=2, places=1, seed=7)
        verdicts[path.stem] = line(path.stem, record)
    assert [each for each in verdicts.values() if "agree" not in each and "not translated" not in each] == []
    assert sum("agree" in each for each in verdicts.values()) > 35


def test_the_command(capsys: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    status = main(["aexion", "--rounds", "1", "-o", str(tmp_path / "found.json")])
    told = capsys.readouterr().out
    assert status == (2 if FOUND is None else 0)
    assert ("2 agree" in told) == (FOUND is not None)
