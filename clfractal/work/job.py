"""What a render needs before it starts, decided in one place for the shell and for Python.

A job's scene has everything folded in that shapes the pixels (number type and samples in use included), so
that rendering the scene in a picture's header gives the same pixels again.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import clfractal
from clfractal.device.select import Device, has_float64
from clfractal.errors import SceneError, Where, unknown_name
from clfractal.files.document import write_document
from clfractal.optics.view import scene_view
from clfractal.pictures.outputs import save_outputs
from clfractal.pictures.tiled import Picture
from clfractal.renderers.lanes import best_lanes, rule_of
from clfractal.renderers.plan import Plan, PrecisionChoice, choose_precision, make_plan
from clfractal.scene.model import Scene

MAX_SAMPLES = 65_536
PRECISIONS = ("auto", "float32", "float64")


@dataclass(frozen=True, slots=True)
class Job:
    """A scene, how and where it is rendered; `remark` is a line for the user, or empty."""

    scene: Scene
    plan: Plan
    device: Device
    remark: str

    def resolved(self) -> dict[str, Any]:
        """The scene as plain data, with what was decided in the place of what was wished."""
        plain = self.scene.resolved()
        plain["renderer"] |= {"samples": self.plan.samples, "precision": self.plan.precision}
        if plain["renderer"]["min_samples"] is not None:
            plain["renderer"]["min_samples"] = min(plain["renderer"]["min_samples"], self.plan.samples)
        if (plain["renderer"]["min_samples"] or 0) > self.plan.samples:
            plain["renderer"]["min_samples"] = None  # the same, and a scene that loads
        plain["output"]["channels"] = list(self.plan.channels)
        return plain

    def header(self) -> dict[str, Any]:
        """What picture files tell about the picture (see `Film`); `seconds` is added when it is known."""
        scene = self.scene
        view = scene_view(scene)
        return {
            "scene": write_document(self.resolved()),
            "version": clfractal.__version__,
            "device": self.device.info.name,
            "platform": f"{self.device.info.platform}, {self.device.info.version}",
            "precision": self.plan.precision,
            "exposure": scene.output.exposure,
            "transparent": scene.background == "transparent",
            "worldToCamera": view.world_to_camera(),
            "worldToNDC": view.world_to_ndc(),
        }

    def identity(self) -> dict[str, Any]:
        """What has to be the same for a tile to have the same bits: kept with unfinished work."""
        scene = self.resolved()
        # How files are written is free to change; the channels are compared by the journal.
        del scene["output"]
        surroundings = self.scene.surroundings
        return {
            "scene": scene,
            # The scene only names its map, and the file may be another one by now.
            "environment": surroundings.digest() if surroundings is not None else None,
            "grid": self.scene.given.digest() if self.scene.given is not None else None,
            "version": clfractal.__version__,
            "device": self.device.info.name,
            "driver": self.device.info.key,
            "lanes": self.plan.lanes,
        }

    def save(self, store: Picture, paths: Sequence[str | Path]) -> None:
        """Writes a finished film to files, as the scene's `output` wants them.

        Raises:
            FileError: a file cannot be written.
        """
        output = self.scene.output
        save_outputs(
            store,
            paths,
            half=output.half_channels,
            bits=output.png_bits,
        )


def prepare(
    scene: Scene,
    device: Device,
    *,
    precision: str | None = None,
    samples: int | None = None,
    region: tuple[int, int, int, int] | None = None,
    channels: Sequence[str] | None = None,
    on_start: Callable[[str], None] | None = None,
) -> Job:
    """Decides number type, lanes, samples, region and channels; what is None is the scene's.

    Args:
        region: x, y, width, height in pixels.
        on_start: told a line if the device is measured first, which takes some seconds, once.

    Raises:
        SceneError: the region is not inside the picture, an unknown precision or channel, a wrong number of
            samples, float64 on a device without it.
        DeviceError: no kernel works on the device.
    """
    wanted = precision if precision is not None else scene.renderer.precision
    if wanted not in PRECISIONS:
        raise SceneError(unknown_name("precision", wanted, PRECISIONS), Where("--precision"))
    if samples is not None and not 1 <= samples <= MAX_SAMPLES:
        raise SceneError(f"must be from 1 to {MAX_SAMPLES}, got {samples}", Where("--samples"))
    choice = cast(PrecisionChoice, wanted)
    used, remark = choose_precision(scene, choice, has_float64=has_float64(device.info))
    plan = make_plan(
        scene,
        precision=used,
        lanes=best_lanes(device, used, rule_of(scene.chain), on_start=on_start),
        samples=samples,
        region=region,
        channels=tuple(channels) if channels is not None else None,
    )
    return Job(scene, plan, device, remark)
