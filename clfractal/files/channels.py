"""The channels a picture may have: one table for scenes, framebuffers and files."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal

from clfractal.errors import SceneError, Where, nearest, unknown_name


@dataclass(frozen=True, slots=True)
class Channel:
    """One named plane of numbers.

    `kind`: `color` channels are averaged over a pixel's samples, `data` channels take the sample nearest to
    its centre.
    `precision`: how an EXR file stores it unless the scene says otherwise.
    `fill`: the value where nothing is hit, and of pixels not rendered.
    """

    name: str
    kind: Literal["color", "data"]
    precision: Literal["half", "float"]
    fill: float
    description: str


def _layer(name: str, parts: str, description: str) -> tuple[Channel, ...]:
    """The channels of a layer, such as `albedo.R`."""
    words = {"R": "red", "G": "green", "B": "blue"}
    return tuple(
        Channel(f"{name}.{part}", "color", "half", 0.0, f"{description}; {words.get(part, part.lower())}")
        for part in parts
    )


CRYPTOMATTE_RANKS = 6
"""Objects, and materials, whose coverage is known in each pixel."""


def _cryptomatte(name: str, kind: str) -> tuple[Channel, ...]:
    """The channels of a Cryptomatte layer: two ranks each in `CryptoObject00`, `CryptoObject01` and so on."""
    parts = (
        (2 * pair + rank, f"{name}{pair:02d}.{'RGBA'[2 * rank + part]}", part)
        for pair in range(CRYPTOMATTE_RANKS // 2)
        for rank in range(2)
        for part in range(2)
    )
    words = ("identifier", "coverage")
    return tuple(
        Channel(each, "data", "float", 0.0, f"{words[part]} of the {kind} of rank {rank}, Cryptomatte")
        for rank, each, part in parts
    )


_TABLE = (
    Channel("R", "color", "half", 0.0, "red, linear Rec. 709"),
    Channel("G", "color", "half", 0.0, "green, linear Rec. 709"),
    Channel("B", "color", "half", 0.0, "blue, linear Rec. 709"),
    Channel("A", "color", "half", 0.0, "coverage, 0 to 1"),
    Channel("Z", "data", "float", math.inf, "distance along the view axis, scene units; inf where no hit"),
    Channel("N.X", "data", "half", 0.0, "surface normal, x; 0 where nothing is hit"),
    Channel("N.Y", "data", "half", 0.0, "surface normal, y"),
    Channel("N.Z", "data", "half", 0.0, "surface normal, z"),
    Channel("P.X", "data", "float", 0.0, "point hit, x, scene units; 0 where nothing is hit"),
    Channel("P.Y", "data", "float", 0.0, "point hit, y, scene units"),
    Channel("P.Z", "data", "float", 0.0, "point hit, z, scene units"),
    Channel("iterations", "data", "float", 0.0, "smooth escape count"),
    Channel("steps", "data", "float", 0.0, "distance evaluations of the ray"),
    Channel("samples", "data", "float", 0.0, "samples of the pixel"),
    *_layer("albedo", "RGB", "what the first surface reflects of white light, 0 to 1"),
    *_layer("emission", "RGB", "light that the first thing seen gives off itself"),
    *_layer("direct", "RGB", "light that was reflected once before it came to the eye"),
    *_layer("indirect", "RGB", "light that was reflected more than once"),
    *_layer("normal", "XYZ", "mean of the surface normals of all samples, times coverage"),
    Channel(
        "object",
        "data",
        "float",
        0.0,
        "number of the object: 1 the set, then the objects in their order; 0: nothing",
    ),
    Channel(
        "material",
        "data",
        "float",
        0.0,
        "number of the material: of `materials` in their order, from 1; after them `material`",
    ),
    *_cryptomatte("CryptoObject", "object"),
    *_cryptomatte("CryptoMaterial", "material"),
    *_layer("noisy", "RGB", "the picture before it was denoised"),
)

CHANNELS: dict[str, Channel] = {channel.name: channel for channel in _TABLE}
"""Every channel by name, in the order in which pictures list them."""


def layer(name: str) -> tuple[str, ...]:
    """The names of a layer's channels, such as those of `albedo`."""
    return tuple(channel for channel in CHANNELS if channel.startswith(f"{name}."))


