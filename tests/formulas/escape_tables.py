"""Tables of how many steps orbits take to escape, and the formula of each."""

from __future__ import annotations

import json
from pathlib import Path

from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain

TABLES = Path(__file__).resolve().parent.parent / "reference"

CASES: dict[str, dict[str, float]] = {
    **json.loads((TABLES / "index.json").read_text()),
    "hast_edges": {"iterations": 40, "bailout": 4},
}


def chain_of(case: str) -> Chain:
    """The formula of a table, from its name: `mandelbulb_power8`."""
    name, _, setting = case.partition("_")
    for parameter in ("power", "scale"):
        if setting.startswith(parameter):
            return catalog.load_chain(name, {parameter: float(setting.removeprefix(parameter))})
    return catalog.load_chain(name)
