"""The library, and formulas in files."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from clfractal.errors import ClfractalError, FileError, FormulaError
from clfractal.formulas import catalog
from clfractal.formulas.reference import escape
from tests.formulas.own_formulas import BALL_FILE

REQUIRED = [
    *("hast", "mandelbulb", "mandelbox", "quaternion_julia", "tetrabrot", "burning_ship", "menger_sponge"),
    *("sierpinski_tetrahedron", "kaleidoscopic_ifs", "bulbox", "kaliset", "amazing_surf", "amazing_box_vary"),
    *(
        "pseudo_kleinian",
        "riemann_sphere",
        "cosine_mandelbulb",
        "benesi_pine_tree",
        "aexion",
        "box_fold_bulb",
    ),
]
# Parameter values far from the defaults, at which the bounds must hold too.
RANGES: list[tuple[str, Mapping[str, float]]] = [
    *(("hast", {"power": p}) for p in (4, 8, 16)),
    *(("mandelbulb", {"power": p}) for p in (1.5, 2, 3, 5.5, 16)),
    ("mandelbulb", {"power": 3, "theta_phase": 1.0, "phi_phase": -2.0}),
    *(("mandelbox", {"scale": s}) for s in (-3, -1.5, -1.2, 1.5, 2.5)),
    ("mandelbox", {"scale": 2, "min_radius": 0.1, "fixed_radius": 2}),
    *(("twisted_box", {"scale": s, "turn_x": t}) for s in (-2, -1.4, 1.5, 2) for t in (0, 1.57)),
    *(("quaternion_julia", {"power": p, "offset": 0.3}) for p in (3, 5)),
    *(("quaternion_mandelbrot", {"power": p, "offset": 0.3}) for p in (3, 5)),
    *(("tetrabrot", {"power": p, "offset": 0.4, "tilt": 1.5}) for p in (2, 3)),
    *(("burning_ship", {"power": p}) for p in (3, 6)),
    *((n, {"scale": 2}) for n in ("menger_sponge", "sierpinski_tetrahedron", "octahedral_ifs")),
    ("vicsek_cross", {"scale": 2.4}),
    *(("kaleidoscopic_ifs", {"scale": s, "turn_before": 1.1, "offset_x": 2}) for s in (1.3, 3)),
    *(("cosine_mandelbulb", {"power": p, "z_sign": 1}) for p in (2, 5)),
    *(("amazing_surf", {"scale": s, "turn": 0.5, "cylinder": c}) for s, c in ((-1.5, 0), (2, 1))),
    *(("amazing_box_vary", {"scale": s, "vary": v}) for s, v in ((2, -0.2), (-1.7, 0.3), (-2, -0.1))),
    *(("kalibox", {"scale": s, "move_x": -2}) for s in (1.3, 3)),
    *(("riemann_sphere", {"rate": r, "offset": o}) for r, o in ((3, 1), (0.5, 0))),
    *(("aexion", {"plus": p}) for p in (-1, 0.5)),
    *(("box_fold_bulb", {"fold": f, "fixed_radius": r}) for f, r in ((2, 3), (0.3, 1))),
    ("box_fold_quaternion", {"fold": 2, "offset": 1}),
    *(("polyhedral_ifs", {"order": o, "scale": 1.5, "face": 0.7, "edge": -0.4}) for o in (3, 4, 5)),
]
CASES: list[tuple[str, Mapping[str, float]]] = [*((name, {}) for name in catalog.names()), *RANGES]


def test_the_library_holds_what_it_should() -> None:
    assert set(REQUIRED) <= set(catalog.names())
    assert len(catalog.names()) >= 32


@pytest.mark.parametrize("name", catalog.names())
def test_every_formula_tells_where_it_comes_from(name: str) -> None:
    data = catalog.description(name)
    assert len(data["title"]) > 3
    assert len(data["description"]) > 30
    assert any(character.isdigit() for character in data["reference"]), "a reference has a year"
    chain = catalog.load_chain(name)
    assert chain.title == data["title"]
    for parameter in (p for link in chain.links for p in link.bound.formula.parameters):
        assert parameter.minimum is not None or parameter.choices is not None


@pytest.mark.parametrize(("name", "parameters"), CASES)
def test_nothing_inside_lies_outside_the_bounds(name: str, parameters: Mapping[str, float]) -> None:
    chain = catalog.load_chain(name, parameters)
    rng = np.random.default_rng(6)
    direction = rng.normal(size=(6000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    distance = chain.radius * rng.uniform(1, 1.8, (6000, 1)) ** 2
    _, inside = escape(chain, chain.center + direction * distance, 40)
    assert not inside.any()


@pytest.mark.parametrize("name", ["mandelbulb", "hast", "mandelbox", "tetrabrot", "bulbox"])
def test_the_bounds_are_not_much_larger_than_the_set(name: str) -> None:
    chain = catalog.load_chain(name)
    points = np.random.default_rng(7).uniform(-1, 1, (60_000, 3)) * chain.radius
    _, inside = escape(chain, points, 10)
    assert np.linalg.norm(points[inside], axis=1).max() > 0.5 * chain.radius


@pytest.mark.parametrize("julia", [(0.1, 0.2, 0.3), (0.9, -0.7, 0.4), (-1.2, 0.0, 0.0)])
@pytest.mark.parametrize("name", ["mandelbulb", "hast", "mandelbox", "burning_ship", "bristorbrot"])
def test_the_bounds_of_julia_sets_hold_too(name: str, julia: tuple[float, ...]) -> None:
    chain = catalog.load_chain({"name": name, "julia": list(julia)})
    rng = np.random.default_rng(6)
    direction = rng.normal(size=(4000, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    points = direction * chain.radius * rng.uniform(1, 1.8, (4000, 1)) ** 2
    assert not escape(chain, points, 40)[1].any()


def test_unknown_names_and_chains() -> None:
    with pytest.raises(FormulaError, match="did you mean 'mandelbox'"):
        catalog.load("mandelbx")
    with pytest.raises(FormulaError, match="is a chain"):
        catalog.load("bulbox")
    assert catalog.is_chain("bulbox")
    assert not catalog.is_chain("hast")
    assert catalog.load("hast") is catalog.load("hast")


def write(folder: Path, name: str, text: str) -> Path:
    path = folder / name
    path.write_text(text)
    return path


def test_formulas_in_files(tmp_path: Path) -> None:
    path = write(tmp_path, "ball.yaml", BALL_FILE)
    for chain in (
        catalog.load_chain(path),
        catalog.load_chain(str(path)),
        catalog.resolve({"file": "ball.yaml"}, tmp_path),
    ):
        assert chain.first.formula.name == "ball"
        assert chain.source is not None
        assert set(chain.source) == {"inline"}
        again = catalog.resolve(chain.source)
        assert again.first.formula.map == chain.first.formula.map


def test_an_error_in_a_file_has_line_and_column(tmp_path: Path) -> None:
    path = write(tmp_path, "ball.yaml", BALL_FILE.replace("y*r, z*r", "y*r, z*q"))
    with pytest.raises(FormulaError) as caught:
        catalog.resolve({"file": "ball.yaml"}, tmp_path)
    assert str(caught.value).startswith("ball.yaml:5:19: map.2: unknown name 'q'")
    path.write_text(BALL_FILE.replace("degree", "dgree"))
    with pytest.raises(FormulaError, match=r"ball.yaml:7:1: unknown key 'dgree'; did you mean 'degree'"):
        catalog.load_chain(path)


def test_chains_in_files(tmp_path: Path) -> None:
    write(tmp_path, "ball.yaml", BALL_FILE)
    text = "chain: [{file: ball.yaml, count: 2}, {name: hast}]\nbounds: {radius: 3}\nbailout: 9\n"
    write(tmp_path, "both.yaml", text)
    chain = catalog.resolve({"file": "both.yaml"}, tmp_path)
    assert [link.count for link in chain.links] == [2, 1]
    assert (chain.radius, chain.bailout) == (3.0, 9.0)
    assert chain.source is not None
    again = catalog.resolve(chain.source)
    assert (again.radius, again.bailout, again.cycle_length) == (3.0, 9.0, 3)
    write(tmp_path, "self.yaml", "chain: [{file: self.yaml}]\n")
    with pytest.raises(FormulaError, match="cannot hold another chain"):
        catalog.resolve({"file": "self.yaml"}, tmp_path)


@pytest.mark.parametrize("name", ["../ball.yaml", "/etc/hostname", "", "a/../../b.yaml", "x\0y"])
def test_paths_out_of_reach_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(FileError, match="inside the scene's folder"):
        catalog.resolve({"file": name}, tmp_path)


def test_links_out_of_the_folder_and_odd_files_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "link.yaml").symlink_to(write(tmp_path, "ball.yaml", BALL_FILE))
    with pytest.raises(FileError, match="leads out"):
        catalog.resolve({"file": "link.yaml"}, folder)
    for spec in ({"file": "missing.yaml"}, {"file": "."}):
        with pytest.raises(ClfractalError) as caught:
            catalog.resolve(spec, folder)
        assert "\n" not in str(caught.value)


@pytest.mark.parametrize("name", catalog.names())
def test_a_chain_knows_a_source_that_gives_it_again(name: str) -> None:
    chain = catalog.load_chain(name)
    assert chain.source is not None
    again = catalog.resolve(chain.source)
    same: list[Any] = [
        (c.radius, c.bailout, c.distance_bailout, c.degree, c.step_scale) for c in (chain, again)
    ]
    assert same[0] == same[1]
