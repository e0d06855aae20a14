"""Canvases to a screen's numbers, on the device: exposure, tone, two eyes in one picture, sRGB, dither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device import program
from clfractal.device.compiler import Argument, Warm
from clfractal.device.groups import fitting
from clfractal.device.select import Device
from clfractal.device.source import FlatText, flatten
from clfractal.device.structs import Field, Struct
from clfractal.device.watched import Watched
from clfractal.engine.canvas import Canvas, whole_groups
from clfractal.engine.job import Identity, Job, StereoPair
from clfractal.files import srgb, tone
from clfractal.files.tone_names import TONES, Tone
from clfractal.images.anaglyph import matrices
from clfractal.images.compose import Side
from clfractal.images.modes import BELOW, BESIDE, eye_size, picture_size
from clfractal.scene.layout import Place
from clfractal.scene.stereo import APART, Mode, Stereo

SHARP = 4
"""Samples of each pixel from which on nothing is smoothed."""
MOST_VIEWS = 64
GROUP = (32, 8)
MODES = ("ONE", "BESIDE", "BELOW", "ROWS", "COLUMNS", "CHECKERBOARD", "CHESSBOARD", "ANAGLYPH")
_WAYS: dict[Mode, str] = {
    "left": "ONE",
    "right": "ONE",
    **dict.fromkeys(BESIDE, "BESIDE"),
    **dict.fromkeys(BELOW, "BELOW"),
    "rows": "ROWS",
    "columns": "COLUMNS",
    "checkerboard": "CHECKERBOARD",
    "anaglyph_chessboard": "CHESSBOARD",
    "anaglyph": "ANAGLYPH",
}

SHOW = Struct(
    "Show",
    [
        Field("width", "int", 0, "of what is shown, pixels"),
        Field("height", "int"),
        Field("mode", "int", 0, "MODE_..."),
        Field("first", "int", 0, "the eye shown first (left, upper, even): 0 left, 1 right"),
        Field("eye_width", "int", 0, "of each eye's picture, pixels"),
        Field("eye_height", "int"),
        Field("views", "int", 0, "number of views"),
        Field("smooth", "int", 0, "1: coarse pictures are interpolated"),
        Field("transparent", "int", 0, "1: a board shows where nothing covers it"),
        Field("tone", "int", 0, "TONE_..."),
        Field("gain", "float", 0, "two to the power of the exposure"),
        Field("background", "float", 3, "between the views of a layout, linear"),
        Field(
            "matrix",
            "float",
            18,
            "of an anaglyph, a row for each colour: left R, G, B, right R, G, B; or two filters",
        ),
    ],
)
SHOWN_VIEW = Struct(
    "ShownView",
    [
        Field("offset", "int", 0, "first pixel in the canvas"),
        Field("width", "int", 0, "in the canvas, pixels"),
        Field("height", "int"),
        Field("divider", "int", 0, "pixels of the picture for one in the canvas"),
        Field("left", "int", 0, "place in the eye's picture, pixels"),
        Field("top", "int"),
        Field("right", "int", 0, "the first column and row behind it"),
        Field("bottom", "int"),
        Field("eye", "int", 0, "0: left, or no eye's in particular; 1: right"),
        Field("smoothing", "float", 0, "share of one step of diffusion that its pixels take, 0 to 1"),
    ],
)


@dataclass(frozen=True, slots=True)
class Look:
    """How a finished picture is shown; changing it needs no new rays.

    Attributes:
        exposure: stops.
        stereo: the scene's section; None without stereo.
        smooth: whether coarse pictures are interpolated, and the noise of those under way is smoothed.
        transparent: whether the background is, and a board is shown there.
        tone: the curve from light to what is shown.
    """

    exposure: float = 0.0
    stereo: Stereo | None = None
    smooth: bool = True
    transparent: bool = False
    tone: Tone = "linear"


@dataclass(frozen=True, slots=True)
class Arrangement:
    """Where the views of a job lie in each eye's picture; follows from the job.

    Attributes:
        image: width and height of the scene's image, pixels.
        eyes: of each view, 0 (left, or none) or 1.
        places: of each view in its eye's picture.
        background: between views, linear.
        stereo: the section that was rendered; None without stereo.
    """

    image: tuple[int, int]
    eyes: tuple[int, ...]
    places: tuple[Place, ...]
    background: tuple[float, float, float] = field(default=(0.0, 0.0, 0.0))
    stereo: Stereo | None = None

    @classmethod
    def of(cls, job: Job) -> Arrangement:
        """The arrangement of a job's views."""
        image = (job.scene.image.width, job.scene.image.height)
        made = job.composition
        parts: dict[Side, Any] = dict(made.eyes) if isinstance(made, StereoPair) else {"left": made}
        eyes, places = [0] * len(job.views), [Place(0, 0, *image)] * len(job.views)
        background = (0.0, 0.0, 0.0)
        for side, part in parts.items():
            if isinstance(part, Identity):
                numbers: Sequence[int] = (part.view,)
                size = (job.views[part.view].scene.image.width, job.views[part.view].scene.image.height)
                places[part.view] = Place(0, 0, *size)
            else:
                numbers, background = part.views, part.background
                for number, place in zip(part.views, part.places, strict=True):
                    places[number] = place
            for number in numbers:
                eyes[number] = int(side == "right")
        return cls(image, tuple(eyes), tuple(places), background, job.scene.stereo)

    def fitting(self, look: Look) -> Look:
        """The look, or the nearest one that these views can be shown with.

        For a moment a window has a picture that was rendered for another way of stereo than the one just chosen: without a
        second eye, or with eyes squeezed in another way. (Scenes are checked, so a squeezed picture can be halved.)
        """
        have, want = self.stereo, look.stereo
        if have is None:
            return look if want is None else replace(look, stereo=None)
        squeeze = (1, 1) if want is None else want.squeeze
        if squeeze == have.squeeze:
            eyes = {"left": {0}, "right": {1}}.get(want.mode if want is not None else "left", {0, 1})
            if eyes <= set(self.eyes):
                return look
        if have.squeeze != (1, 1):
            return replace(look, stereo=have)
        mode: Mode = "left" if 0 in self.eyes else "right"
        return replace(look, stereo=have.model_copy(update={"mode": mode}))

    def size(self, look: Look) -> tuple[int, int]:
        """Width and height of what is shown."""
        stereo = self.fitting(look).stereo
        return self.image if stereo is None else picture_size(_joined(stereo), self.image)


