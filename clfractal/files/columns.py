"""Reads tables of numbers: CSV files whose first row names the columns."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping
from pathlib import Path

from clfractal.errors import FileError, Where, unknown_name
from clfractal.files.regular import decode, read_bytes

MAX_TABLE_BYTES = 64_000_000
# Of a frame: seconds in tables are rounded.
_TOLERANCE = 0.25
_MOST_FRAMES = 1e9


def read_columns(path: Path, wanted: Mapping[str, None], name: str, fps: float) -> dict[str, list[float]]:
    """The wanted columns of a table with a row for each frame, as numbers in the order of the frames.

    A column `frame` says which frame a row belongs to, counted from 0. Where there is none, a column `time` does, in
    seconds. Where there is neither, rows are in their order.

    Args:
        path: the file.
        wanted: names of columns, as of a set with an order.
        name: how messages call the file.
        fps: frames per second.

    Raises:
        FileError: it cannot be read, is too large, has no such column, holds something else than finite numbers, or has no
            row or several for a frame before its last one.
    """
    text = decode(read_bytes(path, name=name, limit=MAX_TABLE_BYTES), name)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True, skipinitialspace=True)
    try:
        titles = [title.strip() for title in next(reader, [])]
        for title in wanted:
            if title not in titles:
                raise FileError(unknown_name("column", title, titles), Where(name, 1))
        rows: list[tuple[Where, list[str]]] = []
        blank = 0
        for row in reader:
            if not any(cell.strip() for cell in row):
                blank = blank or reader.line_num
                continue
            if blank:  # else later rows would come a frame too early
                raise FileError("must have a row for each frame, without blank ones", Where(name, blank))
            rows.append((Where(name, reader.line_num), row))
    except csv.Error as error:
        raise FileError(f"is no CSV table: {error}", Where(name, reader.line_num)) from error
    by = next((title for title in ("frame", "time") if title in titles), None)
    if by is not None:
        place = titles.index(by)
        rows = _in_order(rows, [_frame(row, place, by, fps, where) for where, row in rows], by)
    places = {title: titles.index(title) for title in wanted}
    return {
        title: [_number(row, place, title, where) for where, row in rows] for title, place in places.items()
    }


def _frame(row: list[str], place: int, title: str, fps: float, where: Where) -> int:
    """The frame that a row says it belongs to."""
    number = _number(row, place, title, where)
    frame = number * fps if title == "time" else number
    # (What is beyond all films may be beyond whole numbers, too.)
    is_one = -_TOLERANCE <= frame <= _MOST_FRAMES and abs(frame - round(frame)) <= (
        _TOLERANCE if title == "time" else 0
    )
    if not is_one:
        what = f"of {fps:g} a second" if title == "time" else "counted from 0"
        raise FileError(f"column {title!r} must tell a frame {what}, got {row[place].strip()[:40]!r}", where)
    return round(frame)


def _in_order(
    rows: list[tuple[Where, list[str]]], frames: list[int], by: str
) -> list[tuple[Where, list[str]]]:
    """The rows in the order of their frames, of which each has one."""
    order = sorted(range(len(rows)), key=lambda index: frames[index])
    for wanted, index in enumerate(order):
        where, frame = rows[index][0], frames[index]
        if frame < wanted:
            other = rows[order[wanted - 1]][0].line
            raise FileError(f"column {by!r} has frame {frame} twice, in line {other} too", where)
        if frame > wanted:
            raise FileError(f"column {by!r} leaves out frame {wanted}, before frame {frame}", where)
    return [rows[index] for index in order]


def _number(row: list[str], place: int, title: str, where: Where) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise FileError(f"column {title!r} must hold finite numbers, got {text[:40]!r}", where)
    return number
