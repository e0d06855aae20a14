"""The real screen's width: a window that the user resizes changes it, full screens never do."""

from __future__ import annotations

from clfractal.errors import ClfractalError
from clfractal.viewer.studio import Studio

_KEY = "stereo.screen_width"
# Resizing ends when the width has been the same for so long, seconds.
_REST = 0.4


class OwnScreen:
    """Looks at the window's width once in each round of the loop.

    Only a window among others is a screen whose width its user chooses. One that fills screens has to show the pair for
    the screen that the scene names, whichever size the window had before.
    """

    def __init__(self, studio: Studio) -> None:
        self.studio = studio
        self._width = 0
        # The width, and the value that belongs to it, from which a drag of the window's rim began: so that its end does not
        # depend on the way, and going back gives the same number.
        self._from: tuple[int, float] | None = None
        self._set: float | None = None
        self._changed: float | None = None

    def look(self, width: int, now: float, *, filling: bool, shown: bool) -> None:
        """Follows the window.

        Args:
            width: of the window, framebuffer pixels.
            now: seconds.
            filling: whether it fills screens. The width that it had before is what it goes back to.
            shown: whether its first picture was there: until then a window manager may give it another size.
        """
        if filling:
            return
        before, self._width = self._width, width
        if not shown or before == 0:
            return
        if width != before:
            self._follow(before, width)
            self._changed = now
        elif self._changed is not None and now - self._changed >= _REST:
            self._changed = None
            self._tell()

    def _follow(self, before: int, width: int) -> None:
        stereo = self.studio.scene.stereo
        if stereo is None:
            return
        if self._from is None or self._set != stereo.screen_width:
            self._from = (before, stereo.screen_width)
        wide = (
            self._from[1] if width == self._from[0] else float(f"{self._from[1] * width / self._from[0]:.6g}")
        )
        animation = self.studio.scene.animation
        if animation is not None and _KEY in animation.tracks:
            return
        try:
            self.studio.adjust({_KEY: wide})
        except ClfractalError:
            return  # out of its range: the value stays, and the line tells it
        self._set = wide

    def _tell(self) -> None:
        stereo = self.studio.scene.stereo
        if stereo is None:
            return
        if self._set == stereo.screen_width:
            wide = stereo.screen_width
            self.studio.tell(
                f"the window is another screen: {_KEY} is {wide:g} now",
                holds=lambda: self._changed is None and self._set == wide,
            )
        else:
            self.studio.tell(
                f"the window has another width, but {_KEY} stays {stereo.screen_width:g}", wrong=True
            )
