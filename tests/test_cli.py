"""The commands as users type them: what they write, where, and with which exit status."""

from __future__ import annotations

import json
import os
import pty
import subprocess
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import typer

import clfractal
from clfractal.cli import progress
from clfractal.cli.program import app
from clfractal.files.exr import read_exr
from clfractal.files.png import read_texts
from clfractal.formulas import catalog
from tests.shell import SCENE, InProcess, command, environment, works


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_the_default_output_is_the_scenes_name(here: Path, clf: InProcess) -> None:
    (here / "deep").mkdir()
    (here / "deep" / "my.scene.yaml").write_text(SCENE)
    ended = clf("render", "deep/my.scene.yaml")
    assert (ended.status, ended.out) == (0, "")
    assert ended.err.splitlines()[-1].startswith("my.scene.png: ")
    assert names(here) == {"scene.yaml", "deep", "my.scene.png"}


def test_several_outputs_of_one_render(here: Path, clf: InProcess) -> None:
    ended = clf("render", "scene.yaml", "-o", "a.exr", "-o", "a.png", "--output", "b.EXR", "--quiet")
    assert (ended.status, ended.out, ended.err) == (0, "", "")
    assert names(here) == {"scene.yaml", "a.exr", "a.png", "b.EXR"}
    first, second = (read_exr(here / name)[0] for name in ("a.exr", "b.EXR"))
    assert all(np.array_equal(first[name], second[name]) for name in first)


def test_what_a_picture_tells_of_itself(here: Path, clf: InProcess) -> None:
    clf("render", "scene.yaml", "-o", "a.exr", "-o", "a.png", "--samples", "2", "--precision", "float64")
    header = read_exr(here / "a.exr")[1]
    assert header["clfractalVersion"] == clfractal.__version__
    assert header["clfractalPrecision"] == "float64"
    assert header["clfractalDevice"]
    assert header["clfractalSeconds"] > 0
    scene = clfractal.load_scene(header["clfractal"])
    assert (scene.renderer.samples, scene.renderer.precision) == (2, "float64")
    assert scene == clfractal.load_scene(read_texts(here / "a.png")["clfractal"])
    # The camera at (0, -3, 0) looks along +y, which is z of camera space, and the target is in the middle.
    to_camera, to_ndc = header["worldToCamera"], header["worldToNDC"]
    np.testing.assert_allclose(np.array([0, 0, 0, 1]) @ to_camera, [0, 0, 3, 1], atol=1e-6)
    np.testing.assert_allclose(np.array([0, 0, 1, 1]) @ to_camera, [0, 1, 3, 1], atol=1e-6)
    projected = np.array([0, 0, 0, 1]) @ to_ndc
    np.testing.assert_allclose(projected[:2] / projected[3], [0.5, 0.5], atol=1e-6)


@pytest.mark.parametrize(
    ("seconds", "told"),
    [
        (None, "time left unknown"),
        (0.4, "0:00 left"),
        (59.2, "0:59 left"),
        (59.6, "1:00 left"),
        (61, "1:01 left"),
        (3599, "59:59 left"),
        (3600, "1:00:00 left"),
        (360_061, "100:01:01 left"),
    ],
)
def test_the_time_that_is_left(seconds: float | None, told: str) -> None:
    state: Any = SimpleNamespace(remaining=seconds)
    assert progress._left(state) == told


def test_no_switch_is_on_unless_it_is_given() -> None:
    """Of every command: nobody asked for details, for silence or for another way."""
    group: Any = typer.main.get_command(app)
    parameters = [(f"{name} {p.opts[0]}", p) for name, each in group.commands.items() for p in each.params]
    switches = {name: p for name, p in parameters if getattr(p, "is_flag", False)}
    assert {"render --quiet", "vary --verbose", "check --parallax", "mesh --no-close"} <= switches.keys()
    # Those that have an opposite (--panels, --no-panels) are on.
    on = {name for name, p in switches.items() if p.secondary_opts}
    assert {"view --panels", "view --share"} <= on
    assert {name for name, p in switches.items() if p.default is not (name in on)} == set()


