"""Cancelling: a token that any thread may set and everything that takes long looks at."""

from __future__ import annotations

import threading

from clfractal.errors import Stopped


class CancelToken:
    """Asks work to end. Launches under way are waited for, nothing more is started, builds are left."""

    def __init__(self) -> None:
        self._set = threading.Event()

    def cancel(self) -> None:
        """Asks for the end; from any thread, as often as one likes."""
        self._set.set()

    @property
    def cancelled(self) -> bool:
        """Whether somebody asked."""
        return self._set.is_set()

    def check(self) -> None:
        """Raises Stopped if somebody asked."""
        if self._set.is_set():
            raise Stopped
