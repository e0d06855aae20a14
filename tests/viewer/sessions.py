"""Sessions without a window: started, waited for, and their frames read back."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import numpy as np

import clfractal
from clfractal.device.select import Device
from clfractal.engine.canvas import CHANNELS
from clfractal.engine.job_framebuffers import JobFramebuffers
from clfractal.engine.show import Look
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene
from clfractal.viewer.display import CopyTarget, Display, Shown
from clfractal.viewer.frame import Frame
from clfractal.viewer.pacing import Pacing
from clfractal.viewer.session import Session
from tests.scenes import STEREO, bulb_text

SIZE = (96, 64)
FOREVER = 10_000.0
"""Seconds, in place of `session.SETTLE_SECONDS`: a movement lasts until a request ends it, however late tests are."""
BULB = bulb_text(SIZE, "renderer: {samples: 4}\n")
BALL = """
version: 1
formula:
  iterations: 8
  inline: {variables: [x, y, z], map: [x*x - y*y - z*z, 2*x*y, 2*x*z], add: none, degree: 2, bailout: 4,
           bounds: {center: [0, 0, 0], radius: 1.5}}
image: {width: 96, height: 64}
camera: {position: [0, -4, 0]}
renderer: {samples: 1}
"""


def scene_of(text: str = BULB, *overrides: str) -> Scene:
    """A scene of a text, with values replaced as by `--set`."""
    return clfractal.load_scene(text, overrides=overrides)


def wait_for(true: Callable[[], object], seconds: float = 120.0) -> None:
    """Waits until something is true; fails if that takes far too long, on any machine."""
    end = time.perf_counter() + seconds
    while not true():
        assert time.perf_counter() < end, "waited too long"
        time.sleep(0.002)


@dataclass
class Watch:
    """A session, and all its frames."""

    session: Session
    frames: list[Frame] = field(default_factory=list)
    progress: list[str] = field(default_factory=list)
    pauses: Callable[[Frame], bool] = lambda frame: False
    """After which frame the session pauses, before it does anything more."""

    def woken(self) -> None:
        """Called from the session's thread."""
        frame = self.session.frame
        if frame is not None and (not self.frames or self.frames[-1] is not frame):
            self.frames.append(frame)
            if self.pauses(frame):
                self.session.pause()
        if self.session.progress:
            self.progress.append(self.session.progress)

    def shows(self, true: Callable[[Frame], object]) -> None:
        """Waits until a frame has come of which something is true, whatever came after it."""
        wait_for(lambda: any(true(each) for each in list(self.frames)))

    def rest(self) -> Frame:
        """The frame when nothing is under way any more."""
        wait_for(lambda: self.session.idle)
        assert self.session.frame is not None, self.session.problem
        return self.session.frame

    def finished(self, scene: Scene, *, region: tuple[int, int, int, int] | None = None) -> Frame:
        """The finished frame of a scene."""
        number = self.session.request(scene, region=region)
        frame = self.rest()
        assert self.session.problem is None, self.session.problem
        assert (frame.request, frame.finished) == (number, True)
        return frame


@contextmanager
def session_on(device: Device, pacing: Pacing | None = None) -> Iterator[Watch]:
    """A session that runs."""
    watch: list[Watch] = []
    session = Session(device, pacing or Pacing(), lambda: watch[0].woken())
    watch.append(Watch(session))
    session.start()
    try:
        yield watch[0]
    finally:
        assert session.close()


def planes(frame: Frame) -> list[dict[str, np.ndarray]]:
    """The channels of each view on a frame's canvas."""
    device = frame.canvas.device
    return [frame.canvas.read(device.transfers, number) for number in range(len(frame.canvas.parts))]


def framebuffers_of(frame: Frame) -> JobFramebuffers:
    """Framebuffers that hold what is on a frame's canvas."""
    framebuffers = JobFramebuffers(frame.job)
    for framebuffer, found in zip(framebuffers.framebuffers, planes(frame), strict=True):
        framebuffer.fill({name: found[name] for name in framebuffer})
    return framebuffers


def equal_pictures(first: Framebuffer, second: Framebuffer) -> None:
    """Asserts that the colours and depths of two framebuffers have the same bits."""
    for name in CHANNELS:
        if name in first.channels and name in second.channels:
            np.testing.assert_array_equal(first[name].view(np.uint32), second[name].view(np.uint32), name)


def shown_frame(device: Device, watch: Watch, frame: Frame, look: Look) -> tuple[Shown, np.ndarray]:
    """A frame as a display brings it to the window, by copying; and its pixels, shape (height, width, 4)."""
    display = Display(device, watch.session.pool, lambda: None, to_image=False)
    target = CopyTarget(device, frame.arrangement.size(look))
    try:
        assert display.show(frame, look, target)
        found: list[Shown | None] = [None]

        def arrived() -> bool:
            assert display.problem is None, display.problem
            found[0] = display.take()
            return found[0] is not None

        wait_for(arrived)
        shown = found[0]
        assert shown is not None
        assert target.pixels is not None
        return shown, target.pixels.copy()
    finally:
        display.close()


HALVES = "layout={columns: 2, gap: 3, views: [{}, {renderer: {type: cut_plane, samples: 3}}]}"

SCENES: dict[str, tuple[str, ...]] = {
    "mandelbulb": (),
    "hast": ("formula={name: hast, iterations: 12}",),
    "one sample": ("renderer.samples=1",),
    "adaptive": ("renderer={samples: 16, noise: 0.02, min_samples: 4}",),
    "float64": ("renderer.precision=float64",),
    "volume": ("renderer={type: volume, resolution: 24, samples: 3}", "coloring.by=solid"),
    "cut plane": ("renderer={type: cut_plane, samples: 5, plane: {width: 3, height: 2}}",),
    "layout": (HALVES,),
    "odd size": ("image.width=77", "image.height=41"),
    "pair": (STEREO, "stereo.mode=pair"),
    "anaglyph": (STEREO,),
    "squeezed": (STEREO, "stereo.mode=split_half"),
    "fitted": (STEREO, "stereo.fit=auto"),
    "layout and stereo": (HALVES, STEREO, "stereo.mode=rows"),
}


def shell(scene: Scene) -> clfractal.Framebuffer:
    """The shell's picture."""
    return clfractal.render(scene, channels=CHANNELS)


def turned(scene: Scene, step: float) -> Scene:
    camera = scene.camera.model_copy(update={"position": (2.8 * np.sin(step), -2.8 * np.cos(step), 0.6)})
    return scene.model_copy(update={"camera": camera})
