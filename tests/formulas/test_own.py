"""Formulas of one's own, found by name: in `formulas` beside the scene and in the folders of CLFRACTAL_FORMULAS."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.cli.list_formulas import list_formulas, tell_formula
from clfractal.errors import ClfractalError
from clfractal.formulas import catalog
from clfractal.scene.load import dump_scene, load_scene
from tests.formulas.own_formulas import BALL_FILE

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
    return load_scene(path, **keys)


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
    text = dump_scene(scene)
    path.unlink()
    again = load_scene(text)
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
    assert load_scene(path).chain.links[1].bound.formula.title == "Ball"


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
    with pytest.raises(ClfractalError, match="unknown key 'extra'"):
        tell_formula("oval")


def test_an_unknown_name_is_compared_with_all(place: Path) -> None:
    (place / "scenes" / "formulas" / "snowflake.yaml").write_text(BALL_FILE)
    for given, nearest in (("snowflak", "snowflake"), ("mandelbx", "mandelbox")):
        with pytest.raises(ClfractalError) as caught:
            scene_of(place, given)
        path = place / "scenes" / "scene.yaml"
        message = f"formula.name: unknown formula {given!r}; did you mean {nearest!r}?"
        assert str(caught.value) == f"{path}:2:17: {message}"


def test_an_error_in_one_has_its_line_and_column(place: Path) -> None:
    path = place / "shelf" / "round.yaml"
    path.write_text(BALL_FILE.replace("y*r, z*r", "y*r, z*q"))
    with pytest.raises(ClfractalError) as caught:
        scene_of(place, "round")
    assert f"{path}:5:19: " in str(caught.value)
    assert "unknown name 'q'" in str(caught.value)


def test_what_cannot_be_used_is_told(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (place / "shelf" / "ball.yaml").write_text(BALL_FILE)
    (place / "scenes" / "formulas" / "link.yaml").symlink_to(place / "shelf" / "ball.yaml")
    with pytest.raises(ClfractalError, match="leads out of the scene's folder"):
        scene_of(place, "link")
    gone = str(place / "gone")
    monkeypatch.setenv("CLFRACTAL_FORMULAS", os.pathsep.join([str(place / "shelf"), gone]))
    with pytest.raises(ClfractalError) as caught:
        scene_of(place, "mandelbx")
    assert f"CLFRACTAL_FORMULAS: there is no folder {gone!r}" in str(caught.value)
    with pytest.raises(ClfractalError, match="there is no folder"):
        list_formulas()
    # The library needs no other folder.
    assert scene_of(place, "hast").formula.name == "hast"


def test_a_folder_that_cannot_be_read_is_named(place: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Those who may read every file see this error only in a test."""

    def refused(path: Path) -> list[str]:
        raise PermissionError(13, "Permission denied", str(path))

    monkeypatch.setattr("clfractal.formulas.own.os.listdir", refused)
    with pytest.raises(ClfractalError) as caught:
        scene_of(place, "mandelbx")
    folder = place / "scenes" / "formulas"
    assert f"formula.name: {folder}: cannot be read: Permission denied; unknown" in str(caught.value)
    assert "did you mean 'mandelbox'?" in str(caught.value)
    assert scene_of(place, "hast").formula.name == "hast"
