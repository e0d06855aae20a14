"""Edits of a text that are collected first, by offsets into the text as it was, and then made together."""

from __future__ import annotations

import re
from collections.abc import Sequence

from clfractal.files.spans import Mapping, UnusualError, skip_blank
from clfractal.files.spans import Sequence as ListSpan

_LINE_END = re.compile(r"\r\n|\n|\r|\Z")


class Edits:
    """Replacements and removals of one text; an insertion is a replacement of nothing."""

    def __init__(self, text: str) -> None:
        self.text = text
        self.newline = "\r\n" if "\r\n" in text else "\n"
        self._replaced: list[tuple[int, int, str]] = []
        self._removed: list[tuple[int, int]] = []

    def applied(self) -> str:
        """The text with all edits; insertions at one place stand in the order in which they were asked for.

        Raises:
            UnusualError: two edits concern the same characters.
        """
        removed: list[tuple[int, int]] = []
        for start, end in sorted(self._removed):
            if removed and start < removed[-1][1]:
                removed[-1] = (removed[-1][0], max(end, removed[-1][1]))
            else:
                removed.append((start, end))
        edits = [*self._replaced, *((start, end, "") for start, end in removed if start < end)]
        # (The sort is stable. What is inserted where a removal begins comes first.)
        edits.sort(key=lambda edit: (edit[0], edit[1] > edit[0]))
        pieces, place = [], 0
        for start, end, new in edits:
            if start < place:
                raise UnusualError("two edits of the same characters")
            pieces += [self.text[place:start], new]
            place = end
        return "".join([*pieces, self.text[place:]])

    def replace(self, start: int, end: int, new: str) -> None:
        """Other characters in the place of [start, end)."""
        if self.text[start:end] != new:
            self._replaced.append((start, end, new))

    def remove(self, start: int, end: int) -> None:
        """Nothing in the place of [start, end); removals may overlap."""
        self._removed.append((start, end))

    # --- lines ---

    def column(self, position: int) -> int:
        """How many characters of its line stand before a position."""
        return position - self._line_start(position)

    def next_line(self, position: int) -> int:
        """The offset where the line after a position's begins; the text's length if there is none."""
        return self._line_end(position)[1]

    def insert_lines_after(self, position: int, lines: Sequence[str]) -> None:
        """New lines below the line of a position."""
        if not lines:
            return
        end, start = self._line_end(position)
        joined = self.newline.join(lines)
        self.replace(start, start, joined + self.newline if start > end else self.newline + joined)

    def insert_before(self, position: int, lines: Sequence[str]) -> None:
        """New lines in front of what begins at a position; if something precedes it in its line, from there on."""
        column = self.column(position)
        joined = self.newline.join(lines)
        if self.text[position - column : position].strip():
            self.replace(position, position, joined[column:] + self.newline + " " * column)
        else:
            self.replace(position - column, position - column, joined + self.newline)

    def block_remove(
        self, starts: Sequence[int], ends: Sequence[int], gone: Sequence[int], *, listed: bool
    ) -> None:
        """Removes entries of a list with dashes (`listed`) or of a mapping without braces; at least one stays.

        The comments beside and above them go too. A comment above the first entry may tell about all of them, so it
        stays, unless it is a list of which the second entry has a comment too.
        """
        for index in gone:
            start = starts[index]
            line = self._line_start(start)
            if self.text[line:start].strip():
                # It shares its line with the dash of an outer list, which the next entry takes over.
                self.remove(start, next(starts[i] for i in range(len(starts)) if i > index and i not in gone))
                continue
            several = (
                listed and len(starts) > 1 and self._first_comment(starts[1]) < self._line_start(starts[1])
            )
            self.remove(
                self._first_comment(start) if index > 0 or several else line, self.next_line(ends[index])
            )

    def _first_comment(self, start: int) -> int:
        """Where the comment lines directly above an entry begin; its own line if there are none."""
        line = self._line_start(start)
        marker = " " * (start - line) + "#"
        while line > 0 and self.text.startswith(marker, above := self._previous_line(line)):
            line = above
        return line

    def _previous_line(self, line: int) -> int:
        back = 2 if self.text[:line].endswith("\r\n") else 1
        return self._line_start(line - back)

    def _line_start(self, position: int) -> int:
        return max(self.text.rfind("\n", 0, position), self.text.rfind("\r", 0, position)) + 1

    def _line_end(self, position: int) -> tuple[int, int]:
        """The offset of the line break after a position, and the offset after it."""
        found = _LINE_END.search(self.text, position)
        assert found is not None
        return found.start(), found.end()

    # --- brackets and braces ---

    def flow_insert(
        self, node: Mapping | ListSpan, cores: Sequence[tuple[int, int]], place: int, new: Sequence[str]
    ) -> None:
        """New entries before the entry number `place`, or behind the last one.

        Args:
            node: what is in brackets or braces; it has entries.
            cores: where each entry begins and ends.
        """
        if not new:
            return
        neighbour = min(place, len(cores) - 1)
        start, end = cores[neighbour]
        before = self.text[cores[neighbour - 1][1] if neighbour else node.start : start]
        apart = "\n" in before or "\r" in before
        gap = self.newline + " " * self.column(start) if apart else " "
        if place < len(cores):
            self.replace(start, start, "".join(f"{entry},{gap}" for entry in new))
            return
        comma = self._comma(end)
        line_end = self._line_end(end)[0]
        if apart and skip_blank(self.text, end if comma < 0 else comma + 1) >= line_end:
            # Every entry has its own line, and so has the bracket: comments stay beside their entries.
            if comma < 0:
                self.replace(end, end, ",")
            joined = f",{gap}".join(new) + ("," if comma >= 0 else "")
            self.replace(line_end, line_end, gap + joined)
            return
        self.replace(end, end, "".join(f",{gap}{entry}" for entry in new))

    def flow_remove(
        self, node: Mapping | ListSpan, cores: Sequence[tuple[int, int]], gone: Sequence[int]
    ) -> None:
        """Removes entries with their commas and the comments beside them; at least one entry stays."""
        left = [index for index in range(len(cores)) if index not in gone]
        for index in gone:
            start, end = cores[index]
            if index < left[-1]:
                self.remove(start, self._next_in_flow(end))
        tail = [index for index in gone if index > left[-1]]
        if not tail:
            return
        comma = self._comma(cores[left[-1]][1])
        first, last = cores[tail[0]][0], cores[tail[-1]][1]
        trailing = self._comma(last)
        end = last if trailing < 0 else trailing + 1
        line_end = self._line_end(end)[0]
        alone = skip_blank(self.text, end) >= line_end
        between = self.text[comma + 1 : first]
        self.remove(comma, comma + 1)
        # A comment beside the entry that stays is kept; if the bracket follows, then with its line break.
        kept = len(between.rstrip()) if alone else len(between)
        self.remove(comma + 1 + kept if between.strip() else comma, line_end if alone else end)

    def _next_in_flow(self, end: int) -> int:
        """Where the comments of the entry after one that ends here begin, or that entry itself."""
        comma = self._comma(end)
        position = comma + 1
        line_end = self._line_end(position)[0]
        if skip_blank(self.text, position) >= line_end:
            position = line_end
        while position < len(self.text) and self.text[position] in " \t\r\n":
            position += 1
        return position

    def _comma(self, end: int) -> int:
        """The offset of the comma behind an entry that ends at `end`; -1 if there is none."""
        position = skip_blank(self.text, end)
        return position if position < len(self.text) and self.text[position] == "," else -1
