"""A luminaire as it was measured, from a file of the IES's format LM-63 (1986 to 2002)."""

import re
from collections.abc import Sequence
from math import isfinite
from pathlib import Path
from typing import Annotated, Literal, NoReturn

from pydantic import Field

from clfractal.errors import FileError, Where
from clfractal.files.regular import read_bytes
from clfractal.schema.base import Amount, Direction, Position, cross, length, problem, rule, unit
from clfractal.schema.light import AXIS, SmallLight
from clfractal.schema.record import Number

_TYPES = {1: "C", 2: "B", 3: "A"}
# Of angles; values are at most as many as a file may have.
_MOST = 3601


class IesLight(SmallLight):
    """Light of a luminaire as it was measured: a file of IES LM-63 says how strong it is in each direction.

    Between the file's angles it is mixed linearly; outside of them it is dark.
    """

    title = "IES"
    about = "of a measured luminaire"
    place = 35
    numbers = (
        AXIS,
        Number("zero", "real", 3, "of a luminaire: across the axis, where horizontal angles are 0, length 1"),
    )
    type: Literal["ies"] = "ies"
    intensity: Amount = Field(
        1.0, description="factor on the colour: what arrives at a distance of 1 for each 1000 candela"
    )
    file: Annotated[str, Field(strict=True, min_length=1, max_length=1000)] | None = Field(
        None,
        description="an LM-63 file, in the scene's folder or below; null: 1000 candela in all directions",
    )
    position: Position = Field(description="scene units")
    direction: Direction = Field(
        (0.0, 0.0, -1.0), description="where vertical angles are 0: down, for most luminaires"
    )
    up: Direction = Field(
        (0.0, 1.0, 0.0), description="about where horizontal angles are 0; not along `direction`"
    )

    @rule
    def _has_a_frame(self) -> None:
        if length(cross(unit(self.direction), unit(self.up))) < 1e-6:
            raise problem("must not be along direction", "up")

    def given(self, away: float) -> float:
        """As of every light."""
        return 1 / away**2

    @property
    def reads(self) -> str | None:
        """As of every light."""
        return self.file

    @classmethod
    def table_of(cls, path: Path) -> Sequence[float]:
        """How many vertical and horizontal angles, these in degrees, and a row of values for each horizontal one.

        Horizontal angles go from 0 to 360, whatever symmetry the file has; values are thousands of candela.
        """
        vertical, rows = _read(path)
        horizontal = sorted(rows)
        values = [value / 1000 for angle in horizontal for value in rows[angle]]
        return [len(vertical), len(horizontal), *vertical, *horizontal, *values]

    @classmethod
    def most_of(cls, table: Sequence[float]) -> float:
        """As of every light."""
        angles = int(table[0]) + int(table[1])
        return float(max(table[2 + angles :]))

    def packed(self) -> dict[str, object]:
        """As of every light."""
        axis = unit(self.direction)
        side = unit(cross(axis, self.up))
        return {**super().packed(), "inverse_square": 1, "axis": axis, "zero": unit(cross(side, axis))}


def _read(path: Path) -> tuple[list[float], dict[float, list[float]]]:
    """The vertical angles, and for each horizontal one the candela at these."""
    lines = read_bytes(path).decode("latin-1").splitlines()
    begin = _tilt_line(path, lines)
    numbers = _Numbers(path, lines, begin)
    tilt = _tilt(numbers, lines[begin - 1].split("=", 1)[1].strip())
    numbers.some("the number of lamps", "the lumens of a lamp")
    multiplier = numbers.number("the candela multiplier", least=0)
    vertical_count = numbers.whole("the number of vertical angles", 2, _MOST)
    horizontal_count = numbers.whole("the number of horizontal angles", 1, _MOST)
    kind = numbers.whole("the photometric type", 1, 3)
    if kind != 1:
        numbers.refuse(f"photometry is of type {_TYPES[kind]}; only type C (1) is read")
    numbers.some("the units", "the width", "the length", "the height")
    ballast = numbers.number("the ballast factor", least=0) * numbers.number("the lamp's factor", least=0)
    numbers.some("the watts")
    vertical = numbers.angles(vertical_count, "vertical")
    if vertical[0] not in (0, 90) or vertical[-1] not in (90, 180):
        numbers.refuse(
            f"vertical angles must go from 0 or 90 to 90 or 180, got {vertical[0]:g} to {vertical[-1]:g}"
        )
    horizontal = numbers.angles(horizontal_count, "horizontal")
    if (horizontal[0], horizontal[-1]) not in ((0, 0), (0, 90), (0, 180), (0, 360), (90, 270)):
        numbers.refuse(
            "horizontal angles must be 0, or go from 0 to 90, 180 or 360, or from 90 to 270, "
            f"got {horizontal[0]:g} to {horizontal[-1]:g}"
        )
    factor = multiplier * ballast * tilt
    rows = {
        angle: [factor * numbers.number("a candela value", least=0) for _ in vertical] for angle in horizontal
    }
    numbers.end()
    return vertical, _around(rows)


