"""A settings file of Mandelbulber 2 as a scene, with a line for everything in it that was not taken over."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from clfractal.errors import FileError, Where
from clfractal.exchange.colors import coloring_of
from clfractal.exchange.hollows import take_their_distance
from clfractal.exchange.installed import Installed, find_installed
from clfractal.exchange.look import Look, look_of
from clfractal.exchange.measure import are_inside, ball_of, distance_at
from clfractal.exchange.mists import move_counts
from clfractal.exchange.placing import Placing, matrix_of, mirror, place_around, placing_of
from clfractal.exchange.sequence import formula_of, joined_of
from clfractal.exchange.settings import Section, Settings, parse_settings, read_settings
from clfractal.exchange.solids import solids_of
from clfractal.exchange.translate import COLOR, carried_name
from clfractal.exchange.view import NEAR, is_mirrored, view_of
from clfractal.files.fragments import block_lines

# What windows, films, files and other ways to look at a scene have, and what says how theirs are computed.
_ELSEWHERE = (
    *(
        "keyframe_",
        "flight_",
        "frame_no",
        "frames_per_keyframe",
        "anim_",
        "show_",
        "voxel_",
        "mesh_",
        "opencl_",
    ),
    *("net_render", "netrender", "queue_", "toolbar_", "ui_", "system_tray", "thumbnails_", "description"),
    *(
        "camera_movement",
        "camera_rotation_",
        "camera_absolute",
        "camera_straight",
        "mouse_",
        "auto_",
        "grid_type",
    ),
    *(
        "default_",
        "file_destination",
        "save_",
        "jpeg_",
        "append_",
        "color_enabled",
        "color_postfix",
        "color_quality",
    ),
    *("alpha_", "zbuffer_", "normal_", "normalWorld_", "specular_enabled", "specular_postfix", "diffuse_"),
    *("world_", "optional_", "language", "logging_", "threads_", "limit_CPU", "quit_", "upgrade_", "meas_"),
    *("image_detached", "image_preview", "image_proportion", "tiles", "tile_number", "aux_light_manual"),
    *(
        "aux_light_place",
        "julia_preview",
        "SSAO_random",
        "interior_mode",
        "stereo_actual",
    ),
    *(
        "connect_detail",
        "DOF_max_noise",
        "DOF_min_samples",
        "DOF_blur_opacity",
        "DOF_number",
        "DOF_max_radius",
    ),
    *("antialiasing_", "warning", "statistics", "display_tooltips", "settings_", "gradients"),
)
_METHOD = (
    *(
        "DE_",
        "delta_DE",
        "analityc_DE",
        "detail_",
        "smoothness",
        "slow_shading",
        "abs_m",
        "rel_m",
        "advanced_",
    ),
    *("deltade_", "constant_DE", "iteration_threshold", "use_default_bailout", "minN", "linear_DE"),
)


@dataclass(frozen=True, slots=True)
class Imported:
    """A scene of another program.

    Attributes:
        scene: plain data, as `load_scene` takes it.
        remarks: what was not taken over, one line each.
        origins: the files that formulas were made of, one line each.
        kind: what the file is.
    """

    scene: dict[str, Any]
    remarks: tuple[str, ...]
    origins: tuple[str, ...] = ()
    kind: str = "a settings file of Mandelbulber 2"

    def text(self, name: str) -> str:
        """A scene file's text; origins and remarks are comments at its beginning.

        Args:
            name: of the file that it was made of.
        """
        lines = [f"{name}, {self.kind}.", *self.origins]
        if self.remarks:
            lines += ["What is not taken over:", *self.remarks]
        # A file may have any characters; a comment has only what YAML allows in one.
        comments = ("# " + "".join(each if each.isprintable() else "?" for each in line) for line in lines)
        return "\n".join([*comments, *block_lines(self.scene, 0)]) + "\n"


def import_settings(path: Path, look: Look = "same", formulas: Path | None = None) -> Imported:
    """Reads a settings file as a scene.

    Args:
        formulas: the folder with texts of formulas, or with the program's files; None: where it is installed.
        look: `same`: light, materials and colours as near to theirs as ours can be; `ours`: our own light, along paths.

    Raises:
        FileError: the file cannot be read, is none of the format, or has a formula without a counterpart.
    """
    return imported(read_settings(path), look, formulas)


def import_text(
    text: str, file: str = "settings", look: Look = "same", formulas: Path | None = None
) -> Imported:
    """As `import_settings`, of a text."""
    return imported(parse_settings(text, file), look, formulas)


def imported(settings: Settings, look: Look = "same", formulas: Path | None = None) -> Imported:
    """A settings file that was read as a scene."""
    if formulas is not None and not formulas.is_dir():
        raise FileError("is no folder", Where(str(formulas)))
    installed = find_installed() if formulas is None else Installed(formulas)
    remarks = list(settings.remarks)
    scene: dict[str, Any] = {"version": 1}
    scene["formula"] = formula_of(settings, installed, remarks)
    scene |= view_of(settings, remarks)
    placing = placing_of(settings)
    _look_at_the_set(scene, placing, mirrored=is_mirrored(settings))
    scene |= look_of(settings, scene["camera"], look, remarks)
    joined = joined_of(settings, installed, remarks)
    solids, materials = solids_of(settings.main, len(joined), look == "ours", remarks)
    # Solids come after the formulas, which may cut each other; what joins all before it is cut to the limits in the end.
    limits = scene.pop("objects", {})
    objects = {**joined, **solids, **limits}
    if objects:
        scene["objects"] = objects
    if placing is not None:
        place_around(scene, placing, (*solids, *limits))
    if materials:
        scene.setdefault("materials", {}).update(materials)
    if is_mirrored(settings):
        mirror(scene)
    take_their_distance(scene, settings, installed)
    move_counts(scene)
    _leave_out_lamps(scene, remarks)
    _end_rays(scene, settings.main)
    coloring = coloring_of(settings, remarks, _folds_of(scene["formula"]))
    if coloring is not None:
        scene["coloring"] = coloring
    _without_unused(settings.main)
    remarks += (f"line {line}: the film in [{name}] is not taken over" for name, line in settings.tables)
    remarks += _left(settings)
    return Imported(scene, tuple(remarks), tuple(settings.origins))


def _look_at_the_set(scene: dict[str, Any], placing: Placing | None, *, mirrored: bool) -> None:
    """Moves a target that was next to the eye as far away as the set is, by which occlusion and glow have their sizes."""
    camera = scene["camera"]
    eye, target = camera["position"], camera["target"]
    away = math.dist(eye, target)
    if scene["formula"] == "none" or away > 1.1 * NEAR * math.hypot(*eye):
        return
    place = eye if placing is None else placing.place(eye)
    found = distance_at(scene["formula"], [*place[:2], -place[2]] if mirrored else place)
    if away < found < math.inf:
        camera["target"] = [a + found / away * (b - a) for a, b in zip(eye, target, strict=True)]


def _without_unused(main: Section) -> None:
    """What belongs to parts that are switched off has no meaning."""
    main.without(["mat1_is_defined", "mat1_name"])
    for key, start in (
        ("stereo_enabled", "stereo"),
        ("fake_lights_enabled", "fake_"),
        ("random_lights_group", "random_"),
    ):
        if main.text(key).lower() in ("", "0", "false"):
            main.without(main.beginning(start))
        else:
            main.seen.discard(key)
    if not main.flag("boolean_operators", False):
        main.without(main.beginning("formula_material_id", "boolean_operator_"))
        # Of all materials only the first one is the set's; those of solids were read with them.
        main.without(
            key for key in main.beginning("mat") if key[3:4] in "23456789" and key[4:5] in "_0123456789"
        )


def _folds_of(section: dict[str, Any] | str) -> str | None:
    """The number of a scene's formula that says how a point was folded; None if there is none."""
    if isinstance(section, str):
        return None
    inline = section.get("inline", {})
    members = [each["inline"] for each in inline.get("chain", [section]) if "inline" in each]
    name = carried_name(COLOR)
    return name if any(name in each.get("state", {}) for each in members) else None


