"""Makes docs/engineering/modules.md: what every file of the program and of its kernels is for, in its own words.

python docs/make_modules.py

A Python file says it in the first paragraph of its docstring, a kernel file in the first sentence of its first comment.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from itertools import groupby
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
FILE = ROOT / "docs" / "engineering" / "modules.md"

_HEAD = """\
# Modules

Every file of the program and what it is for, in its own words. `docs/make_modules.py` makes this page of the first
lines of the files; a test compares it with them. [Architecture](../architecture.md) says how the parts work together.
"""
_COMMENT = re.compile(r"(?:^//.*\n)+", re.MULTILINE)
_SENTENCE = re.compile(r".*?[.?](?= [A-Z(`]|$)")


def page() -> str:
    """The page, folder by folder: packages, then kernels."""
    parts = [_HEAD]
    for folder, files in groupby(_files(), key=lambda path: path.parent):
        name = folder.relative_to(ROOT).as_posix()
        package = folder / "__init__.py"
        about = f"\n{purpose(package)}\n" if package.is_file() else ""
        rows = [f"| `{path.name}` | {_cell(purpose(path))} |" for path in files if path.name != "__init__.py"]
        if rows:
            parts.append("\n".join([f"\n## {name}\n{about}", "| file | purpose |", "|---|---|", *rows, ""]))
    return "".join(parts)


def purpose(path: Path) -> str:
    """What a file says that it is for; '' if it does not say."""
    text = path.read_text(encoding="utf-8")
    if path.suffix == ".py":
        return " ".join((ast.get_docstring(ast.parse(text)) or "").partition("\n\n")[0].split())
    found = _COMMENT.search(text)
    if found is None:
        return ""
    lines = [line.removeprefix("//").strip() for line in found[0].splitlines()]
    first = " ".join(lines[: lines.index("")] if "" in lines else lines)
    sentence = _SENTENCE.match(first)
    return sentence[0] if sentence else ""


def _files() -> Iterator[Path]:
    for folder, endings in (("clfractal", {".py"}), ("kernels", {".h", ".cl"})):
        for path in sorted((ROOT / folder).rglob("*"), key=lambda path: (path.parent, path.name)):
            if path.suffix in endings:
                yield path


def _cell(text: str) -> str:
    return text.replace("|", "\\|")


def main() -> None:
    FILE.parent.mkdir(exist_ok=True)
    FILE.write_text(page(), encoding="utf-8")
    print(FILE.relative_to(ROOT))


if __name__ == "__main__":
    main()
