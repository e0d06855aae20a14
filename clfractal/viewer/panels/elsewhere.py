"""What a search finds that no panel shows at the moment: of other renderers, of what is off."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from typing import Literal, get_args, get_origin

from imgui_bundle import imgui

from clfractal.scene.model import Scene
from clfractal.schema.base import Section
from clfractal.viewer.panels import layout, theme
from clfractal.viewer.panels.buttons import wrapped
from clfractal.viewer.panels.metadata import metas, sections_of
from clfractal.viewer.panels.ui import Ui

_MOST = 12
_DEPTH = 7
_KINDS = ("type", "mode", "shape", "by")
# They have what other sections have.
_OTHERS = ("layout", "bookmarks", "animation")
# Names of sections, of which people know another word.
_WORDS = {
    "base.color": "albedo",
    "ior": "index of refraction",
    "fov": "field of view",
    "fog.scattering.color": "shafts of light",
}
# What sections need that are no kinds among several.
_NEEDED = {"materials": ("lighting.mode: path",)}


@dataclass(frozen=True, slots=True)
class Setting:
    """A value that a scene may have.

    Attributes:
        path: in a scene file, with `*` for names and numbers of entries.
        needed: what the scene must have for it, as `renderer.type: volume`; nothing if it always can.
        told: what it means.
    """

    path: str
    needed: tuple[str, ...]
    told: str

    @property
    def text(self) -> str:
        """What is searched in, in lower case."""
        words = [other for name, other in _WORDS.items() if self.path.endswith(name)]
        return f"{layout.label_of(self.path.rsplit('.', 1)[-1])} {self.path} {' '.join(words)}".lower()


@cache
def settings() -> tuple[Setting, ...]:
    """Every value of the schema, in its order, once for each kind of section that has it."""
    return tuple(_walk(Scene, "", (), 0))


def _walk(section: type[Section], path: str, needed: tuple[str, ...], depth: int) -> Iterator[Setting]:
    for name, meta in metas(section).items():
        inner = f"{path}.{name}" if path else name
        kinds = [] if inner in _OTHERS or depth >= _DEPTH else sections_of(section, name)
        for each in kinds:
            below = inner + ".*" * _levels(section, name)
            kind = _kind_of(each) if len(kinds) > 1 else ""
            more = (*_NEEDED.get(inner, ()), *([f"{below}.{kind}"] if kind else []))
            yield from _walk(each, below, (*needed, *more), depth + 1)
        if not kinds:
            yield Setting(inner, needed, meta.description)


def _levels(section: type[Section], name: str) -> int:
    """In how many lists or mappings a field has its sections."""
    text = str(section.model_fields[name].annotation)
    return 1 if re.search(r"tuple\[|dict\[|Mapping\[", text) else 0


def _kind_of(section: type[Section]) -> str:
    """What tells one kind of section from others: `type: volume`."""
    words = {name: section.model_fields[name].annotation for name in _KINDS if name in section.model_fields}
    kinds = (
        f"{name}: {get_args(word)[0]}"
        for name, word in words.items()
        if get_origin(word) is Literal and len(get_args(word)) == 1
    )
    return next(kinds, "")


def found(wanted: str, drawn: set[str]) -> list[Setting]:
    """The settings that have all the wanted words, but those that panels have drawn.

    Args:
        wanted: in lower case.
        drawn: paths in the scene that is shown.
    """
    shown = {_pattern(path) for path in drawn}
    words = wanted.split()
    hits = [
        each for each in settings() if all(word in each.text for word in words) and each.path not in shown
    ]
    # Those whose own name has the word come first, the shorter ones before the longer.
    hits.sort(key=lambda each: (words[-1] not in each.path.rsplit(".", 1)[-1], each.path.count(".")))
    return list({each.path: each for each in reversed(hits)}.values())[::-1]


def _pattern(path: str) -> str:
    """A path in a scene as a path of the schema."""
    parts = path.split(".")
    named = [
        "*"
        if part.isdecimal() or (place == 1 and parts[0] in ("objects", "materials", "bookmarks"))
        else part
        for place, part in enumerate(parts)
    ]
    return ".".join(named)


def draw(ui: Ui) -> None:
    """Draws what is found, below the panels, while something is searched for."""
    wanted = layout.searched(ui)
    if len(wanted) < 2:
        return
    hits = found(wanted, ui.memory.get("filter.drawn", set()))
    if not hits:
        return
    ui.memory["group"] = ""
    layout.title("Not in use at the moment")
    for each in hits[:_MOST]:
        layout.in_labels()
        wrapped(each.path)
        told = "; ".join(filter(None, [each.told.split(";")[0], ", ".join(_missing(ui, each))]))
        if told:
            layout.in_labels()
            wrapped(told, color=theme.DIM)
    if len(hits) > _MOST:
        layout.in_labels()
        imgui.text_colored(theme.vec(theme.FAINT), f"and {len(hits) - _MOST} more")


def _missing(ui: Ui, setting: Setting) -> list[str]:
    """What the scene lacks for a setting, as lines of its file."""
    pairs = [need.split(": ", 1) for need in setting.needed]
    lacks = [pair for pair in pairs if "*" in pair[0] or str(ui.studio.value(pair[0])) != pair[1]]
    return [f"needs {': '.join(pair)}" for pair in lacks]
