"""Whatever is wrong: one line, its exit status, and everything that was there before is untouched."""

from __future__ import annotations

import errno
import os
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest

from clfractal.cli import progress
from clfractal.device import drivers_folder, program, select
from clfractal.integrators import surface
from clfractal.integrators.kernel import ProgramText
from tests.calls import raising
from tests.files.limits import file_size_limit
from tests.shell import SCENE, InProcess, command, environment, works

INLINE = """version: 1
camera: {{position: [0, -3, 0]}}
image: {{width: 32, height: 32}}
formula:
  inline:
    title: test
    reference: test
    variables: [x, y, z]
    map: {map}
    degree: 2
    bounds: {{center: [0, 0, 0], radius: 2}}
    bailout: 4
"""
NESTED = "(" * 10_000 + "x" + ")" * 10_000


@pytest.fixture(autouse=True)
def _earlier(here: Path) -> None:
    """The outputs of an earlier run."""
    for name in ("old.png", "old.exr"):
        (here / name).write_bytes(b"an earlier picture")


@pytest.fixture
def uncompiled(tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch) -> None:
    """No program is kept, on the disk or in memory."""
    monkeypatch.setenv("CLFRACTAL_CACHE", str(tmp_path_factory.mktemp("empty")))
    monkeypatch.setenv("CLFRACTAL_LANES", "1")
    select.choose().loaded.clear()


def untouched(here: Path) -> bool:
    """No new file, and the old ones are as they were."""
    pictures = {name: (here / name).read_bytes() for name in ("old.png", "old.exr")}
    assert set(pictures.values()) == {b"an earlier picture"}
    others = [path.name for path in here.iterdir() if path.suffix != ".yaml" and path.name not in pictures]
    assert not others, others
    return True


@pytest.mark.parametrize(
    ("options", "parts"),
    [
        (["--set", "formula.name=mandelbul"], ["unknown formula 'mandelbul'; did you mean 'mandelbulb'?"]),
        (["--set", "camra.fov=3"], ["unknown key 'camra'; did you mean 'camera'?"]),
        (["--set", "camera.fow=3"], ["--set camera.fow: ", "unknown key 'fow'; did you mean 'fov'?"]),
        (["--set", "output.channels=[R, Q]"], ["unknown channel 'Q'", "iterations"]),
        (["--set", "output.channels=[R, itertions]"], ["did you mean 'iterations'?"]),
        (["--set", "renderer.type=volumetric"], ["--set renderer.type: ", "did you mean 'volume'?"]),
        (["--set", "renderer.type=raster"], ["raster", "cut_plane, surface, volume"]),
        (["--set", "formula.parameters.power=1e9"], ["--set formula.parameters.power: ", "at most"]),
        (["--set", "formula.parameters.pwer=2"], ["did you mean 'power'?"]),
        (["--set", "camera.target=[0, -3, 0]"], ["camera", "must differ"]),
        (["--set", "camera.up=[0, 2, 0]"], ["camera", "parallel to the view"]),
        (["--set", "camera.fov=.nan"], ["camera.fov", "finite"]),
        (["--set", "camera.fov=.inf"], ["camera.fov", "finite"]),
        (["--set", "camera.fov=400"], ["camera.fov", "must be below 180, got 400"]),
        (["--set", "renderer.step=0"], ["--set renderer.step: must be above 0, got 0"]),
        (["--set", "renderer.step=7"], ["--set renderer.step: must be at most the diameter of the bounds"]),
        (["--set", "renderer.points.count=8"], ["--set renderer.points.count: must be a square for a grid"]),
        (
            ["--set", "camera.focus_distance=-1"],
            ["camera.focus_distance", "in front of the camera", "got -1"],
        ),
        (
            ["--set", "lights=[{type: point, position: [0, 0, 0]}]"],
            ["--set lights: 0.position: must be outside the object"],
        ),
        (["--set", "coloring.palette=[{at: 0, color: [1, 1, 1]}]"], ["at least 2 entries, got 1"]),
        (["--set", "nothing"], ["must be KEY=VALUE"]),
        (["--size", "0x10"], ["--size: must be at least 1, got 0"]),
        (["--size", "1000000x10"], ["--size: must be at most"]),
        (["--size", "60000x60000"], ["--size: must be at most", "pixels"]),
        (["--size", "big"], ["--size: must be WIDTHxHEIGHT", "'big'"]),
        (["--region", "0,0,41,1"], ["--region: must lie inside the picture of 40 x 36 pixels"]),
        (["--region", "0,0,0,1"], ["--region: must lie inside"]),
        (["--region", "1,2,3"], ["--region: must be X,Y,WIDTH,HEIGHT"]),
        (["--samples", "0"], ["--samples: must be at least 1, got 0"]),
        (["--samples", "many"], ["clfractal render: ", "--samples", "integer"]),
        (["--precision", "float16"], ["--precision: must be", "float64"]),
        (["--device", "nosuch"], ["unknown device 'nosuch'", "0:0"]),
        (["--device", "17:0"], ["no device '17:0'", "0:0"]),
        (["--sampels", "3"], ["clfractal render: ", "--sampels"]),
        (["--stats", "nowhere/s.json"], ["nowhere/s.json: cannot be written: there is no folder"]),
    ],
)
def test_a_wrong_option(here: Path, clf: InProcess, options: list[str], parts: list[str]) -> None:
    ended = clf("render", "scene.yaml", "-o", "old.png", "-o", "old.exr", *options)
    assert ended.is_one_line(2, *parts)
    assert untouched(here)


