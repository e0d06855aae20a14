"""What follows from sections of a scene: made anew only when one of them changes that it has read."""

from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from typing import Any, ClassVar, TypeVar, cast

T = TypeVar("T")

# Data that a scene has read or resolved, and the section that they depend on.
_SECTIONS = {
    "chain": "formula",
    "joined_chains": "objects",
    "surroundings": "environment",
    "given": "renderer",
    "grids": "objects",
    "textures": "materials",
    "light_tables": "lights",
}
TABLE = "table "
"""What the names of tables begin with, under which a scene keeps them."""


def is_table(name: str) -> bool:
    """Whether a scene keeps a table under a name."""
    return name.startswith(TABLE)


def is_data(name: str) -> bool:
    """Whether what a scene keeps under a name are data that were read, rather than what can be found again."""
    return name in _SECTIONS or is_table(name)


def section_of(name: str) -> str:
    """The section that names these data."""
    return _SECTIONS.get(name, "animation")


class Reads:
    """Stands for a scene and notes which of its sections are read; all of them by a method that it does not know.

    Attributes:
        model_fields: the scene's, for whoever asks its class.
        sections: those that have been read, by their keys.
    """

    model_fields: ClassVar[Mapping[str, Any]]

    def __init__(self, scene: Any) -> None:
        self._scene, self._present = scene, vars(scene)
        self.sections: dict[str, Any] = {}

    @property  # type: ignore[misc]
    def __class__(self) -> Any:
        """That of the scene, for whoever asks whether this is a section."""
        return type(self._scene)

    def __getattr__(self, name: str) -> Any:
        if name in self._present:
            return self.sections.setdefault(name, self._present[name])
        own = getattr(type(self._scene), name, None)
        if isinstance(own, property):
            return own.__get__(self)
        self._note(self._present)
        return getattr(self._scene, name)

    def _note(self, names: Iterable[str]) -> None:
        self.sections |= {name: self._present[name] for name in names}

    @property
    def folder(self) -> Path:
        """As of the scene, whose copies have the same one."""
        return cast(Path, self._scene.folder)

    def once(self, name: str, read: Callable[[], T]) -> T:
        """As of the scene; data depend on the section that names them."""
        self._note([section_of(name)] if is_data(name) else self._present)
        return cast(T, self._scene.once(name, read))

    def derived(self, make: Callable[[Any], T]) -> T:
        """As of the scene; it depends on what that has read."""
        found: T = self._scene.derived(make)
        self._note(self._scene.read_by(make))
        return found
