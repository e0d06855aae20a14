"""Completion of command lines in bash, zsh, fish and PowerShell; the manual page; what commands tell as JSON."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

from clfractal.cli.program import app
from clfractal.formulas import catalog
from clfractal.integrators import lanes
from clfractal.integrators.lanes import MarchReport
from tests.calls import raising
from tests.makers import DOCS, maker
from tests.shell import InProcess, command, environment, process, works
from tests.variants import combinations

COMMANDS = {str(each.name or each.callback.__name__) for each in app.registered_commands if each.callback}


def variables(shell: str, words: list[str]) -> dict[str, str]:
    """What a shell's script tells the program about a command line that ends with an unfinished word."""
    line = " ".join(["clfractal", *words])
    found = {"_CLFRACTAL_COMPLETE": f"complete_{shell}", "_TYPER_COMPLETE_ARGS": line}
    if shell == "bash":
        found |= {"COMP_WORDS": line, "COMP_CWORD": str(len(words))}
    if shell == "fish":
        found["_TYPER_COMPLETE_FISH_ACTION"] = "get-args"
    if shell == "powershell":
        found["_TYPER_COMPLETE_WORD_TO_COMPLETE"] = words[-1]
    return found


SHELLS = ("bash", "zsh", "fish", "powershell")
WORDS = [
    (["ren"], "render"),
    (["render", "--si"], "--size"),
    (["render", "--quality", "fi"], "final"),
    (["formulas", "menger_s"], "menger_sponge"),
    (["scenes", "stereo_h"], "stereo_hall"),
]


# Of a shell depends how it asks and is answered, of a word what is found: each shell has two of the words.
@pytest.mark.parametrize(
    ("shell", "words", "wanted"),
    [
        each if (number - SHELLS.index(shell)) % len(WORDS) < 2 else combinations([each])[0]
        for number, word in enumerate(WORDS)
        for shell in SHELLS
        for each in [(shell, *word)]
    ],
)
def test_words_are_completed(shell: str, words: list[str], wanted: str, tmp_path: Path) -> None:
    ended = works(process([], tmp_path, variables(shell, words)))
    assert wanted in ended.out
    assert "voxelize" not in ended.out  # and nothing else is offered
    assert ended.err == ""


@pytest.mark.parametrize("shell", SHELLS)
def test_each_shell_has_its_script(shell: str, tmp_path: Path) -> None:
    ended = works(process([], tmp_path, {"_CLFRACTAL_COMPLETE": f"source_{shell}"}))
    assert "clfractal" in ended.out
    assert f"complete_{shell}" in ended.out
    assert ended.err == ""


