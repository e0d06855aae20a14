"""Whose turn it is in a chain, and what follows from it: degree, shape, errors."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, NamedTuple

import mpmath
import numpy as np
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

import clfractal
from clfractal.formulas import catalog
from clfractal.formulas.chain import Chain
from clfractal.formulas.reference import distance, escape, mp_escape, mp_orbit
from clfractal.formulas.turns import spans_of
from tests.calls import failure
from tests.formulas.own_formulas import BALL


class Turn(NamedTuple):
    count: int  # type: ignore[assignment]  # hides tuple.count, as a link's count does
    start: int
    stop: int | None


def simulated(members: Sequence[Turn], applications: int) -> list[int] | None:
    """The member of each application, by walking from turn to turn; None if some application has none."""
    found: list[int] = []
    member, done = 0, 0
    for n in range(applications):
        takes_part = [m.start <= n and (m.stop is None or n < m.stop) for m in members]
        if not any(takes_part):
            return None
        while not takes_part[member] or done >= members[member].count:
            member, done = (member + 1) % len(members), 0
        found.append(member)
        done += 1
    return found


def member_at(members: Sequence[Turn], application: int) -> int:
    spans = spans_of(members)
    place = next(s for s in spans if s.end is None or application < s.end).place(application)
    for index, member in enumerate(members):
        if place < member.count:
            return index
        place -= member.count
    raise AssertionError


turns = st.builds(
    lambda count, start, length: Turn(count, start, None if length is None else start + length),
    st.integers(1, 4),
    st.integers(0, 9),
    st.none() | st.integers(1, 12),
)


@given(st.lists(turns, min_size=1, max_size=5))
def test_turns_are_those_of_a_walk(members: list[Turn]) -> None:
    walked = simulated(members, 60)
    if walked is None:
        with pytest.raises(clfractal.FormulaError, match="start and stop leave a gap"):
            spans_of(members)
        return
    assert [member_at(members, n) for n in range(60)] == walked


@given(st.lists(turns, min_size=1, max_size=5))
def test_the_last_span_repeats_itself(members: list[Turn]) -> None:
    assume(simulated(members, 30) is not None)
    last = spans_of(members)[-1]
    for n in range(last.begin, last.begin + 20):
        assert member_at(members, n) == member_at(members, n + last.cycle)
    assert last.begin <= max(m.stop or m.start for m in members)


MEMBER = {"count": 2, "start": 0, "stop": 6}


def chain(*members: dict[str, Any], **keys: Any) -> Chain:
    return catalog.load_chain({"chain": list(members), **keys})


def names(of: Chain, applications: int) -> list[str]:
    return [of.link_at(n).bound.formula.name for n in range(applications)]


def test_a_member_that_does_not_take_part_is_passed_over() -> None:
    both = chain({"name": "mandelbox", "count": 2}, {"name": "mandelbulb", "start": 1, "stop": 6})
    box, bulb = "mandelbox", "mandelbulb"
    assert names(both, 10) == [box, box, bulb, box, box, bulb, box, box, box, box]
    late = chain({"name": "mandelbulb", "start": 2}, {"name": "mandelbox"})
    assert names(late, 6) == [box, box, bulb, box, bulb, box]
    assert late.first.formula.name == box
    cut = chain({"name": "mandelbulb", "count": 5, "stop": 3}, {"name": "mandelbox"})
    assert names(cut, 5) == [bulb, bulb, bulb, box, box]


GAPS = [
    ([{"name": "hast", "start": 1}], "in application 0"),
    ([{"name": "hast", "stop": 3}], "from application 3 on"),
    ([{"name": "hast", "stop": 3}, {"name": "hast", "start": 7}], "in applications 3 to 6"),
]


@pytest.mark.parametrize(("members", "where"), GAPS)
def test_a_gap_is_refused(members: list[dict[str, Any]], where: str) -> None:
    text = f"formula.chain: no formula takes part {where}: start and stop leave a gap"
    scene = {"version": 1, "formula": {"chain": members}, "camera": {}}
    assert str(failure(clfractal.ClfractalError, clfractal.load_scene, scene)) == text


WRONG = [
    ({"start": 4, "stop": 4}, "stop", "must be above start, 4, got 4"),
    ({"start": -1}, "start", "at least 0"),
    ({"start": 1.5}, "start", "whole number"),
    ({"stop": 2_000_000}, "stop", "at most 1000000"),
]


@pytest.mark.parametrize(("keys", "key", "words"), WRONG)
def test_mistakes_are_told_with_their_place(keys: dict[str, Any], key: str, words: str) -> None:
    spec = {"chain": [{"name": "mandelbox"}, {"name": "hast", **keys}]}
    error = failure(
        clfractal.ClfractalError, clfractal.load_scene, {"version": 1, "formula": spec, "camera": {}}
    )
    assert f"formula.chain.1.{key}: " in str(error)
    assert words in str(error)
    # A chain in a file or from Python has no schema before it.
    with pytest.raises(clfractal.FormulaError) as raised:
        catalog.resolve(spec)
    assert raised.value.where.path == f"chain.1.{key}"


def test_a_member_keeps_its_turns_wherever_the_chain_goes() -> None:
    both = chain({"name": "mandelbox", "start": 1}, {"name": "mandelbulb", "count": 2, "stop": 6})
    assert both.source is not None
    again = catalog.resolve(both.source)
    assert again == both
    assert [link.turns for link in again.links] == [(1, 1, None), (2, 0, 6)]
    for change in ({"start": 1}, {"count": 3}, {"stop": 9}):
        member = {"name": "mandelbulb", "count": 2, "stop": 6, **change}
        assert chain({"name": "mandelbox"}, member) != chain({"name": "mandelbox"}, {**member, **MEMBER})


# --- the degree ---


@pytest.mark.parametrize(
    ("members", "degree", "cycle"),
    [
        ([{"name": "mandelbulb", "parameters": {"power": 4}, "count": 2}], 16, 2),
        ([{"name": "mandelbulb", "parameters": {"power": 4}, "count": 2}, {"name": "mandelbox"}], 16, 3),
        ([{"name": "hast", "count": 3}, {"name": "mandelbulb", "parameters": {"power": 3}}], 24, 4),
        ([{"name": "hast", "count": 2, "stop": 9}, {"name": "mandelbulb", "parameters": {"power": 3}}], 3, 1),
        ([{"name": "hast", "count": 2, "stop": 9}, {"name": "mandelbox"}], 1, 1),
        ([{"name": "hast", "count": 2, "start": 9}, {"name": "mandelbox"}], 4, 3),
    ],
)
def test_the_degree_is_the_product_over_a_cycle_of_the_lasting_members(
    members: list[dict[str, Any]], degree: float, cycle: int
) -> None:
    both = chain(*members)
    assert both.degree == pytest.approx(degree)
    assert both.cycle_length == cycle


def test_the_size_far_out_grows_by_the_degree_in_a_cycle() -> None:
    both = chain({"name": "mandelbulb", "parameters": {"power": 3}, "count": 2}, {"name": "mandelbox"})
    points = np.array([[50.0, 3.0, 7.0], [1e3, 2e3, -500.0]])
    for point in points.tolist():
        logs = [float(mpmath.log(mpmath.norm(mpmath.matrix(z)))) for z in mp_orbit(both, point, 6)[3:]]
        # As |z| grows, a cycle multiplies its logarithm by the degree.
        assert logs[3] / logs[0] == pytest.approx(both.degree, rel=0.02)


TWO_BALLS: list[dict[str, Any]] = [
    {"inline": {**BALL, "let": {}, "map": ["x", "y", "z"], "degree": 1}},
    {"inline": BALL, "count": 2},
]


def test_a_member_of_count_2_has_its_degree_twice_in_distances() -> None:
    # After k cycles |z| = |p|^(4^k). The solid of 6 applications is |p| <= 4^(1/16), and that is where the
    # estimate is 0, a Newton step from its surface; with a degree of 2 in place of 4 it would be elsewhere.
    both = chain(*TWO_BALLS, bailout=4)
    r = np.linspace(1.05, 1.5, 400)
    points = r[:, None] * np.array([0.6, 0.0, 0.8])
    got, _ = distance(both, points, 6)
    count, _ = escape(both, points, 30, bailout=both.distance_bailout)
    exact = count % 3 == 0
    assert exact.sum() > 40
    potential, level = np.log(r), math.log(4) / 16
    share = (1 - (level / potential) ** 2) / (1 + potential / 2 + potential**2 / 12)
    expected = np.maximum(0.5 * r * potential * share, 0)
    np.testing.assert_allclose(got[exact], expected[exact], rtol=1e-9, atol=1e-12)
    assert (got[r < 4 ** (1 / 16) - 1e-9] == 0).all()


@pytest.mark.parametrize(("first", "second"), [(0, 1), (1, 0)])
def test_the_shape_is_that_of_the_last_lasting_member_and_of_degree_1_alone(first: int, second: int) -> None:
    members: list[dict[str, Any]] = [{"name": "menger_sponge"}, {"name": "vicsek_cross"}]
    members[second]["stop"] = 2
    both = chain(*members)
    assert both.shape_index == first
    with_bulb = chain({"name": "mandelbulb"}, {"name": "menger_sponge"})
    assert with_bulb.degree > 1
    assert with_bulb.shape_index is None


MEMBERS = [
    {"name": "mandelbox", "parameters": {"scale": -1.5}, "count": 2},
    {"name": "mandelbulb", "parameters": {"power": 2}, "start": 1, "stop": 5},
    {"name": "burning_ship", "start": 3},
]


def test_counts_agree_with_forty_digits() -> None:
    both = chain(*MEMBERS)
    points = np.random.default_rng(5).uniform(-0.8, 0.8, (40, 3))
    count, inside = escape(both, points, 9)
    assert len(set(count.tolist())) > 4
    for point, n, stays in zip(points, count, inside, strict=True):
        assert mp_escape(both, list(point), 9) == (n, stays)
