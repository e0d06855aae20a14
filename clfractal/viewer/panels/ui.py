"""What panels are given to draw with."""

from __future__ import annotations

from collections.abc import Callable, Hashable
from dataclasses import dataclass, field
from typing import Any, Protocol, TypeVar, cast

import numpy as np
import numpy.typing as npt

from clfractal.engine.comfort import Comfort
from clfractal.viewer.display import Shown
from clfractal.viewer.keys import KeyMap
from clfractal.viewer.panels import theme
from clfractal.viewer.picking import Pick
from clfractal.viewer.settings import Settings
from clfractal.viewer.studio import Studio

T = TypeVar("T")

_PICTURE = 200.0
"""Points of the picture's width that are left beside the dock, or else it is put away."""


class Textures(Protocol):
    """Small pictures as textures of the window."""

    def get(self, key: Hashable, pixels: npt.NDArray[np.uint8]) -> Any:
        """The `imgui.ImTextureRef` of a picture, shape (height, width, 4), uploaded once for a key."""


@dataclass(slots=True)
class Speed:
    """What the overlay tells of the picture's speed.

    Attributes:
        frames: a second, while something moves; 0 at rest.
        way: `shared` or `copied`: how pictures get from OpenCL to OpenGL.
    """

    frames: float = 0.0
    way: str = "copied"


@dataclass(slots=True)
class Ui:
    """The window as its panels see it.

    Attributes:
        studio: the scene, and all ways to change it.
        settings: the user's, of the viewer.
        keys: the table of keys.
        textures: for thumbnails.
        act: does an action of the table of keys, by its name.
        size: of the area that panels may use, in points: the window, or one eye's half of it.
        scale: framebuffer pixels for a point, times the user's scale of panels.
        pick: what lies under the pointer; None over panels or outside the picture.
        shown: the newest picture that the window shows, if there is one.
        speed: see `Speed`.
        comfort: the range of the picture's parallax; None without two eyes, and before it is known.
        show: names of the parts that are open: `panels`, `help`, `gallery`, `variations`, `overlay`, `save`, ...
        memory: of panels, by their own keys.
    """

    studio: Studio
    settings: Settings
    keys: KeyMap
    textures: Textures
    act: Callable[[str], None]
    size: tuple[float, float] = (1280.0, 720.0)
    scale: float = 1.0
    pick: Pick | None = None
    shown: Shown | None = None
    speed: Speed = field(default_factory=Speed)
    comfort: Comfort | None = None
    show: set[str] = field(default_factory=lambda: {"panels", "overlay"})
    memory: dict[str, Any] = field(default_factory=dict)

    def with_key(self, about: str, action: str) -> str:
        """A tooltip with the key of an action behind it, if that has one."""
        hint = self.keys.hint(action)
        return f"{about} ({hint})" if hint else about

    def kept(self, key: str, make: Callable[[], T]) -> T:
        """What `memory` has under a key, made when it is asked for first."""
        if key not in self.memory:
            self.memory[key] = make()
        return cast(T, self.memory[key])

    def kept_for(self, key: str, of: Any, make: Callable[[], T]) -> T:
        """The same of what is made of something, and anew of another thing; several things are given as a tuple."""
        known = self.memory.get(key)
        if known is None or (known[0] != of if isinstance(of, tuple) else known[0] is not of):
            known = self.memory[key] = (of, make())
        return cast(T, known[1])

    @property
    def narrow(self) -> bool:
        """Whether panels leave next to nothing of the picture beside them: in a small window, or an eye's half of one."""
        return self.size[0] < theme.DOCK_LEFT + 2 * theme.MARGIN + _PICTURE
