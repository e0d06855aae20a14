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
framebuffer: clfractal.Framebuffer = clfractal.render(scene, samples=2, region=(0, 0, 8, 8))
red: npt.NDArray[np.float32] = framebuffer["R"]
rays = framebuffer.stats["rays"]
pixels: npt.NDArray[np.uint8] = framebuffer.to_rgb8(exposure=1)
size: tuple[int, int] = framebuffer.to_image().size
colors = np.asarray(framebuffer)
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
number: int = framebuffer
"""


DOCS = Path(__file__).resolve().parents[1] / "docs"
# What a page does wrong on purpose, to show the error.
ON_PURPOSE = {"python": ["clfractal.render(scene, samples=2.7)"]}
# A page may import what is not here.
PAGE = "# mypy: ignore-missing-imports\n"


@pytest.fixture(scope="module")
def pages() -> dict[str, list[str]]:
    """The lines of the examples of each page that has some."""
    lines = {}
    for page in sorted(DOCS.rglob("*.md")):
        if found := re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            lines[page.stem.replace("-", "_")] = (PAGE + "\n".join(found)).splitlines()
    return lines


@pytest.fixture(scope="module")
def told(pages: dict[str, list[str]], tmp_path_factory: pytest.TempPathFactory) -> str:
    """What mypy says of the script and the pages, once for all: most of its time it reads NumPy's types."""
    pytest.importorskip("mypy")
    folder = tmp_path_factory.mktemp("types")
    texts = {"script": SCRIPT + MISTAKES, **{name: "\n".join(lines) + "\n" for name, lines in pages.items()}}
    for name, text in texts.items():
        (folder / f"{name}.py").write_text(text, "utf-8")
    command = [sys.executable, "-P", "-m", "mypy", "--strict", "--follow-imports=silent"]
    command += ["--no-incremental", *(f"{name}.py" for name in texts)]
    return subprocess.run(command, cwd=folder, env=environment(), capture_output=True, text=True).stdout


def test_mypy_knows_the_types(told: str) -> None:
    """It takes the script, and sees each of three mistakes after it."""
    found = re.findall(r"^script.py:(\d+): error: .*\[([\w-]+)\]$", told, re.MULTILINE)
    first = SCRIPT.count("\n") + 2
    assert found == [
        (str(first), "arg-type"),
        (str(first + 1), "attr-defined"),
        (str(first + 2), "assignment"),
    ], told


def test_the_examples_of_the_pages_have_their_types(told: str, pages: dict[str, list[str]]) -> None:
    assert len(pages) >= 8
    assert "Found " in told
    wrong = re.findall(r"^(?!script\b)(\w+)\.py:(\d+): error: (.*)$", told, re.MULTILINE)
    shown = [(name, pages[name][int(line) - 1].strip(), message) for name, line, message in wrong]
    assert [(name, line) for name, line, _ in shown] == [
        (name, line) for name, purpose in ON_PURPOSE.items() for line in purpose
    ], shown
