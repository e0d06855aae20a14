"""`clfractal sound`: the loudness of a sound as a table that moves a scene, so that a farm needs no sound."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from clfractal.cli.pipes import refuse_stream
from clfractal.cli.shell import Shell
from clfractal.device.activity import doing
from clfractal.errors import SceneError, Where
from clfractal.files.atomic import atomic_writer, check_output
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.animation import MAX_FRAMES

if TYPE_CHECKING:
    import numpy as np
    import numpy.typing as npt

_MOST_BANDS = 64
_BAND = re.compile(r"([A-Za-z_]\w{0,39})=([0-9.]{1,12})-([0-9.]{1,12})", re.ASCII)


@dataclass(frozen=True, slots=True)
class SoundOrder:
    """The options of `clfractal sound`, as they were given; bands are NAME=LOW-HIGH, in Hz."""

    sound: Path
    output: Path
    fps: float = 30.0
    frames: int | None = None
    bands: tuple[str, ...] = ()
    normal: bool = True
    threshold: float = 0.0
    fade: float = 0.15
    gain: float = 1.0


def write_loudness(order: SoundOrder, shell: Shell) -> None:
    """Writes a CSV table with a row for each frame: its number, its time, the loudness of all, and of each band.

    Raises:
        ClfractalError: the sound cannot be read, an option is wrong, or the table cannot be written.
    """
    from clfractal.engine.loudness import BANDS, Shaping, loudness, shaped
    from clfractal.files.sound import read_sound

    refuse_stream(order.output, "give the table a name")
    _check(order)
    bands = _bands(order.bands) if order.bands else dict(BANDS)
    check_output(order.output, (".csv",))
    refuse_overwriting([order.output], [order.sound])
    with doing(f"reading {order.sound}"):
        sound = read_sound(order.sound)
    frames = order.frames if order.frames is not None else math.ceil(sound.seconds * order.fps)
    if frames > MAX_FRAMES:
        raise SceneError(f"makes {frames:,} frames, at most {MAX_FRAMES:,}", Where("--fps"))
    with doing(f"measuring {order.sound}"):
        try:
            levels = loudness(sound, order.fps, frames, [(0.0, math.inf), *bands.values()])
        except ValueError as error:
            raise SceneError(str(error), Where("--band")) from error
        shaping = Shaping(order.normal, order.threshold, order.fade, order.gain)
        values = shaped(levels, order.fps, shaping)
    _write(order, ["level", *bands], values)
    shell.say(f"{order.output}: {frames} frames, {', '.join(['level', *bands])}")


def _write(order: SoundOrder, titles: list[str], values: npt.NDArray[np.float64]) -> None:
    rows = (
        [str(frame), f"{frame / order.fps:.6g}", *(f"{value:.6g}" for value in row)]
        for frame, row in enumerate(values)
    )
    lines = map(",".join, (["frame", "time", *titles], *rows))
    with atomic_writer(order.output) as path:
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def _check(order: SoundOrder) -> None:
    ranges = (
        ("--fps", order.fps, 0.01, 1000),
        ("--frames", order.frames, 1, MAX_FRAMES),
        ("--threshold", order.threshold, 0, 0.99),
        ("--fade", order.fade, 0, 60),
        ("--gain", order.gain, 0, 1e6),
    )
    for option, value, least, most in ranges:
        if value is not None and not least <= value <= most:
            raise SceneError(f"must be from {least:g} to {most:g}, got {value:g}", Where(option))
    if len(order.bands) > _MOST_BANDS:
        raise SceneError(f"must be at most {_MOST_BANDS} bands, got {len(order.bands)}", Where("--band"))


def _bands(texts: tuple[str, ...]) -> dict[str, tuple[float, float]]:
    found: dict[str, tuple[float, float]] = {}
    for text in texts:
        name, band = _band(text)
        if name in found:
            raise SceneError(f"must have a name of its own, got {name!r} twice", Where("--band"))
        found[name] = band
    return found


def _band(text: str) -> tuple[str, tuple[float, float]]:
    found = _BAND.fullmatch(text.strip())
    try:
        low, high = (float(found[2]), float(found[3])) if found is not None else (0.0, 0.0)
    except ValueError:
        low, high = 0.0, 0.0
    if found is None or not low < high:
        raise SceneError(
            f"must be NAME=LOW-HIGH in Hz, such as kick=40-120; got {text[:60]!r}", Where("--band")
        )
    if found[1] in ("frame", "time", "level"):
        raise SceneError(f"must have a name of its own, got {found[1]!r}", Where("--band"))
    return found[1], (low, high)
