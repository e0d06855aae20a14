"""Scenes whose light goes along paths, in a real window: pictures come while one drags, and the end is the shell's."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from tests.window.changes import changes, seen
from tests.window.display import Display
from tests.window.driver import Window, wait_for
from tests.window.scenes import SURFACE

pytestmark = pytest.mark.quiet

PATHS = SURFACE.replace(
    "material: {ambient: 0.02, diffuse: 0.9, specular: 0.3, shininess: 35}",
    """lighting: {mode: path}
environment: {name: dusk}
materials:
  glass: {transmission: {weight: 1}, specular: {roughness: 0}}
material: {name: glass}""",
)


def test_pictures_come_while_a_lit_scene_is_turned(display: Display, folder: Path) -> None:
    """Right after the window has come, and for nearly two seconds, as somebody looks around."""
    (folder / "s.yaml").write_text(PATHS.replace("samples: 3", "samples: 16"))
    with Window(display, folder, "s.yaml", "--size", "1280x720") as window:
        wait_for(lambda: seen(window).any(), "the first picture")
        window.move(700, 400)
        x, y = (each + offset for each, offset in zip(window.place[:2], (700, 400), strict=True))
        script: list[object] = ["mousemove", x, y, "sleep", 0.1, "mousedown", 1]
        for step in range(1, 39):
            script += ["sleep", 0.05, "mousemove", x + 3 * step, y + step % 5]
        script += ["sleep", 0.05, "mouseup", 1]
        found, end = changes(window, script, 2.0)
        told = f"pictures at {found}, the end at {end}"
        during = [at for at in found if at < end]
        assert len(during) >= 6, told
        assert max(after - before for before, after in pairwise([0.0, *during, end])) < 1.5, told
        assert window.process.poll() is None
