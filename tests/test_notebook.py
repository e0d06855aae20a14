"""The notebook of the documentation runs from its first cell to its last, and shows what it says."""

from __future__ import annotations

import base64
import io
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

import clfractal
from tests.shell import environment

NOTEBOOK = Path(__file__).resolve().parents[1] / "docs" / "notebook.ipynb"


def pictures(notebook: Any) -> list[Image.Image]:
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
    pytest.importorskip("ipykernel")
    pytest.importorskip("skimage")
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

    shown = pictures(notebook)
    assert len(shown) == 5
    assert shown[1].size == shown[3].size == (240, 160)
    for picture in shown:
        assert np.asarray(picture.convert("L")).std() > 10  # there is something to see
    assert clfractal.load_scene(desk / "twisted.png").formula.iterations == 12
    assert (desk / "twisted.ply").stat().st_size > 100_000
    with Image.open(desk / "twisted.webp") as framebuffer:
        assert getattr(framebuffer, "n_frames", 1) == 8
