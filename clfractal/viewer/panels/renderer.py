"""How the picture is rendered: which of the three renderers, its search, its samples."""

from __future__ import annotations

from typing import Any

from imgui_bundle import imgui

from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.object_checks import can_show
from clfractal.scene.renderer import RENDERERS
from clfractal.scene.sampled import Sampled
from clfractal.scene.surface import SurfaceRenderer
from clfractal.viewer.panels import theme
from clfractal.viewer.panels import widgets as w
from clfractal.viewer.panels.ui import Ui

KINDS = {word: kind.title for word, kind in RENDERERS.items()}


def summary(ui: Ui) -> str:
    """For the heading."""
    return KINDS[ui.studio.scene.renderer.type].lower()


def draw(ui: Ui) -> None:
    """Draws the panel."""
    scene = ui.studio.scene
    about = "a surface, a grid of voxels, or a plane that cuts"
    found = w.pick(ui, "Show", KINDS, scene.renderer.type, path="renderer.type", tip=about)
    if found is not None:
        switch(ui, found)
    w.problem(ui, "renderer")
    _samples(ui)
    if isinstance(ui.studio.scene.renderer, SurfaceRenderer):
        _surface(ui, ui.studio.scene.renderer)
    if not w.filtering(ui):
        _region(ui)


def switch(ui: Ui, kind: str, changes: dict[str, Any] | None = None) -> bool:
    """Goes to another kind of renderer, with the samples of this one and what that kind had before.

    Args:
        changes: its values at paths, set along with it.
    """
    scene = ui.studio.scene
    now = w.plain(scene.renderer)
    kept = ui.memory.setdefault("renderer.kept", {})
    kept[now["type"]] = {"renderer": now, "cut_planes": w.plain(scene.cut_planes)}
    known = kept.get(kind, {})
    other = RENDERERS[kind]
    first: dict[str, Any] = {"type": kind, **other.first}
    common = {name: now[name] for name in Sampled.model_fields}
    edits: dict[str, Any] = {"renderer": {**known.get("renderer", first), **common}}
    if other.is_flat:
        edits["cut_planes"] = []
    elif scene.renderer.is_flat and not scene.cut_planes and known.get("cut_planes"):
        edits["cut_planes"] = known["cut_planes"]
    objects = _objects_of(ui, kind)
    if list(objects) != list(scene.objects):
        edits["objects"] = objects
    if other.has_own_colors and scene.coloring.uses_palette:
        edits["coloring.by"] = "solid"
    done = ui.studio.edit({**edits, **(changes or {})})
    if not done:
        ui.studio.tell(ui.studio.problems.get("renderer", "not possible"), wrong=True)
    return done


def _objects_of(ui: Ui, kind: str) -> dict[str, Any]:
    """The objects that another renderer shows; those that it does not show come back with one that does."""
    now = {name: w.plain(each) for name, each in ui.studio.scene.objects.items()}
    # Those of another scene, whose history was another one, do not.
    history, before, hidden = ui.memory.get("renderer.objects", (None, {}, set()))
    if history is not ui.studio.history:
        before, hidden = {}, set()
    every = {name: now.get(name, each) for name, each in before.items() if name in now or name in hidden}
    every |= {name: each for name, each in now.items() if name not in every}
    shown = {name: each for name, each in every.items() if can_show(kind, each["type"])}
    ui.memory["renderer.objects"] = ui.studio.history, every, every.keys() - shown.keys()
    return shown


def _samples(ui: Ui) -> None:
    renderer = ui.studio.scene.renderer
    w.group(ui, "Samples")
    w.field(ui, "renderer.samples", "At most" if renderer.noise is not None else "Samples")
    w.field(ui, "renderer.noise", "Until noise is", start=0.02, auto="all samples")
    if renderer.noise is not None:
        w.field(
            ui, "renderer.min_samples", start=renderer.used_min_samples, auto=f"{renderer.used_min_samples}"
        )
    w.field(ui, "renderer.filter")
    width = {"box": 1, "tent": 2, "blackman_harris": 3}[renderer.filter]
    w.field(ui, "renderer.filter_width", unit=" px", start=float(width), auto=f"{width} px")
    w.field(ui, "renderer.seed")


def _surface(ui: Ui, renderer: SurfaceRenderer) -> None:
    scene = ui.studio.scene
    radius = renderer.bounds.radius if renderer.bounds is not None else scene.chain.radius
    if scene.has_set:
        _search(ui, renderer, radius)
    else:
        radius = scene.bounds[1]
    w.group(ui, "Normals")
    # Normals of a grid need its points, so one choice would not do without the other.
    w.field(ui, "renderer.normal", keep={"renderer.points": None})
    _points(ui, renderer)
    w.group(ui, "Light")
    w.fields(ui, "renderer", ("bounces", "firefly_limit"), firefly_limit={"auto": "no limit"})
    if w.optional(ui, "renderer.ambient_occlusion", "Occlusion", {}, keeps=False):
        w.field(ui, "renderer.ambient_occlusion.rays")
        half = radius / 2
        w.field(ui, "renderer.ambient_occlusion.distance", start=half, auto=f"{half:.3g}")


def _search(ui: Ui, renderer: SurfaceRenderer, radius: float) -> None:
    """How rays look for the set."""
    scene = ui.studio.scene
    w.group(ui, "Search")
    w.field(ui, "renderer.search")
    if renderer.search == "steps":
        w.field(ui, "renderer.step", start=radius / 100, auto=f"{radius / 100:.3g}")
    else:
        w.field(ui, "renderer.detail", unit=" px")
        w.field(ui, "renderer.over_relaxation")
        own = scene.chain.step_scale
        w.field(ui, "renderer.step_scale", start=own, auto=f"{own:.3g}, the formula's")
    w.field(ui, "renderer.max_steps")
    chain = scene.chain
    first = {"center": list(chain.center), "radius": float(f"{chain.radius:.4g}")}
    if w.optional(ui, "renderer.bounds", "Own bounds", first, keeps=False):
        w.fields(ui, "renderer.bounds", ("center", "radius"))


def _points(ui: Ui, renderer: SurfaceRenderer) -> None:
    used, path = renderer.used_points, "renderer.points.count"
    first = {"pattern": used.pattern, "count": used.count}
    if not w.optional(ui, "renderer.points", "Points", first, keeps=False) or renderer.points is None:
        return
    w.field(ui, "renderer.points.pattern")
    if renderer.points.pattern == "stochastic":
        w.field(ui, path)
        return
    words, about = {n * n: f"{n} x {n}" for n in range(1, 9)}, "number of points per pixel"
    found = w.pick(ui, "Count", words, renderer.points.count, path=path, tip=about, listed=True)
    if found is not None:
        w.put(ui, path, found)


def _region(ui: Ui) -> None:
    if isinstance(ui.studio.scene.renderer, CutPlaneRenderer):
        w.field(ui, "renderer.periodicity")
    region = ui.studio.region
    imgui.dummy(imgui.ImVec2(0, 2))
    w.in_labels()
    if region is None:
        if w.button("Refine a rectangle", icon=theme.CROP, width=-1, about="Then drag it in the picture"):
            ui.act("region")
    elif w.button(f"Refine all (now {region[2]} x {region[3]} px)", icon=theme.CROP, width=-1):
        ui.act("region_clear")
