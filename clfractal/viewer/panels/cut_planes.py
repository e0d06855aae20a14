"""Cut planes: those in the picture of the object, and the one of a `cut_plane` renderer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from imgui_bundle import imgui_ctx

from clfractal.scene.checks import MAX_PLANES
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.rectangle import Axis, Plane, scaled
from clfractal.scene.surface import SurfaceRenderer
from clfractal.schema.shape import Solid
from clfractal.viewer import plane_moves
from clfractal.viewer.panels import maps, palette_editor, renderer, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

_OWN: tuple[Axis, ...] = ("normal", "side", "up")
_SPACE: tuple[Axis, ...] = ("x", "y", "z")


def summary(ui: Ui) -> str:
    """For the heading."""
    scene = ui.studio.scene
    if isinstance(scene.renderer, CutPlaneRenderer):
        return "this plane"
    count = sum(plane.count for plane in scene.cut_planes)
    return str(count) if count else ""


def draw(ui: Ui) -> None:
    """Draws the panel."""
    scene = ui.studio.scene
    if isinstance(scene.renderer, CutPlaneRenderer):
        _own_plane(ui)
        return
    planes = scene.cut_planes
    if w.filtering(ui):
        for index in range(len(planes)):
            _cut_plane(ui, index)
        return
    chosen = w.listed(ui, "cut_plane", len(planes), lambda index, on: _line(ui, index, on))
    _buttons(ui)
    w.problem(ui, "cut_planes")
    if chosen < len(ui.studio.scene.cut_planes):
        _cut_plane(ui, chosen)
    elif not planes:
        w.hint(ui, "A plane shows escape counts inside the object, and can cut it open.")


def _line(ui: Ui, index: int, chosen: bool) -> bool:
    """One plane of the list; whether it was clicked."""
    plane, line = ui.studio.scene.cut_planes[index], w.Line(f"plane{index}", chosen)
    line.write(10, theme.SCISSORS if plane.cut else theme.EYE, theme.DIM)
    line.write(31, f"Plane {index + 1}" if plane.count == 1 else f"Planes {index + 1} (x{plane.count})")
    normal = ", ".join(f"{each + 0.0:.2g}" for each in plane.plane.placed.normal)
    line.write(-8, normal.replace("-", "\u2212"), theme.DIM)
    return line.clicked


def _buttons(ui: Ui) -> None:
    planes = [w.plain(plane) for plane in ui.studio.scene.cut_planes]
    room = sum(plane["count"] for plane in planes) < MAX_PLANES
    w.in_labels()
    if w.button("Add a plane", icon=theme.PLUS, enabled=room):
        w.set_entries(ui, "cut_planes", [*planes, _first_plane(ui)], "cut_plane", len(planes))
    w.copy_and_remove(ui, "cut_planes", planes, "cut_plane", room, count=1)


def _first_plane(ui: Ui) -> dict[str, Any]:
    """Through the bounds' middle, towards the side from which the camera sees it, as large as the object."""
    scene = ui.studio.scene
    center, radius = scene.bounds
    away = [p - c for p, c in zip(scene.camera.position, center, strict=True)]
    axis = max(range(3), key=lambda each: abs(away[each]))
    normal = [0.0, 0.0, 0.0]
    normal[axis] = 1.0 if away[axis] >= 0 else -1.0
    side = float(f"{2 * radius:.4g}")
    plane = {"center": list(center), "normal": normal, "width": side, "height": side}
    if axis < 2:
        plane["up"] = [0.0, 0.0, 1.0]
    return {"plane": plane, "opacity": 1.0, "cut": True}


def _named(ui: Ui, path: str, chosen: tuple[str, ...]) -> None:
    """Which of the solids beside the set are cut, too."""
    for name, each in ui.studio.scene.objects.items():
        if not isinstance(each, Solid) or each.join != "union":
            continue
        about, on = "Whether the plane cuts this object, too", name in chosen
        if w.switch(ui, name, on, path=path, name=f"{path} {name}", tip=about):
            others = [other for other in chosen if other != name]
            w.put(ui, path, others if on else [*others, name])


def _cut_plane(ui: Ui, index: int) -> None:
    path = f"cut_planes.{index}"
    plane = ui.studio.scene.cut_planes[index]
    w.field(ui, f"{path}.cut", "Cut open")
    if plane.cut:
        if isinstance(ui.studio.scene.renderer, SurfaceRenderer):
            w.field(ui, f"{path}.set", "Cut the set")
        _named(ui, f"{path}.objects", plane.objects)
        if isinstance(ui.studio.scene.lighting, PathLighting):
            maps.choice(ui, f"{path}.material", plane.material, "Matt", None)
    inside = {"start": plane.opacity, "auto": "as opacity"}
    names, count = ("opacity", "inside_opacity", "count"), {"label": "Parallel planes"}
    w.fields(ui, path, names, inside_opacity=inside, count=count)
    if plane.count > 1:
        w.field(ui, f"{path}.spacing", step=plane.plane.placed.height / 1000)
    _iterations(ui, path)
    if not w.filtering(ui):
        w.in_labels()
        about = "The renderer shows this plane's cut alone; switch back under Renderer"
        if w.button("Show the cut alone", icon=theme.SCISSORS, width=-1, about=about):
            values = {name: w.plain(getattr(plane, name)) for name in ("plane", "colors", "iterations")}
            given = {f"renderer.{name}": value for name, value in values.items() if value is not None}
            renderer.switch(ui, "cut_plane", given)
            return
    place(ui, f"{path}.plane")
    _colors(ui, f"{path}.colors")


