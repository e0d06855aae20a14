"""The text of a formula that was typed in the window is what is saved, comments and all, and what is shown again."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("imgui_bundle")

from clfractal.files import resources
from clfractal.files.document import read_document
from clfractal.scene.load import load_scene
from clfractal.viewer.formula_texts import FormulaTexts, formula_text_in, with_formula_text
from clfractal.viewer.panels import formula_editor
from clfractal.viewer.panels.formula_editor import Editing, read_formula, text_of
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.saving import SceneSource, open_source, save_scene, scene_text
from tests.viewer.panel_harness import make_ui

LIBRARY = resources.folder("formulas/library") / "mandelbulb.yaml"
SCENE = """# Mine
version: 1
formula: {name: mandelbulb, iterations: 6, parameters: {power: 8}}  # the bulb
camera: {position: [0, -4, 0]}  # near
"""


class Desk:
    """A scene file in a window without a picture, with the formula editor."""

    def __init__(self, path: Path, text: str) -> None:
        path.write_text(text)
        self.path = path
        self.open()

    def open(self) -> None:
        """As a new window does."""
        self.source: SceneSource = open_source(self.path)
        self.ui: Ui = make_ui(self.path)[0]
        self.ui.memory["files"] = SimpleNamespace(source=self.source)

    @property
    def shown(self) -> str:
        """The text in the editor."""
        spec = self.ui.studio.scene.formula
        return formula_editor._typed(self.ui, spec) or text_of(spec)

    def type(self, text: str) -> None:
        """The text in the editor becomes this one, and is checked."""
        state: Any = Editing(
            editor=SimpleNamespace(**dict.fromkeys(("clear_markers", "clear_squiggles"), lambda: None))
        )
        state.seen = text
        formula_editor.check(self.ui, state)
        assert state.error is None

    def save(self) -> str:
        studio = self.ui.studio
        self.source = save_scene(self.source, studio.document, self.path, texts=studio.formula_texts)
        self.ui.memory["files"].source = self.source
        assert load_scene(self.path) == studio.document
        return self.path.read_text()


def test_comments_of_an_edited_formula_are_saved_and_shown_again(tmp_path: Path) -> None:
    """The library's text with a small change: the file has its lines, and no line that nobody can read."""
    desk = Desk(tmp_path / "s.yaml", SCENE)
    text = desk.shown.replace("x*x + y*y", "x*x + y*y*1.") + "# my last word\n"
    assert "#" in text
    desk.type(text)
    saved = desk.save()
    for line in text.splitlines():
        assert line.strip() in saved
    assert max(map(len, saved.splitlines())) < 160
    for line in ("# Mine", "camera: {position: [0, -4, 0]}  # near", "  parameters: {power: 8}"):
        assert line in saved
    assert "# the bulb" in saved
    desk.open()
    assert desk.shown == text.rstrip() + "\n"
    # Other edits leave it as it is.
    desk.ui.studio.edit({"formula.iterations": 7})
    assert desk.save() == saved.replace("iterations: 6", "iterations: 7")


def test_it_is_edited_again_and_undone(tmp_path: Path) -> None:
    desk = Desk(tmp_path / "s.yaml", SCENE)
    first = LIBRARY.read_text().replace("x*x + y*y", "x*x + y*y*1.")
    desk.type(first)
    one = desk.save()
    desk.type(first.replace("y*y*1.\n", "y*y*1.  # twice\n"))  # a comment alone
    assert "y*y*1.  # twice" in desk.save()
    desk.type(first.replace("y*y*1.\n", "y*y*2.\n"))
    assert "y*y*2." in desk.save()
    desk.ui.studio.undo()
    desk.ui.studio.undo()
    assert "name: mandelbulb" in desk.save()
    desk.ui.studio.redo()
    assert read_document(desk.save()).plain() == read_document(one).plain()


