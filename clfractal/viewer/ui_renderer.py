"""Dear ImGui with GLFW and OpenGL: its events, and its drawing in one or several places of a window."""

from __future__ import annotations

import ctypes
from typing import Any

from imgui_bundle import imgui
from imgui_bundle.python_backends.glfw_backend import GlfwRenderer

from clfractal.viewer.gl import GL

Place = tuple[int, int, int, int]
"""x, y (from the bottom), width, height in the framebuffer, pixels."""


class UiRenderer(GlfwRenderer):  # type: ignore[misc]
    """Draws the same panels in each of several places: once for each eye, at the same place of both pictures."""

    def __init__(self, window: Any) -> None:
        super().__init__(window, attach_callbacks=False)

    def begin(self, size: tuple[float, float], scale: tuple[float, float], seconds: float) -> None:
        """Begins a frame.

        Args:
            size: of the area for panels, points.
            scale: framebuffer pixels of a point in each direction.
            seconds: since the frame before.
        """
        self.io.display_size = imgui.ImVec2(*size)
        self.io.display_framebuffer_scale = imgui.ImVec2(*scale)
        self.io.delta_time = max(seconds, 1e-4)

    def draw(self, draw_data: Any, places: list[Place]) -> None:
        """Draws a frame in each of the places, over what is there."""
        self._update_textures()
        width, height = self.io.display_size
        if width <= 0 or height <= 0:
            return
        GL.glEnable(GL.GL_BLEND)
        GL.glBlendEquation(GL.GL_FUNC_ADD)
        GL.glBlendFuncSeparate(
            GL.GL_SRC_ALPHA, GL.GL_ONE_MINUS_SRC_ALPHA, GL.GL_ONE, GL.GL_ONE_MINUS_SRC_ALPHA
        )
        GL.glDisable(GL.GL_CULL_FACE)
        GL.glDisable(GL.GL_DEPTH_TEST)
        GL.glEnable(GL.GL_SCISSOR_TEST)
        GL.glActiveTexture(GL.GL_TEXTURE0)
        projection = (ctypes.c_float * 16)(
            *(2.0 / width, 0, 0, 0), *(0, -2.0 / height, 0, 0), *(0, 0, -1, 0), *(-1, 1, 0, 1)
        )
        GL.glUseProgram(self._shader_handle)
        GL.glUniform1i(self._attrib_location_tex, 0)
        GL.glUniformMatrix4fv(self._attrib_proj_mtx, 1, GL.GL_FALSE, projection)
        GL.glBindVertexArray(self._vao_handle)
        for commands in draw_data.cmd_lists:
            self._send(commands)
            for place in places:
                self._draw_commands(commands, place, width, height)
        GL.glBindVertexArray(0)
        GL.glDisable(GL.GL_SCISSOR_TEST)
        GL.glDisable(GL.GL_BLEND)

    def _send(self, commands: Any) -> None:
        GL.glBindBuffer(GL.GL_ARRAY_BUFFER, self._vbo_handle)
        vertices, indices = commands.vtx_buffer, commands.idx_buffer
        GL.glBufferData(
            GL.GL_ARRAY_BUFFER,
            vertices.size() * imgui.VERTEX_SIZE,
            ctypes.c_void_p(vertices.data_address()),
            GL.GL_STREAM_DRAW,
        )
        GL.glBindBuffer(GL.GL_ELEMENT_ARRAY_BUFFER, self._elements_handle)
        GL.glBufferData(
            GL.GL_ELEMENT_ARRAY_BUFFER,
            indices.size() * imgui.INDEX_SIZE,
            ctypes.c_void_p(indices.data_address()),
            GL.GL_STREAM_DRAW,
        )

    def _draw_commands(self, commands: Any, place: Place, width: float, height: float) -> None:
        x, y, wide, high = place
        GL.glViewport(x, y, wide, high)
        across, down = wide / width, high / height
        kind = GL.GL_UNSIGNED_SHORT if imgui.INDEX_SIZE == 2 else GL.GL_UNSIGNED_INT
        for command in commands.cmd_buffer:
            left, top, right, bottom = command.clip_rect
            left, right = max(left, 0.0) * across, min(right, width) * across
            top, bottom = max(top, 0.0) * down, min(bottom, height) * down
            if right <= left or bottom <= top:
                continue
            GL.glScissor(x + int(left), y + int(high - bottom), int(right - left), int(bottom - top))
            GL.glBindTexture(GL.GL_TEXTURE_2D, command.tex_ref.get_tex_id())
            GL.glDrawElements(
                GL.GL_TRIANGLES,
                command.elem_count,
                kind,
                ctypes.c_void_p(command.idx_offset * imgui.INDEX_SIZE),
            )