def completed_by(shell: str, script: str, folder: Path) -> str:
    """The output of a script in a shell for which the program is a command, with its completion installed."""
    program = folder / "bin" / "clfractal"
    program.parent.mkdir()
    program.write_text(f'#!/bin/sh\nexec "{sys.executable}" -P -m clfractal "$@"\n')
    program.chmod(0o755)
    home = {"HOME": str(folder), "PATH": f"{program.parent}{os.pathsep}{os.environ['PATH']}"}
    # The shell that runs is found out by looking at the processes above.
    begun = [shell, "-c", "clfractal --install-completion; true"]
    ended = subprocess.run(
        begun, cwd=folder, env=environment(home), capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 0, ended
    ended = subprocess.run(
        [shell, "-c", script], cwd=folder, env=environment(home), capture_output=True, text=True, timeout=60
    )
    assert ended.returncode == 0, ended
    return ended.stdout


@pytest.mark.parametrize(
    ("shell", "script", "wanted"),
    [
        (
            "bash",
            "source ~/.bashrc; complete -p clfractal >/dev/null || exit 1; COMP_WORDS=(clfractal vo); COMP_CWORD=1;"
            " _clfractal_completion clfractal; echo ${COMPREPLY[@]}",
            "voxelize\n",
        ),
        ("fish", 'complete -C "clfractal vo"', "voxelize\t"),
        (
            "zsh",
            "source ~/.zshrc; whence -w _clfractal; print ${_comps[clfractal]}",
            "_clfractal: function\n_clfractal\n",
        ),
    ],
)
def test_shells_themselves(shell: str, script: str, wanted: str, tmp_path: Path) -> None:
    if shutil.which(shell) is None:
        pytest.skip(f"needs {shell}")
    found = completed_by(shell, script, tmp_path)
    assert found.startswith(wanted) if shell == "fish" else found == wanted


def test_a_shell_without_completion_is_told_which_have_one(
    clf: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    import shellingham

    monkeypatch.setattr(shellingham, "detect_shell", lambda: ("tcsh", "/bin/tcsh"))
    assert clf("--show-completion").is_one_line(2, "--show-completion: is for bash, zsh, fish", "is tcsh")

    monkeypatch.setattr(shellingham, "detect_shell", raising(shellingham.ShellDetectionFailure))
    assert clf("--install-completion").is_one_line(2, "--install-completion: is for bash", "none was found")


# --- the manual page ---


def test_the_manual_page_is_as_it_is_made() -> None:
    made = maker("make_man").page()
    assert (DOCS / "clfractal.1").read_text("utf-8") == made, "run docs/make_man.py"
    for name in COMMANDS:
        assert f"\n.SS {name}\n" in made
    for words in (r"\fB\-\-cluster\fR", r"\fBCLFRACTAL_DEVICE\fR", r"\fB130\fR"):
        assert words in made


@pytest.mark.skipif(shutil.which("groff") is None, reason="needs groff")
def test_the_manual_page_can_be_read() -> None:
    read = subprocess.run(
        ["groff", "-man", "-Tascii", "-ww", "-Wbreak", str(DOCS / "clfractal.1")],
        capture_output=True,
        text=True,
    )
    assert (read.returncode, read.stderr) == (0, "")
    assert "renders 3D fractals with OpenCL" in read.stdout


# --- JSON ---


def test_devices_as_json(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """(The README's examples measure them; here it only matters that both forms tell the same.)"""
    reports = (MarchReport(16, 67.0, 408.0, ""), MarchReport(8, 47.0, 434.0, ""))
    monkeypatch.setattr(lanes, "march_reports", lambda device, precision, **more: reports)
    ended = clf("devices", "--json")
    found = json.loads(ended.out)
    assert ended.status == 0
    assert len([each for each in found if each["default"]]) == 1
    head, *table = clf("devices").out.splitlines()
    assert head.split() == ["index", "name", "platform", "memory", "float64", "GL", "lanes", "speed"]
    assert len([line for line in table if line.startswith("*")]) == 1
    for line, each in zip(table, found, strict=True):
        assert each["default"] == line.startswith("*")
        assert each["index"] in line
        assert each["name"] in line
        assert f"{each['memory'] / 2**30:.1f} GiB" in line
        if not each["remark"]:
            assert each["pixels_per_second"] == pytest.approx(2e9 / (47 + 408))
            assert "4.40 Mpixels/s" in line
            assert {1, 4, 8, 16} >= {*each["lanes"]} > set()


def test_formulas_as_json(clf: InProcess, tmp_path: Path) -> None:
    own = tmp_path / "formulas"
    own.mkdir()
    (own / "broken.yaml").write_text("title: Broken\nvariables: [x]\n")
    (own / "mine.yaml").write_text(
        (Path(catalog.__file__).parent / "library" / "hast.yaml").read_text("utf-8")
    )
    found = {each["name"]: each for each in json.loads(clf("formulas", "--json").out)}
    assert set(catalog.names()) | {"mine", "broken"} == set(found)
    assert found["hast"] == {"name": "hast", "title": found["mine"]["title"], "file": None}
    assert Path(found["mine"]["file"]) == Path("formulas/mine.yaml")
    assert found["broken"]["title"] is None
    assert "broken.yaml" in found["broken"]["problem"]


def test_one_formula_as_json(clf: InProcess) -> None:
    found = json.loads(clf("formulas", "hast", "--json").out)
    assert (found["variables"], found["add"]) == (["a", "b", "c"], "point")
    (power,) = found["parameters"]
    assert (power["name"], power["type"], power["default"]) == ("power", "int", 2)
    assert power["choices"] == [2, 4, 8, 16]
    mixed = json.loads(clf("formulas", "mengerbulb", "--json").out)
    assert [link["name"] for link in mixed["chain"]]
    assert clf("formulas", "hasp", "--json").is_one_line(2, "did you mean 'hast'?")


def test_a_scene_as_json(clf: InProcess, tmp_path: Path) -> None:
    moved = (
        "version: 1\nformula: {name: hast}\ncamera: {}\nanimation: {frames: 3, tracks: {camera.fov: {keys: "
    )
    Path("moved.yaml").write_text(moved + "[{frame: 0, value: 30}, {frame: 2, value: 50}]}}}\n")
    found = json.loads(clf("check", "moved.yaml", "--json").out)
    assert found["remarks"][0].startswith("animation: 3 frames")
    assert found["scene"]["animation"]["tracks"]["camera.fov"]["keys"][1]["value"] == 50
    (tmp_path / "again.json").write_text(json.dumps(found["scene"]))
    assert json.loads(clf("check", "again.json", "--json").out) == found
    broken = command("check", "nothing.yaml", "--json")
    ended = subprocess.run(broken, capture_output=True, text=True, env=environment(), cwd=tmp_path)
    assert (ended.returncode, ended.stdout) == (2, "")