def smoothing_of(samples: int) -> float:
    """How strongly a picture under way is smoothed whose pixels have so many samples: 1 with one, nothing from four on.

    It is the share that is taken of a step of diffusion (`diffuse` in `show.h`). A whole step leaves 0.64 of the deviation
    of noise whose pixels are independent, and all of the picture's mean.
    """
    return max(0.0, (SHARP - samples) / (SHARP - 1))


def can_reduce(canvas: Canvas, arrangement: Arrangement, look: Look) -> bool:
    """Whether a coarse picture may be shown by as many pixels as it has, and enlarged afterwards.

    Not if two eyes' pixels lie between each other, or pictures beside each other: enlarging would mix them.
    """
    look = arrangement.fitting(look)
    alone = look.stereo is None or look.stereo.mode in ("left", "right", "anaglyph")
    coarse = all(part.divider > 1 for part in canvas.parts)
    return coarse and alone and len(set(arrangement.places)) == 1 and len(canvas.parts) <= 2


def _joined(stereo: Stereo) -> Stereo:
    """What is shown of a pair that stays apart in files: both beside each other."""
    return stereo.model_copy(update={"mode": "split"}) if stereo.mode in APART else stereo


def program_text(*, to_image: bool) -> FlatText:
    """The whole text of the program that writes to an image or to a buffer."""
    defines: dict[str, object] = {f"MODE_{name}": number for number, name in enumerate(MODES)}
    defines |= {
        "TABLE_SHIFT": srgb.TABLE_SHIFT,
        "TABLE_LOWEST": srgb.TABLE_LOWEST,
        "TABLE_ONE": srgb.TABLE_ONE,
    }
    defines |= _tone_defines()
    structs = SHOW.c_text("float32") + SHOWN_VIEW.c_text("float32")
    entry = "images/show_image.cl" if to_image else "images/show.cl"
    return flatten(entry, generated={"show_structs.h": structs}, defines=defines)


