"""Structs shared with kernels, declared once: NumPy dtype and OpenCL C text come from the same fields."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

Precision = Literal["float32", "float64"]
FieldType = Literal["real", "int", "uint", "float", "double"]

_C_REAL: dict[Precision, str] = {"float32": "float", "float64": "double"}
_NUMPY: dict[str, str] = {"int": "int32", "uint": "uint32", "float": "float32", "double": "float64"}


@dataclass(frozen=True, slots=True)
class Field:
    """A scalar (`count` 0) or an array of scalars; `meaning` tells unit and space and becomes its comment in
    C.

    `real` is float or double, by the program's precision. There are no OpenCL vectors in structs: a `float3`
    takes the room of four, and drivers have disagreed about it.
    """

    name: str
    type: FieldType
    count: int = 0
    meaning: str = ""


@dataclass(frozen=True, slots=True)
class Struct:
    """A struct of `fields`, in order, laid out by the rules of C; `kinds`: numbers that they hold, by their names in C."""

    name: str
    fields: tuple[Field, ...]
    kinds: tuple[tuple[str, int], ...]

    def __init__(self, name: str, fields: Iterable[Field], kinds: Iterable[tuple[str, int]] = ()) -> None:
        object.__setattr__(self, "name", name)
        object.__setattr__(self, "fields", tuple(fields))
        object.__setattr__(self, "kinds", tuple(kinds))
        names = [field.name for field in self.fields]
        if not names or len(set(names)) != len(names):
            raise ValueError(f"struct {name}: needs fields with different names")

    def dtype(self, precision: Precision) -> np.dtype[np.void]:
        """The NumPy dtype with the layout that a C compiler gives the struct."""
        described: list[Any] = []
        for field in self.fields:
            scalar = precision if field.type == "real" else _NUMPY[field.type]
            described.append((field.name, scalar, (field.count,)) if field.count else (field.name, scalar))
        return np.dtype(described, align=True)

    def c_text(self, precision: Precision | None = None) -> str:
        """The declaration; in C both `Name` and `struct Name` can be written.

        Without a precision, fields of type `real` get the type `scalar` of `lanes.h`, which must
        stand before.
        """
        return "\n".join(self._c_lines(precision)) + "\n"

    def value(self, precision: Precision, values: Mapping[str, object]) -> npt.NDArray[np.void]:
        """A zero-dimensional record holding `values`, one for each field, ready to be a kernel's argument.

        Raises:
            ValueError: a field is missing or unknown, or an array has another length.
        """
        return self.array(precision, [values]).reshape(())

    def array(self, precision: Precision, records: Iterable[Mapping[str, object]]) -> npt.NDArray[np.void]:
        """A one-dimensional array of records, as for a buffer of lights; see `value`."""
        rows = list(records)
        result = np.zeros(len(rows), self.dtype(precision))
        expected = {field.name for field in self.fields}
        for index, row in enumerate(rows):
            if set(row) != expected:
                wrong = ", ".join(sorted(set(row) ^ expected))
                raise ValueError(f"struct {self.name}: missing or unknown fields: {wrong}")
            for field in self.fields:
                value = np.asarray(row[field.name])
                if value.shape != ((field.count,) if field.count else ()):
                    raise ValueError(f"struct {self.name}.{field.name}: wrong shape {value.shape}")
                result[field.name][index] = value
        return result

    def _c_lines(self, precision: Precision | None) -> Iterator[str]:
        for kind, number in self.kinds:
            yield f"#define {kind} {number}"
        yield f"typedef struct {self.name} {{"
        for field in self.fields:
            real = _C_REAL[precision] if precision is not None else "scalar"
            scalar = real if field.type == "real" else field.type
            length = f"[{field.count}]" if field.count else ""
            comment = f"  // {field.meaning}" if field.meaning else ""
            yield f"    {scalar} {field.name}{length};{comment}"
        yield f"}} {self.name};"
