"""Hybrids of the same slots are one program: orders, counts and ranges are data, and so is who is first and last."""

from __future__ import annotations

from itertools import permutations
from typing import Any

import numpy as np
import pytest

from clfractal.formulas import catalog
from clfractal.formulas.chain import MAX_TABLE, Chain
from clfractal.formulas.opencl import forget_texts, write_formula
from clfractal.formulas.reference import distance, escape
from clfractal.formulas.together import write_together
from clfractal.geometry.solids import Body
from clfractal.integrators import points as at_points
from tests.devices import device
from tests.formulas.grown import CARRIED, NUMBERED, STATEMENTS, ball

Member = dict[str, Any]

_SHAPED: Member = {"name": "octahedral_ifs"}
# A number that begins at the point, and one of the same name that does not.
_POINT: Member = {
    "inline": {
        "variables": ["x", "y", "z"],
        "state": {"m": "x", "u": 2},
        "do": [{"x": "x*x - y*y + 0.1*m", "y": "2*x*y", "m": "0.5*m + u"}],
        "degree": 2,
        "bounds": {"radius": 2},
    }
}
_PLAIN: Member = {
    "inline": {
        "variables": ["x", "y", "z"],
        "state": {"m": "0.5"},
        "do": [{"m": "2*m + 0.01*y"}, {"x": "x*x - y*y - z*z", "y": "2*x*y", "z": "2*x*z + 0.1*m"}],
        "degree": 2,
        "bounds": {"radius": 2},
    }
}
# Of formulas that add the point and others, with degrees above 1 and of 1, with shapes and without, with a scalar rule or
# not, that begin at 0, at the point or after the first application, of three numbers and four, and with the later words.
SLOTS: dict[str, list[Member]] = {
    "powers and folds": [{"name": "mandelbulb"}, {"name": "mandelbox"}, {"name": "menger_sponge"}],
    "shapes": [_SHAPED, {"name": "menger_sponge"}, {"name": "mandelbox", "parameters": {"scale": -1.5}}],
    "powers": [{"name": "hast"}, {"name": "mandelbulb"}, {"name": "burning_ship"}],
    "the same twice": [
        {"name": "mandelbulb", "parameters": {"power": 3}},
        {"name": "mandelbulb"},
        {"name": "mandelbox"},
    ],
    "four numbers": [{"name": "quaternion_julia"}, {"name": "tetrabrot"}, {"name": "mandelbox_4d"}],
    "later words": [{"inline": CARRIED}, {"inline": STATEMENTS}, {"inline": NUMBERED}],
    "numbers that begin in their own ways": [_POINT, _PLAIN, {"name": "hast"}],
    "a Julia set": [
        {"name": "hast", "julia": [0.1, 0.5, 0.2]},
        {"name": "mandelbox"},
        {"name": "kaliset"},
    ],
}
# Whose turns are what: counts, starts and stops of the first, second and third slot of a list.
TURNS: list[tuple[Member, Member, Member]] = [
    ({}, {}, {}),
    ({"count": 2}, {}, {"count": 3}),
    ({"stop": 2}, {}, {"stop": 4}),
    ({}, {"stop": 3}, {"start": 2, "stop": 5}),
    ({"start": 2}, {"start": 1}, {}),
]


def hybrids(slots: list[Member]) -> list[Chain]:
    """Every order of the slots, with all turns."""
    return [
        catalog.load_chain({"chain": [{**slot, **turn} for slot, turn in zip(order, turns, strict=True)]})
        for order in permutations(slots)
        for turns in TURNS
    ]


@pytest.mark.parametrize("name", SLOTS)
def test_the_same_slots_are_one_text(name: str) -> None:
    forget_texts()
    found = hybrids(SLOTS[name])
    written = [write_formula(chain) for chain in found]
    assert len({each.text for each in written}) == 1
    # Their data differ: all but the chains of two slots that are one.
    assert len({each.constants for each in written}) > len(TURNS)
    # A text that is kept is what would be written.
    forget_texts()
    assert [write_formula(chain) for chain in reversed(found)] == written[::-1]


@pytest.mark.parametrize("name", ["powers and folds", "later words"])
def test_so_are_programs_that_look_for_orbits_that_come_back(name: str) -> None:
    texts = {repr(Body(chain, 9).texts(turns=True)) for chain in hybrids(SLOTS[name])}
    assert len(texts) == 1


def test_so_are_joined_hybrids() -> None:
    other = catalog.load_chain("hast")
    texts = {write_together((chain, other)).text for chain in hybrids(SLOTS["powers and folds"])}
    assert len(texts) == 1


@pytest.mark.parametrize("name", SLOTS)
def test_each_order_is_what_it_says(name: str) -> None:
    """On the device the counts and distances of NumPy, which knows nothing of tables."""
    slots = SLOTS[name]
    size = catalog.load_chain(slots[0]).size
    points = ball(1.3, 120)
    options: dict[str, Any] = {"device": device(), "lanes": 1, "precision": "float64"}
    for number, chain in enumerate(hybrids(slots)):
        # Every slot as the first and the last one.
        if number % 7 not in (0, 3):
            continue
        count, inside = escape(chain, points, 7)
        got, stays = at_points.escape(chain, points, 7, **options)
        assert (got == count).mean() > 0.98, (number, size)
        assert (stays == inside).mean() > 0.98
        expected = distance(chain, points, 7)[0]
        full = at_points.distances(chain, points, 7, **options).full
        with np.errstate(all="ignore"):
            near = np.abs(full - expected) <= 1e-6 * (1 + np.abs(expected))
        assert near.mean() > 0.97, number


def test_orbits_that_come_back_are_found_in_hybrids() -> None:
    """A cycle of 3: what is compared is as many applications apart, and what is inside is so after any number."""
    chain = catalog.load_chain(
        {"chain": [{"name": "hast", "count": 2}, {"name": "mandelbulb", "parameters": {"power": 2}}]}
    )
    assert (chain.repeats_from, chain.period) == (0, 3)
    points = ball(0.9, 200)
    _, inside = escape(chain, points, 200)
    got = at_points.escape(chain, points, 200, device=device(), lanes=1, precision="float64")
    assert 10 < inside.sum() < 190
    assert (got[1] == inside).mean() > 0.99


def test_turns_that_take_long_to_repeat_themselves_are_in_the_text() -> None:
    members = [{"name": "mandelbulb", "start": MAX_TABLE}, {"name": "mandelbox", "count": 2}]
    chain = catalog.load_chain({"chain": members})
    assert not chain.turns_are_data
    assert f"if (n < {MAX_TABLE})" in write_formula(chain).text
    points = ball(2.0, 60)
    got = at_points.escape(chain, points, 9, device=device(), lanes=1, precision="float64")
    assert (got[0] == escape(chain, points, 9)[0]).all()
