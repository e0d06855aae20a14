"""Twelve variations of the present scene as small pictures, to choose from and to vary again."""

from __future__ import annotations

import threading
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial
from itertools import islice
from typing import Any

from imgui_bundle import imgui, imgui_ctx

from clfractal.engine.variations import (
    KINDS,
    STRENGTHS,
    Variation,
    candidates,
    nothing_to_vary,
    small_scene,
    worthwhile,
)
from clfractal.engine.varied import Kind, Strength
from clfractal.errors import ClfractalError
from clfractal.scene.load import check_scene
from clfractal.scene.model import Scene
from clfractal.viewer.panels import cards, layout, right_dock, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.preparing import internal_error

COUNT = 12
SPARES = 6
"""Variations that take the places of those that show nothing."""
SIZE = (264, 148)
"""Pixels of a picture: it is shown at about half that size, or on a screen of twice the resolution."""
SAMPLES = 4
"""Of a pixel."""
_KEPT = ("image", "output", "stereo", "bookmarks")
_LEAST = 84.0  # points of a card
_GAP = 6.0
_KIND_WORDS: dict[Kind, str] = {"formula": "Formula", "camera": "Camera", "colors": "Colours"}
_KIND_TIPS: dict[Kind, str] = {
    "formula": "parameters of the formula, within their ranges",
    "camera": "the point of view",
    "colors": "material, palettes, lights and background",
}


class Draw:
    """Draws variations in a thread of its own, one after the other, and their small pictures' scenes.

    Attributes:
        found: those that are there: (variation, the scene of its picture).
        problem: why there are no more, or empty.
        finished: whether all are there.
    """

    def __init__(
        self, base: Scene, strength: Strength, seed: int, kinds: frozenset[Kind], woken: Callable[[], None]
    ) -> None:
        self.kinds, self.woken = kinds, woken
        self._draw = partial(candidates, base, strength=strength, seed=seed, kinds=kinds)
        self.found: list[tuple[Variation, Scene]] = []
        self.problem = ""
        self.finished = self.stopped = False
        self._thread = threading.Thread(target=self._work, name="clfractal-variations", daemon=True)
        self._thread.start()

    def join(self) -> None:
        """Waits for the end."""
        self._thread.join()

    def _work(self) -> None:
        try:
            for each in islice(self._draw(), COUNT + SPARES):
                if self.stopped:
                    return
                self.found.append((each, small_scene(each.scene, *SIZE)))
                self.woken()
            if not self.found:
                self.problem = nothing_to_vary([kind for kind in KINDS if kind in self.kinds]).message
        except ClfractalError as error:
            self.problem = error.message
        except Exception as error:  # a panel shows it
            self.problem = internal_error(error).message
        self.finished = True
        self.woken()


@dataclass(slots=True)
class Choice:
    """What the panel remembers.

    Attributes:
        base: the scene that is varied.
        history: of the window's file: another file begins anew.
        number: of the present set: pictures of other sets are forgotten.
        trail: earlier bases and their seeds, to step back to.
        dull: numbers of variations that show nothing.
        taken: scenes that were put into the window, by the number of their variation.
    """

    base: Scene
    history: Any
    strength: Strength = "medium"
    kinds: frozenset[Kind] = frozenset(KINDS)
    seed: int = 0
    number: int = 0
    work: Draw | None = None
    trail: list[tuple[Scene, int]] = field(default_factory=list)
    dull: set[int] = field(default_factory=set)
    taken: dict[int, Scene] = field(default_factory=dict)
    place: tuple[Scene, int | None] | None = None


