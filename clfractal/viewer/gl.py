"""OpenGL 3.3 core: textures filled from mapped memory, and a rectangle that shows them."""

from __future__ import annotations

import ctypes
from collections.abc import Hashable
from typing import Any

import numpy as np
import numpy.typing as npt
import OpenGL

OpenGL.ERROR_CHECKING = False  # a query after each call would wait for the driver; `check` asks once a frame
from OpenGL import GL as GL  # noqa: E402

from clfractal.errors import DeviceError  # noqa: E402

Pixels = npt.NDArray[np.uint8]

_VERTEX = """#version 330 core
uniform vec4 part;  // of the texture: left, top, right, bottom
out vec2 place;
void main() {
    vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    place = mix(part.xy, part.zw, corner);
    gl_Position = vec4(corner.x * 2.0 - 1.0, 1.0 - corner.y * 2.0, 0.0, 1.0);
}
"""
_FRAGMENT = """#version 330 core
uniform sampler2D picture;
in vec2 place;
out vec4 color;
void main() { color = vec4(texture(picture, place).rgb, 1.0); }
"""


def version() -> tuple[int, int]:
    """The version of the current context."""
    return int(GL.glGetIntegerv(GL.GL_MAJOR_VERSION)), int(GL.glGetIntegerv(GL.GL_MINOR_VERSION))


def renderer() -> str:
    """The name of what draws."""
    found = GL.glGetString(GL.GL_RENDERER)
    return found.decode(errors="replace") if found else ""


def has_stereo() -> bool:
    """Whether the window has a buffer for each eye."""
    return bool(GL.glGetBooleanv(GL.GL_STEREO))


def finish() -> None:
    """Waits until OpenGL has done everything."""
    GL.glFinish()


def check(doing: str) -> None:
    """Raises DeviceError if OpenGL met an error since the last check."""
    found = GL.glGetError()
    if found != GL.GL_NO_ERROR:
        raise DeviceError(f"OpenGL failed while {doing}: error 0x{int(found):04x}")


def new_texture(width: int, height: int, *, smooth: bool = False) -> int:
    """A texture of 8-bit RGBA."""
    texture = int(GL.glGenTextures(1))
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    kind = GL.GL_LINEAR if smooth else GL.GL_NEAREST
    for name, value in (
        (GL.GL_TEXTURE_MIN_FILTER, kind),
        (GL.GL_TEXTURE_MAG_FILTER, kind),
        (GL.GL_TEXTURE_WRAP_S, GL.GL_CLAMP_TO_EDGE),
        (GL.GL_TEXTURE_WRAP_T, GL.GL_CLAMP_TO_EDGE),
        (GL.GL_TEXTURE_MAX_LEVEL, 0),
    ):
        GL.glTexParameteri(GL.GL_TEXTURE_2D, name, value)
    GL.glTexImage2D(GL.GL_TEXTURE_2D, 0, GL.GL_RGBA8, width, height, 0, GL.GL_RGBA, GL.GL_UNSIGNED_BYTE, None)
    return texture


def fill_texture(texture: int, pixels: Pixels) -> None:
    """Fills a texture with pixels of shape (height, width, 4)."""
    _fill(texture, pixels.shape, np.ascontiguousarray(pixels))


def _fill(texture: int, shape: tuple[int, ...], source: Any) -> None:
    """Fills a texture from the host's memory, or from the pixel buffer that is bound."""
    kind = (GL.GL_RGBA, GL.GL_UNSIGNED_BYTE)
    GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
    GL.glPixelStorei(GL.GL_UNPACK_ROW_LENGTH, 0)
    GL.glTexSubImage2D(GL.GL_TEXTURE_2D, 0, 0, 0, shape[1], shape[0], *kind, source)


def delete_texture(texture: int) -> None:
    """Frees a texture."""
    GL.glDeleteTextures(1, [texture])


class Upload:
    """A texture that is filled from the host's memory through two pixel buffers: one is copied while one is filled."""

    def __init__(self) -> None:
        self.size = (0, 0)
        self.texture = 0
        self._buffers = [int(each) for each in GL.glGenBuffers(2)]
        self._next = 0

    def fill(self, pixels: Pixels) -> None:
        """Takes pixels of shape (height, width, 4), RGBA, rows from the top."""
        height, width = pixels.shape[:2]
        if self.size != (width, height):
            if self.texture:
                delete_texture(self.texture)
            self.texture, self.size = new_texture(width, height), (width, height)
        self._next = 1 - self._next
        GL.glBindBuffer(GL.GL_PIXEL_UNPACK_BUFFER, self._buffers[self._next])
        GL.glBufferData(GL.GL_PIXEL_UNPACK_BUFFER, pixels.nbytes, None, GL.GL_STREAM_DRAW)
        access = GL.GL_MAP_WRITE_BIT | GL.GL_MAP_INVALIDATE_BUFFER_BIT
        place = GL.glMapBufferRange(GL.GL_PIXEL_UNPACK_BUFFER, 0, pixels.nbytes, access)
        ctypes.memmove(place, pixels.ctypes.data, pixels.nbytes)
        GL.glUnmapBuffer(GL.GL_PIXEL_UNPACK_BUFFER)
        _fill(self.texture, pixels.shape, ctypes.c_void_p(0))
        GL.glBindBuffer(GL.GL_PIXEL_UNPACK_BUFFER, 0)

    def close(self) -> None:
        """Frees texture and buffers."""
        if self.texture:
            delete_texture(self.texture)
            self.texture = 0
        GL.glDeleteBuffers(2, self._buffers)


