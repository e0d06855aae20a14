"""Variations of a scene to choose from: drawn beside the window's thread, judged by their small pictures."""

from __future__ import annotations

import threading
from collections import deque
from collections.abc import Callable, Collection, Hashable, Iterator
from functools import partial
from itertools import count
from typing import Protocol

from clfractal.errors import ClfractalError
from clfractal.scene.model import Scene
from clfractal.viewer.background import Thumbnail
from clfractal.work.variations import KINDS, Variation, candidates, preview_scene, worthwhile
from clfractal.work.varied import Kind, Strength

COUNT = 12
_EMPTY_PER_WANTED = 4
"""So many variations may show nothing, for each one that is wanted, before even those are taken."""
_AHEAD = 2

Size = tuple[int, int]
_numbers = count()


class MakeThumbnail(Protocol):
    """`Studio.thumbnail`."""

    def __call__(self, key: Hashable, load: Callable[[], Scene], size: Size) -> Thumbnail:
        """A small picture that is rendered in the background, once for a key."""


class Suggestions:
    """Twelve variations of one scene; those of which a small picture shows nothing are replaced by others.

    Args:
        scene: the original.
        strength, seed, kinds: as for `variations`.
        size: of the small pictures, pixels.
        woken: called from another thread when there is another variation.

    Attributes:
        places: the variations; None where one is still to come, or where there are no more.
        problem: why there are none, or empty.
    """

    def __init__(
        self,
        scene: Scene,
        *,
        strength: Strength = "medium",
        seed: int = 0,
        kinds: Collection[Kind] = KINDS,
        size: Size = (400, 224),
        woken: Callable[[], None] = lambda: None,
    ) -> None:
        self.scene, self.strength, self.seed, self.kinds = scene, strength, seed, tuple(kinds)
        self.size = size
        self.problem = ""
        self.places: list[Variation | None] = [None] * COUNT
        self._number = next(_numbers)
        self._keys: list[Hashable] = [None] * COUNT
        self._drawn: deque[Variation] = deque()
        self._draws = 0
        self._rejected = 0
        self._ended = False
        self._closed = False
        self._woken = woken
        self._changed = threading.Condition()
        self._thread = threading.Thread(target=self._draw, name="clfractal-variations", daemon=True)
        self._thread.start()

    @property
    def complete(self) -> bool:
        """Whether nothing is still to come but pictures."""
        with self._changed:
            return self._ended and not self._drawn or all(place is not None for place in self.places)

    def belongs(self, key: Hashable) -> bool:
        """Whether a small picture's key is one of these variations'."""
        return isinstance(key, tuple) and key[:2] == ("variation", self._number)

    def key(self, number: int) -> Hashable:
        """The key of the small picture at a place."""
        return self._keys[number]

    def follow(self, thumbnail: MakeThumbnail) -> list[Thumbnail | None]:
        """Fills places, asks for their pictures, and replaces variations that show nothing; the pictures of all places."""
        found: list[Thumbnail | None] = []
        for number in range(COUNT):
            if self.places[number] is None and not self._fill(number):
                found.append(None)
                continue
            variation = self.places[number]
            assert variation is not None
            made = thumbnail(self._keys[number], partial(preview_scene, variation.scene, *self.size), self.size)
            if made.film is not None and self._is_empty(made):
                self.places[number] = None
                self._rejected += 1
                self._fill(number)
                found.append(None)
            else:
                found.append(made)
        return found

    def close(self) -> None:
        """No more are drawn."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()

    def _is_empty(self, thumbnail: Thumbnail) -> bool:
        film, thumbnail.film = thumbnail.film, None  # looked at once, and then given up: it is large
        may_go = self._rejected < _EMPTY_PER_WANTED * COUNT and not (self._ended and not self._drawn)
        return film is not None and may_go and not worthwhile(film)

    def _fill(self, number: int) -> bool:
        with self._changed:
            if not self._drawn:
                return False
            self.places[number] = self._drawn.popleft()
            self._draws += 1
            self._keys[number] = ("variation", self._number, self._draws)
            self._changed.notify_all()
        return True

    def _draw(self) -> None:
        """The other thread: keeps some variations ready."""
        try:
            drawn: Iterator[Variation] = candidates(
                self.scene, strength=self.strength, seed=self.seed, kinds=self.kinds
            )
            for variation in drawn:
                with self._changed:
                    self._drawn.append(variation)
                    self._woken()
                    first = COUNT + _AHEAD
                    self._changed.wait_for(
                        lambda: self._closed or len(self._drawn) + self._draws < first or len(self._drawn) < _AHEAD
                    )
                    if self._closed:
                        return
        except ClfractalError as error:
            self.problem = error.message
        except Exception as error:  # a panel shows it
            self.problem = f"internal error, please report it: {type(error).__name__}: {error}"
        with self._changed:
            self._ended = True
            if not self._drawn and not self._draws and not self.problem:
                self.problem = "nothing can be varied here: choose more kinds"
        self._woken()
