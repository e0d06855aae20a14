"""`clfractal scenes`, `new`, `watch`, and presets of quality."""

from __future__ import annotations

import os
import shlex
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.cli import show_scenes as scenes_command
from clfractal.cli import watch
from clfractal.cli.new import scene_text
from clfractal.engine import thumbnails
from clfractal.engine.framing import Framing
from clfractal.engine.quality import PRESETS, with_quality
from clfractal.files.png import read_png_pixels
from clfractal.files.watching import Watched
from tests.shell import SCENE, InProcess, works

REFUSED = {
    "scenes abalon": "unknown scene 'abalon'; did you mean 'abalone'?",
    "scenes a b": "prints one scene, got 2",
    "scenes abalon --sheet s.png": "did you mean 'abalone'?",
    "scenes --sheet s.gif": "s.gif: unknown extension '.gif'",
    "new x --formula mandelbub": "--formula: unknown formula 'mandelbub'; did you mean 'mandelbulb'?",
    "new x --formula ../f.yaml": "--formula: must lie in the folder of the scene",
    "new x --formula f.yaml": "f.yaml:",
    "new none/x": "none",
    **{f"new {name}": "NAME: must name a file" for name in ("''", ".", "..", "/")},
    "watch none.yaml": "none.yaml: cannot be read",
    "watch scene.yaml --size big": "--size: must be WIDTHxHEIGHT",
    "watch scene.yaml --set camera.fow=3": "--set camera.fow: unknown key",
    "watch scene.yaml --quality god": "--quality: unknown quality 'god'",
    "watch scene.yaml --device abacus": "abacus",
    # What no change of the scene can mend: waiting for one would be in vain.
    "watch scene.yaml -o scene.yaml": "scene.yaml: unknown extension",
    "watch scene.yaml -o none/out.png": "there is no folder 'none'",
    "watch scene.png": "scene.png: would be overwritten",
}


@pytest.mark.parametrize("line", REFUSED)
def test_what_is_refused(clf: InProcess, line: str) -> None:
    Path("f.yaml").write_text("variables: [x, y, z]\nmap: [x +, y, z]\n")
    Path("scene.png").write_text(SCENE)
    assert clf(*shlex.split(line)).is_one_line(2, REFUSED[line])
    assert sorted(path.name for path in Path().iterdir()) == ["f.yaml", "scene.png", "scene.yaml"]


# --- scenes ---


def test_every_scene_has_a_line_and_a_text(clf: InProcess) -> None:
    lines = clf("scenes").out.splitlines()
    assert [line.split()[0] for line in lines] == list(scenes_command.scene_files())
    for line in lines:
        assert len(line) <= 110
        assert len(line.split(maxsplit=1)[1]) > 10
    for name in ("abalone", "cut_geode"):
        assert clf("scenes", name).out == scenes_command.scene_files()[name].read_text("utf-8")


