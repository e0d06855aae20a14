"""`clfractal probe`: what lies at a pixel."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from clfractal.cli.pipes import piped
from clfractal.cli.render import Order, numbers_of, ordered_scene
from clfractal.cli.shell import Shell
from clfractal.errors import SceneError, Where, speaking_of

if TYPE_CHECKING:
    from clfractal.images.probe import Probe


def probe_pixel(order: Order, pixel: str, shell: Shell, *, as_json: bool) -> None:
    """Prints what lies at a pixel of a scene's picture.

    Args:
        pixel: X,Y, pixels from the top left of the whole picture.

    Raises:
        ClfractalError: anything wrong with the input or the device.
    """
    x, y = numbers_of("X,Y", pixel, ",", 2, "X,Y, such as 640,360")
    with piped(shell, order.scene, ()) as files:
        order = replace(order, scene=files.source, folder=files.folder)
        scene = ordered_scene(order)
    from clfractal.engine.engine import Engine
    from clfractal.engine.probing import probed

    engine = Engine(order.device, tell=shell.say)
    with speaking_of(order.scene):
        job = engine.prepare(scene, precision=order.precision)
    region = job.region
    if not (0 <= x < region.width and 0 <= y < region.height):
        raise SceneError(
            f"must lie inside the picture of {region.width} x {region.height} pixels, got {x},{y}",
            Where("X,Y"),
        )
    with speaking_of(order.scene):
        found = probed(job, x, y, engine.preview)
    if as_json:
        shell.print_json(found.plain())
    else:
        shell.print(_text(found))


def _text(found: Probe) -> str:
    view = f", layout.views.{found.view}" if found.view is not None else ""
    eye = f", {found.eye} eye" if found.eye is not None else ""
    shown = f"pixel {found.x},{found.y}{view}{eye}"
    if not found.hit:
        return f"{shown}: nothing is there"
    assert found.point is not None
    assert found.normal is not None
    return "\n".join(
        [
            shown,
            f"point       {_triple(found.point)}",
            f"normal      {_triple(found.normal)}",
            f"depth       {found.depth:.9g}, along the view axis, as of camera.focus_distance",
            f"distance    {found.distance:.9g}, from the eye",
            f"iterations  {found.iterations:.6g}",
            f"steps       {found.steps:g}",
        ]
    )


def _triple(values: Sequence[float]) -> str:
    return "[" + ", ".join(f"{value + 0.0:.9g}" for value in values) + "]"
