"""The YAML reader: what it reads, what it refuses, and where it says things stand."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import FileError, FormulaError, SceneError, Where
from clfractal.files.document import MAX_NODES, read_document, read_value, write_document
from clfractal.files.marks import dotted, split_path
from clfractal.files.regular import MAX_BYTES, read_bytes, read_text_file
from tests.calls import failure


def error_of(text: str) -> str:
    return str(failure(SceneError, read_document, text, "a.yaml"))


@pytest.mark.parametrize(
    ("text", "value"),
    [
        ("1e-3", 0.001),
        ("-.5", -0.5),
        ("1.", 1.0),
        ("+7", 7),
        ("010", 10),  # not octal, as in YAML 1.1
        ("1:30", "1:30"),  # not base 60
        ("yes", "yes"),
        ("true", True),
        ("~", None),
        ("'1'", "1"),
        ("[1, {a: b}]", [1, {"a": "b"}]),
        ("{1: x, true: y, null: z}", {"1": "x", "true": "y", "null": "z"}),
        ("2020-01-01", "2020-01-01"),
        ("[&x [1, 2], *x, *x]", [[1, 2], [1, 2], [1, 2]]),
        ("|\n a\n b\n", "a\nb\n"),
        ("\ufeffa: 1", {"a": 1}),
    ],
)
def test_values(text: str, value: Any) -> None:
    read = read_document(text).plain()
    assert read == value
    assert type(read) is type(value)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "a.yaml:1:1: is empty"),
        ("a: .nan", "a.yaml:1:4: a: must be a finite number, got .nan"),
        ("a:\n  - .inf", "a.yaml:2:5: a.0: must be a finite number, got .inf"),
        ("a: 1e999", "a.yaml:1:4: a: must be a finite number, got 1e999"),
        (f"a: {'9' * 41}", "a.yaml:1:4: a: a number of more than 40 characters"),
        ("a: 1\nb: 2\na: 3", "a.yaml:3:1: duplicate key 'a', first on line 1"),
        ("a: {b: 1, b: 2}", "a.yaml:1:11: a: duplicate key 'b', first on line 1"),
        ("a: !!float 3", "a.yaml:1:4: a: tags are not allowed, got 'tag:yaml.org,2002:float'"),
        ("!!python/object/apply:os.system [ls]", "a.yaml:1:1: tags are not allowed"),
        ("? [a]\n: b", "a.yaml:1:3: a key must be a word"),
        ("&x a: b", "a.yaml:1:1: an anchor on a key is not allowed"),
        ("a: &x [*x]", "a.yaml:1:8: a.0: the alias *x contains itself"),
        ("a: *x", "a.yaml:1:4: a: unknown alias *x"),
        ("a: 1\n---\nb: 2", "a.yaml:2:1: only one YAML document is allowed in a file"),
        ("a: [1, 2\nb: 3", "a.yaml:2:2: not valid YAML"),
        ("a: b: c", "a.yaml:1:5: not valid YAML"),
        ("a: {b: #ffd9a8, c: 1}\nd: 2", '; a colour needs quotes: "#ffd9a8"'),
        ("a: [#fff, #000]\n", '; a colour needs quotes: "#000"'),
        ("a: 1\nb: \x07", "a.yaml:2: holds a character that YAML does not allow"),
        ("a: '\udc80'", "a.yaml: is not UTF-8 text"),
        ("x" * (MAX_BYTES + 1), "a.yaml: is too large: at most 1,000,000 bytes"),
        ("[" * 10_000, "nested more than 100 levels deep"),
        ("{a: " * 10_000, "nested more than 100 levels deep"),
        ("- " * 10_000, "nested more than 100 levels deep"),
        ("[" + "a, " * MAX_NODES + "]", "holds more than 100,000 values"),
    ],
)
def test_refused(text: str, message: str) -> None:
    error = error_of(text)
    assert message in error
    assert "\n" not in error


def test_alias_bomb() -> None:
    """Ten levels of ten aliases: 10^10 values in 400 characters."""
    lines = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
    lines += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 11)]
    assert "aliases counted for what they repeat" in error_of("\n".join(lines))


def test_aliases_cannot_nest_beyond_the_limit() -> None:
    lines = ["a0: &a0 " + "[" * 60 + "x" + "]" * 60, "a1: " + "[" * 60 + "*a0" + "]" * 60]
    assert "nested more than 100 levels deep" in error_of("\n".join(lines))


def test_the_nearest_place_is_found_for_any_path() -> None:
    document = read_document("a:\n  - {b: 'x + y'}\nc: 3\n", "a.yaml")
    assert document.where(("a", 0, "b")) == Where("a.yaml", 2, 9, "a.0.b")
    assert document.where(("a", 0, "b"), column=3) == Where("a.yaml", 2, 12, "a.0.b")
    assert document.where(("a", "0"), key="b") == Where("a.yaml", 2, 6, "a.0")
    assert document.where(("a", 0, "missing")) == Where("a.yaml", 2, 5, "a.0.missing")
    assert document.where(()) == Where("a.yaml", 1, 1, None)


@pytest.mark.parametrize(
    ("text", "column"),
    [
        ("a: x + y", 4 + 4),
        ("a: 'x + y'", 5 + 4),
        ('a: "x + y"', 5 + 4),
        ('a: "x\\x20+ y"', 4),  # an escape moves the columns: only the text as a whole is pointed at
        ("a: |\n  x + y", 4),
    ],
)
def test_column_inside_a_text(text: str, column: int) -> None:
    assert read_document(text, "f").where(("a",), column=5).column == column


def test_locating_an_error_of_a_formula() -> None:
    document = read_document("map: ['x*x', 'y +']\nbals: 3", "f.yaml")
    located = document.locate(FormulaError("cannot be read", Where(path="map[1]", column=3)))
    assert str(located) == "f.yaml:1:17: map.1: cannot be read"
    assert isinstance(located, FormulaError)
    unknown = document.locate(FormulaError("unknown key 'bals'; did you mean 'bailout'?", Where(path="bals")))
    assert str(unknown).startswith("f.yaml:2:1: bals: unknown key")
    elsewhere = FormulaError("x", Where("other.yaml", 1, 1))
    assert document.locate(elsewhere) is elsewhere


def test_an_option_has_no_line() -> None:
    assert read_value("[1, {a: 2}]", "--set x").plain() == [1, {"a": 2}]
    with pytest.raises(SceneError, match=r"^--set x: must be a finite number, got \.nan$"):
        read_value(".nan", "--set x")


def test_paths_are_shown_on_one_line() -> None:
    assert dotted(("a", 0, "b\nc")) == "a.0.'b\\nc'"
    assert len(dotted(("k" * 1000,))) == 60
    assert split_path("a[0].b") == ("a", "0", "b")


PLAIN = st.recursive(
    st.none()
    | st.booleans()
    | st.integers(-(10**30), 10**30)
    | st.floats(allow_nan=False, allow_infinity=False)
    | st.text()
    | st.sampled_from(
        [
            "1e-3",
            ".5",
            "1.",
            "+1",
            "010",
            ".inf",
            ".NaN",
            "yes",
            "~",
            "",
            "0x10",
            "0o7",
            "0b1",
            "1:30",
            "- a",
            "#",
        ]
    ),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=8), inner, max_size=4),
    max_leaves=20,
)


@given(PLAIN)
def test_what_is_written_is_read_back(value: Any) -> None:
    assert read_document(write_document(value)).plain() == value


def test_whole_floats_are_written_short() -> None:
    assert write_document({"a": [0.0, -3.0, 0.5, 1e-7]}) == "a: [0, -3, 0.5, 1.0e-07]\n"
    assert math.copysign(1, read_document(write_document(-0.0)).plain()) == -1


def test_numbers_of_other_bases() -> None:
    """YAML 1.2.2, section 10.3.2: no sign, small letters before the digits; `010` is ten, `0b1` a word."""
    text = "[0x10, 0xfF, 0o10, 010, 0b1, -0x10, 0X10, 0o8, 0x, '0x10']"
    assert read_document(text).plain() == [16, 255, 8, 10, "0b1", "-0x10", "0X10", "0o8", "0x", "0x10"]
    with pytest.raises(SceneError, match="a number of more than 40 characters"):
        read_document("0x" + "f" * 40)


def test_only_ascii() -> None:
    value = {"title": "Gr\u00fcn \u2013 \u0144", "plain": "a"}
    text = write_document(value, only_ascii=True)
    assert text.isascii()
    assert read_document(text).plain() == value


class TestFiles:
    def test_names_that_cannot_be(self) -> None:
        for name in ("nothing.yaml", "a\0b", "x" * 5000):
            with pytest.raises(FileError, match="cannot be read"):
                read_text_file(Path(name))

    def test_size_and_encoding(self, tmp_path: Path) -> None:
        path = tmp_path / "f"
        path.write_bytes(b"a" * 11)
        assert read_bytes(path, limit=11) == b"a" * 11
        assert read_bytes(path, limit=5, prefix=3) == b"aaa"
        with pytest.raises(FileError, match="is too large: 11 bytes, at most 10"):
            read_text_file(path, limit=10)
        path.write_bytes(b"a\nb\xff")
        assert str(failure(FileError, read_text_file, path, name="shown")) == "shown:2: is not UTF-8 text"


# --- merges ---


def test_keys_are_merged_as_in_yaml_1_1() -> None:
    """The same as a library of YAML 1.1 reads, apart from words and numbers."""
    text = """
