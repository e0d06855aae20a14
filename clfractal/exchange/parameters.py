"""The numbers that a formula's text reads: fields of its parameters, by the keys of a settings file."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from functools import cache

from clfractal.errors import FileError
from clfractal.exchange.defaults import GROUPS, KEYS, OTHERS, default_of, folded
from clfractal.exchange.polyhedra import faces
from clfractal.exchange.settings import Section

Vector = tuple[float, ...]
Matrix = tuple[Vector, Vector, Vector]
Found = float | Vector | Matrix | tuple[Vector, ...]

IGNORED = ("mandelbox.color",)
"""What chooses colours alone."""
_OFF = "foldColor."
"""Whether colours are counted: as if they were not, where nobody asks for them."""
_BOX_COLORS = {"factor": "", "factorR": "_R", "factorSp1": "_Sp1", "factorSp2": "_Sp2", "factor4D": "_4D"}
_LOOSE_OTHERS = {folded(key).lower(): key for key in OTHERS}
_RADII = ("mandelbox_folding_fixed_radius", "mandelbox_folding_min_radius")


class UnknownFieldError(Exception):
    """A field that no key is known for."""


class Parameters:
    """The fields of a formula's parameters, with the values of a section and the defaults of what it leaves out.

    Args:
        colors: whether those of colours count.
        solids: whether what the formula says of solids in space does.
    """

    def __init__(
        self, section: Section, choices: Mapping[str, int], *, colors: bool = False, solids: bool = True
    ) -> None:
        self.section, self.choices, self.colors, self.solids = section, choices, colors, solids

    def value(self, path: str, indices: Sequence[int] = ()) -> Found:
        """A field, such as `transformCommon.scale3`; of an array with its indices.

        Vectors have four numbers, conditions are 1 or 0.

        Raises:
            UnknownFieldError: no key is known for it.
            FileError: its value is none of its kind.
        """
        group, _, name = path.partition(".")
        if path.startswith(_OFF) and not self.colors:
            return 0.0
        if group == "IFS":
            found = self._of_ifs(name, indices)
        elif group == "mandelbox":
            found = self._of_box(name, indices)
        elif group == "genFoldBox":
            found = self._of_fold(name)
        else:
            found = self._derived(path)
        if found is not None:
            return found
        if indices:
            raise UnknownFieldError(path)
        return self.read(self._key(path))

    def read(self, key: str) -> Found:
        """The value of a key; a vector is filled up to four numbers."""
        default = default_of(key)
        if isinstance(default, tuple):
            size = max(len(default), min(len(self.section.text(key).split()), 4))
            found = self.section.numbers(key, (*default, 0.0, 0.0, 0.0, 0.0)[:size])
            return (*found, 0.0, 0.0, 0.0)[:4]
        words = self.section.text(key).split()
        if words and words[0].lower() in ("true", "false"):
            return float(self.section.flag(key, bool(default)))
        if len(words) == 1 and words[0][0].isalpha():
            return self._choice(key, words[0])
        if len(words) > 1:  # a vector that the rules for defaults do not know as one
            found = self.section.numbers(key, (0.0, 0.0, 0.0, 0.0))
            return (*found, 0.0, 0.0, 0.0)[:4]
        return self.section.number(key, default)

    def _choice(self, key: str, word: str) -> float:
        """A way to do something, as old files name it: `type2`, `combo_mode1`, or a word of the texts' own names."""
        word = word.removeprefix("combo_")
        if word.startswith("type") and word[4:].isdecimal() and len(word) < 8:
            return float(int(word[4:]) - 1)
        names = {
            name: number
            for name, number in self.choices.items()
            if name.endswith(f"_{word}") or folded(name.rpartition("_")[2]) == folded(word)
        }
        found = set(names.values())
        if len(found) > 1:  # `multi_OrderOfXYZCl_zxy` is meant by `..._order_of_xyz zxy`
            kinds = {name: name.split("_")[-2].removesuffix("Cl").lower() for name in names}
            wanted = folded(key).lower()
            found = {names[name] for name, kind in kinds.items() if kind in wanted}
        if len(found) != 1:
            raise FileError(f"must be a number, got {word[:40]!r}", self.section.where(key))
        return float(found.pop())

    def _key(self, path: str) -> str:
        if path in KEYS:
            return KEYS[path]
        group, _, name = path.partition(".")
        start = GROUPS.get(group, group)
        wanted = folded(f"{start}_{name}")
        given = {folded(key): key for key in self.section.entries}
        if wanted in given:
            return given[wanted]
        loose = {key.lower(): value for key, value in given.items()}
        if wanted.lower() in loose and _is_unambiguous(name):
            return loose[wanted.lower()]
        return _LOOSE_OTHERS.get(wanted.lower(), _spelled(start, name))

    def _derived(self, path: str) -> Found | None:
        name = path.partition(".")[2]
        if path.startswith("bulb.") and name.endswith("AngleOffset"):
            return math.radians(_scalar(self.read(self._key(path))))
        if path == "transformCommon.maxMinR2factor":
            low = _scalar(self.read("transf_minR2_p25"))
            return _scalar(self.read("transf_maxR2_1")) / low if low else 0.0
        if path == "transformCommon.sqtR":
            return math.sqrt(max(_scalar(self.read("transf_minimum_radius_05")), 0.0))
        if path == "transformCommon.mboxFactor1":  # what joins the two sides of the ball of radius sqtR
            radius = _scalar(self.read("transf_minimum_radius_05"))
            return 1 / math.sqrt(radius) if radius > 0 else 0.0
        if name in ("rotationMatrix", "rotationMatrix2"):
            return rotation(self.read("transf_rotation" + name.removeprefix("rotationMatrix")))
        if name.endswith("Matrix"):
            raise UnknownFieldError(path)
        return None

    def _of_fold(self, name: str) -> Found | None:
        kind, _, solid = name.partition("_")
        found = faces(solid)
        if kind in ("Nv", "sides") and found is None:
            raise UnknownFieldError(f"genFoldBox.{name}")
        return found if kind == "Nv" else float(len(found)) if found and kind == "sides" else None

    def _of_box(self, name: str, indices: Sequence[int]) -> Found | None:
        outer, inner = (_scalar(self.read(key)) ** 2 for key in _RADII)
        if name == "fR2":
            return outer
        if name == "mR2":
            return inner
        if name == "mboxFactor1":
            return outer / inner if inner else 0.0
        if name == "mainRot":
            return rotation(self.read("mandelbox_rotation_main"))
        color = _BOX_COLORS.get(name.removeprefix("color.")) if name.startswith("color.") else None
        if color is not None:
            return self.read(f"mandelbox_color{color}")
        if name in ("rot", "rotinv") and len(indices) == 2:
            found = rotation(self.read(f"mandelbox_rotation_{('neg', 'pos')[indices[0]]}_{indices[1] + 1}"))
            return found if name == "rot" else transposed(found)
        return None

    def _of_ifs(self, name: str, indices: Sequence[int]) -> Found | None:
        if name == "mainRot":
            return _rotation_of_ifs(self.read("IFS_rotation"))
        if name == "edge":
            return self.read("IFS_edge")  # whether or not `IFS_edge_enabled` stands there
        if len(indices) == 1:
            number = indices[0]
            if name == "rot":
                return _rotation_of_ifs(self.read(f"IFS_rotations_{number}"))
            if name == "direction":
                found = self.read(f"IFS_direction_{number}")
                assert isinstance(found, tuple)
                length = math.hypot(*(float(each) for each in found[:3] if isinstance(each, float)))
                return tuple(each / length for each in found if isinstance(each, float)) if length else found
            if name in ("enabled", "distance", "intensity"):
                return self.read(f"IFS_{name}_{number}")
        return None


