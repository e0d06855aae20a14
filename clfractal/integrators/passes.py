"""What all renderers' kernels have in common: sampling, data kept for pixels, statistics."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import numpy.typing as npt

from clfractal.device.orbit import Record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.device.watched import CANCELLED
from clfractal.files.channels import (
    CHANNELS,
    CRYPTOMATTE_RANKS,
    ID_CHANNELS,
    NUMBERED,
    RAY_CHANNELS,
    SURFACE_LAYERS,
)
from clfractal.images.tiles import TILE
from clfractal.integrators.plan import Plan
from clfractal.scene.sampled import Sampled

SAMPLING = Struct(
    "Sampling",
    [
        Field("samples", "int", 0, "samples per pixel, at most"),
        Field("min_samples", "int", 0, "samples before the noise is judged"),
        Field("adaptive", "int", 0, "1: a pixel is done when it has little noise"),
        Field("noise", "real", 0, "standard error at which a pixel is done"),
        Field("transparent", "int", 0, "1: coverage is seen, so its noise counts too"),
        Field("filter", "int", 0, "FILTER_BOX, FILTER_TENT or FILTER_BLACKMAN_HARRIS"),
        Field("filter_width", "real", 0, "its width, pixels"),
        Field("seed", "uint", 0, "chooses the places of the samples"),
        Field(CANCELLED, "int", 0, "1: the work was cancelled, and no further sample is begun"),
    ],
)

FILTERS = ("box", "tent", "blackman_harris")
FILTER_WIDTHS = {"box": 1.0, "tent": 2.0, "blackman_harris": 3.0}

STATISTICS = ("rays", "hits", "steps", "iterations", "bad_distances", "waits", "orbit_waits")
"""The statistics that a packet counts, in the kernel's order."""

# What the mode of a pass asks for, as bits.
PASS_KEEP = 1  # what pixels have so far is kept for a later pass
PASS_ADD = 2  # statistics are added to those of the launch before

# Numbers of a pixel that are kept between passes, in the order of `pixel`, `parts` and `cryptomatte` in `pixel.h`,
# and the channels that need them; with none they are always kept.
_DATA = ("Z", "N.X", "N.Y", "N.Z", "P.X", "P.Y", "P.Z", "iterations", "steps")
_OF_NOISE = ("brightness", "brightness_square", "coverage_square")
_KEPT: dict[str, tuple[str, ...]] = {
    "red": ("R",),
    "green": ("G",),
    "blue": ("B",),
    "coverage": ("A",),
    "samples": (),
    **dict.fromkeys(_OF_NOISE, ()),
    "nearest": (*_DATA, *NUMBERED),
    "depth": ("Z",),
    **{f"normal_{axis.lower()}": (f"N.{axis}",) for axis in "XYZ"},
    **{f"point_{axis.lower()}": (f"P.{axis}",) for axis in "XYZ"},
    "smooth": ("iterations",),
    "steps": ("steps",),
    **{f"layer_{name.replace('.', '_').lower()}": (name,) for name in SURFACE_LAYERS},
    **{f"cryptomatte_{number}": ID_CHANNELS for number in range(2 * CRYPTOMATTE_RANKS)},
    "cryptomatte_nearest": NUMBERED,
}


def pass_defines(plan: Plan) -> dict[str, object]:
    """The defines in every renderer's text."""
    return {
        "LANES": plan.lanes,
        "REAL_IS_DOUBLE": int(plan.precision == "float64"),
        "TILE": TILE,
        **_numbered("CHANNEL", (name.replace(".", "") for name in CHANNELS)),
        "CHANNEL_COUNT": len(CHANNELS),
        "RAY_CHANNELS": len(RAY_CHANNELS),
        "CRYPTOMATTE_RANKS": CRYPTOMATTE_RANKS,
        **_numbered("KEPT", _KEPT),
        **_numbered("STATISTIC", STATISTICS),
        "STATISTICS": len(STATISTICS),
        "PASS_KEEP": PASS_KEEP,
        "PASS_ADD": PASS_ADD,
    }


def has_parts(plan: Plan) -> bool:
    """Whether the picture has any of the layers that only surfaces have."""
    return not set(SURFACE_LAYERS).isdisjoint(plan.channels)


def has_cryptomatte(plan: Plan) -> bool:
    """Whether the picture tells which things pixels show."""
    return not set(ID_CHANNELS).isdisjoint(plan.channels)


def sampling_record(sampled: Sampled, samples: int, precision: Precision, *, transparent: bool) -> Record:
    """How a pixel is sampled, with at most `samples` samples."""
    width = sampled.filter_width
    values = {
        "samples": samples,
        "min_samples": min(sampled.used_min_samples, samples),
        "adaptive": int(sampled.noise is not None),
        "noise": sampled.noise or 0.0,
        "transparent": int(transparent),
        "filter": FILTERS.index(sampled.filter),
        "filter_width": width if width is not None else FILTER_WIDTHS[sampled.filter],
        "seed": sampled.seed,
        CANCELLED: 0,
    }
    return SAMPLING.value(precision, values)


def kept_numbers(plan: Plan, sampled: Sampled) -> tuple[str, ...]:
    """The numbers of a pixel that passes keep for each other: those that the channels, or the noise, are made of."""
    wanted = set(plan.channels)
    adaptive = sampled.noise is not None

    def needed(name: str, channels: tuple[str, ...]) -> bool:
        if name in _OF_NOISE or (name == "coverage" and adaptive):
            return adaptive
        return not channels or not wanted.isdisjoint(channels)

    return tuple(name for name, channels in _KEPT.items() if needed(name, channels))


def slots(plan: Plan, sampled: Sampled) -> npt.NDArray[np.int32]:
    """For each channel its place among the wanted ones, then for each number of a pixel among the kept ones; or -1."""
    return np.array(
        [*_places(CHANNELS, plan.channels), *_places(_KEPT, kept_numbers(plan, sampled))], np.int32
    )


def _places(all_names: Iterable[str], chosen: tuple[str, ...]) -> list[int]:
    return [chosen.index(name) if name in chosen else -1 for name in all_names]


def _numbered(prefix: str, names: Iterable[str]) -> dict[str, object]:
    return {f"{prefix}_{name.upper()}": number for number, name in enumerate(names)}
