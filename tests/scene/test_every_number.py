"""Every number of the schema is a track of a film and a value of `--set`, or a message and the docs say why not."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import clfractal
from clfractal.errors import ClfractalError
from clfractal.scene.animation import Animation, Key, Track
from clfractal.scene.load import load_scene
from clfractal.scene.model import Scene
from clfractal.scene.tracks import target_of, value_under
from clfractal.schema.base import Section

# What no scene of the library has.
MORE = """\
version: 1
formula: {name: mandelbulb}
image: {width: 64, height: 64}
camera: {position: [0.4, -3, 0.2]}
materials:
  flat: {base: {color: [0.5, 0.4, 0.3], diffuse_roughness: {by: height, curve: [[0, 0.1], [1, 0.4]]}}}
  bright: {emission: {color: {by: iterations, palette: viridis}, luminance: {by: height, curve: [[0, 0], [1, 2]]}}}
objects:
  ball: {type: sphere, position: [1, 0, 0], radius: 0.1, material: flat}
  column: {type: cylinder, position: [-1, 0, 0], radius: 0.1, height: 1}
  cloud:
    {type: volume, file: grid.npy, position: [0, 2, 0], transfer: {opacity: [{at: 0, opacity: 0}, {at: 1, opacity: 1}]}}
  skin: {type: volume, file: grid.npy, position: [0, -2, 0], level: 0.5}
glow: {color: [1, 0.5, 0.1], trap: {shape: point}}
mist: {by: iterations, density: 3, start: 2, end: 8, colors: [{at: 0, color: [1, 0.5, 0.1]}, {at: 4, color: [0.1, 0.2, 1]}]}
stereo: {screen_width: 0.6, screen_distance: 0.6}
lighting: {mode: path}
"""
PLANE = """\
version: 1
formula: {name: mandelbulb, iterations: 5}
deep: {center: ["0.1", "0.2", "0.3"], magnification: 10}
image: {width: 64, height: 64}
camera: {position: [0, -3, 0]}
renderer: {type: cut_plane, plane: {corners: [[-1, -1, 0], [1, -1, 0], [-1, 1, 0]]}}
stereo: {screen_width: 0.6, screen_distance: 0.6, plane: {width: 2, height: 2}}
"""
VOLUME = """\
version: 1
formula: {name: mandelbulb, iterations: 5}
image: {width: 64, height: 64}
camera: {position: [0, -3, 0]}
renderer:
  type: volume
  resolution: 16
  transfer: {opacity: [{at: 0, opacity: 0}, {at: 1, opacity: 1}], emission: [{at: 0, emission: [1, 1, 1]}]}