@pytest.mark.parametrize(
    ("lines", "message"),
    [
        (
            "renderer:\n  step: 3",
            "6:9: renderer.step: must be at most the diameter of the bounds, 2.208, got 3",
        ),
        ("renderer:\n  points:\n    count: 10", "7:12: renderer.points.count: must be a square for a grid"),
        (
            "renderer: {noise: 0.1, samples: 9,\n  min_samples: 10}",
            "6:16: renderer.min_samples: must be at most samples (9), got 10",
        ),
        (
            "coloring:\n  palette:\n  - {at: 1, color: [0, 0, 0]}\n  - {at: 0, color: [0, 0, 0]}",
            "8:10: coloring.palette.1.at: must be at least 1, the value at the stop before, got 0",
        ),
        (
            "lights:\n- type: point\n  position: [0.1, 0, 0]",
            "7:13: lights.0.position: must be outside the object, where its light reaches something",
        ),
        ("environment:\n  intensity: 1", "6:3: environment: needs one of name, file or sky"),
        ("environment:\n  name: nowhere", "6:9: environment.name: unknown environment 'nowhere'; "),
        ("environment:\n  file: none.exr", "6:9: environment.file: none.exr "),
        (
            "environment:\n  file: ../none.exr",
            "6:9: environment.file: must be a path inside the scene's folder",
        ),
        ("environment:\n  file: old.exr", "6:9: environment.file: old.exr "),
    ],
)
def test_a_scene_that_cannot_work(here: Path, clf: InProcess, lines: str, message: str) -> None:
    (here / "wrong.yaml").write_text(SCENE + lines + "\n")
    ended = clf("render", "wrong.yaml", "-o", "old.png", "-o", "old.exr")
    assert ended.is_one_line(2, f"wrong.yaml:{message}")
    assert untouched(here)


@pytest.mark.parametrize(
    ("output", "message"),
    [
        ("x.gif", "x.gif: unknown extension '.gif'; known: .exr, .png, .jpg, .jpeg, .webp"),
        ("x", "x: needs an extension"),
        ("no/x.png", "no/x.png: cannot be written: there is no folder 'no'"),
        ("scene.yaml/x.png", "scene.yaml/x.png: cannot be written: 'scene.yaml' is not a folder"),
        ("/dev/full", "/dev/full: needs an extension"),
        ("folder.png", "folder.png: cannot be written: it is a folder"),
        ("/proc/x.png", "/proc/x.png: cannot be written"),  # a file system that takes no files
    ],
)
def test_an_output_that_cannot_be_written(here: Path, clf: InProcess, output: str, message: str) -> None:
    (here / "folder.png").mkdir()
    assert clf("render", "scene.yaml", "-o", "old.exr", "-o", output).is_one_line(2, message)
    (here / "folder.png").rmdir()
    assert untouched(here)


