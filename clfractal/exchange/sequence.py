"""Which formulas of a settings file are applied, how often, and what is added: a scene's section `formula`.

Theirs begin at the point and apply the first formula to it. Ours that add the point begin at 0, and the first application
gives the point; so they have one application more. Where that is not the same, a member that does nothing comes first.
"""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

from clfractal.errors import FileError
from clfractal.exchange.colors import follows_folds
from clfractal.exchange.counterparts import counterpart
from clfractal.exchange.ends import (
    BAILOUT,
    DISCS,
    PLANES,
    distance_to_disc,
    distance_to_middle,
    distance_to_planes,
)
from clfractal.exchange.installed import ADD_THEMSELVES, Installed
from clfractal.exchange.measure import is_ball, measured
from clfractal.exchange.plan import (
    MOST_ITERATIONS,
    TRANSFORMS,
    Place,
    Plan,
    Slot,
    plan_of,
    slot_of,
    used_slots,
)
from clfractal.exchange.settings import SLOTS, Settings
from clfractal.exchange.solid_formulas import MOST_FORMULAS
from clfractal.exchange.translate import NO_FOLDS, Space
from clfractal.exchange.translated import STAYS, Following, Text, followed_as_needed, text_of

MOST_LINKS = 63
FOLLOWED = 260
"""Applications that are followed one by one; those after them are as the last ones."""
_CHOSEN = (2, 20)
"""The first version whose files choose what a distance is made by."""
_POWERS = re.compile("^(mandelbulb|quaternion|hypercomplex)")
"""How the names of texts begin whose formulas raise a place to a power."""


def formula_of(
    settings: Settings, installed: Installed | None, remarks: list[str], *, hollow: bool | None = None
) -> dict[str, Any] | str:
    """The section `formula` of a scene; `none` where the first of joined formulas has a place of its own.

    Args:
        installed: where texts of formulas are read; None: there are none.
        hollow: what does not escape is no solid: distances are those of the last application, of powers (True) or not.

    Raises:
        FileError: a formula has no counterpart, at its line; or a value is none of its kind.
    """
    main = settings.main
    joined = main.flag("boolean_operators", False)
    place = Place.of(main, 1) if joined else Place()
    if place.is_elsewhere:
        return "none"  # it is an object as the others are
    hybrid = main.flag("hybrid_fractal_enable", False) and not joined
    used = used_slots(settings, hybrid, joined)
    slots = [slot_of(settings, slot, remarks, hybrid=hybrid) for slot in used]
    for slot in slots:
        if slot.weight not in (0, 1):
            remarks.append(f"formula_weight_{slot.slot}: its map is not blended with z by {slot.weight:g}")
    if not joined:
        main.without(main.beginning("formula_scale_"))
    if not hybrid:
        main.without(main.beginning("formula_weight_"))
    plan = plan_of(settings, 1 if joined else None, place, installed, remarks, hollow)
    alone = len(slots) == 1 and hollow is None and (installed is None or slots[0].number not in DISCS)
    section = _by_library(plan, slots[0]) if alone else None
    if section is None:
        section = _by_texts(plan, slots, main.whole("repeat_from", 1))
    if not joined:
        _without_others(settings)
    # Where surfaces are those of what does not escape, they depend on it.
    chosen = main.flag("iteration_threshold_mode", False) and not main.flag("use_default_bailout", True)
    if chosen and is_ball(section):
        section["bailout"] = min(max(main.number("bailout", BAILOUT), 1.0), 1e9)
    return section


def joined_of(settings: Settings, installed: Installed | None, remarks: list[str]) -> dict[str, Any]:
    """The formulas of a file that joins them, as objects of a scene, but for a first one that is the scene's own.

    Those after it that have no counterpart are told.

    Raises:
        FileError: a value is none of its kind, or the first formula has no counterpart.
    """
    main = settings.main
    found: dict[str, Any] = {}
    if not main.flag("boolean_operators", False):
        return found
    for slot in range(1, SLOTS + 1):
        if main.whole(f"formula_{slot}", 2 if slot == 1 else 0) == 0:
            main.without(main.beginning(f"formula_scale_{slot}", f"formula_position_{slot}"))
            continue
        place = Place.of(main, slot)
        if slot == 1 and not place.is_elsewhere:
            continue
        if len(found) >= MOST_FORMULAS:
            remarks.append(f"formula_{slot}: no more objects can be formulas")
            continue
        joins = "union" if slot == 1 else _JOINS.get(main.whole(f"boolean_operator_{slot - 1}", 1), "union")
        try:
            plan = plan_of(settings, slot, place, installed, remarks)
            one = slot_of(settings, slot, remarks)
            section = _by_library(plan, one) or _by_texts(plan, [one], 1)
        except FileError as error:
            if slot == 1:
                raise
            remarks.append(str(error).removeprefix(f"{settings.file}:"))
            continue
        found[f"formula {slot}"] = {"type": "formula", "formula": section, **place.keys, "join": joins}
    _without_others(settings)
    return found


