"""`clfractal check`: the scene with every default filled in, and where the eyes of a stereo scene are."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.commands.pipes import piped
from clfractal.commands.shell import Shell
from clfractal.errors import SceneError, Where, speaking_of
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt


def check_scene(
    source: str, overrides: tuple[str, ...], shell: Shell, *, parallax: bool, device: str | None
) -> None:
    """Prints a scene with all defaults; remarks about stereo come first, as comments, so that the output is a scene.

    Args:
        parallax: whether to measure a stereo scene's depth (which needs a device) and print the range of parallax.

    Raises:
        ClfractalError: the scene is wrong; or `parallax` of a scene without stereo, or without a device.
    """
    shell.mute_drivers()  # and the library that reads environment maps
    with piped(shell, source, ()) as files:
        source = files.source
        scene = load_scene(Path(source), overrides=overrides, folder=files.folder)
    if parallax and scene.stereo is None:
        raise SceneError("needs a scene with a stereo section", Where("--parallax", path=""))
    lines, warning = [], ""
    if parallax:
        with speaking_of(source):
            scene, summary, warning = _parallax(scene, device, shell)
        lines.append(summary)
    if scene.stereo is not None and scene.stereo.fit is None:
        lines = [*_eyes(scene), *lines]
    text = dump_scene(scene)
    if not shell.can_print(text):
        text = dump_scene(scene, only_ascii=True)  # the output stays a scene
    shell.print("".join(f"# {line}\n" for line in lines) + text)
    if warning:
        shell.say(f"{source}: {warning}")


def _parallax(scene: Scene, wanted: str | None, shell: Shell) -> tuple[Scene, str, str]:
    """The scene as it is rendered, a line with the range of its parallax, and a warning (or an empty text)."""
    from clfractal.work.comfort import fitted, measured
    from clfractal.work.engine import Engine

    look = Engine(wanted, tell=shell.say).look
    found = fitted(scene, look)
    comfort = measured(found, look)
    if comfort is None:
        return found, "parallax: the picture is empty", ""
    return found, comfort.sentence(), comfort.warning()


def _eyes(scene: Scene) -> list[str]:
    """Remarks: where the viewer's eyes are in the scene, the camera's new position, and the plane on the screen."""
    from clfractal.optics.stereo import eye_views, relation
    from clfractal.optics.view import shown_views
    from clfractal.scene.cut_plane import CutPlaneRenderer

    lines = []
    for number, (view, eye, _) in enumerate(shown_views(scene)):
        name = f"layout.views.{number}: " if scene.layout else ""
        assert view.stereo is not None
        if isinstance(view.renderer, CutPlaneRenderer):
            lines.append(f"{name}stereo: a cut plane by itself is flat; both eyes see it on the screen")
            continue
        seen = eye_views(view, eye)
        middle, left, right = (seen[eye] for eye in ("middle", "left", "right"))
        moved = f", moved from {_point(view.camera.position)}" if view.stereo.plane is None else ""
        lines += [
            f"{name}stereo: the camera is at {_point(middle.origin)}{moved}; the left eye at {_point(left.origin)}, "
            f"the right at {_point(right.origin)}",
            f"{name}stereo: this plane lies on the screen: center {_point(middle.center)}, {middle.width:.6g} x "
            f"{middle.height:.6g} scene units; one unit of the screen is {relation(view.stereo, middle):.6g} scene units",
        ]
    return lines


def _point(place: npt.NDArray[np.float64] | tuple[float, float, float]) -> str:
    return "[" + ", ".join(f"{float(value) + 0.0:.6g}" for value in place) + "]"
