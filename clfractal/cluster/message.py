"""Scenes and jobs as bytes, with their large arrays apart, which each worker gets once."""

from __future__ import annotations

import hashlib
import io
import pickle
from collections import OrderedDict
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path, PurePath
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]
Arrays = Mapping[str, Array]
"""Arrays by their digests."""

# Smaller arrays stay in the message, bytes.
_LARGE = 1 << 16
# Arrays whose digests are remembered: hashing a grid takes a second.
_REMEMBERED = 8


@dataclass(frozen=True, slots=True)
class Message:
    """A thing as bytes, and the large arrays in it."""

    data: bytes
    arrays: Arrays = field(default_factory=dict)

    @property
    def key(self) -> str:
        """A text that differs for different things."""
        return hashlib.sha256(self.data).hexdigest()


class Digests:
    """The digests of the last arrays that were asked for."""

    def __init__(self) -> None:
        # With the array itself: as long as it is here, no other has its id.
        self._known: OrderedDict[int, tuple[Array, str]] = OrderedDict()

    def of(self, array: Array) -> str:
        """A text that differs for arrays of other values, shape or type."""
        if id(array) in self._known:
            self._known.move_to_end(id(array))
            return self._known[id(array)][1]
        found = hashlib.sha256(f"{array.dtype.str} {array.shape}".encode())
        found.update(np.ascontiguousarray(array).data)
        self._known[id(array)] = (array, found.hexdigest())
        while len(self._known) > _REMEMBERED:
            self._known.popitem(last=False)
        return found.hexdigest()


def pack(thing: Any, digests: Digests | None = None) -> Message:
    """A scene, a job or the like as a message; `unpack` gives an equal one, on any system.

    Args:
        digests: those that are known from earlier messages.
    """
    buffer = io.BytesIO()
    packer = _Packer(buffer, digests or Digests())
    packer.dump(thing)
    return Message(buffer.getvalue(), packer.arrays)


def unpack(data: bytes, arrays: Arrays) -> Any:
    """The thing of a message.

    Raises:
        KeyError: one of its arrays is not there.
    """
    return _Unpacker(io.BytesIO(data), arrays).load()


class _Packer(pickle.Pickler):
    def __init__(self, file: io.BytesIO, digests: Digests) -> None:
        super().__init__(file, protocol=5)
        self.arrays: dict[str, Array] = {}
        self._digests = digests

    def persistent_id(self, thing: Any) -> str | None:
        if not isinstance(thing, np.ndarray) or thing.nbytes < _LARGE:
            return None
        digest = self._digests.of(thing)
        self.arrays[digest] = thing
        return digest

    def reducer_override(self, thing: Any) -> Any:
        # Paths of Windows cannot be made on other systems, nor theirs on Windows.
        return (Path, (str(thing),)) if isinstance(thing, PurePath) else NotImplemented


class _Unpacker(pickle.Unpickler):
    def __init__(self, file: io.BytesIO, arrays: Arrays) -> None:
        super().__init__(file)
        self._arrays = arrays

    def persistent_load(self, digest: Any) -> Array:
        return self._arrays[digest]