_JOINS = {0: "intersection", 1: "union", 2: "cut"}


def _without_others(settings: Settings) -> None:
    """What nobody asked for belongs to other formulas."""
    for slot in range(1, SLOTS + 1):
        settings.fractal(slot).without(settings.fractal(slot).entries)


def _by_library(plan: Plan, slot: Slot) -> dict[str, Any] | None:
    """A formula alone that our library has; None if it has not."""
    found = counterpart(slot.number, plan.settings.fractal(slot.slot))
    if plan.folds != NO_FOLDS or any(plan.repeats):
        return None
    if isinstance(found, str) or (plan.w and found.four) or (plan.mirrored and not found.even):
        return None
    own = slot.number in ADD_THEMSELVES
    julia = None if own else plan.julia
    if found.adds and not slot.adds and not own:
        julia = (0.0, 0.0, 0.0)
    if slot.adds and (not found.adds or (julia is None and plan.factors != (1, 1, 1))):
        return None
    more = 1 if found.adds and julia is None else 0
    section: dict[str, Any] = {**found.source, "iterations": min(plan.most + more, MOST_ITERATIONS)}
    if found.adds and julia is not None:
        x, y, z = julia
        section["julia"] = [x, y, -z if plan.mirrored else z, 0.0][: 4 if found.four else 3]
    return section


def _by_texts(plan: Plan, slots: Sequence[Slot], repeat: int) -> dict[str, Any]:
    """Formulas by their texts, as a chain."""
    solids = _counts_solids(plan, slots)
    texts = {slot.slot: _text(plan, slot, solids=solids) for slot in slots}
    order = turns(slots, repeat, min(plan.most, FOLLOWED))
    followed, following = _all_followed(plan, slots, texts, order)
    size = len(followed[0]["variables"])
    links = _links(followed)
    if links is None:
        # Applications differ too often to be formulas of their own: one formula has their number, and what changes.
        shift = int(_begins_at_point(plan, followed))
        followed, following = _all_followed(plan, slots, texts, order, following.changed, shift)
        links = _links(followed)
    if links is None:
        where = plan.settings.main.where(f"formula_{slots[0].slot}")
        raise FileError("applications differ too often for a chain of formulas", where)
    standing = _begins_at_point(plan, followed)
    if standing:
        links = [
            following.standing(),
            *({**link, "start": link["start"] + 1, **_later(link)} for link in links),
        ]
    if size == 4 and plan.w:
        for link in links:
            link["formula"] = {**link["formula"], "slice": {"w": plan.w}}
    plan.settings.origins.extend(_origins(slots, texts))
    return measured(links, plan.most + standing, plan.reach, plan.repeats)


def _begins_at_point(plan: Plan, followed: Sequence[dict[str, Any]]) -> bool:
    """Whether orbits need an application of their own to begin where theirs do."""
    return any(plan.repeats) or any(each["add"] == "point" for each in followed)


def _all_followed(
    plan: Plan,
    slots: Sequence[Slot],
    texts: dict[int, Text],
    order: Sequence[int],
    carried: tuple[str, ...] = (),
    shift: int | None = None,
) -> tuple[list[dict[str, Any]], Following]:
    """The formula of each application: of three numbers, if that is enough, and with what has to be carried."""
    first = texts[slots[0].slot].parameters
    last = _last(plan, slots, texts)
    stands_still = last is not None and any(slot.number in DISCS for slot in slots)
    bailout = _bailout(plan) if stands_still else None
    if last is not None or plan.hollow is not None:
        carried = (*carried, *(() if "DE" in carried else ("DE",)))

    def begin(four: bool, carried: tuple[str, ...]) -> Following:
        own = last if plan.hollow is None else distance_to_middle(4 if four else 3, powers=plan.hollow)
        space = Space(four, plan.mirrored, plan.repeats)
        return Following(space, first, carried, shift, plan.folds, own, bailout)

    return followed_as_needed(
        begin,
        lambda following: _followed(plan, slots, texts, order, following),
        four=plan.w != 0,
        carried=carried,
    )


def _bailout(plan: Plan) -> float:
    """Beyond which orbits of the Pseudo Kleinian end."""
    main = plan.settings.main
    own = not main.flag("use_default_bailout", True)
    return max(main.number("bailout", BAILOUT), 1.0) if own else BAILOUT


