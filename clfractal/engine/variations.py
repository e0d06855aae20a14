"""Variations of a scene to choose from: other formula parameters, another point of view, other colours.

Settings that only tune the search for the surface, or decide how finely it is sampled, are never changed.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from random import Random
from typing import TYPE_CHECKING, Any, get_args

import numpy as np

from clfractal.engine.any_engine import SceneLike
from clfractal.engine.quality import with_renderers
from clfractal.engine.varied import AMOUNT, Kind, Step, Strength, changed
from clfractal.engine.vary_camera import camera_step, closeness, following_step
from clfractal.engine.vary_colors import colors_step
from clfractal.engine.vary_formula import expanded, formula_step
from clfractal.errors import ClfractalError, SceneError, Where, arguments, unknown_name
from clfractal.formulas import reference
from clfractal.scene.load import as_scene, check_scene
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer

if TYPE_CHECKING:
    from clfractal.images.framebuffer import Framebuffer

KINDS: tuple[Kind, ...] = get_args(Kind)
STRENGTHS: tuple[Strength, ...] = get_args(Strength)

MOST = 100_000
"""Most variations of one call."""

PREVIEW_SIZE = (96, 54)
"""Pixels of a picture that is large enough for `worthwhile`."""

# How often a kind is part of a variation, of how many draws the one most unlike the earlier variations is taken, and
# after how many draws without a new one there are no more.
_PART_OF: Mapping[Kind, float] = {"formula": 0.9, "camera": 0.65, "colors": 0.75}
_DRAWS = 4
_PATIENCE = 60
# Least part of a picture that is covered, and least spread of its lightness, 0 to 255, where it is.
_LEAST_COVERED, _LEAST_SPREAD = 0.03, 8.0
_PREVIEW_RESOLUTION = 96
_PREVIEW_SAMPLES = 4


@dataclass(frozen=True, slots=True)
class Variation:
    """A scene like another one.

    Attributes:
        scene: it has been checked as a loaded scene.
        changes: its new values as plain data, by dotted path, such as `camera.fov`; a chain of the library that got new
            parameters stands under `formula.inline`.
        remark: what is different, in a few words.
    """

    scene: Scene
    changes: Mapping[str, Any]
    remark: str


def variations(
    scene: SceneLike,
    *,
    count: int = 12,
    strength: Strength = "medium",
    seed: int = 0,
    kinds: Collection[Kind] = KINDS,
    locked: Collection[str] = (),
) -> list[Variation]:
    """Variations of a scene, all different; the same ones for equal arguments, and the first ones of any larger count.

    What changes: parameters of the formula (within their ranges, whole ones stay whole) and the constant of a Julia set;
    the camera round its target, its distance and angle of view, or the plane of a cut_plane renderer; colours of
    material, palettes, lights and background, and where light comes from. Where the bounds of the set grow with a
    parameter, the camera follows.

    Args:
        scene: a scene, or what `load_scene` takes.
        strength: `slight` ones are close relatives, `heavy` ones bold.
        kinds: what may change: `formula`, `camera`, `colors`.
        locked: dotted paths of values or sections that stay, such as `camera` or `formula.parameters.power`.

    Returns:
        `count` variations, or fewer if there are no more.

    Raises:
        SceneError: an unknown strength or kind, a count below 1, or nothing that could change.
    """
    count = arguments.whole("count", count, 1, MOST)
    found = list(islice(candidates(scene, strength=strength, seed=seed, kinds=kinds, locked=locked), count))
    if not found:
        raise nothing_to_vary(kinds)
    return found


def nothing_to_vary(kinds: Collection[Kind]) -> SceneError:
    """The error for a scene without variations of these kinds."""
    return SceneError(f"nothing can be varied: the scene has no {' or '.join(kinds)} that may change")


def candidates(
    scene: SceneLike,
    *,
    strength: Strength = "medium",
    seed: int = 0,
    kinds: Collection[Kind] = KINDS,
    locked: Collection[str] = (),
) -> Iterator[Variation]:
    """As `variations`, one after the other without an end, for callers that look at pictures and leave some out.

    Each is chosen to be unlike those before. It ends where no more different ones are found.

    Raises:
        SceneError: an unknown strength or kind.
    """
    scene = as_scene(scene)
    arguments.word("strength", strength, STRENGTHS)
    if scene.animation is not None and scene.animation.frame is not None:
        # Of that frame as it is: tracks would take back what is varied.
        scene = scene.model_copy(update={"animation": None})
    seed = arguments.whole("seed", seed, -(2**63), 2**63 - 1)
    for kind in arguments.words("kinds", kinds):
        if kind not in KINDS:
            raise SceneError(unknown_name("kind", kind, KINDS), Where(path="kinds"))
    arguments.words("locked", locked)
    wanted = [kind for kind in KINDS if kind in kinds]
    return _drawn(expanded(scene) if "formula" in wanted else scene, AMOUNT[strength], seed, wanted, locked)


def _drawn(
    scene: Scene, amount: float, seed: int, kinds: Sequence[Kind], locked: Collection[str]
) -> Iterator[Variation]:
    rng = Random(seed)
    taken: list[dict[str, float]] = [{}]  # the scene itself
    known: set[str] = set()
    while True:
        best: tuple[float, Step, Scene] | None = None
        valid = tried = 0
        while valid < _DRAWS and tried < _PATIENCE:
            tried += 1
            step = _step(scene, rng, amount, kinds, locked)
            varied = _applied(scene, step) if step is not None and repr(step.changes) not in known else None
            if step is None or varied is None:
                continue
            valid += 1
            unlike = min(_distance(step.sizes, other) for other in taken)
            if best is None or unlike > best[0]:
                best = (unlike, step, varied)
        if best is None:
            return
        _, step, varied = best
        taken.append(step.sizes)
        known.add(repr(step.changes))
        yield Variation(varied, step.changes, ", ".join(step.remarks))


def _step(
    scene: Scene, rng: Random, amount: float, kinds: Sequence[Kind], locked: Collection[str]
) -> Step | None:
    """Draws a step; None if it changes nothing, or the set too much for the view to follow."""
    chosen = (
        [kind for kind in kinds if rng.random() < _PART_OF[kind]] or [rng.choice(list(kinds))]
        if kinds
        else []
    )
    step, seen = Step(), scene
    if "formula" in chosen:
        step = formula_step(scene, rng, amount, closeness=closeness(scene), locked=locked)
        try:
            moved = changed(scene, step.changes) if step.changes else scene
            following = following_step(scene, moved, locked)
        except ClfractalError:
            return None  # values that give the formula no meaning
        if following is None:
            return None
        seen = changed(scene, following.changes) if following.changes else scene
        step.changes |= following.changes
    if "camera" in chosen:
        step.add(camera_step(seen, rng, amount, locked=locked))
    if "colors" in chosen:
        step.add(colors_step(seen, rng, amount, locked=locked))
    return step if step.sizes else None


def _applied(scene: Scene, step: Step) -> Scene | None:
    """The scene after a step; None if a check refuses it, or the camera is inside the set."""
    try:
        varied = changed(scene, step.changes)
        check_scene(varied)
    except ClfractalError:
        return None
    return None if varied == scene or _is_buried(varied) else varied


def _is_buried(scene: Scene) -> bool:
    """Whether the camera is inside the solid that a surface renderer shows."""
    if not isinstance(scene.renderer, SurfaceRenderer) or scene.layout is not None:
        return False
    place = np.array([scene.camera.position], dtype=float)
    if np.linalg.norm(place - np.array(scene.chain.center)) > scene.chain.radius:
        return False
    return bool(reference.distance(scene.chain, place, min(scene.formula.iterations, 2000))[0][0] <= 0)


def _distance(one: Mapping[str, float], other: Mapping[str, float]) -> float:
    """How far apart two steps end, over everything that either of them changes."""
    return float(sum((one.get(name, 0.0) - other.get(name, 0.0)) ** 2 for name in {*one, *other}) ** 0.5)


def small_scene(scene: Scene, width: int, height: int) -> Scene:
    """The scene as a small picture shows it: a still for one eye, with few samples, and a coarse grid."""
    # (Tracks may move what is no more there, such as the distance of the eyes.)
    updates: dict[str, Any] = {
        "image": scene.image.resized(width, height),
        "stereo": None,
        "animation": None,
        **with_renderers(scene, lambda renderer, _: _coarse(renderer)),
    }
    return scene.model_copy(update=updates)


def _coarse(renderer: Any) -> Any:
    update: dict[str, Any] = {
        "samples": min(renderer.samples, _PREVIEW_SAMPLES),
        "noise": None,
        "min_samples": None,
    }
    if isinstance(renderer, VolumeRenderer) and renderer.file is None:
        sides = renderer.resolution
        largest = max(sides) if isinstance(sides, tuple) else sides
        shrink = min(1.0, _PREVIEW_RESOLUTION / largest)
        update["resolution"] = (
            tuple(max(2, round(side * shrink)) for side in sides)
            if isinstance(sides, tuple)
            else max(2, round(sides * shrink))
        )
    return renderer.model_copy(update=update)


def worthwhile(framebuffer: Framebuffer) -> bool:
    """Whether a small picture shows something: neither nothing, nor the flat inside of a solid, nor darkness.

    Args:
        framebuffer: with R, G, B, and A if what is covered shall count; `PREVIEW_SIZE` is large enough.
    """
    code = framebuffer.to_rgb8().astype(np.float64)
    lightness = code @ np.array([0.2126, 0.7152, 0.0722])
    covered = framebuffer["A"] > 0.5 if "A" in framebuffer else np.ones(lightness.shape, bool)
    if covered.mean() < _LEAST_COVERED:
        return False
    return float(lightness[covered].std()) >= _LEAST_SPREAD
