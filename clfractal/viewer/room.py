"""Panels that would leave next to nothing of the picture are put away, until there is room again."""

from __future__ import annotations

from clfractal.viewer.panels.ui import Ui


class Room:
    """Puts the panels away in a narrow window, or in a narrow half of one; who asks for them there gets them."""

    def __init__(self) -> None:
        self._narrow = False
        self._away = False

    def fit(self, ui: Ui, *, alone: bool) -> None:
        """Before the panels of a frame are drawn.

        Args:
            alone: whether the picture shall be alone whatever room there is: it fills a screen.
        """
        narrow = ui.narrow
        if "panels" in ui.show and self._away:
            self._away = False  # the user has brought them back
        if narrow and not self._narrow and "panels" in ui.show:
            ui.show.discard("panels")
            self._away = True
            hint = ui.keys.hint("panels")
            ui.studio.tell(
                f"there is no room for panels beside the picture{f'; {hint} shows them' if hint else ''}",
                holds=lambda: ui.narrow and "panels" not in ui.show,
            )
        elif not narrow and self._away and not alone:
            ui.show.add("panels")
            self._away = False
        self._narrow = narrow
