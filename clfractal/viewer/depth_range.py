"""How far a pair's parallax goes in the picture that is shown, and a line for the user if too far."""

from __future__ import annotations

from clfractal.engine.comfort import LIMIT_DEGREES, Comfort, comfort_of_depth
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.viewer.display import Shown

# A warning is told again only after the picture was this far on the good side.
_GOOD = 0.95 * LIMIT_DEGREES


class DepthRange:
    """Measures a picture once, in the depths that came with it.

    Attributes:
        comfort: of the newest picture that was not coarse; None without two eyes, and where nothing is seen.
    """

    def __init__(self) -> None:
        self.comfort: Comfort | None = None
        self._request = -1
        self._warned = False

    @property
    def strains(self) -> bool:
        """Whether the newest picture asks for too much."""
        return self.comfort is not None and bool(self.comfort.warning())

    def look(self, shown: Shown | None) -> str:
        """Takes a picture in; a warning if it is the first of those that ask for too much, else empty."""
        if shown is None or shown.frame.divider > 1 or shown.frame.request == self._request:
            return ""
        self._request = shown.frame.request
        self.comfort = _measured(shown)
        if self.comfort is None or self.comfort.worst_degrees <= _GOOD:
            self._warned = False
        warning = self.comfort.warning() if self.comfort is not None and not self._warned else ""
        self._warned = self._warned or bool(warning)
        return warning


def _measured(shown: Shown) -> Comfort | None:
    frame = shown.frame
    if frame.scene.stereo is None:
        return None
    found = []
    for view, depths in zip(frame.views, shown.depths, strict=True):
        if isinstance(view.scene.renderer, CutPlaneRenderer):
            found.append(Comfort(0.0, 0.0, 0.0, 0.0))  # it lies on the screen
            continue
        image, region = view.scene.image, view.plan.region
        one = comfort_of_depth(
            view.scene, view.eye, depths, (image.width, image.height), (region.x, region.y)
        )
        if one is not None:
            found.append(one)
    return Comfort.joined(found)