def _own_plane(ui: Ui) -> None:
    if not w.filtering(ui):
        w.in_labels()
        about = "The surface, cut open at this plane"
        if w.button("Show it in the object", icon=theme.CUBE, width=-1, about=about):
            shown = {name: w.plain(w.value(ui, f"renderer.{name}")) for name in ("plane", "colors")}
            renderer.switch(ui, "surface", {"cut_planes": [{**shown, "opacity": 1.0, "cut": True}]})
            return
    _iterations(ui, "renderer")
    place(ui, "renderer.plane")
    _colors(ui, "renderer.colors")


def _iterations(ui: Ui, path: str) -> None:
    own = ui.studio.scene.formula.iterations
    w.field(ui, f"{path}.iterations", start=own, auto=f"{own}, the formula's")


def _colors(ui: Ui, path: str) -> None:
    w.group(ui, "Colours by escape counts")
    palette_editor.draw(ui, f"{path}.palette")
    names, apart = ("mode", "curve", "scale", "offset", "repeat", "inside"), {"segmented": True}
    w.fields(ui, path, names, mode=apart, curve=apart, inside={"label": "Inside"})


def place(ui: Ui, path: str) -> None:
    """Draws where a plane lies, and the moves along and about its own axes and those of space."""
    plane: Plane = w.value(ui, path)
    w.group(ui, "Place")
    placed = plane.placed
    if plane.corners is None and not plane.transform:
        step = placed.height / 400
        names, up = ("center", "normal", "up", "width", "height"), {"step": 0.01, "start": placed.up}
        w.fields(ui, path, names, center={"step": step}, normal={"step": 0.01}, up=up)
    else:
        _placed(ui, path, plane)
    if not w.filtering(ui):
        _moves(ui, path, plane)


def _placed(ui: Ui, path: str, plane: Plane) -> None:
    """A plane by corners or with steps: where it is, and a button that writes it by its middle and normal."""
    placed = plane.placed
    kind = "its corners" if plane.corners is not None else "a middle and normal"
    count = len(plane.transform)
    steps = f", and {count} {'step' if count == 1 else 'steps'}" if count else ""
    center = ", ".join(f"{each:.5g}" for each in placed.center)
    normal = ", ".join(f"{each + 0.0:.4g}" for each in placed.normal)
    w.hint(
        ui,
        f"Given by {kind}{steps}.\nMiddle {center}\nNormal {normal}\n{placed.width:.5g} x {placed.height:.5g}",
    )
    if w.filtering(ui):
        return
    w.in_labels()
    if w.button("Write it by middle and normal", width=-1, about="The same plane, with fields for each"):
        w.put(ui, path, scaled(plane, 1.0))


def _moves(ui: Ui, path: str, plane: Plane) -> None:
    sizes = ui.memory.setdefault("plane.steps", {"move": 0.02, "turn": 5.0, "scale": 1.25})
    w.group(ui, "Move")
    _amount(ui, sizes, "move", "Step", w.Scale(0, 10, (0.0005, 1), log=True, unit=" %", factor=100.0))
    distance = sizes["move"] * plane.placed.height
    for axis in _OWN:
        _step(
            ui,
            path,
            f"Along {axis}",
            lambda sign, axis=axis: plane_moves.shift(plane, **{axis: sign * distance}),  # type: ignore[misc]
        )
    w.group(ui, "Rotate")
    _amount(ui, sizes, "turn", "Angle", w.Scale(0, 360, (0, 90), unit="°"))
    for axis in (*_OWN, *_SPACE):
        own = axis in _OWN
        _step(
            ui,
            path,
            f"Own {axis}" if own else f"Axis {axis}",
            lambda sign, axis=axis: plane_moves.rotate(plane, axis, sign * sizes["turn"]),  # type: ignore[misc]
            about="about the plane's own axis" if own else "about the axis of space, through the origin",
        )
    w.group(ui, "Size")
    _amount(ui, sizes, "scale", "Factor", w.Scale(1, 100, (1.01, 10), log=True))
    _step(ui, path, "Larger, smaller", lambda sign: plane_moves.scale(plane, sizes["scale"] ** sign))


def _amount(ui: Ui, sizes: dict[str, float], key: str, label: str, scale: w.Scale) -> None:
    about = "of the plane's height" if key == "move" else ""
    width = w.row(ui, label, tip=f"by how much one click moves it {about}".strip(), path=f"step.{key}")
    change = w.number_box(w.boxes(ui), f"plane.{key}", sizes[key], width, scale) if width else w.Change()
    if change.value is not None:
        sizes[key] = change.value


def _step(ui: Ui, path: str, label: str, change: Callable[[float], Plane], about: str = "") -> None:
    """A row with a button for either way."""
    width = w.row(ui, label, path=f"{path}.{label}", tip=about)
    if width is None:
        return
    for sign, icon in ((-1.0, theme.MINUS), (1.0, theme.PLUS)):
        if sign > 0:
            w.in_row(4)
        with imgui_ctx.push_button_repeat():
            clicked = w.button(f"{icon}##{label}", width=(width - 4) / 2)
        if clicked:
            w.put(ui, path, change(sign))
