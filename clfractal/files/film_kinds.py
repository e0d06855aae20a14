"""Kinds of films: files, codecs, and how they may be stored. It imports nothing that takes long."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

CONTAINERS: Mapping[str, str] = {".mp4": "mp4", ".mkv": "matroska", ".mov": "mov"}
"""FFmpeg's names of the files that hold films, by extension."""


@dataclass(frozen=True, slots=True)
class Codec:
    """A codec that is offered.

    Attributes:
        library: FFmpeg's name of the encoder.
        containers: extensions of files that hold it; those of which it is the default come first in `DEFAULTS`.
        formats: FFmpeg's pixel formats by bits and chroma (420, 422, 444, or rgb); the first is the default.
        quality: the encoder's option for the quality, its range and its default; None: it has none.
        options: what else the encoder is told.
        least_side: of a picture, pixels.
    """

    library: str
    containers: tuple[str, ...]
    formats: Mapping[tuple[int, str], str]
    quality: tuple[str, int, int, int] | None = None
    options: Mapping[str, str] = field(default_factory=dict)
    least_side: int = 16


_YUV8 = {(8, "420"): "yuv420p", (8, "422"): "yuv422p", (8, "444"): "yuv444p"}
_YUV10 = {(10, "420"): "yuv420p10le", (10, "422"): "yuv422p10le", (10, "444"): "yuv444p10le"}
CODECS: Mapping[str, Codec] = {
    "h264": Codec("libx264", (".mp4", ".mkv", ".mov"), {**_YUV8, **_YUV10}, ("crf", 0, 51, 16)),
    "h265": Codec(
        "libx265",
        (".mp4", ".mkv", ".mov"),
        {**_YUV10, **_YUV8},
        ("crf", 0, 51, 18),
        {"x265-params": "log-level=error"},
        least_side=64,  # of smaller pictures x265 writes beyond its memory
    ),
    # SVT-AV1, the only software encoder of it in av's wheels, knows no other chroma.
    "av1": Codec(
        "libsvtav1",
        (".mp4", ".mkv"),
        {(10, "420"): "yuv420p10le", (8, "420"): "yuv420p"},
        ("crf", 1, 63, 18),
        {"preset": "6"},
        least_side=64,
    ),
    "ffv1": Codec("ffv1", (".mkv",), {(8, "rgb"): "bgr0", (16, "rgb"): "gbrp16le"}, None, {"level": "3"}),
    "prores": Codec("prores_ks", (".mov", ".mkv"), {(10, "422"): "yuv422p10le", (10, "444"): "yuv444p10le"}),
}
DEFAULTS: Mapping[str, str] = {".mp4": "h264", ".mkv": "ffv1", ".mov": "prores"}
"""The codec of each kind of file, if none is named."""

MATROSKA: Mapping[str, tuple[str, str]] = {
    "split": ("left_right", "right_left"),
    "split_half": ("left_right", "right_left"),
    "over_under": ("top_bottom", "bottom_top"),
    "over_under_half": ("top_bottom", "bottom_top"),
    "rows": ("row_interleaved_lr", "row_interleaved_rl"),
    "columns": ("col_interleaved_lr", "col_interleaved_rl"),
    "checkerboard": ("checkerboard_lr", "checkerboard_rl"),
}
"""What Matroska calls the arrangement of two eyes' pictures, by the scene's `stereo.mode`: with the left eye first (its
StereoMode 1, 3, 7, 9, 5), and with the right one (11, 2, 6, 8, 4)."""


@dataclass(frozen=True, slots=True)
class Recipe:
    """How a film is stored; None stands for the codec's default.

    Attributes:
        codec: a name of `CODECS`.
        bits: of each channel.
        chroma: 420, 422, 444 or rgb.
        quality: the encoder's own number; smaller is better.
    """

    codec: str | None = None
    bits: int | None = None
    chroma: str | None = None
    quality: int | None = None
