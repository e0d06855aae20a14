"""Presets of quality: samples and noise together. What the picture shows stays as it is."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias, get_args

from clfractal.errors import SceneError, Where, arguments, unknown_name
from clfractal.scene.model import Scene

Quality: TypeAlias = Literal["draft", "good", "final", "print"]


@dataclass(frozen=True, slots=True)
class Preset:
    """Values of a renderer's settings: `renderer.samples` and `noise`."""

    samples: int
    noise: float | None


PRESETS: Mapping[Quality, Preset] = {
    "draft": Preset(samples=1, noise=None),
    "good": Preset(samples=16, noise=0.02),
    "final": Preset(samples=128, noise=0.01),
    "print": Preset(samples=512, noise=0.004),
}


def with_quality(scene: Scene, quality: str, *, kept: Collection[str] = ()) -> Scene:
    """The scene with a preset's settings in the place of its own, also of views that have their own renderer.

    Args:
        quality: `draft`, `good`, `final` or `print`.
        kept: dotted paths of settings that stay, such as `renderer.samples`, or `renderer` for all of them; `layout` keeps
            those of its views.

    Raises:
        SceneError: there is no such preset.
    """
    if not isinstance(quality, str):
        arguments.refuse("quality", "must be a word such as good", arguments.plain(quality))
    if quality not in PRESETS:
        raise SceneError(unknown_name("quality", quality, get_args(Quality)), Where(path="quality"))
    preset = PRESETS[quality]  # type: ignore[index]
    return scene.model_copy(
        update=with_renderers(scene, lambda each, path: _preset(each, preset, path, kept))
    )


def with_renderers(scene: Scene, change: Callable[[Any, str], Any]) -> dict[str, Any]:
    """What is new in a scene if its renderer is changed, and those of views that have their own.

    Args:
        change: a renderer's settings and their dotted path to other settings.
    """
    updates: dict[str, Any] = {"renderer": change(scene.renderer, "renderer")}
    if scene.layout is not None:
        views = [
            view
            if view.renderer is None
            else view.model_copy(
                update={"renderer": change(view.renderer, f"layout.views.{number}.renderer")}
            )
            for number, view in enumerate(scene.layout.views)
        ]
        updates["layout"] = scene.layout.model_copy(update={"views": views})
    return updates


def _preset(renderer: Any, preset: Preset, path: str, kept: Collection[str]) -> Any:
    values = {"samples": preset.samples, "noise": preset.noise}
    chosen = {name: value for name, value in values.items() if not _is_kept(f"{path}.{name}", kept)}
    # (A least number of samples belongs to another number of them.)
    if "samples" in chosen and not _is_kept(f"{path}.min_samples", kept):
        chosen["min_samples"] = None
    return renderer.model_copy(update=chosen)


def _is_kept(path: str, kept: Collection[str]) -> bool:
    """Whether a setting is kept, or a section that it lies in."""
    parts = path.split(".")
    return any(".".join(parts[:count]) in kept for count in range(1, len(parts) + 1))