def test_size_keeps_the_camera(here: Path, clf: InProcess) -> None:
    """Twice the pixels: every second one of the larger picture lies beside one of the smaller."""
    clf("render", "scene.yaml", "-o", "small.exr", "--size", "40x40")
    clf("render", "scene.yaml", "-o", "large.exr", "--size", "80x80")
    small, large = (read_exr(here / name)[0]["A"] for name in ("small.exr", "large.exr"))
    blocks = large.astype(float).reshape(40, 2, 40, 2).mean(axis=(1, 3))
    assert np.abs(blocks - small).mean() < 0.05


def test_schema_is_json(clf: InProcess) -> None:
    ended = works(clf("schema"))
    schema = json.loads(ended.out)
    assert set(schema["required"]) == {"version", "formula", "camera"}


def test_formulas_lists_the_library(clf: InProcess) -> None:
    listed = [line.split()[0] for line in clf("formulas").out.splitlines()]
    assert listed == list(catalog.names())


@pytest.mark.parametrize("name", catalog.names())
def test_each_formula_tells_about_itself(clf: InProcess, name: str) -> None:
    ended = works(clf("formulas", name))
    assert ended.out.startswith(f"{name}: ")
    for parameter in [] if catalog.is_chain(name) else catalog.load(name).parameters:
        assert f"  {parameter.name}: " in ended.out


@pytest.mark.parametrize(
    ("arguments", "part"),
    [
        ([], "Missing command"),
        (["rendr"], "rendr"),
        (["render"], "SCENE"),
        (["render", "a.yaml", "b.yaml"], "b.yaml"),
        (["formulas", "hast", "tetrabrot"], "tetrabrot"),
        (["--nonsense"], "--nonsense"),
    ],
)
def test_usage_errors_are_one_line(clf: InProcess, arguments: list[str], part: str) -> None:
    assert clf(*arguments).is_one_line(2, "clfractal", part, "--help")


def test_help_and_version(clf: InProcess) -> None:
    assert clf("--version").out == f"clfractal {clfractal.__version__}\n"
    whole = clf("--help")
    for name in ("render", "check", "devices", "formulas", "schema", "bench"):
        assert f"  {name} " in whole.out
    told = clf("render", "--help").out
    options = ["-o", "--device", "--precision", "--size", "--set", "--region", "--samples", "--resume"]
    for option in [*options, "--quiet", "--verbose", "--stats"]:
        assert option in told


def test_a_reader_that_has_seen_enough(here: Path) -> None:
    """As in `clfractal schema | head -1`: no message, no traceback."""
    running = subprocess.Popen(
        command("schema"), cwd=here, env=environment(), stdout=subprocess.PIPE, stderr=subprocess.PIPE
    )
    assert running.stdout is not None
    running.stdout.close()
    assert running.stderr is not None
    assert running.stderr.read() == b""
    assert running.wait() == 0


def test_a_bar_on_a_terminal(here: Path) -> None:
    """A render of seconds on a terminal shows rays per second and the time left, and leaves one last line."""
    ours, theirs = pty.openpty()
    options = ["--samples", "400", "--size", "128x128", "--set", "formula.iterations=50"]
    running = subprocess.Popen(
        command("render", "scene.yaml", "-o", "a.png", *options),
        cwd=here,
        env=environment({"TERM": "xterm", "COLUMNS": "120"}),
        stderr=theirs,
    )
    os.close(theirs)
    told = b""
    try:
        while chunk := os.read(ours, 4096):
            told += chunk
    except OSError:  # the other end is closed
        pass
    os.close(ours)
    assert running.wait() == 0
    assert b"rays/s" in told
    assert b" left" in told
    assert b"a.png: " in told.splitlines()[-1]
