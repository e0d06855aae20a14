"""Framebuffers that lie on disk while they are rendered."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS, check_channels
from clfractal.files.journal import Journal
from clfractal.images.provenance import Provenance, RenderDevice
from clfractal.images.tiled import Bands, Floats, check_tile
from clfractal.images.tiles import TILE, Region, TileGrid


class JournalFramebuffer:
    """A framebuffer whose tiles are kept in a journal file: for resuming, and for pictures larger than memory.

    It keeps no pixel in memory; `bands` reads one row of tiles at a time. See `Framebuffer` for the header.

    Args:
        path: the journal, `OUT.partial` by custom.
        identity: JSON values that say what is rendered; a journal is resumed only if all are equal. The
            picture's size, region and channels are added.
        resume: whether to continue an earlier journal (if there is none, a new one is begun).
        also: other identities whose journals may be continued.

    Raises:
        SceneError: an unknown channel name.
        FileError: see `Journal.create` and `Journal.resume`.
    """

    def __init__(
        self,
        path: str | Path,
        identity: Mapping[str, Any],
        channels: Sequence[str] = DEFAULT_CHANNELS,
        display: tuple[int, int] = (1, 1),
        region: Region | None = None,
        header: Mapping[str, Any] | None = None,
        *,
        resume: bool = False,
        also: Sequence[Mapping[str, Any]] = (),
    ) -> None:
        self.channels: tuple[str, ...] = check_channels(channels)
        self.display = display
        self.region = region or Region(0, 0, *display)
        if not self.region.inside(*display):
            raise ValueError(f"{self.region} is not inside a picture of {display[0]} x {display[1]}")
        self.grid = TileGrid(self.region)
        self.header: dict[str, Any] = dict(header or {})
        x, y, width, height = self.region.x, self.region.y, self.region.width, self.region.height
        shape = {"size": list(display), "region": [x, y, width, height]}
        whole, tiles = {**identity, **shape}, self.grid.count
        if resume:
            others = [{**each, **shape} for each in also]
            self.journal = Journal.resume(path, whole, self.channels, tiles, others)
        else:
            self.journal = Journal.create(path, whole, self.channels, tiles)
        self.provenance = self._noted_provenance()

    def tell(self, key: str, value: Any) -> None:
        """Adds an entry to the header."""
        self.header[key] = value

    @property
    def done(self) -> npt.NDArray[np.bool_]:
        """For each tile, whether it is finished."""
        return self.journal.done

    def put(self, tile_index: int, array: Floats, render_device: RenderDevice | None = None) -> None:
        """Stores a tile: float32 of shape (channels, rows, columns).

        Args:
            render_device: the device that made it, where several render the picture.

        Raises:
            FileError: the journal cannot be written (a full disk).
        """
        check_tile(array, self.grid.tile(tile_index), self.channels)
        self._append(tile_index, array, self._number(render_device))

    def put_tiles(
        self, indices: npt.NDArray[np.int32], framebuffer: Floats, render_device: RenderDevice | None = None
    ) -> None:
        """Stores whole tiles, float32 of shape (tiles, channels, TILE, TILE), as far as they lie in the region.

        Args:
            render_device: as for `put`.

        Raises:
            FileError: the journal cannot be written (a full disk).
        """
        number, boxes = self._number(render_device), self.grid.boxes(indices)
        whole = (boxes[:, 2] == TILE) & (boxes[:, 3] == TILE)
        if whole.any():
            tiles = framebuffer if whole.all() else framebuffer[whole]
            self.journal.append_whole(indices[whole].tolist(), tiles, number)
            self.provenance.of_tiles[indices[whole]] = number
        for place in np.flatnonzero(~whole).tolist():
            x, y, width, height = boxes[place].tolist()
            top, left = y % TILE, x % TILE
            cut = framebuffer[place][:, top : top + height, left : left + width]
            self._append(int(indices[place]), cut, number)

    def _number(self, render_device: RenderDevice | None) -> int:
        """A device's number in the journal, which notes it; 0: there is only one."""
        if render_device is None:
            return 0
        number = self.provenance.number(render_device)
        if number not in self.journal.notes:
            self.journal.note(number, render_device.as_data())
        return number

    def _append(self, tile_index: int, array: Floats, number: int) -> None:
        self.journal.append(tile_index, array, number)
        self.provenance.of_tiles[tile_index] = number

    def bands(self) -> Bands:
        """The picture from top to bottom, one row of tiles at a time: (first_row, channel -> rows).

        Raises:
            FileError: the journal cannot be read, or was damaged after it was written.
        """
        grid, region = self.grid, self.region
        fills = np.array([CHANNELS[name].fill for name in self.channels], dtype=np.float32)
        for row in range(grid.rows):
            indices = range(row * grid.columns, (row + 1) * grid.columns)
            boxes = grid.boxes(indices).tolist()
            top, height = boxes[0][1], boxes[0][3]
            band = np.empty((len(self.channels), height, region.width), dtype=np.float32)
            band[:] = fills[:, None, None]
            for index, (x, _, width, _) in zip(indices, boxes, strict=True):
                if self.done[index]:
                    left = x - region.x
                    band[:, :, left : left + width] = self.journal.tile(index)[:, :height, :width]
            yield top, dict(zip(self.channels, band, strict=True))

    def _noted_provenance(self) -> Provenance:
        """Those of an earlier run."""
        found, notes = Provenance(self.grid.count), self.journal.notes
        last = max([0, *notes, int(self.journal.provenance.max(initial=0))])
        for number in range(1, last + 1):
            about = notes.get(number, {"index": f"device {number}"})
            found.known.append(RenderDevice(*(str(about.get(key, "")) for key in ("index", "name", "key"))))
        found.of_tiles[:] = self.journal.provenance
        return found

    def close(self) -> None:
        """Closes the journal and leaves it for a later run."""
        self.journal.close()

    def discard(self) -> None:
        """Removes the journal: the outputs are written."""
        self.journal.discard()

    def __repr__(self) -> str:
        size = f"{self.display[0]}x{self.display[1]}"
        return f"<JournalFramebuffer {self.journal.path} {size}, {self.done.mean():.0%} done>"
