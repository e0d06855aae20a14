"""A layout that is interrupted goes on where it ended, whichever of its views that was, and ends with the same bits."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from clfractal.cli import run
from clfractal.cli.shell import Shell
from tests.interrupts import planes, watched
from tests.shell import Ended, InProcess

SCENE = """version: 1
formula: {name: mandelbulb, iterations: 8}
image: {width: 136, height: 70}
camera: {position: [0, -3, 0.5]}
layout:
  gap: 4
  background: [0.2, 0.1, 0.3]
  views:
  - {}
  - renderer: {type: cut_plane, plane: {width: 2.5, height: 2.5}, samples: 2}
  - renderer: {samples: 3}
    camera: {position: [2.5, -1, 1]}
output:
  channels: [R, G, B, A, Z, N.X, iterations, steps, samples]
  precision: {R: float, G: float, B: float, N.X: float}
"""
# Each view is 42 or 43 pixels wide: 2 x 3 tiles.
VIEW_TILES, TILES = 6, 18
NAMES = ["out.exr.partial", "out.exr.view2.partial", "out.exr.view3.partial"]
# Of two views: the squeezed eyes' are 32 pixels wide each, 1 x 3 tiles.
STEREO = (
    SCENE.replace("  - renderer: {samples: 3}\n    camera: {position: [2.5, -1, 1]}\n", "")
    + "stereo: {mode: split_half, separation: 0.5}\n"
)
STEREO_NAMES = [
    "out.exr.partial",
    "out.exr.view2.partial",
    "out.exr.right.partial",
    "out.exr.right.view2.partial",
]


@pytest.fixture
def shell(capfd: pytest.CaptureFixture[str]) -> InProcess:
    return InProcess(capfd)


def render(shell: InProcess, *options: str) -> Ended:
    return shell("render", "scene.yaml", "-o", "out.exr", "--quiet", *options)


def finished(shell: InProcess) -> dict[str, bytes]:
    """What an undisturbed render gives; it leaves nothing else."""
    assert render(shell) == Ended(0, "", "")
    assert {path.name for path in Path().iterdir()} == {"scene.yaml", "out.exr"}
    found = planes(Path("out.exr"))
    Path("out.exr").unlink()
    return found


def interrupted(shell: InProcess, tiles: int, *options: str) -> None:
    """A render that ends as soon as so many tiles are finished."""
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch, tiles)
        with pytest.raises(KeyboardInterrupt):
            render(shell, *options)
        assert seen[-1][1] == tiles
    assert not Path("out.exr").exists()


def partials() -> list[str]:
    return sorted(path.name for path in Path().glob("*.partial"))


@pytest.mark.parametrize("tiles", [3, 6, 8, 17])
def test_in_any_view(here: Path, shell: InProcess, tiles: int) -> None:
    """Views that have no tile leave no journal; what is there is not rendered again."""
    expected = finished(shell)
    interrupted(shell, tiles)
    assert partials() == NAMES[: -(-tiles // VIEW_TILES)]
    assert render(shell, "--resume", "--stats", "stats.json") == Ended(0, "", "")
    told = json.loads((here / "stats.json").read_text())
    assert (told["tiles"], told["tiles_resumed"]) == (TILES, tiles)
    assert planes(here / "out.exr") == expected
    assert partials() == []


def test_again_and_again(here: Path, shell: InProcess) -> None:
    expected = finished(shell)
    for tiles in (2, 5, 7, 13, 16):
        interrupted(shell, tiles, "--resume")
    with pytest.MonkeyPatch.context() as patch:
        seen = watched(patch)
        assert render(shell, "--resume") == Ended(0, "", "")
    assert (seen[0][0], seen[-1]) == (16, (16, 18, 18))
    assert planes(here / "out.exr") == expected


@pytest.mark.parametrize("tiles", [2, 5, 7, 11])
def test_of_both_eyes(here: Path, shell: InProcess, tiles: int) -> None:
    (here / "scene.yaml").write_text(STEREO)
    expected = finished(shell)
    interrupted(shell, tiles)
    assert partials() == sorted(STEREO_NAMES[: -(-tiles // 3)])
    assert render(shell, "--resume", "--stats", "stats.json") == Ended(0, "", "")
    told = json.loads((here / "stats.json").read_text())
    assert (told["tiles"], told["tiles_resumed"]) == (12, tiles)
    assert planes(here / "out.exr") == expected
    assert partials() == []


def test_a_region_of_it(here: Path, shell: InProcess) -> None:
    """Of the second view and the third: the first of them is kept beside the output, whichever it is."""
    region = ("--region", "60,5,60,50")
    assert render(shell, *region) == Ended(0, "", "")
    expected = planes(here / "out.exr")
    (here / "out.exr").unlink()
    interrupted(shell, 6, *region)
    assert partials() == ["out.exr.partial", "out.exr.view3.partial"]
    before = {name: (here / name).read_bytes() for name in partials()}
    ended = render(shell, "--resume")
    assert ended.is_one_line(2, "out.exr.partial: cannot be resumed: ")
    assert {name: (here / name).read_bytes() for name in partials()} == before
    assert render(shell, "--resume", *region) == Ended(0, "", "")
    assert planes(here / "out.exr") == expected


@pytest.mark.parametrize(
    "change",
    [
        "layout.gap=5",
        "layout.views.2.camera.position=[2, -2, 1]",
        "layout.views.1.renderer.samples=1",
        "formula.iterations=9",
    ],
)
def test_other_views_are_not_resumed(here: Path, shell: InProcess, change: str) -> None:
    interrupted(shell, 8)
    before = {name: (here / name).read_bytes() for name in NAMES[:2]}
    ended = render(shell, "--resume", "--set", change)
    assert ended.is_one_line(2, "out.exr.partial: cannot be resumed: ")
    assert {name: (here / name).read_bytes() for name in partials()} == before


def test_how_files_are_written_is_free_to_change(here: Path, shell: InProcess) -> None:
    interrupted(shell, 8)
    assert render(shell, "--resume", "--set", "output.exposure=1", "--set", "output.tone=agx").status == 0
    assert partials() == []


def test_without_resume_all_begin_anew_and_say_so(here: Path, shell: InProcess) -> None:
    expected = finished(shell)
    interrupted(shell, 14)
    ended = shell("render", "scene.yaml", "-o", "out.exr")
    dropped = [
        line.partition(":")[0] for line in ended.err.splitlines() if "earlier work is discarded" in line
    ]
    assert dropped == NAMES
    assert planes(here / "out.exr") == expected


def test_a_picture_of_one_view_leaves_nothing_of_the_others(here: Path, shell: InProcess) -> None:
    """And nothing is taken away that only looks like it."""
    interrupted(shell, 14)
    others = ["out.exr.viewpoint.partial", "out.exr.view.partial", "other.exr.view2.partial"]
    for name in others:
        (here / name).write_text("something else")
    ended = shell("render", "scene.yaml", "-o", "out.exr", "--set", "layout=null")
    assert ended.status == 0
    dropped = [
        line.partition(":")[0] for line in ended.err.splitlines() if "earlier work is discarded" in line
    ]
    assert sorted(dropped) == NAMES
    assert partials() == sorted(others)


def test_what_an_interrupt_tells(
    here: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The tiles of all views together."""
    watched(monkeypatch, 8)
    shell = Shell(owns_process=False)
    with pytest.raises(KeyboardInterrupt):
        run(["render", "scene.yaml", "-o", "out.exr", "--quiet"], shell)
    shell.interrupted()
    told = f"{NAMES[0]}: interrupted with 8 of {TILES} tiles done; --resume continues\n"
    assert capfd.readouterr().err == told
    assert partials() == NAMES[:2]
