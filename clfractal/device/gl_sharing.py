"""Textures that OpenCL kernels write and OpenGL shows, without a copy in between.

pyopencl's wheels are built without this part of OpenCL, but the loader inside them has its functions: they are called by
ctypes here.

Order of calls. In OpenGL's thread, with its context current: `current_handles`, `shares_with`, `opened_with`, and
`SharedTexture` for a texture of the format RGBA8 that is complete (no missing mipmaps). Then, in any thread, kernels write
to `SharedTexture.image` between `acquire` and `release`. Before the first OpenGL must have finished with the texture, and
it may use it again after the second, when it has bound it anew. `close` comes before the texture is deleted.
"""

from __future__ import annotations

import ctypes
import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from typing import Any, Literal

import pyopencl as cl

from clfractal.device.driver_errors import status_name
from clfractal.device.select import Device, Properties
from clfractal.errors import DeviceError

FENCES = "cl_khr_gl_event"

# Numbers of the standard that pyopencl has only if it was built with OpenGL.
_GL_CONTEXT = 0x2008
_DISPLAYS = {"egl": 0x2009, "glx": 0x200A, "wgl": 0x200B}
_CGL_SHARE_GROUP = 0x10000000  # of Apple's cl_APPLE_gl_sharing
_CURRENT_DEVICE = 0x2006
_ALL_DEVICES = 0x2007
_TEXTURE_2D = 0x0DE1

_MAX_DEVICES = 64


@dataclass(frozen=True, slots=True)
class GLHandles:
    """What the operating system knows an OpenGL context by.

    Attributes:
        platform: whose context it is: X11's GLX, EGL, Windows' WGL or Apple's CGL.
        context: its pointer.
        display: the pointer of its `Display` (GLX), `EGLDisplay` (EGL), device context (WGL) or share group (CGL).
    """

    platform: Literal["glx", "egl", "wgl", "cgl"]
    context: int
    display: int


def current_handles() -> GLHandles:
    """The OpenGL context that is current in this thread.

    Raises:
        DeviceError: there is none.
    """
    for platform, names, context, display in _context_functions():
        for name in names:
            library = _loaded_library(name)
            if library is None:
                continue
            found = _pointer(library, context)
            shown_on = _pointer(library, display, *([found] if platform == "cgl" else []))
            if found and shown_on:
                return GLHandles(platform, found, shown_on)
    raise DeviceError("no OpenGL context is current")


def sharing_properties(handles: GLHandles) -> Properties:
    """The properties, beside the platform, of an OpenCL context that shares objects with this OpenGL context."""
    if handles.platform == "cgl":
        return ((_CGL_SHARE_GROUP, handles.display),)
    return ((_GL_CONTEXT, handles.context), (_DISPLAYS[handles.platform], handles.display))


def shares_with(device: Device, handles: GLHandles) -> bool:
    """Whether the device is the one that draws for this OpenGL context."""
    if not device.info.gl_sharing:
        return False
    properties = _property_list(device.cl_device, sharing_properties(handles))
    drawing = _gl_devices(device.cl_device, properties, _CURRENT_DEVICE)
    drawing = drawing or _gl_devices(device.cl_device, properties, _ALL_DEVICES)
    return device.cl_device.int_ptr in drawing


def opened_with(device: Device, handles: GLHandles) -> Device:
    """The device with a new context, whose images can be textures of this OpenGL context.

    Raises:
        DeviceError: it cannot share with it.
    """
    if not shares_with(device, handles):
        raise DeviceError(f"{device.info.name} does not share textures with OpenGL")
    shared = device.reopened(sharing_properties(handles), _make_context)
    _ = shared.context  # made here, in OpenGL's thread
    return shared


