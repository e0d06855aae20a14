"""`clfractal vary`: variations of a scene as scene files, each with a small picture, to choose from."""

from __future__ import annotations

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, cast

from clfractal.cli.pipes import piped
from clfractal.cli.proposals import CHANNELS, Moved, Pixels, Proposals, small_size
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
from clfractal.errors import SceneError, Where, speaking_of, unknown_name
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene

if TYPE_CHECKING:
    from clfractal.engine.engine import Engine

MOST_VARIATIONS = 999
# So many variations may show nothing before the search for others ends, for each one that is wanted.
_EMPTY_PER_WANTED = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice(Proposals):
    """The options of `clfractal vary` beside those of a render; `order.size` is that of the small pictures."""

    strength: str = "medium"
    seed: int = 0
    only: str | None = None


def vary_scene(order: Order, choice: Choice, shell: Shell) -> None:
    """Writes variations of a scene to NAME-01.yaml, NAME-02.yaml, ...: with a sheet of all, or a picture each.

    Variations whose picture would show nothing are left out. All files appear complete or not at all; files that exist are
    never replaced. Pairs that are complete stay if a later one fails.

    Raises:
        ClfractalError: anything wrong with the input, the files or the device; no variation shows anything.
    """
    choice.check("variations", MOST_VARIATIONS)
    with piped(shell, order.scene, ()) as files:
        _vary(replace(order, scene=files.source, folder=files.folder), choice, shell)


def _vary(order: Order, choice: Choice, shell: Shell) -> None:
    begun = time.perf_counter()
    kinds = _checked(choice)
    sized = ordered_scene(order)
    # The scene files keep the scene's own size: the option is for the small pictures.
    scene = load_scene(Path(order.scene), overrides=order.overrides, folder=order.folder)
    size = (sized.image.width, sized.image.height) if order.size is not None else small_size(scene)
    names = choice.names(Path(order.scene))
    to_folder = Moved(Path(order.scene), scene, choice.folder, "variations")
    drawn: Iterator[Variation] = candidates(
        scene, strength=cast(Strength, choice.strength), seed=choice.seed, kinds=kinds
    )
    with speaking_of(order.scene):
        first = next(drawn, None)
        if first is None:
            raise nothing_to_vary(kinds)
    drawn = chain([first], drawn)
    choice.check_files(scene, names)
    # Imported only now: mistakes in the input are reported without waiting for OpenCL.
    from clfractal.engine.engine import Engine

    pictures: list[Pixels] = []
    with choice.folder_made(), Engine(order.device, tell=shell.say) as engine, speaking_of(order.scene):
        shell.state = lambda: (
            f"clfractal: interrupted with {len(pictures)} of {choice.count} variations written"
        )
        for name, variation in zip(names, _worthwhile(scene, drawn, choice.count, engine), strict=False):
            framebuffer = engine.render(small_scene(variation.scene, *size), channels=CHANNELS)
            heading = (
                f"Variation {len(pictures) + 1} of {Path(order.scene).name} ({choice.strength}, seed {choice.seed})",
                variation.remark,
            )
            path = choice.write(name, to_folder.text(variation.scene), heading, framebuffer)
            pictures.append(framebuffer.to_rgb8())
            shell.say(f"{path}: {variation.remark}")
    if not pictures:
        raise SceneError("no variation shows anything", Where(order.scene))
    for line in choice.save_sheets(pictures):
        shell.say(line)
    shell.state = lambda: "clfractal: interrupted"
    few = f" (no more of {choice.count} show anything)" if len(pictures) < choice.count else ""
    shell.say(f"{len(pictures)} variations{few}: {time.perf_counter() - begun:.2f} s")


def _checked(choice: Choice) -> Sequence[Kind]:
    """The kinds of change that are wanted; mistakes in the options are raised with the option's name."""
    if choice.strength not in STRENGTHS:
        raise SceneError(unknown_name("strength", choice.strength, STRENGTHS), Where("--strength"))
    words = [word.strip() for word in choice.only.split(",")] if choice.only is not None else list(KINDS)
    for word in words:
        if word not in KINDS:
            raise SceneError(unknown_name("kind", word, KINDS), Where("--only"))
    return cast(Sequence[Kind], words)


def _worthwhile(scene: Scene, drawn: Iterator[Variation], count: int, engine: Engine) -> Iterator[Variation]:
    """Those variations of which a very small picture shows something; all, if even the scene's own shows nothing."""

    def shows(each: Scene) -> bool:
        return worthwhile(engine.render(small_scene(each, *PREVIEW_SIZE), samples=1, channels=CHANNELS))

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
