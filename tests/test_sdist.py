"""The source archive: what it takes to build and test the program, and nothing that a developer's folder has besides."""

from __future__ import annotations

import shutil
import subprocess
import tarfile
from pathlib import Path

import pytest

from tests.wheels import ROOT, built_wheel, names_in

LARGEST = 5_000_000
"""Bytes; the pictures of the pages alone are thirty millions."""


@pytest.fixture(scope="module")
def archive(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The archive of the checkout, in which an editor or a merge has left files behind."""
    from hatchling.builders.sdist import SdistBuilder

    folder = tmp_path_factory.mktemp("sdist")
    checkout = folder / "checkout"
    left_out = shutil.ignore_patterns(".*", "build", "out", "__pycache__")
    shutil.copytree(ROOT, checkout, ignore=left_out)
    (checkout / "docs" / "pictures").mkdir(exist_ok=True)
    for name in ("docs/pictures/a.webp", "docs/pictures.yaml.orig", "kernels/march.cl.rej"):
        (checkout / name).write_text("left behind")
    (file,) = SdistBuilder(str(checkout)).build(directory=str(folder / "dist"))
    return Path(file)


def inside(archive: Path) -> set[str]:
    with tarfile.open(archive) as opened:
        return {name.partition("/")[2] for name in opened.getnames()}


def test_what_belongs_in_it(archive: Path) -> None:
    names = inside(archive)
    for folder, ending in (
        ("clfractal", "py"),
        ("kernels", "*"),
        ("scenes", "yaml"),
        ("tests", "py"),
        ("benchmarks", "py"),
        ("docs", "md"),
        ("docs", "py"),
    ):
        wanted = {str(path.relative_to(ROOT).as_posix()) for path in (ROOT / folder).rglob(f"*.{ending}")}
        assert wanted, folder
        assert wanted <= names, wanted - names
    assert {"pyproject.toml", "Makefile", "README.md", "CHANGELOG.md", "LICENSE", "docs/clfractal.1"} <= names
    assert not [name for name in names if name.startswith("docs/pictures/")]
    assert not [name for name in names if name.endswith((".orig", ".rej", ".partial", ".pyc"))]
    assert archive.stat().st_size <= LARGEST


def test_the_wheel_of_an_archive_is_that_of_the_checkout(archive: Path, tmp_path: Path) -> None:
    with tarfile.open(archive) as opened:
        opened.extractall(tmp_path, filter="data")
    (unpacked,) = tmp_path.iterdir()
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    assert names_in(built_wheel(unpacked, tmp_path / "a")) == names_in(built_wheel(ROOT, tmp_path / "b"))


def test_no_leftovers_are_tracked() -> None:
    if not (ROOT / ".git").exists():
        pytest.skip("no checkout")
    listed = subprocess.run(["git", "ls-files"], cwd=ROOT, capture_output=True, text=True)
    if listed.returncode:
        pytest.skip("no git")
    assert not [name for name in listed.stdout.splitlines() if name.endswith((".orig", ".rej", ".partial"))]
