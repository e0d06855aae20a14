"""Compiles programs for GPUs without one, and compares what they need with the record: `make gpu-check`.

Exit statuses: 0, nothing is worse; 1, a program does not compile, breaks a limit of OpenCL 1.2, or needs more than on
record; 2, a compiler is missing, or is not the one of the record.
"""

from __future__ import annotations

import argparse
import fnmatch
import os
import sys
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor

from tests.gpu import compilers, listing, record, table
from tests.gpu.compilers import Compilers, MissingCompilerError, RejectedError
from tests.gpu.figures import Figures
from tests.gpu.listing import Listed


def main(arguments: Sequence[str] | None = None) -> int:
    """The command; gives its exit status."""
    asked = _asked(arguments)
    try:
        found = compilers.find()
    except MissingCompilerError as error:
        return _wrong(str(error))
    known = record.load()
    if found.versions != known.versions:
        if not asked.record or asked.only != ["*"]:
            return _wrong(
                f"the record is of {_said(known.versions)}, and here is {_said(found.versions)}: install the same,"
                " or make another record (--record)"
            )
        known = record.Record(found.versions, {})
    chosen = listing.unlike(listing.everything() if asked.all or asked.record else listing.paired())
    programs = [each for each in chosen if any(fnmatch.fnmatch(each.name, name) for name in asked.only)]
    texts = _sums(found, programs, asked.jobs)
    if asked.known:
        recorded = {name.split(" | ")[0] for name in known.figures}
        fresh = [each.name for each in programs if each.name not in recorded]
        programs = [each for each in programs if each.name in recorded]
        print(
            f"{len(fresh)} programs are not on record yet; make gpu-check ARGUMENTS=--record puts them there"
        )
    if not programs:
        return _wrong(f"no program is called {' or '.join(asked.only)}")
    if asked.known or asked.record:
        changed = [each for each in programs if texts[each.name] != known.texts.get(each.name)]
        print(f"{len(programs) - len(changed)} programs are what they were when their figures were recorded")
        programs = changed
    print(f"{len(programs)} programs with {_said(found.versions)}", flush=True)
    measured, failures = compiled(found, programs, asked.jobs)
    if asked.record and not failures:
        # Programs that were not asked for stay on record; those that there are no more do not.
        still = {each.name for each in chosen} - {each.name for each in programs}
        kept = {name: by_gpu for name, by_gpu in known.figures.items() if name.split(" | ")[0] in still}
        kept_texts = {name: text for name, text in known.texts.items() if name in still}
        made = record.Record(found.versions, {**kept, **measured}, {**kept_texts, **texts})
        record.save(made)
        page = table.into_page(table.PAGE.read_text(encoding="utf-8"), table.markdown(made.figures))
        table.PAGE.write_text(page, encoding="utf-8", newline="\n")
        print(f"recorded: {record.PATH.name}, {table.PAGE.name}")
        return 0
    failures += record.worse(measured, known)
    print(table.markdown(measured), end="")
    for line in failures:
        print(line, file=sys.stderr)
    less = record.better(measured, known)
    if less:
        print(f"{less} kernels need less than on record; make gpu-check ARGUMENTS=--record keeps that")
    return 1 if failures else 0


def _asked(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="make gpu-check", description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--all", action="store_true", help="every program, not only each pair of features")
    parser.add_argument(
        "--known", action="store_true", help="only programs that are on record, and whose texts have changed"
    )
    parser.add_argument(
        "--record",
        action="store_true",
        help="compile what is not on record as it is now, and put the figures there",
    )
    parser.add_argument(
        "--only", nargs="+", default=["*"], metavar="NAME", help="programs of such names: 'march *'"
    )
    parser.add_argument("--jobs", type=int, default=os.cpu_count() or 1, help="compilers at a time")
    return parser.parse_args(arguments)


def _said(versions: Mapping[str, str]) -> str:
    return ", ".join(f"{name} {version}" for name, version in versions.items()) or "no compiler"


def _wrong(message: str) -> int:
    print(f"gpu-check: {message}", file=sys.stderr)
    return 2


def _sums(found: Compilers, programs: Sequence[Listed], jobs: int) -> dict[str, str]:
    """What the texts of programs are known by; empty for one that cannot be read, which is told when it is compiled."""

    def one(listed: Listed) -> str:
        try:
            return record.sum_of(compilers.shown(found, listed.text.text, listed.precision))
        except RejectedError:
            return ""

    with ThreadPoolExecutor(jobs) as pool:
        return dict(zip((each.name for each in programs), pool.map(one, programs), strict=True))


def compiled(
    found: Compilers, programs: Sequence[Listed], jobs: int
) -> tuple[dict[str, dict[str, Figures]], list[str]]:
    """Figures of all kernels by `program | kernel` and GPU, and a line for each program that is rejected."""

    def one(listed: Listed) -> dict[str, dict[str, Figures]] | RejectedError:
        try:
            return compilers.measured(found, listed.text.text, listed.precision)
        except RejectedError as error:
            return error

    measured: dict[str, dict[str, Figures]] = {}
    failures = []
    with ThreadPoolExecutor(jobs) as pool:
        for listed, result in zip(programs, pool.map(one, programs), strict=True):
            if isinstance(result, RejectedError):
                failures.append(f"{listed.name}: {result}")
                continue
            measured.update({f"{listed.name} | {kernel}": by_gpu for kernel, by_gpu in result.items()})
            for line in table.listed({f"{listed.name} | {kernel}": by for kernel, by in result.items()}):
                print(line, flush=True)
    return measured, failures


if __name__ == "__main__":
    sys.exit(main())
