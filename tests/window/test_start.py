"""What keeps the window from opening: one line, the status, and no window."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.shell import SCENE, Ended, environment, process
from tests.window.display import Display

LIBRARIES = ("glfw", "OpenGL", "imgui_bundle")


def view(display: Display | None, folder: Path, *arguments: str, **extra: str) -> Ended:
    """Runs `clfractal view` to its end."""
    (folder / "s.yaml").write_text(SCENE)
    shown = {"DISPLAY": display.name if display is not None else "", "WAYLAND_DISPLAY": ""}
    return process(["view", *arguments], folder, {"CLFRACTAL_DEVICE": "pthread", **shown, **extra})


def test_without_a_display(folder: Path) -> None:
    view(None, folder, "s.yaml").is_one_line(3, "display")


def test_with_a_display_that_does_not_answer(folder: Path) -> None:
    view(None, folder, "s.yaml", DISPLAY=":4711").is_one_line(3, "display")


@pytest.mark.parametrize("extra", [{"MESA_GL_VERSION_OVERRIDE": "2.1"}, {"MESA_GL_VERSION_OVERRIDE": "3.2"}])
def test_with_an_opengl_that_is_too_old(display: Display, folder: Path, extra: dict[str, str]) -> None:
    view(display, folder, "s.yaml", **extra).is_one_line(3, "OpenGL 3.3")


def test_without_any_opengl_driver(display: Display, folder: Path) -> None:
    nowhere = str(folder / "nowhere")
    extra = {"LIBGL_DRIVERS_PATH": nowhere, "GALLIUM_DRIVER": "none", "__GLX_VENDOR_LIBRARY_NAME": "none"}
    view(display, folder, "s.yaml", **extra).is_one_line(3, "OpenGL 3.3")


@pytest.mark.parametrize("library", LIBRARIES)
def test_without_a_library(display: Display, folder: Path, library: str) -> None:
    """A file that is found first takes the place of the library, and cannot be imported."""
    blocker = folder / "blocker"
    blocker.mkdir()
    (blocker / "sitecustomize.py").write_text(
        "import sys\n"
        "class Blocker:\n"
        "    def find_spec(self, name, path=None, target=None):\n"
        f"        if name == {library!r}:\n"
        f"            raise ModuleNotFoundError('No module named {library}', name=name)\n"
        "sys.meta_path.insert(0, Blocker())\n"
    )
    (folder / "s.yaml").write_text(SCENE)
    home = environment()["PYTHONPATH"]
    extra = {"DISPLAY": display.name, "PYTHONPATH": f"{blocker}:{home}"}
    ended = process(["view", "s.yaml"], folder, extra)
    ended.is_one_line(3, "pip install 'clfractal[viewer]'", library)


@pytest.mark.parametrize(
    ("arguments", "parts"),
    [
        (["missing.yaml"], ["missing.yaml"]),
        (["s.yaml", "--size", "12"], ["--size"]),
        (["s.yaml", "--size", "1x1"], ["--size"]),
        (["s.yaml", "--set", "camera.fov=wide"], ["camera.fov"]),
        (["s.yaml", "--set", "camera.fow=40"], ["camera.fow", "fov"]),
        (["s.yaml", "--stereo", "anaglif"], ["anaglif"]),
        (["s.yaml", "--device", "9:9"], ["9:9"]),
        (["s.yaml", "--shot", "picture.jpg"], ["picture.jpg"]),
        (["s.yaml", "--shot", "no/folder/picture.png"], ["no/folder"]),
        (["s.yaml", "--save", "scene.png"], ["scene.png"]),
        (["s.yaml", "--play", "missing.jsonl"], ["missing.jsonl"]),
        (["s.yaml", "--record", "no/folder/events"], ["no/folder"]),
        (["wrong.yaml"], ["wrong.yaml:2"]),
        (["s.yaml", "--what"], ["--what"]),
    ],
)
def test_wrong_input_is_told_before_a_window_opens(
    folder: Path, arguments: list[str], parts: list[str]
) -> None:
    """There is no display: whatever is looked at after it would be status 3."""
    (folder / "wrong.yaml").write_text("version: 1\nformula: {name: mandelblub}\ncamera: {}\n")
    view(None, folder, *arguments).is_one_line(2, *parts)


def test_a_monitor_that_is_not_there(display: Display, folder: Path) -> None:
    view(display, folder, "s.yaml", "--monitors", "7").is_one_line(2, "--monitors", "7")


def test_a_wrong_settings_file_is_told_and_the_defaults_are_used(display: Display, folder: Path) -> None:
    (folder / "settings.yaml").write_text("orbits: free\n")
    settings = str(folder / "settings.yaml")
    ended = view(display, folder, "s.yaml", "--shot", "out.png", CLFRACTAL_SETTINGS=settings)
    assert ended.status == 0
    assert ended.err.count("\n") == 1
    assert "settings.yaml:1" in ended.err
    assert (folder / "out.png").exists()
