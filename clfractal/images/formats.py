"""What each format of picture files can hold; what it cannot is refused before anything is rendered."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from clfractal.errors import FileError, Where
from clfractal.files import atomic
from clfractal.files.photo import LOSSLESS, MOST_PIXELS, Format
from clfractal.images.modes import PICKED, picture_size
from clfractal.scene.stereo import Stereo

if TYPE_CHECKING:
    from clfractal.scene.model import Scene

Kind = Literal["EXR", "PNG", "JPEG", "WebP"]
KINDS: dict[str, Kind] = {".exr": "EXR", ".png": "PNG", ".jpg": "JPEG", ".jpeg": "JPEG", ".webp": "WebP"}
"""The formats by their extensions; those of `atomic.PICTURES`."""
PHOTOS: dict[Kind, Format] = {"JPEG": "JPEG", "WebP": "WEBP"}
"""The formats that `files/photo.py` writes, by its names for them."""


@dataclass(frozen=True, slots=True)
class Content:
    """What a picture file is to hold.

    Attributes:
        channels: the picture's.
        size: width and height of what the file holds, pixels.
        transparent: whether there is no background.
        stereo: how two eyes are shown in it; None without stereo.
        quality: of a JPEG or WebP.
    """

    channels: Collection[str]
    size: tuple[int, int]
    transparent: bool
    stereo: Stereo | None
    quality: int

    @classmethod
    def of(cls, scene: Scene, region: tuple[int, int, int, int] | None = None) -> Content:
        """Of each file of a scene's picture, or of a region of it: x, y, width, height in pixels."""
        size = (scene.image.width, scene.image.height)
        if scene.stereo is not None:
            size = picture_size(scene.stereo, size)
        output = scene.output
        return cls(
            output.channels,
            size if region is None else region[2:],
            scene.background == "transparent",
            scene.stereo,
            output.quality,
        )


def kind_of(path: str | Path) -> Kind:
    """The format of a file that `check_output` has let pass."""
    return KINDS[Path(path).suffix.lower()]


def check_output(path: str | Path, content: Content | None = None) -> None:
    """Makes sure, before anything is rendered, that a picture can be written to `path`, and that its format can hold it.

    Raises:
        FileError: unknown extension, no such folder, not writable, a folder or device; or what the format cannot hold:
            a picture without colours, too many pixels, transparency, two eyes' pixels side by side.
    """
    atomic.check_output(path)
    reason = _refused(kind_of(path), content) if content is not None else ""
    if reason:
        raise FileError(reason, Where(str(path)))


def _refused(kind: Kind, content: Content) -> str:
    """Why a format cannot hold this; empty if it can."""
    if kind == "EXR":
        return ""
    missing = [name for name in "RGB" if name not in content.channels]
    if missing:
        return f"a {kind} needs the channels R, G, B; without {', '.join(missing)} write an EXR"
    if kind not in PHOTOS:
        return ""
    width, height = content.size
    most = MOST_PIXELS[PHOTOS[kind]]
    if max(width, height) > most:
        return f"a {kind} has at most {most:,} pixels a side, got {width:,} x {height:,}; write a PNG or EXR"
    if kind == "JPEG" and content.transparent:
        return "a JPEG has no transparency; write a PNG, WebP or EXR, or give the scene a background"
    if content.stereo is None or content.stereo.mode not in PICKED:
        return ""
    mixes = f"mixes neighbouring pixels, which {content.stereo.mode} gives to different eyes; write a PNG"
    if kind == "JPEG":
        return f"a JPEG {mixes}"
    return f"a WebP {mixes}, or set output.quality to {LOSSLESS}" if content.quality < LOSSLESS else ""


def check_views(path: str | Path) -> None:
    """Makes sure, before anything is rendered, that a picture of both views can be written to `path`.

    Raises:
        FileError: as for `check_output`, and for formats other than EXR, which can hold only one view.
    """
    check_output(path)
    kind = kind_of(path)
    if kind != "EXR":
        raise FileError(f"a {kind} has room for one view; write both to an EXR", Where(str(path)))
