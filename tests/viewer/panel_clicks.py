"""Where panels draw their buttons and cards, so that tests can click on them by name."""

from __future__ import annotations

from typing import Any

import pytest
from imgui_bundle import imgui

from clfractal.viewer.panels import cards
from clfractal.viewer.panels import widgets as w
from tests.viewer.panel_harness import Stage


class Seen:
    """The places of what was drawn last, points: text or name of a button, or name of a card, to its corner.

    Attributes:
        enabled: which of the buttons can be clicked.
    """

    def __init__(self, monkeypatch: pytest.MonkeyPatch) -> None:
        self.places: dict[str, tuple[float, float]] = {}
        self.enabled: dict[str, bool] = {}
        plain_button, plain_icon, plain_card = w.button, w.icon_button, cards.draw

        def button(text: str, **options: Any) -> bool:
            self._note(text, options)
            return plain_button(text, **options)

        def icon_button(icon: str, about: str, **options: Any) -> bool:
            self._note(options.get("name") or about, options)
            return plain_icon(icon, about, **options)

        def card(ui: Any, name: str, *rest: Any) -> bool:
            self._note(name, {})
            return plain_card(ui, name, *rest)

        monkeypatch.setattr(w, "button", button)
        monkeypatch.setattr(w, "icon_button", icon_button)
        monkeypatch.setattr(cards, "draw", card)

    def click(self, stage: Stage, name: str, *, double: bool = False) -> None:
        """Clicks on what has a name."""
        x, y = self.places[name]
        if double:
            stage.rest()
            stage.move(x + 9, y + 9)
            for down in (True, False, True, False):
                stage.button(down)
            stage.frame()
        else:
            stage.click(x + 9, y + 9)

    def fresh(self, stage: Stage) -> dict[str, tuple[float, float]]:
        """The places in a new frame."""
        self.places.clear()
        stage.frame()
        return self.places

    def _note(self, name: str, options: Any) -> None:
        corner = imgui.get_cursor_screen_pos()
        self.places[name] = (corner.x, corner.y)
        self.enabled[name] = options.get("enabled", True)
