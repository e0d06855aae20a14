"""No command and no film replaces a file that was read for the picture, or another of its outputs."""

from __future__ import annotations

import os
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import get_args, get_type_hints

import numpy as np
import pytest

import clfractal
from clfractal.cli.program import app
from clfractal.files import resources
from clfractal.files.exr import write_exr
from clfractal.files.inputs import noting, refuse_overwriting
from clfractal.files.volume_file import Volume, write_volume
from clfractal.scene.load import load_scene, read_scene
from tests.exchange.files import settings
from tests.shell import SCENE, InProcess

VOLUME = SCENE + "renderer: {type: volume, file: scan.nrrd}\n"
PLANE = SCENE + "renderer: {type: cut_plane, plane: {width: 3, height: 3}}\n"


@pytest.fixture(autouse=True)
def _files(here: Path) -> None:
    """Scenes of every kind, and the files that they name."""
    shutil.copy(resources.folder("formulas/library") / "mandelbulb.yaml", here / "own.yaml")
    (here / "formula.yaml").write_text(SCENE.replace("name: mandelbulb", "file: own.yaml"))
    rows = {name: np.ones((4, 8), np.float32) for name in "RGB"}
    box = {"display": (8, 4), "region": (0, 0, 8, 4), "channels": tuple("RGB"), "half": set()}
    write_exr(here / "sky.exr", [rows], header={}, **box)  # type: ignore[arg-type]
    (here / "sky.yaml").write_text(SCENE + "environment: {file: sky.exr}\n")
    (here / "views.yaml").write_text(
        SCENE + "layout: {views: [{}, {environment: {file: sky.exr}}], columns: 2}\n"
    )
    grid = np.arange(64, dtype=np.uint8).reshape(4, 4, 4)
    volume = Volume(grid, np.zeros(3), np.eye(3))
    write_volume(here / "scan.nrrd", volume)
    write_volume(here / "scan.npy", volume)
    (here / "volume.yaml").write_text(VOLUME)
    (here / "array.yaml").write_text(VOLUME.replace("scan.nrrd", "scan.npy"))
    (here / "plane.yaml").write_text(PLANE)
    (here / "stereo.yaml").write_text(SCENE + "stereo: {mode: pair}\n")
    # A picture's name, but YAML inside; and names that outputs of other names lead to.
    for name in (
        "scene.png",
        "out_L.png",
        "out.exr.partial",
        "out.exr.right.view2.partial",
        "slice_0002.exr",
    ):
        text = PLANE if name.startswith("slice") else SCENE
        (here / name).write_text(text)
    shutil.copy(here / "stereo.yaml", here / "out_R.png")
    for name in ("moving.yaml", "frame_1.png"):
        (here / name).write_text(SCENE + "animation: {frames: 2}\n")
    (here / "track.wav").write_bytes(b"RIFF1234WAVE")
    (here / "sound.csv").symlink_to("track.wav")
    (here / "link.png").symlink_to("scene.yaml")
    (here / "link.ply").symlink_to("scan.nrrd")
    (here / "shipped.png").symlink_to(resources.folder("scenes") / "mandelbulb.yaml")
    (here / "deep").symlink_to(".")
    (here / "folder").mkdir()
    os.link(here / "sky.exr", here / "hard.exr")
    # A settings file of Mandelbulber by a scene's name, which is where its scene may go.
    (here / "hall.yaml").write_text(settings("formula_1 2;"))


def contents(here: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in sorted(here.iterdir()) if path.is_file()}


