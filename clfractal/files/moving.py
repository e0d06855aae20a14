"""Writes moving pictures by FFmpeg's libraries: codecs, pixels, and what players must know of colours.

Pictures come in as sRGB codes, and are stored as red, green and blue or, as most codecs want it, as Y'CbCr by the matrix of
ITU-R BT.709, in its limited range. The file tells so, with the primaries of BT.709 and the transfer function of sRGB (IEC
61966-2-1).
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, SceneError, Where
from clfractal.files.atomic import atomic_writer, check_output, file_error
from clfractal.files.encoding import as_usual_threads
from clfractal.files.film_kinds import CODECS, CONTAINERS, DEFAULTS, MATROSKA, Codec, Recipe
from clfractal.files.frame_packing import arrangements, frame_packing, with_message

if TYPE_CHECKING:
    from av import VideoFrame

Codes = npt.NDArray[np.uint16]

# Weights of red and blue in BT.709's luma (ITU-R BT.709-6, item 3.2).
_RED, _BLUE = 0.2126, 0.0722
# FFmpeg's numbers for BT.709's primaries and matrix, sRGB's transfer function, RGB, and for the two ranges.
_BT709, _SRGB, _RGB, _LIMITED, _FULL = 1, 13, 0, 1, 2


@dataclass(frozen=True, slots=True)
class Plan:
    """A film file as it will be written.

    Attributes:
        path: the file.
        codec: how it is coded.
        bits, chroma: of its pixels.
        quality: the encoder's number.
        size: width and height, pixels.
        fps: frames per second.
        stereo: the scene's `stereo.mode`; None: a film for one eye.
        swap: whether the eyes' places are exchanged.
    """

    path: Path
    codec: Codec
    bits: int
    chroma: str
    quality: int | None
    size: tuple[int, int]
    fps: Fraction
    stereo: str | None = None
    swap: bool = False

    @property
    def tells_stereo(self) -> bool:
        """Whether the file tells players how it holds two pictures."""
        holds_one = self.stereo not in MATROSKA  # one picture, or one of two colours
        return holds_one or self.stereo_mode is not None or self.packing is not None

    @property
    def stereo_mode(self) -> str | None:
        """What Matroska calls the arrangement of two pictures; None if the film is none, or holds one picture."""
        if self.stereo is None or self.stereo not in MATROSKA or self.path.suffix.lower() != ".mkv":
            return None
        return MATROSKA[self.stereo][self.swap]

    @property
    def packing(self) -> bytes | None:
        """The message that tells the arrangement within the stream of pictures; None if the codec has none."""
        if self.stereo is None or self.stereo not in arrangements(self.codec.library):
            return None
        return frame_packing(self.codec.library, self.stereo, swap=self.swap)


def plan_film(
    path: Path,
    recipe: Recipe,
    size: tuple[int, int],
    fps: float,
    *,
    stereo: str | None = None,
    swap: bool = False,
) -> Plan:
    """Decides how a film file is written, before anything is rendered.

    Raises:
        FileError: the file cannot be written, or cannot hold the codec or pictures of this size; `av` is missing.
        SceneError: an option does not fit the codec.
    """
    check_output(path, tuple(CONTAINERS))
    suffix = path.suffix.lower()
    name = recipe.codec if recipe.codec is not None else DEFAULTS[suffix]
    if name not in CODECS:
        raise SceneError(f"must be {', '.join(CODECS)}, got {name[:40]!r}", Where("--codec"))
    codec = CODECS[name]
    where = Where(str(path))
    if suffix not in codec.containers:
        raise FileError(f"cannot hold {name}; it goes into {', '.join(codec.containers)}", where)
    if stereo in ("pair", "multi_view"):
        raise FileError(f"cannot be a film of {stereo}; choose another stereo.mode, such as split", where)
    bits, chroma = _pixels(name, codec, recipe)
    _check_size(size, chroma, codec.least_side, where)
    quality = codec.quality[3] if codec.quality is not None else None
    if recipe.quality is not None:
        if codec.quality is None:
            raise SceneError(f"has no meaning for {name}, which has no such setting", Where("--crf"))
        _, least, most, _ = codec.quality
        if not least <= recipe.quality <= most:
            raise SceneError(
                f"must be from {least} to {most} for {name}, got {recipe.quality}", Where("--crf")
            )
        quality = recipe.quality
    _library(codec)
    rate = Fraction(fps).limit_denominator(100_000)
    return Plan(path, codec, bits, chroma, quality, size, rate, stereo, swap)


def _pixels(name: str, codec: Codec, recipe: Recipe) -> tuple[int, str]:
    for bits, chroma in codec.formats:
        if recipe.bits in (None, bits) and recipe.chroma in (None, chroma):
            return bits, chroma
    known = ", ".join(f"{chroma} with {bits} bits" for bits, chroma in codec.formats)
    option = "--bits" if recipe.bits is not None else "--chroma"
    raise SceneError(f"does not fit: {name} has {known}", Where(option))


def _check_size(size: tuple[int, int], chroma: str, least: int, where: Where) -> None:
    wide, high = _halves(chroma)
    if size[0] % wide or size[1] % high:
        what = "width and height" if high == 2 else "width"
        raise FileError(
            f"needs an even {what} with chroma {chroma}, got {size[0]} x {size[1]}; change the size, or use --chroma 444",
            where,
        )
    if max(size) > 16_384 or min(size) < least:
        raise FileError(f"cannot hold pictures of {size[0]} x {size[1]} pixels: {least} to 16,384", where)


def _halves(chroma: str) -> tuple[int, int]:
    """How many pixels share a chroma sample, across and down."""
    return (2 if chroma in ("420", "422") else 1, 2 if chroma == "420" else 1)


def _library(codec: Codec) -> Any:
    """The package; FileError if it is not there, or was built without the codec."""
    try:
        import av
    except ImportError:
        raise FileError("needs the package av: pip install 'clfractal[film]'", Where("-o")) from None
    if codec.library not in av.codecs_available:
        raise FileError(f"the installed package av has no {codec.library}", Where("--codec"))
    return av


def write_film(plan: Plan, pictures: Iterable[Path]) -> None:
    """Writes a film of pictures; the file appears when it is whole.

    Args:
        pictures: PNG files of the planned size, in their order.

    Raises:
        FileError: a picture cannot be read, or the film not be written.
    """
    av = _library(plan.codec)
    with atomic_writer(plan.path) as beside:
        try:
            form = CONTAINERS[plan.path.suffix.lower()]
            with av.open(
                str(beside),
                "w",
                format=form,
                options={"movflags": "+faststart"} if form in ("mp4", "mov") else {},
            ) as film:
                stream = _stream(plan, film)
                with as_usual_threads(plan.codec.library):
                    stream.codec_context.open()
                for number, picture in enumerate(pictures):
                    frame = _frame(av, plan, _read(av, picture, plan))
                    frame.pts = number
                    frame.time_base = 1 / plan.fps
                    film.mux(_told(av, plan, stream.encode(frame)))
                film.mux(_told(av, plan, stream.encode()))
        except av.FFmpegError as error:
            raise file_error(plan.path, "cannot be written", error) from error


def _told(av: Any, plan: Plan, packets: list[Any]) -> list[Any]:
    """Coded pictures, of which the key ones tell how two eyes' pictures lie in them."""
    if plan.packing is None:
        return packets
    return [_with_packing(av, plan, packet) if packet.is_keyframe else packet for packet in packets]


