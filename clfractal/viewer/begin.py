"""What comes before the window: everything that can be wrong on the command line, then the display.

PyOpenGL decides where to look for functions when it is imported. So this module imports nothing that imports it, and
`app` is imported when the display is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from clfractal.device.select import Device, choose
from clfractal.files.atomic import check_output
from clfractal.files.inputs import noting, refuse_overwriting
from clfractal.scene.model import Scene
from clfractal.viewer import window
from clfractal.viewer.files import Files
from clfractal.viewer.freed_memory import give_memory_back
from clfractal.viewer.recording import Recording, read_recording
from clfractal.viewer.sources import same_file
from clfractal.viewer.window_options import Options


@dataclass(frozen=True, slots=True)
class Begun:
    """What a window begins with.

    Attributes:
        scene: the first one.
        device: that was chosen; the window makes a context of its own.
        recording: events to play; None: none.
    """

    options: Options
    files: Files
    scene: Scene
    device: Device
    recording: Recording | None

    @property
    def size(self) -> tuple[int, int]:
        """Of the window, screen coordinates: as asked for, as it was recorded, or the usual one."""
        recorded = self.recording.size if self.recording is not None else (1280, 720)
        return self.options.size or recorded


def begin(options: Options) -> Begun:
    """Checks the options, reads what they name, and connects to the display.

    Raises:
        ClfractalError: a wrong option or scene, or a file that cannot be read or written: status 2.
        DeviceError: no device; no display (status 3).
    """
    give_memory_back()
    files = Files(options)
    with noting() as played:
        recording = read_recording(options.play) if options.play is not None else None
    if options.record is not None:
        check_output(options.record, (options.record.suffix.lower(),))
    scene = files.first_scene()
    _check_files(options, [*played, *scene.files])
    device = choose(options.device)
    window.start()
    return Begun(options, files, scene, device, recording)


def _check_files(options: Options, read: Sequence[Path]) -> None:
    """Raises FileError if a file that is written is one that is read, or another one that is written."""
    written = [path for path in (options.shot, options.record, options.save) if path is not None]
    own = (
        options.save is not None
        and options.scene is not None
        and same_file(options.save, Path(options.scene))
    )
    # A scene may be saved over itself, as Ctrl+S does without the option.
    others = [path for path in written if path is not options.save] if own else written
    refuse_overwriting(others, read)
    refuse_overwriting(written)
