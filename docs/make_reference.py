"""Makes the tables of keys in docs/*.md of what the schema declares, sections of kinds, and quantities of colours.

python docs/make_reference.py

A table has its class before it, as `<!-- keys of Fog -->`. Keys, defaults and what is allowed come from the schema; what
a page says of a key's meaning stays, and a key that is new there has its description.
"""

from __future__ import annotations

import inspect
import json
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

from clfractal.scene.load import schema
from clfractal.scene.materials import PARTS
from clfractal.schema.hex_color import COLOR_SCHEMA, TEXT_SCHEMA
from clfractal.schema.kinds import members
from clfractal.schema.quantity import colorings
from clfractal.schema.shape import solids

DOCS = Path(__file__).resolve().parent
HEAD = "| key | default | allowed | meaning |\n|---|---|---|---|\n"
_TABLE = re.compile(r"^<!-- keys of (\w+) -->\n\n(?:\|.*\n)*", re.MULTILINE)
_KINDS = re.compile(r"(?<=<!-- )(solids|lights)( -->\n).*(?=<!-- end of \1 -->)", re.DOTALL)
_PARTS = re.compile(r"(?<=<!-- parts -->\n).*(?=<!-- end of parts -->)", re.DOTALL)
_QUANTITIES = re.compile(r"(?<=<!-- quantities -->\n\n)(?:\|.*\n)*")
# Words of descriptions as pages write them.
_LINKS = {
    "`materials`": "[`materials`](paths.md#materials)",
    "with the set and": "[with the set](#joined-to-the-set) and",
    " null:": " `null`:",
}


def made(page: str) -> str:
    """A page's text with the tables and sections that the schema says."""
    found = _TABLE.sub(lambda table: _table(table[1], table[0]), page)
    found = _PARTS.sub(lambda parts: "\n" + "".join(_part_sections(parts[0])), found)
    found = _QUANTITIES.sub(lambda _: _quantities(), found)
    return _KINDS.sub(lambda block: f"{block[1]}{block[2]}\n" + "".join(_sections(block[1], block[0])), found)


def sections_of(page: str) -> list[str]:
    """The classes whose tables are on a page."""
    return [table[1] for table in _TABLE.finditer(page)]


def _table(name: str, before: str = "") -> str:
    """The table of a class, with the order and the meanings of the one before."""
    meanings = {row[0]: row[3] for row in map(_cells, before.splitlines()) if len(row) == 4}
    places = list(meanings)
    rows = sorted(_rows(name), key=lambda row: places.index(row[0]) if row[0] in places else len(places))
    lines = [
        "| " + " | ".join(_escaped([*row, meanings.get(row[0], meaning)])) + " |\n" for *row, meaning in rows
    ]
    return f"<!-- keys of {name} -->\n\n{HEAD}{''.join(lines)}"


def _cells(line: str) -> list[str]:
    return [cell.strip().replace("\\|", "|") for cell in re.split(r"(?<!\\)\|", line)[1:-1]]


def _escaped(cells: list[str]) -> list[str]:
    return [cell.replace("|", "\\|") for cell in cells]


def _rows(name: str) -> Iterator[tuple[str, str, str, str]]:
    """key, default, allowed and description of a class of the schema."""
    found = _without_texts(_schema()["$defs"][name])
    for key, entry in found["properties"].items():
        meaning = entry.get("description", "chooses this kind" if "const" in entry else "")
        for word, link in _LINKS.items():
            meaning = meaning.replace(word, link)
        yield f"`{key}`", _default(entry, key, found.get("required", [])), _allowed(entry), meaning


def _quantities() -> str:
    """The table of quantities that choose colours."""
    rows = (
        f"| `{kind.tag}` | {kind.__doc__} | {kind.unit} | {kind.usual_scale} |\n"
        for kind in colorings()
        if kind.uses_palette
    )
    return "| `by` | q | unit | typical `scale` |\n|---|---|---|---|\n" + "".join(rows)


def _sections(family: str, before: str) -> Iterator[str]:
    """Of each kind what its class says, its picture, and its keys, as the tables before tell them."""
    tables = {table[1]: table[0] for table in _TABLE.finditer(before)}
    folder, prefix, found = (
        ("objects", "", solids()) if family == "solids" else (family, f"{family}, ", members(family))
    )
    for kind in found:
        about = " ".join((inspect.getdoc(kind) or "").split())
        yield f"## {prefix}{kind.tag}\n\n{about}\n\n"
        if (DOCS / "pictures" / f"{folder}_{kind.tag}.webp").exists():
            yield f"![{about}](pictures/{folder}_{kind.tag}.webp)\n\n"
        yield _table(kind.__name__, tables.get(kind.__name__, "")) + "\n"


