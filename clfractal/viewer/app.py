"""The window's main loop, which only handles events and draws: what takes long happens in other threads."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from imgui_bundle import imgui

from clfractal.camera.views import scene_view, seen_by
from clfractal.device.select import choose, devices
from clfractal.errors import STATUS_DEVICE_FAILED, DeviceError, KernelBuildError
from clfractal.scene.stereo import MIDDLE
from clfractal.viewer import marked_lines as marks
from clfractal.viewer import window
from clfractal.viewer.begin import Begun
from clfractal.viewer.deeper_moves import DeeperMoves
from clfractal.viewer.depth_range import DepthRange
from clfractal.viewer.input_events import Inputs
from clfractal.viewer.measuring import Measuring
from clfractal.viewer.operators import Operators
from clfractal.viewer.own_screen import OwnScreen
from clfractal.viewer.panels import all_panels, timeline_area
from clfractal.viewer.room import Room
from clfractal.viewer.screenshots import Drawn
from clfractal.viewer.settings import Settings
from clfractal.viewer.ui_renderer import UiRenderer
from clfractal.viewer.window_places import places_of
from clfractal.viewer.workspace import Workspace

_IDLE_SECONDS = 0.5
"""How long the loop sleeps at most when nothing happens."""
_PANEL_SECONDS = 0.1
"""While only the picture moves, panels are built anew after this time."""
_REDRAWN = 3
"""Frames that are drawn after an event: panels need some to take it in."""


class Viewer(Workspace):
    """A window on a scene: a workspace, and the loop that keeps it alive.

    Args:
        begun: the options, the scene, the device, and a display.
        settings: the user's.
        remark: what was wrong with the settings' file, or empty.
        tell: prints a line for the user (with `--quiet` nothing).

    Raises:
        DeviceError: no OpenGL 3.3.
        ClfractalError: there is no such monitor.
    """

    def __init__(self, begun: Begun, settings: Settings, remark: str, tell: Callable[[str], None]) -> None:
        self.tell = tell
        self.started = time.perf_counter()
        super().__init__(begun, settings)
        self.own_screen = OwnScreen(self.studio)
        self.depth_range, self.room = DepthRange(), Room()
        self.pads = window.Pads()
        self.operators, self.deeper = Operators(self), DeeperMoves(self.studio, self.controls, self.motion)
        self.ui.memory["deeper"] = self.deeper
        self.operators.scene.first_stereo = self.screen
        self.inputs = Inputs(self, self.operators, begun.recording)
        self._hidden, self._measuring = False, Measuring(begun.options)
        self._told: Any = None
        self._failed: set[str] = set()
        self._redraw = _REDRAWN
        self._last = time.perf_counter()
        self._drawn_at = self._last
        for line in (remark, self.remark, *self.files.remarks):
            if line:
                self.studio.tell(line, wrong=True)
        self.files.attach(self.studio, self.outputs, self.ui.show, self.window.title)
        if begun.scene.animation is not None:
            self.studio.go_to_frame(0.0)
        if not begun.options.panels or begun.options.fullscreen or begun.options.monitors is not None:
            self.ui.show.clear()  # F2 brings the panels; who fills a screen or a projector wants the picture

    # The loop

    def run(self) -> None:
        """Until the window is closed.

        Raises:
            KeyboardInterrupt: Ctrl-C in the shell. The process has to end at once, so nothing is waited for.
        """
        try:
            while not self.files.finished:
                self.turn()
        except KeyboardInterrupt:
            self.files.keep()
            raise
        except BaseException:
            self.files.keep()
            self.close()
            raise
        self.close()

    def turn(self) -> None:
        """One round: events, motion, what has arrived, and a picture if anything changed."""
        window.poll(self._patience())
        now = time.perf_counter()
        self.window.look()
        self.pads.look(now)
        seconds, self._last = now - self._last, now
        self.inputs.play(now)
        moved = False
        while self.events:
            if moved and self.events[0].kind in ("button", "scroll"):
                break  # panels learn only with a frame that the pointer is over them now
            event = self.events.popleft()
            moved = moved or event.kind == "move"
            if event.kind == "move" and self.events and self.events[0].kind == "move":
                continue  # a mouse reports ten times as often as there are pictures: the newest place counts
            self.inputs.handle(event, now)
            self._redraw = _REDRAWN
        if self.window.closing:
            self.window.closing = False
            self.files.ask_to_close()
            self._redraw = _REDRAWN
        if self.motion.step(now, seconds, self.pads.gamepad(), self.pads.six()):
            self._redraw = _REDRAWN
        if self.player.step(now):
            self._redraw = max(self._redraw, 1)
        self._take_settings()
        self.deeper.look()
        self.controls.rest(now)
        self.files.tick(now, self.settings, dragging=self.controls.dragging, played=self.inputs.played)
        self._follow(now)
        arrived = self.surface.update()
        if arrived:
            self._redraw = max(self._redraw, 1)
            self.meter.shown(self.surface.shown, now)
            self._mind_comfort()
        if self._redraw > 0 and (arrived or self._until_drawn(now) <= 0) and not self.window.minimised:
            self._redraw -= 1
            self.draw(now)
        limit = self.options.seconds
        if limit is not None and now - self.started > limit:
            self.files.leave()

    def act(self, name: str) -> None:
        """Does an action; see `Operators`."""
        self.operators.do(name)
        self._redraw = _REDRAWN

    def redraw(self) -> None:
        """Something that is drawn has changed."""
        self._redraw = _REDRAWN

    def _take_settings(self) -> None:
        """A panel has changed the user's settings: they count at once, and are kept."""
        if self.ui.settings is self.settings:
            return
        self.set_settings(self.ui.settings)
        with self.studio.telling():
            self.settings.save()

    # The picture

    def _follow(self, now: float) -> None:
        """The studio learns the window's size, the surface what to show."""
        if not self.window.minimised:
            stereo = self.studio.scene.stereo
            self.outputs.leave(timeline_area.room_of(self.ui) * self.ui.scale, stereo)
            self.studio.resize(*self.outputs.picture_size(stereo))
            self.own_screen.look(
                self.window.framebuffer[0],
                now,
                filling=self.outputs.filling,
                shown=self.surface.shown is not None,
            )
        self._rest(self.window.minimised)
        self.outputs.watch(now, self.studio.tell)
        self._mind_device()
        self.studio.films.look(now)
        self.studio.tick()
        self._measuring.look(self.studio, now)
        session = self.studio.session
        told = (session.problem, session.progress, session.paused, self.studio.messages[-1:])
        if told != self._told:
            self._told = told
            self.redraw()
        self.surface.want(self.studio.frame, self.studio.look)
        self.motion.depth = self.meter.nearest(self.surface.shown, self.studio.scene.deep)

    def _rest(self, hidden: bool) -> None:
        """A window that nobody sees gathers no samples."""
        if hidden != self._hidden:
            self._hidden = hidden
            if self.studio.session.paused != hidden or not hidden:
                self.studio.session.pause(hidden)

    def _mind_comfort(self) -> None:
        """Warns of a pair that strains the eyes, as of one that is written to a file; a shot is of the picture."""
        moves = self.controls.dragging or self.motion.active or self.player.playing
        if moves or self.files.options.shot is not None:
            return
        warning = self.depth_range.look(self.surface.shown)
        if warning:
            self.studio.tell(warning, wrong=True, holds=lambda: self.depth_range.strains)

    def _mind_device(self) -> None:
        """A device that fails gives way to another one; the last picture stays until then."""
        failed, problem = self.studio.session.device.info, self.studio.session.problem
        if not isinstance(problem, DeviceError) or problem.status != STATUS_DEVICE_FAILED:
            return
        if isinstance(problem, KernelBuildError) or failed.index in self._failed:
            return
        self._failed.add(failed.index)
        others = [each for each in devices() if each.index not in self._failed]
        if others:
            self.studio.tell(f"{problem.message}; going on with {others[0].name}", wrong=True)
            self.use_device(choose(others[0].index))

    def draw(self, now: float) -> None:
        """Draws the picture and the panels, and shows them."""
        self.window.use()
        framebuffer = self.window.framebuffer
        places = places_of(self.outputs.panel_stereo(self.studio.scene.stereo), framebuffer)
        if places != self.places or not self._panels_may_stay(now):
            self.places = places
            self._build_panels(now)
        self._draw_outputs()
        self._redraw_while_busy()
        still = self.inputs.played and not self.motion.active
        if self.files.after_draw(Drawn(self.surface.shown, still, self.outputs.read, self.picture_alone)):
            self.redraw()
        self.outputs.swap()
        self.meter.swapped(time.perf_counter())

    def picture_alone(self) -> Any:
        """The picture that is shown, without what lies over it: uint8 of shape (height, width, 3)."""
        self.outputs.draw(self.surface, False, lambda by: None)
        pixels = self.outputs.read(picture=True)
        self._draw_outputs()
        return pixels

    def _draw_outputs(self) -> None:
        def draw_panels(by: UiRenderer | None) -> None:
            (by or self.renderer).draw(imgui.get_draw_data(), list(self.places.ui))

        self.outputs.draw(self.surface, self.operators.chart_shown, draw_panels)

    def _panels_may_stay(self, now: float) -> bool:
        """Whether the panels of the frame before are shown again, while only the picture moves.

        Building them takes the time of a third of a frame. What they tell then changes ten times a second.
        """
        if now - self._drawn_at >= _PANEL_SECONDS or self.files.options.shot is not None:
            return False
        controls = self.controls
        marked = controls.marking or controls.region_start is not None or "lights" in self.ui.show
        return (controls.dragging or self.motion.active or self.player.playing) and not marked

    def _build_panels(self, now: float) -> None:
        """Asks all panels what they show, and takes in what was done to them."""
        scale = self.window.scale * self.settings.panel_scale
        size = (self.places.ui_size[0] / scale, self.places.ui_size[1] / scale)
        self.renderer.begin(size, (scale, scale), now - self._drawn_at)
        self._drawn_at = now
        pick = None if imgui.get_io().want_capture_mouse else self.pick_at(*self.pointer)
        imgui.new_frame()
        ui = self.ui
        ui.size, ui.scale, ui.pick, ui.shown = size, scale, pick, self.surface.shown
        ui.comfort = self.depth_range.comfort if self.studio.scene.stereo is not None else None
        self.room.fit(ui, alone=self.outputs.fills_screens)
        ui.speed = replace(self.meter.speed, way="shared" if self.surface.shared else "copied")
        self._draw_marks(scale)
        all_panels.draw_safely(ui)
        imgui.render()
        if imgui.get_io().want_text_input or imgui.is_any_item_active():
            self._redraw = max(self._redraw, 1)

    def _draw_marks(self, scale: float) -> None:
        scene = self.studio.shown_scene
        if scene.layout is not None:
            return
        eye = MIDDLE
        if scene.stereo is not None:
            seen, named = seen_by(scene, "left")
            eye = replace(named, name="middle")
            scene = seen
        size = (scene.image.width * eye.wide, scene.image.height * eye.high)
        marks.draw(
            scene,
            scene_view(scene, eye),
            self.controls,
            size,
            scale,
            lights="lights" in self.ui.show,
            depths=self.surface.shown.depths[0] if self.surface.shown is not None else None,
        )

    def _redraw_while_busy(self) -> None:
        """A spinner turns while something compiles or is rendered beside the picture."""
        # A panel may wait for pictures, or for a thread of its own.
        awaited = self.ui.memory.pop("awaited", False)
        if awaited or self.studio.session.progress or self.studio.busy_beside:
            self._wake_at = time.perf_counter() + 0.1

    _wake_at = 0.0

    def _until_drawn(self, now: float) -> float:
        """Seconds until the next frame is due. While a drag waits for its picture, frames without it would delay it."""
        if not self.controls.dragging:
            return 0.0
        return self._drawn_at + 1 / self.settings.frame_rate - now

    def _patience(self) -> float:
        """How long the loop may sleep, seconds."""
        if self.motion.active or self.events:
            return 0.0
        wait = _IDLE_SECONDS
        if self._redraw > 0 and not self.window.minimised:
            wait = self._until_drawn(time.perf_counter())
            if wait <= 0:
                return 0.0
        frame, due = self.player.wait(time.perf_counter()), self.inputs.next_due
        wait = wait if frame is None else min(wait, frame)
        wait = wait if due is None else min(wait, max(due - time.perf_counter(), 0.0))
        if self._wake_at:
            left = self._wake_at - time.perf_counter()
            if left <= 0:
                self._wake_at = 0.0
                self._redraw = 1
                return 0.0
            wait = min(wait, left)
        if self.pads.any:
            wait = min(wait, 1 / 60)
        return max(min(wait, self.files.patience), 0.001)

    def close(self) -> None:
        """Ends a recording, safety copies and films, then all parts of the window."""
        self.inputs.close()
        self.files.close()
        self.studio.session.pause()
        for line in self.studio.films.close():
            self.tell(line)
        super().close()
