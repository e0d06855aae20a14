"""The code in README.md and docs/ is executed.

By the word behind the fence: `sh` is run by a shell, with `clfractal` the program under test and `scenes/`
in the current folder; `python` is run, the blocks of a page one after another; `yaml` with `version:` is
loaded as a scene, with `map:` as a formula. A `yaml` block whose first line is a comment with a file's name, such as
`# pollen.yaml`, is a file that the reader writes: the `sh` blocks below it find it, and test it. What is not meant to be
executed here (installing, measuring) is `console`.
"""

from __future__ import annotations

import os
import re
import stat
import subprocess
import sys
from pathlib import Path

import pytest

import clfractal
from clfractal.files.resources import folder
from clfractal.formulas import catalog
from tests.makers import PICTURES
from tests.shell import environment, python, works

ROOT = Path(__file__).resolve().parents[1]
PAGES = [ROOT / "README.md", ROOT / "CHANGELOG.md", *sorted((ROOT / "docs").rglob("*.md"))]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
FILE_NAME = re.compile(r"# ([\w/]+\.yaml)\n")
KNOWN = {"sh", "python", "yaml", "console", "text", "json", "c", ""}


def blocks(page: Path, language: str) -> list[str]:
    """The page's blocks of code in a language."""
    return [text for word, text in FENCE.findall(page.read_text(encoding="utf-8")) if word == language]


def steps(page: Path) -> list[tuple[str, str]]:
    """What a reader of the page writes and runs, in order: (name of a file, its text), or ("", shell code)."""
    found = []
    for word, text in FENCE.findall(page.read_text(encoding="utf-8")):
        named = FILE_NAME.match(text)
        if word == "sh":
            found.append(("", text))
        elif word == "yaml" and named is not None:
            found.append((named.group(1), text))
    return found


def name(page: Path) -> str:
    return page.name


@pytest.fixture
def desk(tmp_path: Path) -> Path:
    """A folder to work in: the scenes, and a `clfractal` on the path of `shell_environment`."""
    (tmp_path / "scenes").symlink_to(folder("scenes"))
    tool = tmp_path / "bin" / "clfractal"
    tool.parent.mkdir()
    tool.write_text(f'#!/bin/sh\nexec "{sys.executable}" -P -m clfractal "$@"\n')
    tool.chmod(tool.stat().st_mode | stat.S_IXUSR)
    return tmp_path


def shell_environment(desk: Path) -> dict[str, str]:
    return environment({"PATH": f"{desk / 'bin'}{os.pathsep}{os.environ['PATH']}"})


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_every_block_says_what_it_is(page: Path) -> None:
    words = {word for word, _ in FENCE.findall(page.read_text(encoding="utf-8"))}
    assert words <= KNOWN


def test_the_changelog_is_one_by_keep_a_changelog() -> None:
    """https://keepachangelog.com/en/1.1.0: what comes next on top, versions with dates, six kinds of changes."""
    lines = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines()
    versions = [line for line in lines if line.startswith("## ")]
    assert versions[0] == "## [Unreleased]"
    dated = [re.fullmatch(r"## \[\d+\.\d+\.\d+\] - (\d{4}-\d\d-\d\d)", line) for line in versions[1:]]
    dates = [found[1] for found in dated if found is not None]
    assert len(dates) == len(versions) - 1
    assert dates == sorted(dates, reverse=True)
    kinds = ["Added", "Changed", "Deprecated", "Removed", "Fixed", "Security"]
    for version in re.split(r"^## ", "\n".join(lines), flags=re.MULTILINE)[1:]:
        found = re.findall(r"^### (.*)$", version, re.MULTILINE)
        assert found == [kind for kind in kinds if kind in found]


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "sh")], ids=name)
def test_shell_code(page: Path, desk: Path) -> None:
    for file, text in steps(page):
        if file:
            (desk / file).parent.mkdir(exist_ok=True)
            (desk / file).write_text(text, encoding="utf-8")
            continue
        ended = subprocess.run(
            ["sh", "-eu", "-c", text], cwd=desk, env=shell_environment(desk), capture_output=True, text=True
        )
        assert ended.returncode == 0, f"{text}\n{ended.stderr[-2000:]}"


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "python")], ids=name)
def test_python_code(page: Path, desk: Path) -> None:
    text = "\n".join(blocks(page, "python"))
    works(python(text, folder=desk))


@pytest.mark.parametrize("page", [page for page in PAGES if blocks(page, "yaml")], ids=name)
def test_scenes_and_formulas(page: Path, desk: Path) -> None:
    for text in blocks(page, "yaml"):
        if FILE_NAME.match(text):
            assert blocks(page, "sh"), "a file that no command uses"
        elif "version:" in text:
            assert clfractal.load_scene(text + "\n").version == 1
        else:
            (desk / "formula.yaml").write_text(text)
            assert catalog.load_chain(desk / "formula.yaml").links


@pytest.mark.parametrize("page", PAGES, ids=name)
def test_links_lead_somewhere(page: Path) -> None:
    for target in re.findall(r"\]\(([^)#:]+?)(?:#[^)]*)?\)", page.read_text(encoding="utf-8")):
        if PICTURES.is_dir() or not (page.parent / target).is_relative_to(PICTURES):
            assert (page.parent / target).exists(), target
