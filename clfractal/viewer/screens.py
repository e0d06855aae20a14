"""The screens: one window, one over several monitors, or one for each eye with its own OpenGL context."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from typing import Any

import numpy as np

from clfractal.images.modes import BELOW
from clfractal.scene.stereo import Stereo
from clfractal.viewer import gl, window
from clfractal.viewer.cables import Cables
from clfractal.viewer.chart import mixed_chart
from clfractal.viewer.recording import Event
from clfractal.viewer.ui_renderer import UiRenderer
from clfractal.viewer.window import Monitor, Window
from clfractal.viewer.window_options import Options
from clfractal.viewer.window_picture import Surface
from clfractal.viewer.window_places import places_of


class Outputs:
    """Where the picture goes.

    Args:
        first: the window that has the keyboard; its context is current.
        on_event: given the events of other windows.
    """

    def __init__(self, first: Window, on_event: Callable[[Event], None]) -> None:
        self.first, self.on_event = first, on_event
        self.second: Window | None = None
        self.quad = gl.has_stereo()
        self.monitors: list[Monitor] = []
        self._cables = Cables()
        self._rectangle = gl.Rectangle()
        self._second_rectangle: gl.Rectangle | None = None
        self._second_ui: UiRenderer | None = None
        self._below = 0
        self._charts: dict[tuple[int, int, str], int] = {}

    def begin(self, options: Options) -> None:
        """Places the window as the command line asks.

        Raises:
            ClfractalError: there is no such monitor.
        """
        if options.monitors is not None:
            self.monitors = window.chosen_monitors(options.monitors)
            if options.windows and len(self.monitors) == 2:
                self.open_second()
            else:
                self._fill(self.first, self.monitors)
        elif options.fullscreen:
            self.full_screen()

    # Windows

    def full_screen(self) -> None:
        """Fills the monitor that holds the window, or goes back."""
        if self.second is not None:
            self.close_second()
        elif self.first.fullscreen:
            self._unfill()
        else:
            here = self.first.monitor()
            if here is not None:
                self._fill(self.first, [here])

    def span(self) -> None:
        """One borderless window over all chosen monitors (all there are, if none were chosen), or goes back."""
        wanted = self.monitors or window.monitors()
        if self.first.fullscreen:
            self._unfill()
        elif wanted:
            self._fill(self.first, wanted)

    def open_second(self) -> None:
        """A window for each of two monitors, the left eye's and the right eye's; back to one if there are two."""
        if self.second is not None:
            self.close_second()
            return
        there = self.monitors or window.monitors()
        self.second = Window(self.first.size, self.on_event, share=self.first)
        self._second_rectangle = gl.Rectangle()
        self._second_ui = UiRenderer(self.second.handle)
        window.no_wait()
        self.first.use()
        if len(there) >= 2:
            self._fill(self.first, there[:1])
            self._fill(self.second, there[1:2])
        self.second.title("right eye")
        self.first.raise_to_front()

    def close_second(self) -> None:
        """Back to one window."""
        if self.second is None:
            return
        self.second.use()
        self._second_ui = self._second_rectangle = None
        self.second.close()
        self.second = None
        self.first.use()
        self._unfill()

    def watch(self, now: float, tell: Callable[..., None]) -> None:
        """Looks once a second whether the filled monitors are there, and tells what has changed.

        Args:
            now: seconds.
            tell: the studio's.
        """
        told, returned = self._cables.look(now)
        for where, wanted in returned:
            where.fill(wanted)
        if self.second is not None:
            self.second.show(self._cables.has(self.second))
        for line in told:
            tell(line.text, wrong=line.wrong, holds=partial(self._still, line.wrong))

    def _still(self, missing: bool) -> bool:
        return missing != self._cables.complete

    def _fill(self, where: Window, wanted: Sequence[Monitor]) -> None:
        where.fill(wanted)
        self._cables.filled(where, wanted)

    def _unfill(self) -> None:
        self._cables.clear()
        self.first.unfill()

    @property
    def fills_screens(self) -> bool:
        """Whether a screen shows nothing but the picture, as a projector does."""
        return self.first.fullscreen or self.second is not None

    # Sizes

    @property
    def filling(self) -> bool:
        """Whether the picture fills screens; else it is in a window whose size the user chooses."""
        return self.first.filling or self.second is not None

    @property
    def apart(self) -> bool:
        """Whether each eye has a screen, or a buffer, of its own."""
        return self.second is not None or self.quad

    def picture_size(self, stereo: Stereo | None) -> tuple[int, int]:
        """Size of the picture that fills the screens, pixels: both eyes' beside each other, if they are apart."""
        width, height = self._room
        return (2 * width, height) if self.apart and stereo is not None else (width, height)

    def leave(self, below: float, stereo: Stereo | None) -> None:
        """Leaves so many pixels at the window's lower rim, where the picture may be smaller than the window.

        It may not where it fills a screen, where a buffer or a half of the window is one eye's.
        """
        halves = stereo is not None and stereo.mode in BELOW
        free = not (self.fills_screens or self.apart or halves)
        height = self.first.framebuffer[1]
        self._below = min(round(below), height // 2) if free else 0

    @property
    def _room(self) -> tuple[int, int]:
        """The part of the first window that its picture fills, pixels from the top left."""
        width, height = self.first.framebuffer
        return width, max(height - self._below, 1)

    def shown_stereo(self, stereo: Stereo | None) -> Stereo | None:
        """How the pair is composed for these screens."""
        if stereo is None or not self.apart:
            return stereo
        return stereo.model_copy(update={"mode": "split"})

    def panel_stereo(self, stereo: Stereo | None) -> Stereo | None:
        """How panels are placed in each window."""
        return None if self.apart else stereo

    def to_picture(self, x: float, y: float, size: tuple[int, int]) -> tuple[float, float]:
        """A place of the first window, framebuffer pixels, in the picture of a size."""
        width, height = self._room
        wide = size[0] / 2 if self.apart and size[0] >= 2 * width - 2 else size[0]
        return x * wide / max(width, 1), y * size[1] / max(height, 1)

    # Drawing

    def draw(self, surface: Surface, charted: bool, draw_ui: Callable[[UiRenderer | None], None]) -> None:
        """Draws all windows; nothing is seen before `swap`.

        Args:
            charted: whether the alignment chart is shown instead of the picture.
            draw_ui: draws the panels, by the given renderer or the first window's.
        """
        if self.second is not None:
            self.second.look()
            self._draw_half(surface, 0, charted, self._rectangle, self.first)
            draw_ui(None)
            self.second.use()
            assert self._second_rectangle is not None
            self._draw_half(surface, 1, charted, self._second_rectangle, self.second)
            draw_ui(self._second_ui)
            self.first.use()
            return
        if self.quad:
            for number, eye in enumerate(("left", "right")):
                gl.draw_to(eye)
                self._draw_half(surface, number, charted, self._rectangle, self.first)
                draw_ui(None)
            gl.draw_to(None)
            return
        gl.clear()
        width, height = self.first.framebuffer
        if charted:
            self._draw_charts(surface, width, height)
        elif surface.texture:
            height -= self._below
            wide, high = surface.size
            part, smooth = surface.part, surface.coarse and surface.smooth
            place = (0, self._below, width, height)
            # A picture is at most a pixel smaller than its window, where halves need even sizes.
            fits = 0 <= width - wide <= 1 and 0 <= height - high <= 1
            if fits:
                place = (0, self._below + height - high, wide, high)
            self._rectangle.draw(surface.texture, place, part, smooth=smooth or not fits)
        draw_ui(None)

    def _draw_half(
        self, surface: Surface, number: int, charted: bool, rectangle: gl.Rectangle, where: Window
    ) -> None:
        gl.clear()
        width, height = where.framebuffer
        if charted:
            rectangle.draw(self._chart(width, height, ("left", "right")[number]), (0, 0, width, height))
        elif surface.texture:
            pair = surface.shown is not None and surface.shown.look.stereo is not None
            part = (0.5 * number, 0.0, 0.5 * number + 0.5, 1.0) if pair else (0.0, 0.0, 1.0, 1.0)
            wide, high = surface.size[0] // (2 if pair else 1), surface.size[1]
            rectangle.draw(
                surface.texture, (0, 0, width, height), part, smooth=(wide, high) != (width, height)
            )

    def _draw_charts(self, surface: Surface, width: int, height: int) -> None:
        stereo = surface.shown.look.stereo if surface.shown is not None else None
        places = places_of(stereo, (width, height)).ui
        eyes = ("left", "right") if len(places) > 1 else (stereo.mode if stereo is not None else "left",)
        for eye, place in zip(eyes, places, strict=True):
            self._rectangle.draw(self._chart(*place[2:], eye), place)

    def _chart(self, width: int, height: int, eye: Any) -> int:
        key = (width, height, eye)
        if key not in self._charts:
            while len(self._charts) > 3:
                gl.delete_texture(self._charts.pop(next(iter(self._charts))))
            self._charts[key] = gl.new_texture(width, height)
            gl.fill_texture(self._charts[key], mixed_chart((width, height), eye))
        return self._charts[key]

    def read(self, *, picture: bool = False) -> Any:
        """What was drawn and not yet swapped, uint8 of shape (height, width, 3); of two windows side by side.

        Args:
            picture: only the part that the picture fills.
        """
        first = gl.read_pixels(*self.first.framebuffer)
        if picture:
            first = first[: self._room[1]]
        if self.second is None:
            return first
        self.second.use()
        second = gl.read_pixels(*self.second.framebuffer)
        self.first.use()
        rows = min(len(first), len(second))
        return np.concatenate([first[:rows], second[:rows]], axis=1)

    def swap(self) -> None:
        """Shows what was drawn, in all windows at once."""
        self.first.swap()
        if self.second is not None:
            self.second.swap()

    def close(self) -> None:
        """Closes all windows."""
        self.close_second()
        self.first.close()
