"""Work in progress: finished tiles, appended to a file that survives the death of its writer at any moment.

Layout, little-endian:

    8 bytes   "CLFJRNL1"
    uint32    length of the identity
    uint32    CRC-32 of the identity
    bytes     the identity: JSON, the keys sorted
    records   uint32 tile index, uint32 CRC-32 of index and payload, payload: float32 [channels, 32, 32]

The index has 24 bits; the highest 8 bits number who made the tile, 0 in a picture that one device makes. A number above 0
is explained by a note, a record whose index is 0xFFFFFFFF and whose payload begins with a text: JSON with `number`.

All records have one size, so a damaged one spoils no other, and the k-th one is found without an index.
The header appears complete or not at all (by renaming); a record that was cut short by the writer's death is
at the end of the file and is overwritten by the next one. Nothing is brought to the disk record by record:
a killed process loses nothing that it wrote, and after a power failure the check sums tell which tiles to
render again.
"""

from __future__ import annotations

import json
import os
import stat
import struct
import zlib
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.errors import FileError, Where
from clfractal.files import system
from clfractal.files.atomic import file_error, naming, open_beside

Floats = npt.NDArray[np.float32]

MAGIC = b"CLFJRNL1"
SIDE = 32
"""Side of a stored tile, in pixels; smaller tiles are stored in the top left corner of one."""

_HEAD = struct.Struct("<8sII")
_RECORD = struct.Struct("<II")
_LARGEST_IDENTITY = 16 << 20  # bytes
_NOTE = 0xFFFFFFFF
_INDEX_BITS = 24
_MOST_DEVICES = 250
_MOST_AT_ONCE = 128  # records that the system is given at a time; it takes a few hundred