a: &a {x: 1, y: [1, 2], z: {deep: 1}}
b: &b {y: 5, w: 6}
one: {<<: *a, x: 7}
late: {x: 7, <<: *a}
several: {<<: [*b, *a], own: 1}
chained: &c {<<: *b, y: 8}
written: {<<: {x: 3}, y: 4}
"""
    found = read_document(text).plain()
    assert found == yaml.safe_load(text)
    assert list(found["one"]) == ["x", "y", "z"]
    twice = read_document(f"{text}twice: {{<<: *c}}\n").plain()["twice"]  # which that library gets wrong
    assert twice == found["chained"] == {"y": 8, "w": 6}
    assert read_document("a: {'<<': 1}").plain() == {
        "a": {"<<": 1}
    }  # a word in quotes is a key like any other


def test_an_error_in_what_was_merged_is_where_it_was_written() -> None:
    document = read_document("a: &a\n  x: 1\n  y: 2\nb:\n  <<: *a\n  z: 3\n", "s.yaml")
    assert document.where(("b", "y")).line == 3
    assert document.where(("b",), key="y").line == 3
    assert document.where(("b",), key="z").line == 6


@pytest.mark.parametrize(
    ("text", "message"),
    [
        (
            "a: {<<: 3}",
            "s:1:5: a.<<: merges mappings: its value must be one, such as *name, or a list of them",
        ),
        ("a: &a [1]\nb: {<<: *a}", "s:2:5: b.<<: merges mappings"),
        ("a: &a {<<: *a}", "contains itself"),
        ("a: &a {x: 1}\nb: {<<: *a, <<: *a}", "s:2:13: b: duplicate key '<<', first on line 2"),
        ("b: {<<: *a}", "unknown alias *a"),
    ],
)
def test_what_cannot_be_merged(text: str, message: str) -> None:
    assert message in str(failure(SceneError, read_document, text, "s"))


def test_merges_count_for_what_they_repeat() -> None:
    lines = ["a0: &a0 {" + ", ".join(f"k{i}: 1" for i in range(1000)) + "}"]
    lines += [f"a{n}: &a{n} {{x{n}: [*a{n - 1}, *a{n - 1}], <<: *a{n - 1}}}" for n in range(1, 12)]
    with pytest.raises(SceneError, match="holds more than 100,000 values"):
        read_document("\n".join(lines))
