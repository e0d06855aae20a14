"""Several formulas and simple solids that are joined to one: their records and texts, see `kernels/solids.h`."""

from __future__ import annotations

import re
from functools import lru_cache

import numpy as np

from clfractal.device.orbit import Record, orbit_record
from clfractal.device.structs import Precision
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.renderers.water import frame_of
from clfractal.resources import folder
from clfractal.scene.base import length
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject, Joined, PlaneObject, Solid, turned_axes

SOLID_KINDS = {"formula": 0, "plane": 1, "sphere": 2, "box": 3, "cylinder": 4}
JOINS = {"union": 0, "smooth_union": 1, "cut": 2, "intersection": 3}

# What a text defines: macros, functions and types.
_DEFINED = re.compile(r"^#define (\w+)|^INLINE [\w ]+?\**(\w+)\(|^} (\w+);|^typedef \w+ (\w+);", re.MULTILINE)


def solid_defines(scene: Scene) -> dict[str, object]:
    """The defines of all programs that march rays, or read what marches have found."""
    return {"SOLIDS": 1 + len(scene.joined)}


def solid_texts(scene: Scene, *, traps: bool = False) -> dict[str, str]:
    """The generated texts of a program that asks the scene's formulas.

    Args:
        traps: whether it also asks how near orbits come to a trap.
    """
    if not scene.joined:
        return {"formula.h": write_formula(scene.chain).text}
    texts = list(_texts(scene))
    names = ["orbit.h", *(["trap_near.h"] if traps else [])]
    derivative = all(write_formula(chain).has_derivative for chain in _chains(scene))
    head = [
        *(f"#define SOLID_{kind.upper()} {number}" for kind, number in SOLID_KINDS.items()),
        *(f"#define JOIN_{join.split('_')[0].upper()} {number}" for join, number in JOINS.items()),
        f"#define JOINS_SMOOTHLY {int(any(each.join == 'smooth_union' for each in scene.joined.values()))}",
        '#include "orbit_types.h"',
        *(['#include "trap.h"'] if traps else []),
    ]
    body = [numbered(text, tuple(names), number) for number, text in enumerate(texts)]
    each = " ".join(f"DO({number})" for number in range(len(texts)))
    tail = [
        f"#define HAS_DERIVATIVE {int(derivative)}",
        "#define HAS_CALLS 1",
        f"#define EACH_TEXT(DO) {each}",
    ]
    found = {"formula.h": "\n".join([*head, *body, *tail]) + "\n", "orbit.h": '#include "solids.h"\n'}
    return {**found, "trap_near.h": '#include "solids_near.h"\n'} if traps else found


@lru_cache(maxsize=64)
def numbered(text: str, after: tuple[str, ...], number: int) -> str:
    """A formula's text and the kernel files that use it, with a number behind the name of all that they define."""
    whole = text + "".join((folder("kernels") / name).read_text(encoding="utf-8") for name in after)
    names = {name for found in _DEFINED.findall(whole) for name in found if name}
    pattern = re.compile(rf"\b(?:{'|'.join(sorted(names, key=len, reverse=True))})\b")
    return pattern.sub(lambda found: f"{found[0]}_{number}", whole)


def solid_records(scene: Scene, precision: Precision) -> list[Record]:
    """The scene's own formula, and what is joined to it."""
    iterations = scene.formula.iterations
    if not scene.joined:
        return [orbit_record(scene.chain, iterations, precision)]
    renderer, radius = scene.surface, scene.bounds[1]
    own = renderer.bounds
    main = (own.center, own.radius) if own is not None else (scene.chain.center, scene.chain.radius)
    texts = list(_texts(scene))
    constants = _Constants()

    def formula(chain: Chain, scale: float, ball: tuple[object, float]) -> dict[str, object]:
        written = write_formula(chain)
        safe = renderer.step_scale if renderer.step_scale is not None else chain.step_scale
        return {
            "kind": SOLID_KINDS["formula"],
            "text": texts.index(written.text),
            "first": constants.place(written),
            "scale": scale * safe,
            "step_scale": safe,
            "ball": ball[0],
            "ball_radius": ball[1],
            "potential_share": ball[1] / radius,
        }

    found = [orbit_record(scene.chain, iterations, precision, joined=formula(scene.chain, 1.0, main))]
    objects = list(scene.objects)
    for name, each in scene.joined.items():
        part: dict[str, object] = {
            "object": 1 + objects.index(name),
            "join": JOINS[each.join],
            "smoothness": each.smoothness,
        }
        part |= {"middle": each.position, **_axes(each)}
        chain, limit = scene.chain, iterations
        if isinstance(each, FormulaObject):
            chain, limit = scene.joined_chains[name], each.formula.iterations
            part |= formula(chain, each.scale, each.ball(chain.center, chain.radius))
        else:
            part |= {"kind": SOLID_KINDS[each.tag], "step_scale": 1.0}
        found.append(orbit_record(chain, limit, precision, joined=part))
    return found


def solid_constants(scene: Scene, precision: Precision) -> Record:
    """The constants of all formulas, one after the other."""
    constants = _Constants()
    for chain in _chains(scene):
        constants.place(write_formula(chain))
    return np.array(constants.values, precision)


def _chains(scene: Scene) -> list[Chain]:
    chains = scene.joined_chains if scene.joined else {}
    return [scene.chain, *(chains[name] for name in scene.joined if name in chains)]


def _texts(scene: Scene) -> dict[str, None]:
    """The texts of all formulas, each once."""
    return dict.fromkeys(write_formula(chain).text for chain in _chains(scene))


class _Constants:
    """Constants of formulas behind each other."""

    def __init__(self) -> None:
        self.values: list[float] = []

    def place(self, formula: FormulaText) -> int:
        """Adds those of a formula, and says where they begin."""
        first = len(self.values)
        self.values += formula.constants
        return first


def _axes(each: Joined) -> dict[str, object]:
    """From scene units to its own ones, and half its sides."""
    if isinstance(each, FormulaObject):
        axes = [np.array(axis) / each.scale for axis in turned_axes(each.rotation)]
        sides = [1.0, 1.0, 1.0]
    elif isinstance(each, Solid):
        axes = [np.array(axis) / np.dot(axis, axis) for axis in each.axes]
        sides = [length(axis) for axis in each.axes]
    else:
        assert isinstance(each, PlaneObject)
        axes, sides = [np.array(axis) for axis in frame_of(each.normal)], [1.0, 1.0, 1.0]
    return {"sides": sides, **dict(zip(("own_x", "own_y", "own_z"), axes, strict=True))}
