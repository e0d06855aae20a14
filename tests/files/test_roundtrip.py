"""Edits of a YAML text: the result holds the new data, and everything that was not edited is as it was."""

from __future__ import annotations

import copy
import json
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.files.document import read_document
from clfractal.files.fragments import flow_text, number_text, same, text_scalar
from clfractal.files.roundtrip import updated, written
from clfractal.scene.load import load_scene

scalars = (
    st.none()
    | st.booleans()
    | st.integers(-(10**6), 10**6)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text(max_size=8)
    | st.sampled_from(["viridis", "x*x - y*y", "null", "1e-3", "- a", "a: b", "#", "", "yes", "0x10", "1:30"])
)
keys = st.sampled_from(["a", "b", "c", "type", "n", "a b", "1", "x: y"]) | st.text(min_size=1, max_size=4)
trees = st.recursive(
    scalars,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4),
    max_leaves=12,
)
documents = st.dictionaries(keys, trees, max_size=5)


class Writer:
    """Writes data as YAML in one of many styles, with comments where the style has room for them."""

    def __init__(self, choose: Callable[[int], int]) -> None:
        self.choose = choose
        self.comments = 0

    def comment(self) -> str:
        self.comments += 1
        return f"  # comment {self.comments}" if self.choose(3) == 0 else ""

    def scalar(self, value: Any) -> str:
        if isinstance(value, str) and self.choose(3) == 0:
            return text_scalar(value, quote="'\""[self.choose(2)])
        return flow_text(value)

    def flow(self, value: Any, indent: int) -> str:
        """In brackets; on one line, or with one entry to a line and comments."""
        if not isinstance(value, (dict, list)) or not value:
            return self.scalar(value)
        several = self.choose(3) == 0
        gap = "\n" + " " * (indent + 2) if several else ""
        parts = []
        items = list(value.items()) if isinstance(value, dict) else [(None, child) for child in value]
        for index, (key, child) in enumerate(items):
            above = f"# comment above {self.comments}{gap}" if several and self.choose(4) == 0 else ""
            name = "" if key is None else f"{text_scalar(key)}: "
            last = index + 1 == len(items)
            comma = "" if last and self.choose(2) else ","
            beside = self.comment() if several else ""
            parts.append(
                f"{gap}{above}{name}{self.flow(child, indent + 2)}{comma}{beside}" + " " * (not several)
            )
        end = "\n" + " " * (indent + 1) if several else ""
        opened, closed = "{}" if isinstance(value, dict) else "[]"
        return opened + "".join(parts) + end + closed

    def block(self, value: Any, indent: int) -> list[str]:
        lines: list[str] = []
        space = " " * indent
        for item in list(value.items()) if isinstance(value, dict) else [(None, child) for child in value]:
            key, child = item
            if self.choose(4) == 0:
                lines.append(f"{space}# comment above {len(lines)}")
            if self.choose(6) == 0:
                lines.append("")
            nested = isinstance(child, (dict, list)) and child and self.choose(2)
            if key is None and nested:
                first, *rest = [line for line in self.block(child, indent + 2) if line.strip()]
                while first.lstrip().startswith("#"):
                    first, *rest = rest
                lines += [f"{space}- {first[indent + 2 :]}", *rest]
            elif key is None:
                lines.append(f"{space}- {self.flow(child, indent)}{self.comment()}")
            elif nested:
                deeper = 0 if isinstance(child, list) and self.choose(2) else 1 + self.choose(4)
                lines += [f"{space}{text_scalar(key)}:{self.comment()}", *self.block(child, indent + deeper)]
            else:
                lines.append(f"{space}{text_scalar(key)}: {self.flow(child, indent)}{self.comment()}")
        return lines


@st.composite
def styled(draw: st.DrawFn, data: dict[str, Any]) -> str:
    writer = Writer(lambda sides: draw(st.integers(0, sides - 1)))
    if draw(st.integers(0, 5)) == 0:
        return "# head\n\n" + writer.flow(data, 0) + "\n"
    newline = draw(st.sampled_from(["\n", "\n", "\n", "\r\n"]))
    end = draw(st.sampled_from([newline, "", newline + "# the end" + newline]))
    return newline.join(["# head", "", *writer.block(data, 0)]) + end


