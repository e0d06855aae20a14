"""JPEG and WebP pictures, 8 bits a component, written by Pillow; the scene travels in an XMP packet.

Pillow holds the whole picture in memory: 3 or 4 bytes for each pixel, and the file.
Sources: JPEG, ITU-T T.81, Annex B; WebP container, RFC 9649, section 2.7; XMP, ISO 16684-1, and its Part 3 (Adobe 2020),
section 1.1.3 for JPEG. Files are read here, without Pillow: those of untrusted origin get errors of one line.
"""

from __future__ import annotations

import hashlib
import io
import os
import struct
from collections.abc import Iterable, Mapping
from functools import cache
from pathlib import Path
from typing import Any, BinaryIO, Literal, TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.files.atomic import ContentError, atomic_writer, file_error, reading
from clfractal.files.png import SCENE_KEY
from clfractal.files.srgb import Floats, codes

Format = Literal["JPEG", "WEBP"]
Codes: TypeAlias = npt.NDArray[np.uint8]

LOSSLESS = 100
"""The quality at which a WebP keeps every pixel."""
MOST_PIXELS: dict[Format, int] = {"JPEG": 65_500, "WEBP": 16_383}
"""The longest side that can be written: 65,535 fit into a JPEG, but its library writes no more than this."""

_LARGEST_TEXT = 16 << 20  # bytes; a scene with a formula library inlined has some ten thousand
_XMP = b"http://ns.adobe.com/xap/1.0/\0"
_XMP_MORE = b"http://ns.adobe.com/xmp/extension/\0"
_SEGMENT = (
    65_400  # bytes of a packet in one segment of a JPEG, which holds 65,533 with everything around them
)
_SPACES = {
    "x": "adobe:ns:meta/",
    "rdf": "http://www.w3.org/1999/02/22-rdf-syntax-ns#",
    "xmp": "http://ns.adobe.com/xap/1.0/",
    "xmpNote": "http://ns.adobe.com/xmp/note/",
    "clfractal": "urn:clfractal:header#",
}
_SOFTWARE, _MORE = "Software", f"{{{_SPACES['xmpNote']}}}HasExtendedXMP"


def write_photo(
    path: str | Path,
    bands: Iterable[Floats],
    *,
    format: Format,
    width: int,
    height: int,
    quality: int,
    alpha: bool = False,
    texts: Mapping[str, str] | None = None,
    origin: tuple[int, int] = (0, 0),
) -> None:
    """Writes a JPEG or WebP file, tagged as sRGB; it appears complete or not at all.

    Args:
        bands: as for `png.write_png`; a JPEG has no alpha.
        quality: 1 to 100. A JPEG keeps colours at full resolution, and a lossy WebP at half of it.
        texts: of an XMP packet, by the keywords that a PNG has; the scene under `SCENE_KEY`.
        origin: picture coordinates (x, y) of the first pixel, for the dither pattern.

    Raises:
        FileError: the file cannot be written; or is too large for its format, which is to be checked before.
    """
    pixels = np.empty((height, width, 4 if alpha else 3), np.uint8)
    row = 0
    for band in bands:
        pixels[row : row + len(band)] = codes(band, 8, alpha=alpha, origin=(origin[0], origin[1] + row))
        row += len(band)
    if row != height:
        raise ValueError(f"a picture of {height} rows got {row}")
    try:
        data = _encoded(pixels, format, quality, texts or {})
    except (OSError, ValueError) as error:
        raise file_error(path, "cannot be written", str(error)) from error
    with atomic_writer(path) as beside, open(beside, "wb") as stream:
        for piece in data:
            stream.write(piece)


def _encoded(pixels: Codes, format: Format, quality: int, texts: Mapping[str, str]) -> list[bytes]:
    """The bytes of the file, in pieces."""
    from PIL import Image

    stream = io.BytesIO()
    image = Image.fromarray(pixels)
    if format == "WEBP":
        settings: dict[str, Any] = {"lossless": True, "exact": True} if quality >= LOSSLESS else {}
        settings["quality"] = 70 if quality >= LOSSLESS else quality  # of a lossless one: the effort
        packet = _packet(texts)
        image.save(stream, "WEBP", method=4, icc_profile=_profile(), xmp=packet, **settings)
        return [stream.getvalue()]
    image.save(stream, "JPEG", quality=quality, subsampling=0, optimize=True, icc_profile=_profile())
    data = stream.getvalue()
    # Pillow begins with a JFIF segment, which has to be the first; how it writes XMP depends on its version.
    (length,) = struct.unpack_from(">H", data, 4)
    start = 4 + length
    return [data[:start], *_segments(texts), data[start:]]


