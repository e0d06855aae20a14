"""Every program with its features, and a part that has every pair of them."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from clfractal.device.source import FlatText
from clfractal.device.structs import Precision
from clfractal.formulas import catalog
from clfractal.formulas.opencl import write_formula
from clfractal.geometry.solids import Body
from clfractal.integrators import points, surface, trial
from clfractal.scene.load import load_scene
from tests.features import APART, FEATURES, OF_MEDIA, put_together
from tests.gpu.pairs import covering
from tests.platforms import programs
from tests.portability.pictures import FOLDER

PRECISIONS: tuple[Precision, ...] = ("float32", "float64")
# Programs that know no formula: one text for all scenes, so their names have no features.
_ALIKE = {each.name for each in surface.PROGRAMS if not each.formula} | {
    *("volume_surface", "volume_medium", "volume_paths")
}


@dataclass(frozen=True, slots=True)
class Listed:
    """A program for one lane: its name on the record, and its text."""

    name: str
    precision: Precision
    text: FlatText


def paired() -> Iterator[Listed]:
    """Programs that have every pair of a renderer's features, number types included, and one of each other kind."""
    for renderer, features in FEATURES.items():
        for chosen in covering(
            {**features, "precision": PRECISIONS}, OF_MEDIA if renderer == "volume" else APART
        ):
            yield from _of_choice(renderer, chosen)
    for precision in PRECISIONS:
        for name, text in programs.of_others(1, precision):
            if "alone=0" not in name:  # bricks in vectors of 16 are for processors
                yield Listed(f"{name} {precision}", precision, text)


def everything() -> Iterator[Listed]:
    """Those, the pictures that all implementations render, and the march and the orbits of every formula of the library."""
    yield from paired()
    for precision in PRECISIONS:
        for name, text in programs.of_pictures(1, precision, programs.PICTURES):
            yield Listed(f"{name} {precision}", precision, text)
        for name in catalog.names():
            body = Body(catalog.load_chain(name), 1)
            probe = trial.program_text(write_formula(body.chain), 1, precision)
            yield Listed(f"march_probe {name} {precision}", precision, probe)
            yield Listed(f"points {name} {precision}", precision, points.program_text(body, 1, precision))
            # What knows a formula in a program of its own has figures for each of them.
            plain = load_scene({**_scene("surface"), "formula": {"name": name}})
            for part, text in programs.of_scene(plain, 1, precision):
                if part == "rays":
                    yield Listed(f"{part} {name} {precision}", precision, text)


def unlike(listed: Iterable[Listed]) -> list[Listed]:
    """Without programs whose text and number type an earlier one has."""
    first: dict[tuple[str, Precision], Listed] = {}
    for each in listed:
        first.setdefault((each.text.text, each.precision), each)
    return list(first.values())


def _scene(renderer: str) -> dict[str, Any]:
    """What every scene has, without a formula."""
    return {
        "version": 1,
        "image": {"width": 16, "height": 16},
        "camera": {"position": [0, -20, 5], "target": [0, 0, 0]},
        "renderer": {"type": renderer},
    }


def _of_choice(renderer: str, chosen: Mapping[str, str]) -> Iterator[Listed]:
    """The programs of a scene that has what is chosen of each feature."""
    scene = put_together(_scene(renderer), FEATURES[renderer], chosen)
    precision: Precision = "float64" if chosen["precision"] == "float64" else "float32"
    name = " ".join(value for value in chosen.values() if value)
    for part, text in programs.of_scene(load_scene(scene, folder=FOLDER), 1, precision):
        yield Listed(f"{part} {precision if part in _ALIKE else name}", precision, text)
