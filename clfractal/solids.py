"""Several formulas and simple solids that are joined to one: their records and texts, see `kernels/solids.h`."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from clfractal.device.orbit import Record, orbit_record
from clfractal.device.structs import Precision
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import FormulaText, write_formula
from clfractal.resources import folder
from clfractal.scene.base import frame_of, length
from clfractal.scene.checks import used_boxes
from clfractal.scene.model import Scene
from clfractal.scene.objects import Ball, FormulaObject, Joined, PlaneObject, Solid, ball_of_both, turned_axes
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer

SOLID_KINDS = {"formula": 0, "plane": 1, "sphere": 2, "box": 3, "cylinder": 4}
JOINS = {"union": 0, "smooth_union": 1, "cut": 2, "intersection": 3}

# Around a formula's ball, in its radii: here it has a gradient and a count, for light is computed before surfaces.
_BESIDE = 0.5
# Where a surface is that flows into another the other is not farther off than this, in widths of the smooth union: it
# is lifted by a quarter of the width at most, and distances that differ by more than the width do not flow.
_FLOWS = 1.25

# Kernel files that ask one formula, and what asks several solids in their place.
_JOINED = {
    "orbit.h": "solids.h",
    "trap_near.h": "solids_near.h",
    "solid_inside.h": "joined_inside.h",
    "solid_count.h": "joined_count.h",
    "node_proof.h": "joined_nodes.h",
    "escape.h": "joined_escape.h",
}
# What they need before them, once for all formulas.
_HEADERS = {
    "orbit.h": ("orbit_types.h",),
    "trap_near.h": ("trap.h",),
    "solid_inside.h": ("fill_packets.h",),
    "escape.h": ("escape_types.h",),
}

# What a text defines: macros, functions and types.
_DEFINED = re.compile(r"^#define (\w+)|^INLINE [\w ]+?\**(\w+)\(|^} (\w+);|^typedef \w+ (\w+);", re.MULTILINE)


@dataclass(frozen=True, slots=True)
class Body:
    """What programs ask: a formula by itself, or a scene's, with all that is joined to it.

    Attributes:
        scene: None for a formula by itself.
        bailout: in the place of the formula's own; for a formula by itself.
        potential: whether normals are those of the potential, not of the surface.
    """

    chain: Chain
    iterations: int
    scene: Scene | None = None
    bailout: float | None = None
    potential: bool = False

    @classmethod
    def of(cls, scene: Scene) -> Body:
        """A scene's."""
        joined = scene if scene.joined else None
        return cls(scene.chain, scene.formula.iterations, joined, potential=_by_potential(scene))

    @property
    def defines(self) -> dict[str, object]:
        """The defines of all programs that ask it, or read what marches have found."""
        joined = {} if self.scene is None else self.scene.joined
        return {
            "SOLIDS": 1 + len(joined),
            "JOINS_SMOOTHLY": int(self.scene is not None and joins_smoothly(self.scene)),
            "HOLLOWS": int(any(is_hollow(each) for each in joined.values())),
        }

    def texts(
        self, *, files: Sequence[str] = (), defines: Callable[[Chain], Mapping[str, object]] | None = None
    ) -> dict[str, str]:
        """The generated texts of a program that asks it.

        Args:
            files: what it asks beside `orbit.h`: other kernel files that _JOINED replaces.
            defines: what these depend on, of each formula.
        """
        lines = _lines_of(defines)
        if self.scene is not None:
            return _joined_texts(self.scene, ("orbit.h", *files), lines)
        return {"formula.h": lines(self.chain) + write_formula(self.chain).text}

    def records(self, precision: Precision) -> Record:
        """The `Orbit` records, shape (solids,)."""
        if self.scene is not None:
            return np.stack(_joined_records(self.scene, precision))
        record = orbit_record(self.chain, self.iterations, precision, self.bailout, potential=self.potential)
        return record.reshape(1)

    def constants(self, precision: Precision) -> Record:
        """The constants of all formulas, one after the other."""
        constants = _Constants()
        for chain in [self.chain] if self.scene is None else _chains(self.scene):
            constants.place(write_formula(chain))
        return np.array(constants.values, precision)


def joins_smoothly(scene: Scene) -> bool:
    """Whether anything flows into the set."""
    return any(each.join == "smooth_union" for each in scene.joined.values())


def is_hollow(each: Joined) -> bool:
    """Whether an object leaves a hollow in which no distance is known."""
    return isinstance(each, FormulaObject) and each.join == "cut"