def rotation(angles: Found) -> Matrix:
    """The matrix of three angles in degrees, about x, y and z: Rz Ry Rx, as depths of theirs show."""
    x, y, z = (_about(axis, angle) for axis, angle in enumerate(_radians(angles)))
    return times(times(z, y), x)


def _rotation_of_ifs(angles: Found) -> Matrix:
    """The same of kaleidoscopic sets, whose angles are about z, y and x."""
    assert isinstance(angles, tuple)
    return rotation((*angles[2::-1], 0.0))


def _radians(angles: Found) -> tuple[float, float, float]:
    assert isinstance(angles, tuple)
    one, two, three = (math.radians(each) if isinstance(each, float) else 0.0 for each in angles[:3])
    return one, two, three


def _about(axis: int, angle: float) -> Matrix:
    c, s = math.cos(angle), math.sin(angle)
    if axis == 0:
        return (1.0, 0.0, 0.0), (0.0, c, -s), (0.0, s, c)
    if axis == 1:
        return (c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)
    return (c, -s, 0.0), (s, c, 0.0), (0.0, 0.0, 1.0)


def times(a: Matrix, b: Matrix) -> Matrix:
    """The product of two matrices."""
    one, two, three = (
        tuple(sum(row[k] * b[k][column] for k in range(3)) for column in range(3)) for row in a
    )
    return one, two, three


def transposed(a: Matrix) -> Matrix:
    """A matrix with rows and columns in exchange."""
    one, two, three = zip(*a, strict=True)
    return one, two, three


def _scalar(value: Found) -> float:
    assert isinstance(value, float)
    return value


def _is_unambiguous(name: str) -> bool:
    """Whether capitals do not tell it from another one, as they tell `functionEnabledX` from `functionEnabledx`."""
    return "Enabled" not in name and "Iterations" not in name


@cache
def _spelled(start: str, name: str) -> str:
    """The key of a field as keys are spelled: `offsetA111` of `transf` is `transf_offsetA_111`."""
    found = start
    for place, letter in enumerate(name):
        before, after = name[place - 1 : place], name[place + 1 : place + 2]
        begins = letter.isupper() and after.islower()
        digit = letter.isdigit() and not before.isdigit() and place > 0 and before != "R"
        single = letter.isupper() and not after.islower() and "Iterations" in name and before.islower()
        found += ("_" if (begins or digit or single or place == 0) and found else "") + (
            letter.lower() if begins else letter
        )
    return found
