"""Recorded events, played again, lead to the same scene; and what a window shows after them is the shell's picture."""

from __future__ import annotations

from pathlib import Path

from clfractal.scene.load import load_scene
from tests.pictures import read_picture
from tests.window.display import Display
from tests.window.driver import RIGHT, Window, differs, wait_for
from tests.window.film import film
from tests.window.scenes import SPHERE

PLAIN = ("--size", "480x360", "--no-panels")


def test_played_events_lead_to_the_same_scene(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SPHERE)
    with Window(display, folder, "s.yaml", *PLAIN, "--record", "events.jsonl") as window:
        window.drag((200, 150), (260, 190))
        window.still()
        window.drag((240, 180), (200, 150), RIGHT)
        window.wheel(220, 170, 2)
        window.still()
        window.keys("7", "equal", "n")
        window.still()
        window.keys("alt+z", "ctrl+z")
        window.still()
        recorded = load_scene(window.save())
        window.keys("ctrl+q")
        assert window.ended().status == 0
    (folder / "saved.yaml").unlink()
    # It takes the size of the recording, and closes after its last event.
    with Window(display, folder, "s.yaml", "--no-panels", "--play", "events.jsonl", open=False) as window:
        assert window.ended(60).status == 0
    played = load_scene(folder / "saved.yaml")
    # Depths under the pointer may come from a picture of another coarseness.
    assert played.output == recorded.output
    assert played.stereo == recorded.stereo
    for one, other in zip(played.camera.position, recorded.camera.position, strict=True):
        assert abs(one - other) < 0.05


def test_a_shot_after_events(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SPHERE)
    (folder / "events.jsonl").write_text(
        '{"format": "clfractal events", "version": 1, "size": [480, 360]}\n'
        '{"at": 0.5, "move": [200.0, 150.0]}\n'
        '{"at": 0.6, "button": [0, 1, 0]}\n'
        '{"at": 0.7, "move": [260.0, 150.0]}\n'
        '{"at": 0.8, "button": [0, 0, 0]}\n'
        '{"at": 1.0, "key": [83, 39, 1, 2]}\n'
        '{"at": 1.1, "key": [83, 39, 0, 2]}\n'
    )
    given = [*PLAIN, "--play", "events.jsonl", "--shot", "out.png"]
    with Window(display, folder, "s.yaml", *given, open=False) as window:
        assert window.ended(60).status == 0
    shown, expected = read_picture(folder / "out.png"), film(folder, "saved.yaml", (480, 360))
    assert differs(shown[120:], expected[120:]) == ""  # above there is a message
    assert load_scene(folder / "saved.yaml").camera != load_scene(folder / "s.yaml").camera


def test_a_crash_leaves_a_recording_that_can_be_played(display: Display, folder: Path) -> None:
    (folder / "s.yaml").write_text(SPHERE)
    events = folder / "events.jsonl"
    with Window(display, folder, "s.yaml", *PLAIN, "--record", events) as window:
        window.drag((200, 150), (260, 190))
        window.still(1.5)
        window.drag((200, 150), (260, 190))
        wait_for(lambda: '"button"' in events.read_text(), "the recording")
        window.kill()
    with Window(display, folder, "s.yaml", *PLAIN, "--play", events, open=False) as window:
        assert window.ended(60).status == 0
