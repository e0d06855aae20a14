"""Files that mean harm, and texts that mean nothing, end in one line."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from clfractal.errors import ClfractalError, FileError, FormulaError, SceneError
from clfractal.scene.load import load_scene
from clfractal.scene.stereo import Stereo

GOOD = """version: 1
formula: {name: mandelbulb, parameters: {power: 8}, iterations: 12}
image: {width: 64, height: 48}
camera: {projection: perspective, position: [0, -3, 0], target: [0, 0, 0], up: [0, 0, 1], fov: 45}
lights: [{type: directional, direction: [-1, 1, -1], shadow: true}, {type: point, position: [1, 2, 3]}]
renderer: {search: steps, step: 0.1, points: {pattern: grid, count: 9}, normal: least_squares, noise: 0.1}
background: {top: [0.1, 0.2, 0.3], bottom: [0, 0, 0]}
coloring: {by: trap, palette: [{at: 0, color: [0, 0, 0]}, {at: 1, color: [1, 1, 1]}], trap: {shape: axis}}
fog: {color: [0.5, 0.5, 0.5], density: 0.2}
stereo: {mode: rows, screen_width: 2, plane: {normal: [0, -1, 0], up: [0, 0, 1], width: 3}, separation: 0.5}
output: {exposure: 0, channels: [R, G, B, A, Z]}
"""
FORMULA = """variables: [x, y, z]
map:
  - x*x - y*y
  - 2*x*y
  - z*z
