"""`clfractal vary`: variations of a scene as scene files, each with a small picture, to choose from."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias, cast

import numpy as np
import numpy.typing as npt

from clfractal.cli.pipes import piped, refuse_stream
from clfractal.cli.render import Order, ordered_scene
from clfractal.cli.shell import Shell
from clfractal.engine.variations import (
    KINDS,
    PREVIEW_SIZE,
    STRENGTHS,
    Variation,
    candidates,
    nothing_to_vary,
    small_scene,
    worthwhile,
)
from clfractal.engine.varied import Kind, Strength
from clfractal.errors import FileError, SceneError, Where, speaking_of, unknown_name
from clfractal.files.atomic import atomic_writer, check_output, naming
from clfractal.files.document import write_document
from clfractal.files.inputs import refuse_overwriting
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.named_files import rename_files

if TYPE_CHECKING:
    from clfractal.engine.engine import Engine

Pixels: TypeAlias = npt.NDArray[np.uint8]

MOST_VARIATIONS = 999
_CHANNELS = ("R", "G", "B", "A")
# Pixels along a picture's longer side, if no size is given.
_LONGER_SIDE = 320
# So many variations may show nothing before the search for others ends, for each one that is wanted.
_EMPTY_PER_WANTED = 6


@dataclass(frozen=True, slots=True)
class Choice:
    """The options of `clfractal vary` beside those of a render; `order.size` is that of the small pictures.

    `output` is a folder for scenes and their pictures; or a picture, a sheet of all of them, with the scenes beside it.
    """

    output: Path = Path()
    count: int = 12
    strength: str = "medium"
    seed: int = 0
    sheet: Path | None = None
    only: str | None = None

    @property
    def is_sheet(self) -> bool:
        """Whether the output is a picture of all variations."""
        return bool(self.output.suffix) and not self.output.is_dir()

    @property
    def folder(self) -> Path:
        """Where the scenes go."""
        return self.output.parent if self.is_sheet else self.output

    @property
    def sheets(self) -> tuple[Path, ...]:
        """The pictures of all variations that are wanted."""
        wanted = (self.output if self.is_sheet else None, self.sheet)
        return tuple(path for path in wanted if path is not None)


def vary_scene(order: Order, choice: Choice, shell: Shell) -> None:
    """Writes variations of a scene to NAME-01.yaml, NAME-02.yaml, ...: with a sheet of all, or a picture each.

    Variations whose picture would show nothing are left out. All files appear complete or not at all; files that exist are
    never replaced. Pairs that are complete stay if a later one fails.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; no variation shows anything.
    """
    refuse_stream(choice.output, "variations are several files; name a folder, or a file for the sheet")
    refuse_stream(choice.sheet, "the sheet needs a file")
    with piped(shell, order.scene, ()) as files:
        _vary(replace(order, scene=files.source, folder=files.folder), choice, shell)


def _vary(order: Order, choice: Choice, shell: Shell) -> None:
    begun = time.perf_counter()
    kinds = _checked(choice)
    sized = ordered_scene(order)
    # The scene files keep the scene's own size: the option is for the small pictures.
    scene = load_scene(Path(order.scene), overrides=order.overrides, folder=order.folder)
    size = (sized.image.width, sized.image.height) if order.size is not None else _small(scene)
    stem = Path(order.scene).stem
    digits = max(2, len(str(choice.count)))
    names = [f"{stem}-{number:0{digits}d}" for number in range(1, choice.count + 1)]
    to_folder = _Moved(Path(order.scene), scene, choice.folder)
    drawn: Iterator[Variation] = candidates(
        scene, strength=cast(Strength, choice.strength), seed=choice.seed, kinds=kinds
    )
    with speaking_of(order.scene):
        first = next(drawn, None)
        if first is None:
            raise nothing_to_vary(kinds)
    drawn = chain([first], drawn)
    _check_files(scene, choice, names)
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine.engine import Engine
    from clfractal.images.sheet import sheet_of

    pictures: list[Pixels] = []
    with Engine(order.device, tell=shell.say) as engine, speaking_of(order.scene):
        shell.state = lambda: (
            f"clfractal: interrupted with {len(pictures)} of {choice.count} variations written"
        )
        for name, variation in zip(names, _worthwhile(scene, drawn, choice.count, engine), strict=False):
            framebuffer = engine.render(small_scene(variation.scene, *size), channels=_CHANNELS)
            text = write_document(to_folder.plain(variation.scene))
            if not choice.is_sheet:
                # The picture holds the variation itself, rather than what made the picture small and quick.
                framebuffer.tell("scene", text)
                framebuffer.save(choice.folder / f"{name}.png")
            path = choice.folder / f"{name}.yaml"
            with atomic_writer(path) as beside:
                beside.write_bytes((_heading(order, choice, len(pictures) + 1, variation) + text).encode())
            pictures.append(framebuffer.to_rgb8())
            shell.say(f"{path}: {variation.remark}")
    if not pictures:
        raise SceneError("no variation shows anything", Where(order.scene))
    for sheet in choice.sheets:
        sheet_of(pictures, [str(number) for number in range(1, len(pictures) + 1)]).save(sheet)
        shell.say(f"{sheet}: {len(pictures)} pictures, each with its number")
    shell.state = lambda: "clfractal: interrupted"
    few = f" (no more of {choice.count} show anything)" if len(pictures) < choice.count else ""
    shell.say(f"{len(pictures)} variations{few}: {time.perf_counter() - begun:.2f} s")


def _checked(choice: Choice) -> Sequence[Kind]:
    """The kinds of change that are wanted; mistakes in the options are raised with the option's name."""
    if not 1 <= choice.count <= MOST_VARIATIONS:
        raise SceneError(f"must be from 1 to {MOST_VARIATIONS}, got {choice.count}", Where("--count"))
    if choice.strength not in STRENGTHS:
        raise SceneError(unknown_name("strength", choice.strength, STRENGTHS), Where("--strength"))
    words = [word.strip() for word in choice.only.split(",")] if choice.only is not None else list(KINDS)
    for word in words:
        if word not in KINDS:
            raise SceneError(unknown_name("kind", word, KINDS), Where("--only"))
    return cast(Sequence[Kind], words)


