"""Puts small mistakes into copies of the program and tells which no test noticed.

    python -m tests.mutants                            60 mistakes, chosen by the seed 1
    python -m tests.mutants --sample 20 --seed 7
    python -m tests.mutants --only 'kernels/integrators/march/queue.h'   mistakes of some files only
    python -m tests.mutants --sample 5 --list          shows them without running a test

Run it in a checkout. Each survivor is printed with its change: it wants a test, or it changes nothing (say so where you
tell the figure).
"""

from __future__ import annotations

import argparse
import sys
from collections import Counter
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from queue import SimpleQueue

from tests.mutants.mutant import Mutant
from tests.mutants.sample import sample
from tests.mutants.trial import Outcome, Trial

CHECKOUT = Path(__file__).resolve().parents[2]


def main(arguments: Sequence[str]) -> int:
    """The number of survivors, as an exit status of at most 1."""
    parser = argparse.ArgumentParser("python -m tests.mutants", description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--sample", type=int, default=60, help="how many mistakes")
    parser.add_argument("--seed", type=int, default=1, help="which: the same seed, the same mistakes")
    parser.add_argument(
        "--skip", type=int, default=0, help="leave out the first of them, to go on with a sample"
    )
    parser.add_argument("--only", default="*", help="only files that fit a pattern, like 'kernels/*'")
    parser.add_argument("--jobs", type=int, default=1, help="how many at once")
    parser.add_argument("--first", action="store_true", help="ask no more tests than those of the file")
    parser.add_argument("--list", action="store_true", help="show the mistakes and end")
    parser.add_argument(
        "--folder", type=Path, default=CHECKOUT / "build" / "mutants", help="for copies and caches"
    )
    chosen = parser.parse_args(arguments)
    mutants = list(sample(CHECKOUT, chosen.sample, chosen.seed, chosen.only))[chosen.skip :]
    if chosen.list:
        print("\n\n".join(mutant.diff() for mutant in mutants))
        return 0
    trials: SimpleQueue[Trial] = SimpleQueue()
    for number in range(chosen.jobs):
        trials.put(Trial(CHECKOUT, chosen.folder / str(number), quick=not chosen.first))

    def attempt(mutant: Mutant) -> Outcome:
        trial = trials.get()
        try:
            outcome = trial.of(mutant)
        finally:
            trials.put(trial)
        print(_line(outcome), flush=True)
        return outcome

    with ThreadPoolExecutor(chosen.jobs) as pool:
        outcomes = list(pool.map(attempt, mutants))
    return _summary(outcomes)


def _line(outcome: Outcome) -> str:
    line = f"{outcome.verdict:9} {outcome.seconds:4.0f} s  {outcome.mutant.path}: {outcome.mutant.what}"
    return f"{line}\n{outcome.mutant.diff()}\n" if outcome.verdict == "survived" else f"{line}; {outcome.by}"


def _summary(outcomes: Sequence[Outcome]) -> int:
    counts = Counter(outcome.verdict for outcome in outcomes)
    noticed = len(outcomes) - counts["survived"]
    share = noticed / max(len(outcomes), 1)
    late = f", {counts['timed out']} of them by taking too long" if counts["timed out"] else ""
    print(f"{noticed} of {len(outcomes)} noticed ({share:.0%}){late}")
    return int(counts["survived"] > 0)


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