def _with_packing(av: Any, plan: Plan, packet: Any) -> Any:
    assert plan.packing is not None
    told = av.Packet(with_message(bytes(packet), plan.packing, plan.codec.library))
    told.stream, told.time_base, told.is_keyframe = packet.stream, packet.time_base, True
    told.pts, told.dts, told.duration = packet.pts, packet.dts, packet.duration
    return told


def _stream(plan: Plan, film: Any) -> Any:
    options = dict(plan.codec.options)
    if plan.codec.quality is not None:
        options[plan.codec.quality[0]] = str(plan.quality)
    if plan.codec.library == "prores_ks":
        options["profile"] = "4" if plan.chroma == "444" else "3"
    stream = film.add_stream(plan.codec.library, rate=plan.fps, options=options)
    stream.width, stream.height = plan.size
    stream.pix_fmt = plan.codec.formats[plan.bits, plan.chroma]
    stream.time_base = 1 / plan.fps
    context = stream.codec_context
    context.time_base = 1 / plan.fps
    context.framerate = plan.fps
    _tell_colors(context, plan)
    if plan.stereo_mode is not None:
        stream.metadata["stereo_mode"] = plan.stereo_mode
    return stream


def _tell_colors(said_of: Any, plan: Plan) -> None:
    """Says of a stream, or of one picture in it, what its numbers mean."""
    is_rgb = plan.chroma == "rgb"
    said_of.color_primaries, said_of.color_trc = _BT709, _SRGB
    said_of.colorspace = _RGB if is_rgb else _BT709
    said_of.color_range = _FULL if is_rgb else _LIMITED


