"""Parameters of Mandelbulber's formulas: the keys of their fields, and the values of keys that are left out.

Its names say what a parameter is by default: `transf_scale_3` is 3, `transf_offset_111` is 1, 1, 1,
`transf_function_enabled_false` is off. Only what does not follow this rule is written out here.
"""

from __future__ import annotations

from collections.abc import Mapping

Default = float | tuple[float, ...]

GROUPS: Mapping[str, str] = {
    "transformCommon": "transf",
    "bulb": "",
    "aexion": "",
    "combo4": "",
    "combo5": "",
    "combo6": "",
    "foldColor": "fold_color",
    "mandelboxVary4D": "mandelbox_vary",
    "foldingIntPow": "boxfold_bulbpow2",
    "platonicSolid": "platonic_solid",
}
"""What keys begin with, for the groups of fields that have another name there."""

KEYS: Mapping[str, str] = {
    "aSurf3Folds.orderOf3Folds1": "aSurf3Folds_order_of_folds_1",
    "aSurf3Folds.orderOf3Folds2": "aSurf3Folds_order_of_folds_2",
    "aSurf3Folds.orderOf3Folds3": "aSurf3Folds_order_of_folds_3",
    "foldingIntPow.foldFactor": "boxfold_bulbpow2_folding_factor",
    "genFoldBox.type": "mandelbox_generalized_fold_type",
    "mandelbox.foldingSphericalFixed": "mandelbox_folding_fixed_radius",
    "mandelbox.foldingSphericalMin": "mandelbox_folding_min_radius",
    "transformCommon.additionConstant000": "transf_addition_constant",
    "transformCommon.juliaC": "transf_constant_julia_c",
    "transformCommon.juliaMode": "transf_constant_julia_mode",
    "transformCommon.maxR2d1": "transf_maxR2_1",
    "transformCommon.minR0": "transf_minimum_radius_0",
    "transformCommon.minR05": "transf_minimum_radius_05",
    "transformCommon.minR06": "transf_minimum_radius_06",
    "transformCommon.scaleNeg1": "transf_scale_neg1",
}
"""The keys of fields whose names differ in more than capitals and underscores."""

