"""A sample of all mistakes, chosen by a seed."""

from __future__ import annotations

import random
from collections.abc import Iterator
from fnmatch import fnmatch
from pathlib import Path

from tests.mutants.kernel_code import kernel_mutants
from tests.mutants.mutant import Mutant

KERNELS = (".cl", ".h")


def sources(root: Path, pattern: str = "*") -> list[str]:
    """The files of the program that fit a pattern: Python and kernels."""
    files = [*(root / "clfractal").rglob("*.py"), *(path for path in (root / "kernels").rglob("*.*"))]
    names = sorted(path.relative_to(root).as_posix() for path in files if path.suffix in (".py", *KERNELS))
    return [name for name in names if fnmatch(name, pattern)]


def sample(root: Path, count: int, seed: int, pattern: str = "*") -> Iterator[Mutant]:
    """`count` different mistakes. Each file is chosen as often as it is long, so Python and kernels get their parts."""
    source = random.Random(seed)
    names = sources(root, pattern)
    texts = {name: (root / name).read_text(encoding="utf-8") for name in names}
    lengths = [texts[name].count("\n") for name in names]
    taken: set[tuple[str, str]] = set()
    tries = 0
    while len(taken) < count and tries < 50 * count + 50:
        tries += 1
        (name,) = source.choices(names, lengths)
        mutant = _one(name, texts[name], source)
        if mutant is not None and (name, mutant.after) not in taken:
            taken.add((name, mutant.after))
            yield mutant


def _one(name: str, text: str, source: random.Random) -> Mutant | None:
    """One mistake of a file; None where the choice is none."""
    if name.endswith(KERNELS):
        mutants = kernel_mutants(name, text)
        return source.choice(mutants) if mutants else None
    from tests.mutants.python_code import python_mutant, python_places  # cosmic-ray is an extra of its own

    places = python_places(text)
    if not places:
        return None
    # By kind first: there are so many numbers that they would be half of all mistakes.
    kind = source.choice(sorted({kind for kind, _ in places}))
    return python_mutant(name, text, source.choice([place for place in places if place[0] == kind]))
