"""Writes changed values into a YAML text and leaves comments, order, style and spaces as they are.

The parser that scenes are read with tells where each value stands, and only those pieces of the text are replaced. The
result is read back; if it does not hold what it should, because the text is written in a rare way, the whole text is
written anew below its first comment. A round-trip library loses comments and layout: docs/engineering/libraries.md.
"""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from itertools import takewhile
from typing import Any

from clfractal.errors import SceneError
from clfractal.files import spans
from clfractal.files.document import read_document
from clfractal.files.edits import Edits
from clfractal.files.fragments import block_lines, fits, flow_text, number_text, same, text_scalar
from clfractal.files.marks import MERGE, Node
from clfractal.files.spans import UnusualError

_NONE = object()


def updated(
    text: str, before: Mapping[str, Any], after: Mapping[str, Any], sparse: Mapping[str, Any] | None = None
) -> str:
    """The text with the values of `after`; what is equal in `before` and `after` is not touched.

    A changed number or word is replaced in its place. A new key comes behind the others of its mapping (in front if it
    is the first one of `sparse`), a removed one goes with its comment. Entries of a list are matched by their values. A
    value that becomes its default stays, and is written. Anchors and their aliases stay as long as they stand for equal
    values; an alias that stands for another one becomes a value of its own. So do the keys that a mapping takes over by
    `<<` if the other mapping changes; if only the mapping itself does, it gets the key besides.

    Args:
        text: YAML of a mapping that `read_document` accepts; or JSON, which it then stays.
        before: the plain data that the text stands for, with the defaults of keys that it does not have.
        after: the same of what it shall stand for.
        sparse: `after` without defaults; what is not in the text yet is written as it is here. None: as in `after`.

    Raises:
        SceneError: the text is not YAML.
    """
    root = read_document(text).root
    shorter = after if sparse is None else sparse
    if same(before, after):
        return text
    try:
        found = _Editor(text, root, sparse is not None).edited(before, after, shorter)
        if _stands_for(read_document(found).plain(), root.plain(), before, after, shorter):
            return found
    except (UnusualError, SceneError):
        pass
    return written(shorter, text)


def written(data: Mapping[str, Any], head: str = "") -> str:
    """A mapping as YAML text, below the comments that the text `head` begins with."""
    comments = takewhile(lambda line: not line.strip() or line.startswith("#"), head.splitlines())
    return "\n".join([*comments, *block_lines(data, 0)]) + "\n"


def _stands_for(found: Any, original: Any, before: Any, after: Any, sparse: Any) -> bool:
    """Whether data that were read stand for `after`: what they lack must be a default, or as it was.

    A value may be written in a short way that reads as other data, such as a colour in hexadecimal. Where it has not
    changed, it has to be written as in the original text.
    """
    if same(before, after) and original is not _NONE and same(found, original):
        return True
    if isinstance(after, Mapping):
        if not isinstance(found, Mapping) or any(found[key] for key in found.keys() - after.keys()):
            return False
        return all(
            _stands_for(
                found[key], _child(original, key), _child(before, key), after[key], _child(sparse, key)
            )
            if key in found
            else _child(sparse, key) is _NONE or same(_child(before, key), after[key])
            for key in after
        )
    if isinstance(after, list):
        if not isinstance(found, list) or len(found) != len(after):
            return False
        # An entry that was matched with one at another place is written as that one was.
        old = {j: i for i, j in _matched(before, after)[0]} if isinstance(before, list) else {}
        return all(
            _stands_for(
                found[j],
                _child(original, old.get(j, j)),
                _child(before, old.get(j, j)),
                after[j],
                _child(sparse, j),
            )
            for j in range(len(after))
        )
    return same(found, after)


def _child(value: Any, key: str | int) -> Any:
    if isinstance(value, Mapping):
        return value.get(str(key), _NONE)
    if isinstance(value, list) and isinstance(key, int) and key < len(value):
        return value[key]
    return _NONE


