"""Cancelling: a token that any thread may set, and that all long work checks."""

from __future__ import annotations

import threading

from clfractal.errors import Stopped


class CancelToken:
    """Asks work to end: running launches are waited for, nothing more is started, and builds are abandoned."""

    def __init__(self) -> None:
        self._set = threading.Event()

    def cancel(self) -> None:
        """Asks work to end; may be called from any thread, any number of times."""
        self._set.set()

    @property
    def cancelled(self) -> bool:
        """Whether `cancel` was called."""
        return self._set.is_set()

    def __call__(self) -> bool:
        """The same, as a function to pass to code that waits."""
        return self._set.is_set()

    def check(self) -> None:
        """Raises Stopped if `cancel` was called."""
        if self._set.is_set():
            raise Stopped
