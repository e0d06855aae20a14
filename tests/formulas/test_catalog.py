"""The library, and formulas of one's own in files, found by name beside the scene and on CLFRACTAL_FORMULAS."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.cli.list_formulas import list_formulas, tell_formula
from clfractal.formulas import catalog
from clfractal.formulas.reference import escape
from tests.calls import failure
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
    *(("menger_tesseract", {"dimension": d, "turn": 0.3, "offset": -0.2}) for d in (2, 3)),
    ("turned_menger", {"scale": 1.8, "turn_x": 2, "center_x": 1.5}),
    *(("lambdabulb", {"power": p, "seed_x": x, "seed_y": 0.4}) for p, x in ((2, -1.5), (9, 0.5))),
    *((name, {"power": 3, "offset": 0.2}) for name in ("arrowheadbrot", "mousebrot")),
    ("quaternion_phoenix", {"memory": 0.8, "offset": 0.2}),
    ("cubic_locus", {"imaginary": 0.6}),
    ("julibrot", {"imaginary": -1.0}),
    ("henon_map", {"c_re": -1.1, "a_re": 0.9, "imaginary": 0.5}),
    *(("mandelbox_4d", {"scale": s, "turn": t, "offset": 1}) for s, t in ((-1.3, 1.5), (2, 0.5), (-3, -1))),
    *(
        ("amazing_box_mod", {"scale": s, "wall_x": 0.5, "wall_y": 2, "center_z": c})
        for s, c in ((-1.5, 0.8), (3, -1))
    ),
    *(("octahedral_box", {"scale": s, "size": z}) for s, z in ((-1.5, 2.5), (3, 0.6))),
    *(("mandalay_box", {"scale": s, "fold": f, "gap": 1}) for s, f in ((-1.5, 1.2), (1.5, 0.2))),
    ("inverted_sponge", {"radius": 1.7}),
    *(("benesi_mag_tree", {"spread": s, "offset": o}) for s, o in ((0.6, 0), (2.5, 2))),
    ("fractal_tree", {"branches": 5, "ratio": 0.78, "spread": 1.8}),
]
JULIA: list[tuple[Any, Mapping[str, float]]] = [
    ({"name": name, "julia": julia}, {})
    for name in ("mandelbulb", "hast", "mandelbox", "burning_ship", "bristorbrot")
    for julia in ([0.1, 0.2, 0.3], [0.9, -0.7, 0.4], [-1.2, 0.0, 0.0])
]
CASES: list[tuple[Any, Mapping[str, float]]] = [*((name, {}) for name in catalog.names()), *RANGES, *JULIA]


def test_the_library_holds_what_it_should() -> None:
    assert set(REQUIRED) <= set(catalog.names())
    assert len(catalog.names()) >= 62


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


@pytest.mark.parametrize(("spec", "parameters"), CASES)
def test_nothing_inside_lies_outside_the_bounds(spec: Any, parameters: Mapping[str, float]) -> None:
    chain = catalog.load_chain(spec, parameters)
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


def test_unknown_names_and_chains() -> None:
    with pytest.raises(clfractal.FormulaError, match="did you mean 'mandelbox'"):
        catalog.load("mandelbx")
    with pytest.raises(clfractal.FormulaError, match="is a chain"):
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
    told = str(failure(clfractal.FormulaError, catalog.resolve, {"file": "ball.yaml"}, tmp_path))
    assert told.startswith("ball.yaml:5:19: map.2: unknown name 'q'")
    path.write_text(BALL_FILE.replace("degree", "dgree"))
    with pytest.raises(
        clfractal.FormulaError, match=r"ball.yaml:7:1: unknown key 'dgree'; did you mean 'degree'"
    ):
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
    with pytest.raises(clfractal.FormulaError, match="cannot hold another chain"):
        catalog.resolve({"file": "self.yaml"}, tmp_path)


@pytest.mark.parametrize("name", ["../ball.yaml", "/etc/hostname", "", "a/../../b.yaml", "x\0y"])
def test_paths_out_of_reach_are_refused(name: str, tmp_path: Path) -> None:
    with pytest.raises(clfractal.FileError, match="inside the scene's folder"):
        catalog.resolve({"file": name}, tmp_path)


def test_links_out_of_the_folder_and_odd_files_are_refused(tmp_path: Path) -> None:
    folder = tmp_path / "scenes"
    folder.mkdir()
    (folder / "link.yaml").symlink_to(write(tmp_path, "ball.yaml", BALL_FILE))
    with pytest.raises(clfractal.FileError, match="leads out"):
        catalog.resolve({"file": "link.yaml"}, folder)
    for spec in ({"file": "missing.yaml"}, {"file": "."}):
        failure(clfractal.ClfractalError, catalog.resolve, spec, folder)


@pytest.mark.parametrize("name", catalog.names())
def test_a_chain_knows_a_source_that_gives_it_again(name: str) -> None:
    chain = catalog.load_chain(name)
    assert chain.source is not None
    again = catalog.resolve(chain.source)
    same: list[Any] = [
        (c.radius, c.bailout, c.distance_bailout, c.degree, c.step_scale) for c in (chain, again)
    ]
    assert same[0] == same[1]


# --- formulas of one's own, found by name ---


SCENE = "version: 1\nformula: {name: NAME, iterations: 5}\ncamera: {}\n"


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder for scenes with `formulas` in it, and `shelf`, which the variable names; the current folder is another."""
    for name in ("scenes/formulas", "shelf", "elsewhere"):
        (tmp_path / name).mkdir(parents=True)
    monkeypatch.setenv("CLFRACTAL_FORMULAS", str(tmp_path / "shelf"))
    monkeypatch.chdir(tmp_path / "elsewhere")
    return tmp_path