NORMAL: tuple[str, ...] = layer("normal")
ALBEDO: tuple[str, ...] = layer("albedo")
LIGHT_LAYERS: tuple[str, ...] = (*layer("emission"), *layer("direct"), *layer("indirect"))
"""Parts of the picture by how often light was reflected; only paths know them."""
SURFACE_LAYERS: tuple[str, ...] = (*ALBEDO, *LIGHT_LAYERS, *NORMAL)
"""Channels that only surfaces have, in the order of `parts` in `kernels/integrators/pixel.h`."""
NUMBERED: tuple[str, ...] = ("object", "material")
CRYPTOMATTE_OBJECTS: tuple[str, ...] = tuple(name for name in CHANNELS if name.startswith("CryptoObject"))
CRYPTOMATTE_MATERIALS: tuple[str, ...] = tuple(name for name in CHANNELS if name.startswith("CryptoMaterial"))
ID_CHANNELS: tuple[str, ...] = (*NUMBERED, *CRYPTOMATTE_OBJECTS, *CRYPTOMATTE_MATERIALS)
"""Channels that tell which things a pixel shows; only surfaces have them."""
NOISY: tuple[str, ...] = layer("noisy")
"""The picture before it was denoised: made when all else is finished, never rendered."""
RAY_CHANNELS: tuple[str, ...] = tuple(
    name for name in CHANNELS if name not in {*SURFACE_LAYERS, *ID_CHANNELS, *NOISY}
)
"""The channels that every renderer makes."""

LAYERS: dict[str, tuple[str, ...]] = {
    **{
        name: layer(name)
        for name in ("N", "P", "albedo", "emission", "direct", "indirect", "normal", "noisy")
    },
    "CryptoObject": CRYPTOMATTE_OBJECTS,
    "CryptoMaterial": CRYPTOMATTE_MATERIALS,
}
"""Names that stand for several channels wherever a picture's channels are named."""

DEFAULT_CHANNELS: tuple[str, ...] = ("R", "G", "B", "A", "Z")
"""The channels of a picture unless the scene's `output.channels` names others."""


def unknown_channel(name: str) -> str:
    """Message text for an unknown channel: the nearest one, or else a list, in which layers stand for their channels."""
    every = (*CHANNELS, *LAYERS)
    brief = [each for each in CHANNELS if not any(each in parts for parts in LAYERS.values())]
    return unknown_name("channel", name, every if nearest(name, sorted(every)) else (*brief, *LAYERS))


def check_channels(names: Iterable[str], where: Where | None = None) -> tuple[str, ...]:
    """The names as a tuple, in the given order; layers (`LAYERS`) are replaced by their channels.

    Raises:
        SceneError: no name, an unknown one (with the nearest known), or one given twice.
    """
    chosen: list[str] = []
    for name in names:
        if name not in CHANNELS and name not in LAYERS:
            raise SceneError(unknown_channel(str(name)), where)
        for each in LAYERS.get(name, (name,)):
            if each in chosen:
                raise SceneError(f"channel {each!r} is given twice", where)
            chosen.append(each)
    if not chosen:
        raise SceneError("a picture needs at least one channel", where)
    return tuple(chosen)


VIEWS: tuple[str, ...] = ("left", "right")
"""The views of a stereo picture by the names that OpenEXR gives them; the first is the default."""


def in_view(name: str, view: str) -> str:
    """The name of a view's channel in a file of several views: `R`, `N.left.X`; `right.R`, `N.right.X`.

    The view stands before the last part of the name. Only in the default view is it left out, and only of a name of one
    part: "Storing Multi-View Images in OpenEXR Files", section "Channel Naming" (openexr.com).
    """
    *layers, last = name.split(".")
    return name if view == VIEWS[0] and not layers else ".".join([*layers, view, last])


def without_view(name: str) -> str:
    """The channel's name without its view; names that `in_view` did not make are unchanged."""
    parts = name.split(".")
    return ".".join(part for place, part in enumerate(parts) if place != len(parts) - 2 or part not in VIEWS)
