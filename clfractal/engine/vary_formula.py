"""Steps of a formula's numbers: its parameters and the constant of a Julia set."""

from __future__ import annotations

import math
from collections.abc import Collection
from copy import deepcopy
from dataclasses import dataclass
from random import Random

from clfractal.engine.varied import Step, is_locked, rounded, signed
from clfractal.formulas import catalog
from clfractal.formulas.blocks import nodes_of
from clfractal.formulas.definition import BoundFormula, Formula, Parameter
from clfractal.formulas.nodes import names_in
from clfractal.scene.model import Scene

# The boldest steps: of a range; of a range's logarithm, and at most; of a parameter without a range, by its size; and of
# a Julia constant, by its length, which counts as at least _LEAST_JULIA.
_LINEAR, _LOGARITHMIC, _MOST_LOGARITHMIC = 0.12, 0.25, 0.35
_UNBOUNDED, _JULIA, _LEAST_JULIA = 0.3, 0.3, 0.4
_PART_CHANGED = 0.65
# Strengths above this take another of a parameter's choices; a whole number changes by at most this part and the amount.
_LEAST_FOR_CHOICES = 0.2
_WHOLE_PART = 0.2


@dataclass(frozen=True, slots=True)
class Slot:
    """A formula with values: a scene's only one, or a link of its chain. `path` is where its values are given."""

    path: str
    bound: BoundFormula
    owns_julia: bool


def expanded(scene: Scene) -> Scene:
    """The same picture, with a chain of the library written out in the scene, so that its links can have values."""
    name = scene.formula.name
    if name is None or not catalog.is_chain(name):
        return scene
    formula = {**scene.formula.mapping(), "inline": deepcopy(dict(catalog.description(name)))}
    del formula["name"]
    return scene.model_copy(update={"formula": formula})


def slots(scene: Scene) -> list[Slot]:
    """The scene's formulas with their values."""
    spec, links = scene.formula, scene.chain.links
    if spec.chain is not None:
        path, own = "formula.chain", [link.julia is not None for link in spec.chain]
    elif spec.inline is not None and "chain" in spec.inline:
        path = "formula.inline.chain"
        own = [link.get("julia") is not None for link in spec.inline["chain"]]
    else:
        return [Slot("formula", links[0].bound, True)]
    return [
        Slot(f"{path}.{number}", link.bound, own[number] or spec.julia is None)
        for number, link in enumerate(links)
    ]


def shown_parameters(formula: Formula) -> list[Parameter]:
    """The parameters that change the set itself: not those that only bounds, radii or the step scale use."""
    nodes = [node for _, node in formula.let]
    nodes += [*formula.map, formula.repeat]
    nodes += [*nodes_of(formula.steps), *(each.start for each in formula.state)]
    nodes += [node for node in (formula.slice, formula.shape, formula.distance) if node is not None]
    used = {name for node in nodes for name in names_in(node)}
    return [parameter for parameter in formula.parameters if parameter.name in used]


def formula_step(
    scene: Scene, rng: Random, amount: float, *, closeness: float, locked: Collection[str]
) -> Step:
    """New values for some of the scene's parameters and constants; an empty step if it has none.

    Args:
        closeness: up to 1, less where the picture shows a small part of the set, of which a small step changes much.
    """
    step = Step()
    found = slots(scene)
    draws: list[tuple[Slot, Parameter | None]] = []
    for slot in found:
        for parameter in shown_parameters(slot.bound.formula):
            if not is_locked(f"{slot.path}.parameters.{parameter.name}", locked):
                draws.append((slot, parameter))
        if slot.owns_julia and slot.bound.julia is not None and not is_locked(f"{slot.path}.julia", locked):
            draws.append((slot, None))
    shared = scene.formula.julia if not all(slot.owns_julia for slot in found) else None
    if shared is not None and not is_locked("formula.julia", locked):
        _move_julia(step, "formula.julia", shared, rng, amount * closeness)
    chosen = [draw for draw in draws if rng.random() < _PART_CHANGED]
    if draws and not chosen:
        chosen = [rng.choice(draws)]
    for slot, moved in chosen:
        if moved is not None:
            _move_parameter(step, slot, moved, rng, amount, closeness)
        elif slot.bound.julia is not None:
            _move_julia(step, f"{slot.path}.julia", slot.bound.julia, rng, amount * closeness)
    return step


