"""Silhouettes and depths of imported scenes beside those of the installed Mandelbulber 2, for all its examples.

    python -m benchmarks.peers [FILE ...] [--only WORD] [--sample N --seed S] [--again [VERDICT]] [--jobs N] [-o FILE.json]

A line for each file: the part of the picture that it covers (theirs), intersection over union of both silhouettes, relative
differences of depth in the middle and at nine tenths, and what is wrong. Of files with a ~ water is compared flat: their
waves are others. What was found is kept in a file, and not measured again without `--again`.
"""

from __future__ import annotations

import argparse
import json
import random
import subprocess
import sys
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

from benchmarks.peers import theirs
from benchmarks.peers.causes import summary, verdict

SIDE = 96
HEAD = f"{'file':58} {'covers':>6} {'IoU':>6} {'depth':>7} {'90 %':>7}  verdict"


def main(arguments: Sequence[str] | None = None) -> int:
    options = _options(arguments)
    if not theirs.is_there():
        print(
            "Mandelbulber 2 is not installed (apt-get install mandelbulber2): there is nothing to compare with"
        )
        return 2
    files = _chosen(options)
    kept: dict[str, Any] = json.loads(options.output.read_text("utf-8")) if options.output.is_file() else {}
    again = [name for path in files if (name := _name(path)) in kept and _is_again(kept[name], options.again)]
    for name in again:
        del kept[name]
    print(HEAD)
    waiting = [path for path in files if _name(path) not in kept]
    for path in files:
        if _name(path) in kept:
            print(line(_name(path), kept[_name(path)]))
    with ThreadPoolExecutor(options.jobs) as pool:
        for path, found in zip(
            waiting, pool.map(lambda path: _measured(path, options), waiting), strict=True
        ):
            kept[_name(path)] = found
            print(line(_name(path), found), flush=True)
            options.output.parent.mkdir(parents=True, exist_ok=True)
            options.output.write_text(json.dumps(kept, indent=1, sort_keys=True), "utf-8")
    print("\n" + "\n".join(summary([kept[_name(path)] for path in files])))
    return 0


def _options(arguments: Sequence[str] | None) -> argparse.Namespace:
    parser = argparse.ArgumentParser(prog="peers", description=__doc__.split("\n", 1)[0] if __doc__ else None)
    parser.add_argument("files", nargs="*", type=Path, metavar="FILE", help="settings; without: all examples")
    parser.add_argument("--only", metavar="WORD", help="examples with this in their name")
    parser.add_argument("--sample", type=int, metavar="N", help="so many of them, at random")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="which ones")
    parser.add_argument(
        "--again",
        nargs="?",
        const="",
        metavar="VERDICT",
        help="measure anew what is known: all, or with this verdict",
    )
    parser.add_argument("--jobs", type=int, default=1, metavar="N", help="files at a time")
    parser.add_argument(
        "--seconds", type=float, default=240, metavar="S", help="what each program may take for a file"
    )
    parser.add_argument("--keep", type=Path, metavar="FOLDER", help="write depths there, NAME.npz")
    parser.add_argument("-o", "--output", type=Path, default=Path("build/peers.json"), metavar="FILE.json")
    return parser.parse_args(arguments)


def _chosen(options: argparse.Namespace) -> list[Path]:
    files: list[Path] = options.files or theirs.examples()
    if options.only:
        files = [path for path in files if options.only.lower() in _name(path).lower()]
    if options.sample is not None and options.sample < len(files):
        files = sorted(random.Random(options.seed).sample(files, options.sample))
    return files


def _name(path: Path) -> str:
    examples = theirs.FOLDER / "examples"
    return str(path.relative_to(examples) if path.is_relative_to(examples) else path)


def _is_again(record: dict[str, Any], wanted: str | None) -> bool:
    return wanted is not None and wanted in verdict(record)


def _measured(path: Path, options: argparse.Namespace) -> dict[str, Any]:
    command = [sys.executable, "-P", "-m", "benchmarks.peers.one", str(path), str(SIDE), str(options.seconds)]
    try:
        done = subprocess.run(
            [*command, str(options.keep or "")],
            capture_output=True,
            text=True,
            timeout=2 * options.seconds + 60,
        )
    except subprocess.TimeoutExpired:
        return {"stage": "ours", "error": f"ours took more than {options.seconds:g} s", "dropped": []}
    try:
        found: dict[str, Any] = json.loads(done.stdout.splitlines()[-1])
    except (IndexError, json.JSONDecodeError):
        last = (done.stderr.strip().splitlines() or ["nothing"])[-1]
        return {"stage": "ours", "error": f"ended with {done.returncode}: {last}", "dropped": []}
    return found


def line(name: str, record: dict[str, Any]) -> str:
    """A file's line of the table."""
    shown = name if len(name) <= 58 else "..." + name[-55:]
    cells = [f"{shown:58}"]
    for key, width, digits in (("covered", 6, 1), ("union", 6, 1), ("middle", 7, 2), ("ninth", 7, 2)):
        value = record.get(key)
        cells.append(f"{'-' if value is None else f'{100 * value:.{digits}f}':>{width}}")
    why = record.get("error") or ", ".join(record.get("dropped") or record.get("habits", ()))
    word = verdict(record)
    mark = "~" if record.get("calm") else " "
    return f"{' '.join(cells)} {mark}{word}" + (f": {why}" if why and word != "alike" else "")


if __name__ == "__main__":
    sys.exit(main())