READ = "would be overwritten"
TWICE = "would be written twice"
# What is asked for, and what is said of which file.
REFUSED = {
    "render scene.yaml -o out.png --stats scene.yaml": f"scene.yaml: {READ}, but it is read for this",
    "render formula.yaml -o out.png --stats own.yaml": f"own.yaml: {READ}",
    "render formula.yaml -o out.png --stats deep/own.yaml": f"deep/own.yaml: {READ}, but it is the file 'own.yaml'",
    "render scene.yaml -o out.png --stats out.png": f"out.png: {TWICE}",
    "render scene.yaml -o out.png --stats deep/out.png": f"deep/out.png: {TWICE}, also as 'out.png'",
    "render scene.yaml -o out.png -o out.png": f"out.png: {TWICE}",
    "render scene.yaml -o out.png --stats out.png.partial": f"out.png.partial: {TWICE}",
    "render scene.yaml -o new.png --stats ./new.png": f"new.png: {TWICE}",
    "render scene.yaml -o link.png": f"link.png: {READ}, but it is the file 'scene.yaml'",
    "render sky.yaml -o sky.exr": f"sky.exr: {READ}",
    "render sky.yaml -o hard.exr": f"hard.exr: {READ}, but it is the file 'sky.exr'",
    "render sky.yaml -o deep/sky.exr": f"deep/sky.exr: {READ}",
    "render views.yaml -o sky.exr": f"sky.exr: {READ}",
    "render scene.png -o scene.png": f"scene.png: {READ}",
    "render scene.png": f"scene.png: {READ}",
    "render volume.yaml -o out.png --stats scan.nrrd": f"scan.nrrd: {READ}",
    "render out_R.png -o out.png": f"out_R.png: {READ}",
    "render stereo.yaml -o out.png --stats out_L.png": f"out_L.png: {TWICE}",
    "render out.exr.partial -o out.exr": f"out.exr.partial: {READ}",
    "render out.exr.right.view2.partial -o out.exr": f"out.exr.right.view2.partial: {READ}",
    "slices slice_0002.exr -o slice.exr": f"slice_0002.exr: {READ}",
    "slices plane.yaml -o slice.png -o slice.png": f"slice_0001.png: {TWICE}",
    "animate frame_1.png -o frame_#.png": f"frame_1.png: {READ}",
    "animate moving.yaml -o f#.png -o f#.png": f"f0.png: {TWICE}",
    "animate frame_1.png --preview frame_1.png": f"frame_1.png: {READ}",
    "animate moving.yaml -o f.mp4 --stats f.mp4": f"f.mp4: {TWICE}",
    "animate frame_1.png -o f.mp4 --stats frame_1.png": f"frame_1.png: {READ}",
    "animate moving.yaml -o f.mp4 -o f.mp4": f"f.mp4: {TWICE}",
    "sound track.wav -o deep/sound.csv": f"deep/sound.csv: {READ}, but it is the file 'track.wav'",
    "scenes --sheet shipped.png": f"shipped.png: {READ}, but it is the file",
    "voxelize volume.yaml -o scan.nrrd": f"scan.nrrd: {READ}",
    "voxelize array.yaml -o scan.npy": f"scan.npy: {READ}",
    "mesh volume.yaml -o link.ply": f"link.ply: {READ}, but it is the file 'scan.nrrd'",
    "mesh scan.nrrd -o link.ply": f"link.ply: {READ}, but it is the file 'scan.nrrd'",
    "vary scene.yaml -o folder --sheet folder/scene-01.png": f"folder/scene-01.png: {TWICE}",
    "find scene.yaml -o folder --sheet folder/scene-01.png": f"folder/scene-01.png: {TWICE}",
    "import hall.yaml -o hall.yaml": f"hall.yaml: {READ}",
    "import hall.yaml -o deep/hall.yaml": f"deep/hall.yaml: {READ}, but it is the file 'hall.yaml'",
    "view scene.png --shot scene.png": f"scene.png: {READ}",
    "view scene.yaml --record scene.yaml": f"scene.yaml: {READ}",
    "view formula.yaml --save own.yaml": f"own.yaml: {READ}",
    "view scene.yaml --save scene.yaml --record scene.yaml": f"scene.yaml: {READ}",
    "view scene.yaml --save new.yaml --record new.yaml": f"new.yaml: {TWICE}",
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_refused(here: Path, clf: InProcess, line: str) -> None:
    before = contents(here)
    assert clf(*line.split()).is_one_line(2, REFUSED[line])
    assert contents(here) == before


# Options that take a file which is not written, or a new one in a folder.
_NOT_WRITTEN = {("view", "--play"), ("import", "--formulas")}
# A command that checks its outputs as `render` does, tells what is wrong, and waits for another scene.
_WAITS = {("watch", "--output")}
# Options whose command reads no file.
_READS_NOTHING = {("bench", "--json")}


def _options() -> Iterator[tuple[str, tuple[str, ...]]]:
    """Each command's options that take a path."""
    for command in app.registered_commands:
        assert command.callback is not None
        for hint in get_type_hints(command.callback, include_extras=True).values():
            for option in get_args(hint)[1:]:
                if "Path" in str(get_args(hint)[0]):
                    # Typer keeps an annotation's first name where it keeps defaults.
                    # A word of Python's own has an underscore after it.
                    yield command.callback.__name__.rstrip("_"), (option.default, *option.param_decls)


def test_every_option_that_writes_a_file_is_tried_above() -> None:
    options = list(_options())
    assert ("render", ("--stats",)) in options
    assert ("render", ("-o", "--output")) in options
    forgotten = [
        (command, names)
        for command, names in options
        if not any((command, name) in _NOT_WRITTEN | _READS_NOTHING | _WAITS for name in names)
        and not any(line.split()[0] == command and set(names) & set(line.split()) for line in REFUSED)
    ]
    assert not forgotten


def test_what_may_be_written(here: Path) -> None:
    refuse_overwriting(["new.png", "old.png", "deep/other.png", "New.png"], ["scene.yaml", "missing.yaml"])
    assert not [path.name for path in here.iterdir() if path.name.startswith(".")]


def test_names_that_a_file_system_may_not_tell_apart(here: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Both kinds of file systems, whichever this one is."""
    refuse_overwriting(["a.png", "\u00e9.png", "b.png"])
    for one, two in (("a.png", "A.PNG"), ("\u00e9.png", "e\u0301.png")):
        monkeypatch.setattr("clfractal.files.inputs._differ", lambda *_: True)
        refuse_overwriting([one, two])
        monkeypatch.setattr("clfractal.files.inputs._differ", lambda *_: False)
        with pytest.raises(clfractal.FileError, match=TWICE):
            refuse_overwriting([one, two])


def test_a_scene_knows_the_files_that_it_was_read_from(here: Path) -> None:
    def names(source: str) -> list[str]:
        return [path.name for path in load_scene(Path(source)).files if path.parent == here]

    assert names("scene.yaml") == ["scene.yaml"]
    assert names("formula.yaml") == ["formula.yaml", "own.yaml"]
    assert names("views.yaml") == ["views.yaml", "sky.exr"]
    assert names("array.yaml") == ["array.yaml", "scan.npy", "scan.npy.json"]
    assert load_scene(SCENE).files == ()
    scene = load_scene(read_scene(Path("sky.yaml")))
    other = scene.model_copy(update={"image": {"width": 8, "height": 8}})
    assert [path.name for path in other.placed(Path("elsewhere")).files] == ["sky.yaml", "sky.exr"]


def test_a_detached_header_names_its_data(here: Path) -> None:
    head, data = (here / "scan.nrrd").read_bytes().split(b"\n\n", 1)
    (here / "values.raw").write_bytes(data)
    (here / "scan.nhdr").write_bytes(head + b"\ndata file: values.raw\n\n")
    (here / "detached.yaml").write_text(VOLUME.replace("scan.nrrd", "scan.nhdr"))
    files = [path.name for path in load_scene(Path("detached.yaml")).files if path.parent == here]
    assert files == ["detached.yaml", "scan.nhdr", "values.raw"]


def test_lists_within_lists(here: Path) -> None:
    with noting() as outer:
        with noting() as inner:
            read_scene(Path("scene.yaml"))
        read_scene(Path("plane.yaml"))
    read_scene(Path("sky.yaml"))
    assert [path.name for path in inner] == ["scene.yaml"]
    assert [path.name for path in outer] == ["scene.yaml", "plane.yaml"]


def test_films(here: Path) -> None:
    before = contents(here)
    film = clfractal.render(Path("sky.yaml"))
    for name in ("sky.exr", "deep/sky.exr", "hard.exr"):
        with pytest.raises(clfractal.FileError, match=f"^{name}: {READ}"):
            film.save(name)
    left, right = clfractal.render_pair(Path("out_R.png"))
    for eye in (left, right):
        with pytest.raises(clfractal.FileError, match=f"^out_R.png: {READ}"):
            eye.save("out_R.png")
    assert contents(here) == before
    film.save("new.png")
    film.save("new.png")
    assert isinstance(film, clfractal.Framebuffer)
    assert len(contents(here)) == len(before) + 1