class Journal:
    """An open journal; made by `create` or `resume`. One process at a time may have it open.

    Attributes:
        done: for each tile whether it is there; not to be written to.
        provenance: for each tile the number of the device that made it; not to be written to.
        notes: what is noted of devices, by their numbers.
    """

    def __init__(
        self, path: Path, descriptor: int, start: int, channels: tuple[str, ...], tile_count: int
    ) -> None:
        self.path = path
        self.channels = channels
        self._descriptor = descriptor
        self._start = start  # bytes before the first record
        self._payload = len(channels) * SIDE * SIDE * 4
        self._size = _RECORD.size + self._payload
        self._records = 0
        self._place = np.full(tile_count, -1, dtype=np.int64)  # record number of each tile
        self.done = np.zeros(tile_count, dtype=np.bool_)
        self.provenance = np.zeros(tile_count, dtype=np.uint8)
        self.notes: dict[int, dict[str, Any]] = {}

    @classmethod
    def create(
        cls, path: str | Path, identity: Mapping[str, Any], channels: Sequence[str], tile_count: int
    ) -> Journal:
        """A new, empty journal; one that lies there already is replaced.

        Args:
            identity: what has to be the same for a tile to be the same (JSON values).

        Raises:
            FileError: it cannot be written; another process has it open; what lies there is no journal.
        """
        target = Path(path)
        with suppress(FileNotFoundError):
            earlier = _open_locked(target)
            try:
                if not stat.S_ISREG(os.fstat(earlier).st_mode) or system.read_at(earlier, 8, 0) != MAGIC:
                    raise file_error(target, "is in the way and holds no work in progress; move it away", "")
            finally:
                os.close(earlier)
        if tile_count >= 1 << _INDEX_BITS:
            raise ValueError(f"{tile_count} tiles in one journal")
        text = _identity_text(identity, channels, tile_count)
        with naming(target, "cannot be written"):
            descriptor, beside = open_beside(target)
        try:
            with suppress(OSError):  # a file system without locks
                system.lock(descriptor)
            system.write_at(descriptor, [_HEAD.pack(MAGIC, len(text), zlib.crc32(text)), text], 0)
            os.fsync(descriptor)
            if system.RENAMES_OPEN_FILES:
                os.replace(beside, target)
            else:
                os.close(descriptor)
                descriptor = -1
                system.replace(beside, target)
                descriptor = _open_locked(target)
        except BaseException as error:
            if descriptor >= 0:
                os.close(descriptor)
            with suppress(OSError):
                beside.unlink()
            if isinstance(error, OSError):
                raise file_error(target, "cannot be written", error) from error
            raise
        return cls(target, descriptor, _HEAD.size + len(text), tuple(channels), tile_count)

    @classmethod
    def resume(
        cls,
        path: str | Path,
        identity: Mapping[str, Any],
        channels: Sequence[str],
        tile_count: int,
        also: Sequence[Mapping[str, Any]] = (),
    ) -> Journal:
        """Opens an earlier journal of the same work; a missing one is created.

        Args:
            also: other identities of journals that may be continued.

        Raises:
            FileError: it belongs to other work (the message names what differs), is no journal, cannot be
                read or written, or another process has it open.
        """
        target = Path(path)
        try:
            descriptor = _open_locked(target)
        except FileNotFoundError:
            return cls.create(path, identity, channels, tile_count)
        try:
            wanted = [_identity_text(each, channels, tile_count) for each in (identity, *also)]
            start = _check_identity(target, descriptor, wanted)
            journal = cls(target, descriptor, start, tuple(channels), tile_count)
            journal._scan()
        except BaseException as error:
            os.close(descriptor)
            if isinstance(error, OSError):
                raise file_error(target, "cannot be read", error) from error
            raise
        return journal

    def note(self, device: int, about: Mapping[str, Any]) -> None:
        """Notes which device made tiles (JSON values, cut where a record has no room for them).

        Raises:
            FileError: it cannot be written.
        """
        if not 0 < device <= _MOST_DEVICES:
            raise ValueError(f"device {device}")
        shown = {key: str(value)[: self._payload // 16] for key, value in about.items()}
        text = json.dumps({**shown, "number": device}, ensure_ascii=False).encode()
        self._write([(_NOTE, text[: self._payload].ljust(self._payload, b"\0"))])
        self.notes[device] = shown

    def append(self, tile_index: int, array: Floats, device: int = 0) -> None:
        """Stores a tile: float32 of shape (channels, rows, columns), at most `SIDE` rows and columns.

        Args:
            device: who made it, see `note`.

        Raises:
            FileError: it cannot be written (a full disk); what was there before is still whole.
        """
        planes, rows, columns = array.shape
        if planes != len(self.channels) or rows > SIDE or columns > SIDE:
            raise ValueError(f"a tile of shape {array.shape} in a journal of {len(self.channels)} channels")
        if (rows, columns) == (SIDE, SIDE):
            stored = np.ascontiguousarray(array, dtype="<f4")
        else:
            stored = np.zeros((planes, SIDE, SIDE), dtype="<f4")
            stored[:, :rows, :columns] = array
        self._place[tile_index] = self._write([(tile_index | device << _INDEX_BITS, stored.tobytes())])
        self.done[tile_index] = True
        self.provenance[tile_index] = device

    def append_whole(self, tile_indices: Sequence[int], arrays: Floats, device: int = 0) -> None:
        """Stores whole tiles, float32 of shape (tiles, channels, `SIDE`, `SIDE`): as `append` each of them, but many at a
        time, without copies of them.
        """
        if arrays.shape[1:] != (len(self.channels), SIDE, SIDE):
            raise ValueError(f"tiles of shape {arrays.shape} in a journal of {len(self.channels)} channels")
        stored = np.ascontiguousarray(arrays, dtype="<f4")
        for first in range(0, len(stored), _MOST_AT_ONCE):
            indices = tile_indices[first : first + _MOST_AT_ONCE]
            tiles = stored[first : first + _MOST_AT_ONCE]
            parts = zip(indices, tiles.reshape(len(indices), -1).view(np.uint8), strict=True)
            try:
                place = self._write([(index | device << _INDEX_BITS, tile.data) for index, tile in parts])
            except FileError:
                # On a full disk those stay for which there is room.
                for index, tile in zip(indices, tiles, strict=True):
                    self.append(index, tile, device)
            else:
                self._place[indices] = range(place, place + len(indices))
                self.done[indices] = True
                self.provenance[indices] = device

    def tile(self, tile_index: int) -> Floats:
        """A stored tile: float32 of shape (channels, `SIDE`, `SIDE`).

        Raises:
            KeyError: it is not there.
            FileError: it cannot be read, or has been damaged since it was written.
        """
        place = int(self._place[tile_index])
        if place < 0:
            raise KeyError(tile_index)
        with naming(self.path, "cannot be read"):
            found = self._record(place)
        if found is None or found[0] % (1 << _INDEX_BITS) != tile_index:
            raise file_error(self.path, f"is damaged: tile {tile_index} has changed since it was written", "")
        return found[1].reshape(len(self.channels), SIDE, SIDE)

    def close(self) -> None:
        """Closes the file and leaves it for a later `resume`."""
        # (Two threads may, at an interrupt.)
        descriptor, self._descriptor = self._descriptor, -1
        if descriptor >= 0:
            os.close(descriptor)

    def discard(self) -> None:
        """Removes the file: the work is done."""
        if not system.RENAMES_OPEN_FILES:
            self.close()
        with suppress(FileNotFoundError):
            self.path.unlink()
        self.close()

    def _write(self, records: Sequence[tuple[int, bytes | memoryview]]) -> int:
        """Appends records of an index and a payload each, and gives the number of the first."""
        parts: list[bytes | memoryview] = []
        for index, payload in records:
            check = zlib.crc32(payload, zlib.crc32(struct.pack("<I", index)))
            parts += [_RECORD.pack(index, check), payload]
        offset = self._start + self._records * self._size
        with naming(self.path, "cannot be written"):
            system.write_at(self._descriptor, parts, offset)
        self._records += len(records)
        return self._records - len(records)

    def _record(self, number: int) -> tuple[int, Floats] | None:
        """Index and payload of a record; None if it is damaged or not all there."""
        data = system.read_at(self._descriptor, self._size, self._start + number * self._size)
        if len(data) < self._size:
            return None
        index, check = _RECORD.unpack_from(data)
        payload = memoryview(data)[_RECORD.size :]
        if zlib.crc32(payload, zlib.crc32(data[:4])) != check:
            return None
        return index, np.frombuffer(payload, dtype="<f4")

    def _scan(self) -> None:
        """Finds the tiles of an earlier run."""
        length = os.fstat(self._descriptor).st_size - self._start
        self._records = max(0, length // self._size)
        for number in range(self._records):
            found = self._record(number)
            if found is None:
                continue
            if found[0] == _NOTE:
                self._read_note(found[1].tobytes())
                continue
            device, index = divmod(found[0], 1 << _INDEX_BITS)
            if index < len(self._place):
                self._place[index] = number
                self.done[index] = True
                self.provenance[index] = device

    def _read_note(self, payload: bytes) -> None:
        with suppress(ValueError, KeyError, TypeError):
            about = json.loads(payload.rstrip(b"\0"))
            self.notes[int(about.pop("number"))] = about


def identity_of(path: Path) -> dict[str, Any] | None:
    """What an earlier journal is of; None if there is none, or it cannot be told."""
    try:
        with open(path, "rb") as file:
            head = file.read(_HEAD.size)
            magic, length, check = _HEAD.unpack(head)
            text = file.read(length) if magic == MAGIC and length <= _LARGEST_IDENTITY else b""
        found = json.loads(text) if zlib.crc32(text) == check else None
    except (OSError, ValueError, RecursionError, struct.error):
        return None
    return found if isinstance(found, dict) else None


def _open_locked(path: Path) -> int:
    """Opens a file that may be a journal, and locks it against other processes.

    Raises:
        FileNotFoundError: there is none.
        FileError: it cannot be opened, or another process has it open.
    """
    try:
        descriptor = os.open(path, system.READ_AND_WRITE)
    except FileNotFoundError:
        raise
    except (OSError, ValueError) as error:
        raise file_error(path, "cannot be opened", error) from error
    try:
        system.lock(descriptor)
    except system.HeldError as error:
        os.close(descriptor)
        raise file_error(path, "is in use: another process renders this picture", "") from error
    except OSError:
        pass  # a file system without locks: nothing can be said
    return descriptor


def _identity_text(identity: Mapping[str, Any], channels: Sequence[str], tile_count: int) -> bytes:
    whole = {**identity, "channels": list(channels), "tiles": tile_count, "side": SIDE}
    return json.dumps(whole, sort_keys=True, ensure_ascii=False).encode()


def _check_identity(path: Path, descriptor: int, wanted: Sequence[bytes]) -> int:
    """Where the records of a journal begin; FileError if it is another one's."""
    head = system.read_at(descriptor, _HEAD.size, 0)
    not_one = file_error(path, "holds no work in progress that could be resumed", "")
    if len(head) < _HEAD.size or head[:8] != MAGIC:
        raise not_one
    _, length, check = _HEAD.unpack(head)
    if length > _LARGEST_IDENTITY:
        raise not_one
    text = system.read_at(descriptor, length, _HEAD.size)
    if zlib.crc32(text) != check or len(text) != length:
        raise not_one
    if text not in wanted:
        differences = min((_differences(text, each) for each in wanted), key=len)
        raise FileError(f"cannot be resumed: {differences}", Where(str(path)))
    return _HEAD.size + int(length)


def _differences(found: bytes, wanted: bytes) -> str:
    """`the version was "0.1.0" and is "0.2.0", the scene is another one`."""
    before, now = json.loads(found), json.loads(wanted)
    changes = []
    for key in sorted(set(before) | set(now)):
        old, new = (
            json.dumps(side[key], ensure_ascii=False) if key in side else "unknown" for side in (before, now)
        )
        if old != new:
            short = max(len(old), len(new)) <= 60
            changes.append(f"the {key} was {old} and is {new}" if short else f"the {key} has changed")
    return ", ".join(changes)
