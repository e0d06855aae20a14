"""Finds the errors in OpenCL compilers' logs, and their places in our own files."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace

from clfractal.device.source import SourceMap, origin
from clfractal.errors import STATUS_BAD_INPUT, STATUS_DEVICE_FAILED, KernelBuildError, Where

# Clang's form is used by PoCL (which puts `error: ` first), Intel, AMD, Apple, Mesa and Oclgrind; NVIDIA
# writes `<kernel>:3:5: error: ...` in the same form; the older EDG front ends write `"file", line 3: error:
# ...`.
_FORMS = (
    re.compile(
        r"^(?:error: )?(?P<file>[^\s:][^:\n]*):(?P<line>\d+):(?P<column>\d+): "
        r"(?P<kind>(?:fatal )?error: )?(?P<text>.+)$"
    ),
    re.compile(
        r'^"?(?P<file>[^",\n]+)"?, line (?P<line>\d+): (?:catastrophic )?(?P<kind>error)(?: #[\w-]+)?: '
        r"(?P<text>.+)$"
    ),
    re.compile(r"^(?P<file>[^\s(:]+)\((?P<line>\d+)\): (?P<kind>error)(?: \w+)?: (?P<text>.+)$"),
)


@dataclass(frozen=True, slots=True)
class Diagnostic:
    """One error of a compiler: the file as named in `#line`, line and column (from 1), and what is wrong."""

    file: str
    line: int
    column: int | None
    text: str


def diagnostics(log: str) -> list[Diagnostic]:
    """The errors in a compiler's log, in the log's order, without warnings and notes."""
    found = []
    for line in log.splitlines():
        for form in _FORMS:
            match = form.match(line.strip())
            if match is None:
                continue
            parts = match.groupdict()
            if not parts["kind"] and not line.strip().startswith("error: "):
                continue
            column = parts.get("column")
            place = parts["file"], int(parts["line"]), int(column) if column else None
            found.append(Diagnostic(*place, parts["text"]))
            break
    return found


def build_error(log: str, text: str, sources: SourceMap, device_name: str) -> KernelBuildError:
    """The error for a program that does not compile: the first error's place, and an excerpt in the details.

    `text` is the whole program. The status is 2 if the place lies in a text generated from the user's
    formula, else 3.
    """
    found = [_in_our_files(each, text, sources) for each in diagnostics(log)]
    first = next((each for each in found if each.file in sources.texts), found[0] if found else None)
    if first is None:
        lines = [line for line in log.splitlines() if line.strip()]
        return KernelBuildError(
            f"the kernel does not build on {device_name}: {lines[0].strip() if lines else 'no reason given'}",
            details=log,
        )
    excerpt = sources.excerpt(first.file, first.line, first.column)
    by_user = first.file.removeprefix("generated/") in sources.user
    return KernelBuildError(
        f"the kernel does not build on {device_name}: {first.text}",
        Where(file=first.file, line=first.line, column=first.column),
        details=f"{excerpt}\n\n{log}" if excerpt else log,
        status=STATUS_BAD_INPUT if by_user else STATUS_DEVICE_FAILED,
    )


def _in_our_files(diagnostic: Diagnostic, text: str, sources: SourceMap) -> Diagnostic:
    """The same diagnostic, moved to our own file if the driver did not heed `#line`."""
    if diagnostic.file in sources.texts:
        return diagnostic
    place = origin(text, diagnostic.line)
    return diagnostic if place is None else replace(diagnostic, file=place[0], line=place[1])
