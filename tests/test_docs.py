"""The code in README.md and docs/ is executed; the notebook runs, and examples have the types that mypy wants.

By the word behind the fence: `sh` is run by a shell, with `clfractal` the program under test and `scenes/`
in the current folder; `python` is run, the blocks of a page one after another; `yaml` with `version:` is
loaded as a scene, with `map:` as a formula. A `yaml` block whose first line is a comment with a file's name, such as
`# pollen.yaml`, is a file that the reader writes: the `sh` blocks below it find it, and test it. What is not meant to be
executed here (installing, measuring) is `console`.
"""

from __future__ import annotations

import base64
import io
import os
import re
import stat
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

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
        # Its pictures are for the eye; what a command does, a smaller one shows.
        text = text.replace("--size 480x270", "--size 96x54")
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


# --- the notebook ---


NOTEBOOK = ROOT / "docs" / "notebook.ipynb"


def shown_pictures(notebook: Any) -> list[Image.Image]:
    """What its cells show, in turn."""
    return [
        Image.open(io.BytesIO(base64.b64decode(output["data"]["image/png"])))
        for cell in notebook.cells
        for output in cell.get("outputs", [])
        if "image/png" in output.get("data", {})
    ]


def test_the_notebook_runs(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    nbclient = pytest.importorskip("nbclient")
    nbformat = pytest.importorskip("nbformat")
    # A kernel of this very Python, whatever kernels are installed; and nothing is kept in the user's folders.
    kernels = tmp_path / "jupyter" / "kernels" / "python3"
    kernels.mkdir(parents=True)
    command = [sys.executable, "-P", "-m", "ipykernel_launcher", "-f", "{connection_file}"]
    written = str(command).replace("'", '"').replace("\\", "\\\\")
    (kernels / "kernel.json").write_text(f'{{"argv": {written}, "display_name": "p", "language": "python"}}')
    for name, value in environment({"JUPYTER_PATH": str(tmp_path / "jupyter")}).items():
        monkeypatch.setenv(name, value)
    for name in ("IPYTHONDIR", "JUPYTER_RUNTIME_DIR", "JUPYTER_CONFIG_DIR", "JUPYTER_DATA_DIR"):
        monkeypatch.setenv(name, str(tmp_path / name.lower()))
    monkeypatch.setenv("JUPYTER_DATA_DIR", str(tmp_path / "jupyter"))
    desk = tmp_path / "desk"
    desk.mkdir()
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    nbformat.validate(notebook)
    assert all(not cell.get("outputs") for cell in notebook.cells)  # outputs are made, not kept
    client = nbclient.NotebookClient(
        notebook, timeout=240, kernel_name="python3", resources={"metadata": {"path": str(desk)}}
    )
    client.execute()

    shown = shown_pictures(notebook)
    assert len(shown) == 5
    assert shown[1].size == shown[3].size == (240, 160)
    for picture in shown:
        assert np.asarray(picture.convert("L")).std() > 10  # there is something to see
    assert clfractal.load_scene(desk / "twisted.png").formula.iterations == 12
    assert (desk / "twisted.ply").stat().st_size > 100_000
    with Image.open(desk / "twisted.webp") as framebuffer:
        assert getattr(framebuffer, "n_frames", 1) == 8


# --- types ---


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


# What a page does wrong on purpose, to show the error.
ON_PURPOSE = {"python": ["clfractal.render(scene, samples=2.7)"]}
# A page may import what is not here.
UNTYPED = "# mypy: ignore-missing-imports\n"


@pytest.fixture(scope="module")
def pages() -> dict[str, list[str]]:
    """The lines of the examples of each page that has some."""
    lines = {}
    for page in sorted((ROOT / "docs").rglob("*.md")):
        if found := re.findall(r"```python\n(.*?)```", page.read_text("utf-8"), re.DOTALL):
            lines[page.stem.replace("-", "_")] = (UNTYPED + "\n".join(found)).splitlines()
    return lines


@pytest.fixture(scope="module")
def told(pages: dict[str, list[str]], tmp_path_factory: pytest.TempPathFactory) -> str:
    """What mypy says of the script and the pages, once for all: most of its time it reads NumPy's types."""
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
