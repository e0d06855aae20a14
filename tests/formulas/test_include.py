"""Formula files that have the functions of others."""

from __future__ import annotations

from pathlib import Path

import pytest

from clfractal.errors import ClfractalError
from clfractal.formulas import catalog
from clfractal.formulas.reference import escape
from clfractal.scene.load import load_scene
from tests.formulas.grown import ball, chain_of

FOLDS = """\
functions:
  box(p, l): 2*clamp(p, -l, l) - p
"""
PARTS = """\
include: [folds.yaml]
functions:
  twice(p): box(box(p, 1), scale)
"""
INCLUDING = """\
include: [parts]
variables: {v: 3}
parameters: {scale: 0.7}
map: 1.7*twice(v)
bounds: {radius: 3}
"""


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A folder with a formula that includes one of the folder's own by name, which includes a file beside it."""
    (tmp_path / "formulas").mkdir()
    (tmp_path / "formulas" / "folds.yaml").write_text(FOLDS)
    (tmp_path / "formulas" / "parts.yaml").write_text(PARTS)
    (tmp_path / "mine.yaml").write_text(INCLUDING)
    (tmp_path / "scene.yaml").write_text("version: 1\nformula: {file: mine.yaml}\ncamera: {}\n")
    return tmp_path


def test_a_file_has_the_functions_of_those_that_it_includes(
    desk: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    written = {
        "variables": {"v": 3},
        "parameters": {"scale": 0.7},
        "functions": {"box(p, l)": "2*clamp(p, -l, l) - p"},
        "map": "1.7*box(box(v, 1), scale)",
        "bounds": {"radius": 3},
    }
    expected = escape(chain_of(written), ball(2.0), 9)[0]
    monkeypatch.chdir(desk)
    scene = load_scene(desk / "scene.yaml")
    for chain in (scene.chain, catalog.load_chain("mine.yaml"), catalog.load_chain(Path("mine.yaml"))):
        assert (escape(chain, ball(2.0), 9)[0] == expected).all()
    # A scene that is kept has all of it, and needs no file.
    kept = load_scene({"version": 1, "formula": scene.formula.mapping(), "camera": {}})
    assert "include" not in str(scene.formula.mapping())
    assert (escape(kept.chain, ball(2.0), 9)[0] == expected).all()
    inline = load_scene(
        "version: 1\nformula:\n  inline:\n    " + INCLUDING.replace("\n", "\n    ") + "\ncamera: {}\n"
    )
    assert (escape(inline.chain, ball(2.0), 9)[0] == expected).all()


INCLUDE_MISTAKES = [
    ("include: [prts]", "did you mean 'parts'?"),
    ("include: [missing.yaml]", "missing.yaml"),
    ("include: ../folds.yaml", "must be a list of up to 16 names"),
    ("include: [../folds.yaml]", "must be a path inside the scene's folder"),
    ("include: [hast]", "'hast' has no `functions`"),
    ("include: [mine.yaml]", "files include each other more than 4 deep"),
]


@pytest.mark.parametrize(("line", "message"), INCLUDE_MISTAKES)
def test_what_cannot_be_included_is_told(desk: Path, line: str, message: str) -> None:
    (desk / "mine.yaml").write_text(INCLUDING.replace("include: [parts]", line))
    with pytest.raises(ClfractalError) as caught:
        load_scene(desk / "scene.yaml")
    assert message in str(caught.value)
    assert "mine.yaml" in str(caught.value)


def test_a_mistake_in_a_function_is_told_where_it_stands(desk: Path) -> None:
    (desk / "formulas" / "folds.yaml").write_text(FOLDS.replace("- p", "- q"))
    with pytest.raises(ClfractalError, match=r"folds\.yaml:2:.*unknown name 'q'"):
        load_scene(desk / "scene.yaml").chain  # noqa: B018