@st.composite
def changed(draw: st.DrawFn, value: Any) -> Any:
    """Mostly the same data, with some values, keys and entries changed, added, removed or moved."""
    what = draw(st.integers(0, 9))
    if what == 0:
        return draw(trees)
    if isinstance(value, dict):
        found = {key: draw(changed(child)) for key, child in value.items() if draw(st.integers(0, 7))}
        if draw(st.integers(0, 3)) == 0:
            found = (
                {draw(keys): draw(trees), **found}
                if draw(st.booleans())
                else {**found, draw(keys): draw(trees)}
            )
        return found
    if isinstance(value, list):
        entries = [draw(changed(child)) for child in value if draw(st.integers(0, 5))]
        if draw(st.integers(0, 3)) == 0:
            entries.insert(draw(st.integers(0, len(entries))), draw(trees))
        return entries
    return draw(scalars) if what == 1 else value


@given(st.data(), documents)
@settings(max_examples=200, deadline=None)
def test_any_edit_of_any_text(data: st.DataObject, inner: dict[str, Any]) -> None:
    before = {"kept": 1, **inner, "last": {"also kept": [1, 2]}}
    text = data.draw(styled(before))
    # A comment that is kept only by edits in place, not by writing everything anew.
    text = text.replace("kept: 1", "kept: 1 ", 1)
    assert same(read_document(text).plain(), before)
    after = data.draw(changed(inner))
    after = {"kept": 1, **(after if isinstance(after, dict) else {}), "last": {"also kept": [1, 2]}}
    found = updated(text, before, after)
    assert same(read_document(found).plain(), after)
    assert found.startswith("# head")
    assert "kept: 1 " in found.replace("kept: 1,", "kept: 1 ,")
    if same(before, after):
        assert found == text
    again = updated(found, after, before)
    assert same(read_document(again).plain(), before)


@given(documents, documents)
@settings(deadline=None)
def test_json_stays_json(before: dict[str, Any], after: dict[str, Any]) -> None:
    text = flow_text({"kept": 1, **before}, json_only=True)
    assert json.loads(text) == {"kept": 1, **before}
    found = updated(text, {"kept": 1, **before}, {"kept": 1, **after})
    assert same(read_document(found).plain(), {"kept": 1, **after})
    assert json.loads(found) == {"kept": 1, **after}


@given(trees)
@settings(deadline=None)
def test_values_are_read_as_they_were_written(value: Any) -> None:
    assert same(read_document(flow_text(value)).plain(), value)
    assert same(read_document(written({"a": value})).plain(), {"a": value})


@pytest.mark.parametrize(
    ("value", "like", "text"),
    [
        (1e-5, "", "1.0e-05"),
        (1.5e-7, "3", "1.5e-07"),
        (4.0, "3", "4"),
        (4.0, "3.0", "4.0"),
        (0.1, "", "0.1"),
        (1e16, "", "1.0e+16"),
        (-0.0, "", "-0.0"),
        (7, "1.0", "7"),
    ],
)
def test_numbers_are_short_and_numbers_for_every_reader(value: float, like: str, text: str) -> None:
    import yaml

    assert number_text(value, like) == text
    assert yaml.safe_load(text) == value == read_document(text).plain()


SCENE = """\
# A scene

version: 1          # the schema's
camera: {position: [0, -3.0,   0], fov: 30}  # far away
renderer:  # how
  # as many as needed
  samples: 6    # six
  # not too noisy
  noise: 0.5    # half

lights:
  # the key light
  - {direction: [0, 0, 1], color: [1.0, 1, 1]}   # from above
  # the fill light
  - direction: [1, 0, 0]  # from the side
    shadow: false         # none
  - {intensity: 2}
palette: [
  {at: 0},  # first
  # about the second
  {at: 1},  # second
  {at: 2}   # third
]
# the end
"""


def edited(text: str, *edits: str) -> str:
    """The text after Python statements have changed its data `a`."""
    before = read_document(text).plain()
    after = copy.deepcopy(before)
    for edit in edits:
        exec(edit, {"a": after})
    found = updated(text, before, after)
    assert same(read_document(found).plain(), after)
    return found