def ball(title: str) -> str:
    return BALL_FILE.replace("title: Ball", f"title: {title}")


def scene_of(place: Path, name: str, **keys: Any) -> Any:
    path = place / "scenes" / "scene.yaml"
    path.write_text(SCENE.replace("NAME", name))
    return clfractal.load_scene(path, **keys)


def test_a_name_is_looked_for_beside_the_scene_and_then_on_the_shelf(place: Path) -> None:
    (place / "shelf" / "round.yaml").write_text(ball("On the shelf"))
    (place / "shelf" / "only.yml").write_text(ball("Only there"))
    (place / "scenes" / "formulas" / "round.yaml").write_text(ball("Beside the scene"))
    assert scene_of(place, "round").chain.title == "Beside the scene"
    assert scene_of(place, "only").chain.title == "Only there"


def test_the_names_of_the_library_win(place: Path) -> None:
    (place / "scenes" / "formulas" / "hast.yaml").write_text(ball("Mine"))
    assert scene_of(place, "hast").chain.title == catalog.description("hast")["title"]
    assert scene_of(place, "hast").formula.name == "hast"


def test_the_scene_holds_the_formula_inline(place: Path) -> None:
    path = place / "scenes" / "formulas" / "round.yaml"
    path.write_text(BALL_FILE)
    scene = scene_of(place, "round")
    assert path in [Path(each) for each in scene.files]
    text = clfractal.dump_scene(scene)
    path.unlink()
    again = clfractal.load_scene(text)
    assert again.formula.name is None
    assert again.chain == scene.chain


def test_members_of_chains_and_files_of_formulas(place: Path) -> None:
    shelf = place / "shelf"
    (shelf / "round.yaml").write_text(BALL_FILE)
    (shelf / "part.yaml").write_text(ball("Part"))
    # A file named by a formula of one's own stands beside that formula.
    (shelf / "both.yaml").write_text("chain: [{file: part.yaml, count: 2}, {name: round}, {name: hast}]\n")
    for spec in ({"name": "both"}, {"chain": [{"name": "round", "count": 2}, {"name": "hast"}]}):
        chain = catalog.resolve(spec)
        assert chain.links[0].count == 2
        again = catalog.resolve(chain.source or {})
        assert [link.bound.formula.map for link in again.links] == [
            link.bound.formula.map for link in chain.links
        ]
    loaded = scene_of(place, "both")
    assert [link.bound.formula.title for link in loaded.chain.links][:2] == ["Part", "Ball"]
    path = place / "scenes" / "scene.yaml"
    path.write_text("version: 1\nformula: {chain: [{name: hast}, {name: round}]}\ncamera: {}\n")
    assert clfractal.load_scene(path).chain.links[1].bound.formula.title == "Ball"


