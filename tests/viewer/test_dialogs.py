"""Questions to the user: which one is open, what each answer does, and what happens when it goes wrong."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from imgui_bundle import imgui

from clfractal.errors import FileError, Where
from clfractal.files.document import read_document
from clfractal.scene.load import SceneText, load_scene
from clfractal.viewer.panels import buttons, dialogs
from clfractal.viewer.panels.ui import Ui
from tests.scenes import HEAD
from tests.viewer.panel_harness import Stage, headless, make_ui


@dataclass
class FakeFiles:
    """Takes note of what it is asked for; refuses what `refused` says."""

    suggestion: Path
    source: Any = field(default_factory=lambda: SimpleNamespace(path=None))
    offered: list[Any] = field(default_factory=list)
    refused: str = ""
    done: list[tuple[str, Any]] = field(default_factory=list)

    def _does(self, what: str, about: Any = None) -> None:
        if self.refused:
            raise FileError(self.refused, Where("file"))
        self.done.append((what, about))

    def open(self, path: Path) -> None:
        self._does("open", path)

    def save_as(self, path: Path) -> None:
        self._does("save_as", path)

    def save(self) -> None:
        self._does("save")

    def leave(self) -> None:
        self.done.append(("leave", None))

    def put_off(self) -> None:
        self.done.append(("put off", list(self.offered)))
        self.offered.clear()

    def recover(self, found: Any) -> None:
        self._does("recover", found)
        self.offered.remove(found)

    def discard(self, found: Any) -> None:
        self.done.append(("discard", found))
        self.offered.remove(found)


class Asked:
    """A stage with the dialogs, and where their buttons are."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, folder: Path) -> None:
        self.ui: Ui = make_ui(load_scene(SceneText(read_document(HEAD), folder)))[0]
        self.files = FakeFiles(folder / "scene.yaml")
        self.ui.memory["files"] = self.files
        self.places: dict[str, tuple[float, float]] = {}
        self.seen: list[str] = []
        real = buttons.button

        def button(text: str, **options: Any) -> bool:
            clicked = real(text, **options)
            low, high = imgui.get_item_rect_min(), imgui.get_item_rect_max()
            self.places[text] = ((low.x + high.x) / 2, (low.y + high.y) / 2)
            return clicked

        monkeypatch.setattr(buttons, "button", button)
        self.stage = Stage(self.ui, self._draw, window=False)

    def _draw(self, ui: Ui) -> None:
        self.places.clear()
        dialogs.draw(ui)

    def shown(self) -> set[str]:
        """The buttons that are there."""
        self.stage.frame()
        self.stage.frame()
        return set(self.places)

    def click(self, text: str) -> None:
        """Clicks a button."""
        assert text in self.shown()
        self.stage.click(*self.places[text])

    def enter(self, text: str) -> None:
        """Replaces the typed line and presses Enter."""
        self.shown()
        self.stage.hold(imgui.Key.mod_ctrl, True)
        self.stage.press(imgui.Key.a)
        self.stage.hold(imgui.Key.mod_ctrl, False)
        self.stage.type(text)
        self.stage.press(imgui.Key.enter)


