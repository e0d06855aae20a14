"""Makes the manual page docs/clfractal.1 from the commands and their options; a wheel has it as share/man/man1/clfractal.1.

python docs/make_man.py
man -l docs/clfractal.1
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import typer

import clfractal
from clfractal.cli.program import app

DOCS = Path(__file__).resolve().parent
FILE = DOCS / "clfractal.1"

_LINK = re.compile(r"\[([^\]]*)\]\([^)]*\)")


def page() -> str:
    """The manual page, in the macros of man(7)."""
    program: Any = typer.main.get_command(app)
    about = str(app.info.help)
    lines = [
        f'.TH CLFRACTAL 1 "" "clfractal {clfractal.__version__}" "User Commands"',
        ".SH NAME",
        r"clfractal \- renders 3D fractals with OpenCL",
        ".SH SYNOPSIS",
        *_synopsis("clfractal", ["COMMAND", "..."]),
        ".SH DESCRIPTION",
        _text(about),
        ".PP",
        "Results go to standard output. Progress, remarks and errors go to standard error.",
        "A SCENE is a scene file, or a picture that clfractal wrote.",
        ".SH OPTIONS",
        *_options(program),
        ".SH COMMANDS",
    ]
    for name, command in program.commands.items():
        # Typer's own help option is left out: every command has it.
        arguments = [_argument(each) for each in command.params if each.param_type_name == "argument"]
        lines += [f".SS {_text(name)}", *_synopsis(f"clfractal {name}", ["[OPTIONS]", *arguments])]
        lines += [".PP", *_paragraphs(command.help or ""), *_options(command)]
    lines += [".SH EXIT STATUS", *_rows("Exit status"), ".SH ENVIRONMENT", *_rows("Environment variables")]
    lines += [".SH SEE ALSO", "The pages of the folder docs of the project, which begin at docs/index.md."]
    return "\n".join(lines) + "\n"


def _synopsis(name: str, arguments: Iterable[str]) -> Iterator[str]:
    yield rf"\fB{_text(name)}\fR " + " ".join(rf"\fI{_text(each)}\fR" for each in arguments)


def _argument(argument: Any) -> str:
    shown = str(argument.metavar or argument.name.upper())
    return shown if argument.required or shown.startswith("[") else f"[{shown}]"


def _options(command: Any) -> Iterator[str]:
    """Arguments and options with what they mean."""
    for each in command.params:
        if each.param_type_name == "argument":
            yield from (".TP", rf"\fI{_text(_argument(each))}\fR", _text(each.help or ""))
            continue
        names = ", ".join(rf"\fB{_text(name)}\fR" for name in (*each.opts, *each.secondary_opts))
        value = "" if each.is_flag else rf" \fI{_text(each.metavar or each.name.upper())}\fR"
        yield from (".TP", names + value, _text(each.help or ""))


def _paragraphs(text: str) -> Iterator[str]:
    for number, paragraph in enumerate(text.split("\n\n")):
        if number:
            yield ".PP"
        yield _text(paragraph)


def _rows(heading: str) -> Iterator[str]:
    """The table below a heading of docs/command-line.md."""
    section = (
        (DOCS / "command-line.md").read_text("utf-8").split(f"\n## {heading}\n", 1)[1].split("\n## ", 1)[0]
    )
    for line in section.splitlines():
        cells = [cell.strip() for cell in line.strip("|").split("|")]
        if line.startswith("|") and not set(line) <= set("|-") and cells[0] not in ("status", "variable"):
            first, second = (_LINK.sub(r"\1", cell).replace("`", "") for cell in cells)
            yield from (".TP", rf"\fB{_text(first)}\fR", _text(second))


def _text(words: str) -> str:
    """Words in one line, as roff reads them: a hyphen is one that can be copied, and no line begins with a command."""
    escaped = " ".join(words.split()).replace("\\", r"\e").replace("-", r"\-")
    return r"\&" + escaped if escaped.startswith((".", "'")) else escaped


if __name__ == "__main__":
    FILE.write_text(page(), "utf-8")
    print(FILE)