def _lines_of(defines: Callable[[Chain], Mapping[str, object]] | None) -> Callable[[Chain], str]:
    """Defines of a formula as text."""
    if defines is None:
        return lambda chain: ""
    return lambda chain: "".join(f"#define {name} {value}\n" for name, value in defines(chain).items())


def _joined_texts(scene: Scene, names: tuple[str, ...], lines: Callable[[Chain], str]) -> dict[str, str]:
    """Every text of a formula once, with its number, and kernel files that ask them all in the places of `names`."""
    derivative = all(write_formula(chain).has_derivative for chain in _chains(scene))
    head = [
        *(f"#define SOLID_{kind.upper()} {number}" for kind, number in SOLID_KINDS.items()),
        *(f"#define JOIN_{join.split('_')[0].upper()} {number}" for join, number in JOINS.items()),
        *(f'#include "{header}"' for name in names for header in _HEADERS.get(name, ())),
    ]
    body = [
        numbered(lines(chain) + text, names, number)
        for number, (text, chain) in enumerate(_texts(scene).items())
    ]
    each = " ".join(f"DO({number})" for number in range(len(body)))
    tail = [
        f"#define HAS_DERIVATIVE {int(derivative)}",
        "#define HAS_CALLS 1",
        f"#define EACH_TEXT(DO) {each}",
    ]
    texts = {name: f'#include "{_JOINED[name]}"\n' for name in names}
    return {"formula.h": "\n".join([*head, *body, *tail]) + "\n", **texts}


@lru_cache(maxsize=64)
def numbered(text: str, after: tuple[str, ...], number: int) -> str:
    """A formula's text and the kernel files that use it, with a number behind the name of all that they define."""
    whole = text + "".join((folder("kernels") / name).read_text(encoding="utf-8") for name in after)
    names = {name for found in _DEFINED.findall(whole) for name in found if name}
    pattern = re.compile(rf"\b(?:{'|'.join(sorted(names, key=len, reverse=True))})\b")
    return pattern.sub(lambda found: f"{found[0]}_{number}", whole)


def _joined_records(scene: Scene, precision: Precision) -> list[Record]:
    """The scene's own formula, and what is joined to it."""
    iterations, potential = scene.formula.iterations, _by_potential(scene)
    widest = max(
        (each.smoothness for each in scene.joined.values() if each.join == "smooth_union"), default=0.0
    )
    radius = min(scene.bounds[1], scene.formula_bounds[1])
    texts = list(_texts(scene))
    constants = _Constants()

    def formula(chain: Chain, scale: float, ball: Ball) -> dict[str, object]:
        written = write_formula(chain)
        own = scene.renderer.step_scale if isinstance(scene.renderer, SurfaceRenderer) else None
        safe = own if own is not None else chain.step_scale
        return {
            "kind": SOLID_KINDS["formula"],
            "text": texts.index(written.text),
            "first": constants.place(written),
            "scale": scale * safe,
            "step_scale": safe,
            "ball": ball[0],
            "ball_radius": ball[1],
            "reach": max(_BESIDE * ball[1], _FLOWS * widest * safe),
            "potential_share": min(ball[1], scale * chain.radius) / radius,
        }

    first = formula(scene.chain, 1.0, _ball(scene))
    found = [orbit_record(scene.chain, iterations, precision, potential=potential, joined=first)]
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
        found.append(orbit_record(chain, limit, precision, potential=potential, joined=part))
    return found


def _by_potential(scene: Scene) -> bool:
    return isinstance(scene.renderer, SurfaceRenderer) and scene.renderer.normal == "potential"


def _ball(scene: Scene) -> Ball:
    """Where the scene's own formula is asked: the renderer says what belongs to its set."""
    own = scene.chain.center, scene.chain.radius
    if isinstance(scene.renderer, VolumeRenderer):
        filled = used_boxes(scene, scene.renderer)[1]
        return ball_of_both(own, (filled.center, length(filled.sides) / 2))
    if isinstance(scene.renderer, SurfaceRenderer) and scene.renderer.bounds is not None:
        return scene.renderer.bounds.center, scene.renderer.bounds.radius
    return own


def _chains(scene: Scene) -> list[Chain]:
    chains = scene.joined_chains
    return [scene.chain, *(chains[name] for name in scene.joined if name in chains)]


def _texts(scene: Scene) -> dict[str, Chain]:
    """The texts of all formulas, each once, and a formula that has it."""
    found: dict[str, Chain] = {}
    for chain in _chains(scene):
        found.setdefault(write_formula(chain).text, chain)
    return found


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