def _end_rays(scene: dict[str, Any], main: Section) -> None:
    """Looks for the set no farther than theirs look, where it goes on behind that."""
    farthest = main.number("view_distance_max", 50.0)
    eye = scene["camera"]["position"]
    formulas = [] if scene["formula"] == "none" else [(scene["formula"], _IN_THE_MIDDLE)]
    formulas += [
        (each["formula"], each) for each in scene.get("objects", {}).values() if each["type"] == "formula"
    ]
    if farthest > 0 and any(_reach(formula, placed, eye) > farthest for formula, placed in formulas):
        scene["renderer"]["bounds"] = {"center": list(eye), "radius": min(farthest, 1e6)}


_IN_THE_MIDDLE: dict[str, Any] = {"position": [0.0, 0.0, 0.0]}


def _reach(formula: dict[str, Any], placed: dict[str, Any], eye: list[float]) -> float:
    """How far from the eye a set may be, by the ball that holds it."""
    center, radius = ball_of(formula)
    return float(placed.get("scale", 1.0) * (math.dist(_own(placed, eye), center) + radius))


def _own(placed: dict[str, Any], place: list[float]) -> list[float]:
    """A place in the space of a formula that is an object."""
    placing = Placing(matrix_of(placed.get("rotation", (0, 0, 0))), placed["position"])
    return [part / placed.get("scale", 1.0) for part in placing.place(place)]


