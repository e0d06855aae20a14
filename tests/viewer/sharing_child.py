"""A process with a hidden window that shares a texture with OpenCL: `sharing_child.py API [MISTAKE]`.

It runs the real code on OpenCL devices that gl_layer.c lets share with OpenGL. A mistake of that name (see
sharing_mistakes.py) is made on the way. What came of it is written as one line of JSON.
"""

from __future__ import annotations

import ctypes
import json
import sys
from concurrent.futures import ThreadPoolExecutor
from threading import Event
from typing import Any

import glfw
import numpy as np
import pyopencl as cl
from OpenGL import GL

from clfractal.device import gl_sharing, select
from clfractal.device.gl_sharing import SharedTexture
from clfractal.device.select import Device
from clfractal.errors import DeviceError
from tests.viewer.sharing_mistakes import MISTAKES

WIDTH, HEIGHT = 96, 40
RED = (255, 0, 0, 255)

KERNEL = """
__kernel void paint(__write_only image2d_t shown, int seed) {
    const int x = get_global_id(0), y = get_global_id(1);
    const int4 bytes = (int4)(x * 7 + seed, y * 5, x ^ y, 255 - seed) & 255;
    write_imagef(shown, (int2)(x, y), convert_float4(bytes) / 255.0f);
}
"""


def expected(seed: int) -> np.ndarray[Any, Any]:
    """What the kernel writes: bytes of shape (HEIGHT, WIDTH, 4)."""
    y, x = np.mgrid[0:HEIGHT, 0:WIDTH]
    return (np.stack([x * 7 + seed, y * 5, x ^ y, np.full_like(x, 255 - seed)], axis=-1) & 255).astype(
        np.uint8
    )


VERTICES = """#version 330 core
void main() { gl_Position = vec4(gl_VertexID % 2 * 4 - 1, gl_VertexID / 2 * 4 - 1, 0, 1); }
"""
FRAGMENTS = """#version 330 core
uniform sampler2D shown;
out vec4 color;
void main() { color = texelFetch(shown, ivec2(gl_FragCoord.xy), 0); }
"""


def _program() -> int:
    program = int(GL.glCreateProgram())
    for kind, text in ((GL.GL_VERTEX_SHADER, VERTICES), (GL.GL_FRAGMENT_SHADER, FRAGMENTS)):
        shader = GL.glCreateShader(kind)
        GL.glShaderSource(shader, text)
        GL.glCompileShader(shader)
        GL.glAttachShader(program, shader)
    GL.glLinkProgram(program)
    return program


class Window:
    """A hidden window with a texture, and a framebuffer that the texture is drawn into."""

    def __init__(self, api: str) -> None:
        if not glfw.init():
            raise SystemExit("GLFW does not start")
        native = glfw.EGL_CONTEXT_API if api == "egl" else glfw.NATIVE_CONTEXT_API
        glfw.window_hint(glfw.CONTEXT_CREATION_API, native)
        glfw.window_hint(glfw.VISIBLE, glfw.FALSE)
        glfw.window_hint(glfw.CONTEXT_VERSION_MAJOR, 3)
        glfw.window_hint(glfw.CONTEXT_VERSION_MINOR, 3)
        glfw.window_hint(glfw.OPENGL_PROFILE, glfw.OPENGL_CORE_PROFILE)
        self.window = glfw.create_window(64, 64, "clfractal", None, None)
        glfw.make_context_current(self.window)
        self.texture, self._target = new_texture(), new_texture()
        GL.glBindFramebuffer(GL.GL_FRAMEBUFFER, GL.glGenFramebuffers(1))
        GL.glFramebufferTexture2D(
            GL.GL_FRAMEBUFFER, GL.GL_COLOR_ATTACHMENT0, GL.GL_TEXTURE_2D, self._target, 0
        )
        GL.glViewport(0, 0, WIDTH, HEIGHT)
        GL.glBindVertexArray(GL.glGenVertexArrays(1))
        GL.glUseProgram(_program())

    def draw(self) -> None:
        """Tells OpenGL to draw the texture into the framebuffer; nothing says when."""
        GL.glBindTexture(GL.GL_TEXTURE_2D, self.texture)
        GL.glDrawArrays(GL.GL_TRIANGLES, 0, 3)

    def fence(self) -> int:
        """A fence behind all that was drawn."""
        fence = GL.glFenceSync(GL.GL_SYNC_GPU_COMMANDS_COMPLETE, 0)
        self.flush()
        return int(ctypes.cast(fence, ctypes.c_void_p).value or 0)

    def flush(self) -> None:
        """Lets OpenGL begin."""
        GL.glFlush()

    def drawn(self) -> np.ndarray[Any, Any]:
        """The bytes of the framebuffer."""
        return _pixels(self._target)

    def pixels(self) -> np.ndarray[Any, Any]:
        """The bytes of the texture."""
        return _pixels(self.texture)

    def delete_texture(self) -> None:
        """Deletes the texture."""
        GL.glDeleteTextures(1, [self.texture])