@pytest.mark.parametrize(
    ("expressions", "parts"),
    [
        ('["x*qq", "y", "z"]', ["9:14: formula.inline.map.0: unknown name 'qq'", "column 3"]),
        ('["x", "y"]', ["9:10: formula.inline.map: must have 3 expressions"]),
        ('["x/0", "y", "z"]', ["9:14: formula.inline.map.0: division by zero"]),
        ('["x/(2 - 2)", "y", "z"]', ["division by zero"]),
        (f'["{NESTED}", "y", "z"]', ["formula.inline.map.0: is too long"]),
        ('["' + "(" * 400 + "x" + ")" * 400 + '", "y", "z"]', ["formula.inline.map.0: "]),
        ('["x +", "y", "z"]', ["formula.inline.map.0: "]),
        ('[\'__import__("os").system("true")\', "y", "z"]', ["formula.inline.map.0: "]),
        (
            '["a", "y", "z"]\n    let: {a: "b", b: "a"}',
            ["formula.inline.let.a: 'a' uses 'b', which is defined after"],
        ),
        ('["a", "y", "z"]\n    let: {a: "a + x"}', ["formula.inline.let.a: "]),
    ],
)
def test_a_wrong_formula(here: Path, clf: InProcess, expressions: str, parts: list[str]) -> None:
    (here / "wrong.yaml").write_text(INLINE.format(map=expressions))
    assert clf("render", "wrong.yaml", "-o", "old.png").is_one_line(2, "wrong.yaml:", *parts)
    assert untouched(here)


def test_the_formulas_above_fail_for_what_they_say(here: Path, clf: InProcess) -> None:
    (here / "right.yaml").write_text(INLINE.format(map='["x*x - y*y - z*z", "2*x*y", "2*x*z"]'))
    works(clf("check", "right.yaml"))


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("nothing.yaml", "nothing.yaml: cannot be read: No such file or directory"),
        ("inside", "inside: cannot be read: No such file or directory; did you mean inside.yaml?"),
        ("/dev/zero", "/dev/zero: is not a regular file"),
        (".", ".: is a folder, not a file"),
        ("old.png", "old.png:"),
        ("picture", "picture:"),
    ],
)
def test_a_scene_that_cannot_be_read(here: Path, clf: InProcess, name: str, message: str) -> None:
    (here / "picture").write_bytes(b"\x89PNG\r\n\x1a\n")
    (here / "inside.yaml").write_text("version: 1")
    ended = clf("render", name, "-o", "old.exr")
    (here / "picture").unlink()
    assert ended.is_one_line(2, message)
    assert untouched(here)


def test_a_pipe_as_a_scene_is_not_waited_for(here: Path, clf: InProcess) -> None:
    os.mkfifo(here / "pipe.yaml")
    assert clf("check", "pipe.yaml").is_one_line(2, "pipe.yaml: is not a regular file")


