"""The program as it is installed, with kernels, scenes and formulas; and the source archive, which builds and tests it."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

import clfractal
from tests.shell import SCENE

ROOT = Path(__file__).resolve().parents[1]


def run(*command: str | Path, folder: Path) -> str:
    """Runs a command in a folder without anything that leads to the checkout; gives its standard output."""
    clean = {name: value for name, value in os.environ.items() if name not in ("PYTHONPATH", "VIRTUAL_ENV")}
    ended = subprocess.run(list(map(str, command)), cwd=folder, env=clean, capture_output=True, text=True)
    assert ended.returncode == 0, ended.stderr[-2000:]
    return ended.stdout


def built_wheel(source: Path, folder: Path) -> Path:
    """The wheel of a folder with sources, built in another folder."""
    run(
        *(sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "--no-build-isolation"),
        *("--wheel-dir", folder, source),
        folder=folder,
    )
    (found,) = folder.glob("*.whl")
    return found


def names_in(wheel: Path) -> set[str]:
    """The files in a wheel."""
    return set(zipfile.ZipFile(wheel).namelist())


# --- the wheel ---


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the checkout."""
    return built_wheel(ROOT, tmp_path_factory.mktemp("wheel"))


def test_what_travels_in_the_wheel(wheel: Path) -> None:
    names = names_in(wheel)
    for place, pattern, inside in (
        (ROOT / "kernels", "*.*", "clfractal/kernels"),
        (ROOT / "scenes", "*.yaml", "clfractal/scenes"),
        (ROOT / "clfractal" / "formulas" / "library", "*.yaml", "clfractal/formulas/library"),
        (ROOT / "clfractal" / "environments", "*.exr", "clfractal/environments"),
        (ROOT / "clfractal" / "tables", "*.npy", "clfractal/tables"),
        (ROOT / "clfractal", "*.py", "clfractal"),
    ):
        files = {f"{inside}/{path.relative_to(place)}" for path in place.rglob(pattern) if path.is_file()}
        assert files <= names, files - names
    assert "clfractal/py.typed" in names
    assert [name for name in names if name.endswith(".data/data/share/man/man1/clfractal.1")]
    assert not [name for name in names if name.startswith(("tests", "benchmarks", "docs"))]


def test_a_fresh_environment_renders_from_the_wheel(wheel: Path, tmp_path: Path) -> None:
    """A new virtual environment outside the tree, with the dependencies that the wheel itself asks for."""
    environment, work = tmp_path / "environment", tmp_path / "work"
    work.mkdir()
    run(sys.executable, "-m", "venv", "--without-pip", environment, folder=work)
    python = environment / "bin" / "python"
    run(
        *(sys.executable, "-m", "pip", "--python", python, "install", "--quiet", "--no-compile", wheel),
        folder=work,
    )
    where = run(python, "-c", "import clfractal; print(clfractal.__file__)", folder=work).strip()
    assert Path(where).is_relative_to(environment)
    assert (environment / "share" / "man" / "man1" / "clfractal.1").is_file()
    (work / "scene.yaml").write_text(SCENE)
    run(environment / "bin" / "clfractal", "render", "scene.yaml", "-o", "a.exr", "-o", "a.png", folder=work)
    assert (work / "a.png").read_bytes()[:8] == b"\x89PNG\r\n\x1a\n"
    assert (work / "a.exr").read_bytes()[:4] == b"\x76\x2f\x31\x01"
    told = subprocess.run(
        [environment / "bin" / "clfractal", "mesh", "scene.yaml", "-o", "a.ply"],
        cwd=work,
        capture_output=True,
        text=True,
    )
    assert told.returncode == 2
    assert told.stderr == "clfractal mesh: needs scikit-image: pip install scikit-image\n"
    loaded = run(
        python,
        *("-c", "import sys, clfractal.api, clfractal.engine.engine, clfractal.files.resources as r\n"),
        folder=work,
    )
    assert loaded == ""
    code = "from clfractal.files import resources\nprint(resources.folder('kernels'), resources.folder('scenes'))"
    for folder in run(python, "-c", code, folder=work).split():
        assert Path(folder).is_relative_to(environment)


def test_the_tests_run_on_the_installed_program() -> None:
    """`make test` promises it; elsewhere (a developer's own pytest) the checkout is tested."""
    if os.environ.get("CLFRACTAL_EXPECT_INSTALLED"):
        assert not Path(clfractal.__file__).resolve().is_relative_to(ROOT / "clfractal")


# --- the source archive ---


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