class _Editor:
    """Finds the edits that a text needs.

    Attributes:
        text: the text as it is.
        tree: its values and where they stand.
        root: the same values as `read_document` reads them, aliases resolved.
        has_sparse: whether defaults are known, so that they need not be written.
        broken: anchors that go away, so that their aliases become values.
        anchored: what each anchor stands for from now on: whether that has changed, the value, and without defaults.
    """

    def __init__(self, text: str, root: Node, has_sparse: bool) -> None:
        self.text = text
        self.tree = spans.parse(text)
        self.root = root
        self.has_sparse = has_sparse
        self.json_only = _is_json(text)
        self.broken: set[str] = set()
        self.anchored: dict[str, tuple[bool, Any, Any]] = {}
        self.edits = Edits(text)

    def edited(self, before: Any, after: Any, sparse: Any) -> str:
        """The text with all edits made.

        Raises:
            UnusualError: it is written in a way that is not edited in place.
        """
        while True:
            known = set(self.broken)
            self.edits = Edits(self.text)
            self.anchored.clear()
            self._mapping(self.tree, self.root, before, after, sparse)
            if self.broken == known:
                return self.edits.applied()

    def _flow(self, value: Any) -> str:
        return flow_text(value, json_only=self.json_only)

    def _value(self, node: spans.Node, read: Node, before: Any, after: Any, sparse: Any) -> bool:
        """Edits a value inside its place; False if it has to be replaced as a whole."""
        changed = not same(before, after)
        if isinstance(node, spans.Alias):
            if not self._is_still(node.name, changed, after, sparse):
                text = self._flow(_written_value(before, after, sparse, read))
                self.edits.replace(node.start, node.end, text)
            return True
        if node.anchor:
            self.anchored[node.anchor] = (changed, after, sparse)
        if isinstance(node, spans.Mapping) and isinstance(after, Mapping):
            return self._mapping(node, read, before, after, sparse)
        if isinstance(node, spans.Sequence) and isinstance(after, list):
            return self._sequence(node, read, before, after, sparse)
        if changed and isinstance(node, spans.Scalar) and not isinstance(after, (Mapping, list)):
            return self._scalar(node, after)
        return not changed

    def _is_still(self, name: str, changed: bool, after: Any, sparse: Any) -> bool:
        """Whether an alias stands for its anchor's value as it did."""
        if name in self.broken:
            return False
        if name not in self.anchored:
            return not changed  # it lies in what is written in a short way, and so has not been looked into
        anchor_changed, value, short = self.anchored[name]
        # (Sections of two kinds have other defaults.)
        equal = same(value, after) or (sparse is not _NONE and short is not _NONE and same(short, sparse))
        return equal or not (changed or anchor_changed)

    def _scalar(self, node: spans.Scalar, after: Any) -> bool:
        if node.start == node.end or node.style in ("|", ">"):
            return False
        if isinstance(after, str):
            new = text_scalar(after, json_only=self.json_only, quote=node.style)
        elif isinstance(after, float):
            new = number_text(after, node.value)
        else:
            new = self._flow(after)
        self.edits.replace(spans.value_start(self.text, node), node.end, new)
        return True

    def _mapping(self, node: spans.Mapping, read: Node, before: Any, after: Any, sparse: Any) -> bool:
        old = before if isinstance(before, Mapping) else {}
        names = [key.value for key in node.keys]
        merges = [_is_merge(key) for key in node.keys]
        # The keys that the text does not have, but those that it merges.
        taken = [key for key in read.value if key not in names] if any(merges) else []
        given = self._given(node)
        apart = any(merges) and self._apart(
            node, taken, given, {k: v for k, v in after.items() if k not in names}
        )
        # (A key that means nothing, such as `julia: null`, may be in neither of the two.)
        kept = [
            not apart if merging else name in after or name not in old
            for name, merging in zip(names, merges, strict=True)
        ]
        new = {
            key: _written_value(_child(old, key), after[key], _child(sparse, key), read.child(key))
            for key in after
            if key not in names
            and (
                (apart or (key not in given and not same(_child(old, key), after[key])))
                if key in taken
                else self._needed(key, old, after, sparse)
            )
        }
        if not names or not any(kept):
            return not names and not new
        for index, name in enumerate(names):
            if merges[index]:
                continue
            child = read.child(name)
            assert child is not None
            values = (_child(old, name), after.get(name, _NONE), _child(sparse, name))
            if not kept[index]:
                self._lost(node.values[index])
            elif name in after and not self._value(node.values[index], child, *values):
                self._whole(node, index, _written_value(*values, child))
        first = next(iter(sparse if isinstance(sparse, Mapping) and sparse else after), "")
        if node.flow:
            self._flow_mapping(node, kept, new, first)
        else:
            self._block_mapping(node, kept, new, first)
        return True

    def _given(self, node: spans.Mapping) -> dict[str, Any]:
        """What a mapping takes over from others that change."""
        found: dict[str, Any] = {}
        for key, value in _pairs(node):
            for name in _aliases(value) if _is_merge(key) else ():
                changed, given, _ = self.anchored.get(name, (False, None, None))
                if changed and isinstance(given, Mapping):
                    found = {**given, **found}
        return found

    def _apart(
        self, node: spans.Mapping, taken: Sequence[str], given: Mapping[str, Any], after: Mapping[str, Any]
    ) -> bool:
        """Whether a mapping can no longer take over keys: one is gone, or another's has a value that is not this one's.

        Args:
            after: without the keys that the mapping has itself.
        """
        names = {name for key, value in _pairs(node) if _is_merge(key) for name in _aliases(value)}
        if names & self.broken or any(key not in after for key in taken):
            return True
        return any(not same(given[key], after[key]) for key in given.keys() & after.keys())

    def _needed(self, key: str, before: Mapping[str, Any], after: Mapping[str, Any], sparse: Any) -> bool:
        """Whether a key that the text lacks has to be written."""
        changed = not same(before.get(key, _NONE), after[key])
        if not self.has_sparse:
            return changed
        # Another kind of section may have other defaults, so that an equal value is no longer the default.
        return _child(sparse, key) is not _NONE and (changed or before.keys() != after.keys())

    def _flow_mapping(
        self, node: spans.Mapping, kept: list[bool], new: Mapping[str, Any], first: str
    ) -> None:
        cores = [(key.start, value.end) for key, value in zip(node.keys, node.values, strict=True)]
        pairs = {
            key: f"{text_scalar(key, json_only=self.json_only)}: {self._flow(value)}"
            for key, value in new.items()
        }
        waiting = list(pairs)
        if first in pairs:
            waiting.remove(first)
            self.edits.flow_insert(node, cores, 0, [pairs[first]])
        gone = [index for index, keep in enumerate(kept) if not keep]
        while gone and waiting:
            self.edits.replace(*cores[gone.pop(0)], pairs[waiting.pop(0)])
        self.edits.flow_remove(node, cores, gone)
        self.edits.flow_insert(node, cores, len(cores), [pairs[key] for key in waiting])

    def _block_mapping(
        self, node: spans.Mapping, kept: list[bool], new: Mapping[str, Any], first: str
    ) -> None:
        starts = [key.start for key in node.keys]
        ends = [value.end for value in node.values]
        column = self.edits.column(starts[0])
        lines = {key: block_lines({key: value}, column) for key, value in new.items()}
        self.edits.block_remove(starts, ends, [i for i, keep in enumerate(kept) if not keep], listed=False)
        if first in lines:
            self.edits.insert_before(starts[0], lines.pop(first))
        for inserted in lines.values():
            self.edits.insert_lines_after(ends[-1], inserted)

    def _sequence(self, node: spans.Sequence, read: Node, before: Any, after: list[Any], sparse: Any) -> bool:
        old = before if isinstance(before, list) else []
        if len(old) != len(node.entries):
            raise UnusualError("the text and its data differ in the length of a list")
        if not after or not old:
            return not after and not old
        pairs, gone, new = _matched(old, after)
        # What a word stands for, such as a colour of a palette, may follow from its place and from how many there are.
        words = any(isinstance(each, spans.Scalar) for each in node.entries)
        if words and (gone or new) and any(isinstance(each, Mapping) for each in old):
            return False
        texts = {j: _written_value(None, after[j], _child(sparse, j), None) for j in range(len(after))}
        for i in gone:
            self._lost(node.entries[i])
        for i, j in pairs:
            child = read.child(i)
            assert child is not None
            entry = node.entries[i]
            if not self._value(entry, child, old[i], after[j], _child(sparse, j)):
                self._lost_within(entry)
                self.edits.replace(spans.value_start(self.text, entry), entry.end, self._flow(texts[j]))
        if not node.flow:
            self._block_sequence(
                node, gone, {place: [texts[j] for j in added] for place, added in new.items()}
            )
            return True
        cores = [(entry.start, entry.end) for entry in node.entries]
        self.edits.flow_remove(node, cores, gone)
        for place, added in new.items():
            self.edits.flow_insert(node, cores, place, [self._flow(texts[j]) for j in added])
        return True

    def _block_sequence(self, node: spans.Sequence, gone: list[int], new: dict[int, list[Any]]) -> None:
        ends = [entry.end for entry in node.entries]
        column = self.edits.column(node.dashes[0])
        self.edits.block_remove(node.dashes, ends, gone, listed=True)
        for place, values in new.items():
            lines = block_lines(values, column)
            if place == 0:
                self.edits.insert_before(node.dashes[0], lines)
            else:
                self.edits.insert_lines_after(ends[place - 1], lines)

    def _whole(self, node: spans.Mapping, index: int, value: Any) -> None:
        """Replaces all of a mapping's value."""
        old, colon = node.values[index], node.colons[index]
        self._lost_within(old)
        text = self._flow(value)
        anchor = "" if isinstance(old, spans.Alias) or not old.anchor else f"&{old.anchor}"
        if anchor:
            text = f"{anchor} {text}"
        if node.flow or colon < 0:
            self.edits.replace(old.start, old.end, text if old.start < old.end else ": "[colon >= 0 :] + text)
            return
        column = self.edits.column(node.keys[index].start)
        on_line = "\n" not in self.text[colon : old.start] and "\r" not in self.text[colon : old.start]
        one_line = not value or fits(value, self.edits.column(colon) + 2 + len(anchor))
        first = f" {text if one_line else anchor}".rstrip()
        lines = [] if one_line else block_lines(value, column + 2)
        if on_line:
            self.edits.replace(colon + 1, old.end, first)
            self.edits.insert_lines_after(old.end, lines)
        else:
            self.edits.replace(colon + 1, colon + 1, first)
            self.edits.insert_lines_after(colon, lines)
            self.edits.remove(self.edits.next_line(colon), self.edits.next_line(old.end))

    def _lost(self, node: spans.Node) -> None:
        """Remembers the anchors of a value that goes away."""
        if not isinstance(node, spans.Alias) and node.anchor:
            self.broken.add(node.anchor)
        self._lost_within(node)

    def _lost_within(self, node: spans.Node) -> None:
        """The same for a value that another one takes the place of: its own anchor is the new one's."""
        inner = node.entries if isinstance(node, spans.Sequence) else ()
        for child in node.values if isinstance(node, spans.Mapping) else inner:
            self._lost(child)