_ONES = (
    "mandelbox_vary_fold",
    "mandelbox_vary_rpower",
    "mandelbox_solid",
    "surfBox_scale1Z1",
    "transf_scale",
)
_OFF = (
    "IFS_edge_enabled",
    "IFS_rotation_enabled",
    "mandelbox_main_rotation_enabled",
    "mandelbox_rotations_enabled",
)
OTHERS: Mapping[str, Default] = {
    **dict.fromkeys(
        (*_ONES, "Cpara_para0", "Cpara_paraA", "Cpara_paraB", "Cpara_paraC", "Cpara_parab_offset"), 1.0
    ),
    **dict.fromkeys(
        ("mandelbox_folding_limit", "mandelbox_folding_fixed_radius", "transf_folding_limit"), 1.0
    ),
    **dict.fromkeys(("platonic_solid_amplitude", "platonic_solid_frequency", "platonic_solid_rhoMul"), 1.0),
    **dict.fromkeys(("analyticDE_offset_2", "donut_ring_radius"), 1.0),
    **dict.fromkeys(("mandelbox_scale", "IFS_scale", "transf_folding_value", "transf_multiplication"), 2.0),
    **dict.fromkeys(("mandelbox_folding_value", "boxfold_bulbpow2_folding_factor"), 2.0),
    **dict.fromkeys(("mandelbox_folding_min_radius", "mandelbox_vary_minr"), 0.5),
    **dict.fromkeys(("mandelbox_sharpness", "donut_factor"), 3.0),
    **dict.fromkeys((*_OFF, "transf_rotation_enabled"), 0.0),
    **dict.fromkeys(("Cpara_iterA", "Cpara_iterB", "Cpara_iterC"), 250.0),
    **dict.fromkeys((f"transf_int8_{axis}" for axis in "XYZ"), 8.0),
    **dict.fromkeys((f"transf_int_3_{axis}" for axis in "XYZ"), 3.0),
    **dict.fromkeys(("IFS_offset", *(f"IFS_direction_{number}" for number in range(9))), (1.0, 0.0, 0.0)),
    **dict.fromkeys((f"IFS_{name}_{number}" for name in ("distance", "enabled") for number in range(9)), 0.0),
    **dict.fromkeys((f"IFS_intensity_{number}" for number in range(9)), 1.0),
    **dict.fromkeys(("mandelbox_color", "mandelbox_color_4D"), (0.03, 0.05, 0.07)),
    **dict.fromkeys(("mandelbox_color_Sp1", "mandelbox_color_Sp2"), 0.2),
    "mandelbox_color_R": 0.0,
    "power": 9.0,
    "cadd": -1.3,
    "boxfold_bulbpow2_z_factor": 5.0,
    "donut_number": 9.0,
    "donut_ring_thickness": 0.1,
    "transf_minR2_p25": 0.25,
    "transf_offset_0005": 0.005,
    "transf_offset_105": 1.5,
    "transf_scale_015": 1.5,
    "transf_scale_025": 0.25,
    "transf_pwr_8a": 8.0,
    "transf_addition_constant_111d5": (1.0, 1.0, 1.0, 0.5),
    "transf_constant_factor": (1.0, 2.0, 2.0),
    "transf_offset_1105": (1.0, 1.0, 0.5),
    "transf_offset_neg_1111": (-1.0,) * 4,
    "transf_power_025": (0.25,) * 3,
    "transf_power_8": (8.0,) * 3,
    "transf_scaleP_222": (0.2,) * 3,
}
CHOICES = ("_order_of_", "combo", "mandelbulbMulti_", "sinTan2Trig_", "mandelbox_generalized")
"""What begins with the first of several ways."""
_ZEROS = (
    "rotation",
    "IFS_edge",
    "mandelbox_offset",
    "mandelbox_color",
    "transf_constant_julia_c",
    "aboxMod1_foldM",
    "_direction",
)
_VECTORS = ("addition_constant", "constant_multiplier", "scale3D")


def folded(name: str) -> str:
    """A name without underscores, and without capitals but single ones: what is the same in fields and keys."""
    found = ""
    for place, letter in enumerate(name):
        if letter == "_":
            continue
        following = name[place + 1 : place + 2]
        begins = letter.isupper() and following.islower()
        found += letter.lower() if begins else letter
    return found


def default_of(key: str) -> Default:
    """The value of a key of a formula that a file does not give."""
    if key in OTHERS:
        return OTHERS[key]
    last = key.rpartition("_")[2]
    if any(name in key for name in CHOICES):
        return 0.0
    if last == "false":
        return 0.0
    if "enabled" in key:
        return 1.0
    digits = last.lstrip("ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz")
    digits = digits if digits.isdecimal() else ""
    if "start_iterations" in key:
        return float(digits or 0)
    if "stop_iterations" in key:
        return float(digits or 250)
    if any(name in key for name in _ZEROS):
        return (0.0, 0.0, 0.0)
    if any(name in key for name in _VECTORS) or (len(digits) >= 3 and digits[1:] != "05"):
        return _components(last, digits)
    if not digits:
        return 0.0
    return -_number(digits) if last.startswith("neg") else _number(digits)


def _components(last: str, digits: str) -> tuple[float, ...]:
    if not digits:
        return (0.0, 0.0, 0.0)
    sign = -1.0 if last.startswith("neg") else 1.0
    if len(digits) == 4 and len(set(digits[1:])) == 1 and digits[0] == "0" and digits[1] != "0":
        return (int(digits[1]) / 10,) * 3
    return tuple(sign * int(digit) if digit != "0" else 0.0 for digit in digits)


def _number(digits: str) -> float:
    if digits.startswith("0") and len(digits) > 1:
        return float("0." + digits[1:])
    return float(digits)