class SharedTexture:
    """A texture that kernels of a device can write to.

    Args:
        device: from `opened_with`.
        texture: OpenGL's number of a GL_TEXTURE_2D whose level 0 has the format GL_RGBA8.
        width, height: of its level 0, in pixels.

    Raises:
        DeviceError: it cannot be shared, or has another size.
    """

    def __init__(self, device: Device, texture: int, width: int, height: int) -> None:
        self.device = device
        self.width, self.height = width, height
        image: cl.Image = _shared_image(device, texture)
        if (image.width, image.height) != (width, height):
            found = f"{image.width} x {image.height}"
            image.release()
            raise DeviceError(
                f"{device.info.name} has a texture of {found} pixels, not of {width} x {height}"
            )
        self._image: cl.Image | None = image

    @property
    def image(self) -> cl.Image:
        """For arguments of kernels that are `__write_only image2d_t`."""
        if self._image is None:
            raise DeviceError("a texture was used that is no longer shared")
        return self._image

    @property
    def takes_fences(self) -> bool:
        """Whether `acquire` can wait for a fence of OpenGL's, so that no thread has to."""
        return FENCES in self.device.cl_device.extensions.split()

    def acquire(self, queue: cl.CommandQueue, finish_gl: Callable[[], object], *, fence: int = 0) -> None:
        """From here to `release` the texture is OpenCL's.

        Args:
            queue: where the kernels that write to it are put, in order.
            finish_gl: returns when OpenGL has finished what it was told to do with the texture: `glFinish` if OpenGL's
                context is current in this thread.
            fence: a sync object of OpenGL, behind all it was told to do with the texture, and flushed. It is waited
                for instead where the device can.

        Raises:
            DeviceError: the device failed.
        """
        if fence and self.takes_fences:
            event = _fence_event(self.device, fence)
            _enqueue("clEnqueueAcquireGLObjects", queue, self.image, [event])
            return
        finish_gl()
        _enqueue("clEnqueueAcquireGLObjects", queue, self.image)

    def release(self, queue: cl.CommandQueue) -> None:
        """Gives the texture back; returns when the kernels have written to it and OpenGL may use it.

        Raises:
            DeviceError: the device failed.
        """
        _enqueue("clEnqueueReleaseGLObjects", queue, self.image)
        with self.device.failures("writing to a texture"):
            queue.finish()

    @contextmanager
    def held(
        self, queue: cl.CommandQueue, finish_gl: Callable[[], object], *, fence: int = 0
    ) -> Iterator[cl.Image]:
        """`acquire` before and `release` after, whatever happens between; the image."""
        self.acquire(queue, finish_gl, fence=fence)
        try:
            yield self.image
        except BaseException:
            with suppress(DeviceError):  # what happened first is the error to tell
                self.release(queue)
            raise
        self.release(queue)

    def close(self) -> None:
        """Shares it no longer: after the last `release`, before the texture is deleted. May be called again."""
        image, self._image = self._image, None
        if image is not None:
            image.release()


def _shared_image(device: Device, texture: int) -> Any:
    error = ctypes.c_int()
    function = _function("clCreateFromGLTexture", ctypes.c_void_p)
    flags = ctypes.c_uint64(int(cl.mem_flags.WRITE_ONLY))
    context = ctypes.c_void_p(device.context.int_ptr)
    target, level = ctypes.c_uint(_TEXTURE_2D), ctypes.c_int(0)
    made = function(context, flags, target, level, ctypes.c_uint(texture), ctypes.byref(error))
    _check("clCreateFromGLTexture", error.value)
    return cl.Image.from_int_ptr(made, retain=False)


def _enqueue(
    name: Literal["clEnqueueAcquireGLObjects", "clEnqueueReleaseGLObjects"],
    queue: cl.CommandQueue,
    image: cl.Image,
    wait_for: Sequence[cl.Event] = (),
) -> None:
    images = (ctypes.c_void_p * 1)(image.int_ptr)
    events = (ctypes.c_void_p * len(wait_for))(*(event.int_ptr for event in wait_for))
    count = ctypes.c_uint(len(wait_for))
    function = _function(name, ctypes.c_int)
    target = ctypes.c_void_p(queue.int_ptr)
    _check(name, function(target, ctypes.c_uint(1), images, count, events if wait_for else None, None))


def _make_context(cl_device: cl.Device, properties: Properties) -> cl.Context:
    """A context with properties that pyopencl refuses where it was built without OpenGL."""
    error = ctypes.c_int()
    devices = (ctypes.c_void_p * 1)(cl_device.int_ptr)
    function = _function("clCreateContext", ctypes.c_void_p)
    wanted = _property_list(cl_device, properties)
    made = function(wanted, ctypes.c_uint(1), devices, None, None, ctypes.byref(error))
    _check("clCreateContext", error.value)
    return cl.Context.from_int_ptr(made, retain=False)


def _gl_devices(cl_device: cl.Device, properties: Any, which: int) -> list[int]:
    """The devices that the driver names for an OpenGL context, as pointers; none if it refuses the question."""
    kind = ctypes.CFUNCTYPE(
        ctypes.c_int,
        ctypes.c_void_p,
        ctypes.c_uint,
        ctypes.c_size_t,
        ctypes.c_void_p,
        ctypes.POINTER(ctypes.c_size_t),
    )
    address = _extension(cl_device, "clGetGLContextInfoKHR")
    if not address:
        return []
    found, size = (ctypes.c_void_p * _MAX_DEVICES)(), ctypes.c_size_t(0)
    status = kind(address)(properties, which, ctypes.sizeof(found), found, ctypes.byref(size))
    count = size.value // ctypes.sizeof(ctypes.c_void_p)
    return [] if status else [int(each) for each in found[:count] if each]


