"""The film: finished tiles become named channels, in memory; `store.py` has the film on disk."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import unknown_name
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS, check_channels
from clfractal.pictures.tiled import Bands, Floats, Picture, check_tile
from clfractal.pictures.tiles import TILE, Region, TileGrid


class Film:
    """A picture in memory: `film["R"]` is a float32 array of shape (height, width) of the region.

    R, G, B are linear Rec. 709; if the background is transparent they are premultiplied by A.
    `header` may hold: `scene` (text), `version`, `device`, `precision`, `seconds`, `exposure` (stops) and
    `transparent` (what PNG files and notebooks show), and `worldToCamera` and
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
        header: Mapping[str, Any] | Callable[[], Mapping[str, Any]] | None = None,
    ) -> None:
        self.channels: tuple[str, ...] = check_channels(channels)
        self.display = display
        self.region = region or Region(0, 0, *display)
        if not self.region.inside(*display):
            raise ValueError(f"{self.region} is not inside a picture of {display[0]} x {display[1]}")
        self.grid = TileGrid(self.region)
        self._make_header = header if callable(header) else None
        self._header: dict[str, Any] | None = None if callable(header) else dict(header or {})
        self._told: dict[str, Any] = {}
        self.stage = ""
        """How far a picture that is made in passes is, such as `4 of 16 samples`; empty once it is finished."""
        # Not `zeros`: NumPy asks for large pages only for memory that it does not want cleared, and small ones take the
        # system ten times as long.
        self._data = np.empty((len(self.channels), self.region.height, self.region.width), np.float32)
        self._planes = dict(zip(self.channels, self._data, strict=True))
        for name, plane in self._planes.items():
            plane.fill(CHANNELS[name].fill)
        self._done = np.zeros(self.grid.count, dtype=np.bool_)

    @property
    def header(self) -> dict[str, Any]:
        """The header of picture files; made at first use if it was given as a function."""
        if self._header is None:
            assert self._make_header is not None
            self._header = {**self._make_header(), **self._told}
        return self._header

    def tell(self, key: str, value: Any) -> None:
        """Adds an entry to the header, even if the header has not been made yet."""
        (self._told if self._header is None else self._header)[key] = value

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
            KeyError: the film has no such channel.
        """
        try:
            return self._planes[name]
        except KeyError:
            raise KeyError(unknown_name("channel", name, self.channels)) from None

    def __contains__(self, name: object) -> bool:
        return name in self._planes

    def __iter__(self) -> Iterator[str]:
        return iter(self.channels)

    def __repr__(self) -> str:
        part = "" if self.region == Region(0, 0, *self.display) else f", {self.region}"
        size = f"{self.display[0]}x{self.display[1]}"
        stage = self.stage or f"{self._done.mean():.0%} done"
        return f"<Film {size}{part}, channels {' '.join(self.channels)}, {stage}>"

    def put(self, tile_index: int, array: Floats) -> None:
        """Stores a tile: float32 of shape (channels, rows, columns)."""
        tile = self.grid.tile(tile_index)
        check_tile(array, tile, self.channels)
        top, left = tile.y - self.region.y, tile.x - self.region.x
        self._data[:, top : top + tile.height, left : left + tile.width] = array
        self._done[tile_index] = True

    def put_tiles(self, indices: npt.NDArray[np.int32], film: Floats) -> None:
        """Stores whole tiles, float32 of shape (tiles, channels, TILE, TILE), as far as they lie in the region."""
        region, data = self.region, self._data
        boxes = self.grid.boxes(indices).tolist()
        for (x, y, width, height), array in zip(boxes, film, strict=True):
            top, left = y % TILE, x % TILE
            part = array[:, top : top + height, left : left + width]
            data[:, y - region.y : y - region.y + height, x - region.x : x - region.x + width] = part
        self._done[indices] = True

    def fill(self, planes: Mapping[str, Floats]) -> None:
        """Stores the whole region: of each channel float32 of shape (height, width)."""
        for name in self.channels:
            self._planes[name][:] = planes[name]
        self._done[:] = True

    def take(self, other: Film) -> None:
        """Copies another film of the same region."""
        for name in self.channels:
            self._planes[name][:] = other[name]
        self._done[:] = other.done

    def bands(self) -> Bands:
        """The picture from top to bottom, one row of tiles at a time: (first_row, channel -> rows)."""
        row = self.region.y
        while row < self.region.bottom:
            end = min((row // TILE + 1) * TILE, self.region.bottom)
            part = slice(row - self.region.y, end - self.region.y)
            yield row, {name: plane[part] for name, plane in self._planes.items()}
            row = end

    def save(self, path: str | Path, **settings: Any) -> None:
        """Writes an `.exr` or `.png` file; settings as in `outputs.save_outputs`.

        Raises:
            FileError: it cannot be written.
        """
        from clfractal.pictures.outputs import save_outputs

        save_outputs(self, [path], **settings)

    def to_rgb8(self, exposure: float = 0.0) -> npt.NDArray[np.uint8]:
        """The picture as a screen shows it: sRGB, uint8 of shape (height, width, 3); exposure in stops.

        Raises:
            KeyError: the film has no R, G, B.
        """
        from clfractal.files.srgb import encode8

        linear = np.stack([self["R"], self["G"], self["B"]], axis=-1)
        if exposure:
            linear *= np.float32(2.0**exposure)
        return encode8(linear, origin=(self.region.x, self.region.y))

    def _repr_png_(self) -> bytes | None:
        """The picture that a notebook shows; None (it then shows the text form) if there are no colours."""
        if not {"R", "G", "B"} <= set(self.channels):
            return None
        from clfractal.pictures.outputs import png_bytes

        return png_bytes(self)


def in_memory(picture: Picture) -> Film:
    """A whole picture as a film; returned unchanged if it is a film."""
    if isinstance(picture, Film):
        return picture
    bands = [band for _, band in picture.bands()]
    film = Film(picture.channels, picture.display, picture.region, picture.header)
    film.fill({name: np.concatenate([band[name] for band in bands]) for name in picture.channels})
    return film