def _last(plan: Plan, slots: Sequence[Slot], texts: dict[int, Text]) -> str | None:
    """The distance by the end of orbits, where all formulas are of a kind that has one of its own, or transforms."""
    if plan.hollow is not None:
        return None
    wanted = _wanted(plan)
    kinds = (
        (DISCS, ("3", "pseudo_kleinian"), distance_to_disc),
        (PLANES, ("4", "jos_kleinian"), distance_to_planes),
    )
    own = [slot for slot in slots if slot.number < TRANSFORMS]
    for kind, names, distance in kinds:
        if own and (wanted in names if wanted else all(slot.number in kind for slot in own)):
            return distance(texts[own[0].slot].parameters)
    return None


def _later(link: dict[str, Any]) -> dict[str, int]:
    return {"stop": link["stop"] + 1} if "stop" in link else {}


def _wanted(plan: Plan) -> str | None:
    """The distance that a file chooses; empty where that follows from its formulas, None in files that have no choice."""
    # (In files of before 2.20 it has no effect.)
    if (plan.settings.version or _CHOSEN) < _CHOSEN:
        return None
    wanted = plan.settings.main.text("delta_DE_function").strip()
    return "" if wanted in ("0", "preferred") else wanted


def _counts_solids(plan: Plan, slots: Sequence[Slot]) -> bool:
    """Whether solids that transforms put into space count: not beside powers, whose distance is preferred to theirs."""
    if plan.installed is None or _wanted(plan) != "":
        return True
    files = [plan.installed.text(slot.number) for slot in slots if slot.number < TRANSFORMS]
    return not any(found is not None and _POWERS.match(found[1].name) for found in files)


def _text(plan: Plan, slot: Slot, *, solids: bool) -> Text:
    fractal = plan.settings.fractal(slot.slot)
    where = plan.settings.main.where(f"formula_{slot.slot}")
    found = text_of(slot.number, fractal, plan.installed, colors=follows_folds(plan.settings), solids=solids)
    if found is not None and slot.weight == 0:  # its turn leaves z where it is
        found.statements = STAYS
    if found is None:
        reason = counterpart(slot.number, fractal)
        why = reason if isinstance(reason, str) else "our library has it, but not with what is added here"
        how = (
            "no installed Mandelbulber 2 has its text" if plan.installed is None else "its text is not there"
        )
        raise FileError(f"formula {slot.number} has no counterpart: {why}; and {how}", where)
    return found


def _followed(
    plan: Plan, slots: Sequence[Slot], texts: dict[int, Text], order: Sequence[int], following: Following
) -> list[dict[str, Any]]:
    """The formula of each application."""
    by_number = {slot.slot: slot for slot in slots}
    found = []
    for application, number in enumerate(order):
        formula = following.applied(texts[number], application, plan.addition(by_number[number]))
        found.append(formula)
    return found


def _origins(slots: Sequence[Slot], texts: dict[int, Text]) -> list[str]:
    return [f"formula_{slot.slot}, {slot.number}, is made of {texts[slot.slot].file}" for slot in slots]


def turns(slots: Sequence[Slot], repeat: int, count: int) -> list[int]:
    """Whose turn it is in each of `count` applications, as they have it: the slots' numbers."""
    found: list[int] = []
    again = next((place for place, slot in enumerate(slots) if slot.slot >= repeat), 0)
    place = done = 0

    def following(now: int) -> int:
        return now + 1 if now + 1 < len(slots) else again

    for application in range(count):
        done += 1
        for _ in range(SLOTS):
            if slots[place].start <= application <= slots[place].stop:
                break
            place = following(place)
        found.append(slots[place].slot)
        if done >= slots[place].count:
            done, place = 0, following(place)
    return found


def _links(followed: Sequence[dict[str, Any]]) -> list[dict[str, Any]] | None:
    """Members of a chain that have these turns; None if they would be too many.

    The end of the applications that are followed repeats for ever: the shortest part that does.
    """
    keys = [id(formula) for formula in followed]
    for period in range(1, min(MOST_LINKS, len(keys)) + 1):
        begin = len(keys) - period
        while begin > 0 and keys[begin - 1] == keys[begin - 1 + period]:
            begin -= 1
        found = [
            *_runs(0, begin, keys, followed, stop=True),
            *_runs(begin, begin + period, keys, followed, stop=False),
        ]
        repeats = begin + 2 * period <= len(keys) or begin + period >= len(keys)
        if len(found) <= MOST_LINKS and repeats:
            return found
    return None


def _runs(
    begin: int, end: int, keys: Sequence[int], followed: Sequence[dict[str, Any]], *, stop: bool
) -> list[dict[str, Any]]:
    """Members for the applications from `begin` to `end`: each run of one formula, which stops after it or comes again."""
    found: list[dict[str, Any]] = []
    place = begin
    while place < end:
        last = place
        while last < end and keys[last] == keys[place]:
            last += 1
        start = place if stop else begin
        link: dict[str, Any] = {"formula": followed[place], "count": last - place, "start": start}
        found.append({**link, "stop": last} if stop else link)
        place = last
    return found