@cache
def _profile() -> bytes:
    """An ICC profile of sRGB; the time when it was made is left out, so that equal pictures are equal files."""
    from PIL import ImageCms

    data = bytearray(ImageCms.ImageCmsProfile(ImageCms.createProfile("sRGB")).tobytes())
    data[24:36] = struct.pack(">6H", 2000, 1, 1, 0, 0, 0)  # ICC.1:2022, section 7.2.1
    return bytes(data)


def _segments(texts: Mapping[str, str]) -> list[bytes]:
    """The segments of a JPEG that hold the packet; a scene too long for one goes into an extended packet."""
    packet = _packet(texts)
    if len(packet) <= _SEGMENT:
        return [_segment(_XMP + packet)]
    more = _packet({SCENE_KEY: texts[SCENE_KEY]}, framed=False)
    name = hashlib.md5(more, usedforsecurity=False).hexdigest().upper()
    rest = {key: text for key, text in texts.items() if key != SCENE_KEY}
    packet = _packet(rest, more=name)
    pieces = range(0, len(more), _SEGMENT)
    head = _XMP_MORE + name.encode()
    return [
        _segment(_XMP + packet),
        *(
            _segment(head + struct.pack(">II", len(more), place) + more[place : place + _SEGMENT])
            for place in pieces
        ),
    ]


def _segment(data: bytes) -> bytes:
    return b"\xff\xe1" + struct.pack(">H", len(data) + 2) + data


def _packet(texts: Mapping[str, str], *, more: str = "", framed: bool = True) -> bytes:
    """An XMP packet with the texts; `more` names the extended packet that goes on."""
    from xml.sax.saxutils import escape

    entries = [f"<{_name(key)}>{escape(text)}</{_name(key)}>" for key, text in texts.items()]
    if more:
        entries.append(f"<xmpNote:HasExtendedXMP>{more}</xmpNote:HasExtendedXMP>")
    spaces = " ".join(f'xmlns:{short}="{uri}"' for short, uri in _SPACES.items() if short not in ("x", "rdf"))
    body = "\n".join(
        [
            f'<x:xmpmeta xmlns:x="{_SPACES["x"]}">',
            f'<rdf:RDF xmlns:rdf="{_SPACES["rdf"]}">',
            f'<rdf:Description rdf:about="" {spaces}>',
            *entries,
            "</rdf:Description>",
            "</rdf:RDF>",
            "</x:xmpmeta>",
        ]
    )
    if framed:
        body = f'<?xpacket begin="\ufeff" id="W5M0MpCehiHzreSzNTczkc9d"?>\n{body}\n<?xpacket end="r"?>'
    return body.encode()


def _name(key: str) -> str:
    """The XMP property of a PNG's keyword: `clfractal:scene`, `clfractal:device` and so on, `xmp:CreatorTool`."""
    if key == _SOFTWARE:
        return "xmp:CreatorTool"
    rest = key.removeprefix(SCENE_KEY) or "Scene"
    return f"clfractal:{rest[0].lower()}{rest[1:]}"


def _keyword(tag: str) -> str | None:
    """The PNG's keyword of an XMP property, given as {namespace}name; None for the properties of others."""
    space, _, name = tag[1:].partition("}")
    if space == _SPACES["xmp"] and name == "CreatorTool":
        return _SOFTWARE
    if space != _SPACES["clfractal"] or not name:
        return None
    return SCENE_KEY if name == "scene" else f"{SCENE_KEY}{name[0].upper()}{name[1:]}"


