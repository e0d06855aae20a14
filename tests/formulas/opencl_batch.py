"""Many formulas in one program, since every build costs seconds: each text's own names get a number."""

from __future__ import annotations

import re
from collections.abc import Sequence
from functools import lru_cache
from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.select import Device
from clfractal.device.structs import Precision
from clfractal.files.resources import folder
from clfractal.formulas.opencl import FormulaText
from clfractal.integrators.declarations import struct_text
from tests.small_kernels import Floats, SmallKernels

_DEFINED = re.compile(
    r"^(?:(?:INLINE|CALLED)(?: __attribute__\(\(\w+\)\))? \w+|__kernel void|#define|#undef) (\w+)"
    r"|^(?:\}|typedef [\w(), ]+) (\w+);|^STAGE\((\w+)\)",
    re.MULTILINE,
)
_INCLUDES = re.compile(
    r'^#include "(?:[a-z]+/)*(?:lanes|vectors|structs|formula|(?:\w+_)?orbits?|distances|solids|numbers/\w+)\.h"\n',
    re.MULTILINE,
)

_ORBITS = (
    "formulas/orbit.h",
    "formulas/packet_orbits.h",
    "formulas/dual_orbits.h",
    "formulas/scalar_orbits.h",
    "formulas/distances.h",
    "formulas/solids.h",
)

HEAD = "".join(
    f'#include "{name}"\n'
    for name in (
        "device/lanes.h",
        "formulas/numbers/real.h",
        "formulas/numbers/powers.h",
        "formulas/numbers/quick.h",
        "device/vectors.h",
        "structs.h",
    )
)


def kernel_file(name: str) -> str:
    """A file of the kernels folder without the headers that every program here begins with."""
    return _INCLUDES.sub("", (folder("kernels") / name).read_text(encoding="utf-8"))


def orbit_files(*behind: str) -> str:
    """The files that ask formulas by themselves, in the order in which they include each other, and others behind them."""
    return "".join(map(kernel_file, (*_ORBITS, *behind)))


def numbered(text: str, number: int) -> str:
    """The text with `_f<number>` after every name that it defines (but not after members, `light->color`).

    JOINED stays as it is: all formulas of a batch stand alone, and headers that they share read it. So do the numbers
    of shapes, which are the same for all.
    """
    names = {name for found in _DEFINED.findall(text) for name in found if name} - {"JOINED"}
    names = {name for name in names if not name.startswith("SHAPE_")}
    for listed in re.findall(r"^enum \{([^}]*)\};", text, re.MULTILINE):
        names |= set(re.findall(r"\w+", listed))
    pattern = rf"(?<!->)\b({'|'.join(sorted(names, key=len, reverse=True))})\b"
    picked = re.findall(r"^NUMBERS_PICKED\((\w+)\)", text, re.MULTILINE)
    text = re.sub(pattern, rf"\1_f{number}", text)
    # Names that macros put together: those of a shape's functions, and of what picks one of two structs.
    text = re.sub(r"\b(name##_\w+)", rf"\1_f{number}", text)
    for struct in picked:
        text = re.sub(rf"\b{struct}_pick\b", f"{struct}_f{number}_pick", text)
    return text


def batch_text(formulas: Sequence[FormulaText], tail: str) -> str:
    """All formulas, each followed by `tail`, which may use its functions; kernel k of formula 3 is `k_f3`."""
    parts = [numbered(formula.text + tail, number) for number, formula in enumerate(formulas)]
    return HEAD + "\n".join(parts)


@lru_cache(maxsize=8)
def formula_kernels(
    device: Device, text: str, precision: Precision, lanes: int, flags: tuple[str, ...] = ()
) -> SmallKernels:
    """The program of a generated text, which tests in turn ask for again."""
    return SmallKernels(device, text, precision, lanes, generated={"structs.h": struct_text()}, flags=flags)


def at_points(
    kernels: SmallKernels,
    name: str,
    points: Floats,
    planes: int,
    *constants: npt.NDArray[Any] | np.int32,
    kind: str | None = None,
) -> npt.NDArray[Any]:
    """Runs a kernel (points, result, stride, constants...) and gives its planes, shape (planes, n).

    Args:
        points: of shape (n, 3).
        kind: type of the result's numbers; None: the one of the points.
    """
    given = kernels.planes(points.T)
    count = given.shape[1]
    result = np.full((planes, count), np.nan if kind is None else -1, kind or kernels.precision)
    kernels.run(name, given, result, np.int32(count), *constants, result=result)
    return result[:, : len(points)]
