"""Any edit of any scene that comes with the program is saved, and what was not edited stays as it was written."""

from __future__ import annotations

import copy
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from pydantic import ValidationError

from clfractal.errors import ClfractalError
from clfractal.files.fragments import same
from clfractal.scene.checks import check_parts
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of
from clfractal.viewer.saving import SceneSource, open_source, scene_text
from clfractal.viewer.sparse import without_defaults
from tests.viewer.scene_files import SCENES, with_camera


def commented(text: str) -> str:
    """A scene's text with a comment beside each line, and above each section and entry of a list."""
    lines = []
    for number, line in enumerate(text.splitlines()):
        bare = line.lstrip(" ")
        if bare and not bare.startswith("#"):
            indent = line[: len(line) - len(bare)]
            if not indent or bare.startswith("- "):
                lines.append(f"{indent}# above line {number}")
            line = f"{line}  # beside line {number}"
        lines.append(line)
    return "\n".join(lines) + "\n"


def sections(text: str) -> dict[str, list[str]]:
    """The lines of each top-level key, from the comment above it on."""
    found: dict[str, list[str]] = {}
    above: list[str] = []
    key = "head"
    for line in text.splitlines():
        if line.startswith("#"):
            above.append(line)
            continue
        if not line.startswith(" "):
            key = line.partition(":")[0]
        found.setdefault(key, []).extend([*above, line])
        above = []
    return found


