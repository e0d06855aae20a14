"""Mistakes that code which shares textures could make, each planted into the real code, and what shall betray it."""

from __future__ import annotations

import ctypes
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from typing import Any

from clfractal.device import gl_sharing
from clfractal.device.gl_sharing import GLHandles, SharedTexture
from clfractal.device.select import Device, Properties

Plant = Callable[[Any], object]


@dataclass(frozen=True, slots=True)
class Mistake:
    """One mistake.

    Attributes:
        plant: puts it into the code; it is given the window.
        line: a part of a line that the layer shall write, of any if empty.
        pixels: which pixels shall be wrong: "first", "second" or "drawn"; empty if that is not said.
        error: a part of the one-line error that shall end the work; empty if there is none.
        environment: how the layer shall behave.
    """

    plant: Plant
    line: str = ""
    pixels: str = ""
    error: str = ""
    environment: Mapping[str, Any] = field(default_factory=dict)


def _nothing(*_: Any, **__: Any) -> None:
    """Takes the place of a call that is forgotten."""


def _properties(changed: Callable[[GLHandles], Properties]) -> Plant:
    return lambda _: setattr(gl_sharing, "sharing_properties", changed)


def _handles(**changes: Callable[[GLHandles], Any]) -> Plant:
    """Changes what the OpenGL context is known by."""
    real = gl_sharing.current_handles

    def wrong() -> GLHandles:
        right = real()
        return replace(right, **{name: change(right) for name, change in changes.items()})

    return lambda _: setattr(gl_sharing, "current_handles", wrong)


def _argument(place: int, value: Any) -> Plant:
    """Another argument of clCreateFromGLTexture: 1 flags, 2 target, 3 level, 4 texture."""
    real = gl_sharing._function

    def wrong(name: str, result: Any) -> Any:
        function = real(name, result)
        if name != "clCreateFromGLTexture":
            return function
        return lambda *given: function(*given[:place], value, *given[place + 1 :])

    return lambda _: setattr(gl_sharing, "_function", wrong)


def _method(name: str, changed: Callable[..., Any]) -> Plant:
    """Another method of SharedTexture; it is given the real one first."""
    real = getattr(SharedTexture, name)

    def wrong(*given: Any, **named: Any) -> Any:
        return changed(real, *given, **named)

    return lambda _: setattr(SharedTexture, name, wrong)


def _context_without_sharing(device: Device, handles: GLHandles) -> Device:
    return device.reopened()


def _context_in_another_thread(device: Device, handles: GLHandles) -> Device:
    shared = device.reopened(gl_sharing.sharing_properties(handles), gl_sharing._make_context)
    with ThreadPoolExecutor(1) as other:
        other.submit(lambda: shared.context).result()
    return shared


def _without_asking(window: Any) -> None:
    gl_sharing.shares_with = lambda device, handles: True


def _twice(real: Callable[..., Any], *given: Any, **named: Any) -> Any:
    real(*given, **named)
    return real(*given, **named)


def _acquire_unfinished(
    real: Callable[..., Any], shared: Any, queue: Any, finish_gl: Any, fence: int = 0
) -> None:
    real(shared, queue, lambda: None)


def _release_in_another_queue(real: Callable[..., Any], shared: Any, queue: Any) -> None:
    real(shared, shared.device.transfers)


def _release_unfinished(real: Callable[..., Any], shared: Any, queue: Any) -> None:
    gl_sharing._enqueue("clEnqueueReleaseGLObjects", queue, shared.image)


def _release_and_wait_elsewhere(real: Callable[..., Any], shared: Any, queue: Any) -> None:
    _release_unfinished(real, shared, queue)
    shared.device.transfers.finish()


def _acquire_in_another_queue(
    real: Callable[..., Any], shared: Any, queue: Any, finish_gl: Any, fence: int = 0
) -> None:
    real(shared, shared.device.transfers, finish_gl)


def _close_while_acquired(
    real: Callable[..., Any], shared: Any, queue: Any, *given: Any, **named: Any
) -> Any:
    real(shared, queue, *given, **named)
    shared.close()


def _delete_while_shared(window: Any) -> None:
    """Deletes the texture after the first frame, as a window would that was resized."""
    real = window.draw

    def draw() -> None:
        real()
        window.delete_texture()

    window.draw = draw


def _delete_before_close(window: Any) -> None:
    real = SharedTexture.close

    def close(shared: SharedTexture) -> None:
        window.delete_texture()
        real(shared)

    SharedTexture.close = close  # type: ignore[method-assign, assignment]


def _leak(real: Callable[..., Any], shared: Any) -> None:
    """Keeps a reference that nobody gives back."""
    retain = gl_sharing._function("clRetainMemObject", ctypes.c_int)
    retain(ctypes.c_void_p(shared.image.int_ptr))
    real(shared)


def _another_fence(window: Any) -> None:
    real = gl_sharing._fence_event
    gl_sharing._fence_event = lambda device, fence: real(device, fence + 8)