def _leave_out_lamps(scene: dict[str, Any], remarks: list[str]) -> None:
    """Takes away lamps within the set, or within a ball: nothing of their light comes out, and scenes refuse them."""
    lamps = [light for light in scene["lights"] if light.get("type") == "point"]
    if not lamps:
        return
    held = _held(scene, [lamp["position"] for lamp in lamps])
    eye = scene["camera"]["position"]
    balls = [
        each
        for each in scene.get("objects", {}).values()
        # A ball around the eye is a room.
        if each["type"] == "sphere" and math.dist(eye, each["position"]) > each["radius"]
    ]
    for lamp, inside in zip(lamps, held, strict=True):
        place = lamp["position"]
        if inside or any(math.dist(place, ball["position"]) <= ball["radius"] for ball in balls):
            scene["lights"].remove(lamp)
            remarks.append(
                f"a lamp at {', '.join(f'{each:g}' for each in place)} is within a solid; left out"
            )


def _held(scene: dict[str, Any], places: list[list[float]]) -> list[bool]:
    """Which places are within the formula, or one that stands beside it."""
    found = [False] * len(places) if scene["formula"] == "none" else are_inside(scene["formula"], places)
    for each in scene.get("objects", {}).values():
        if each["type"] != "formula" or each.get("join", "union") != "union":
            continue
        more = are_inside(each["formula"], [_own(each, place) for place in places])
        found = [a or b for a, b in zip(found, more, strict=True)]
    return found


def _left(settings: Settings) -> list[str]:
    """A line for each key that nobody asked for; one for all those that do not concern a still picture."""
    lines: list[str] = []
    elsewhere = method = 0
    for section in settings.sections.values():
        if section.name != "main_parameters" and not section.name.startswith("fractal_"):
            continue
        for key, entry in section.unread():
            if section.name == "main_parameters" and key.startswith(_ELSEWHERE):
                elsewhere += 1
            elif section.name == "main_parameters" and key.startswith(_METHOD):
                method += 1
            else:
                lines.append(
                    f"line {entry.line}: {_shown(section, key)} = {entry.text[:60]} is not taken over"
                )
    if method:
        lines.append(f"{_keys(method)} of how their rays find the surface: ours find it by themselves")
    if elsewhere:
        lines.append(f"{_keys(elsewhere)} of windows, films and files: not a part of the picture")
    return lines


def _shown(section: Section, key: str) -> str:
    return key if section.name == "main_parameters" else f"{section.name}.{key}"


def _keys(count: int) -> str:
    return "1 key" if count == 1 else f"{count} keys"
