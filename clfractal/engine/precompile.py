"""Compiles programs before a picture waits for them: those of scenes, or of the whole library."""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Future, wait
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from clfractal.device import children, program
from clfractal.device.cancel import CancelToken
from clfractal.device.select import Device, is_simulator
from clfractal.device.threads import ending_together
from clfractal.engine.canvas import CanvasKernels
from clfractal.engine.carry import Carrier
from clfractal.engine.drawing import Drawing, OutputBuffers, Wanted
from clfractal.engine.job import Job
from clfractal.engine.local_executor import LocalExecutor
from clfractal.engine.prepare import prepare
from clfractal.engine.show import Shower
from clfractal.engine.thumbnails import shown_scene
from clfractal.formulas import catalog
from clfractal.integrators.kept import Resources
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer

_LOOK_SECONDS = 0.05
_OPACITY = [{"at": 0, "opacity": 0}, {"at": 9, "opacity": 1}]
# Of a volume each kind of values has programs that ask the formula. (Those of other than gradient normals take longest to
# compile, and are left to the scenes that have them.)
_KINDS: tuple[dict[str, object], ...] = (
    {},
    {"renderer": {"type": "cut_plane"}},
    {"renderer": {"type": "volume", "value": "inside"}},
    {"renderer": {"type": "volume", "value": "coverage"}},
    {
        "renderer": {"type": "volume", "value": "iterations", "transfer": {"opacity": _OPACITY}},
        "lighting": {"mode": "path"},
    },
)


@dataclass(frozen=True, slots=True)
class Compiled:
    """What was done: how many programs there are, how many were compiled, and how many the cache does not keep."""

    programs: int
    compiled: int
    unkept: int


class Precompilation:
    """Programs to compile for one device.

    Args:
        device: where they are to run.
        scenes: their scenes, read one by one.
        precision: a number type in the place of the scenes'.
        read: called with the number of scenes that were read.
        on_start: told a line if the device is measured first.

    Raises:
        SceneError: a number type that is none, or that the device lacks.
        DeviceError: no kernel works on the device.
    """

    def __init__(
        self,
        device: Device,
        scenes: Iterable[Scene],
        *,
        precision: str | None = None,
        read: Callable[[int], None] = lambda count: None,
        on_start: Callable[[str], None] | None = None,
    ) -> None:
        self.device = device
        self._wanted: dict[tuple[str, tuple[str, ...]], Wanted] = {}
        self._volumes: list[Job] = []
        drawing, resources = Drawing(device, OutputBuffers(device)), Resources(device)
        for number, scene in enumerate(scenes):
            read(number)
            job = prepare(scene, device, precision=precision, measures=True, on_start=on_start)
            if any(isinstance(view.scene.renderer, VolumeRenderer) for view in job.views):
                self._volumes.append(prepare(shown_scene(scene), device, precision=precision))
                continue
            for view in job.views:
                for each in drawing.wanted(view, resources):
                    self._wanted.setdefault((each.text.flat.text, each.flags), each)

    @property
    def steps(self) -> int:
        """How many steps `run` has: programs, grids, and the three programs of a window."""
        return len(self._wanted) + len(self._volumes) + 3

    def run(self, progress: Callable[[int], None]) -> Compiled:
        """Compiles what the cache lacks, side by side.

        Args:
            progress: called with the number of steps that are done, some times a second.

        Raises:
            KernelBuildError: a program does not compile.
            DeviceError: the driver failed.
        """
        done = compiled = 0
        wanted = sorted(self._wanted.values(), key=lambda each: -len(each.text.flat.text))
        with ending_together(children.processors()) as (pool, ended):
            # Those of a window and of volumes build their own programs, which are not counted.
            works: list[Callable[[], object]] = [
                *(partial(make, self.device) for make in (CanvasKernels, Shower, Carrier)),
                *(partial(self._fill, job, ended) for job in self._volumes),
                *(partial(self._build, each, ended) for each in wanted),
            ]
            # Oclgrind's checks of memory are lost with the thread that they began in.
            if is_simulator(self.device.info):
                for done, work in enumerate(works):
                    progress(done)
                    compiled += work() is True
                return Compiled(len(wanted), compiled, self._unkept())
            waiting: set[Future[object]] = {pool.submit(work) for work in works}
            while waiting:
                finished, waiting = wait(waiting, timeout=_LOOK_SECONDS, return_when=FIRST_COMPLETED)
                compiled += sum(each.result() is True for each in finished)
                done += len(finished)
                progress(done)
        return Compiled(len(wanted), compiled, self._unkept())

    def _build(self, wanted: Wanted, ended: CancelToken) -> bool:
        """Compiles a program if the cache lacks it, and says whether it did."""
        if self._is_kept(wanted):
            return False
        text = wanted.text.flat
        program.build(
            self.device,
            text.text,
            flags=wanted.flags,
            sources=text.sources,
            warm=wanted.warm,
            stopped=ended,
            what=wanted.text.name,
        )
        return True

    def _fill(self, job: Job, ended: CancelToken) -> None:
        """Fills a grid for its programs: one that fills at once."""
        LocalExecutor(self.device).make_ready(job, ended)

    def _is_kept(self, wanted: Wanted) -> bool:
        return program.is_kept(self.device, wanted.text.flat.text, flags=wanted.flags, warm=wanted.warm)

    def _unkept(self) -> int:
        return sum(not self._is_kept(each) for each in self._wanted.values())


def library_count(files: Collection[Path]) -> int:
    """How many scenes `library_scenes` gives."""
    return len(catalog.names()) * len(_KINDS) + len(files)


def library_scenes(files: Iterable[Path]) -> Iterator[Scene]:
    """Plain scenes of each formula of the library, one of each kind, and the scenes of files."""
    for name in catalog.names():
        for kind in _KINDS:
            yield load_scene({"version": 1, "formula": {"name": name}, "camera": {}, **kind})
    for file in files:
        yield load_scene(file)