def _fence_event(device: Device, fence: int) -> cl.Event:
    """An event that is complete when OpenGL has passed the fence."""
    kind = ctypes.CFUNCTYPE(ctypes.c_void_p, ctypes.c_void_p, ctypes.c_void_p, ctypes.POINTER(ctypes.c_int))
    name = "clCreateEventFromGLsyncKHR"
    address = _extension(device.cl_device, name)
    if not address:
        raise DeviceError(f"sharing with OpenGL failed: {name} is missing")
    error = ctypes.c_int()
    made = kind(address)(device.context.int_ptr, fence, ctypes.byref(error))
    _check(name, error.value)
    return cl.Event.from_int_ptr(made, retain=False)


def _property_list(cl_device: cl.Device, properties: Properties) -> Any:
    """Properties as the standard wants them: pairs behind each other, ended by 0."""
    pairs = ((int(cl.context_properties.PLATFORM), cl_device.platform.int_ptr), *properties)
    numbers = [int(number) for pair in pairs for number in pair]
    return (ctypes.c_ssize_t * (len(numbers) + 1))(*numbers, 0)


def _extension(cl_device: cl.Device, name: str) -> int:
    function = _function("clGetExtensionFunctionAddressForPlatform", ctypes.c_void_p)
    return int(function(ctypes.c_void_p(cl_device.platform.int_ptr), name.encode()) or 0)


def _check(name: str, status: int) -> None:
    if status:
        raise DeviceError(
            f"sharing with OpenGL failed: {name}: {_GL_STATUS.get(status) or status_name(status)}"
        )


_GL_STATUS = {-64: "INVALID_PROPERTY", -1000: "INVALID_GL_SHAREGROUP_REFERENCE_KHR"}


def _function(name: str, result: Any) -> Any:
    try:
        function = _loader()[name]
    except AttributeError as error:
        raise DeviceError(f"sharing with OpenGL failed: the OpenCL loader lacks {name}") from error
    function.restype = result
    return function


@cache
def _loader() -> ctypes.CDLL:
    """The OpenCL loader that pyopencl itself calls; a second one would not know its handles."""
    if sys.platform != "win32":
        # A library's handle also finds the functions of those that it is linked with.
        return ctypes.CDLL(_module_file())
    beside = os.path.join(os.path.dirname(os.path.dirname(_module_file())), "pyopencl.libs")
    names = sorted(os.listdir(beside)) if os.path.isdir(beside) else []
    bundled = [os.path.join(beside, name) for name in names if name.lower().startswith("opencl")]
    return ctypes.CDLL((bundled or ["OpenCL"])[0])


def _module_file() -> str:
    module: Any = cl
    return str(module._cl.__file__)


_Source = tuple[Literal["glx", "egl", "wgl", "cgl"], tuple[str, ...], str, str]


def _context_functions() -> tuple[_Source, ...]:
    """Libraries that may hold the current context: whose, their names, what gives the context and its display."""
    if sys.platform == "win32":
        return (("wgl", ("opengl32",), "wglGetCurrentContext", "wglGetCurrentDC"),)
    if sys.platform == "darwin":
        path = "/System/Library/Frameworks/OpenGL.framework/OpenGL"
        return (("cgl", (path,), "CGLGetCurrentContext", "CGLGetShareGroup"),)
    glx = ("libGLX.so.0", "libGL.so.1", "libGLX.so", "libGL.so")
    return (
        ("glx", glx, "glXGetCurrentContext", "glXGetCurrentDisplay"),
        ("egl", ("libEGL.so.1", "libEGL.so"), "eglGetCurrentContext", "eglGetCurrentDisplay"),
    )


def _loaded_library(name: str) -> ctypes.CDLL | None:
    """A library that is in use already: one that nobody loaded holds no current context."""
    try:
        return ctypes.CDLL(name, mode=ctypes.DEFAULT_MODE | getattr(os, "RTLD_NOLOAD", 0))
    except OSError:
        return None


def _pointer(library: ctypes.CDLL, name: str, *arguments: int) -> int:
    """What a function of a library returns; 0 if it lacks it."""
    try:
        function = library[name]
    except AttributeError:
        return 0
    function.restype = ctypes.c_void_p
    return int(function(*(ctypes.c_void_p(each) for each in arguments)) or 0)
