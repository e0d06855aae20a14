"""The framebuffer: finished tiles become named channels, in memory; `store.py` has the one on disk."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np
import numpy.typing as npt

from clfractal.errors import SceneError, Where, arguments, unknown_name
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS, check_channels
from clfractal.files.tone_names import Tone
from clfractal.images.develop import Development, developed, rgb8
from clfractal.images.provenance import Provenance, RenderDevice
from clfractal.images.tiled import Bands, Floats, Picture, check_tile
from clfractal.images.tiles import TILE, Region, TileGrid

if TYPE_CHECKING:
    from PIL.Image import Image
    from xarray import Dataset

    from clfractal.images.probe import Probe
    from clfractal.scene.stereo import Stereo

Facts: TypeAlias = Mapping[str, Any] | Callable[[], Mapping[str, Any]]
"""Values by their names, or a function that finds them."""


class _Known:
    """Facts that are found when they are first asked for, and those that were added before that."""

    def __init__(self, facts: Facts) -> None:
        self._find = facts if callable(facts) else None
        self._found: dict[str, Any] = {} if callable(facts) else dict(facts)

    @property
    def facts(self) -> dict[str, Any]:
        if self._find is not None:
            self._found = {**self._find(), **self._found}
            self._find = None
        return self._found

    def add(self, name: str, value: Any) -> None:
        self._found[name] = value

    def __reduce__(self) -> tuple[type[_Known], tuple[dict[str, Any]]]:
        return _Known, (self.facts,)


class Framebuffer:
    """A picture in memory: `framebuffer["R"]` is a float32 array of shape (height, width) of the region.

    R, G, B are linear Rec. 709; if the background is transparent they are premultiplied by A.
    `header` may hold: `scene` (text), `version`, `device`, `precision`, `seconds`, `exposure` (stops), `tone` (a curve) and
    `transparent` (what PNG, JPEG and WebP files and notebooks show), and `worldToCamera` and
    `worldToNDC`, 4 x 4 matrices for row vectors (point_camera = [x, y, z, 1] @ matrix: the translation is the
    last row), as in OpenEXR's standard attributes. A function that returns the header is called when it is first needed.

    Raises:
        SceneError: an unknown channel name.
        ValueError: the region is not inside the picture.
    """

    def __init__(
        self,
        channels: Sequence[str] = DEFAULT_CHANNELS,
        display: tuple[int, int] = (1, 1),
        region: Region | None = None,
        header: Facts | None = None,
    ) -> None:
        self.channels: tuple[str, ...] = check_channels(channels)
        self.display = display
        self.region = region or Region(0, 0, *display)
        if not self.region.inside(*display):
            raise ValueError(f"{self.region} is not inside a picture of {display[0]} x {display[1]}")
        self.grid = TileGrid(self.region)
        self._header = _Known(header or {})
        self._stats = _Known({})
        self.prober: Callable[[Framebuffer, int, int], Probe] | None = None
        """Answers `probe`, of a framebuffer that was rendered."""
        self.inputs: tuple[Path, ...] = ()
        """Files that were read for the picture; `save` replaces none of them."""
        self.mixed_from: Picture | None = None
        """The picture that mixes two eyes' pictures in this one, if it does: a tone curve bends each eye's before."""
        self.stereo: Stereo | None = None
        """How two eyes' pictures were put into this one; None if it shows one."""
        self.stage = ""
        """How far a picture that is made in passes is, such as `4 of 16 samples`; empty once it is finished."""
        # Not `zeros`: NumPy asks for large pages only for memory that it does not want cleared, and small ones take the
        # system ten times as long.
        self._data = np.empty((len(self.channels), self.region.height, self.region.width), np.float32)
        self._planes = dict(zip(self.channels, self._data, strict=True))  # views of it
        for name, plane in self._planes.items():
            plane.fill(CHANNELS[name].fill)
        self._done = np.zeros(self.grid.count, dtype=np.bool_)
        self.provenance = Provenance(self.grid.count)
        """Which devices made the tiles, if several did."""

    @property
    def makers(self) -> Provenance:
        """The former name of `provenance`."""
        warnings.warn("Framebuffer.makers is Framebuffer.provenance", DeprecationWarning, stacklevel=2)
        return self.provenance

    @property
    def header(self) -> dict[str, Any]:
        """The header of picture files; made at first use if it was given as a function."""
        return self._header.facts

    @property
    def stats(self) -> dict[str, Any]:
        """What the render took and what it counted, with the keys of `--stats`; empty if nothing was rendered.

        Times of a framebuffer of a refinement are those of all its passes so far. `wall_ms` has no time for files.
        """
        return self._stats.facts

    @property
    def remarks(self) -> tuple[str, ...]:
        """What the user should know about the picture, a line each, such as that nothing is seen; mostly none."""
        return tuple(self.stats.get("remarks", ()))

    def tell(self, key: str, value: Any) -> None:
        """Adds an entry to the header, even if the header has not been made yet."""
        self._header.add(key, value)

    def tell_stats(self, stats: Facts) -> None:
        """Says what the render took; a function is called when `stats` is first asked for."""
        self._stats = _Known(stats)

    @property
    def width(self) -> int:
        """Width of the region, in pixels."""
        return self.region.width

    @property
    def height(self) -> int:
        """Height of the region, in pixels."""
        return self.region.height

    @property
    def done(self) -> npt.NDArray[np.bool_]:
        """For each tile, whether it is finished."""
        return self._done

    def __getitem__(self, name: str) -> Floats:
        """One channel, shape (height, width).

        Raises:
            KeyError: the framebuffer has no such channel.
        """
        try:
            return self._planes[name]
        except KeyError:
            raise KeyError(unknown_name("channel", name, self.channels)) from None

    def __contains__(self, name: object) -> bool:
        return name in self._planes

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __getstate__(self) -> dict[str, Any]:
        return {name: value for name, value in self.__dict__.items() if name != "_planes"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__.update(state)
        self._planes = dict(zip(self.channels, self._data, strict=True))

    def __array__(self, dtype: npt.DTypeLike | None = None, copy: bool | None = None) -> npt.NDArray[Any]:
        """The colours R, G, B, float32 of shape (height, width, 3); `np.asarray(framebuffer)` calls this.

        Raises:
            KeyError: the framebuffer has no R, G, B.
            ValueError: `copy` is False: channels lie one after the other in memory, colours side by side.
        """
        if copy is False:
            raise ValueError("the colours of a framebuffer cannot be an array without copying them")
        colors = np.stack([self["R"], self["G"], self["B"]], axis=-1)
        return colors if dtype is None else colors.astype(dtype, copy=False)

    def __repr__(self) -> str:
        part = "" if self.region == Region(0, 0, *self.display) else f", {self.region}"
        size = f"{self.display[0]}x{self.display[1]}"
        stage = self.stage or f"{self._done.mean():.0%} done"
        return f"<Framebuffer {size}{part}, channels {' '.join(self.channels)}, {stage}>"

    def put(self, tile_index: int, array: Floats) -> None:
        """Stores a tile: float32 of shape (channels, rows, columns)."""
        tile = self.grid.tile(tile_index)
        check_tile(array, tile, self.channels)
        top, left = tile.y - self.region.y, tile.x - self.region.x
        self._data[:, top : top + tile.height, left : left + tile.width] = array
        self._done[tile_index] = True

    def put_tiles(
        self, indices: npt.NDArray[np.int32], framebuffer: Floats, render_device: RenderDevice | None = None
    ) -> None:
        """Stores whole tiles, float32 of shape (tiles, channels, TILE, TILE), as far as they lie in the region."""
        if render_device is not None:
            self.provenance.put(indices, render_device)
        region, data = self.region, self._data
        boxes = self.grid.boxes(indices).tolist()
        for (x, y, width, height), array in zip(boxes, framebuffer, strict=True):
            top, left = y % TILE, x % TILE
            part = array[:, top : top + height, left : left + width]
            data[:, y - region.y : y - region.y + height, x - region.x : x - region.x + width] = part
        self._done[indices] = True

    def fill(self, planes: Mapping[str, Floats]) -> None:
        """Stores the whole region: of each channel float32 of shape (height, width)."""
        for name in self.channels:
            self._planes[name][:] = planes[name]
        self._done[:] = True

    def with_planes(self, planes: Mapping[str, Floats]) -> Framebuffer:
        """The same picture with other channels: of each float32 of shape (height, width)."""
        framebuffer = Framebuffer(tuple(planes), self.display, self.region, lambda: self.header)
        framebuffer.fill(planes)
        framebuffer._done[:] = self.done
        framebuffer.provenance, framebuffer.prober, framebuffer.inputs, framebuffer.stage = (
            self.provenance,
            self.prober,
            self.inputs,
            self.stage,
        )
        return framebuffer

    def take(self, other: Framebuffer) -> None:
        """Copies another framebuffer of the same region."""
        for name in self.channels:
            self._planes[name][:] = other[name]
        self._done[:] = other.done
        self.provenance = other.provenance

    def bands(self) -> Bands:
        """The picture from top to bottom, one row of tiles at a time: (first_row, channel -> rows)."""
        row = self.region.y
        while row < self.region.bottom:
            end = min((row // TILE + 1) * TILE, self.region.bottom)
            part = slice(row - self.region.y, end - self.region.y)
            yield row, {name: plane[part] for name, plane in self._planes.items()}
            row = end

    def probe(self, x: int, y: int) -> Probe:
        """What lies at a pixel: the point, its normal, depth and distance, counts.

        A framebuffer that has the channels Z, N, P, iterations and steps tells it from them; of several samples they have
        the one nearest to the pixel's middle. For any other framebuffer one ray is rendered, through the pixel's middle.

        Args:
            x, y: the pixel, from the top left of the whole picture, as of `region`.

        Raises:
            SceneError: the framebuffer does not hold that pixel, or was not made by a render.
            DeviceError, KernelBuildError: a ray is needed, and the framebuffer's device is gone or failed.
        """
        if self.prober is None:
            raise SceneError("only framebuffers that were rendered can be probed", Where())
        return self.prober(self, x, y)

    def save(self, path: str | Path, **settings: Any) -> None:
        """Writes an .exr, .png, .jpg or .webp file; settings as in `outputs.save_outputs`.

        Raises:
            SceneError: a setting is wrong.
            FileError: it cannot be written, or is one of the files that were read for the picture.
        """
        from clfractal.files.inputs import refuse_overwriting
        from clfractal.images.outputs import save_outputs

        path = arguments.path_of("path", path)
        refuse_overwriting([path], self.inputs)
        save_outputs(self, [path], **settings)

    def developed_parts(self, development: Development) -> Picture | None:
        """The picture with each of two eyes' pictures developed before they are mixed; None if there is no need.

        Exposure alone gives the same before and after.
        """
        if self.mixed_from is None or development.tone == "linear":
            return None
        return developed(self.mixed_from, development)

    def to_rgb8(self, exposure: float | None = None, tone: Tone | None = None) -> npt.NDArray[np.uint8]:
        """The picture as a screen shows it: sRGB, uint8 of shape (height, width, 3).

        Args:
            exposure: stops; as the scene says if None.
            tone: the curve: linear, reinhard or agx; as the scene says if None.

        Raises:
            KeyError: the framebuffer has no R, G, B.
            SceneError: the exposure is no number from -100 to 100.
        """
        return rgb8(self, Development.of(self.header, exposure, tone))

    def to_image(self) -> Image:
        """The picture as an image of Pillow: the pixels of an 8-bit PNG; RGBA if the background is transparent.

        Raises:
            KeyError: the framebuffer has no R, G, B.
        """
        from clfractal.images.convert import to_image

        for name in "RGB":
            _ = self[name]
        return to_image(self)

    def to_xarray(self) -> Dataset:
        """The channels as a data set of xarray, see `convert.to_xarray`.

        Raises:
            FileError: xarray is not installed.
        """
        from clfractal.images.convert import to_xarray

        return to_xarray(self, self._planes)

    def _repr_png_(self) -> bytes | None:
        """The picture that a notebook shows; None (it then shows the text form) if there are no colours."""
        if not {"R", "G", "B"} <= set(self.channels):
            return None
        from clfractal.images.outputs import png_bytes

        return png_bytes(self)


def in_memory(picture: Picture) -> Framebuffer:
    """A whole picture as a framebuffer; returned unchanged if it is a framebuffer."""
    if isinstance(picture, Framebuffer):
        return picture
    bands = [band for _, band in picture.bands()]
    framebuffer = Framebuffer(picture.channels, picture.display, picture.region, picture.header)
    framebuffer.fill({name: np.concatenate([band[name] for band in bands]) for name in picture.channels})
    framebuffer.stereo = getattr(picture, "stereo", None)
    if framebuffer.stereo is not None and framebuffer.stereo.mixes_colors:
        framebuffer.mixed_from = picture
    return framebuffer