def _part_sections(before: str) -> Iterator[str]:
    """Of each part of materials the section that is there, or what its class says, and its keys."""
    there = {text.partition("\n")[0]: text for text in before.split("### ")[1:]}
    for part in PARTS:
        about = " ".join((inspect.getdoc(part) or "").split())
        yield "### " + (there.get(part.tag) or f"{part.tag}\n\n{about}\n\n{_table(part.__name__)}\n")
        for name, field in part.model_fields.items():
            picture = f"pictures/{part.tag}_{name}.webp"
            if (DOCS / picture).exists() and picture not in there.get(part.tag, ""):
                yield f"![{field.description}]({picture})\n\n"


@cache
def _schema() -> dict[str, Any]:
    return schema()


def _number(value: float) -> str:
    """As the pages write numbers: whole ones in full, in groups of three digits."""
    return f"{value:,.0f}" if value == int(value) and abs(value) < 1e16 else f"{value:g}"


def _allowed(entry: dict[str, Any]) -> str:
    """The values that a schema allows, in the words of scenes.md."""
    options = [option for option in entry.get("anyOf", entry.get("oneOf", ())) if option != {"type": "null"}]
    if options:
        return " or ".join(_allowed(option) for option in options)
    if "const" in entry:
        return f"`{entry['const']}`"
    if "enum" in entry:
        return ", ".join(f"`{word}`" for word in entry["enum"])
    if "$ref" in entry:
        return "a mapping"
    kind = entry.get("type")
    if kind == "array":
        if entry.get("prefixItems", [{}])[0].get("type") == "array":
            component = entry["prefixItems"][0]["prefixItems"][0]
            kind = "positions" if component["minimum"] < 0 else f"colours, {_interval(component)}"
            return f"{len(entry['prefixItems'])} {kind}"
        if "prefixItems" in entry:
            component = entry["prefixItems"][0]  # (an exact number may be text, too)
            return f"{len(entry['prefixItems'])} numbers, {_interval(component.get('anyOf', [component])[0])}"
        return f"a list of {entry.get('minItems', 0)} to {entry['maxItems']}"
    if kind in ("integer", "number"):
        return ("whole, " if kind == "integer" else "") + _interval(entry)
    return {"boolean": "`true`, `false`", "string": "text", "object": "a mapping"}[str(kind)]


def _interval(entry: dict[str, Any]) -> str:
    low, above = entry.get("minimum"), entry.get("exclusiveMinimum")
    high, below = entry.get("maximum"), entry.get("exclusiveMaximum")
    start = _number(low) if low is not None else f"above {_number(above or 0)}"
    return f"{start} to {_number(high)}" if high is not None else f"{start} to below {_number(below or 0)}"


def _default(entry: dict[str, Any], name: str, required: list[str]) -> str:
    if name in required:
        return "required"
    if "default" not in entry:
        return "`{}`"  # made by a function: `output.precision` and mappings whose keys all have a default
    shown = json.dumps(_plain(entry["default"])).replace('"', "")
    return f"`{shown}`"


def _plain(value: Any) -> Any:
    """Whole floats as int, as one writes them."""
    if isinstance(value, list):
        return [_plain(each) for each in value]
    return int(value) if isinstance(value, float) and value.is_integer() else value


def _without_texts(entry: Any) -> Any:
    """A schema without colours as text, which the page tells once, under its conventions."""
    if isinstance(entry, list):
        return [_without_texts(each) for each in entry]
    if not isinstance(entry, dict):
        return entry
    shorter = {key: _without_texts(value) for key, value in entry.items() if key != "anyOf"}
    others = [each for each in entry.get("anyOf", ()) if each not in (TEXT_SCHEMA, COLOR_SCHEMA)]
    if len(others) == 1:
        return {**_without_texts(others[0]), **shorter}
    return {**shorter, "anyOf": _without_texts(others)} if others else shorter


def main() -> None:
    for path in sorted(DOCS.glob("*.md")):
        before = path.read_text(encoding="utf-8")
        after = made(before)
        if after != before:
            path.write_text(after, encoding="utf-8")
            print(path.relative_to(DOCS.parent))


if __name__ == "__main__":
    main()