def draw(ui: Ui) -> None:
    """Draws the panel, if it is open."""
    state: Choice | None = ui.memory.get("variations")
    if "variations" not in ui.show:
        if state is not None and state.work is not None:
            _stop(ui, state)
        return
    scene = ui.studio.scene
    if state is None:
        state = ui.memory["variations"] = Choice(scene, ui.studio.history)
    if state.history is not ui.studio.history or (state.work is None and _number_of(ui, state) is None):
        state.history, state.trail = ui.studio.history, []
        begin(ui, state, scene)
    elif state.work is None:
        taken = state.taken
        begin(ui, state, state.base, state.seed)
        state.taken = taken
    with right_dock.window(ui, "variations", "Variations", theme.RANDOM):
        _settings(ui, state)
        _grid(ui, state)
        _buttons(ui, state)


def begin(ui: Ui, state: Choice, base: Scene, seed: int | None = None) -> None:
    """Draws a new set: of a scene, or the same scene's with another seed."""
    _stop(ui, state)
    state.base, state.seed = base, state.seed + 1 if seed is None else seed
    state.dull, state.taken, state.place = set(), {}, None
    state.number += 1
    state.work = Draw(base, state.strength, state.seed, state.kinds, ui.studio.woken)


def shown(state: Choice) -> list[int]:
    """Numbers of the variations in the grid: the first ones that show something."""
    if state.work is None:
        return []
    return [number for number in range(len(state.work.found)) if number not in state.dull][:COUNT]


def taken_over(variation: Scene, present: Scene) -> Scene:
    """A variation with what of the present scene is no part of a variation: bookmarks, output, stereo."""
    found = variation.model_copy(update={name: getattr(present, name) for name in _KEPT})
    try:
        check_scene(found)
    except ClfractalError:  # stereo was switched on since, and does not fit an orthographic camera
        found = found.model_copy(update={"stereo": variation.stereo})
    return found


def _stop(ui: Ui, state: Choice) -> None:
    if state.work is not None:
        state.work.stopped = True
        state.work = None
    ui.studio.forget_thumbnails(lambda key: isinstance(key, tuple) and key[0] == "variation")


def _settings(ui: Ui, state: Choice) -> None:
    wide = imgui.get_content_region_avail().x
    words = {each: each.capitalize() for each in STRENGTHS}
    found = w.segments("variations.strength", words, state.strength, wide)
    strength, kinds = found or state.strength, state.kinds
    each_width = (wide - 2 * 4) / len(KINDS)
    for place, kind in enumerate(KINDS):
        if place:
            w.in_row(4)
        on = kind in state.kinds
        if _chip(_KIND_WORDS[kind], on, each_width, f"Vary {_KIND_TIPS[kind]}"):
            kinds = state.kinds ^ {kind} or kinds
    if (strength, kinds) != (state.strength, state.kinds):
        state.strength, state.kinds = strength, kinds
        begin(ui, state, state.base, state.seed)
    imgui.dummy(imgui.ImVec2(0, 1))


def _chip(text: str, on: bool, width: float, about: str) -> bool:
    back = theme.ACCENT_FAINT if on else theme.FRAME
    with theme.colors(button=back, text=theme.ACCENT if on else theme.DIM):
        clicked = imgui.button(text, imgui.ImVec2(width, 0))
    w.tip(about)
    return bool(clicked)


def _grid(ui: Ui, state: Choice) -> None:
    foot = imgui.get_frame_height() + 10
    room = imgui.get_content_region_avail()
    imgui.begin_child("##cards", imgui.ImVec2(room.x, room.y - foot))
    work = state.work
    if work is not None and work.problem:
        imgui.dummy(imgui.ImVec2(0, 4))
        layout.warn(work.problem)
    elif work is not None:
        if not work.finished:
            ui.memory["awaited"] = True
        room = imgui.get_content_region_avail()
        columns, width = layout_of(room.x - 1, room.y)
        corner = imgui.get_cursor_pos()
        left = corner.x + (room.x - columns * width - _GAP * (columns - 1)) / 2
        numbers = shown(state)
        for place in range(COUNT if not work.finished else len(numbers)):
            row, column = divmod(place, columns)
            step = cards.height(width) + _GAP
            imgui.set_cursor_pos(imgui.ImVec2(left + column * (width + _GAP), corner.y + row * step))
            if place < len(numbers):
                _card(ui, state, work, numbers[place], width)
                if state.work is not work:
                    break  # a double click has begun a new set
            else:
                cards.draw(ui, f"waiting.{place}", cards.Card("", None), width)
    imgui.end_child()