def test_a_sheet_goes_on_where_it_was_interrupted(
    clf: InProcess, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The scenes of the test stand for those of the program, and its cache folder holds nothing else."""
    for number in (1, 2, 3):
        Path(f"s{number}.yaml").write_text(f"# Number {number}\n" + SCENE.replace("8}", f"{4 + number}}}"))
    files = {f"s{number}": tmp_path / f"s{number}.yaml" for number in (1, 2, 3)}
    monkeypatch.setattr(scenes_command, "scene_files", lambda: files)
    monkeypatch.setattr(thumbnails, "SIZE", (48, 27))
    kept: dict[str, thumbnails.Pixels] = {}
    monkeypatch.setattr(thumbnails, "load", kept.get)
    monkeypatch.setattr(thumbnails, "store", kept.__setitem__)
    render = clfractal.Engine.render
    rendered: list[int] = []

    def interrupted(engine: clfractal.Engine, *arguments: object, **settings: object) -> object:
        if len(rendered) == 2:
            rendered.clear()
            raise KeyboardInterrupt
        rendered.append(1)
        return render(engine, *arguments, **settings)  # type: ignore[arg-type]

    monkeypatch.setattr(clfractal.Engine, "render", interrupted)
    with pytest.raises(KeyboardInterrupt):
        clf("scenes", "--sheet", "sheet.png")
    assert not Path("sheet.png").exists()
    assert len(kept) == 2
    ended = works(clf("scenes", "--sheet", "sheet.png"))
    assert "s3: 3 of 3" in ended.err
    assert "s1: " not in ended.err
    sheet = read_png_pixels("sheet.png")
    assert sheet.shape == (27 + 16, 3 * 56 + 8, 3)
    # Each picture is in its place, but for the name in its corner.
    for number, picture in enumerate(kept.values()):
        place = sheet[8 + 14 : 8 + 27, 8 + 56 * number : 8 + 56 * number + 48]
        np.testing.assert_array_equal(place, picture[14:])
    few = clf("scenes", "s2", "--sheet", "few.png", "--quiet")
    assert few.err == ""
    assert read_png_pixels("few.png").shape == (27 + 16, 48 + 16, 3)
    assert clf("scenes", "--sheet", "s1.yaml").status == 2


# --- new ---


def test_a_new_scene_fills_the_picture(clf: InProcess) -> None:
    ended = works(clf("new", "first", "--formula", "mandelbulb"))
    assert ended.out == ""
    text = Path("first.yaml").read_text("utf-8")
    assert text.startswith("# First\n")
    scene = clfractal.load_scene(Path("first.yaml"))
    assert scene.formula.name == "mandelbulb"
    small = scene.model_copy(update={"image": {"width": 64, "height": 36}})
    covered = clfractal.render(small, samples=1, channels=["A"])["A"] > 0
    rows, columns = np.nonzero(covered)
    share = max(np.ptp(rows) / 36, np.ptp(columns) / 64)
    assert 0.72 < share < 0.97
    # It lies in the middle.
    assert abs((rows.min() + rows.max()) / 2 - 17.5) <= 3
    assert abs((columns.min() + columns.max()) / 2 - 31.5) <= 3
    # Nothing is ever replaced.
    assert clf("new", "first.yaml").is_one_line(2, "first.yaml: exists already and is not replaced")
    assert Path("first.yaml").read_text("utf-8") == text
    assert clf("new", "none", "--formula", "none").is_one_line(
        2, "--formula: none is for scenes of objects alone"
    )
    assert not Path("none.yaml").exists()


@pytest.mark.parametrize("formula", ["apollonian", "kaliset"])
def test_a_set_that_fills_its_bounds_is_seen_from_within(clf: InProcess, formula: str) -> None:
    """Elsewhere one sees but the ball in which it was cut off."""
    works(clf("new", "hall", "--formula", formula))
    scene = clfractal.load_scene(Path("hall.yaml"))
    center, radius = scene.bounds
    assert np.linalg.norm(np.subtract(scene.camera.position, center)) < 0.7 * radius
    assert scene.fog is not None
    assert not any(light.shadow for light in scene.lights)
    small = scene.model_copy(update={"image": {"width": 64, "height": 36}})
    film = clfractal.render(small, samples=1, channels=["A", "Z"])
    seen = film["A"] > 0.5
    assert seen.mean() > 0.6
    assert np.median(film["Z"][seen]) > 0.1 * radius
    assert film.remarks == ()


def test_commands_in_a_new_scene_can_be_copied() -> None:
    found = Framing(5, (0, 0, 0), 30, 20, 3, ((1, 1, -1), (-1, 0, 0)), "viridis", 1, 0, 0)
    for file, shown in (("first.yaml", "first.yaml"), ("my scene.yaml", '"my scene.yaml"')):
        text = scene_text(file, {"name": "mandelbulb"}, found)
        for command in ("render", "watch", "view"):
            assert f"`clfractal {command} {shown}`" in text


# --- watch ---


def scripted(monkeypatch: pytest.MonkeyPatch, *steps: Callable[[], None]) -> None:
    """Whenever nothing is left to do, the next step happens; after the last one Ctrl-C."""
    wait, left = watch._wait, list(steps)

    def act(watched: Watched) -> None:
        if not left:
            raise KeyboardInterrupt
        left.pop(0)()
        wait(watched)

    monkeypatch.setattr(watch, "_wait", act)


def test_a_picture_follows_its_scene_and_its_formula(clf: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    formula = "variables: [x, y, z]\nmap: [x*x - y*y - z*z, 2*x*y, 2*x*z]\nadd: point\ndegree: 2\n"
    formula += "bounds: {center: [0, 0, 0], radius: 2}\nbailout: 4\n"
    text = SCENE.replace("name: mandelbulb", "file: f.yaml")
    pictures: list[thumbnails.Pixels] = []

    def write(name: str, content: str) -> Callable[[], None]:
        def step() -> None:
            pictures.append(read_png_pixels("out.png"))
            beside = Path(f"{name}.new")
            beside.write_text(content)
            os.replace(beside, name)

        return step

    write_first = [Path("f.yaml").write_text(formula), Path("scene.yaml").write_text(text)]
    assert all(write_first)
    scripted(
        monkeypatch,
        write("scene.yaml", text.replace("-3", "-4")),
        write("scene.yaml", text.replace("camera", "camra")),
        write("scene.yaml", text),
        write("f.yaml", formula.replace("2*x*z]", "2*x*z")),
        write("f.yaml", formula.replace("2*x*z]", "-2*x*z - z]")),
    )
    with pytest.raises(KeyboardInterrupt):
        clf("watch", "scene.yaml", "-o", "out.png", "--size", "24x16")
    pictures.append(read_png_pixels("out.png"))
    told = clf.capture.readouterr().err
    assert told.count("out.png: 24 x 16, ") == 4
    assert "scene.yaml:4:1: unknown key 'camra'; did you mean 'camera'?" in told
    assert "f.yaml:" in told
    assert "Traceback" not in told
    first, farther, broken, again, wrong, other = pictures
    assert (first != farther).any()
    assert (farther == broken).all()  # what is wrong leaves the picture as it was
    assert (again == first).all()
    assert (wrong == first).all()
    assert (other != first).any()
    assert sorted(path.name for path in Path().iterdir()) == ["f.yaml", "out.png", "scene.yaml"]


def test_a_change_ends_a_render(tmp_path: Path) -> None:
    file = tmp_path / "scene.yaml"
    file.write_text("1")
    cancelled = []

    def changed_meanwhile() -> None:
        with watch._ended_by_change(Watched([file], interval=0.01)) as token:
            cancelled.append(token.cancelled)
            file.write_text("22")
            for _ in range(6000):
                if token.cancelled:
                    break
                time.sleep(0.02)
            cancelled.append(token.cancelled)

    with pytest.raises(clfractal.Stopped):
        changed_meanwhile()
    assert cancelled == [False, True]
    with watch._ended_by_change(Watched([file], interval=0.01)) as token:
        assert not token.cancelled


# --- quality ---


def test_presets_set_samples_and_noise_and_nothing_else() -> None:
    scene = clfractal.load_scene(
        SCENE + "renderer: {samples: 5, noise: 0.1, min_samples: 4, detail: 3, max_steps: 70}\n"
    )
    for name, preset in PRESETS.items():
        found = with_quality(scene, name)
        renderer = found.surface
        assert (renderer.samples, renderer.noise) == (preset.samples, preset.noise)
        assert renderer.min_samples is None
        assert (renderer.max_steps, renderer.detail) == (70, 3)
        assert found.model_copy(update={"renderer": scene.renderer}) == scene
    with pytest.raises(
        clfractal.SceneError, match=r"^quality: unknown quality 'god'; did you mean 'good'\?$"
    ):
        with_quality(scene, "god")


def test_presets_of_other_renderers_and_of_views() -> None:
    plane = clfractal.load_scene(
        SCENE + "renderer: {type: cut_plane}\nlayout: {views: [{renderer: {samples: 9}}, {}]}\n"
    )
    found = with_quality(plane, "good")
    assert found.renderer.samples == 16
    assert found.layout is not None
    own = found.layout.views[0].renderer
    assert own is not None
    assert (own.samples, own.noise) == (16, 0.02)
    kept = with_quality(plane, "good", kept=["layout.views.0.renderer", "renderer.samples"])
    assert kept.renderer.samples == 1
    assert kept.renderer.noise == 0.02
    assert kept.layout == plane.layout
    for section in ("layout", "layout.views", "layout.views.0"):
        assert with_quality(plane, "good", kept=[section]).layout == plane.layout


def test_explicit_options_win(clf: InProcess) -> None:
    works(
        clf(
            "render",
            "scene.yaml",
            "-o",
            "out.png",
            "--quality",
            "good",
            "--set",
            "renderer.noise=0.3",
            "--samples",
            "2",
        )
    )
    renderer = clfractal.load_scene(Path("out.png")).surface
    assert (renderer.samples, renderer.noise) == (2, 0.3)
    film = clfractal.render(SCENE, samples=2, quality="good", channels=["R", "G", "B"])
    assert clfractal.load_scene(str(film.header["scene"])).surface.noise == 0.02
    with pytest.raises(clfractal.SceneError, match=r"^quality: unknown quality 'best'"):
        clfractal.render(SCENE, quality="best")