class Shower:
    """The kernels that show canvases, on one device, with a queue of its own: it does not wait for a picture's launches.

    Args:
        to_image: whether it writes to an image (a texture that is shared) instead of a buffer.

    Raises:
        DeviceError, KernelBuildError: it cannot be built.
    """

    def __init__(self, device: Device, *, to_image: bool = False) -> None:
        self.device, self.to_image = device, to_image
        text = program_text(to_image=to_image)
        buffer = Argument("buffer", 4096)
        warm = [
            Warm("show", GROUP, GROUP, (buffer,) * 6),
            Warm("diffuse", GROUP, GROUP, (buffer, buffer, Argument("scalar", dtype="int32"), buffer)),
        ]
        built = program.build(
            device,
            text.text,
            flags=("-cl-std=CL1.2", "-cl-denorms-are-zero"),
            sources=text.sources,
            warm=[] if to_image else warm,
        )
        self._kernel, self._diffuse = built.kernel("show"), built.kernel("diffuse")
        self._smoothed: Any = None
        self._room = 0
        with device.failures("opening the device"):
            self.queue = cl.CommandQueue(device.context)
        self._table, self._tones = self._sent(srgb.table8()), self._sent(tone.tables())
        # A write is a command, and would wait until PoCL's cores are done with a picture's launch.
        self._views = Watched(device, np.zeros(MOST_VIEWS, SHOWN_VIEW.dtype("float32")))
        self._show = Watched(device, np.zeros(1, SHOW.dtype("float32")))

    def enqueue(
        self,
        canvas: Canvas,
        arrangement: Arrangement,
        look: Look,
        shown: Any,
        *,
        reduced: bool = False,
        smoothing: Sequence[float] = (),
    ) -> cl.Event:
        """Starts the kernel on a canvas whose picture is complete; `shown` is where pixels go, row by row from the top.

        Args:
            reduced: show only the pixels that the canvas has, see `can_reduce`.
            smoothing: of each view, see `smoothing_of`; empty: nothing is smoothed.

        Raises:
            DeviceError: the device failed.
        """
        record, views = self.records(canvas, arrangement, look, reduced=reduced, smoothing=smoothing)
        width, height = int(record["width"][0]), int(record["height"][0])
        size = whole_groups((width, height), GROUP)
        with self.device.failures("showing the picture"):
            self._views.put(self.queue, views)
            self._show.put(self.queue, record)
            colors = self._smooth(canvas, views) if views["smoothing"].any() else canvas.colors
            self._kernel.set_args(
                colors, self._views.buffer, self._show.buffer, self._table, self._tones, shown
            )
            group = fitting(self.device, self._kernel, GROUP)
            event = cl.enqueue_nd_range_kernel(self.queue, self._kernel, size, group)
            self.queue.flush()
        return event

    def _smooth(self, canvas: Canvas, views: npt.NDArray[np.void]) -> Any:
        """The buffer of the canvas's colours with less noise; `views` have been sent."""
        if canvas.pixels > self._room:
            self._smoothed, self._room = None, 0
            self._smoothed = self.device.buffer(16 * canvas.pixels, "a picture on the screen")
            self._room = canvas.pixels
        group = fitting(self.device, self._diffuse, GROUP)
        for number, part in enumerate(canvas.parts):
            self._diffuse.set_args(canvas.colors, self._views.buffer, np.int32(number), self._smoothed)
            size = whole_groups((part.region.width, part.region.height), GROUP)
            cl.enqueue_nd_range_kernel(self.queue, self._diffuse, size, group)
        return self._smoothed

    @staticmethod
    def records(
        canvas: Canvas,
        arrangement: Arrangement,
        look: Look,
        *,
        reduced: bool = False,
        smoothing: Sequence[float] = (),
    ) -> tuple[npt.NDArray[np.void], npt.NDArray[np.void]]:
        """The kernel's structs, of the whole and of the views."""
        look = arrangement.fitting(look)
        strengths = smoothing if smoothing and look.smooth else (0.0,) * len(canvas.parts)
        first_part = canvas.parts[0].region
        width, height = (first_part.width, first_part.height) if reduced else arrangement.size(look)
        eye = arrangement.image if look.stereo is None else eye_size(_joined(look.stereo), arrangement.image)
        mode, first, matrix = _way(look)
        values = {
            "width": width,
            "height": height,
            "mode": mode,
            "first": first,
            "eye_width": eye[0],
            "eye_height": eye[1],
            "views": len(canvas.parts),
            "smooth": int(look.smooth),
            "transparent": int(look.transparent),
            "tone": TONES.index(look.tone),
            "gain": 2.0**look.exposure,
            "background": np.array(arrangement.background, np.float32),
            "matrix": matrix,
        }
        rows = []
        views = zip(canvas.parts, arrangement.places, arrangement.eyes, strengths, strict=True)
        for part, place, side, strength in views:
            region, divider = part.region, 1 if reduced else part.divider
            if reduced:
                place = Place(-region.x, -region.y, region.right, region.bottom)
            left, top = place.x + region.x * divider, place.y + region.y * divider
            right = min(left + region.width * divider, place.x + place.width)
            bottom = min(top + region.height * divider, place.y + place.height)
            rows.append(
                {
                    "offset": part.offset,
                    "width": region.width,
                    "height": region.height,
                    "divider": divider,
                    "left": left,
                    "top": top,
                    "right": right,
                    "bottom": bottom,
                    "eye": side,
                    "smoothing": strength,
                }
            )
        return SHOW.array("float32", [values]), SHOWN_VIEW.array("float32", rows)

    def _sent(self, data: npt.NDArray[Any]) -> cl.Buffer:
        buffer = self.device.buffer(data.nbytes, "a table", read_only=True)
        with self.device.failures("uploading constants"):
            cl.enqueue_copy(self.queue, buffer, data)
        return buffer


