"""Films that lie on disk while they are rendered, and the files that any film is written to."""

from __future__ import annotations

import io
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, Where
from clfractal.files import atomic
from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS, check_channels
from clfractal.files.journal import Journal
from clfractal.files.png import Bits, stream_png, write_png
from clfractal.render.film import Bands, Film, Floats, TiledStore, check_tile
from clfractal.render.tiles import Region, TileGrid

# Names of the header's keys in a file: those that OpenEXR defines keep theirs, ours begin with the program's.
_FILE_KEYS = {"scene": "clfractal", "worldToCamera": "worldToCamera", "worldToNDC": "worldToNDC"}


class JournalFilm:
    """A film whose tiles are kept in a journal file: for resuming, and for pictures larger than memory.

    It keeps no pixel in memory; `bands` reads one row of tiles at a time. See `Film` for the header.

    Args:
        path: the journal, `OUT.partial` by custom.
        identity: JSON values that say what is rendered; a journal is resumed only if all are equal. The
            picture's size, region and channels are added.
        resume: whether to continue an earlier journal (a missing one is begun anew).

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
    ) -> None:
        self.channels: tuple[str, ...] = check_channels(channels)
        self.display = display
        self.region = region or Region(0, 0, *display)
        if not self.region.inside(*display):
            raise ValueError(f"{self.region} is not inside a picture of {display[0]} x {display[1]}")
        self.grid = TileGrid(self.region)
        self.header: dict[str, Any] = dict(header or {})
        x, y, width, height = self.region.x, self.region.y, self.region.width, self.region.height
        whole = {**identity, "size": list(display), "region": [x, y, width, height]}
        begin = Journal.resume if resume else Journal.create
        self.journal = begin(path, whole, self.channels, self.grid.count)

    @property
    def done(self) -> npt.NDArray[np.bool_]:
        """For each tile whether it is there."""
        return self.journal.done

    def put(self, tile_index: int, array: Floats) -> None:
        """Stores a tile: float32 of shape (channels, rows, columns).

        Raises:
            FileError: the journal cannot be written (a full disk).
        """
        check_tile(array, self.grid.tile(tile_index), self.channels)
        self.journal.append(tile_index, array)

    def bands(self) -> Bands:
        """The picture from top to bottom, one row of tiles at a time: (first_row, channel -> rows).

        Raises:
            FileError: the journal cannot be read, or was damaged after it was written.
        """
        grid, region = self.grid, self.region
        fills = np.array([CHANNELS[name].fill for name in self.channels], dtype=np.float32)
        for row in range(grid.rows):
            first = grid.tile(row * grid.columns)
            band = np.empty((len(self.channels), first.height, region.width), dtype=np.float32)
            band[:] = fills[:, None, None]
            for index in range(first.index, first.index + grid.columns):
                if self.done[index]:
                    tile = grid.tile(index)
                    left = tile.x - region.x
                    pixels = self.journal.tile(index)[:, : tile.height, : tile.width]
                    band[:, :, left : left + tile.width] = pixels
            yield first.y, dict(zip(self.channels, band, strict=True))

    def to_film(self) -> Film:
        """All of it in memory."""
        film = Film(self.channels, self.display, self.region, self.header)
        for index in np.flatnonzero(self.done).tolist():
            tile = self.grid.tile(index)
            film.put(index, self.journal.tile(index)[:, : tile.height, : tile.width])
        return film

    def close(self) -> None:
        """Closes the journal and leaves it for a later run."""
        self.journal.close()

    def discard(self) -> None:
        """Removes the journal: the outputs are written."""
        self.journal.discard()

    def __repr__(self) -> str:
        size = f"{self.display[0]}x{self.display[1]}"
        return f"<JournalFilm {self.journal.path} {size}, {self.done.mean():.0%} done>"


def check_output(path: str | Path, channels: Collection[str] | None = None) -> None:
    """Makes sure, before anything is rendered, that a picture can be written to `path`.

    Raises:
        FileError: unknown extension, no such folder, not writable, a folder or device; or a PNG without
            the colour channels that it needs.
    """
    atomic.check_output(path)
    if channels is not None and Path(path).suffix.lower() == ".png":
        missing = [name for name in "RGB" if name not in channels]
        if missing:
            listed = ", ".join(missing)
            raise FileError(
                f"a PNG needs the channels R, G, B; without {listed} write an EXR", Where(str(path))
            )


def save_outputs(
    store: TiledStore,
    paths: Iterable[str | Path],
    *,
    header: Mapping[str, Any] | None = None,
    half: Collection[str] | None = None,
    bits: Bits = 8,
    transparent: bool = False,
    exposure: float = 0.0,
) -> None:
    """Writes a film to files, the format of each told by its extension; each appears whole or not at all.

    All paths are checked before the first is written. Memory needed: a few bands of rows, see `bands`.

    Args:
        header: added to `store.header`.
        half: the channels that an EXR stores as half; by default as `CHANNELS` says.
        bits: 8 or 16, of a PNG.
        transparent: whether a PNG has an alpha channel (the film's colours are premultiplied); needs A.
        exposure: stops (powers of two) by which a PNG is lighter than the film; an EXR keeps scene values.

    Raises:
        FileError: a file cannot be written; earlier ones of `paths` may be there by then.
    """
    chosen = [Path(path) for path in paths]
    for path in chosen:
        check_output(path, store.channels)
    whole = {**store.header, **(header or {})}
    region = store.region
    for path in chosen:
        if path.suffix.lower() == ".png":
            alpha = transparent and "A" in store.channels
            write_png(
                path,
                _colors(store, alpha=alpha, exposure=exposure),
                width=region.width,
                height=region.height,
                bits=bits,
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


def png_bytes(film: Film) -> bytes:
    """An 8-bit PNG of a film in memory, for notebooks; transparent where the film is."""
    stream = io.BytesIO()
    region = film.region
    alpha = "A" in film.channels and bool(film.header.get("transparent", False))
    stream_png(
        stream,
        _colors(film, alpha=alpha, exposure=float(film.header.get("exposure", 0.0))),
        width=region.width,
        height=region.height,
        alpha=alpha,
        texts=_texts(film.header),
        origin=(region.x, region.y),
    )
    return stream.getvalue()


def _colors(store: TiledStore, *, alpha: bool, exposure: float) -> Iterator[Floats]:
    """The bands as arrays (rows, width, 3 or 4), colours made lighter by `exposure` stops."""
    gain = np.float32(2.0**exposure)
    for _, band in store.bands():
        rows, width = band["R"].shape
        pixels = np.empty((rows, width, 4 if alpha else 3), dtype=np.float32)
        for component, name in enumerate("RGB"):
            with np.errstate(over="ignore"):  # infinitely light is limited to 1 later
                np.multiply(band[name], gain, out=pixels[..., component])
        if alpha:
            pixels[..., 3] = band["A"]
        yield pixels


def _file_key(key: str) -> str:
    return _FILE_KEYS.get(key) or f"clfractal{key[:1].upper()}{key[1:]}"


def _software(header: Mapping[str, Any]) -> str:
    return f"clfractal {header['version']}" if "version" in header else "clfractal"


def _attributes(header: Mapping[str, Any]) -> dict[str, Any]:
    """The film's header as attributes of an EXR file."""
    return {"software": _software(header)} | {
        _file_key(key): value for key, value in header.items() if value is not None
    }


def _texts(header: Mapping[str, Any]) -> dict[str, str]:
    """The film's header as text chunks of a PNG file; it has no place for matrices."""
    return {"Software": _software(header)} | {
        _file_key(key): str(value)
        for key, value in header.items()
        if isinstance(value, str | bool | int | float | np.number)
    }