def layout_of(width: float, height: float) -> tuple[int, float]:
    """How many columns of cards a part of the panel has, and how wide they are: as large as they all fit, points."""
    counts = [(-(-COUNT // columns), columns) for columns in range(1, COUNT + 1)]
    most, columns = max(
        (min((width + _GAP) / columns - _GAP, ((height + _GAP) / rows - _GAP) * 16 / 9), columns)
        for rows, columns in counts
    )
    # In a part that is too small they scroll.
    return (columns, most) if most >= _LEAST else cards.grid(width, _LEAST, _GAP)


def _card(ui: Ui, state: Choice, work: Draw, number: int, width: float) -> None:
    variation, small = work.found[number]
    key = ("variation", state.number, number)
    picture = ui.studio.thumbnail(key, lambda: small, SIZE, SAMPLES)
    if picture.framebuffer is not None:
        if len(work.found) - len(state.dull) > COUNT and not worthwhile(picture.framebuffer):
            state.dull.add(number)
            ui.memory["awaited"] = True
        picture.framebuffer = None
    card = cards.Card(key, picture.pixels, picture.problem, chosen=_number_of(ui, state) == number)
    with imgui_ctx.push_id(f"{state.number}"):
        clicked = cards.draw(ui, f"{number}", card, width)
        again = imgui.is_item_hovered() and imgui.is_mouse_double_clicked(0)
        w.tip(picture.problem or f"{variation.remark}\nDouble click: vary this one")
    if again:
        state.trail.append((state.base, state.seed))
        begin(ui, state, ui.studio.scene if _number_of(ui, state) == number else variation.scene)
    elif clicked:
        taken = taken_over(variation.scene, ui.studio.scene)
        state.taken[number] = taken
        ui.studio.set_scene(taken)


def _alike(one: Scene, other: Scene) -> bool:
    """Whether two scenes differ at most in what is no part of a variation."""
    return one is other or one.model_copy(update={name: getattr(other, name) for name in _KEPT}) == other


def _number_of(ui: Ui, state: Choice) -> int | None:
    """The number of the variation that the window shows, -1 for the base, None for another scene."""
    scene = ui.studio.scene
    if state.place is None or state.place[0] is not scene:
        found = next((number for number, each in state.taken.items() if _alike(each, scene)), None)
        if found is None and _alike(state.base, scene):
            found = -1
        state.place = (scene, found)
    return state.place[1]


def _buttons(ui: Ui, state: Choice) -> None:
    imgui.dummy(imgui.ImVec2(0, 0))
    number = _number_of(ui, state)
    wide = imgui.get_content_region_avail().x
    each = (wide - 2 * 6) / 3
    if w.button("New", icon=theme.RANDOM, primary=True, width=each, about="Twelve others of the same scene"):
        begin(ui, state, state.base)
    w.in_row()
    back = bool(state.trail) or number != -1
    about = "Back to the scene that is varied; once more: to what was varied before"
    if w.button("Back", icon=theme.UNDO, width=each, about=about, enabled=back):
        step_back(ui, state)
    w.in_row()
    about = "Variations of the scene as it is now"
    if w.button("Vary this", icon=theme.TARGET, width=each, about=about, enabled=number != -1):
        state.trail.append((state.base, state.seed))
        begin(ui, state, ui.studio.scene)


def step_back(ui: Ui, state: Choice) -> None:
    """Shows the scene that is varied; if that is shown, the one that was varied before, and its variations."""
    if _number_of(ui, state) == -1 and state.trail:
        base, seed = state.trail.pop()
        begin(ui, state, base, seed)
    back = taken_over(state.base, ui.studio.scene)
    if back != ui.studio.scene:
        ui.studio.set_scene(back)
    state.place = None