def _tone_defines() -> dict[str, object]:
    """The numbers of `files/tone.py` in the kernel's text; hexadecimal, so that each is the same."""

    def exact(value: np.float32) -> str:
        return f"{float(value).hex()}f"

    kept = np.float32(1) - tone.INSET
    found: dict[str, object] = {f"TONE_{name.upper()}": number for number, name in enumerate(TONES)}
    found |= {"TONE_SHIFT": tone.SHIFT, "TONE_LOWEST": tone.LOWEST, "TONE_ENTRIES": tone.ENTRIES}
    found |= {"TONE_LIGHTEST": exact(tone.LIGHTEST), "TONE_INSET": exact(tone.INSET)}
    found |= {"TONE_KEPT": exact(kept), "TONE_BACK": exact(np.float32(1) / kept)}
    return found | {
        f"{name}_{color}": exact(weight)
        for name, weights in (("LUMINANCE", tone.LUMINANCE), ("GREY", tone.GREY))
        for color, weight in zip("RGB", weights, strict=True)
    }


def _way(look: Look) -> tuple[int, int, npt.NDArray[np.float32]]:
    """The mode's number, the eye that is shown first, and the matrices."""
    matrix = np.zeros(18, np.float32)
    if look.stereo is None:
        return MODES.index("ONE"), 0, matrix
    stereo = _joined(look.stereo)
    mode, way = stereo.mode, _WAYS[stereo.mode]
    if mode == "anaglyph":
        left, right = matrices(stereo.method, stereo.glasses)
        matrix[:] = np.concatenate([left, right], axis=1).astype(np.float32).ravel()
    elif mode == "anaglyph_chessboard":
        matrix[:6] = np.array(stereo.colors, np.float32).ravel()
    return MODES.index(way), int(mode == "right" if way == "ONE" else stereo.swap), matrix