def _small(scene: Scene) -> tuple[int, int]:
    """The size of a small picture with the scene's proportions, pixels."""
    width, height = scene.image.width, scene.image.height
    shrink = _LONGER_SIDE / max(width, height)
    return max(1, round(width * shrink)), max(1, round(height * shrink))


def _check_files(scene: Scene, choice: Choice, names: Sequence[str]) -> None:
    """Makes the folder if it is missing, and refuses files that exist, before anything is rendered."""
    from clfractal.images.formats import check_output as check_picture

    suffixes = (".yaml",) if choice.is_sheet else (".yaml", ".png")
    files = [choice.folder / f"{name}{suffix}" for name in names for suffix in suffixes]
    for file in (*choice.sheets, *files):
        if file.exists() or file.is_symlink():
            other = "name" if file in choice.sheets else "folder with -o"
            raise FileError(f"exists already and is not replaced; choose another {other}", Where(str(file)))
    for sheet in choice.sheets:
        check_picture(sheet)
    with naming(choice.folder, "cannot be made"):
        choice.folder.mkdir(exist_ok=True)
    check_output(files[0], (".yaml",))
    refuse_overwriting([*files, *choice.sheets], scene.files)


def _worthwhile(scene: Scene, drawn: Iterator[Variation], count: int, engine: Engine) -> Iterator[Variation]:
    """Those variations of which a very small picture shows something; all, if even the scene's own shows nothing."""

    def shows(each: Scene) -> bool:
        return worthwhile(engine.render(small_scene(each, *PREVIEW_SIZE), samples=1, channels=_CHANNELS))

    if not shows(scene):
        yield from drawn
        return
    empty = 0
    for variation in drawn:
        if shows(variation.scene):
            yield variation
            continue
        empty += 1
        if empty >= _EMPTY_PER_WANTED * count:
            return


def _heading(order: Order, choice: Choice, number: int, variation: Variation) -> str:
    name = Path(order.scene).name
    lines = [
        f"Variation {number} of {name} ({choice.strength}, seed {choice.seed})",
        f"{variation.remark}",
    ]
    return "".join(f"# {line if line.isprintable() else ascii(line)}\n" for line in lines)


class _Moved:
    """Scene files for another folder: files that the scene names are named from there.

    Raises:
        FileError: a file is not in that folder or below, where the variation could not use it.
    """

    def __init__(self, source: Path, scene: Scene, folder: Path) -> None:
        self.source, self.base, self.folder = source, scene.folder, folder
        self._renamed(scene.resolved())

    def plain(self, scene: Scene) -> dict[str, Any]:
        """The keys that were given or changed; they load to an equal scene."""
        given = scene.model_dump(mode="json", exclude_unset=True)
        given["formula"] = scene.formula.mapping()
        short = {name: value for name, value in given.items() if value not in (None, {}) or name == "formula"}
        plainest = Scene.model_validate({"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}})
        for name in ("lights", "cut_planes"):
            if getattr(scene, name) == getattr(plainest, name):
                short.pop(name, None)
        self._renamed(short)
        return short

    def _renamed(self, data: dict[str, Any]) -> None:
        layout = data.get("layout") or {}
        for part in (data, *layout.get("views", ())):
            for name in ("environment", "renderer", "lights"):
                rename_files(part.get(name), self._from_there)
            for name in ("materials", "objects"):  # whose names are the user's
                rename_files(list((part.get(name) or {}).values()), self._from_there)

    def _from_there(self, file: str) -> str:
        whole = (self.base / file).resolve()
        try:
            return whole.relative_to(self.folder.resolve()).as_posix()
        except ValueError:
            raise FileError(
                f"uses {file[:80]!r}, which must lie in the variations' folder or below; write them to {self.base} with -o",
                Where(str(self.source)),
            ) from None