"""
# Why a number does not move, as messages say it; each is in the documentation too.
REASONS = {
    "is the version of the file": "version",
    "is the same for all frames of a film": "the\npicture's size",
    "is a whole number, and decides how the picture is made": "whole numbers that say how a picture is made",
    "is null, and would be no number": "whole numbers that say how a picture is made",
    "says how files are written": "how files are written",
    "says how the others move": "`animation` itself",
    "does not change the picture": "bookmarks",
    "the lights on the set": "lights on the set",
}


def sections(root: type[Section]) -> Iterator[type[Section]]:
    """All sections of the schema that can stand in a scene: those that are not only what others are made of."""
    for cls in root.__subclasses__():
        yield from sections(cls)
        if not cls.__subclasses__():
            yield cls


def is_number(value: Any, annotation: str) -> bool:
    if value is None:
        return "float" in annotation or "int" in annotation
    if isinstance(value, tuple):
        return bool(value) and all(type(each) is float for each in value)
    return type(value) in (int, float)


def numbers(value: Any, path: tuple[str, ...] = ()) -> Iterator[tuple[tuple[str, str], tuple[str, ...]]]:
    """The numbers in a value: their section and key, and their path."""
    if isinstance(value, Section):
        for key, field in type(value).model_fields.items():
            below = value_under(value, key)
            if is_number(below, str(field.annotation)):
                yield (type(value).__name__, key), (*path, key)
            yield from numbers(below, (*path, key))
    elif isinstance(value, Mapping):
        for key, below in value.items():
            yield from numbers(below, (*path, str(key)))
    elif isinstance(value, tuple):
        for index, below in enumerate(value):
            yield from numbers(below, (*path, str(index)))


@pytest.fixture(scope="module")
def scenes(tmp_path_factory: pytest.TempPathFactory) -> list[Scene]:
    folder = tmp_path_factory.mktemp("scenes")
    np.save(folder / "grid.npy", np.linspace(0, 1, 512, dtype=np.float32).reshape(8, 8, 8))
    texts = {"more.yaml": MORE, "volume.yaml": VOLUME, "plane.yaml": PLANE}
    for name, text in texts.items():
        (folder / name).write_text(text)
    paths = [*(folder / name for name in texts), *sorted(Path("scenes").glob("*.yaml"))]
    return [load_scene(path, posed=False) for path in paths]


@pytest.fixture(scope="module")
def examples(scenes: list[Scene]) -> dict[tuple[str, str], tuple[Scene, tuple[str, ...]]]:
    """Each number of the schema once: the scene that has it, and where."""
    found: dict[tuple[str, str], tuple[Scene, tuple[str, ...]]] = {}
    for scene in scenes:
        for name, path in numbers(scene):
            found.setdefault(name, (scene, path))
    return found


def test_the_examples_have_every_section_with_numbers(
    examples: dict[tuple[str, str], tuple[Scene, tuple[str, ...]]],
) -> None:
    seen = {section for section, _ in examples}
    with_numbers = {
        cls.__name__
        for cls in sections(Section)
        if cls.__module__.startswith("clfractal.scene.")
        and any(
            is_number(None, str(field.annotation)) and "Literal" not in str(field.annotation)
            for field in cls.model_fields.values()
        )
    }
    assert with_numbers - seen == set()


def test_every_number_moves_or_a_message_says_why_not(
    examples: dict[tuple[str, str], tuple[Scene, tuple[str, ...]]],
) -> None:
    page = Path("docs/animation.md").read_text(encoding="utf-8")
    moved = 0
    for scene, path in examples.values():
        name = ".".join(path)
        why_not = _refusal(target_of, scene, name)
        if why_not is not None:
            reasons = [reason for reason in REASONS if reason in why_not]
            assert reasons, f"{name}: {why_not}"
            assert REASONS[reasons[0]] in page, reasons[0]
            continue
        target = target_of(scene, name)
        value = _at(scene, path)
        if value is None:
            continue
        # It stays what it is: so the film's first frame is the scene, but for its noise.
        key = Key(frame=0, value=value)
        films = Animation(frames=1, noise="fixed", tracks={name: Track(keys=(key,))})
        found = _at(clfractal.at_frame(scene.model_copy(update={"animation": films}), 0), path)
        if target.kind == "direction":  # its length has no meaning
            found, value = (np.array(each) / np.linalg.norm(each) for each in (found, value))
        assert found == pytest.approx(value, rel=1e-9, abs=1e-9), name
        assert target.path == path
        moved += 1
    assert moved > 150


def test_every_number_can_be_set(examples: dict[tuple[str, str], tuple[Scene, tuple[str, ...]]]) -> None:
    for scene, path in examples.values():
        value = _at(scene, path)
        listed = list(value) if isinstance(value, tuple) else value
        text = "null" if value is None else repr(listed)
        if path[0] == "animation" and path[1:2] == ("tracks",):
            continue  # names of tracks have dots: they are set as a whole, which tests of the command line do
        override = f"{'.'.join(path)}={text}"
        why_not = _refusal(load_scene, _file(scene), overrides=[override], posed=False)
        if why_not is not None:
            # What else the scene gives may speak against it, but never that there is no such key.
            assert "unknown" not in why_not, f"{override}: {why_not}"
            continue
        loaded = load_scene(_file(scene), overrides=[override], posed=False)
        found = _at(loaded, path)
        assert found == pytest.approx(value) if value is not None else found is None, path


def _refusal(make: Callable[..., object], *arguments: Any, **options: Any) -> str | None:
    try:
        make(*arguments, **options)
    except ClfractalError as error:
        return error.message
    return None


def _at(value: Any, path: tuple[str, ...]) -> Any:
    for part in path:
        if isinstance(value, Section):
            value = value_under(value, part)
        else:
            value = value[int(part)] if isinstance(value, tuple) else value.get(part)
    return value


def _file(scene: Scene) -> Path:
    assert scene.files
    return scene.files[0]
