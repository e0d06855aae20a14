"""Several formulas and simple solids that are joined to one: their records and texts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from clfractal.device.orbit import BODY_OPAQUE, JOINS, SOLID_KINDS, Record, orbit_record
from clfractal.device.structs import Precision
from clfractal.formulas.language import Chain
from clfractal.formulas.opencl import write_formula
from clfractal.formulas.together import write_together
from clfractal.geometry.faces import face_number, opening_planes
from clfractal.scene.checks import used_boxes
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject, ball_of_both
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.base import frame_of, length
from clfractal.schema.shape import Ball, Joined, Level, ObjectBase, Simple, Solid, turned_axes
from clfractal.shading.set_bodies import joins_smoothly, set_bodies

# Around a formula's ball, in its radii: here it has a gradient and a count, for light is computed before surfaces.
_BESIDE = 0.5
# Where a surface is that flows into another the other is not farther off than this, in widths of the smooth union: it
# is lifted by a quarter of the width at most, and distances that differ by more than the width do not flow.
_FLOWS = 1.25


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

    def texts(self, *, turns: bool = False) -> dict[str, str]:
        """The generated text of a program that asks it, `formula.h`.

        Solids that are joined are a list that programs read. Of a scene with such solids only the formulas are text.
        `turns`: with the defines that depend on how formulas' turns repeat themselves.
        """
        return self._text(alone=self.scene is None, turns=turns)

    def possible_texts(self, *, turns: bool = False) -> list[dict[str, str]]:
        """That text, and the one with simple solids where there are none, or of the formula by itself."""
        return [self.texts(turns=turns), self._text(alone=self.scene is not None, turns=turns)]

    def _text(self, *, alone: bool, turns: bool) -> dict[str, str]:
        chains = (self.chain,) if alone else self._chains
        own = _turns(chains) if turns else {}
        lines = "".join(f"#define {name} {value}\n" for name, value in own.items())
        text = write_formula(self.chain).text if alone else write_together(chains).text
        return {"formula.h": lines + text}

    def records(self, precision: Precision) -> Record:
        """The `Orbit` records, shape (solids,)."""
        if self.scene is not None:
            return np.stack(_joined_records(self.scene, precision))
        record = orbit_record(self.chain, self.iterations, precision, self.bailout, potential=self.potential)
        return record.reshape(1)

    def constants(self, precision: Precision) -> Record:
        """The constants of all formulas, one after the other."""
        if self.scene is None:
            return np.array(write_formula(self.chain).constants, precision)
        return np.array(write_together(self._chains).constants, precision)

    @property
    def _chains(self) -> tuple[Chain, ...]:
        return (self.chain,) if self.scene is None else _chains(self.scene)


def _turns(chains: Sequence[Chain]) -> dict[str, int | str]:
    """What texts that look for orbits that came back depend on: one set for all formulas of a program."""
    if any(len(chain.links) > 1 for chain in chains):
        return {"CYCLE": "(orbit->cycle)", "REPEATS_FROM": "(orbit->repeats_from)"}
    return {"CYCLE": 1, "REPEATS_FROM": max(chain.repeats_from for chain in chains)}


def has_hollows(scene: Scene) -> bool:
    """Whether an object leaves a hollow in which no distance is known."""
    return any(isinstance(each, FormulaObject) and each.join == "cut" for each in scene.joined.values())


def _joined_records(scene: Scene, precision: Precision) -> list[Record]:
    """The scene's own formula, and what is joined to it."""
    iterations, potential = scene.formula.iterations, _by_potential(scene)
    widest = max(
        (each.smoothness for each in scene.joined.values() if each.join == "smooth_union"), default=0.0
    )
    radius = min(scene.bounds[1], scene.formula_bounds[1])
    together = write_together(_chains(scene))
    formulas = iter(zip(together.formulas, together.firsts, strict=True))
    flows, bodies = {"flows": int(joins_smoothly(scene))}, set_bodies(scene)

    def body(number: int) -> int:
        """Of a set of several bodies what is no body has a number, too."""
        return number or (BODY_OPAQUE if bodies.several else 0)

    def formula(chain: Chain, scale: float, ball: Ball) -> dict[str, object]:
        written, first = next(formulas)
        own = scene.renderer.step_scale if isinstance(scene.renderer, SurfaceRenderer) else None
        safe = own if own is not None else chain.step_scale
        return {
            "kind": SOLID_KINDS["formula"],
            "first": first,
            "has_shape": int(written.facts.has_shape),
            "scale": scale * safe,
            "step_scale": safe,
            "ball": ball[0],
            "ball_radius": ball[1],
            "reach": max(_BESIDE * ball[1], _FLOWS * widest * safe),
            "potential_share": min(ball[1], scale * chain.radius) / radius,
        }

    first = {**flows, "body": body(bodies.own), **formula(scene.chain, 1.0, _ball(scene))}
    found: list[_Part] = [_Part(scene.chain, iterations, first)]
    objects = list(scene.objects)
    for name, each in scene.joined.items():
        part: dict[str, object] = {
            **flows,
            "object": 1 + objects.index(name),
            "join": JOINS[each.join],
            "body": body(bodies.parts[name]) if each.join in ("union", "smooth_union") else 0,
            "bare": int(bodies.several),
            "smoothness": each.smoothness,
        }
        part |= {"middle": each.position, **_axes(each)}
        chain, limit = scene.chain, iterations
        if isinstance(each, FormulaObject):
            chain, limit = scene.joined_chains[name], each.formula.iterations
            part |= formula(chain, each.scale, each.ball(chain.center, chain.radius))
        else:
            assert isinstance(each, Simple)
            part |= {"kind": SOLID_KINDS[each.tag], "form": each.form, "step_scale": 1.0}
        found.append(_Part(chain, limit, part, _opening(scene, name)))
    lists = [found]
    if bodies.several:
        lists += _lists_of_bodies(found)
    records: list[_Part] = []
    for number, each_list in enumerate(lists):
        more = _one_list(each_list, scene.chain, iterations)
        more[0].record["next_list"] = len(more) if number + 1 < len(lists) else 0
        records += more
    return [
        orbit_record(each.chain, each.iterations, precision, potential=potential, joined=each.record)
        for each in records
    ]