def _around(rows: dict[float, list[float]]) -> dict[float, list[float]]:
    """The same for all horizontal angles from 0 to 360, by the symmetry that the file's last one tells."""
    first, last = min(rows), max(rows)
    if last == 0:
        return {0.0: rows[0], 360.0: rows[0]}
    if first == 90:
        rows = {**{(540 - angle) % 360: row for angle, row in rows.items()}, **rows}
        return {**rows, 360.0: rows[0]} if 0 in rows else _closed(rows)
    if last == 90:
        rows = {**rows, **{180 - angle: row for angle, row in rows.items()}}
    if last <= 180:
        rows = {**rows, **{360 - angle: row for angle, row in rows.items()}}
    return rows


def _closed(rows: dict[float, list[float]]) -> dict[float, list[float]]:
    """With a row at 0 and 360, between the last and the first one that are there."""
    low, high = min(rows), max(rows)
    share = (360 - high) / (low + 360 - high)
    row = [a + share * (b - a) for a, b in zip(rows[high], rows[low], strict=True)]
    return {0.0: row, **rows, 360.0: row}


def _tilt_line(path: Path, lines: Sequence[str]) -> int:
    """The number of the line TILT=, from 1; before it are a header and keywords, or before 1991 any labels."""
    has_keywords = bool(lines) and lines[0].strip().startswith("IES")
    for number, line in enumerate(lines, 1):
        text = line.strip()
        if text.startswith("TILT="):
            return number
        if has_keywords and number > 1 and text and not text.startswith("["):
            raise FileError(f"must be a [KEYWORD] or TILT=, got {text[:40]!r}", Where(str(path), number))
    raise FileError("has no line TILT=, as files of IES LM-63 have", Where(str(path)))


def _tilt(numbers: "_Numbers", given: str) -> float:
    """The factor of a lamp that is not tilted. (Scenes have no plumb line: luminaires stand as they were measured.)"""
    if given == "NONE":
        return 1.0
    if given != "INCLUDE":
        numbers.refuse(f"TILT must be NONE or INCLUDE, got {given[:40]!r}")
    numbers.whole("the lamp's geometry", 1, 3)
    count = numbers.whole("the number of tilts", 1, _MOST)
    angles = numbers.angles(count, "tilt")
    factors = [numbers.number("a tilt's factor", least=0) for _ in angles]
    return factors[0]


class _Numbers:
    """The numbers behind the line TILT=, one after the other, whatever lines they are on."""

    def __init__(self, path: Path, lines: Sequence[str], begin: int) -> None:
        self._path, self._line, self._last = path, begin, len(lines)
        self._tokens = (
            (text, number)
            for number, line in enumerate(lines[begin:], begin + 1)
            for text in re.split(r"[\s,]+", line)
            if text
        )

    def refuse(self, message: str) -> NoReturn:
        """Raises FileError at the line of the last number."""
        raise FileError(message, Where(str(self._path), self._line))

    def number(self, what: str, least: float | None = None) -> float:
        """The next one."""
        text, self._line = next(self._tokens, ("", self._last))
        if not text:
            self.refuse(f"ends before {what}")
        try:
            found = float(text)
        except ValueError:
            found = float("nan")
        if not isfinite(found):
            self.refuse(f"{what} must be a number, got {text[:40]!r}")
        if least is not None and found < least:
            self.refuse(f"{what} must be at least {least:g}, got {found:g}")
        return found

    def some(self, *what: str) -> None:
        """Numbers that do not matter here."""
        for each in what:
            self.number(each)

    def whole(self, what: str, low: int, high: int) -> int:
        """The next one, a count."""
        found = self.number(what)
        if not (found.is_integer() and low <= found <= high):
            self.refuse(f"{what} must be a whole number, {low} to {high}, got {found:g}")
        return int(found)

    def angles(self, count: int, what: str) -> list[float]:
        """The next ones, which must rise."""
        found: list[float] = []
        for _ in range(count):
            angle = self.number(f"a {what} angle")
            if found and angle <= found[-1]:
                self.refuse(f"{what} angles must rise, got {angle:g} after {found[-1]:g}")
            found.append(angle)
        return found

    def end(self) -> None:
        """Nothing may be left."""
        text, self._line = next(self._tokens, ("", self._line))
        if text:
            self.refuse(f"must end behind the candela values, got {text[:40]!r}")
