"""`clfractal check`: the scene with every default filled in, how it moves, where a pair's eyes are."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.pipes import piped
from clfractal.cli.shell import Shell
from clfractal.errors import SceneError, Where, speaking_of
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.load import dump_scene, load_scene
from clfractal.scene.model import Scene
from clfractal.scene.movement import movement_of

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

    from clfractal.scene.animation import Animation
    from clfractal.schema.fields import Kind

_MOST_KEYS = 12
_WORDS: Mapping[Kind, str] = {
    "number": "a number",
    "whole": "a whole number",
    "scale": "by equal factors",
    "place": "a place in space",
    "direction": "a direction",
    "color": "each number by itself",
    "exact": "a place of any depth",
}


def check_scene(
    source: str,
    overrides: tuple[str, ...],
    shell: Shell,
    *,
    parallax: bool,
    as_json: bool,
    device: str | None,
) -> None:
    """Prints a scene with all defaults; remarks about movement and stereo come first, as comments: the output is a scene.

    As JSON the scene is the value `scene` of an object, and the lines of remarks are its list `remarks`.

    Args:
        parallax: whether to measure a stereo scene's depth (which needs a device) and print the range of parallax.

    Raises:
        ClfractalError: the scene is wrong; or `parallax` of a scene without stereo, or without a device.
    """
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
    if scene.animation is not None:
        lines = [*_moves(scene, scene.animation), *lines]
    if as_json:
        shell.print_json({"scene": scene.resolved(), "remarks": lines})
    else:
        text = dump_scene(scene)
        if not shell.can_print(text):
            text = dump_scene(scene, only_ascii=True)  # the output stays a scene
        shell.print("".join(f"# {line}\n" for line in lines) + text)
    if warning:
        shell.say(f"{source}: {warning}")


def _parallax(scene: Scene, wanted: str | None, shell: Shell) -> tuple[Scene, str, str]:
    """The scene as it is rendered, a line with the range of its parallax, and a warning (or an empty text)."""
    from clfractal.engine.comfort import fitted, measured
    from clfractal.engine.engine import Engine

    preview = Engine(wanted, tell=shell.say).preview
    found = fitted(scene, preview)
    comfort = measured(found, preview)
    if comfort is None:
        return found, "parallax: the picture is empty", ""
    return found, comfort.sentence(), comfort.warning()


def _moves(scene: Scene, animation: Animation) -> list[str]:
    """Remarks: the film's length, and each track with the values at its keys, or at its ends and in its middle."""
    last = animation.count - 1
    seconds = animation.count / animation.fps
    loop = ", begins again without a seam" if animation.loop else ""
    blur = f", each exposed for {animation.shutter:.4g} of a frame" if animation.shutter else ""
    lines = [
        f"animation: {animation.count} frames, {seconds:.6g} s at {animation.fps:g} per second{loop}{blur}"
    ]
    for mover in movement_of(scene).movers:
        track = animation.tracks[mover.name]
        if track.keys is not None:
            frames = [animation.frame_of(key) for key in track.keys]
            by = f"{len(frames)} keys, {track.interpolation}"
        else:
            frames = sorted({0.0, float(last // 2), float(last)})
            by = "by an expression" if track.expression is not None else f"by {track.file}"
        left = f"; {len(frames) - _MOST_KEYS} more" if len(frames) > _MOST_KEYS else ""
        values = [f"frame {frame:g}: {_value(mover.value(frame))}" for frame in frames[:_MOST_KEYS]]
        lines.append(
            f"animation: {mover.name} ({by}; {_WORDS[mover.target.kind]}): {', '.join(values)}{left}"
        )
    return lines


def _value(value: float | tuple[float, ...] | tuple[str, ...]) -> str:
    return _point(tuple(map(float, value))) if isinstance(value, tuple) else f"{value:.6g}"


def _eyes(scene: Scene) -> list[str]:
    """Remarks: where the viewer's eyes are in the scene, the camera's new position, and the plane on the screen."""
    from clfractal.camera.views import shown_views
    from clfractal.stereo.eyes import eye_views, relation

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


def _point(place: npt.NDArray[np.float64] | tuple[float, ...]) -> str:
    return "[" + ", ".join(f"{float(value) + 0.0:.6g}" for value in place) + "]"