class Rectangle:
    """Draws a part of a texture over a part of the framebuffer. Objects of this kind are not shared between contexts."""

    def __init__(self) -> None:
        self._program = _program()
        self._part = GL.glGetUniformLocation(self._program, "part")
        self._array = int(GL.glGenVertexArrays(1))

    def draw(
        self,
        texture: int,
        viewport: tuple[int, int, int, int],
        part: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0),
        *,
        smooth: bool = False,
    ) -> None:
        """Draws.

        Args:
            viewport: x, y (from the bottom), width, height, pixels.
            part: left, top, right, bottom of the texture, 0 to 1.
            smooth: interpolate, because the texture's pixels are not the framebuffer's.
        """
        GL.glDisable(GL.GL_BLEND)
        GL.glDisable(GL.GL_SCISSOR_TEST)
        GL.glViewport(*viewport)
        GL.glUseProgram(self._program)
        GL.glActiveTexture(GL.GL_TEXTURE0)
        GL.glBindTexture(GL.GL_TEXTURE_2D, texture)
        for name in (GL.GL_TEXTURE_MAG_FILTER, GL.GL_TEXTURE_MIN_FILTER):
            GL.glTexParameteri(GL.GL_TEXTURE_2D, name, GL.GL_LINEAR if smooth else GL.GL_NEAREST)
        GL.glUniform4f(self._part, *part)
        GL.glBindVertexArray(self._array)
        GL.glDrawArrays(GL.GL_TRIANGLE_STRIP, 0, 4)
        GL.glBindVertexArray(0)


def _program() -> int:
    program = GL.glCreateProgram()
    for kind, text in ((GL.GL_VERTEX_SHADER, _VERTEX), (GL.GL_FRAGMENT_SHADER, _FRAGMENT)):
        shader = GL.glCreateShader(kind)
        GL.glShaderSource(shader, text)
        GL.glCompileShader(shader)
        if not GL.glGetShaderiv(shader, GL.GL_COMPILE_STATUS):
            raise DeviceError(f"OpenGL refused a shader: {GL.glGetShaderInfoLog(shader)!r}")
        GL.glAttachShader(program, shader)
        GL.glDeleteShader(shader)
    GL.glLinkProgram(program)
    if not GL.glGetProgramiv(program, GL.GL_LINK_STATUS):
        raise DeviceError(f"OpenGL refused a program: {GL.glGetProgramInfoLog(program)!r}")
    return int(program)


def clear(color: tuple[float, float, float] = (0.0, 0.0, 0.0)) -> None:
    """Fills the framebuffer."""
    GL.glDisable(GL.GL_SCISSOR_TEST)
    GL.glClearColor(*color, 1.0)
    GL.glClear(GL.GL_COLOR_BUFFER_BIT)


def draw_to(eye: str | None) -> None:
    """Chooses the buffer of one eye (`left`, `right`), or both."""
    GL.glDrawBuffer({None: GL.GL_BACK, "left": GL.GL_BACK_LEFT, "right": GL.GL_BACK_RIGHT}[eye])


def read_pixels(width: int, height: int) -> Pixels:
    """What was drawn and not yet swapped: shape (height, width, 3), rows from the top."""
    GL.glPixelStorei(GL.GL_PACK_ALIGNMENT, 1)
    data = GL.glReadPixels(0, 0, width, height, GL.GL_RGB, GL.GL_UNSIGNED_BYTE)
    found = np.frombuffer(bytes(data), np.uint8).reshape(height, width, 3)
    return np.ascontiguousarray(found[::-1])


class SmallTextures:
    """Small pictures for panels, uploaded once for a key; those not used for long are freed."""

    most = 400

    def __init__(self) -> None:
        self._found: dict[Hashable, int] = {}

    def get(self, key: Hashable, pixels: Pixels) -> Any:
        """The `imgui.ImTextureRef` of a picture of shape (height, width, 4)."""
        from imgui_bundle import imgui

        texture = self._found.pop(key, None)
        if texture is None:
            height, width = pixels.shape[:2]
            texture = new_texture(width, height, smooth=True)
            fill_texture(texture, pixels)
        self._found[key] = texture
        while len(self._found) > self.most:
            delete_texture(self._found.pop(next(iter(self._found))))
        return imgui.ImTextureRef(texture)

    def close(self) -> None:
        """Frees all."""
        for texture in self._found.values():
            delete_texture(texture)
        self._found.clear()