def _fence_too_early(window: Any) -> None:
    draw, fence = window.draw, window.fence

    def draw_behind_the_fence() -> None:
        early = fence()
        window.fence = lambda: early
        draw()

    window.draw = draw_behind_the_fence


def _fence_forgotten(window: Any) -> None:
    real = gl_sharing._enqueue

    def enqueue(name: Any, queue: Any, image: Any, wait_for: Any = ()) -> None:
        real(name, queue, image)

    gl_sharing._enqueue = enqueue


_SHARES = "does not share textures with OpenGL"

MISTAKES: dict[str, Mistake] = {
    # Properties of the context, and its device.
    "another context": Mistake(
        _handles(context=lambda right: right.context + 64), "not the current context", error=_SHARES
    ),
    "another display": Mistake(
        _handles(display=lambda right: right.display + 64), "not the current display", error=_SHARES
    ),
    "context and display swapped": Mistake(
        _handles(context=lambda right: right.display, display=lambda right: right.context),
        "not the current context",
        error=_SHARES,
    ),
    "another platform's display": Mistake(
        _handles(platform=lambda right: "egl" if right.platform == "glx" else "glx"),
        "another platform's",
        error=_SHARES,
    ),
    "no display": Mistake(
        _properties(lambda handles: ((0x2008, handles.context),)), "display is missing", error=_SHARES
    ),
    "no context": Mistake(
        _properties(lambda handles: ((0x200A, handles.display),)),
        "CL_GL_CONTEXT_KHR is missing",
        error=_SHARES,
    ),
    "no properties": Mistake(_properties(lambda handles: ()), "no OpenGL context", error=_SHARES),
    "properties left out": Mistake(
        lambda _: setattr(gl_sharing, "opened_with", _context_without_sharing),
        "does not share with OpenGL",
        error="INVALID_CONTEXT",
    ),
    "device not asked": Mistake(
        _without_asking,
        "does not drive OpenGL",
        error="INVALID_OPERATION",
        environment={"drives": "another driver"},
    ),
    "context made in another thread": Mistake(
        lambda _: setattr(gl_sharing, "opened_with", _context_in_another_thread),
        "not current in the thread",
        error="INVALID_GL_SHAREGROUP_REFERENCE_KHR",
    ),
    # The image.
    "another target": Mistake(
        _argument(2, ctypes.c_uint(0x84F5)), "not GL_TEXTURE_2D", error="INVALID_VALUE"
    ),
    "another level": Mistake(_argument(3, ctypes.c_int(1)), "level 1", error="clCreateFromGLTexture"),
    "flags for reading": Mistake(_argument(1, ctypes.c_uint64(4)), "flags 0x4"),
    "another number": Mistake(
        _argument(4, ctypes.c_uint(4711)), "no texture 4711", error="INVALID_GL_OBJECT"
    ),
    "another texture": Mistake(_argument(4, ctypes.c_uint(2)), pixels="first"),
    # Acquire and release.
    "not acquired": Mistake(_method("acquire", _nothing), "was not acquired", error="INVALID_OPERATION"),
    "acquired twice": Mistake(_method("acquire", _twice), "acquired twice", error="INVALID_OPERATION"),
    "acquired in another queue": Mistake(
        _method("acquire", _acquire_in_another_queue), "before it is acquired", error="INVALID_OPERATION"
    ),
    "acquired before OpenGL has finished": Mistake(_method("acquire", _acquire_unfinished), pixels="drawn"),
    "not released": Mistake(_method("release", _nothing), "acquired twice", "first", "INVALID_OPERATION"),
    "released twice": Mistake(_method("release", _twice), "without an acquire", error="INVALID_OPERATION"),
    "released before the kernel has ended": Mistake(
        _method("release", _release_in_another_queue), "before what uses it has ended"
    ),
    "nobody waits for the release": Mistake(
        _method("release", _release_unfinished), "before anybody waited", "first", "INVALID_OPERATION"
    ),
    "another queue is waited for": Mistake(
        _method("release", _release_and_wait_elsewhere), "before anybody waited", "first", "INVALID_OPERATION"
    ),
    # Lifetimes.
    "texture deleted while it is shared": Mistake(
        _delete_while_shared, "deleted while it is shared", error="INVALID_GL_OBJECT"
    ),
    "texture deleted before its image": Mistake(_delete_before_close, "deleted before its image"),
    "image given up while acquired": Mistake(
        _method("acquire", _close_while_acquired), "while it was acquired", error="no longer shared"
    ),
    "image never given up": Mistake(_method("close", _leak), "never given up"),
    # Fences.
    "another fence": Mistake(
        _another_fence, "no such fence", error="INVALID_GL_OBJECT", environment={"events": True}
    ),
    "fence not waited for": Mistake(
        _fence_forgotten,
        "without waiting for the fence",
        error="INVALID_OPERATION",
        environment={"events": True},
    ),
    "fence before the drawing": Mistake(_fence_too_early, pixels="drawn", environment={"events": True}),
}
