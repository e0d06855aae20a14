"""The surface's material, and what is around it: background, fog, environment."""

from __future__ import annotations

from typing import Any

from clfractal.scene.environment import names
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.lighting import Environment
from clfractal.viewer.panels import maps
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.metadata import metas
from clfractal.viewer.panels.ui import Ui

# No name that a material may have.
PHONG, NEW = "", " "


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
    width = w.row(
        ui,
        "Light",
        path="lighting",
        tip="straight from the lights, or bouncing from surface to surface",
        differs=paths,
        reset=lambda: _put(ui, "lighting", {}),
    )
    if width is not None:
        found = w.segments("lighting", {False: "Direct", True: "Bounces"}, paths, width)
        if found is not None:
            kept = ui.memory.setdefault("lighting.kept", {"mode": "path"})
            if paths:
                kept.update(ui.studio.value("lighting"))
            _put(ui, "lighting", dict(kept) if found else {})
    w.problem(ui, "lighting.mode")
    if not paths:
        return
    w.fields(ui, "lighting", ("bounces", "roulette", "detail", "clamp"), clamp={"auto": "no limit"})
    _choice(ui)


def _choice(ui: Ui) -> None:
    """Which of the scene's materials is shown; one more can be made."""
    scene = ui.studio.scene
    width = w.row(ui, "Material", path="material.name", tip=w.value_tip(ui, "material.name"))
    if width is None:
        return
    words = {PHONG: "Phong's", **{name: name for name in scene.materials}, NEW: "New material"}
    found = w.choose("material.name", words, scene.material.name or PHONG, width)
    if found == NEW:
        made = next(name for name in (f"material {n}" for n in range(1, 1000)) if name not in scene.materials)
        color = None if not scene.coloring.kind.of_material else list(scene.material.color)
        ui.studio.edit({f"materials.{made}": {"base": {"color": color}}, "material.name": made})
    elif found is not None:
        _put(ui, "material.name", None if found == PHONG else found)
    w.problem(ui, "material.name")


def summary(ui: Ui) -> str:
    """For the heading of the surroundings."""
    scene = ui.studio.scene
    parts = [_source(scene.environment)] if scene.environment is not None else []
    return ", ".join(
        [*parts, *(["fog"] if scene.fog is not None else []), *(["glow"] if scene.glow is not None else [])]
    )


def _source(environment: Environment) -> str:
    return environment.name or ("sky" if environment.sky is not None else "map")


def _glow(ui: Ui, radius: float) -> None:
    w.group(ui, "Glow")
    if not _switch(ui, "glow", "Glow", {}):
        return
    width = {"auto": "1/20 of the bounds", "start": float(f"{radius / 20:.2g}")}
    w.fields(ui, "glow", ("color", "intensity", "width", "by"), width=width)
    glow = ui.studio.scene.glow
    if glow is None or glow.by != "trap":
        return
    w.field(ui, "glow.reach")
    w.fields(ui, "glow.trap", glow.trap.used_keys)


def draw_surroundings(ui: Ui) -> None:
    """Draws background, fog, glow and environment."""
    w.group(ui, "Background")
    _background(ui)
    w.group(ui, "Fog")
    radius = ui.studio.scene.bounds[1]
    if _switch(ui, "fog", "Fog", {"density": float(f"{0.25 / radius:.2g}")}):
        w.fields(
            ui,
            "fog",
            ("color", "density", "height", "base", "up", "background"),
            height={"auto": "everywhere", "start": float(f"{0.25 * radius:.2g}")},
            background={"label": "On background"},
        )
        if _switch(ui, "fog.scattering", "Shafts", {}):
            w.fields(ui, "fog.scattering", ("color", "anisotropy"))
    _glow(ui, radius)
    w.group(ui, "Environment")
    if _switch(ui, "environment", "Environment", {"name": names()[0]}):
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
    width = w.row(
        ui,
        "Kind",
        path="background",
        tip="a gradient from top to bottom, or nothing",
        differs=transparent,
        reset=lambda: _put(ui, "background", {}),
    )
    if width is not None:
        words = {False: "Gradient", True: "Transparent"}
        found = w.segments("background", words, transparent, width)
        if found is not None:
            kept = ui.memory.setdefault("background.kept", {})
            if found:
                kept.update(
                    top=list(w.value(ui, "background.top")), bottom=list(w.value(ui, "background.bottom"))
                )
            _put(ui, "background", "transparent" if found else dict(kept))
    if ui.studio.scene.background != "transparent":
        w.fields(ui, "background", ("top", "bottom"))


def _switch(ui: Ui, key: str, label: str, first: dict[str, Any]) -> bool:
    """The switch of a section that may be null; whether it is there. Its values come back when it is switched on again."""
    given = w.value(ui, key) is not None
    width = w.row(
        ui, label, path=key, tip=w.value_tip(ui, key), differs=given, reset=lambda: _put(ui, key, None)
    )
    if width is not None and w.toggle(key, given):
        kept = ui.memory.setdefault("kept", {})
        if given:
            kept[key] = ui.studio.value(key)
        _put(ui, key, None if given else kept.get(key, first))
    w.problem(ui, key)
    return w.value(ui, key) is not None


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
        w.field(ui, "environment.file")
        return
    about = metas(type(environment))["name"].description
    width = w.row(ui, "Map", path="environment.name", tip=about)
    if width is None:
        return
    found = w.choose(
        "environment.name", {name: w.word(name) for name in names()}, environment.name or "", width
    )
    if found is not None:
        _put(ui, "environment.name", found)
    w.problem(ui, "environment.name")


def _put(ui: Ui, path: str, value: Any) -> None:
    ui.studio.edit({path: value})
