"""The figures over the picture's lower rim: time, depth, method, zoom, stereo."""

from __future__ import annotations

import math
import time

from imgui_bundle import imgui

from clfractal.device import activity
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.deeper import magnified
from clfractal.scene.model import Scene
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.viewer import zoom_box
from clfractal.viewer.frame import Frame
from clfractal.viewer.panels import stereo as stereo_panel
from clfractal.viewer.panels import theme, volume
from clfractal.viewer.panels.timeline_area import room_of
from clfractal.viewer.panels.ui import Ui
from clfractal.viewer.picking import Pick
from clfractal.viewer.plane_count import PlaneCount, Point, point_on_plane

Pair = tuple[str, str]
"""A label and its value."""

_FOR_NARROW = (
    "render",
    "samples",
    "zoom",
    "new zoom",
    "plane",
    "count",
    "depth",
    "point",
    "stereo",
    "parallax",
)
# From this magnification on the figures tell it.
_DEEP = 100.0
DRAFT = "Draft: light comes when it rests"
_SPINNER = "|/-\\"


def lines(ui: Ui) -> list[list[Pair]]:
    """What the overlay tells, in rows: of the picture, of the scene, of stereo."""
    found = [_picture(ui), _scene(ui)]
    if ui.studio.scene.stereo is not None:
        found.append(_stereo(ui))
    if ui.narrow:  # the picture counts more
        found = [[pair for pair in row if pair[0] in _FOR_NARROW] for row in found]
    return [row for row in found if row]


def _picture(ui: Ui) -> list[Pair]:
    frame, session = ui.studio.frame, ui.studio.session
    found: list[Pair] = []
    if frame is not None:
        found.append(("render", seconds_text(frame.seconds if frame.divider == 1 else frame.frame_seconds)))
        if ui.speed.frames:
            found.append(("frames", f"{ui.speed.frames:.0f}/s"))
        width, height = frame.arrangement.size(ui.studio.look)
        coarse = f", 1/{frame.divider}" if frame.divider > 1 else ""
        state = "" if frame.finished else ", paused" if session.paused else ""
        found += [
            ("size", f"{width} x {height}{coarse}"),
            ("samples", f"{frame.samples} of {frame.job.samples}{state}"),
            ("number", frame.job.precision),
        ]
    found += [("device", session.device.info.name), ("picture", ui.speed.way)]
    if ui.studio.region is not None:
        found.append(("region", "{2} x {3} at {0}, {1}".format(*ui.studio.region)))
    return found


def _scene(ui: Ui) -> list[Pair]:
    scene = ui.studio.scene
    renderer = scene.renderer
    found: list[Pair] = [("iterations", f"{scene.formula.iterations}")]
    if isinstance(renderer, SurfaceRenderer):
        method = f"{renderer.search}, {renderer.normal.replace('_', ' ')}"
        found += [("method", method), ("step", _step(scene, renderer))]
        if scene.deep is not None or magnified(scene) >= _DEEP:
            found.append(("zoom", number_text(magnified(scene))))
    elif isinstance(renderer, VolumeRenderer):
        found += [
            ("method", f"volume, {renderer.value}, {renderer.normals.replace('_', ' ')}"),
            ("step", f"{renderer.step:g} voxels"),
            ("zoom", number_text(renderer.magnification)),
        ]
        box = volume.marked(ui)
        if box is not None:
            found.append(("new zoom", number_text(zoom_box.next_magnification(renderer, box))))
    elif isinstance(renderer, CutPlaneRenderer):
        found += [("method", "cut plane"), ("plane", f"{renderer.plane.placed.height:.4g} high")]
    pick = ui.pick
    on_plane = point_on_plane(pick) if pick is not None else None
    if pick is not None and on_plane is not None:
        place = ", ".join(f"{each:.6g}" for each in on_plane)
        found += [("point", place), ("count", _count(ui, pick, on_plane))]
    elif isinstance(renderer, CutPlaneRenderer):
        found += [("point", "-"), ("count", "-")]
    else:
        point = pick.point if pick is not None else None
        found.append(("depth", f"{pick.depth:.5g}" if pick is not None and point is not None else "-"))
        if point is not None:
            found.append(("point", ", ".join(f"{each:.4g}" for each in point)))
    return found


def _count(ui: Ui, pick: Pick, point: Point) -> str:
    """How often the formula was applied to a point of the plane."""
    counts: PlaneCount = ui.memory.setdefault("plane.count", PlaneCount(ui.studio))
    text = counts.at(pick, point)
    if not text:
        ui.memory["awaited"] = True
    return text or "..."


def _step(scene: Scene, renderer: SurfaceRenderer) -> str:
    """The fixed step of a search by steps, scene units; else the distance that counts as a hit, pixels."""
    if renderer.search == "distance":
        return f"{renderer.detail:g} px"
    return f"{scene.bounds[1] / 100 if renderer.step is None else renderer.step:.4g}"


