"""Does the actions of the table of keys, also for buttons of panels."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

from imgui_bundle import imgui

from clfractal.device.select import choose, devices
from clfractal.viewer import timeline_view
from clfractal.viewer.flying import Key
from clfractal.viewer.panels import all_panels, keyboard
from clfractal.viewer.place_text import place_text, with_place
from clfractal.viewer.scene_operators import SceneOperators
from clfractal.viewer.workspace import Workspace

HELD: dict[str, Key] = {
    "fly_forward": "forward",
    "fly_back": "back",
    "fly_left": "left",
    "fly_right": "right",
    "fly_up": "up",
    "fly_down": "down",
    "roll_left": "roll_left",
    "roll_right": "roll_right",
}
"""Actions that go on while their key is down, as keys of flying."""

# Parts that keys open and close, by the names that panels know.
_PARTS = {
    "help": "help",
    "panels": "panels",
    "overlay": "overlay",
    "gallery": "gallery",
    "variations": "variations",
    "formula": "formula_editor",
    "lights": "lights",
    "parallax": "parallax",
    "history": "history",
}


class Operators:
    """The actions of a window, by their names.

    Attributes:
        scene: those that change the scene.
        chart_shown: whether the alignment chart is shown.
        flying: whether the pointer is hidden and turns the head.
    """

    def __init__(self, workspace: Workspace) -> None:
        self.workspace = workspace
        self.scene = SceneOperators(
            workspace.studio,
            workspace.controls,
            workspace.motion,
            workspace.aim,
            lambda: workspace.now,
        )
        self.chart_shown = False
        self.flying = False
        files = workspace.files
        self._operators: dict[str, Callable[[], object]] = {
            **self.scene.operators,
            **self._film(),
            **{name: self._switch(part) for name, part in _PARTS.items()},
            "into_panels": lambda: keyboard.enter(workspace.ui),
            "next_device": self._next_device,
            "full_screen": workspace.outputs.full_screen,
            "span_monitors": workspace.outputs.span,
            "window_per_monitor": self._second_window,
            "cancel": self.cancel,
            "quit": files.ask_to_close,
            "open": self._switch("open"),
            "save": files.save,
            "save_as": self._switch("save"),
            "reload": files.reload,
            "copy": self._copy,
            "copy_place": self._copy_place,
            "paste_place": self._paste_place,
            "screenshot": files.screenshot,
            "screenshot_panels": lambda: files.screenshot(panels=True),
            "export": files.export,
            "render_still": self._switch("stills"),
            "render_film": self._switch("films"),
            "pause": self._pause,
            "coarse": self._coarse,
            "orbit_style": self._orbit_style,
            "fly": self.fly,
            "chart": self._chart,
        }

    def do(self, name: str) -> None:
        """Does an action by its name; `device:1:0` changes the device, `open:PATH` opens a scene.

        What goes wrong becomes a message.
        """
        studio = self.workspace.studio
        studio.begin_topic(name)
        try:
            with studio.telling():
                kind, colon, rest = name.partition(":")
                if colon and kind == "device":
                    self.workspace.use_device(choose(rest))
                elif colon and kind == "open":
                    self.workspace.files.open(Path(rest))
                elif name in self._operators:
                    self._operators[name]()
        finally:
            studio.begin_topic("")

    @property
    def names(self) -> set[str]:
        """All actions that can be done."""
        return set(self._operators) | set(HELD)

    def _film(self) -> dict[str, Callable[[], None]]:
        work, player = self.workspace, self.workspace.player
        return {
            "timeline": player.open_film,
            "play": lambda: player.play(work.now),
            "play_repeat": player.switch_repeat,
            "frame_back": lambda: player.by(-1),
            "frame_forward": lambda: player.by(1),
            "key_back": lambda: player.to_key(-1),
            "key_forward": lambda: player.to_key(1),
            "film_first": lambda: player.to_end(-1),
            "film_last": lambda: player.to_end(1),
            "play_from": lambda: player.span_end(-1),
            "play_to": lambda: player.span_end(1),
            "play_all": player.span_clear,
            "set_keys": player.set_keys,
            "auto_keys": player.switch_auto_keys,
            "delete_keys": lambda: timeline_view.of(work.ui.memory).delete(work.studio),
            "record_flight": lambda: player.record(work.now),
        }

    def cancel(self) -> None:
        """Escape: closes a menu, ends what is under way, then closes what is open, then stops rendering."""
        work = self.workspace
        if all_panels.menu_is_open():
            work.ui.memory[all_panels.CLOSE_MENU] = True
        elif imgui.get_io().want_text_input:
            return  # the field gives up what was typed
        elif keyboard.inside(work.ui):
            keyboard.leave(work.ui)
        elif self.flying:
            self.fly()
        elif work.controls.cancel():
            return
        elif work.player.playing or work.player.recording:
            work.player.play(work.now)
        elif self.chart_shown:
            self.chart_shown = False
        elif work.ui.show & _CLOSED_BY_ESCAPE:
            work.ui.show -= _CLOSED_BY_ESCAPE
        elif any(not still.finished for still in work.studio.stills):
            for still in work.studio.stills:
                still.cancel()
            work.studio.tell("stills are cancelled")
        elif work.studio.films.cancel():
            work.studio.tell("films are cancelled; their frames are kept")
        else:
            work.motion.stop()
            work.studio.session.pause()
            work.studio.tell("stopped; Space goes on", holds=lambda: work.studio.session.paused)

    def fly(self) -> None:
        """Hides the pointer, which then turns the head; or shows it again."""
        self.flying = not self.flying
        self.workspace.window.hide_pointer(self.flying)
        if not self.flying:
            self.workspace.motion.stop()
            self.workspace.studio.end_gesture()

    def _switch(self, part: str) -> Callable[[], None]:
        def switch() -> None:
            self.workspace.ui.show ^= {part}

        return switch

    def _next_device(self) -> None:
        there = devices()
        now = self.workspace.studio.session.device.info
        place = next((n for n, info in enumerate(there) if info.index == now.index), -1)
        if len(there) < 2:
            self.workspace.studio.tell("there is no other device")
        else:
            self.workspace.use_device(choose(there[(place + 1) % len(there)].index))

    def _second_window(self) -> None:
        self.workspace.outputs.open_second()
        if self.workspace.outputs.second is not None and self.workspace.studio.scene.stereo is None:
            self.scene.stereo_mode(2)  # now that it is known which screen is filled

    def _copy(self) -> None:
        self.workspace.window.clipboard(self.workspace.files.text())
        self.workspace.studio.tell("the scene is in the clipboard")

    def _copy_place(self) -> None:
        self.workspace.window.clipboard(place_text(self.workspace.studio.scene))
        self.workspace.studio.tell("the place is in the clipboard")

    def _paste_place(self) -> None:
        studio, text = self.workspace.studio, self.workspace.window.from_clipboard()
        found = with_place(studio.scene, text)
        self.workspace.motion.stop()
        studio.set_view(found.camera, found.deep)

    def _pause(self) -> None:
        session, paused = self.workspace.studio.session, not self.workspace.studio.session.paused
        session.pause(paused)
        self.workspace.studio.tell(
            "paused" if paused else "gathering samples", holds=lambda: session.paused == paused
        )

    def _coarse(self) -> None:
        coarse = not self.workspace.settings.coarse
        self.workspace.set_settings(replace(self.workspace.settings, coarse=coarse))
        self.workspace.studio.tell(f"moving pictures {'may be' if coarse else 'are never'} coarse")

    def _orbit_style(self) -> None:
        free = self.workspace.settings.orbit == "free"
        self.workspace.set_settings(replace(self.workspace.settings, orbit="turntable" if free else "free"))
        self.workspace.studio.tell(f"orbit: {self.workspace.settings.orbit}")

    def _chart(self) -> None:
        self.chart_shown = not self.chart_shown


_CLOSED_BY_ESCAPE = {
    "close",
    "help",
    "gallery",
    "variations",
    "save",
    "open",
    "stills",
    "films",
    "history",
    "formula_editor",
}
