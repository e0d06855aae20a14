"""The scenes that come with the program, as a gallery lists them; no scene is checked or loaded for this."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, TypeAlias, get_args

from clfractal.files.regular import read_text_file
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.renderer import Renderer
from clfractal.scene.volume import VolumeRenderer

Kind: TypeAlias = Literal["surface", "volume", "cut_plane", "stereo"]
KINDS: tuple[Kind, ...] = get_args(Kind)

LARGEST_GRID = 96
"""Voxels along the longest side of a volume in a small picture: a full grid would take seconds to fill."""

_COST = re.compile(r"^takes about ", re.IGNORECASE)
_SIGNS: dict[Kind, re.Pattern[str]] = {
    "volume": re.compile(r"\btype:\s*volume\b"),
    "cut_plane": re.compile(r"\btype:\s*cut_plane\b|^cut_planes:", re.MULTILINE),
    "stereo": re.compile(r"^stereo:", re.MULTILINE),
}


@dataclass(frozen=True, slots=True)
class Entry:
    """A scene file.

    Attributes:
        path: the file.
        text: all of it.
        title: its first line of comment, or its name.
        about: the other lines of the comment at its head, without the one that tells how long it takes.
        cost: that one, or empty.
        kinds: what it shows; a pair of pictures is `stereo` beside another kind.
    """

    path: Path
    text: str
    title: str
    about: str
    cost: str
    kinds: frozenset[Kind]

    def matches(self, words: str, kind: Kind | None = None) -> bool:
        """Whether every word occurs in its name or its text (case does not matter), and it is of a kind."""
        if kind is not None and kind not in self.kinds:
            return False
        searched = f"{self.path.stem} {self.text}".lower()
        return all(word in searched for word in words.lower().split())


def entry_of(path: Path, text: str) -> Entry:
    """What the gallery tells of a scene file with this text."""
    head = []
    for line in text.splitlines():
        if not line.startswith("#"):
            break
        head.append(line.lstrip("# ").rstrip())
    title = head[0].rstrip(".") if head and head[0] else path.stem.replace("_", " ").capitalize()
    cost = next((line for line in head[1:] if _COST.match(line)), "")
    about = " ".join(line for line in head[1:] if line and line != cost)
    found: set[Kind] = {kind for kind, sign in _SIGNS.items() if sign.search(text)}
    if not found & {"volume", "cut_plane"}:
        found.add("surface")
    return Entry(path, text, title, about, cost, frozenset(found))


def entries(folder: Path) -> list[Entry]:
    """The scene files of a folder, by title; a file that cannot be read is left out."""
    found = []
    for path in sorted(folder.glob("*.yaml")):
        try:
            found.append(entry_of(path, read_text_file(path)))
        except (OSError, ValueError):
            continue
    return sorted(found, key=lambda entry: (entry.title.lower(), entry.path.name))


def small_scene(path: Path) -> Scene:
    """A scene as a small picture shows it: grids that are filled have few voxels.

    Raises:
        ClfractalError: the file is wrong.
    """
    scene = load_scene(path)
    updates: dict[str, object] = {"renderer": coarse(scene.renderer)}
    if scene.layout is not None:
        views = tuple(
            view.model_copy(update={"renderer": coarse(view.renderer)}) if view.renderer is not None else view
            for view in scene.layout.views
        )
        updates["layout"] = scene.layout.model_copy(update={"views": views})
    return scene.model_copy(update=updates)


def coarse(renderer: Renderer) -> Renderer:
    """The renderer with at most `LARGEST_GRID` voxels along each side of a grid that is filled."""
    if not isinstance(renderer, VolumeRenderer) or renderer.file is not None:
        return renderer
    sides = renderer.resolution
    if isinstance(sides, int):
        return renderer.model_copy(update={"resolution": min(sides, LARGEST_GRID)})
    shrink = min(1.0, LARGEST_GRID / max(sides))
    return renderer.model_copy(update={"resolution": tuple(max(2, round(side * shrink)) for side in sides)})
