"""Writes any kind of framebuffer to files."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable, Iterator, Mapping
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from clfractal.errors import Where, arguments
from clfractal.files.channels import CHANNELS, VIEWS, check_channels, in_view
from clfractal.files.photo import LOSSLESS, write_photo
from clfractal.files.png import stream_png, write_png
from clfractal.files.read_ahead import read_ahead
from clfractal.files.srgb import Bits
from clfractal.files.tone_names import Tone
from clfractal.images.develop import Development, developed
from clfractal.images.formats import KINDS, PHOTOS, Content, check_output, check_views, kind_of
from clfractal.images.tiled import Floats, Picture
from clfractal.scene.stereo import APART, Stereo

# Names of the header's keys in a file: OpenEXR's own names are kept, the others begin with the program's name.
_MATRICES = ("worldToCamera", "worldToNDC")
_CRYPTOMATTE = "cryptomatte/"
_FILE_KEYS = {"scene": "clfractal"} | {name: name for name in (*_MATRICES, "view", "multiView")}
# In a file with both eyes' pictures each has its own of these, with its view before the name.
_OF_VIEWS = (*_MATRICES, "devices", "tileDevices")


def save_outputs(
    store: Picture,
    paths: Iterable[str | Path],
    *,
    header: Mapping[str, Any] | None = None,
    half: Collection[str] | None = None,
    bits: Bits = 8,
    quality: int = 90,
    transparent: bool | None = None,
    exposure: float | None = None,
    tone: Tone | None = None,
) -> None:
    """Writes a framebuffer to files, in the formats of their extensions; each file appears complete or not at all.

    All paths are checked before the first is written. Memory needed: a few bands of rows, see `bands`; for a JPEG or WebP
    3 or 4 bytes for each pixel, and the file.

    Args:
        header: added to `store.header`.
        half: the channels that an EXR stores as half; by default as `CHANNELS` says.
        bits: 8 or 16, of a PNG.
        quality: 1 to 100, of a JPEG or WebP; at 100 a WebP is lossless.
        transparent: whether a PNG or WebP has an alpha channel (the framebuffer's colours are premultiplied); needs A.
        exposure: stops (powers of two) by which files but an EXR are lighter than the framebuffer; that keeps scene values.
        tone: the curve that its light goes through: linear, reinhard or agx.
            If they are None, the header's values are used.

    Raises:
        SceneError: a setting is wrong.
        FileError: a file cannot be written; earlier ones of `paths` may already be written.
    """
    bits = _checked_bits(bits)
    half = None if half is None else check_channels(arguments.words("half", half), Where(path="half"))
    transparent = None if transparent is None else arguments.flag("transparent", transparent)
    quality = arguments.whole("quality", quality, 1, LOSSLESS)
    development = Development.of(store.header, exposure, tone)
    chosen = [Path(path) for path in paths]
    whole = {**store.header, **(header or {})}
    region = store.region
    alpha = _transparent(store, transparent)
    content = Content(
        store.channels, (region.width, region.height), alpha, getattr(store, "stereo", None), quality
    )
    for path in chosen:
        check_output(path, content)
    for path in chosen:
        kind = kind_of(path)
        if kind != "EXR":
            write = (
                partial(write_png, bits=bits)
                if kind == "PNG"
                else partial(write_photo, format=PHOTOS[kind], quality=quality)
            )
            colors = _colors(developed(store, development), alpha=alpha)
            write(
                path,
                colors if kind == "PNG" else read_ahead(colors),
                width=region.width,
                height=region.height,
                alpha=alpha,
                texts=_texts(whole),
                origin=(region.x, region.y),
            )
        else:
            # The library needs some 10 ms to load: only for those who write its files.
            from clfractal.files.exr import write_exr

            if half is None:
                half = {name for name in store.channels if CHANNELS[name].precision == "half"}
            write_exr(
                path,
                (band for _, band in store.bands()),
                display=store.display,
                region=(region.x, region.y, region.width, region.height),
                channels=store.channels,
                half=half,
                header=_attributes(whole),
            )


def _checked_bits(bits: Any) -> Bits:
    found = arguments.whole("bits", bits, 1, 64)
    if found != 8 and found != 16:
        arguments.refuse("bits", "must be 8 or 16", found)
    return 8 if found == 8 else 16


def output_files(stereo: Stereo | None, path: str | Path) -> list[Path]:
    """The files that are written for an output: two of a pair, and of views in a format that holds but one."""
    if stereo is None or stereo.mode not in APART:
        return [Path(path)]
    one_file = stereo.mode == "multi_view" and KINDS.get(Path(path).suffix.lower()) == "EXR"
    return [Path(path)] if one_file else list(pair_paths(path))


def pair_paths(path: str | Path) -> tuple[Path, Path]:
    """The two files of a pair: `out_L.exr` and `out_R.exr` of `out.exr`."""
    whole = Path(path)
    left, right = (whole.with_name(f"{whole.stem}_{letter}{whole.suffix}") for letter in "LR")
    return left, right


def save_views(
    left: Picture,
    right: Picture,
    path: str | Path,
    *,
    half: Collection[str] | None = None,
) -> None:
    """Writes both eyes' pictures to one multi-view EXR, the left one as its default view; memory as of `save_outputs`.

    The standard attributes worldToCamera and worldToNDC are the left eye's. Each eye's are there too, with its view
    before the name, as in `right.worldToCamera`; so are the devices that made each eye's tiles, if several did. The
    seconds are those of both.

    Args:
        left, right: pictures of one size and region with the same channels.
        half: the channels that are stored as half, without views; by default as `CHANNELS` says.

    Raises:
        FileError: the file cannot be written, or is no EXR.
        ValueError: the pictures do not fit each other.
    """
    if (left.channels, left.display, left.region) != (right.channels, right.display, right.region):
        raise ValueError("the views of a picture must have the same size, region and channels")
    check_views(path)
    from clfractal.files.exr import write_exr

    pictures = dict(zip(VIEWS, (left, right), strict=True))
    if half is None:
        half = {name for name in left.channels if CHANNELS[name].precision == "half"}
    own = {
        f"{view}.{name}": picture.header[name]
        for view, picture in pictures.items()
        for name in _OF_VIEWS
        if name in picture.header
    }
    common = {name: value for name, value in left.header.items() if name not in ("devices", "tileDevices")}
    if "seconds" in common:
        common["seconds"] = sum(picture.header.get("seconds", 0.0) for picture in pictures.values())
    region = left.region
    write_exr(
        path,
        (
            {
                in_view(name, view): planes[name]
                for view, (_, planes) in zip(VIEWS, pair, strict=True)
                for name in planes
            }
            for pair in zip(left.bands(), right.bands(), strict=True)
        ),
        display=left.display,
        region=(region.x, region.y, region.width, region.height),
        channels=[in_view(name, view) for view in VIEWS for name in left.channels],
        half={in_view(name, view) for view in VIEWS for name in half},
        header=_attributes({**common, **own, "view": None, "multiView": VIEWS}),
    )


def png_bytes(store: Picture) -> bytes:
    """An 8-bit PNG of a framebuffer, for notebooks; transparent where the framebuffer is."""
    stream = io.BytesIO()
    region = store.region
    alpha = _transparent(store, None)
    stream_png(
        stream,
        _colors(developed(store, Development.of(store.header)), alpha=alpha),
        width=region.width,
        height=region.height,
        alpha=alpha,
        texts=_texts(store.header),
        origin=(region.x, region.y),
    )
    return stream.getvalue()


def _transparent(store: Picture, wanted: bool | None) -> bool:
    chosen = bool(store.header.get("transparent", False)) if wanted is None else wanted
    return chosen and "A" in store.channels


def _colors(picture: Picture, *, alpha: bool) -> Iterator[Floats]:
    """The bands as arrays (rows, width, 3 or 4)."""
    names = "RGBA" if alpha else "RGB"
    for _, band in picture.bands():
        yield np.stack([band[name] for name in names], axis=-1)


def _file_key(key: str) -> str:
    view, dot, name = key.rpartition(".")
    if dot:
        return f"{view}.{_file_key(name)}"
    if key.startswith(_CRYPTOMATTE):
        return key  # as its specification says
    return _FILE_KEYS.get(key) or f"clfractal{key[:1].upper()}{key[1:]}"


def _software(header: Mapping[str, Any]) -> str:
    return f"clfractal {header['version']}" if "version" in header else "clfractal"


def _attributes(header: Mapping[str, Any]) -> dict[str, Any]:
    """The framebuffer's header as attributes of an EXR file."""
    return {"software": _software(header)} | {
        _file_key(key): value for key, value in header.items() if value is not None
    }


def _texts(header: Mapping[str, Any]) -> dict[str, str]:
    """The framebuffer's header as text chunks of a PNG file; it has no place for matrices."""
    return {"Software": _software(header)} | {
        _file_key(key): str(value)
        for key, value in header.items()
        if isinstance(value, str | bool | int | float | np.number) and not key.startswith(_CRYPTOMATTE)
    }
