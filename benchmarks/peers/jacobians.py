"""The automatic Jacobian of every formula that is made of an installed text, beside finite differences with many digits.

    python -m benchmarks.peers.jacobians [NAME ...] [--device] [--rounds N] [--places N] [--seed S] [-o FILE.json]

A line for each text: the places where partials were compared, those that were drawn anew as a case changes within the step,
the largest relative difference, and whether they agree; or why the text is not translated. The first round has the
parameters' defaults, the others random ones. With `--device` kernels differentiate, in float64, and both ways in which
formulas are written are looked at; else it is Python with as many digits. The status is 1 if some do not agree.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from random import Random
from typing import Any

from benchmarks.peers.device_slopes import AGREED as AGREED_ON_DEVICE
from benchmarks.peers.device_slopes import slopes_on
from benchmarks.peers.slopes import AGREED, Slopes, slopes_of
from benchmarks.peers.texts import formulas_of
from clfractal.device.select import Device, choose
from clfractal.errors import ClfractalError
from clfractal.exchange.installed import Installed, find_installed

HEAD = f"{'text':40} {'rounds':>6} {'places':>6} {'anew':>6} {'largest':>8}  verdict"


def looked_at(
    path: Path,
    number: int | None,
    installed: Installed,
    *,
    rounds: int,
    places: int,
    seed: int,
    device: Device | None = None,
) -> dict[str, Any]:
    """What is known of a text: of its partials, and why it is not translated where it is not.

    Args:
        device: whose partials are looked at; None: those of mpmath.
    """
    found = Slopes()
    translated = 0
    refused: list[str] = []
    for turn in range(rounds):
        # Of each text by itself, so that one can be looked at again.
        chance = Random(f"{seed} {path.name} {turn}")
        try:
            formulas = formulas_of(path, number, installed, chance if turn else None)
        except ClfractalError as error:
            refused.append(str(error).removeprefix(f"{path.parent}/"))
            continue
        translated += 1
        for application, bound in formulas:
            if device is None:
                slopes_of(bound, application, chance, places, found)
            else:
                slopes_on(device, bound, application, chance, places, found)
    return {
        "rounds": translated,
        **asdict(found),
        "refused": list(dict.fromkeys(refused)),
        "verdict": _verdict(found, translated, AGREED if device is None else AGREED_ON_DEVICE),
    }


def _verdict(found: Slopes, translated: int, agreed: float) -> str:
    if not translated:
        return "not translated"
    if not found.places:
        return "no place where all is finite" if found.endless >= found.anew else "a case changes everywhere"
    return "agree" if found.largest <= agreed else "differ"


def line(name: str, record: Mapping[str, Any]) -> str:
    """A text's line of the table."""
    cells = [f"{name[:40]:40}", *(f"{record[key]:6}" for key in ("rounds", "places", "anew"))]
    why = record["where"] if record["verdict"] == "differ" else "; ".join(record["refused"])
    return f"{' '.join(cells)} {record['largest']:8.1e}  {record['verdict']}" + (f": {why}" if why else "")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(
        prog="jacobians", description=__doc__.split("\n", 1)[0] if __doc__ else None
    )
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help="texts with this in their name; without: all"
    )
    parser.add_argument("--device", action="store_true", help="look at what kernels compute")
    parser.add_argument(
        "--rounds", type=int, default=4, metavar="N", help="sets of parameters; the first are the defaults"
    )
    parser.add_argument("--places", type=int, default=3, metavar="N", help="for each formula of a round")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="of parameters and places")
    parser.add_argument(
        "-o", "--output", type=Path, default=Path("build/jacobians.json"), metavar="FILE.json"
    )
    options = parser.parse_args(arguments)
    installed = find_installed()
    if installed is None:
        print(
            "Mandelbulber 2 is not installed (apt-get install mandelbulber2): there are no texts to look at"
        )
        return 2
    device = choose() if options.device else None
    records: dict[str, Any] = {}
    print(HEAD)
    for path, number in installed.files.items():
        if options.names and not any(name in path.stem for name in options.names):
            continue
        records[path.stem] = looked_at(
            path,
            number,
            installed,
            rounds=options.rounds,
            places=options.places,
            seed=options.seed,
            device=device,
        )
        print(line(path.stem, records[path.stem]), flush=True)
    options.output.parent.mkdir(parents=True, exist_ok=True)
    options.output.write_text(json.dumps(records, indent=1, sort_keys=True), "utf-8")
    verdicts = [record["verdict"] for record in records.values()]
    print("\n" + ", ".join(f"{verdicts.count(each)} {each}" for each in dict.fromkeys(verdicts)))
    return int("differ" in verdicts)


if __name__ == "__main__":
    sys.exit(main())
