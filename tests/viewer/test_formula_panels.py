"""The formula's panel and its editor: chains, parameters, and texts that are checked as they are typed."""

from __future__ import annotations

import pytest

pytest.importorskip("imgui_bundle")

from clfractal.errors import ClfractalError, FormulaError
from clfractal.formulas import catalog
from clfractal.scene.load import load_scene
from clfractal.viewer.panels import formula, formula_editor, formula_library, scene_dock
from clfractal.viewer.panels.formula_editor import Editing
from clfractal.viewer.panels.ui import Ui
from tests.viewer.panel_harness import Stage, make_ui, opened

pytestmark = pytest.mark.usefixtures("drawing_context")


def test_every_formula_can_be_chosen_and_edited_as_text() -> None:
    for name in formula_library.titles():
        ui, _ = make_ui("scenes/mandelbulb.yaml")
        assert ui.studio.edit({"formula": {"name": name, "iterations": 12}}), name
        text = formula_editor.text_of(ui.studio.scene.formula)
        assert formula_editor.read_formula(text) == catalog.description(name)


def test_without_a_formula_panels_say_so_and_one_can_be_given() -> None:
    ui = opened("version: 1\nformula: none\ncamera: {}\nobjects: {ball: {}}")
    before = ui.studio.scene
    ui.show.add("formula_editor")
    Stage(ui, scene_dock.draw, window=False)
    Stage(ui, formula_editor.draw, window=False)
    assert ui.studio.scene is before
    assert ui.studio.problems == {}
    assert formula.summary(ui) == "None"
    # The text that is there is that of a formula which says that it has no set.
    assert typed(ui, formula_editor.text_of(before.formula)).error is None
    assert ui.studio.scene is before
    text = formula_editor.text_of(load_scene("scenes/mandelbulb.yaml").formula)
    assert typed(ui, text).error is None
    assert ui.studio.scene.has_set
    assert ui.studio.undo("scene")
    assert ui.studio.scene == before
    assert formula_library.take(ui.studio, {"name": "hast", "iterations": 12})
    assert ui.studio.scene.has_set


def test_a_chain_of_the_library_becomes_members_with_the_same_picture() -> None:
    ui, _ = make_ui("scenes/mengerbulb.yaml")
    before = ui.studio.scene.chain
    assert formula.chain_path(ui) is None
    formula._open_chain(ui)
    assert formula.chain_path(ui) == "formula.inline.chain"
    assert ui.studio.scene.chain.key == before.key
    assert ui.studio.edit({"formula.inline.chain.0.parameters.scale": 2.5})
    assert ui.studio.scene.chain.links[0].bound.values["scale"] == 2.5


def test_a_formula_becomes_a_chain_with_its_parameters() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    before = ui.studio.scene
    formula._open_chain(ui)
    link = ui.studio.scene.chain.links[0]
    assert link.bound.values == before.chain.first.values
    assert ui.studio.scene.formula.iterations == before.formula.iterations
    assert ui.studio.undo("scene")
    assert ui.studio.scene == before


_MANDELBULB = "formulas/library/mandelbulb.yaml"


@pytest.mark.parametrize(
    ("old", "new", "line", "message"),
    [
        ("degree: power", "degree: powr", "degree:", "unknown name 'powr'"),
        ("add: point", "add: pint", "add:", "pint"),
        ("title: Mandelbulb", "titel: Mandelbulb", "titel:", "unknown key"),
        ("rho: sqrt(square)", "rho: sqrt(square", "rho:", "sqrt(square"),
        ("variables: [x, y, z]", "variables: [x, y, z", None, ""),
    ],
)
def test_mistakes_in_a_formula_are_found_at_their_place(
    old: str, new: str, line: str | None, message: str
) -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    text = formula_editor.text_of(ui.studio.scene.formula)
    assert old in text
    wrong = text.replace(old, new)
    with pytest.raises(FormulaError) as caught:
        formula_editor.read_formula(wrong)
    where = caught.value.where
    assert where.line is not None
    if line is not None:
        assert wrong.splitlines()[where.line - 1].strip().startswith(line)
        assert message in str(caught.value)


def typed(ui: Ui, text: str) -> Editing:
    """The editor after a text was typed and the pause is over."""
    state: Editing = ui.memory.setdefault("formula.editor", Editing())
    formula_editor._follow(ui, state)
    state.editor.set_text(text)
    state.seen = state.editor.get_text()
    formula_editor.check(ui, state)
    return state


def test_what_is_wrong_never_reaches_the_scene() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    before = ui.studio.scene
    text = formula_editor.text_of(before.formula)
    state = typed(ui, text.replace("degree: power", "degree: powr"))
    assert state.error is not None
    assert state.editor.has_markers()
    assert ui.studio.scene is before
    state = typed(ui, text.replace("default: 8", "default: 7"))
    assert state.error is None
    assert not state.editor.has_markers()
    assert ui.studio.scene.formula.inline is not None
    assert ui.studio.undo("scene")
    assert ui.studio.scene == before


def test_an_edited_formula_keeps_values_that_still_fit() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    assert ui.studio.edit({"formula.parameters.power": 5.5, "formula.julia": [0.1, 0.2, 0.3]})
    text = formula_editor.text_of(ui.studio.scene.formula)
    typed(ui, text.replace("title: Mandelbulb", "title: Mine"))
    assert ui.studio.scene.formula.parameters["power"] == 5.5
    assert ui.studio.scene.formula.julia == (0.1, 0.2, 0.3)
    assert ui.studio.scene.chain.title == "Mine"
    typed(
        ui,
        text.replace("maximum: 16", "maximum: 5")
        if "maximum: 16" in text
        else text.replace("default: 8", "default: 2, maximum: 5"),
    )
    with pytest.raises(ClfractalError):
        formula_editor.read_formula("title: x")


def test_the_editor_checks_when_nobody_types() -> None:
    ui, _ = make_ui("scenes/mandelbulb.yaml")
    ui.show.add("formula_editor")
    stage = Stage(ui, formula_editor.draw, window=False)
    state: Editing = ui.memory["formula.editor"]
    state.editor.set_text(state.text.replace("degree: power", "degree: powr"))
    stage.frame()
    stage.frame()
    assert state.error is None
    for _ in range(30):
        stage.frame()
    assert state.error is not None
