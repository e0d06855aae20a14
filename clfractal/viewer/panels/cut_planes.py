"""Cut planes: those in the picture of the object, and the one of a `cut_plane` renderer."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from imgui_bundle import imgui

from clfractal.scene.checks import MAX_PLANES
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.rectangle import Plane, scaled
from clfractal.scene.surface import SurfaceRenderer
from clfractal.schema.shape import Solid
from clfractal.viewer import plane_moves
from clfractal.viewer.panels import palette_editor, renderer, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.buttons import area
from clfractal.viewer.panels.metadata import plain
from clfractal.viewer.panels.ui import Ui

_OWN = (("normal", "Normal"), ("side", "Side"), ("up", "Up"))
_SPACE = (("x", "x"), ("y", "y"), ("z", "z"))


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
    chosen = min(int(ui.memory.get("cut_plane", 0)), max(len(planes) - 1, 0))
    if w.filtering(ui):
        for index in range(len(planes)):
            _cut_plane(ui, index)
        return
    for index in range(len(planes)):
        if _line(ui, index, index == chosen):
            chosen = index
    ui.memory["cut_plane"] = chosen
    _buttons(ui, chosen)
    w.problem(ui, "cut_planes")
    if chosen < len(ui.studio.scene.cut_planes):
        _cut_plane(ui, chosen)
    elif not planes:
        w.hint(ui, "A plane shows escape counts inside the object, and can cut it open.")


def _line(ui: Ui, index: int, chosen: bool) -> bool:
    """One plane of the list; whether it was clicked."""
    plane = ui.studio.scene.cut_planes[index]
    corner, height = imgui.get_cursor_screen_pos(), imgui.get_frame_height()
    wide = imgui.get_content_region_avail().x
    clicked = area(f"##plane{index}", (wide, height))
    draw = imgui.get_window_draw_list()
    if chosen or imgui.is_item_hovered():
        back = theme.ACCENT_FAINT if chosen else theme.FRAME
        far = imgui.ImVec2(corner.x + wide, corner.y + height)
        draw.add_rect_filled(corner, far, theme.packed(back), 5.0)
    y = corner.y + (height - imgui.get_font_size()) / 2
    icon = theme.SCISSORS if plane.cut else theme.EYE
    draw.add_text(imgui.ImVec2(corner.x + 10, y), theme.packed(theme.DIM), icon)
    name = f"Plane {index + 1}" if plane.count == 1 else f"Planes {index + 1} (x{plane.count})"
    draw.add_text(imgui.ImVec2(corner.x + 31, y), theme.packed(theme.TEXT), name)
    x, y_, z = plane.plane.placed.normal
    text = f"{x + 0.0:.2g}, {y_ + 0.0:.2g}, {z + 0.0:.2g}".replace("-", "\u2212")
    place = imgui.ImVec2(corner.x + wide - imgui.calc_text_size(text).x - 8, y)
    draw.add_text(place, theme.packed(theme.DIM), text)
    return bool(clicked)


def _buttons(ui: Ui, chosen: int) -> None:
    planes = [plain(plane) for plane in ui.studio.scene.cut_planes]
    room = sum(plane["count"] for plane in planes) < MAX_PLANES
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
    if w.button("Add a plane", icon=theme.PLUS, enabled=room):
        _set(ui, [*planes, _first_plane(ui)], len(planes))
    w.in_row(4)
    if w.icon_button(theme.COPY, "Duplicate", enabled=bool(planes) and room):
        _set(ui, [*planes, {**planes[chosen], "count": 1}], len(planes))
    w.in_row(4)
    if w.icon_button(theme.TRASH, "Remove", enabled=bool(planes)):
        _set(ui, [*planes[:chosen], *planes[chosen + 1 :]], max(chosen - 1, 0))


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
        width = w.row(ui, name, tip="Whether the plane cuts this object, too", path=path)
        if width is not None and w.toggle(f"{path} {name}", name in chosen):
            others = [other for other in chosen if other != name]
            ui.studio.edit({path: others if name in chosen else [*others, name]})


def _set(ui: Ui, planes: list[Any], chosen: int) -> None:
    if ui.studio.edit({"cut_planes": planes}):
        ui.memory["cut_plane"] = chosen


def _cut_plane(ui: Ui, index: int) -> None:
    path = f"cut_planes.{index}"
    plane = ui.studio.scene.cut_planes[index]
    w.field(ui, f"{path}.cut", "Cut open")
    if plane.cut:
        if isinstance(ui.studio.scene.renderer, SurfaceRenderer):
            w.field(ui, f"{path}.set", "Cut the set")
        _named(ui, f"{path}.objects", plane.objects)
    w.field(ui, f"{path}.opacity")
    w.field(ui, f"{path}.inside_opacity", start=plane.opacity, auto="as opacity")
    w.field(ui, f"{path}.count", "Parallel planes")
    if plane.count > 1:
        w.field(ui, f"{path}.spacing", step=plane.plane.placed.height / 1000)
    _iterations(ui, path)
    if not w.filtering(ui):
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
        about = "The renderer shows this plane's cut alone; switch back under Renderer"
        if w.button("Show the cut alone", icon=theme.SCISSORS, width=-1, about=about):
            sections = {"plane": plain(plane.plane), "colors": plain(plane.colors)}
            more = {"iterations": plane.iterations} if plane.iterations is not None else {}
            changes = {f"renderer.{name}": value for name, value in {**sections, **more}.items()}
            renderer.switch(ui, "cut_plane", changes)
            return
    place(ui, f"{path}.plane")
    _colors(ui, f"{path}.colors")


def _own_plane(ui: Ui) -> None:
    if not w.filtering(ui):
        imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
        if w.button(
            "Show it in the object", icon=theme.CUBE, width=-1, about="The surface, cut open at this plane"
        ):
            shown = ui.studio.scene.renderer
            assert isinstance(shown, CutPlaneRenderer)
            plane = {"plane": plain(shown.plane), "colors": plain(shown.colors), "opacity": 1.0, "cut": True}
            renderer.switch(ui, "surface", {"cut_planes": [plane]})
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
    w.field(ui, f"{path}.mode", segmented=True)
    w.field(ui, f"{path}.curve", segmented=True)
    w.fields(ui, path, ("scale", "offset", "repeat", "inside"), inside={"label": "Inside"})


def place(ui: Ui, path: str) -> None:
    """Draws where a plane lies, and the moves along and about its own axes and those of space."""
    plane: Plane = w.value(ui, path)
    w.group(ui, "Place")
    placed = plane.placed
    if plane.corners is None and not plane.transform:
        step = placed.height / 400
        w.fields(
            ui,
            path,
            ("center", "normal", "up", "width", "height"),
            center={"step": step},
            normal={"step": 0.01},
            up={"step": 0.01, "start": placed.up},
        )
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
    imgui.set_cursor_pos_x(imgui.get_cursor_pos_x() + 11)
    if w.button("Write it by middle and normal", width=-1, about="The same plane, with fields for each"):
        _move(ui, path, scaled(plane, 1.0))


def _moves(ui: Ui, path: str, plane: Plane) -> None:
    sizes = ui.memory.setdefault("plane.steps", {"move": 0.02, "turn": 5.0, "scale": 1.25})
    w.group(ui, "Move")
    _amount(ui, sizes, "move", "Step", w.Scale(0, 10, (0.0005, 1), log=True, unit=" %", factor=100.0))
    distance = sizes["move"] * plane.placed.height
    for axis, name in _OWN:
        _step(
            ui,
            path,
            f"Along {name.lower()}",
            lambda sign, axis=axis: plane_moves.shift(plane, **{axis: sign * distance}),  # type: ignore[misc]
        )
    w.group(ui, "Rotate")
    _amount(ui, sizes, "turn", "Angle", w.Scale(0, 360, (0, 90), unit="°"))
    for axis, name in (*_OWN, *_SPACE):
        own = (axis, name) in _OWN
        _step(
            ui,
            path,
            f"Own {name.lower()}" if own else f"Axis {name}",
            lambda sign, axis=axis: plane_moves.rotate(plane, axis, sign * sizes["turn"]),  # type: ignore[misc]
            about="about the plane's own axis" if own else "about the axis of space, through the origin",
        )
    w.group(ui, "Size")
    _amount(ui, sizes, "scale", "Factor", w.Scale(1, 100, (1.01, 10), log=True))
    _step(ui, path, "Larger, smaller", lambda sign: plane_moves.scale(plane, sizes["scale"] ** sign))


def _amount(ui: Ui, sizes: dict[str, float], key: str, label: str, scale: w.Scale) -> None:
    about = "of the plane's height" if key == "move" else ""
    width = w.row(ui, label, tip=f"by how much one click moves it {about}".strip(), path=f"step.{key}")
    if width is None:
        return
    change = w.number_box(w.boxes(ui), f"plane.{key}", sizes[key], width, scale)
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
        imgui.push_item_flag(imgui.ItemFlags_.button_repeat, True)
        clicked = w.button(f"{icon}##{label}", width=(width - 4) / 2)
        imgui.pop_item_flag()
        if clicked:
            _move(ui, path, change(sign))


def _move(ui: Ui, path: str, plane: Plane) -> None:
    ui.studio.edit({path: plain(plane)})