@pytest.fixture
def asked(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Iterator[Asked]:
    with headless():
        yield Asked(monkeypatch, tmp_path)


def unsave(ui: Ui) -> None:
    assert ui.studio.edit({"formula.iterations": 17})
    assert ui.studio.unsaved


@pytest.mark.parametrize(
    ("part", "verb", "typed", "name", "does"),
    [
        ("save", "Save", "mine.yaml", "mine.yaml", "save_as"),
        ("save", "Save", "mine", "mine.yaml", "save_as"),
        ("open", "Open", "other.yaml", "other.yaml", "open"),
    ],
)
def test_a_name_is_asked_for_and_enter_does_it(
    asked: Asked, tmp_path: Path, part: str, verb: str, typed: str, name: str, does: str
) -> None:
    assert asked.shown() == set()
    asked.ui.show.add(part)
    assert asked.shown() == {verb, "Cancel"}
    asked.click("Cancel")
    assert (asked.shown(), asked.files.done) == (set(), [])
    asked.ui.show.add(part)
    asked.enter(str(tmp_path / typed))
    assert asked.files.done == [(does, tmp_path / name)]
    assert part not in asked.ui.show


def test_a_confirmation_counts_for_that_name_alone(asked: Asked, tmp_path: Path) -> None:
    one, two = taken = [tmp_path / name for name in ("one.yaml", "two.yaml")]
    for path in taken:
        path.write_text("of somebody else")
    asked.files.suggestion = one
    for _ in range(2):  # the second time the question begins anew
        asked.ui.show.add("save")
        asked.click("Save")
        assert (asked.files.done, "save" in asked.ui.show) == ([], True)
        asked.click("Cancel")
    asked.ui.show.add("save")
    asked.enter(str(two))
    assert asked.files.done == []
    asked.click("Save")
    assert asked.files.done == [("save_as", two)]


def test_the_scene_s_own_file_needs_no_confirmation(asked: Asked, tmp_path: Path) -> None:
    own = tmp_path / "own.yaml"
    own.write_text(HEAD)
    asked.files.source = SimpleNamespace(path=own)
    asked.files.suggestion = own
    asked.ui.show.add("save")
    asked.click("Save")
    assert asked.files.done == [("save_as", own)]


@pytest.mark.parametrize(("part", "verb"), [("save", "Save"), ("open", "Open")])
def test_what_goes_wrong_is_told_and_the_question_stays(asked: Asked, part: str, verb: str) -> None:
    asked.files.refused = "is never overwritten"
    asked.ui.show.add(part)
    asked.click(verb)
    assert part in asked.ui.show
    assert "is never overwritten" in asked.ui.memory[f"dialog {part}"]["problem"]
    asked.files.refused = ""
    asked.click(verb)
    assert len(asked.files.done) == 1
    assert part not in asked.ui.show


def test_leaving_with_unsaved_changes(asked: Asked) -> None:
    unsave(asked.ui)
    asked.ui.show.add("close")
    assert asked.shown() == {"Save", "Discard", "Cancel"}
    asked.click("Cancel")
    assert asked.files.done == []
    assert "close" not in asked.ui.show
    asked.ui.show.add("close")
    asked.click("Discard")
    assert asked.files.done == [("leave", None)]


def test_saving_before_leaving(asked: Asked) -> None:
    unsave(asked.ui)
    studio, files = asked.ui.studio, asked.files

    def save() -> None:
        files.done.append(("save", None))
        studio.saved = studio.scene

    files.save = save  # type: ignore[method-assign]
    asked.ui.show.add("close")
    asked.click("Save")
    assert files.done == [("save", None), ("leave", None)]


def test_the_window_stays_if_it_cannot_be_saved(asked: Asked) -> None:
    unsave(asked.ui)
    asked.files.refused = "no space left on device"
    asked.ui.show.add("close")
    asked.click("Save")
    assert asked.files.done == []
    assert "no space left" in asked.ui.studio.messages[-1].text


def test_kept_changes_are_one_question(asked: Asked) -> None:
    """However many windows have ended: the newest copy, and the older ones beside it."""
    first, second, third = kept = [SimpleNamespace(path=None, time=float(number)) for number in (3, 2, 1)]
    asked.files.offered = list(kept)
    older = {text for text in asked.shown() if text.endswith(("##0", "##1"))}
    assert asked.shown() - older == {"Go on with them", "Discard", "Later", "Discard all"}
    assert len(older) == 2
    asked.click(next(text for text in older if text.endswith("##1")))
    assert asked.files.done == [("recover", third)]
    asked.click("Discard")
    assert asked.files.offered == [second]
    assert "Discard all" not in asked.shown()
    asked.click("Go on with them")
    assert asked.files.done[1:] == [("discard", first), ("recover", second)]
    assert asked.shown() == set()


def test_kept_changes_can_wait_or_go(asked: Asked) -> None:
    kept = [SimpleNamespace(path=None, time=float(number)) for number in (2, 1)]
    asked.files.offered = list(kept)
    asked.click("Later")
    assert asked.files.done == [("put off", kept)]
    asked.files.offered = list(kept)
    asked.click("Discard all")
    assert asked.files.done[1:] == [("discard", each) for each in kept]


def test_how_long_ago_something_was() -> None:
    told = {20: "less than a minute", 70: "1 minute", 150: "2 minutes", 7100: "118 minutes", 7300: "2 hours"}
    told |= {100_000: "28 hours", 259_200: "3 days"}
    assert {seconds: dialogs.ago(seconds) for seconds in told} == {
        seconds: f"{words} ago" for seconds, words in told.items()
    }


def test_changes_that_cannot_be_read_any_more_are_given_up(asked: Asked) -> None:
    lost = SimpleNamespace(path=Path("mine.yaml"), time=0.0)
    asked.files.offered = [lost]
    asked.files.refused = "its map is missing"
    asked.click("Go on with them")
    assert "its map is missing" in asked.ui.studio.messages[-1].text
    assert asked.files.offered == []


def test_the_first_question_is_that_of_leaving(asked: Asked) -> None:
    asked.files.offered = [SimpleNamespace(path=None, time=0.0)]
    asked.ui.show |= {"save", "open", "close"}
    assert asked.shown() == {"Save", "Discard", "Cancel"}