def read_texts(path: str | Path) -> dict[str, str]:
    """The texts of a JPEG or WebP file, by the keywords that a PNG has.

    Raises:
        FileError: it cannot be read, is no such file, or is damaged or cut short.
    """
    with reading(path) as stream:
        start = stream.read(12)
        if start[:3] == b"\xff\xd8\xff":
            return _of_jpeg(stream)
        if start[:4] == b"RIFF" and start[8:] == b"WEBP":
            return _of_webp(stream, int.from_bytes(start[4:8], "little"))
        raise ContentError("is neither a JPEG nor a WebP file")


def read_scene_text(path: str | Path) -> str | None:
    """The scene in a JPEG or WebP file, None if it has none.

    Raises:
        FileError: as for `read_texts`.
    """
    return read_texts(path).get(SCENE_KEY)


_CUT_SHORT = "is cut short: the file ends inside its data"


def _of_jpeg(stream: BinaryIO) -> dict[str, str]:
    stream.seek(2)
    packet, total = b"", 0
    more: dict[bytes, dict[int, bytes]] = {}
    while True:
        head = stream.read(4)
        if len(head) < 4:
            raise ContentError(_CUT_SHORT)
        marker, length = head[1], int.from_bytes(head[2:], "big")
        if head[0] != 0xFF or length < 2:
            raise ContentError("is damaged: its segments are not valid")
        data = stream.read(length - 2)
        if len(data) < length - 2:
            raise ContentError(_CUT_SHORT)
        if marker == 0xE1 and data.startswith(_XMP):
            packet = data[len(_XMP) :]
        elif marker == 0xE1 and data.startswith(_XMP_MORE) and len(data) >= len(_XMP_MORE) + 40:
            name, rest = data[len(_XMP_MORE) :][:32], data[len(_XMP_MORE) + 32 :]
            more.setdefault(name, {})[int.from_bytes(rest[4:8], "big")] = rest[8:]
            total += len(rest)
            if total > _LARGEST_TEXT:
                raise ContentError(f"is damaged: a text of more than {_LARGEST_TEXT:,} bytes")
        if marker == 0xDA:  # the scan: what follows is pixels
            break
    # Within pixels 0xFF is followed by 0 or a restart's number, so these two bytes are the picture's end.
    before = b""
    while piece := stream.read(1 << 20):
        if b"\xff\xd9" in before + piece:
            break
        before = piece[-1:]
    else:
        raise ContentError(_CUT_SHORT)
    properties = _properties(packet)
    name = properties.get(_MORE, "").encode()
    parts = more.get(name, {})
    whole = b"".join(parts[place] for place in sorted(parts))
    if name and hashlib.md5(whole, usedforsecurity=False).hexdigest().upper().encode() != name:
        raise ContentError("is damaged: wrong check sum of its scene")
    return _by_keyword({**_properties(whole), **properties})


def _of_webp(stream: BinaryIO, length: int) -> dict[str, str]:
    size = os.fstat(stream.fileno()).st_size
    if length + 8 > size:
        raise ContentError(_CUT_SHORT)
    place, end = 12, length + 8
    texts: dict[str, str] = {}
    while place + 8 <= end:
        stream.seek(place)
        head = stream.read(8)
        inside = int.from_bytes(head[4:], "little")
        if place + 8 + inside > end:
            raise ContentError("is damaged: its chunks are not valid")
        if head[:4] == b"XMP ":
            if inside > _LARGEST_TEXT:
                raise ContentError(f"is damaged: a text of {inside:,} bytes")
            texts = _by_keyword(_properties(stream.read(inside)))
        place += 8 + inside + inside % 2
    return texts


def _properties(packet: bytes) -> dict[str, str]:
    """The simple properties of a packet, as {namespace}name; those of a packet that is no XML are left out.

    Other programs may write an element as an attribute.
    """
    from xml.etree import ElementTree

    found: dict[str, str] = {}
    if not packet or b"<!" in packet:  # entities could grow without end; XMP has none
        return found
    try:
        root = ElementTree.fromstring(packet)
    except (ElementTree.ParseError, ValueError):
        return found
    for described in root.iter(f"{{{_SPACES['rdf']}}}Description"):
        found |= described.attrib
        found |= {element.tag: element.text or "" for element in described}
    return found


def _by_keyword(properties: Mapping[str, str]) -> dict[str, str]:
    named = {_keyword(tag): text for tag, text in properties.items()}
    return {key: text for key, text in named.items() if key is not None}