def leaves(value: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    inner = value.items() if isinstance(value, dict) else enumerate(value) if isinstance(value, list) else ()
    for key, child in inner:
        yield (*path, key)
        yield from leaves(child, (*path, key))


def at(value: Any, path: tuple[Any, ...]) -> Any:
    for part in path:
        value = value[part]
    return value


CAMERA = {"position": [0.5, -4, 1], "fov": 20}
WHOLE: list[tuple[str, Any]] = [
    ("renderer", {"type": "volume", "resolution": [8, 9, 10], "transfer": {"opacity": [{"at": 0.5, "opacity": 1}]}}),
    ("renderer", {"type": "cut_plane", "plane": {"width": 3, "transform": [{"scale": 2}, {"rotate_x": 5}]}}),
    ("renderer", {"normal": "least_squares", "points": {"count": 16}, "firefly_limit": None}),
    ("camera", {"projection": "orthographic", "position": [1, 2, 3], "height": 1e-5}),
    ("camera", {"position": [1, 2, 3], "f_number": 8}),
    ("background", "transparent"),
    ("background", {"top": [1, 1, 0.5]}),
    ("coloring", {"by": "iterations", "palette": [{"at": 0, "color": [0, 0, 1]}, {"at": 1, "color": [1, 0, 0]}]}),
    ("coloring", {"palette": "magma_r"}),
    ("environment", {"name": "studio", "rays": 0}),
    ("environment", None),
    ("fog", {"density": 0.25}),
    ("fog", None),
    ("stereo", {"mode": "anaglyph", "plane": {"width": 2}}),
    ("stereo", None),
    ("lights", []),
    ("lights", [{"type": "point", "position": [90, 0, 0]}, {}]),
    ("cut_planes", [{"cut": True}]),
    ("cut_planes", []),
    ("layout", {"views": [{}, {"camera": CAMERA, "fog": {}}, {"renderer": {"type": "cut_plane"}, "lights": []}]}),
    ("layout", None),
    ("output", {"channels": ["R", "G", "B"], "precision": {"R": "float"}}),
    ("formula", {"name": "mandelbulb", "parameters": {"power": 3.5}, "live": ["power"]}),
    ("formula", {"chain": [{"name": "mandelbox"}, {"name": "mandelbulb", "count": 2}], "iterations": 8}),
    ("bookmarks", {"front": CAMERA, "from: #above": {"projection": "orthographic"}}),
]  # fmt: skip


@st.composite
def edited(draw: st.DrawFn, scene: Scene) -> Scene:
    """The scene after some edits of numbers, lists and whole sections; those that are not valid are left out."""
    for _ in range(draw(st.integers(1, 4))):
        plain = copy.deepcopy(scene.resolved())
        what = draw(st.integers(0, 3))
        if what == 0:
            key, value = draw(st.sampled_from(WHOLE))
            plain[key] = value
        elif what == 1:
            lists = [p for p in leaves(plain) if isinstance(at(plain, p), list) and p[-1] in LISTS]
            if lists:
                entries = at(plain, draw(st.sampled_from(lists)))
                change = draw(st.integers(0, 3))
                if change == 0 and entries:
                    del entries[draw(st.integers(0, len(entries) - 1))]
                elif change == 1 and entries:
                    entries.insert(draw(st.integers(0, len(entries))), copy.deepcopy(entries[0]))
                elif change == 2:
                    entries.reverse()
        else:
            numbers = [p for p in leaves(plain) if type(at(plain, p)) is float]
            path = draw(st.sampled_from(numbers))
            old = at(plain, path)
            values = [old * 1.5, old + 0.125, -old, 0.0, 1e-5, old / 3, 3.0, 1e5]
            at(plain, path[:-1])[path[-1]] = draw(st.sampled_from(values))
        try:
            found = Scene.model_validate(plain)
            check_parts(found)
            if found.animation is not None:
                movement_of(found).check(check_parts)
            scene = found
        except (ValidationError, ClfractalError):
            continue
    return scene


LISTS = ("lights", "cut_planes", "palette", "opacity", "color", "views", "channels", "transform")


@pytest.mark.parametrize("path", SCENES, ids=lambda path: str(path.stem))
@given(st.data())
@settings(max_examples=3, deadline=None, suppress_health_check=[HealthCheck.too_slow])
def test_any_edit_of_every_shipped_scene(path: Path, data: st.DataObject) -> None:
    text = commented(path.read_text())
    loaded = load_scene(text)
    source = SceneSource("scene", path, text, loaded)
    present = data.draw(edited(loaded)).placed(path.parent)
    found = scene_text(source, present)
    assert load_scene(found) == present
    before, after = loaded.resolved(), present.resolved()
    old, new = sections(text), sections(found)
    assert [key for key in new if key in old] == list(old)
    for key, lines in old.items():
        if same(before[key], after[key]) and "*" not in "".join(lines):
            assert new[key] == lines  # (An alias of what has changed elsewhere becomes a value.)
        else:
            assert new[key][0] == lines[0]  # the comment above the section
    if same(before, after):
        assert found == text
    # And back again: what came and went leaves no trace in the data.
    back = scene_text(SceneSource("scene", path, found, present), loaded.placed(path.parent))
    assert load_scene(back) == loaded


def test_a_palette_of_words_loses_a_colour(tmp_path: Path) -> None:
    """Where a word stands among the others is a part of what it means; comments stay all the same."""
    text = (
        "version: 1\nformula: {name: hast}\ncamera: {position: [0, -3, 0]}\n"
        'coloring:\n  by: trap  # how near\n  palette: ["#ffd27a", "#e8743a", "#7a3a7c", "#2a4a94"]  # warm to cold\n'
    )
    loaded = load_scene(text)
    coloring = loaded.coloring.model_copy(update={"palette": loaded.coloring.palette[1:]})
    present = loaded.model_copy(update={"coloring": coloring})
    found = scene_text(SceneSource("scene", tmp_path / "a.yaml", text, loaded), present)
    assert load_scene(found) == present
    assert "# how near" in found
    assert "# warm to cold" in found


@pytest.mark.parametrize("path", SCENES, ids=lambda path: str(path.stem))
def test_a_moved_camera_changes_one_line(path: Path) -> None:
    source = open_source(path)
    assert source.loaded is not None
    assert scene_text(source, source.loaded) == source.text
    moved = with_camera(source.loaded, position=(0.125, -4.5, 1e-5))
    old, new = source.text.splitlines(), scene_text(source, moved).splitlines()
    changed = [(a, b) for a, b in zip(old, new, strict=True) if a != b]
    assert len(changed) == 1
    assert "position: [0.125, -4.5, 1.0e-05]" in changed[0][1]


@pytest.mark.parametrize("path", SCENES, ids=lambda path: str(path.stem))
def test_data_without_defaults_load_to_the_same_scene(path: Path) -> None:
    scene = load_scene(path)
    short = without_defaults(scene)
    assert load_scene(short) == scene
    assert len(json.dumps(short)) < len(json.dumps(scene.resolved())) * 0.7


def test_words_for_the_usual_kinds_may_be_left_out() -> None:
    short = without_defaults(load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {}}))
    assert short == {"version": 1, "formula": {"name": "hast"}, "camera": {}}
