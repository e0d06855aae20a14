"""The program as it is installed: with its kernels, scenes and formulas, and nothing from the checkout."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

import clfractal
from tests.shell import SCENE
from tests.wheels import ROOT, built_wheel, names_in, run


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
