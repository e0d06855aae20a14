"""`python -m tests.portability [--brief] [--all] [NAME ...]`: the same tests and pictures on every OpenCL implementation.

With `--all` an implementation that this user or machine may not have is a fault, too, and is not passed over.
With `--brief` fewer pictures are rendered: those that differ in kind, as golden pictures show the formulas.

Each implementation has processes of its own: one for the tests marked `conformance`, others for the pictures of
`pictures.py`; Oclgrind renders tiny ones and checks every access to memory. As many processes as there are cores work
side by side, whatever they belong to, since most of the time goes into compilers that use one core each. All pictures
are then compared with those of the first implementation. Pictures that differ are left in `build/portability`.
"""

from __future__ import annotations

import os
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from subprocess import PIPE, STDOUT

import numpy as np

from tests.portability.compare import difference
from tests.portability.implementations import (
    IMPLEMENTATIONS,
    ROOT,
    WORKPLACE,
    Implementation,
    MissingError,
    NotAllowedError,
)
from tests.portability.pictures import PARTS

# Of one process: the longest takes three minutes on two idle cores (`Implementation.minutes`), and more beside other work.
_TIMEOUT_S = 1500
_TELLING = threading.Lock()


def main() -> int:
    """The exit status: 0 if every implementation is there and passes."""
    wanted = [argument for argument in sys.argv[1:] if argument not in ("--brief", "--all")]
    kind = "brief" if "--brief" in sys.argv else "full"
    unknown = set(wanted) - {each.name for each in IMPLEMENTATIONS}
    if unknown:
        known = ", ".join(each.name for each in IMPLEMENTATIONS)
        print(f"unknown implementation {', '.join(sorted(unknown))}; known: {known}", file=sys.stderr)
        return 2
    chosen = [each for each in IMPLEMENTATIONS if not wanted or each.name in wanted]
    WORKPLACE.mkdir(parents=True, exist_ok=True)
    faults = _examine(chosen, kind)
    for name, fault in _compare(chosen, (kind, "tiny")):
        faults[name].append(fault)
    print("\nimplementation  result")
    for name, found in faults.items():
        print(f"{name:15} {'passed' if not found else '; '.join(found)}")
    return 1 if any(faults.values()) else 0


def _examine(chosen: Sequence[Implementation], kind: str) -> dict[str, list[str]]:
    """What is wrong with each implementation by itself."""
    faults: dict[str, list[str]] = {each.name: [] for each in chosen}
    parts: list[tuple[Implementation, Part]] = []
    for implementation in chosen:
        try:
            environment = implementation.environment(os.environ)
        except NotAllowedError as error:
            print(f"{implementation.name}: passed over: {error}", flush=True)
            faults[implementation.name] += ["not allowed here"] if "--all" in sys.argv else []
            continue
        except MissingError as error:
            print(f"{implementation.name}: {error}", flush=True)
            faults[implementation.name].append("not there and not to be installed")
            continue
        environment.update(_oclgrind_checks(implementation))
        parts += [(implementation, part) for part in _parts(implementation, environment, kind)]
    # Those that take longest first: a core that is left with one at the end is waited for.
    parts.sort(key=lambda each: each[0].minutes, reverse=True)
    with ThreadPoolExecutor(os.cpu_count() or 1) as pool:
        running = [(implementation, pool.submit(part)) for implementation, part in parts]
        for implementation, found in running:
            faults[implementation.name] += found.result()
    return faults


def _parts(implementation: Implementation, environment: Mapping[str, str], kind: str) -> list[Part]:
    """What can be done side by side."""
    conformance = partial(_conformance_faults, implementation, environment)
    if not implementation.simulator:
        # Tiny ones are for the simulator, and what it is compared with.
        kinds = (kind, "tiny") if implementation is IMPLEMENTATIONS[0] else (kind,)
        pictures = [
            partial(_picture_faults, implementation, environment, kind=each, part=part)
            for each in kinds
            for part in range(PARTS[each])
        ]
        return [*pictures, conformance]

    # The simulator's processes share a log.
    def one_after_the_other() -> list[str]:
        found = conformance()
        for part in range(PARTS["tiny"]):
            found += _picture_faults(implementation, environment, kind="tiny", part=part)
        return found + _memory_faults(environment)

    return [one_after_the_other]


def _conformance_faults(implementation: Implementation, environment: Mapping[str, str]) -> list[str]:
    tests = ["pytest", "-q", "-p", "no:cacheprovider", "-m", "conformance", *_tests(implementation)]
    passed = _run(implementation, "conformance", implementation.command(tests, environment), environment)
    return [] if passed else ["conformance tests fail"]


def _picture_faults(
    implementation: Implementation, environment: Mapping[str, str], kind: str, part: int
) -> list[str]:
    pictures = _pictures(implementation, kind, part)
    pictures.unlink(missing_ok=True)
    module = ["tests.portability.pictures", str(pictures), kind, str(part), *implementation.left_out]
    command = implementation.command(module, environment)
    rendered = _run(implementation, f"{kind} pictures, part {part}", command, environment)
    return [] if rendered else [f"the {kind} pictures fail"]