def new_texture(texture_format: int = GL.GL_RGBA8, *, complete: bool = True) -> int:
    """A red texture, which lacks mipmaps unless it is complete without; its number."""
    texture = int(GL.glGenTextures(1))
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    if complete:
        GL.glTexParameteri(GL.GL_TEXTURE_2D, GL.GL_TEXTURE_MIN_FILTER, GL.GL_NEAREST)
    red = np.tile(np.array(RED, np.uint8), (HEIGHT, WIDTH, 1))
    size = (WIDTH, HEIGHT)
    GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, texture_format, *size, 0, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, red)
    return texture


def _pixels(texture: int) -> np.ndarray[Any, Any]:
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    data = GL.glGetTexImage(GL.GL_TEXTURE_2D, 0, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE)
    return np.frombuffer(data, np.uint8).reshape(HEIGHT, WIDTH, 4)


class Painter:
    """Writes frames to the shared texture, in a thread where no OpenGL context is current."""

    def __init__(self, device: Device, shared: SharedTexture) -> None:
        self._kernel = cl.Program(device.context, KERNEL).build().paint
        self._device, self._shared = device, shared
        self._thread = ThreadPoolExecutor(1)
        self._wanted, self._finished = Event(), Event()

    def paint(self, seed: int, fence: int = 0) -> None:
        """One frame; OpenGL may show it when this returns. In OpenGL's thread, which finishes when it is asked to."""
        self._wanted.clear()
        self._finished.clear()
        painted = self._thread.submit(self._paint, seed, fence)
        while not painted.done():
            if self._wanted.wait(0.002):
                GL.glFinish()
                self._finished.set()
        painted.result()

    def _paint(self, seed: int, fence: int) -> None:
        queue = self._device.queue
        with self._shared.held(queue, self._finish_gl, fence=fence) as image:
            self._kernel.set_arg(0, image)
            self._kernel.set_arg(1, np.int32(seed))
            cl.enqueue_nd_range_kernel(queue, self._kernel, (WIDTH, HEIGHT), None)

    def _finish_gl(self) -> None:
        self._wanted.set()
        self._finished.wait()


def story(window: Window, result: dict[str, Any]) -> None:
    """Two frames, the second of them made while OpenGL has yet to draw the first; which pixels were right."""
    handles = gl_sharing.current_handles()
    result["platform"] = handles.platform
    device = gl_sharing.opened_with(select.choose(), handles)
    shared = SharedTexture(device, window.texture, WIDTH, HEIGHT)
    result["fences"] = shared.takes_fences
    painter = Painter(device, shared)
    painter.paint(1)
    result["first"] = bool(np.array_equal(window.pixels(), expected(1)))
    window.draw()
    painter.paint(2, window.fence() if shared.takes_fences else 0)
    result["drawn"] = bool(np.array_equal(window.drawn(), expected(1)))
    result["second"] = bool(np.array_equal(window.pixels(), expected(2)))
    shared.close()
    window.delete_texture()


def main(api: str, mistake: str = "") -> None:
    """Prints what came of the story: which pixels were right, and the error that ended it."""
    window = Window(api)
    if mistake:
        MISTAKES[mistake].plant(window)
    result: dict[str, Any] = {}
    try:
        story(window, result)
    except (DeviceError, cl.Error) as error:
        result |= {"error": str(error), "kind": type(error).__name__}
    print(json.dumps(result), flush=True)


if __name__ == "__main__":
    main(*sys.argv[1:])