def _is_merge(key: spans.Scalar) -> bool:
    """Whether a key merges other mappings."""
    return key.value == MERGE and not key.style


def _pairs(node: spans.Mapping) -> Iterator[tuple[spans.Scalar, spans.Node]]:
    return zip(node.keys, node.values, strict=True)


def _aliases(node: spans.Node) -> Iterator[str]:
    """The names of all aliases in a value."""
    if isinstance(node, spans.Alias):
        yield node.name
        return
    inner = node.entries if isinstance(node, spans.Sequence) else ()
    for child in node.values if isinstance(node, spans.Mapping) else inner:
        yield from _aliases(child)


def _written_value(before: Any, after: Any, sparse: Any, read: Node | None) -> Any:
    """What is written for a value: as the text had it if it has not changed, else without defaults."""
    if read is not None and same(before, after):
        return read.plain()
    return after if sparse is _NONE else sparse


def _matched(
    before: Sequence[Any], after: Sequence[Any]
) -> tuple[list[tuple[int, int]], list[int], dict[int, list[int]]]:
    """Which entries of two lists belong together, which go, and which come before an index of the first list."""
    if len(before) == len(after) and not any(isinstance(each, (Mapping, list)) for each in before):
        return [(i, i) for i in range(len(before))], [], {}
    matcher = difflib.SequenceMatcher(None, list(map(repr, before)), list(map(repr, after)), autojunk=False)
    pairs: list[tuple[int, int]] = []
    gone: list[int] = []
    new: dict[int, list[int]] = {}
    for _, i, i_end, j, j_end in matcher.get_opcodes():
        both = min(i_end - i, j_end - j)
        pairs += zip(range(i, i + both), range(j, j + both), strict=True)
        gone += range(i + both, i_end)
        if j + both < j_end:
            new[i_end] = list(range(j + both, j_end))
    if len(before) == len(after) and len(pairs) * 2 < len(before):
        return [(i, i) for i in range(len(before))], [], {}
    return pairs, gone, new


def _is_json(text: str) -> bool:
    import json

    try:
        json.loads(text)
    except ValueError:
        return False
    return True
