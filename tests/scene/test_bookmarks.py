"""Bookmarks: cameras under names, checked as the scene's own is, and without influence on the picture."""

from __future__ import annotations

import json
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import SceneError
from clfractal.scene.bookmarks import MAX_BOOKMARKS
from clfractal.scene.load import dump_scene, load_scene, schema
from clfractal.scene.parts import OrthographicCamera, PerspectiveCamera

BASE = "version: 1\nformula: {name: hast}\ncamera: {}\nbookmarks:"


def test_both_projections() -> None:
    scene = load_scene(f"{BASE}\n  front: {{fov: 20}}\n  top: {{projection: orthographic, height: 2}}\n")
    assert list(scene.bookmarks) == ["front", "top"]
    assert isinstance(scene.bookmarks["front"], PerspectiveCamera)
    assert isinstance(scene.bookmarks["top"], OrthographicCamera)
    assert load_scene(dump_scene(scene)) == scene
    assert load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {}}).bookmarks == {}


names = st.text(min_size=1, max_size=100).filter(lambda name: name.isprintable() and not name.isspace())


@given(st.dictionaries(names, st.floats(1e-6, 179.9), max_size=5))
def test_any_names(fields_of_view: dict[str, float]) -> None:
    data: dict[str, Any] = {"version": 1, "formula": {"name": "hast"}, "camera": {}}
    data["bookmarks"] = {name: {"fov": fov} for name, fov in fields_of_view.items()}
    scene = load_scene(data)
    assert {name: camera.fov for name, camera in scene.bookmarks.items()} == fields_of_view  # type: ignore[union-attr]
    assert load_scene(dump_scene(scene)) == scene
    assert load_scene(json.loads(json.dumps(scene.resolved()))) == scene


LONG = "x" * 101
MANY = "".join(f"\n  view {number}: {{}}" for number in range(MAX_BOOKMARKS + 1))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("\n  a: {fov: 400}", "5:12: bookmarks.a.fov: must be below 180, got 400"),
        ("\n  a.b: {fov: 400}", "5:14: bookmarks.a.b.fov: must be below 180, got 400"),
        ("\n  a: {fow: 4}", "5:7: bookmarks.a: unknown key 'fow'; did you mean 'fov'?"),
        (
            "\n  a: {projection: iso}",
            "5:19: bookmarks.a.projection: unknown projection 'iso'; known: orthographic, perspective",
        ),
        (
            "\n  a: {projection: orthographic, fov: 3}",
            "5:33: bookmarks.a: unknown key 'fov'; known: frame, height, orbit, position, projection, roll, shift,"
            " target, up",
        ),
        (
            "\n  a: {position: [1, 2]}",
            "5:17: bookmarks.a.position: must be a list of 3 numbers, got a list of 2",
        ),
        ("\n  a: {position: [0, 0, 0]}", "5:6: bookmarks.a.target: must differ from camera.position"),
        ("\n  a: 3", "5:6: bookmarks.a: must be a mapping, got 3"),
        (" []", "4:12: bookmarks: must be a mapping, got a list of 0"),
        (
            f"\n  ok: {{}}\n  {LONG}: {{}}",
            "6:3: bookmarks: a bookmark's name must be 1 to 100 characters long, got 101",
        ),
        ('\n  "": {}', "5:3: bookmarks: a bookmark's name must be 1 to 100 characters long, got 0"),
        ('\n  "a\\nb": {}', "5:3: bookmarks: a bookmark's name must be printable text on one line"),
        ('\n  " ": {}', "5:3: bookmarks: a bookmark's name must be printable text on one line"),
        (MANY, "5:3: bookmarks: must have at most 100 entries, got 101"),
    ],
)
def test_errors_at_their_places(text: str, message: str) -> None:
    with pytest.raises(SceneError) as error:
        load_scene(f"{BASE}{text}\n")
    assert str(error.value) == f"scene:{message}"


def test_an_option_changes_a_bookmark() -> None:
    scene = load_scene(f"{BASE} {{a: {{}}}}\n", overrides=["bookmarks.a.fov=20"])
    assert scene.bookmarks["a"].fov == 20  # type: ignore[union-attr]
    with pytest.raises(SceneError, match=r"^--set bookmarks\.a\.fov: must be below 180, got 200$"):
        load_scene(f"{BASE} {{a: {{}}}}\n", overrides=["bookmarks.a.fov=200"])


def test_the_schema_for_editors() -> None:
    found = schema()["properties"]["bookmarks"]
    assert found["default"] == {}
    assert found["maxProperties"] == MAX_BOOKMARKS
    assert found["propertyNames"] == {"minLength": 1, "maxLength": 100}