def _read(av: Any, path: Path, plan: Plan) -> Codes:
    """A picture as codes of 16 bits, shape (height, width, 3)."""
    try:
        with av.open(str(path)) as file:
            frame = next(file.decode(video=0))
    except (av.FFmpegError, StopIteration) as error:
        raise file_error(path, "cannot be read", error) from error
    if frame.format.components[0].bits > 8:
        codes: Codes = frame.to_ndarray(format="rgb48le")
    else:
        codes = frame.to_ndarray(format="rgb24").astype(np.uint16) * np.uint16(257)
    if codes.shape[:2] != plan.size[::-1]:
        raise FileError(
            f"is {codes.shape[1]} x {codes.shape[0]} pixels, and not as the film", Where(str(path))
        )
    return codes


def _frame(av: Any, plan: Plan, codes: Codes) -> VideoFrame:
    """A picture as the encoder wants it."""
    name = plan.codec.formats[plan.bits, plan.chroma]
    frame = av.VideoFrame(*plan.size, name)
    if name == "bgr0":
        eight = np.zeros((*codes.shape[:2], 4), np.uint8)
        eight[..., :3] = _rounded(codes.astype(np.float64) / 257, 255)[..., ::-1]
        planes = [eight.reshape(codes.shape[0], -1)]
    elif plan.chroma == "rgb":
        planes = [codes[..., channel] for channel in (1, 2, 0)]
    else:
        planes = ycbcr(codes, plan.bits, plan.chroma)
    for plane, values in zip(frame.planes, planes, strict=True):
        rows = np.zeros((plane.height, plane.line_size), np.uint8)
        wide = np.ascontiguousarray(values).view(np.uint8).reshape(plane.height, -1)
        rows[:, : wide.shape[1]] = wide
        plane.update(rows.tobytes())
    _tell_colors(frame, plan)
    return frame


def ycbcr(codes: Codes, bits: int, chroma: str) -> list[npt.NDArray[np.uint8] | npt.NDArray[np.uint16]]:
    """The planes of luma and chroma of a picture, by BT.709 in its limited range.

    Chroma samples lie at the left one of two pixels and between two rows, as MPEG-2 and its successors have them.

    Args:
        codes: shape (height, width, 3), sRGB codes of 16 bits.
        bits: of a channel, 8 or 10.
        chroma: 420, 422 or 444.
    """
    red, green, blue = (codes[..., i] / 65535.0 for i in range(3))
    luma = _RED * red + (1 - _RED - _BLUE) * green + _BLUE * blue
    scale, most = 2.0 ** (bits - 8), 2**bits - 1
    planes = [_rounded(scale * (16 + 219 * luma), most)]
    wide, high = _halves(chroma)
    for difference, weight in ((blue - luma, _BLUE), (red - luma, _RED)):
        plane = difference / (2 * (1 - weight))
        if wide == 2:
            padded = np.pad(plane, ((0, 0), (1, 1)), mode="edge")
            plane = (0.25 * padded[:, :-2] + 0.5 * padded[:, 1:-1] + 0.25 * padded[:, 2:])[:, ::2]
        if high == 2:
            plane = 0.5 * (plane[::2] + plane[1::2])
        planes.append(_rounded(scale * (128 + 224 * plane), most))
    return planes


def _rounded(values: npt.NDArray[np.float64], most: int) -> npt.NDArray[np.uint8] | npt.NDArray[np.uint16]:
    whole = np.clip(np.rint(values), 0, most)
    return whole.astype(np.uint8) if most == 255 else whole.astype(np.uint16)
