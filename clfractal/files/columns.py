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


def read_columns(path: Path, wanted: Mapping[str, None], name: str) -> dict[str, list[float]]:
    """The wanted columns of a table, as numbers.

    Args:
        path: the file.
        wanted: names of columns, as of a set with an order.
        name: how messages call the file.

    Raises:
        FileError: it cannot be read, is too large, has no such column, or holds something else than finite numbers.
    """
    text = decode(read_bytes(path, name=name, limit=MAX_TABLE_BYTES), name)
    rows = csv.reader(io.StringIO(text, newline=""), strict=True, skipinitialspace=True)
    try:
        titles = [title.strip() for title in next(rows, [])]
        for title in wanted:
            if title not in titles:
                raise FileError(unknown_name("column", title, titles), Where(name, 1))
        places = {title: titles.index(title) for title in wanted}
        found: dict[str, list[float]] = {title: [] for title in wanted}
        blank = 0
        for row in rows:
            if not any(cell.strip() for cell in row):
                blank = blank or rows.line_num
                continue
            if blank:  # else later rows would come a frame too early
                raise FileError("must have a row for each frame, without blank ones", Where(name, blank))
            for title, place in places.items():
                found[title].append(_number(row, place, title, Where(name, rows.line_num)))
    except csv.Error as error:
        raise FileError(f"is no CSV table: {error}", Where(name, rows.line_num)) from error
    return found


def _number(row: list[str], place: int, title: str, where: Where) -> float:
    text = row[place].strip() if place < len(row) else ""
    try:
        number = float(text)
    except ValueError:
        number = math.nan
    if not math.isfinite(number):
        raise FileError(f"column {title!r} must hold finite numbers, got {text[:40]!r}", where)
    return number