degree: 2
bounds: {radius: 2}
"""


def loads_or_one_line(source: Any, folder: Path | None = None) -> None:
    try:
        load_scene(source, folder=folder)
    except (SceneError, FormulaError, FileError) as error:
        check_line(error)


def check_line(error: ClfractalError) -> None:
    text = str(error)
    assert text.isprintable(), text
    assert len(text) < 1500
    assert error.status == 2


def scene_with(formula: str) -> str:
    return f"version: 1\nformula: {formula}\ncamera: {{}}\n"


class TestFormulaFiles:
    @pytest.fixture
    def folder(self, tmp_path: Path) -> Path:
        inside = tmp_path / "scenes"
        inside.mkdir()
        (tmp_path / "secret.yaml").write_text(FORMULA)
        return inside

    def error(self, folder: Path, file: str) -> str:
        (folder / "scene.yaml").write_text(scene_with(f"{{file: {file}}}"))
        with pytest.raises((FileError, FormulaError)) as caught:
            load_scene(folder / "scene.yaml")
        return str(caught.value).removeprefix(f"{folder}/")

    def test_a_file_beside_the_scene_is_inlined(self, folder: Path) -> None:
        (folder / "sub").mkdir()
        (folder / "sub/mine.yaml").write_text(FORMULA)
        (folder / "scene.yaml").write_text(scene_with("{file: sub/mine.yaml}"))
        scene = load_scene(folder / "scene.yaml")
        assert scene.formula.file is None
        assert scene.formula.inline is not None
        assert scene.formula.inline["degree"] == 2
        assert load_scene(scene.resolved()) == scene

    def test_a_chain_in_a_file_of_links_in_files(self, folder: Path) -> None:
        (folder / "mine.yaml").write_text(FORMULA)
        (folder / "chain.yaml").write_text("title: T\nchain: [{file: mine.yaml, count: 2}, {name: hast}]\n")
        (folder / "scene.yaml").write_text(scene_with("{file: chain.yaml}"))
        scene = load_scene(folder / "scene.yaml")
        assert [link.count for link in scene.chain.links] == [2, 1]
        assert load_scene(scene.resolved()) == scene

    def test_a_file_that_names_itself_ends(self, folder: Path) -> None:
        (folder / "a.yaml").write_text("chain: [{file: a.yaml}]\n")
        (folder / "scene.yaml").write_text(scene_with("{file: a.yaml}"))
        with pytest.raises((SceneError, FormulaError, FileError)):
            load_scene(folder / "scene.yaml")

    @pytest.mark.parametrize(
        "file", ["../secret.yaml", "a/../../secret.yaml", "/etc/passwd", '"a\\0b"', "/dev/zero", "x" * 500]
    )
    def test_paths_out_of_reach(self, folder: Path, file: str) -> None:
        assert self.error(folder, file).startswith("scene.yaml:2:17: formula.file: ")

    def test_a_link_that_leads_out(self, folder: Path) -> None:
        (folder / "link.yaml").symlink_to("../secret.yaml")
        (folder / "up").symlink_to("..")
        for file in ("link.yaml", "up/secret.yaml"):
            assert "leads out of the scene's folder" in self.error(folder, file)

    def test_what_is_no_file(self, folder: Path) -> None:
        os.mkfifo(folder / "fifo")
        (folder / "device").symlink_to("/dev/zero")
        (folder / "loop").symlink_to("loop")
        (folder / "sub").mkdir()
        assert "is not a regular file" in self.error(folder, "fifo")
        assert "leads out of the scene's folder" in self.error(folder, "device")
        assert self.error(folder, "loop").startswith("scene.yaml:2:17: formula.file: ")
        assert "is a folder" in self.error(folder, "sub")
        assert "No such file" in self.error(folder, "none.yaml")

    def test_a_huge_file(self, folder: Path) -> None:
        with (folder / "huge.yaml").open("wb") as stream:
            stream.truncate(10**12)
        assert "huge.yaml is too large" in self.error(folder, "huge.yaml")

    def test_errors_in_the_file_are_found_in_it(self, folder: Path) -> None:
        (folder / "mine.yaml").write_text(FORMULA.replace("2*x*y", "2*x*w"))
        message = self.error(folder, "mine.yaml")
        assert message.startswith("mine.yaml:4:9: map.1: unknown name 'w'")

    def test_a_file_that_is_not_yaml(self, folder: Path) -> None:
        (folder / "mine.yaml").write_text("a: [1")
        assert self.error(folder, "mine.yaml").startswith("mine.yaml:")


class TestSceneFiles:
    @pytest.mark.parametrize("name", ["", "nothing.yaml", "/dev/zero", "/", "a\0b"])
    def test_what_cannot_be_read(self, name: str) -> None:
        with pytest.raises(FileError):
            load_scene(name)

    def test_a_fifo_does_not_wait(self, tmp_path: Path) -> None:
        os.mkfifo(tmp_path / "scene.yaml")
        with pytest.raises(FileError, match="is not a regular file"):
            load_scene(tmp_path / "scene.yaml")

    @pytest.mark.parametrize(
        "content", [b"", b"\xff\xfe", b"\x00" * 100, b"\x76\x2f\x31\x01", b"\x89PNG\r\n\x1a\n", b"\x89PNG"]
    )
    def test_foreign_bytes(self, tmp_path: Path, content: bytes) -> None:
        path = tmp_path / "scene"
        path.write_bytes(content)
        with pytest.raises((FileError, SceneError)) as caught:
            load_scene(path)
        assert str(caught.value).startswith(str(path))

    def test_a_scene_of_aliases_that_explode(self) -> None:
        bomb = ["a0: &a0 [x, x, x, x, x, x, x, x, x, x]"]
        bomb += [f"a{i}: &a{i} [{', '.join([f'*a{i - 1}'] * 10)}]" for i in range(1, 10)]
        with pytest.raises(SceneError, match="aliases counted for what they repeat"):
            load_scene(GOOD + "\n".join(bomb))


@given(st.text(max_size=300))
def test_any_text(text: str) -> None:
    loads_or_one_line(text + "\n")


@given(st.integers(0, len(GOOD)), st.integers(0, 12), st.text(max_size=6))
@settings(max_examples=300)
def test_a_scene_with_a_part_replaced(start: int, length: int, text: str) -> None:
    loads_or_one_line(GOOD[:start] + text + GOOD[start + length :])


WORDS = [
    "version",
    "formula",
    "camera",
    "name",
    "mandelbulb",
    "inline",
    "chain",
    "map",
    "lights",
    "<<",
    "1",
    ".nan",
    "-1e400",
]
TOKENS = st.sampled_from(
    [*WORDS, *"[]{},-:?'", "&a ", "*a", "!!int ", " ", ": ", ", ", "- ", "\n", "\n  ", '"', "|\n", "---\n"]
)


@given(st.lists(TOKENS, max_size=60))
@settings(max_examples=300)
def test_a_soup_of_tokens(tokens: list[str]) -> None:
    loads_or_one_line("".join(tokens) + "\n")


KEYS = st.sampled_from(["type", "color", "by", "a", "position", "name", "map", "\x1b[1m"])
ANYTHING = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=8) | st.just(10**400),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=4),
    max_leaves=10,
)
SECTIONS = [
    "version",
    "formula",
    "image",
    "camera",
    "renderer",
    "lights",
    "material",
    "coloring",
    "background",
    "environment",
    "fog",
    "cut_planes",
    "layout",
    "stereo",
    "output",
    "bookmarks",
]


@given(st.dictionaries(st.sampled_from(SECTIONS), ANYTHING), st.booleans())
@settings(max_examples=300)
def test_any_data_in_any_section(data: dict[str, Any], complete: bool) -> None:
    base = {"version": 1, "formula": {"name": "hast"}, "camera": {}} if complete else {}
    loads_or_one_line({**base, **data})


INLINE: dict[str, Any] = {
    "variables": ["x", "y", "z"],
    "map": ["x*x", "y", "z"],
    "degree": 2,
    "bounds": {"radius": 2},
}


FORMULA_KEYS = [
    *INLINE,
    "let",
    "repeat",
    "parameters",
    "julia",
    "slice",
    "shape",
    "add",
    "derivative",
    "alone",
    "chain",
]


@given(st.dictionaries(st.sampled_from([*Stereo.model_fields, "mod"]), ANYTHING | st.floats(1e-9, 1e9)))
@settings(max_examples=200)
def test_any_data_in_stereo(data: dict[str, Any]) -> None:
    loads_or_one_line({"version": 1, "formula": {"name": "hast"}, "camera": {}, "stereo": data})


@given(st.dictionaries(st.sampled_from(FORMULA_KEYS), ANYTHING))
@settings(max_examples=200)
def test_any_data_in_an_inline_formula(data: dict[str, Any]) -> None:
    loads_or_one_line({"version": 1, "formula": {"inline": {**INLINE, **data}}, "camera": {}})
