"""What a settings file says of its formulas: their turns and places, and what is added and folded."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from clfractal.errors import FileError, Where
from clfractal.exchange.installed import ADD_NOTHING, ADD_SWAPPED, ADD_THEMSELVES, Installed
from clfractal.exchange.parameters import rotation
from clfractal.exchange.placing import angles_of, reach_from
from clfractal.exchange.settings import SLOTS, Section, Settings
from clfractal.exchange.translate import Folds
from clfractal.exchange.translated import Addition
from clfractal.exchange.view import is_mirrored

MOST_ITERATIONS = 1_000_000
TRANSFORMS = 1000
"""From here on formulas are transforms."""
_NEVER = 250
"""`formula_stop_iteration` of a formula that goes on to the end; a file may have more iterations."""
_SHAPES = range(600, 800)
_NOWHERE = (0.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Slot:
    """A formula of a file, and its turns: from `start` to `stop`, both included."""

    slot: int
    number: int
    adds: bool
    count: int
    start: int
    stop: int
    weight: float = 1.0


@dataclass(frozen=True, slots=True)
class Plan:
    """What all formulas of a file have in common."""

    settings: Settings
    most: int
    julia: tuple[float, ...] | None
    factors: tuple[float, ...]
    w: float
    mirrored: bool
    repeats: tuple[float, ...]
    reach: float
    folds: Folds
    installed: Installed | None
    remarks: list[str]
    hollow: bool | None = None

    def addition(self, slot: Slot) -> Addition:
        """What is added after a formula."""
        if not slot.adds or slot.weight == 0:
            return Addition()
        swapped = slot.number in ADD_SWAPPED
        if self.julia is None:
            return Addition(factors=self.factors, swapped=swapped)
        return Addition(constant=self.julia, swapped=swapped)


@dataclass(frozen=True, slots=True)
class Place:
    """Where a joined formula stands: its middle, its turn, its size, and lengths after which it is there again."""

    position: tuple[float, ...] = _NOWHERE
    angles: tuple[float, ...] = _NOWHERE
    size: float = 1.0
    repeat: tuple[float, ...] = _NOWHERE

    @classmethod
    def of(cls, main: Section, slot: int) -> Place:
        """That of a slot."""
        position, turn, repeat = (
            main.vector(f"formula_{part}_{slot}") for part in ("position", "rotation", "repeat")
        )
        size = max(main.number(f"formula_scale_{slot}", 1.0), 1e-6)
        return cls(position, tuple(angles_of(rotation(turn))), size, tuple(max(each, 0.0) for each in repeat))

    @property
    def is_elsewhere(self) -> bool:
        """Whether it does not stand as formulas do by themselves."""
        return any((*self.position, *self.angles)) or self.size != 1

    @property
    def keys(self) -> dict[str, Any]:
        """As an object of a scene has it."""
        turned = {"rotation": list(self.angles)} if any(self.angles) else {}
        return {"position": list(self.position), "scale": self.size, **turned}


def plan_of(
    settings: Settings,
    slot: int | None,
    place: Place,
    installed: Installed | None,
    remarks: list[str],
    hollow: bool | None = None,
) -> Plan:
    """What holds for all formulas, or for that of a slot."""
    main = settings.main
    suffix = "" if slot is None else f"_{slot}"
    repeats = main.vector("repeat")
    if any(place.repeat):
        # It is repeated before it is turned, and only then enlarged.
        if any(place.angles):
            remarks.append(f"formula_repeat{suffix}: the formula is turned, and there once")
        else:
            repeats = tuple(each / place.size for each in place.repeat)
    factors = main.vector(f"fractal_constant_factor{suffix}", (1, 1, 1))
    constant = main.vector(f"julia_c{suffix}")
    julia = tuple(c * f for c, f in zip(constant, factors, strict=True))
    wanted = main.flag(f"julia_mode{suffix}", False)
    most = min(max(main.whole("N", 250), 1), MOST_ITERATIONS)
    w = main.number(f"initial_waxis{suffix}", 0.0)
    return Plan(
        settings,
        most,
        julia if wanted else None,
        factors,
        w,
        is_mirrored(settings),
        tuple(max(each, 0.0) for each in repeats),
        # In its own units.
        reach_from(main, place.position) / place.size,
        _folds(main),
        installed,
        remarks,
        hollow,
    )


def _folds(main: Section) -> Folds:
    """What is done to z before each application."""
    box = (main.number("box_folding_limit", 1.0), main.number("box_folding_value", 2.0))
    ball = (main.number("spherical_folding_inner", 0.5), main.number("spherical_folding_outer", 1.0))
    return Folds(
        box if main.flag("box_folding", False) else None,
        ball if main.flag("spherical_folding", False) else None,
    )


def used_slots(settings: Settings, hybrid: bool, joined: bool) -> list[int]:
    """The numbers of the slots that have a turn."""
    main = settings.main
    if joined:
        return [1]
    if not hybrid:
        main.without(key for key in main.beginning("formula_") if not key.endswith("_1"))
        main.without((*main.beginning("fractal_enable_"), *main.beginning("formula_i", "formula_st")))
        return [1]
    numbers = [slot for slot in range(1, SLOTS + 1) if main.flag(f"fractal_enable_{slot}", True)]
    used = [slot for slot in numbers if main.whole(f"formula_{slot}", 2 if slot == 1 else 0) != 0]
    for slot in set(range(1, SLOTS + 1)) - set(used):
        main.without(key for key in main.beginning("formula_") if key.endswith(f"_{slot}"))
    if not used:
        raise FileError("has no formula: all are 0 or not enabled", Where(settings.file))
    return used


def slot_of(settings: Settings, slot: int, remarks: list[str], *, hybrid: bool = False) -> Slot:
    """A formula and its turns.

    Raises:
        FileError: there is none, or a value is none of its kind.
    """
    main = settings.main
    key = f"formula_{slot}"
    number = main.whole(key, 2 if slot == 1 else 0)
    if number <= 0:
        raise FileError("no formula is chosen", main.where(key))
    adds = not (number in ADD_NOTHING or number >= TRANSFORMS or number in _SHAPES)
    if main.flag(f"dont_add_c_constant_{slot}", False):
        adds = not adds
    if not main.flag(f"check_for_bailout_{slot}", True):
        remarks.append(f"check_for_bailout_{slot}: every application is compared with the bailout")
    return Slot(
        slot,
        number,
        adds and number not in ADD_THEMSELVES,
        max(main.whole(f"formula_iterations_{slot}", 1), 1),
        max(main.whole(f"formula_start_iteration_{slot}", 0), 0),
        main.whole(f"formula_stop_iteration_{slot}", _NEVER),
        main.number(f"formula_weight_{slot}", 1.0) if hybrid else 1.0,
    )
