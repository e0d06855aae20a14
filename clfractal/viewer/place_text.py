"""A view as text, to be copied and pasted: the place that a scene shows, with all digits, and its camera."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from clfractal.errors import SceneError
from clfractal.files.document import read_document, write_document
from clfractal.scene.model import Scene
from clfractal.viewer.editing import plain, replaced

_KEYS = ("deep", "camera")


def place_text(scene: Scene) -> str:
    """The scene's `deep` and `camera` as YAML: what it leaves out has its default."""
    return write_document({"deep": plain(scene.deep), "camera": _without_defaults(scene)})


def with_place(scene: Scene, text: str) -> Scene:
    """The scene at the place that a text tells, which may be one of a whole scene; without `deep` the space itself.

    Raises:
        SceneError: the text tells no place, or one that the scene cannot show; nothing else of it counts.
    """
    found = read_document(text, "clipboard").plain()
    if not isinstance(found, Mapping) or not any(key in found for key in _KEYS):
        raise SceneError("the clipboard holds no place: deep and camera, as the window copies them")
    deep, camera = found.get("deep"), found.get("camera", plain(scene.camera))
    return replaced(scene, {"deep": deep, "camera": camera})


def _without_defaults(scene: Scene) -> dict[str, Any]:
    camera = scene.camera
    found: dict[str, Any] = plain(camera)
    fields = type(camera).model_fields
    needed = ("position", "target", "projection")
    return {
        key: value for key, value in found.items() if key in needed or value != plain(fields[key].default)
    }