@pytest.mark.parametrize(
    ("edits", "old", "new"),
    [
        (["a['camera']['fov'] = 35.5"], "fov: 30}", "fov: 35.5}"),
        (["a['camera']['position'][1] = -2.0"], "-3.0, ", "-2.0, "),
        (["a['camera']['up'] = [0, 1, 0]"], "fov: 30}", "fov: 30, up: [0, 1, 0]}"),
        (["del a['camera']['position']"], "{position: [0, -3.0,   0], fov: 30}", "{fov: 30}"),
        (["del a['camera']['fov']"], ", fov: 30}", "}"),
        (
            ["a['renderer'] = {'type': 'volume', **a['renderer']}"],
            "  samples: 6",
            "  type: volume\n  samples: 6",
        ),
        (["a['renderer']['seed'] = 3"], "  # half\n", "  # half\n  seed: 3\n"),
        (["del a['renderer']['noise']"], "  # not too noisy\n  noise: 0.5    # half\n", ""),
        (["del a['lights'][1]['direction']"], "direction: [1, 0, 0]  # from the side\n    shadow", "shadow"),
        (["a['lights'].append({'b': 1})"], "  - {intensity: 2}\n", "  - {intensity: 2}\n  - {b: 1}\n"),
        (["a['lights'].insert(2, {'b': 1})"], "  - {intensity: 2}\n", "  - {b: 1}\n  - {intensity: 2}\n"),
        (["del a['lights'][2]"], "  - {intensity: 2}\n", ""),
        (
            ["del a['lights'][0]"],
            "  # the key light\n  - {direction: [0, 0, 1], color: [1.0, 1, 1]}   # from above\n",
            "",
        ),
        (
            ["del a['lights'][1]"],
            "  # the fill light\n  - direction: [1, 0, 0]  # from the side\n    shadow: false         # none\n",
            "",
        ),
        (["a['palette'].append({'at': 3})"], "{at: 2}   # third\n", "{at: 2},   # third\n  {at: 3}\n"),
        (["a['palette'].insert(1, {'at': 3})"], "  {at: 1},", "  {at: 3},\n  {at: 1},"),
        (["del a['palette'][2]"], "{at: 1},  # second\n  {at: 2}   # third\n", "{at: 1}  # second\n"),
        (["del a['palette'][0]"], "  {at: 0},  # first\n", ""),
        (["a['fog'] = {'density': 0.1}"], "]\n# the", "]\nfog: {density: 0.1}\n# the"),
        (["a['version'] = 2"], "version: 1 ", "version: 2 "),
    ],
)
def test_one_edit_changes_one_place(edits: list[str], old: str, new: str) -> None:
    assert SCENE.count(old) == 1
    assert edited(SCENE, *edits) == SCENE.replace(old, new)
    windows = SCENE.replace("\n", "\r\n")
    assert edited(windows, *edits) == SCENE.replace(old, new).replace("\n", "\r\n")


def test_a_section_that_becomes_a_word_or_a_list() -> None:
    text = edited(SCENE, "a['renderer'] = None", "a['palette'] = 'viridis'")
    assert "\nrenderer: null  # how\n\nlights:" in text
    assert "\npalette: viridis\n# the end\n" in text
    entries = [{"at": i, "color": [0.125, 0.25, 0.5]} for i in range(6)]
    block = edited(text, f"a['palette'] = {entries}")
    assert "\npalette:\n  - {at: 0, color: [0.125, 0.25, 0.5]}\n" in block
    assert edited(block, "a['palette'] = 'viridis'") == text


ALIASES = "a: &x {k: 1, l: 2}  # one\nb: *x  # two\nc: *x\nd: &y [1, 2]\ne: *y\n"


def test_an_edit_does_not_leak_through_an_alias() -> None:
    assert edited(ALIASES, "a['b'] = {'k': 3, 'l': 2}") == ALIASES.replace("b: *x", "b: {k: 3, l: 2}")
    own = "{k: 1, l: 2}"
    expected = ALIASES.replace("{k: 1", "{k: 3").replace("*x", own)
    assert edited(ALIASES, "a['a'] = {'k': 3, 'l': 2}") == expected
    # What is the same as before everywhere is one thing.
    both = "a['a'] = a['c'] = {'k': 3, 'l': 2}"
    assert edited(ALIASES, both) == ALIASES.replace("{k: 1", "{k: 3").replace("b: *x", f"b: {own}")
    every = "a['a'] = a['b'] = a['c'] = {'k': 3, 'm': 5}"
    assert edited(ALIASES, every) == ALIASES.replace("{k: 1, l: 2}", "{k: 3, m: 5}")
    assert edited(ALIASES, "a['a'] = a['b'] = a['c'] = 7") == ALIASES.replace("{k: 1, l: 2}", "7")
    assert edited("a: &x 1\nb: *x\n", "a['a'] = a['b'] = 2") == "a: &x 2\nb: *x\n"
    assert edited("a: &x 1\nb: *x\n", "a['a'] = a['b'] = {'k': [1]}") == "a: &x {k: [1]}\nb: *x\n"
    long = ["a long text that needs a line of its own " + "x" * 60] * 3
    grown = edited("a: &x 1\nb: *x\n", f"a['a'] = a['b'] = {long!r}")
    assert grown.startswith("a: &x\n  - ")
    assert grown.endswith("\nb: *x\n")
    assert "e: [1, 2]" in edited(ALIASES, "del a['d']")
    assert edited(ALIASES, "del a['e']") == ALIASES.replace("e: *y\n", "")