def _stereo(ui: Ui) -> list[Pair]:
    stereo = ui.studio.scene.stereo
    assert stereo is not None
    found = [
        ("stereo", stereo.mode.replace("_", " ") + (", swapped" if stereo.swap else "")),
        ("screen", f"{stereo.screen_width:.4g} wide, {stereo.screen_distance:.4g} away"),
        ("eyes", f"{stereo.interpupillary_distance:.4g} apart"),
    ]
    if ui.comfort is not None:
        found.append(("depth", stereo_panel.range_text(ui.comfort)))
    if "parallax" in ui.show or ui.pick is not None:
        under = stereo_panel.under_pointer(ui)
        text = "{:+.4g}, {:+.2f} degrees".format(*under) if under is not None else "-"
        found.append(("parallax", text))
    return found


def seconds_text(seconds: float) -> str:
    """A time for people: milliseconds below a second."""
    if seconds < 1:
        return f"{1e3 * seconds:.0f} ms"
    return f"{seconds:.1f} s" if seconds < 100 else f"{seconds / 60:.1f} min"


def number_text(number: float) -> str:
    """A magnification for people."""
    return f"{number:.3g}x" if number < 1e5 else f"{number:.2e}x"


def draw(ui: Ui) -> None:
    """Draws the figures at the lower rim, above them what takes long and what is wrong."""
    left = theme.MARGIN + (theme.DOCK_LEFT + theme.MARGIN if "panels" in ui.show else 0.0)
    bottom = ui.size[1] - theme.MARGIN - room_of(ui)
    if "overlay" in ui.show:
        bottom = _figures(ui, left, bottom)
    _state(ui, left, bottom)


def _figures(ui: Ui, left: float, bottom: float) -> float:
    """The rows, from the bottom up; gives where the next thing ends."""
    canvas = imgui.get_background_draw_list()
    room = ui.size[0] - left - theme.MARGIN
    with theme.font(size=12.5):
        rows = _wrapped(lines(ui), room - 16)
        high = imgui.get_text_line_height() + 3
        top = bottom - high * len(rows) - 8
        wide = max(sum(_width(pair) for pair in row) for row in rows) + 12
        canvas.add_rect_filled(
            imgui.ImVec2(left, top),
            imgui.ImVec2(left + wide, bottom),
            theme.packed(theme.PANEL, 0.72),
            theme.ROUNDING,
        )
        for number, row in enumerate(rows):
            x, y = left + 9, top + 5 + number * high
            for label, value in row:
                canvas.add_text(imgui.ImVec2(x, y), theme.packed(theme.DIM), label)
                x += imgui.calc_text_size(label).x + 5
                canvas.add_text(imgui.ImVec2(x, y), theme.packed(theme.TEXT), value)
                x += imgui.calc_text_size(value).x + 14
    frame = ui.studio.frame
    if frame is not None and not frame.finished:
        share = frame.samples / max(frame.job.samples, 1)
        canvas.add_rect_filled(
            imgui.ImVec2(left + 6, bottom - 2.5),
            imgui.ImVec2(left + 6 + (wide - 12) * share, bottom - 1),
            theme.packed(theme.ACCENT),
        )
    return float(top - 6)


def _width(pair: Pair) -> float:
    return float(imgui.calc_text_size(pair[0]).x + imgui.calc_text_size(pair[1]).x) + 19


def _wrapped(rows: list[list[Pair]], room: float) -> list[list[Pair]]:
    """Rows that fit into a width."""
    found: list[list[Pair]] = []
    for row in rows:
        line: list[Pair] = []
        used = 0.0
        for pair in row:
            if line and used + _width(pair) > room:
                found.append(line)
                line, used = [], 0.0
            line.append(pair)
            used += _width(pair)
        found.append(line)
    return found


def state_lines(ui: Ui, frame: Frame | None) -> list[tuple[str, theme.Rgba]]:
    """What takes long, why the newest scene cannot be shown, and that a picture is a draft: lines from the bottom up."""
    session = ui.studio.session
    told: list[tuple[str, theme.Rgba]] = []
    if frame is not None and frame.is_draft and ui.show & {"overlay", "panels"}:
        told.append((DRAFT, theme.ACCENT))
    if session.problem is not None:
        told.append((str(session.problem), theme.WARNING))
    if session.progress:
        turn = _SPINNER[int(time.perf_counter() * 8) % len(_SPINNER)]
        told.append((f"{turn}  {_with_seconds(session.progress)}", theme.ACCENT))
    return told


def _with_seconds(line: str) -> str:
    """What takes long, and since when; of several programs that are compiled the one that was begun last."""
    doing = activity.current()
    if doing is None or doing.what.split()[0] != line.split()[0]:
        return line
    return f"{doing.what}, {time.monotonic() - doing.began:.0f} s"


def _state(ui: Ui, left: float, bottom: float) -> None:
    """What takes long, and why the newest scene cannot be shown."""
    canvas = imgui.get_background_draw_list()
    for text, color in state_lines(ui, ui.studio.frame):
        room = ui.size[0] - left - theme.MARGIN - 20
        size = imgui.calc_text_size(text, False, room)
        top = bottom - size.y - 10
        far = imgui.ImVec2(left + min(size.x, room) + 20, bottom)
        canvas.add_rect_filled(imgui.ImVec2(left, top), far, theme.packed(theme.PANEL, 0.9), theme.ROUNDING)
        place, font = imgui.ImVec2(left + 10, top + 5), (imgui.get_font(), imgui.get_font_size())
        canvas.add_text(*font, place, theme.packed(color), text, room if math.isfinite(room) else 0.0)
        bottom = top - 6
