"""The picture of a window: a texture that always holds the newest frame, by sharing or by copying."""

from __future__ import annotations

from collections.abc import Callable

from clfractal.device import gl_sharing
from clfractal.device.select import Device
from clfractal.engine.show import Look, can_reduce
from clfractal.errors import ClfractalError
from clfractal.viewer import gl
from clfractal.viewer.display import CopyTarget, Display, SharedTarget, Shown, Target
from clfractal.viewer.frame import CanvasPool, Frame

_TARGETS = 3
"""One is shown, one is being written, and one waits."""


class Surface:
    """Shows frames of one device. Only for the thread whose OpenGL context is current.

    Args:
        device: the session's, whose context shares the window's objects if `shared`.
        pool: the session's.
        shared: whether textures are shared; else pictures are copied.
        woken: called from another thread when a frame has arrived.
        remark: called with a line if sharing fails and copying takes over.
    """

    def __init__(
        self,
        device: Device,
        pool: CanvasPool,
        *,
        shared: bool,
        woken: Callable[[], None],
        remark: Callable[[str], None],
    ) -> None:
        self.device, self.pool, self.woken, self.remark = device, pool, woken, remark
        self.shared = shared
        self.shown: Shown | None = None
        self._asked: tuple[int, Look] | None = None
        self._upload = gl.Upload()
        self._free: list[Target] = []
        self._made: list[Target] = []
        self._display = Display(device, pool, woken, to_image=shared)

    @property
    def texture(self) -> int:
        """The texture that holds the picture; 0 before the first."""
        if self.shown is None:
            return 0
        target = self.shown.target
        return target.texture if isinstance(target, SharedTarget) else self._upload.texture

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, pixels; its texture has fewer if it is coarse, see `part`."""
        return self.shown.frame.arrangement.size(self.shown.look) if self.shown is not None else (0, 0)

    @property
    def coarse(self) -> bool:
        """Whether the texture has fewer pixels than the picture."""
        return self.shown is not None and self.shown.reduced

    @property
    def part(self) -> tuple[float, float, float, float]:
        """The part of the texture that is the whole picture: left, top, right, bottom, 0 to 1."""
        if self.shown is None or not self.shown.reduced:
            return 0.0, 0.0, 1.0, 1.0
        # A coarse pixel is the picture's pixel at the corner of its block, so that one's middle is the texel's middle.
        divider, (width, height) = self.shown.frame.divider, self.size
        across, down = self.shown.target.size
        first, right, bottom = 0.5 - 0.5 / divider, (width - 0.5) / divider, (height - 0.5) / divider
        return first / across, first / down, (right + 0.5) / across, (bottom + 0.5) / down

    @property
    def smooth(self) -> bool:
        """Whether coarse pixels are interpolated."""
        return self.shown is not None and self.shown.look.smooth

    def want(self, frame: Frame | None, look: Look) -> None:
        """Asks for a frame, unless it is shown or on its way already."""
        if frame is None or self._asked == (frame.number, look):
            return
        reduced = can_reduce(frame.canvas, frame.arrangement, look)
        region = frame.canvas.parts[0].region
        target = self._target((region.width, region.height) if reduced else frame.arrangement.size(look))
        if target is None:
            return  # all are in use; it is asked for again after the next arrives
        if self._display.show(frame, look, target, reduced=reduced):
            self._asked = (frame.number, look)
        else:
            self._free.append(target)  # a newer frame is there

    def update(self) -> bool:
        """Takes what has arrived; whether the picture has changed."""
        for target in self._display.spare():
            self._give(target)
        problem = self._display.problem
        if problem is not None:
            self._display.problem = None
            self._failed(problem)
        shown = self._display.take()
        if shown is None:
            return False
        if isinstance(shown.target, CopyTarget):
            assert shown.target.pixels is not None
            self._upload.fill(shown.target.pixels)
        if self.shown is not None:
            self._give(self.shown.target)
        self.shown = shown
        return True

    def close(self) -> None:
        """Ends the display; the context must be current."""
        self._display.close()
        for target in self._made:
            self._drop(target)
        self._made.clear()
        self._upload.close()

    def _target(self, size: tuple[int, int]) -> Target | None:
        for target in [target for target in self._free if target.size != size]:
            self._free.remove(target)
            self._made.remove(target)
            self._drop(target)
        if self._free:
            return self._free.pop()
        if sum(target.size == size for target in self._made) >= _TARGETS:
            return None
        try:
            target = self._new(size)
        except ClfractalError as error:
            if not self.shared:
                raise
            self._failed(error)
            return None
        self._made.append(target)
        return target

    def _new(self, size: tuple[int, int]) -> Target:
        if not self.shared:
            return CopyTarget(self.device, size)
        texture = gl.new_texture(*size)
        gl.finish()  # the texture must be there before OpenCL makes an image of it
        try:
            return SharedTarget(gl_sharing.SharedTexture(self.device, texture, *size), texture, size)
        except ClfractalError:
            gl.delete_texture(texture)
            raise

    def _give(self, target: Target) -> None:
        """Keeps a target for later frames; OpenGL has to be done with it before OpenCL writes to it."""
        if isinstance(target, SharedTarget):
            gl.finish()
        if target in self._made:
            self._free.append(target)

    def _drop(self, target: Target) -> None:
        target.close()
        if isinstance(target, SharedTarget):
            gl.delete_texture(target.texture)

    def _failed(self, problem: ClfractalError) -> None:
        """Sharing that fails gives way to copying; copying that fails is told, and tried with the next frame."""
        if not self.shared:
            self.remark(problem.message)
            return
        self._asked = None
        self.remark(f"pictures are copied now, since sharing textures failed: {problem.message}")
        self._display.close()
        shown = self.shown.target if self.shown is not None else None
        for target in self._made:
            if target is not shown:
                self._drop(target)
        self._made = [shown] if shown is not None else []
        self._free = []
        self.shared = False
        self._display = Display(self.device, self.pool, self.woken, to_image=False)