def test_values_that_are_equal_in_another_form_are_not_touched() -> None:
    text = "a: 0.10\nb: 1.0e1  # ten\nc: [1., +2]\nd: 1\n"
    before = {"a": 0.1, "b": 10.0, "c": [1.0, 2.0], "d": 1, "e": 5}
    assert updated(text, before, {**before, "d": 2}) == text.replace("d: 1", "d: 2")
    assert updated(text, before, {**before, "e": 6}) == text + "e: 6\n"


def test_new_sections_are_written_without_defaults() -> None:
    before = {"renderer": {"type": "a", "x": 1, "y": 2}}
    after = {"renderer": {"type": "b", "x": 1, "y": 2, "z": 3}}
    # In this kind the value of `y` is no default.
    sparse = {"renderer": {"type": "b", "y": 2}}
    assert updated("renderer: {x: 1}\n", before, after, sparse) == "renderer: {type: b, x: 1, y: 2}\n"


@pytest.mark.parametrize(
    "text",
    ["# head\n? a\n: 1\n? b\n: [1, 2]\n", "--- # head\na: 1\nb: [? 1, 2]\n", "# head\na: 1\nb: [1, x: 2]\n"],
)
def test_rare_forms_are_written_anew(text: str) -> None:
    before = read_document(text).plain()
    after = {**before, "a": 5}
    assert same(read_document(updated(text, before, after)).plain(), after)


MERGING = """# head
a: &a {x: 1, y: [1, 2]}   # base
b:
  <<: *a     # as a
  z: 3
c: {<<: *a, x: 5}
d:
  <<: [*a, {w: 9, x: 0}]
"""


@pytest.mark.parametrize(
    ("change", "kept"),
    [
        (lambda data: data["b"].update(z=4), ["<<: *a     # as a\n  z: 4", "c: {<<: *a, x: 5}", "[*a, {w"]),
        (lambda data: data["b"].update(x=4), ["  x: 4\n", "<<: *a     # as a", "c: {<<: *a, x: 5}"]),
        (lambda data: data["c"].update(y=[3]), ["c: {<<: *a, x: 5, y: [3]}", "<<: *a     # as a"]),
        (lambda data: data["d"].update(w=8), ["<<: [*a, {w: 9, x: 0}]\n  w: 8"]),
        (lambda data: data["a"].update(x=7), ["a: &a {x: 7, y: [1, 2]}   # base", "b:\n  x: 1\n  z: 3"]),
        (
            lambda data: [data[key].update(y=[8]) for key in data],
            ["a: &a {x: 1, y: [8]}   # base", "  <<: *a     # as a", "c: {<<: *a, x: 5}", "<<: [*a, {w: 9"],
        ),
        (lambda data: data["b"].pop("x"), ["c: {<<: *a, x: 5}", "b:\n  y: [1, 2]\n  z: 3"]),
        (lambda data: data.pop("a"), ["# head", "b:", "z: 3"]),
    ],
)
def test_merges_stay_where_they_can(change: Callable[[Any], None], kept: list[str]) -> None:
    before = read_document(MERGING).plain()
    after = copy.deepcopy(before)
    change(after)
    text = updated(MERGING, before, after)
    assert read_document(text).plain() == after
    for part in kept:
        assert part in text, text


def test_keys_of_a_scene_that_were_merged_are_saved() -> None:
    """A light that takes over the keys of another is edited; then the other."""
    text = (
        "version: 1\nformula: {name: hast}\ncamera: {}\nlights:\n  - &key {type: point, position: [9, 0, 0]}\n"
        "  - {<<: *key, intensity: 0.5}  # fill\n"
    )
    scene = load_scene(text)
    assert [light.intensity for light in scene.lights] == [1, 0.5]
    before, after = scene.resolved(), scene.resolved()
    assert before["lights"][1]["position"] == before["lights"][0]["position"] == [9, 0, 0]
    after["lights"][1]["position"] = [0, 9, 0]
    saved = updated(text, before, after)
    assert "{<<: *key, intensity: 0.5, position: [0, 9, 0]}  # fill" in saved
    assert load_scene(saved).resolved() == after
    after["lights"][0]["intensity"] = 2
    assert load_scene(updated(text, before, after)).resolved() == after