@pytest.mark.parametrize("name", ["whole.exr", "whole.png"])
def test_a_picture_cut_short_as_a_scene(here: Path, clf: InProcess, name: str) -> None:
    works(clf("render", "scene.yaml", "-o", name, "--quiet"))
    whole = (here / name).read_bytes()
    (here / name).unlink()
    for length in (6, 100, 700, len(whole) // 2, len(whole) - 1):
        cut = here / f"cut{Path(name).suffix}"
        cut.write_bytes(whole[:length])
        ended = clf("render", cut.name, "-o", "old.exr")
        cut.unlink()
        assert ended.is_one_line(2, f"{cut.name}:")
    assert untouched(here)


def test_a_full_disk(here: Path, clf: InProcess) -> None:
    assert clf("render", "scene.yaml", "-o", "built.png", "--quiet").status == 0  # its program is there now
    (here / "built.png").unlink()
    for output in ("old.png", "old.exr"):
        with file_size_limit(4096):
            ended = clf("render", "scene.yaml", "-o", output, "--quiet")
        assert ended.is_one_line(2, f"{output}.partial: cannot be written: ")
        assert untouched(here)


@pytest.mark.usefixtures("uncompiled")
def test_no_room_for_what_the_compiler_is_told(here: Path, clf: InProcess) -> None:
    with file_size_limit(4096):
        ended = clf("render", "scene.yaml", "-o", "old.png", "--quiet")
    assert ended.is_one_line(2, "ulimit -f: allows files of 4096 bytes", "compiled programs")
    (here / "old.png.partial").unlink(missing_ok=True)
    assert untouched(here)


@pytest.mark.usefixtures("uncompiled")
def test_no_room_for_temporary_files(here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder is named that has none, and not one in it whose name nobody knows."""

    with monkeypatch.context() as patch:
        patch.setattr(Path, "write_text", raising(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))))
        ended = clf("render", "scene.yaml", "-o", "old.png", "--quiet")
    assert ended.is_one_line(
        2, f"{drivers_folder.path().parent}: has no room for temporary files: No space left"
    )
    (here / "old.png.partial").unlink(missing_ok=True)
    assert untouched(here)


def test_a_disk_that_is_full_when_the_picture_is_written(
    here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The work is kept: with space again, --resume only has to write the files."""

    def full(descriptor: int) -> None:
        if os.pread(descriptor, 8, 0) != b"CLFJRNL1":  # there was space for the work, not for the picture
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

    with monkeypatch.context() as patch:
        patch.setattr(os, "fsync", full)  # where a file system tells that a delayed write found no room
        for output in ("old.png", "old.exr"):
            ended = clf("render", "scene.yaml", "-o", output, "--quiet")
            assert ended.is_one_line(2, f"{output}: cannot be written: No space left on device")
            assert (here / output).read_bytes() == b"an earlier picture"
    ended = works(clf("render", "scene.yaml", "-o", "old.png", "--resume"))
    assert "nothing was left to render" in ended.err
    (here / "old.exr.partial").unlink()
    assert {path.name for path in here.iterdir()} == {"scene.yaml", "old.png", "old.exr"}


def test_standard_output_that_is_full(here: Path) -> None:
    with open("/dev/full", "wb") as full:
        ended = subprocess.run(
            command("check", "scene.yaml"), cwd=here, env=environment(), stdout=full, stderr=subprocess.PIPE
        )
    assert ended.returncode == 2
    assert ended.stderr == b"standard output: cannot be written: No space left on device\n"


def test_a_device_with_too_little_memory(here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    describe = select._describe

    def tiny(index: str, platform: object, device: object) -> select.DeviceInfo:
        return replace(describe(index, platform, device), memory=10_000, max_alloc=5_000)  # type: ignore[arg-type]

    monkeypatch.setattr(select, "_describe", tiny)
    monkeypatch.setattr(select, "_find", select._find.__wrapped__)  # anew, not as remembered
    ended = clf("render", "scene.yaml", "-o", "old.png")
    assert ended.is_one_line(2, "rendering needs ", " MiB of device memory, ", "has 0.0 MiB")
    assert untouched(here)


def test_a_kernel_that_does_not_build(here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    texts = surface.program_texts

    def broken(*arguments: object) -> list[ProgramText]:
        def changed(text: str) -> str:
            return text.replace("STAGE(find_interactions)", "__kernel vod find_interactions(STAGE_ARGUMENTS)")

        return [
            replace(each, flat=replace(each.flat, text=changed(each.flat.text)))
            for each in texts(*arguments)  # type: ignore[arg-type]
        ]

    monkeypatch.setattr(surface, "program_texts", broken)
    # However slow the machine is: a line about a long compilation is not what is tested.
    monkeypatch.setattr(program, "_REMARK_SECONDS", 600.0)
    monkeypatch.setattr(progress, "SILENT_SECONDS", 600.0)
    ended = clf("render", "scene.yaml", "-o", "old.png")
    assert ended.is_one_line(3, "find_interactions.cl:", "vod")
    told = clf("render", "scene.yaml", "-o", "old.png", "--verbose")
    assert told.status == 3
    assert " | STAGE(find_interactions)" in told.err.split("\n", 1)[1]
    assert untouched(here)


def test_a_driver_that_aborts(here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """The child process that compiles plays a driver whose compiler calls abort()."""
    clf("render", "scene.yaml", "-o", "warm.png", "--quiet")  # the lanes have been measured
    (here / "warm.png").unlink()
    monkeypatch.setenv("CLFRACTAL_TEST_ABORT", "surface")
    monkeypatch.setenv("CLFRACTAL_CACHE", str(here / "cache.yaml"))
    monkeypatch.setenv("CLFRACTAL_LANES", "1")
    ended = clf("render", "scene.yaml", "-o", "old.png", "--quiet")
    assert ended.is_one_line(3, "the driver aborted (signal 6) while building")
    assert untouched(here)


def test_a_mistake_of_ours_is_one_line_too(
    here: Path, clf: InProcess, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(surface, "program_texts", raising(IndexError("of an array\nwith two lines")))
    ended = clf("render", "scene.yaml", "-o", "old.png")
    assert ended.is_one_line(3, "internal error", "IndexError: of an array with two lines")
    assert "Traceback" in clf("render", "scene.yaml", "-o", "old.png", "--verbose").err
    assert untouched(here)
