"""The surface's material, and what is around it: background, fog, environment."""

from __future__ import annotations

from imgui_bundle import imgui

from clfractal.scene.environment import names
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.mist import MAX_STOPS, Mist
from clfractal.viewer.panels import maps, theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui


def draw(ui: Ui) -> None:
    """Draws how light reaches the eye, and the material."""
    _lighting(ui)
    name = ui.studio.scene.material.name
    if name is not None and ui.studio.scene.lighting.mode == "path":
        maps.material(ui, name)
        return
    if ui.studio.scene.coloring.kind.of_material:
        w.field(ui, "material.color")
    elif not w.filtering(ui):
        w.hint(ui, f"The colour comes from the colouring by {w.word(ui.studio.scene.coloring.by).lower()}.")
    w.fields(ui, "material", ("ambient", "diffuse", "specular", "shininess", "reflection"))


def _lighting(ui: Ui) -> None:
    scene = ui.studio.scene
    paths = isinstance(scene.lighting, PathLighting)
    found = w.pick(
        ui,
        "Light",
        {False: "Direct", True: "Bounces"},
        paths,
        path="lighting",
        tip="straight from the lights, or bouncing from surface to surface",
        differs=paths,
        reset=lambda: w.put(ui, "lighting", {}),
    )
    if found is not None:
        kept = ui.memory.setdefault("lighting.kept", {"mode": "path"})
        if paths:
            kept.update(ui.studio.value("lighting"))
        w.put(ui, "lighting", kept if found else {})
    w.problem(ui, "lighting.mode")
    if paths:
        w.fields(ui, "lighting", ("bounces", "roulette", "detail", "clamp"), clamp={"auto": "no limit"})
        color = list(scene.material.color) if scene.coloring.kind.of_material else None
        maps.choice(ui, "material.name", scene.material.name, "Phong's", color)


def summary(ui: Ui) -> str:
    """For the heading of the surroundings."""
    scene = ui.studio.scene
    around = (("fog", scene.fog), ("glow", scene.glow), ("mist", scene.mist))
    parts = [name for name, part in around if part is not None]
    light = scene.environment
    if light is not None:
        parts.insert(0, light.name or ("sky" if light.sky is not None else "map"))
    return ", ".join(parts)


def _glow(ui: Ui, radius: float) -> None:
    w.group(ui, "Glow")
    if not w.optional(ui, "glow", "Glow", {}):
        return
    width = {"auto": "1/20 of the bounds", "start": float(f"{radius / 20:.2g}")}
    w.fields(ui, "glow", ("color", "intensity", "width", "by"), width=width)
    glow = ui.studio.scene.glow
    if glow is None or glow.by != "trap":
        return
    w.field(ui, "glow.reach")
    w.fields(ui, "glow.trap", glow.trap.used_keys)


def _mist(ui: Ui, radius: float) -> None:
    w.group(ui, "Mist")
    if not w.optional(ui, "mist", "Mist", {}):
        return
    w.field(ui, "mist.by", "Dense by")
    mist = ui.studio.scene.mist
    assert mist is not None
    by_count = mist.by == "iterations"
    density = {"auto": "hides half", "start": float(f"{mist.used_density(radius):.2g}")}
    width = {"auto": "1/20 of the bounds", "start": float(f"{radius / 20:.2g}")}
    end = {"auto": "all iterations", "start": mist.used_end(ui.studio.scene.formula.iterations)}
    keys = ("density", "start", "end") if by_count else ("density", "width", "distance")
    w.fields(ui, "mist", keys, density=density, width=width, end=end)
    for number in range(len(mist.colors)):
        label = {"label": "At count" if by_count else "At distance"}
        w.fields(ui, f"mist.colors.{number}", ("at", "color"), at=label)
    if not w.filtering(ui):
        _stop_buttons(ui, mist, 1.0 if by_count else mist.used_width(radius))


def _stop_buttons(ui: Ui, mist: Mist, step: float) -> None:
    """For one colour more, which begins as the last one a step farther, or one less."""
    stops = [w.plain(stop) for stop in mist.colors]
    w.in_labels()
    if w.button("Add a colour", icon=theme.PLUS, enabled=len(stops) < MAX_STOPS):
        farther = {**stops[-1], "at": float(f"{stops[-1]['at'] + step:.4g}")}
        w.put(ui, "mist.colors", [*stops, farther])
    imgui.same_line()
    if w.button("Remove the last", icon=theme.MINUS, enabled=len(stops) > 1):
        w.put(ui, "mist.colors", stops[:-1])


def draw_surroundings(ui: Ui) -> None:
    """Draws background, fog, glow, mist and environment."""
    w.group(ui, "Background")
    _background(ui)
    w.group(ui, "Fog")
    radius = ui.studio.scene.bounds[1]
    if w.optional(ui, "fog", "Fog", {"density": float(f"{0.25 / radius:.2g}")}):
        w.fields(
            ui,
            "fog",
            ("color", "density", "height", "base", "up", "background"),
            height={"auto": "everywhere", "start": float(f"{0.25 * radius:.2g}")},
            background={"label": "On background"},
        )
        if w.optional(ui, "fog.scattering", "Shafts", {}):
            w.fields(ui, "fog.scattering", ("color", "anisotropy"))
    _glow(ui, radius)
    _mist(ui, radius)
    w.group(ui, "Environment")
    if w.optional(ui, "environment", "Environment", {"name": names()[0]}):
        _map(ui)
        w.fields(
            ui,
            "environment",
            ("intensity", "rotation", "background", "rays"),
            rotation={"unit": "°"},
            background={"label": "Is background"},
        )


def _background(ui: Ui) -> None:
    transparent = ui.studio.scene.background == "transparent"
    found = w.pick(
        ui,
        "Kind",
        {False: "Gradient", True: "Transparent"},
        transparent,
        path="background",
        tip="a gradient from top to bottom, or nothing",
        differs=transparent,
        reset=lambda: w.put(ui, "background", {}),
    )
    if found is not None:
        kept = ui.memory.setdefault("background.kept", {})
        if found:
            kept.update({end: w.value(ui, f"background.{end}") for end in ("top", "bottom")})
        w.put(ui, "background", "transparent" if found else kept)
    if ui.studio.scene.background != "transparent":
        w.fields(ui, "background", ("top", "bottom"))


def _map(ui: Ui) -> None:
    environment = ui.studio.scene.environment
    assert environment is not None
    if environment.sky is not None:
        degrees = {"unit": "°"}
        w.fields(
            ui,
            "environment.sky",
            tuple(type(environment.sky).model_fields),
            sun_elevation=degrees,
            sun_azimuth={**degrees, "usual": (-180.0, 180.0)},
            sun={"label": "Sun's disc"},
        )
        return
    if environment.file is not None:
        w.fields(ui, "environment", ("file", "stretch", "up", "mirrored"))
        return
    words, now, path = {name: w.word(name) for name in names()}, environment.name or "", "environment.name"
    found = w.pick(ui, "Map", words, now, path=path, tip=w.value_tip(ui, path), listed=True)
    if found is not None:
        w.put(ui, path, found)
    w.fields(ui, "environment", ("up", "mirrored"))
