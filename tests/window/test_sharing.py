"""The whole window with textures that OpenCL and OpenGL share, on PoCL, by the strict layer of `tests/viewer`."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from tests.pictures import read_picture
from tests.shell import environment
from tests.viewer import gl_layer
from tests.window import scenes
from tests.window.display import Display, missing
from tests.window.driver import Window, differs
from tests.window.film import film

ROOT = Path(__file__).absolute().parents[2]  # not resolved: tests of the installed package are linked to


@pytest.fixture(scope="module")
def layer(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The layer, built."""
    missing(gl_layer.missing())
    return gl_layer.build(tmp_path_factory.mktemp("layer"))


def layered(layer: Path, folder: Path, **wanted: Any) -> dict[str, str]:
    """The environment of a process with the layer on PoCL's wheel, which logs mistakes to `mistakes` in the folder."""
    (folder / "vendors").mkdir(exist_ok=True)
    found = dict(gl_layer.environment(layer, folder / "mistakes", **wanted))
    return {**found, "OCL_ICD_VENDORS": str(folder / "vendors"), "CLFRACTAL_DEVICE": "pthread"}


def _without_layer(folder: Path) -> dict[str, str]:
    return {"OCL_ICD_VENDORS": str(folder / "vendors")}


def mistakes(folder: Path) -> str:
    log = folder / "mistakes"
    return log.read_text() if log.exists() else ""


def run(display: Display, folder: Path, layer: Path, mistake: str = "", **wanted: Any) -> dict[str, Any]:
    """What the child found."""
    (folder / "s.yaml").write_text(scenes.SURFACE)
    extra = {**environment(layered(layer, folder, **wanted))}
    extra["PYTHONPATH"] += f":{ROOT}"
    ended = subprocess.run(
        [sys.executable, "-m", "tests.window.sharing_child", str(folder / "s.yaml"), mistake, "shot.png"],
        cwd=folder,
        env=display.environment(extra),
        capture_output=True,
        text=True,
        timeout=240,
        check=False,
    )
    assert ended.returncode == 0, ended.stderr
    found: dict[str, Any] = json.loads(ended.stdout.splitlines()[-1])
    assert found["size"] == [360, 240]
    picture = film(folder, "seen.yaml", (360, 240), extra=_without_layer(folder))
    assert differs(read_picture(folder / "shot.png"), picture) == ""
    return found


@pytest.mark.parametrize("events", [False, True], ids=["without fences", "with fences"])
def test_a_whole_session_with_shared_textures(
    display: Display, folder: Path, layer: Path, events: bool
) -> None:
    """Orbits, other sizes, another context: the picture is right, and the layer finds no mistake."""
    found = run(display, folder, layer, events=events)
    assert found["began"]
    assert found["shared"]
    assert found["way"] == "shared"
    assert found["acquired"] > 10
    assert [line for line in found["messages"] if "cop" in line] == []
    assert mistakes(folder) == ""


@pytest.mark.parametrize("mistake", ["begin", "acquire"])
def test_copying_takes_over_with_a_remark(display: Display, folder: Path, layer: Path, mistake: str) -> None:
    found = run(display, folder, layer, mistake)
    assert found["began"]
    assert not found["shared"] or mistake == "acquire"
    assert [line for line in found["messages"] if "pictures are copied" in line and "planted" in line]
    assert mistakes(folder) == ""


@pytest.mark.parametrize("answer", ["none", "missing"])
def test_a_driver_that_does_not_share_after_all(
    display: Display, folder: Path, layer: Path, answer: str
) -> None:
    found = run(display, folder, layer, answer=answer)
    assert not found["began"]
    assert found["way"] == "copied"
    assert mistakes(folder) == ""


@pytest.mark.parametrize("share", ["--share", "--no-share"])
def test_the_program_itself_shares(display: Display, folder: Path, layer: Path, share: str) -> None:
    (folder / "s.yaml").write_text(scenes.LAYOUT)
    given = ["--size", "400x240", "--no-panels", share, "--shot", "shot.png"]
    extra = layered(layer, folder)
    with Window(display, folder, "s.yaml", *given, extra=extra, save=False, open=False) as window:
        ended = window.ended(120)
    assert (ended.status, ended.out, ended.err) == (0, "", "")
    picture = film(folder, "s.yaml", (400, 240), extra=_without_layer(folder))
    assert differs(read_picture(folder / "shot.png"), picture) == ""
    assert mistakes(folder) == ""