Part = Callable[[], list[str]]


def _tests(implementation: Implementation) -> list[str]:
    # Interpreting costs some 10,000 times the time: the simulator is for memory, on tiny pictures.
    # The files are named, since a Debian in a folder has not what the others import.
    return ["tests/device"] if implementation.simulator else _marked()


def _marked() -> list[str]:
    """The files of tests that have tests marked `conformance`."""
    files = sorted((ROOT / "tests").rglob("test_*.py"))
    return [
        str(path.relative_to(ROOT))
        for path in files
        if "mark.conformance" in path.read_text(encoding="utf-8")
    ]


def _pictures(implementation: Implementation, kind: str, part: int) -> Path:
    return WORKPLACE / f"{implementation.name}-{kind}-{part}.npz"


def _oclgrind_checks(implementation: Implementation) -> dict[str, str]:
    if not implementation.simulator:
        return {}
    log = WORKPLACE / "oclgrind.log"
    return {"OCLGRIND_LOG": str(log), "OCLGRIND_UNINITIALIZED": "1", "OCLGRIND_DATA_RACES": "1"}


def _memory_faults(environment: Mapping[str, str]) -> list[str]:
    """Oclgrind's findings on the tiny pictures; and on a kernel with a fault, to know that it looks."""
    log = Path(environment["OCLGRIND_LOG"])
    found = []
    text = log.read_text() if log.exists() else ""
    if text.strip():
        print(text[:4000])
        found.append("invalid use of memory")
    canary = [sys.executable, "-m", "tests.portability.canary"]
    subprocess.run(canary, env=environment, timeout=_TIMEOUT_S, check=False)
    if "Invalid write" not in (log.read_text() if log.exists() else ""):
        found.append("the memory checker finds nothing where something is")
    return found


def _run(
    implementation: Implementation, doing: str, command: list[str], environment: Mapping[str, str]
) -> bool:
    """Runs a command to its end, and then tells what it has printed, in one piece."""
    start = time.monotonic()
    try:
        ended = subprocess.run(
            command, env=environment, timeout=_TIMEOUT_S, check=False, stdout=PIPE, stderr=STDOUT
        )
        told, well = ended.stdout, ended.returncode == 0
    except subprocess.TimeoutExpired as error:
        told = (error.stdout or b"") + f"{' '.join(command)[:200]}: more than {_TIMEOUT_S} s\n".encode()
        well = False
    head = f"\n=== {implementation.name}, {doing}: {time.monotonic() - start:.0f} s\n"
    with _TELLING:
        print(head + told.decode(errors="replace"), end="", flush=True)
    return well


def _compare(chosen: list[Implementation], kinds: tuple[str, str]) -> list[tuple[str, str]]:
    """Faults of the pictures, by implementation; those of the first that has them are the measure."""
    faults = []
    for kind in kinds:
        reference: dict[str, np.typing.NDArray[np.float32]] = {}
        for implementation in chosen:
            pictures: dict[str, np.typing.NDArray[np.float32]] = {}
            for path in (_pictures(implementation, kind, part) for part in range(PARTS[kind])):
                if path.exists():
                    with np.load(path) as archive:
                        pictures |= {name: archive[name] for name in archive.files}
            if not pictures:
                continue
            if not reference:
                reference = pictures
            for name, picture in pictures.items():
                if name not in reference:  # it failed there, which is told already
                    continue
                # The measure is compared with itself too: that finds colours that are no numbers.
                found = difference(reference[name], picture, name.split()[-1], name)
                print(f"{implementation.name:12} {kind} {name:24} {found.share:.3%} {found.fault or 'same'}")
                if found.fault:
                    faults.append((implementation.name, f"{kind} {name}: {found.fault}"))
                    _leave(implementation.name, f"{kind} {name}", reference[name], picture, found.pixels)
    return faults


def _leave(
    implementation: str,
    name: str,
    expected: np.typing.NDArray[np.float32],
    picture: np.typing.NDArray[np.float32],
    pixels: np.typing.NDArray[np.bool_],
) -> None:
    """Expected, found and difference side by side, enlarged, as a PNG for a person to look at."""
    from PIL import Image

    def bytes_of(rgb: np.typing.NDArray[np.float32]) -> np.typing.NDArray[np.uint8]:
        finite = np.nan_to_num(rgb, nan=1, posinf=1, neginf=0).clip(0, 1)
        return (255 * np.moveaxis(finite, 0, -1) ** (1 / 2.2)).astype(np.uint8)

    marks = np.repeat(pixels[None].astype(np.float32), 3, axis=0)
    panels = [bytes_of(expected[:3]), bytes_of(picture[:3]), bytes_of(marks)]
    image = Image.fromarray(np.concatenate(panels, axis=1))
    path = WORKPLACE / f"{implementation} {name}.png".replace(" ", "-")
    image.resize((image.width * 4, image.height * 4), Image.Resampling.NEAREST).save(path)
    print(f"left {path}: expected, found, difference")


if __name__ == "__main__":
    sys.exit(main())
