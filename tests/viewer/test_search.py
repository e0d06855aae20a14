"""Searching among the settings: headings come along, editors too, and what other modes have is told."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("imgui_bundle")

from clfractal.viewer.panels import elsewhere, layout, scene_dock, transfer
from clfractal.viewer.panels import widgets as w
from tests.scenes import HEAD
from tests.viewer.panel_harness import Stage, make_ui

pytestmark = pytest.mark.usefixtures("drawing_context")

VOLUME = HEAD + (
    "renderer: {type: volume, resolution: 32, transfer: {opacity: [{at: 0, opacity: 0}, {at: 1, opacity: 1}]}}\n"
)


class Dock:
    """The dock with a word in its search line; what it draws."""

    def __init__(self, scene: str, word: str, monkeypatch: pytest.MonkeyPatch) -> None:
        self.ui, _ = make_ui(scene)
        self.ui.memory["filter"] = word
        self.titles: list[str] = []
        self.rows: set[str] = set()
        self.editors: list[str] = []
        plain_title, plain_row = layout.title, layout.row

        def title(text: str) -> None:
            self.titles.append(text)
            plain_title(text)

        def row(ui: Any, label: str, **options: Any) -> float | None:
            width = plain_row(ui, label, **options)
            if width is not None:
                self.rows.add(options.get("path") or label)
            return width

        monkeypatch.setattr(layout, "title", title)
        for module in (layout, w):
            monkeypatch.setattr(module, "row", row)
        for name in ("_graph", "_strip"):
            monkeypatch.setattr(transfer, name, lambda *arguments, name=name: self.editors.append(name))
        stage = Stage(self.ui, scene_dock.draw, window=False)
        self.titles.clear()
        self.editors.clear()
        stage.frame()


@pytest.mark.parametrize(
    ("word", "path", "needs"),
    [
        ("coat", "materials.*.coat.weight", "needs lighting.mode: path"),
        ("sky", "environment.sky.turbidity", ""),
        ("resolution", "renderer.resolution", "needs renderer.type: volume"),
        ("shafts", "fog.scattering.color", ""),
    ],
)
def test_what_other_modes_have_is_found(
    word: str, path: str, needs: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    dock = Dock(HEAD, word, monkeypatch)
    assert dock.titles[-1] == "Not in use at the moment"
    setting = next(
        each for each in elsewhere.found(word, dock.ui.memory["filter.drawn"]) if each.path == path
    )
    assert elsewhere._missing(dock.ui, setting) == ([needs] if needs else [])


def test_what_is_shown_is_not_told_as_missing(monkeypatch: pytest.MonkeyPatch) -> None:
    dock = Dock(VOLUME, "resolution", monkeypatch)
    assert "renderer.resolution" in dock.rows
    found = elsewhere.found("resolution", dock.ui.memory["filter.drawn"])
    assert "renderer.resolution" not in [each.path for each in found]


def test_groups_keep_their_headings(monkeypatch: pytest.MonkeyPatch) -> None:
    """A row comes with the heading that it stands below, once; a heading without rows does not come."""
    dock = Dock(HEAD, "filter", monkeypatch)
    assert {"renderer.filter", "renderer.filter_width"} <= dock.rows
    assert dock.titles.count("Samples") == 1
    assert "Iteration" not in dock.titles
    assert "renderer.seed" in Dock(HEAD, "samples", monkeypatch).rows  # all of the group that is called so


@pytest.mark.parametrize("word", ["transfer", "opacity", "transf func"])
def test_the_editor_of_the_transfer_function_is_never_hidden(
    word: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    assert "_graph" in Dock(VOLUME, word, monkeypatch).editors
    assert Dock(VOLUME, "exposure", monkeypatch).editors == []


def test_every_setting_of_the_schema_can_be_found() -> None:
    paths = {each.path for each in elsewhere.settings()}
    assert {
        "camera.fov",
        "lights.*.intensity",
        "objects.*.radius",
        "renderer.zoom.*.scale",
        "output.tone",
    } <= paths
    assert len(paths) > 300
