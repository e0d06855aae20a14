"""`clfractal scenes`: the scenes that come with the program, as lines, as text, or as small pictures."""

from __future__ import annotations

import re
import time
from collections.abc import Sequence
from pathlib import Path

from clfractal.cli.pipes import refuse_stream
from clfractal.cli.shell import Shell
from clfractal.errors import SceneError, Where, speaking_of, unknown_name
from clfractal.files import resources
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.load import load_scene, read_text

_WIDTH = 110
_CHANNELS = ("R", "G", "B")


def scene_files() -> dict[str, Path]:
    """The files of all scenes that come with the program, by their names."""
    return {path.stem: path for path in sorted(resources.folder("scenes").glob("*.yaml"))}


def list_scenes() -> str:
    """A line for each scene: its name, its title, and how its description begins."""
    files = scene_files()
    column = max(map(len, files)) + 2
    return "\n".join(f"{name:{column}}{_line(path, _WIDTH - column)}" for name, path in files.items())


def tell_scene(name: str) -> str:
    """The text of one scene.

    Raises:
        SceneError: there is none of that name.
    """
    return read_text(_file_of(name))


def draw_sheet(names: Sequence[str], sheet: Path, device: str | None, shell: Shell) -> None:
    """Writes one picture with small pictures of scenes, of all if no names are given.

    Small pictures are kept in the cache, also if the course is interrupted: the next one goes on where it was.

    Raises:
        ClfractalError: there is no such scene or device, or the sheet cannot be written.
    """
    begun = time.perf_counter()
    refuse_stream(sheet, "name a file for the sheet")
    files = {name: _file_of(name) for name in names} if names else scene_files()
    from clfractal.images.formats import check_output

    check_output(sheet)
    refuse_overwriting([sheet], files.values())
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine import thumbnails
    from clfractal.engine.engine import Engine
    from clfractal.images.sheet import sheet_of

    pictures: list[thumbnails.Pixels] = []
    shell.state = lambda: (
        f"clfractal: interrupted with {len(pictures)} of {len(files)} small pictures done; they are kept"
    )
    with Engine(device, tell=shell.say) as engine:
        for number, (name, path) in enumerate(files.items(), start=1):
            scene = thumbnails.shown_scene(load_scene(path))
            key = thumbnails.key_of(scene, engine.device.info.key)
            found = thumbnails.load(key)
            if found is None:
                shell.say(f"{name}: {number} of {len(files)}")
                with speaking_of(str(path)):
                    found = engine.render(scene, channels=_CHANNELS).to_rgb8()
                thumbnails.store(key, found)
            pictures.append(found)
    sheet_of(pictures, list(files)).save(sheet)
    shell.state = lambda: "clfractal: interrupted"
    shell.say(f"{sheet}: {len(pictures)} scenes, {time.perf_counter() - begun:.2f} s")


def _file_of(name: str) -> Path:
    files = scene_files()
    if name not in files:
        raise SceneError(unknown_name("scene", name, list(files)), Where("clfractal scenes"))
    return files[name]


def _line(path: Path, width: int) -> str:
    from clfractal.engine.thumbnails import words_of

    title, about = words_of(read_text(path))
    # Its first sentence, as far as there is room.
    sentence = re.split(r"(?<=\.)\s", about, maxsplit=1)[0]
    text = f"{title.rstrip('.')}. {sentence}".strip()
    return text if len(text) <= width else text[: width - 1].rsplit(" ", 1)[0].rstrip(",;:(") + " …"
