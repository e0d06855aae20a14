"""Brings frames from canvases to where OpenGL shows them, in a thread, as the window never waits."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import pyopencl as cl

from clfractal.device.gl_sharing import SharedTexture
from clfractal.device.select import Device
from clfractal.engine.show import Look, Shower
from clfractal.errors import ClfractalError
from clfractal.images.tiled import Floats
from clfractal.viewer.frame import CanvasPool, Frame
from clfractal.viewer.preparing import internal_error


class Target(Protocol):
    """Where a frame's pixels go: memory that is mapped, or a texture that is shared."""

    size: tuple[int, int]

    @property
    def shown(self) -> Any:
        """The kernel's argument."""

    def begin(self, queue: cl.CommandQueue) -> None:
        """Before the kernel is enqueued."""

    def end(self, queue: cl.CommandQueue) -> None:
        """After it is enqueued; waits until the pixels are there."""

    def close(self) -> None:
        """Frees it."""


class CopyTarget:
    """A buffer in the host's memory; `pixels` has shape (height, width, 4) while it is mapped, RGBA from the top row on."""

    def __init__(self, device: Device, size: tuple[int, int]) -> None:
        self.size = size
        self.pixels: npt.NDArray[np.uint8] | None = None
        self._mapped: Any = None
        with device.failures("allocating the window's picture", need=4 * size[0] * size[1]):
            flags = cl.mem_flags.READ_WRITE | cl.mem_flags.ALLOC_HOST_PTR
            self._buffer = cl.Buffer(device.context, flags, 4 * size[0] * size[1])

    @property
    def shown(self) -> Any:
        """See `Target`."""
        return self._buffer

    def begin(self, queue: cl.CommandQueue) -> None:
        """See `Target`."""
        if self._mapped is not None:
            self.pixels = None
            self._mapped.base.release(queue)
            self._mapped = None

    def end(self, queue: cl.CommandQueue) -> None:
        """See `Target`."""
        width, height = self.size
        found: Any = cl.enqueue_map_buffer(
            queue,
            self._buffer,
            cl.map_flags.READ,
            0,
            (height, width, 4),
            np.dtype(np.uint8),
            is_blocking=False,
        )
        self._mapped, event = found
        event.wait()
        self.pixels = self._mapped

    def close(self) -> None:
        """See `Target`."""
        self.pixels = self._mapped = None


class SharedTarget:
    """An OpenGL texture that the kernel writes to.

    Args:
        shared: the texture as OpenCL sees it.
        texture: its OpenGL name.
    """

    def __init__(self, shared: SharedTexture, texture: int, size: tuple[int, int]) -> None:
        self.shared, self.texture, self.size = shared, texture, size

    @property
    def shown(self) -> Any:
        """See `Target`."""
        return self.shared.image

    def begin(self, queue: cl.CommandQueue) -> None:
        """See `Target`; OpenGL has finished with the texture."""
        self.shared.acquire(queue, _nothing)

    def end(self, queue: cl.CommandQueue) -> None:
        """See `Target`."""
        self.shared.release(queue)
        queue.finish()

    def close(self) -> None:
        """See `Target`; before the texture is deleted."""
        self.shared.close()


@dataclass(frozen=True, slots=True, eq=False)
class Shown:
    """A frame whose pixels have arrived.

    Attributes:
        frame, look: what is shown, and how.
        target: where.
        depths: of each view, arrays of shape (rows, columns) in the pixels of `frame.views`; scene units.
        reduced: whether the target has only the frame's coarse pixels, and has to be enlarged.
    """

    frame: Frame
    look: Look
    target: Target
    depths: list[Floats]
    reduced: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class _Order:
    frame: Frame
    look: Look
    target: Target
    reduced: bool


class Display:
    """A thread that shows the newest of the frames that it is asked for.

    Args:
        device: the session's.
        pool: the session's.
        woken: called from the thread when a frame has arrived or failed.
        to_image: whether targets are textures.

    Attributes:
        problem: why the last frame could not be shown; the caller may go on with other targets.
    """

    def __init__(
        self, device: Device, pool: CanvasPool, woken: Callable[[], None], *, to_image: bool
    ) -> None:
        self.device, self.pool, self.woken, self.to_image = device, pool, woken, to_image
        self.problem: ClfractalError | None = None
        self._changed = threading.Condition()
        self._order: _Order | None = None
        self._shown: Shown | None = None
        self._spare: list[Target] = []
        self._closed = False
        self._shower: Shower | None = None
        self._depths: tuple[int, list[Floats]] = (-1, [])
        self._thread = threading.Thread(target=self._work, name="clfractal-display", daemon=True)
        self._thread.start()

    def show(self, frame: Frame, look: Look, target: Target, *, reduced: bool = False) -> bool:
        """Asks for a frame; one that was asked for before and has not begun is forgotten.

        False if the frame is not there any more: then there is a newer one, and the target stays the caller's.
        """
        with self._changed:
            if self._closed or not self.pool.hold(frame):
                return False
            if self._order is not None:
                self._drop(self._order)
            self._order = _Order(frame, look, target, reduced)
            self._changed.notify_all()
            return True

    def take(self) -> Shown | None:
        """The frame that arrived last, once; its target is the caller's until it is used again."""
        with self._changed:
            shown, self._shown = self._shown, None
            return shown

    def spare(self) -> list[Target]:
        """Targets that were given to `show`, and whose pictures nobody will take."""
        with self._changed:
            found, self._spare = self._spare, []
            return found

    def close(self) -> None:
        """Ends the thread; waits until OpenCL uses no target."""
        with self._changed:
            self._closed = True
            self._changed.notify_all()
        self._thread.join(10.0)

    def _drop(self, order: _Order) -> None:
        self.pool.release(order.frame.canvas)
        self._spare.append(order.target)

    def _work(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._closed or self._order is not None)
                order, self._order = self._order, None
                if self._closed:
                    if order is not None:
                        self._drop(order)
                    return
            assert order is not None
            try:
                shown = self._show(order)
                with self._changed:
                    if self._shown is not None:
                        self._spare.append(self._shown.target)
                    self._shown = shown
            except Exception as error:  # the next frame is shown again
                self.problem = error if isinstance(error, ClfractalError) else internal_error(error)
                with self._changed:
                    self._spare.append(order.target)
            finally:
                self.pool.release(order.frame.canvas)
            self.woken()

    def _show(self, order: _Order) -> Shown:
        frame = order.frame
        if self._shower is None:
            self._shower = Shower(self.device, to_image=self.to_image)
        queue = self._shower.queue
        with self.device.failures("showing the picture"):
            order.target.begin(queue)
            self._shower.enqueue(
                frame.canvas,
                frame.arrangement,
                order.look,
                order.target.shown,
                reduced=order.reduced,
                smoothing=frame.smoothing,
            )
            if self._depths[0] == frame.number:
                order.target.end(queue)
            else:
                # Before anything is waited for: each wait may last until PoCL's cores are done with a launch.
                depths, event = frame.canvas.start_reading_depths(queue)
                order.target.end(queue)
                event.wait()
                self._depths = (frame.number, depths)
        return Shown(frame, order.look, order.target, self._depths[1], order.reduced)


def _nothing() -> None:
    """OpenGL has finished already: the window's thread waits for it before it gives a texture away."""