def _move_parameter(
    step: Step, slot: Slot, parameter: Parameter, rng: Random, amount: float, closeness: float
) -> None:
    value = slot.bound.values[parameter.name]
    # Whole powers stay whole: others tear the set open along a half plane.
    power = parameter.name in names_in(slot.bound.formula.degree)
    whole = parameter.type == "int" or (power and value == round(value))
    size = signed(rng, amount)
    if parameter.choices is not None or whole:
        # The shortest step of such a number is a large one, so weak variations take it seldom, or not at all.
        if rng.random() > math.sqrt(amount * closeness):
            return
        if parameter.choices is not None:
            new = _next_choice(parameter, value, size) if amount > _LEAST_FOR_CHOICES else value
        else:
            new = _next_whole(parameter, value, size)
            if abs(new - value) > (_WHOLE_PART + amount) * abs(value):
                return
    else:
        size *= closeness
        new = moved_value(parameter, value, size)
    if new == value:
        return
    path = f"{slot.path}.parameters.{parameter.name}"
    step.add(Step({path: new}, {path: size}, [f"{parameter.name} {new:.4g}"]))


def moved_value(parameter: Parameter, value: float, size: float) -> float:
    """A real parameter's value after a step of -1 to 1, in its range; at an end of the range it turns back."""
    low, high = parameter.minimum, parameter.maximum
    if low is None or high is None:
        span = _UNBOUNDED * max(abs(value), abs(parameter.default), 1.0)
    elif low > 0 and value > 0:
        factor = min(_LOGARITHMIC * math.log(high / low), _MOST_LOGARITHMIC)
        span = value * math.expm1(factor * abs(size)) / abs(size)
    else:
        span = _LINEAR * (high - low)
    for direction in (1.0, -1.0):
        new = rounded(value + direction * size * span, size * span)
        if (low is None or new >= low) and (high is None or new <= high):
            return new
    return value


def _next_choice(parameter: Parameter, value: float, size: float) -> float:
    choices = sorted(parameter.choices or ())
    far = max(1, round(abs(size) * len(choices) / 2))
    place = choices.index(value)
    for target in (place + math.copysign(far, size), place - math.copysign(far, size)):
        if 0 <= target < len(choices):
            return _whole(choices[int(target)])
    return value


def _next_whole(parameter: Parameter, value: float, size: float) -> float:
    """The nearest whole number to a step by a factor, but never the same one."""
    far = max(1, round(abs(value) * math.expm1(_MOST_LOGARITHMIC * abs(size))))
    for new in (value + math.copysign(far, size), value - math.copysign(far, size)):
        least = -math.inf if parameter.minimum is None else math.ceil(parameter.minimum)
        if least <= new <= (math.inf if parameter.maximum is None else parameter.maximum):
            return _whole(new)
    return value


def _whole(value: float) -> float:
    return int(value) if value == round(value) else value


def _move_julia(step: Step, path: str, constant: tuple[float, ...], rng: Random, amount: float) -> None:
    """Moves the constant in a random direction of its space."""
    direction = [rng.gauss(0.0, 1.0) for _ in constant]
    size = abs(signed(rng, amount))
    length = math.hypot(*direction) or 1.0
    far = _JULIA * size * max(math.hypot(*constant), _LEAST_JULIA) / length
    moved = [rounded(c + far * d, far) for c, d in zip(constant, direction, strict=True)]
    sizes = {f"{path}.{index}": size * each / length for index, each in enumerate(direction)}
    step.add(Step({path: moved}, sizes, ["julia " + ", ".join(f"{each:.3g}" for each in moved)]))