@pytest.mark.parametrize(
    "section",
    [
        "formula:\n  # above\n  inline: {map: [x, y, z]}\n  iterations: 9  # many\n",
        "formula: {inline: {map: [x, y, z]}, iterations: 9}\n",
        "formula:\n  inline:\n    map: [x, y, z]\n  iterations: 9\n",
        'formula: {iterations: 9, "inline": {map: [x, y, z]}, parameters: {a: 1}} # end\n',
    ],
)
def test_it_takes_the_place_of_what_was_written_out(section: str) -> None:
    typed = "# what it is\nvariables: [x, y, z]\nmap:\n  - x*x  # first\n  - y\n  - z\n"
    before = "version: 1\n" + section + "camera: {}\n"
    found = with_formula_text(before, typed)
    wanted = read_document(before).plain()
    wanted["formula"]["inline"] = read_document(typed).plain()
    assert read_document(found).plain() == wanted
    for part in (
        "# what it is",
        "# first",
        "camera: {}",
        *(["# many", "# above"] if "above" in section else []),
    ):
        assert part in found
    assert formula_text_in(found) == (read_document(typed).plain(), typed)


def test_texts_that_hold_no_formula_stay() -> None:
    for text in ("version: 1\nformula: {name: hast}\n", "a: [", "formula: &f {inline: {map: [x]}}\n"):
        assert with_formula_text(text, "map: [y]\n") == text
        assert formula_text_in(text) is None


def test_a_text_that_would_break_the_scene_is_not_used(tmp_path: Path) -> None:
    """A mark of YAML within a mapping: then the formula is written as before."""
    desk = Desk(tmp_path / "s.yaml", SCENE)
    text = "--- # a document\n" + LIBRARY.read_text().replace("x*x + y*y", "x*x + y*y*1.")
    desk.ui.studio.edit({"formula": {"inline": read_formula(text), "iterations": 5}})
    texts = FormulaTexts()
    texts.remember(desk.ui.studio.scene.formula.inline, text)
    found = scene_text(desk.source, desk.ui.studio.document, texts)
    assert "--- #" not in found
    assert load_scene(found) == desk.ui.studio.document


def ask(name: str) -> dict[str, Any]:
    return {"name": name, "problem": "", "sure": ""}


def test_a_formula_is_saved_as_a_file_of_its_own(tmp_path: Path) -> None:
    """The scene's file names it, and a new window shows its text; a change of the formula is the scene's own again."""
    desk = Desk(tmp_path / "s.yaml", SCENE)
    text = desk.shown.replace("x*x + y*y\n", "x*x + y*y*1.  # mine\n")
    desk.type(text)
    state: Any = SimpleNamespace(text=text, source=None)
    wanted = ask("mine")
    formula_editor.save_as_file(desk.ui, state, wanted)
    assert wanted["problem"] == ""
    assert (tmp_path / "mine.yaml").read_text() == text
    saved = desk.save()
    assert "formula: {file: mine.yaml, iterations: 6, parameters: {power: 8}}  # the bulb" in saved
    desk.open()
    assert desk.shown == text
    desk.type(text.replace("*1.  # mine", "*2.  # other"))
    assert "# other" in desk.save()
    assert (tmp_path / "mine.yaml").read_text() == text


def test_files_that_are_there_and_names_that_are_none(tmp_path: Path) -> None:
    desk = Desk(tmp_path / "s.yaml", SCENE)
    (tmp_path / "taken.yaml").write_text("mine\n")
    state: Any = SimpleNamespace(text=desk.shown, source=None)
    for name, told in (
        ("taken", "once more replaces it"),
        ("a.png", ".yaml"),
        (str(LIBRARY), "comes with the program"),
    ):
        wanted = ask(name)
        formula_editor.save_as_file(desk.ui, state, wanted)
        assert told in wanted["problem"]
    assert (tmp_path / "taken.yaml").read_text() == "mine\n"
    wanted = ask("taken")
    formula_editor.save_as_file(desk.ui, state, wanted)
    formula_editor.save_as_file(desk.ui, state, wanted)
    assert wanted["problem"] == ""
    assert (tmp_path / "taken.yaml").read_text() == desk.shown
