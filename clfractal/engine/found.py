"""A view that was found, and what can be asked of a scene and a search for views."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.errors import SceneError, Where, arguments
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.deep import LARGEST_MAGNIFICATION
from clfractal.scene.deeper import magnification_of
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer

MOST = 100
"""Most views of one call."""


@dataclass(frozen=True, slots=True)
class FoundView:
    """A view that was found.

    Attributes:
        scene: the scene with a camera of its own.
        score: 0 to 1, the higher the more there is to see.
        room: how far the camera is from the set at least, by the estimate, scene units; of deep places, how far
            the middle of what is seen is.
        remark: what it shows, in a few words.
    """

    scene: Scene
    score: float
    room: float
    remark: str


def checked(count: int, seed: int) -> tuple[int, int]:
    """Both as numbers; SceneError for what is out of range."""
    return arguments.whole("count", count, 1, MOST), arguments.whole("seed", seed, 0, 2**63 - 1)


def check_suitable(scene: Scene, *, deeper: bool = False) -> None:
    """Raises SceneError for a scene of which no views can be looked for; `deeper`: only deeper ones are."""
    if scene.layout is not None:
        raise SceneError("has views of its own; remove it to look for others", Where(path="layout"))
    if scene.deep is not None and not deeper:
        raise SceneError("shows one place of the set; remove it to look for others", Where(path="deep"))
    if not isinstance(scene.renderer, SurfaceRenderer):
        word = "cut_plane" if isinstance(scene.renderer, CutPlaneRenderer) else "volume"
        raise SceneError(f"views are found of surfaces, got a {word}", Where(path="renderer.type"))
    if scene.stereo is not None and scene.stereo.plane is not None:
        raise SceneError(
            "decides where the viewer is; remove it to look for views", Where(path="stereo.plane")
        )


def checked_magnification(scene: Scene, magnification: float) -> float:
    """It as a number; SceneError for what is out of range, or for a scene that is not shown deep."""
    least = magnification_of(scene.deep)
    wanted = arguments.number("magnification", magnification, least, LARGEST_MAGNIFICATION)
    if scene.chain.alone:
        raise SceneError("has no deep places", Where(path="formula"))
    for path, there in (("objects", scene.objects), ("cut_planes", scene.cut_planes)):
        if there:
            raise SceneError(
                "would stand in the way of deep places; remove it to look for them", Where(path=path)
            )
    return wanted
