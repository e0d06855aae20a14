"""Formulas of Mandelbulber that our library has as the same map: by number, for values of their parameters.

What a formula is called there is a number, `formula_1` to `formula_9`; its parameters stand in the sections `fractal_1` to
`fractal_9`. A counterpart is the same map for these values, not one of a similar name.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

from clfractal.exchange.settings import Section

Source = Mapping[str, Any]
"""`name` or `inline`, and `parameters`, as in a scene's `formula`."""


@dataclass(frozen=True, slots=True)
class Counterpart:
    """A formula of ours that is one of theirs.

    Attributes:
        title: what it is called there, for messages.
        source: it.
        four: whether it has four variables.
        adds: whether it adds the point.
        even: mirroring z before it is mirroring z after it.
    """

    title: str
    source: Source
    four: bool = False
    adds: bool = True
    even: bool = True


Maker = Callable[[Section], Counterpart | str]
"""The counterpart for values of parameters, or a reason why there is none."""

_MAKERS: dict[int, Maker] = {}


def counterpart(number: int, fractal: Section) -> Counterpart | str:
    """The formula of ours for a formula of theirs, or why there is none.

    Args:
        number: of the formula.
        fractal: its parameters.

    Raises:
        FileError: a parameter is none of its kind.
    """
    make = _MAKERS.get(number)
    return "our library has no such formula" if make is None else make(fractal)


def _formula(number: int) -> Callable[[Maker], Maker]:
    def noted(make: Maker) -> Maker:
        _MAKERS[number] = make
        return make

    return noted


def _named(name: str, **parameters: float) -> Source:
    return {"name": name, **({"parameters": parameters} if parameters else {})}


@_formula(2)
def _mandelbulb(fractal: Section) -> Counterpart | str:
    power = fractal.number("power", 9.0)
    angles = [fractal.number(key, 0.0) for key in ("alpha_angle_offset", "beta_angle_offset")]
    if any(angles):
        return "its angles are turned (alpha_angle_offset, beta_angle_offset)"
    if power != int(power) or not 2 <= power <= 16:
        return f"its power is {power:g}; ours are whole, 2 to 16"
    return Counterpart("Mandelbulb", _named("cosine_mandelbulb", power=int(power), z_sign=1))


@_formula(3)
def _mandelbulb_power_2(fractal: Section) -> Counterpart | str:
    return Counterpart("Mandelbulb of power 2", _named("cosine_mandelbulb", power=2, z_sign=-1))


@_formula(5)
def _quaternion(fractal: Section) -> Counterpart | str:
    # The fourth number stays 0.
    return Counterpart("Quaternion", _named("quaternion_mandelbrot"), four=True)


@_formula(7)
def _menger_sponge(fractal: Section) -> Counterpart | str:
    scale = fractal.number("transf_scale_3", 3.0)
    if scale != 3:
        return f"its scale is {scale:g}, not 3, and its offset is 2"
    return Counterpart("Menger sponge", _named("menger_sponge"), adds=False)


@_formula(8)
def _mandelbox(fractal: Section) -> Counterpart | str:
    scale = fractal.number("mandelbox_scale", 2.0)
    inner = fractal.number("mandelbox_folding_min_radius", 0.5)
    outer = fractal.number("mandelbox_folding_fixed_radius", 1.0)
    limit, value = (
        fractal.number("mandelbox_folding_limit", 1.0),
        fractal.number("mandelbox_folding_value", 2.0),
    )
    fractal.without(("mandelbox_color", "mandelbox_color_R", "mandelbox_color_Sp1", "mandelbox_color_Sp2"))
    if (limit, value) != (1.0, 2.0):
        return f"it folds at {limit:g} by {value:g}, not at 1 by 2"
    if any(fractal.vector("mandelbox_offset")):
        return "it has an offset (mandelbox_offset)"
    if fractal.flag("mandelbox_rotations_enabled", False) and any(
        any(fractal.vector(f"mandelbox_rotation_{side}_{axis}"))
        for side in ("neg", "pos")
        for axis in (1, 2, 3)
    ):
        return "its folds are turned (mandelbox_rotations_enabled)"
    if fractal.flag("mandelbox_main_rotation_enabled", False) and any(
        abs(angle) > 1e-30 for angle in fractal.vector("mandelbox_rotation_main")
    ):
        return "it is turned in every step (mandelbox_rotation_main)"
    if not 1 <= abs(scale) <= 4:
        return f"its scale is {scale:g}; ours are 1 to 4, and -1 to -4"
    if not (0.001 <= inner <= 2 and 0.001 <= outer <= 4):
        return f"its radii are {inner:g} and {outer:g}; ours are from 0.001 to 2 and 4"
    return Counterpart("Mandelbox", _named("mandelbox", scale=scale, min_radius=inner, fixed_radius=outer))


@_formula(19)
def _aexion(fractal: Section) -> Counterpart | str:
    plus = fractal.number("cadd", -1.3)
    if not -1 <= plus <= 1:
        return f"cadd is {plus:g}; ours is from -1 to 1"
    return Counterpart("Aexion", _named("aexion", plus=plus), four=True, even=False)


@_formula(21)
def _bristorbrot(fractal: Section) -> Counterpart | str:
    return Counterpart("Bristorbrot", _named("bristorbrot"), even=False)


@_formula(50)
def _makin(fractal: Section) -> Counterpart | str:
    return Counterpart("Makin 3D-2", _named("makin_brot"), even=False)


@_formula(103)
def _pseudo_kleinian(fractal: Section) -> Counterpart | str:
    for key in fractal.beginning("transf_function_enabled", "transf_sphere_inversion_enabled"):
        if fractal.flag(key, False):
            return f"one of its transforms is on ({key})"
    box = fractal.vector("transf_addition_constant_0777", (0.7, 0.7, 0.7))
    move = fractal.vector("transf_addition_constant")
    values = {
        "size": fractal.number("transf_minimum_radius_05", 0.5),
        **{f"box_{axis}": side for axis, side in zip("xyz", box, strict=True)},
        **{f"move_{axis}": by for axis, by in zip("xyz", move, strict=True)},
        "tube": fractal.number("analyticDE_scale_1", 1.0),
        "sheet": 0.0001,
    }
    for name, value in values.items():
        low = -3 if name.startswith("move") else 0.05 if name in ("tube", "sheet") else 0.1
        if name != "sheet" and not low <= value <= 3:
            return f"its {name} is {value:g}; ours is from {low:g} to 3"
    return Counterpart("Pseudo Kleinian", _named("pseudo_kleinian", **values), adds=False, even=move[2] == 0)
