"""A user's script is checked by mypy, strictly, against the installed package."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest

from tests.shell import environment

SCRIPT = """
import numpy as np
import numpy.typing as npt

import clfractal

scene: clfractal.Scene = clfractal.load_scene({"version": 1, "formula": {"name": "hast"}, "camera": {}})
fov: float = scene.model_copy(update={"image": {"width": 8}}).material.ambient
film: clfractal.Film = clfractal.render(scene, samples=2, region=(0, 0, 8, 8))
red: npt.NDArray[np.float32] = film["R"]
rays = film.stats["rays"]
pixels: npt.NDArray[np.uint8] = film.to_rgb8(exposure=1)
size: tuple[int, int] = film.to_image().size
colors = np.asarray(film)
counts, inside = clfractal.escape("hast", [[0, 0, 0]], iterations=3)
most: np.int64 = counts.max()
normal: npt.NDArray[np.float64] = clfractal.distances("hast", [[0.0, 0, 0]]).normal
volume: clfractal.Volume = clfractal.voxelize(scene, resolution=(8, 8, 8))
mesh: clfractal.Mesh = clfractal.mesh(volume, level=0.5)
mesh.save("a.ply")
token = clfractal.CancelToken()


def told(state: clfractal.Progress) -> None:
    print(state.tiles_done, state.remaining)


with clfractal.Engine(budget_seconds=0.05, tell=print) as engine:
    for coarse in engine.refine(scene, token=token):
        stage: str = coarse.stage
    left, right = engine.render_pair(scene, told)
try:
    clfractal.render("scene.yaml")
except clfractal.SceneError as error:
    line: int | None = error.where.line
names: list[str] = [device.name for device in clfractal.devices()]
"""


MISTAKES = """
clfractal.render(scene, samples="4")
clfractal.rendre(scene)
number: int = film
"""


def test_mypy_knows_the_types(tmp_path: Path) -> None:
    """It takes the script, and sees each of three mistakes after it."""
    pytest.importorskip("mypy")
    (tmp_path / "script.py").write_text(SCRIPT + MISTAKES)
    command = [sys.executable, "-P", "-m", "mypy", "--strict", "--follow-imports=silent"]
    command += ["--no-incremental", "script.py"]
    ended = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True)
    found = re.findall(r"^script.py:(\d+): error: .*\[([\w-]+)\]$", ended.stdout, re.MULTILINE)
    first = SCRIPT.count("\n") + 2
    assert found == [
        (str(first), "arg-type"),
        (str(first + 1), "attr-defined"),
        (str(first + 2), "assignment"),
    ], ended.stdout


DOCS = Path(__file__).resolve().parents[1] / "docs"
# What a page does wrong on purpose, to show the error.
ON_PURPOSE = {"python": ["clfractal.render(scene, samples=2.7)"]}


def test_the_examples_of_the_pages_have_their_types(tmp_path: Path) -> None:
    pytest.importorskip("mypy")
    lines = {}
    for page in sorted(DOCS.glob("*.md")):
        found = re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.DOTALL)
        if found:
            name = page.stem.replace("-", "_")
            lines[name] = "\n".join(found).splitlines()
            (tmp_path / f"{name}.py").write_text("\n".join(lines[name]) + "\n", "utf-8")
    assert len(lines) >= 8
    command = [
        sys.executable,
        "-P",
        "-m",
        "mypy",
        "--strict",
        "--follow-imports=silent",
        "--ignore-missing-imports",
    ]
    command += ["--no-incremental", *(f"{name}.py" for name in lines)]
    ended = subprocess.run(command, cwd=tmp_path, env=environment(), capture_output=True, text=True)
    wrong = re.findall(r"^(\w+)\.py:(\d+): error: (.*)$", ended.stdout, re.MULTILINE)
    shown = [(name, lines[name][int(line) - 1].strip(), message) for name, line, message in wrong]
    assert [(name, line) for name, line, _ in shown] == [
        (name, line) for name, purpose in ON_PURPOSE.items() for line in purpose
    ], shown