@dataclass(frozen=True, slots=True)
class _Part:
    """A solid of a list: its record, and those of the planes that open it alone."""

    chain: Chain
    iterations: int
    record: dict[str, object]
    openings: Sequence[dict[str, object]] = ()


def _lists_of_bodies(parts: Sequence[_Part]) -> list[list[_Part]]:
    """Of each body, and of all that is opaque, what is added to it, and what cuts that."""
    added = JOINS["union"]
    numbers = dict.fromkeys(each.record["body"] for each in parts if each.record.get("join", added) == added)
    found = []
    for number in numbers:
        own = [each for each in parts if each.record["body"] in (number, 0)]
        while own[0].record["body"] == 0:
            del own[0]
        found.append(own)
    return found


def _one_list(parts: Sequence[_Part], chain: Chain, iterations: int) -> list[_Part]:
    """The records of solids that are asked as one: behind them stand those of the planes."""
    found = [replace(each, record={**each.record, "solids": len(parts)}) for each in parts]
    end = len(found)
    for number, each in enumerate(parts):
        found[number].record.update(planes=len(each.openings), first_plane=end - number)
        end += len(each.openings)
    return found + [_Part(chain, iterations, dict(record)) for each in parts for record in each.openings]


def _opening(scene: Scene, name: str) -> list[dict[str, object]]:
    """The planes that open one part alone: solids of which it is within. (What fills grids has no planes.)"""
    if not isinstance(scene.renderer, SurfaceRenderer):
        return []
    thing = 1 + list(scene.objects).index(name)
    return [
        {
            "kind": SOLID_KINDS["plane"],
            "object": face_number(number, thing),
            "middle": placed.center,
            "sides": [1.0, 1.0, 1.0],
            **_along(frame_of(placed.normal)),
        }
        for number, placed in opening_planes(scene, name)
    ]


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


def _chains(scene: Scene) -> tuple[Chain, ...]:
    chains = scene.joined_chains
    return (scene.chain, *(chains[name] for name in scene.joined if name in chains))


def own_axes(each: ObjectBase) -> tuple[list[npt.NDArray[np.float64]], list[float]]:
    """Of a solid or a plane: from scene units to its own ones, and half its sides."""
    if isinstance(each, Solid):
        # The axes stand at right angles: each one's own number is the product with it by its square.
        return [np.array(axis) / np.dot(axis, axis) for axis in each.axes], list(map(length, each.axes))
    assert isinstance(each, Level)
    return [np.array(axis) for axis in frame_of(each.normal)], [1.0, 1.0, 1.0]


def _axes(each: Joined) -> dict[str, object]:
    """From scene units to its own ones, and half its sides."""
    if isinstance(each, FormulaObject):
        axes = [np.array(axis) / each.scale for axis in turned_axes(each.rotation)]
        sides = [1.0, 1.0, 1.0]
    else:
        axes, sides = own_axes(each)
    return {"sides": sides, **_along(axes)}


def _along(axes: Sequence[npt.ArrayLike]) -> dict[str, object]:
    return dict(zip(("own_x", "own_y", "own_z"), axes, strict=True))