def test_a_chain_of_ones_own_names_the_formulas_beside_it(
    place: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In `formulas` beside the scene as on the shelf; also for those who have no scene."""
    folder = place / "scenes" / "formulas"
    (folder / "round.yaml").write_text(BALL_FILE)
    (folder / "both.yaml").write_text("chain: [{name: round, count: 2}, {name: hast}]\n")
    assert scene_of(place, "both").chain.links[0].bound.formula.title == "Ball"
    monkeypatch.chdir(folder.parent)
    assert catalog.load_chain("both").links[0].bound.formula.title == "Ball"
    assert "round x 2" in tell_formula("both")


def test_python_and_the_list_know_them(place: Path) -> None:
    (place / "shelf" / "round.yaml").write_text(BALL_FILE)
    (place / "elsewhere" / "formulas").mkdir()
    (place / "elsewhere" / "formulas" / "oval.yaml").write_text(ball("Oval") + "extra: 1\n")
    count, inside = clfractal.escape("round", np.array([[0.5, 0, 0], [1.5, 0, 0]]), iterations=20)
    assert inside.tolist() == [True, False]
    assert count[0] == 20
    listed = list_formulas()
    assert f"in {place / 'shelf'}:\nround" in listed
    assert "unknown key 'extra'" in listed.split("in formulas:")[1]
    assert tell_formula("round").startswith("round: Ball\n\nreference: none, 2024")
    with pytest.raises(clfractal.ClfractalError, match="unknown key 'extra'"):
        tell_formula("oval")


def test_an_unknown_name_is_compared_with_all(place: Path) -> None:
    (place / "scenes" / "formulas" / "snowflake.yaml").write_text(BALL_FILE)
    for given, nearest in (("snowflak", "snowflake"), ("mandelbx", "mandelbox")):
        path = place / "scenes" / "scene.yaml"
        message = f"formula.name: unknown formula {given!r}; did you mean {nearest!r}?"
        assert str(failure(clfractal.ClfractalError, scene_of, place, given)) == f"{path}:2:17: {message}"


def test_an_error_in_one_has_its_line_and_column(place: Path) -> None:
    path = place / "shelf" / "round.yaml"
    path.write_text(BALL_FILE.replace("y*r, z*r", "y*r, z*q"))
    error = failure(clfractal.ClfractalError, scene_of, place, "round")
    assert f"{path}:5:19: " in str(error)
    assert "unknown name 'q'" in str(error)


def test_what_cannot_be_used_is_told(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "shelf" / "ball.yaml").write_text(BALL_FILE)
    (place / "scenes" / "formulas" / "link.yaml").symlink_to(place / "shelf" / "ball.yaml")
    with pytest.raises(clfractal.ClfractalError, match="leads out of the scene's folder"):
        scene_of(place, "link")
    gone = str(place / "gone")
    monkeypatch.setenv("CLFRACTAL_FORMULAS", os.pathsep.join([str(place / "shelf"), gone]))
    assert f"CLFRACTAL_FORMULAS: there is no folder {gone!r}" in str(
        failure(clfractal.ClfractalError, scene_of, place, "mandelbx")
    )
    with pytest.raises(clfractal.ClfractalError, match="there is no folder"):
        list_formulas()
    # The library needs no other folder.
    assert scene_of(place, "hast").formula.name == "hast"


def test_a_folder_that_cannot_be_read_is_named(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those who may read every file see this error only in a test."""

    def refused(path: Path) -> list[str]:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("clfractal.formulas.own.os.listdir", refused)
    error = failure(clfractal.ClfractalError, scene_of, place, "mandelbx")
    folder = place / "scenes" / "formulas"
    assert f"formula.name: {folder}: cannot be read: Permission denied; unknown" in str(error)
    assert "did you mean 'mandelbox'?" in str(error)
    assert scene_of(place, "hast").formula.name == "hast"
