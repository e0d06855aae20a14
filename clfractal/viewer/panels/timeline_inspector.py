"""The timeline's settings: of the chosen key and track, of the film, and the list of what can get a track."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, TypeAlias, get_args

from imgui_bundle import imgui, imgui_ctx

from clfractal.scene.animation import EASES, MAX_FRAMES, Animation, Interpolation, Key, Track
from clfractal.viewer import timeline_edits as timeline
from clfractal.viewer.film_place import movable, value_of
from clfractal.viewer.panels import metadata, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.number_box import Change, Scale
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.timeline_edits import NONE, KeyAt, Selection
from clfractal.viewer.timeline_view import TimelineView

EDITED = {
    Animation: frozenset({"fps", "frames", "duration", "loop", "noise", "shutter", "frame", "tracks"}),
    Track: frozenset(
        {
            "keys",
            "expression",
            "file",
            "column",
            "factor",
            "offset",
            "interpolation",
            "repeat",
            "around_target",
        }
    ),
    Key: frozenset({"frame", "time", "value", "interpolation", "handles"}),
}
"""The settings of films that the timeline edits."""

KeyEdit: TypeAlias = Callable[[Animation, KeyAt, float], tuple[Animation, Selection]]
"""Makes of an animation, a key of it and a number another animation, and the keys that are chosen in it."""
WAYS: tuple[Interpolation, ...] = get_args(Interpolation)
# Of tracks with keys: a field, its label, and the words of its values.
_OF_KEYS: tuple[tuple[str, str, dict[Any, str]], ...] = (
    ("interpolation", "Way", {way: w.word(way) for way in WAYS}),
    ("repeat", "After the last", {"none": "Its value", "loop": "Loop", "ping_pong": "Ping-pong"}),
    ("around_target", "Round target", {None: "Where smooth", True: "Yes", False: "No"}),
)
_AXES = ("x1", "y1", "x2", "y2")
_LISTED = 14


def draw(ui: Ui, view: TimelineView, animation: Animation) -> None:
    """Draws what is chosen: a key, several, or a track."""
    chosen = sorted(view.selection)
    if len(chosen) == 1:
        _key(ui, view, animation, chosen[0])
    elif chosen:
        w.group(ui, f"{len(chosen)} keys")
        _ways(ui, view)
    if view.track in animation.tracks:
        _track(ui, view, animation, view.track)
    elif not chosen:
        w.hint(ui, "A click on a key or on a track's name shows its settings here.")


def _number(
    ui: Ui,
    view: TimelineView,
    label: str,
    path: str,
    of: tuple[Any, str],
    value: float,
    scale: Scale,
    change: Callable[[Animation, float], Animation],
    name: str = "",
) -> None:
    """A row with a number of the animation; `change` sets it, and a drag is one step.

    Args:
        of: the section and its field that it is.
        name: of its box; else the path.
    """
    width = _row(ui, label, path, *of)
    if width is None:
        return
    found = w.number_box(w.boxes(ui), name or path, value, width, scale)
    _apply(ui, view, found, lambda old, new: (change(old, new), view.selection))


def _apply(
    ui: Ui, view: TimelineView, found: Change, edit: Callable[[Animation, float], tuple[Animation, Selection]]
) -> None:
    """Does what a number box returned; a drag is one step."""
    new = found.value
    if new is not None and found.dragging:
        if view.before is None:
            view.begin(ui.studio)
        view.drag(ui.studio, lambda old: edit(old, new))
    elif new is not None:
        view.edit(ui.studio, lambda old: edit(old, new))
    if found.ended:
        view.end(ui.studio)


def _row(ui: Ui, label: str, path: str, section: Any, key: str) -> float | None:
    return w.row(ui, label, path=path, tip=_about(section, key))


def _about(section: Any, key: str) -> str:
    return metadata.metas(section)[key].description


def _key(ui: Ui, view: TimelineView, animation: Animation, at: KeyAt) -> None:
    name, index = at
    key = timeline.key_of(animation, at)
    w.group(ui, f"Key {index + 1} of {len(animation.tracks[name].keys or ())}")
    # A key that passes another one has another number then; its boxes stay those in which the drag began.
    first = _dragged(view) or at
    path = f"animation.tracks.{name}.keys.{first[1]}"
    in_seconds = key.frame is None
    width = _row(ui, "Time" if in_seconds else "Frame", path, Key, "time" if in_seconds else "frame")
    if width is not None:
        scale = Scale(0, MAX_FRAMES, step=0.02 if in_seconds else 0.2, unit=" s" if in_seconds else "")
        given = key.time if in_seconds else key.frame
        assert given is not None

        def moved(old: Animation, at: KeyAt, number: float) -> tuple[Animation, Selection]:
            frame = number * old.fps if in_seconds else round(number, 3)
            return timeline.moved(old, frozenset({at}), lambda _: frame)

        _of_key(ui, view, at, w.number_box(w.boxes(ui), f"{path}.time", given, width, scale), moved)
    wide = _row(ui, "Value", path, Key, "value")
    if wide is None:
        return
    if len(key.values) > 1:
        wide = w.columns(min(len(key.values), 3))
    for component, number in enumerate(key.values):
        if component % 3:
            w.in_row(4)
        mark = theme.AXES[component % 3] if len(key.values) > 1 else None
        found = w.number_box(
            w.boxes(ui), f"{path}.value.{component}", number, wide, Scale(step=None), mark=mark
        )
        _of_key(ui, view, at, found, _in_place(timeline.with_number, component))
    _ways(ui, view)
    way = key.interpolation or animation.tracks[name].interpolation
    if way == "bezier" and key.handles is not None and index + 1 < len(animation.tracks[name].keys or ()):
        _row(ui, "Handles", path, Key, "handles")
        wide = w.columns(4, 3)
        for place, number in enumerate(key.handles):
            if place:
                w.in_row(3)
            found = w.number_box(w.boxes(ui), f"{path}.handles.{place}", number, wide, Scale(step=0.01))
            w.tip(f"{_AXES[place]}: {_about(Key, 'handles')}")
            _of_key(ui, view, at, found, _in_place(_handled, place))


def _in_place(change: Callable[[Animation, KeyAt, int, float], Animation], number: int) -> KeyEdit:
    """An edit of one number of a key, which stays where it is."""
    return lambda old, at, new: (change(old, at, number, new), frozenset({at}))


def _handled(old: Animation, at: KeyAt, place: int, number: float) -> Animation:
    handles = list(timeline.key_of(old, at).handles or EASES["ease"])
    handles[place] = number
    return timeline.with_handles(old, at, handles)


def _dragged(view: TimelineView) -> KeyAt | None:
    """The key that is dragged, as it was when the drag began; None if that is none, or several."""
    chosen = view.before[1] if view.before is not None else NONE
    return next(iter(chosen)) if len(chosen) == 1 else None


def _of_key(ui: Ui, view: TimelineView, at: KeyAt, found: Change, change: KeyEdit) -> None:
    """Does what a number box of a key returned; a drag is one step, and changes the key that it began with."""
    _apply(ui, view, found, lambda old, new: change(old, _dragged(view) or at, new))


def _ways(ui: Ui, view: TimelineView) -> None:
    """How the chosen keys go on to the next ones."""
    animation = ui.studio.scene.animation
    if animation is None:
        return
    words = {timeline.key_of(animation, each).interpolation for each in view.selection}
    names: dict[Any, str] = {"": "As the track", **{way: w.word(way) for way in WAYS}}
    now: Any = words.pop() or "" if len(words) == 1 else "mixed"
    names |= {"mixed": "Several"} if now == "mixed" else {}
    path, about = "animation.tracks.keys.interpolation", _about(Key, "interpolation")
    found = w.pick(ui, "To the next", names, now, path=path, name="key.way", tip=about, listed=True)
    if found is not None and found != "mixed":
        view.change(ui.studio, lambda old: timeline.with_way(old, view.selection, found or None))


def key_menu(ui: Ui, view: TimelineView, under: KeyAt | None) -> None:
    """The menu of the chosen keys: the way to the next key, deleting. A right click on a key opens it.

    Args:
        under: the key under the pointer; None: none.
    """
    if under is not None and imgui.is_mouse_clicked(imgui.MouseButton_.right):
        if under not in view.selection:
            view.selection = frozenset({under})
        view.track = under[0]
        imgui.open_popup("##key.menu")
    if not imgui.begin_popup("##key.menu"):
        return
    animation = ui.studio.scene.animation
    chosen = timeline.still_there(animation, view.selection)
    words = {timeline.key_of(animation, each).interpolation for each in chosen} if animation else set()
    for way in (None, *WAYS):
        text = "As the track" if way is None else w.word(way)
        if imgui.menu_item(text, "", words == {way})[0]:
            view.change(ui.studio, lambda old, way=way: timeline.with_way(old, chosen, way))  # type: ignore[misc]
    imgui.separator()
    if imgui.menu_item("Delete", ui.keys.hint("delete_keys") or "", False)[0]:
        view.delete(ui.studio)
    imgui.end_popup()


def _track(ui: Ui, view: TimelineView, animation: Animation, name: str) -> None:
    track, path = animation.tracks[name], f"animation.tracks.{name}"
    w.group(ui, name if len(name) < 27 else f"…{name[-26:]}")
    for key, label, words in _OF_KEYS if track.keys is not None else ():
        if key == "around_target" and not name.endswith("position"):
            continue
        now, about = words[getattr(track, key)], _about(Track, key)
        shown = {text: text for text in words.values()}  # (null is no choice, but its word is)
        found = w.pick(ui, label, shown, now, path=path, name=f"track.{key}", tip=about, listed=True)
        if found is not None:
            chosen = {key: next(value for value, text in words.items() if text == found)}
            view.change(ui.studio, lambda old, chosen=chosen: timeline.with_track(old, name, chosen))  # type: ignore[misc]
    for key in ("expression", "file", "column"):
        _texts(ui, view, name, track, key)
    for key in ("factor", "offset") if track.file is not None else ():
        _number(
            ui,
            view,
            key.capitalize(),
            path,
            (Track, key),
            getattr(track, key),
            Scale(),
            lambda old, number, key=key: timeline.with_track(old, name, {key: number}),  # type: ignore[misc]
            f"{path}.{key}",
        )
    imgui.dummy(imgui.ImVec2(0, 1))
    w.in_labels()
    if w.button("Remove track", icon=theme.TRASH, about="The value stays what the scene as it stands has"):
        view.selection = timeline.NONE
        view.change(ui.studio, lambda old: timeline.without_track(old, name))


def _texts(ui: Ui, view: TimelineView, name: str, track: Track, key: str) -> None:
    """The texts of a track, one in a line."""
    given = getattr(track, key)
    if given is None:
        return
    several = given if isinstance(given, tuple) else (given,)
    for number, text in enumerate(several):
        width = _row(ui, key.capitalize(), f"animation.tracks.{name}", Track, key)
        if width is None:
            continue
        new = w.text_box(ui, f"track.{name}.{key}.{number}", text, width)
        if new:
            whole = (*several[:number], new, *several[number + 1 :]) if isinstance(given, tuple) else new
            view.change(ui.studio, lambda old, whole=whole: timeline.with_track(old, name, {key: whole}))  # type: ignore[misc]


def film_popup(ui: Ui, view: TimelineView) -> None:
    """Length, rate and what else concerns the whole film."""
    animation = ui.studio.scene.animation
    imgui.set_next_window_size(imgui.ImVec2(300, 0))
    if not imgui.begin_popup("##timeline.film"):
        return
    assert animation is not None
    w.group(ui, "Film")
    keep = bool(ui.memory.setdefault("timeline.scale", False))

    def number(label: str, key: str, value: float, scale: Scale, change: Any) -> None:
        _number(ui, view, label, f"animation.{key}", (Animation, key), value, scale, change)

    def put(**changes: Any) -> None:
        view.change(ui.studio, lambda old: old.model_copy(update=changes))

    number(
        "Frames",
        "frames",
        animation.count,
        Scale(1, MAX_FRAMES, whole=True, step=0.3),
        lambda old, new: timeline.with_frames(old, int(new), scale=keep),
    )
    number(
        "Duration",
        "duration",
        animation.count / animation.fps,
        Scale(0.001, 1e6, unit=" s", step=0.02),
        lambda old, new: timeline.with_frames(old, round(new * old.fps), scale=keep),
    )
    number(
        "Frames a second",
        "fps",
        animation.fps,
        Scale(0.01, 1000, step=0.2),
        lambda old, new: timeline.with_rate(old, new, "seconds" if keep else "frames"),
    )
    about = "of another length: keys keep their part of the film; at another rate: their seconds. Else: their frames"
    if w.switch(ui, "Keys move along", keep, path="", name="film.scale", tip=about):
        ui.memory["timeline.scale"] = not keep
    path = "animation.loop"
    if w.switch(ui, "Loop", animation.loop, path=path, name="film.loop", tip=_about(Animation, "loop")):
        put(loop=not animation.loop)
    noises, about = {"new": "New", "fixed": "Fixed"}, _about(Animation, "noise")
    noise = w.pick(ui, "Noise", noises, animation.noise, path="animation.noise", tip=about)
    if noise is not None:
        put(noise=noise)
    number(
        "Shutter",
        "shutter",
        animation.shutter,
        Scale(0, 1, step=0.01),
        lambda old, new: old.model_copy(update={"shutter": new}),
    )
    about, on = _about(Animation, "frame"), animation.frame is not None
    if w.switch(ui, "Frame of stills", on, path="animation.frame", name="film.still", tip=about):
        place = ui.studio.place
        put(frame=place.frame if not on and place is not None else None)
    imgui.dummy(imgui.ImVec2(0, 1))
    w.in_labels()
    if w.button("Remove the film", icon=theme.TRASH, about="The scene as it stands is kept"):
        ui.studio.set_animation(None)
        imgui.close_current_popup()
    imgui.end_popup()


def add_popup(ui: Ui, view: TimelineView) -> None:
    """The values that can move and do not yet, with a line to search in them."""
    imgui.set_next_window_size(imgui.ImVec2(290, 0))
    if not imgui.begin_popup("##timeline.add"):
        return
    animation, scene = ui.studio.scene.animation, ui.studio.scene
    assert animation is not None
    wanted = w.search(ui, "timeline.search", "Find a value").strip().lower().split()
    names = ui.kept_for("timeline.movable", scene, lambda: [".".join(path) for path in movable(scene)])
    taken = [f"{each}." for each in animation.tracks]
    free = [name for name in names if not any(f"{name}.".startswith(each) for each in taken)]
    free = [name for name in free if not any(each.startswith(f"{name}.") for each in taken)]
    found = [
        name
        for name in free
        if all(word in name.lower().replace("_", " ") or word in name for word in wanted)
    ]
    now = ui.studio.frame_number or 0.0
    with imgui_ctx.begin_child("##values", imgui.ImVec2(0, 20.0 * min(max(len(found), 1), _LISTED))):
        for name in found:
            if imgui.selectable(name, False)[0]:
                value = value_of(scene, tuple(name.split(".")))
                view.change(ui.studio, lambda old, n=name, v=value: timeline.with_key(old, n, now, v))  # type: ignore[misc]
                view.track = name
                imgui.close_current_popup()
        if not found:
            w.hint(ui, "Nothing of this name can move.")
    imgui.end_popup()
