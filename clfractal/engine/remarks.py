"""What a user should know about a finished picture that shows less than it could: one line each.

A picture that is wrong at the first glance (empty, one flat colour) mostly has one of a few causes, and a setting that
mends it. Everything here follows from the job, what its rays counted and its pixels; the device is not asked.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from clfractal.camera.views import View
from clfractal.engine.job import Job
from clfractal.engine.run import Counters, Progress
from clfractal.geometry.eye_body import eye_body
from clfractal.images.framebuffer import Framebuffer
from clfractal.images.store import JournalFramebuffer
from clfractal.images.tiled import Picture
from clfractal.images.tiles import Region
from clfractal.integrators.plan import PlannedView
from clfractal.scene.checks import inside_solid, used_boxes
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.grid_place import GridPlace
from clfractal.scene.grid_values import in_words, is_finite_somewhere, lacking
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.scene.objects import FormulaObject, VolumeObject
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import VolumeRenderer
from clfractal.schema.shape import Solid

if TYPE_CHECKING:
    from clfractal.engine.comfort import Comfort

Floats = npt.NDArray[np.float64]

BAD_SHARE = 0.01
"""Steps that ended inside, of all steps, past which the user is told."""

# Colours (linear) that are no farther apart look the same.
_ALIKE = 0.004
# Rays across and down the picture that are asked whether bounds are in sight.
_RAYS = 33
# Of the steps that marches may take, past which their limit is told.
_MUCH = 1 / 3
# Points of the bounds that are asked whether they escape, and applications after which they count as inside.
_POINTS, _MOST_APPLICATIONS = 48, 200


@dataclass(frozen=True, slots=True)
class _Seen:
    """One of a layout's views, as one eye or both see it.

    Attributes:
        views: of each eye.
        stores: their pictures.
        counts: sums of what their rays counted.
        empty: whether nothing is seen; None where that is not known.
    """

    views: tuple[PlannedView, ...]
    stores: tuple[Picture, ...]
    counts: Counters
    empty: bool | None

    @property
    def scene(self) -> Scene:
        return self.views[0].scene

    @property
    def whole(self) -> bool:
        """Whether all of the view's picture was rendered."""
        return all(view.plan.region == Region(0, 0, *view.size) for view in self.views)


def remarks_of(
    job: Job, state: Progress, stores: Sequence[Picture], comfort: Comfort | None = None
) -> tuple[str, ...]:
    """The remarks on a finished job, without repetitions.

    Args:
        state: its counts; of a resumed job those of its last part, and then the pixels are looked at, too.
        stores: its pictures, one of each view.
        comfort: its parallax, where that is known.

    Raises:
        FileError: a picture on the disk cannot be read.
    """
    found = [job.remark] if job.remark else []
    found += [*_of_keys(job.scene), *state.remarks, *_of_kinds(stores)]
    for number in sorted({view.number for view in job.views}):
        name = f"layout.views.{number}: " if job.scene.layout is not None else ""
        found += [name + line for line in _of_view(_gathered(job, state, stores, number))]
    if comfort is not None and comfort.warning():
        found.append(comfort.warning())
    return tuple(dict.fromkeys(found))


def _of_keys(scene: Scene) -> list[str]:
    """That a key has no effect."""
    formulas = [
        scene.formula,
        *(each.formula for each in scene.objects.values() if isinstance(each, FormulaObject)),
    ]
    members = [member for formula in formulas for member in (formula, *(formula.chain or ()))]
    if not any(member.live for member in members):
        return []
    return ["formula.live has no effect: no value of a parameter is part of a program"]


def _of_kinds(stores: Sequence[Picture]) -> list[str]:
    """That devices of several kinds have made parts of a picture."""
    tiled = [store for store in stores if isinstance(store, (Framebuffer, JournalFramebuffer))]
    render_devices = {each.key: each for store in tiled for each in store.provenance.counts(store.done)}
    return [mixed_kinds(len(render_devices))] if len(render_devices) > 1 else []


def mixed_kinds(count: int) -> str:
    """The remark on a picture by devices of several kinds."""
    return f"made by devices of {count} kinds, which differ where last digits decide; the header tells whose tiles"


def _gathered(job: Job, state: Progress, stores: Sequence[Picture], number: int) -> _Seen:
    chosen = [place for place, view in enumerate(job.views) if view.number == number]
    counts = Counters()
    for place in chosen:
        counts.add(state.views[place])
    empty: bool | None = counts.hits == 0
    if empty and state.tiles_before:
        shown = [_shows(stores[place]) for place in chosen]
        empty = None if None in shown else not any(shown)
    return _Seen(
        tuple(job.views[place] for place in chosen),
        tuple(stores[place] for place in chosen),
        counts,
        empty,
    )


def _of_view(seen: _Seen) -> list[str]:
    renderer = seen.scene.renderer
    if isinstance(renderer, CutPlaneRenderer):
        return _of_plane(seen, renderer)
    if few := _of_steps(seen):
        return [few]
    if seen.empty:
        why = (
            _why_no_volume(seen, renderer) if isinstance(renderer, VolumeRenderer) else _why_no_surface(seen)
        )
        clear = ", so alpha is 0 everywhere" if seen.scene.background == "transparent" else ""
        return [why.replace(";", f"{clear};", 1)] if why else []
    found = [*_of_solid(seen), *_of_motion(seen), *_of_lighting(seen.scene)]
    if isinstance(renderer, SurfaceRenderer) and seen.counts.bad_distances > BAD_SHARE * seen.counts.steps:
        scale = renderer.step_scale if renderer.step_scale is not None else seen.scene.chain.step_scale
        found.append(
            f"{seen.counts.bad_distances / seen.counts.steps:.1%} of the steps ended inside the set, where it may have"
            f" holes; a renderer.step_scale below {scale:.3g}, such as {scale / 2:.2g}, helps"
        )
    return found


def _of_steps(seen: _Seen) -> str:
    """That marches mostly take as many steps as they may, so that many end before they arrive; else empty."""
    scene, renderer = seen.scene, seen.scene.renderer
    if not isinstance(renderer, SurfaceRenderer) or renderer.search == "steps" or not seen.counts.steps:
        return ""
    center, radius = scene.bounds
    met = [_meets_ball(view.camera, np.array(center), radius).mean() for view in seen.views]
    through = seen.counts.rays * (float(np.mean(met)) if seen.whole else 1.0)
    # Where a surface is hit others begin: as many as there can be, so that their steps do not look like those of rays.
    if isinstance(scene.lighting, PathLighting):
        each = 2 * scene.lighting.bounces
    else:
        occlusion = scene.surface.ambient_occlusion
        shadows = sum(light.rays or 1 for light in scene.lights if light.shadow)
        each = 1 + shadows + (occlusion.rays if occlusion is not None else 0)
    marches = max(through + seen.counts.hits * each, 1.0)
    if seen.counts.steps < _MUCH * marches * renderer.max_steps:
        return ""
    mean = min(seen.counts.steps / marches, float(renderer.max_steps))
    return (
        f"rays take {mean:.3g} of at most {renderer.max_steps} steps on the average, so many end before they"
        " arrive; a larger renderer.max_steps shows more"
    )


def _of_lighting(scene: Scene) -> list[str]:
    """Keys that the scene's way of lighting ignores, where they would have changed the picture."""
    material = scene.material
    if not isinstance(scene.lighting, PathLighting):
        named = [] if material.name is None else [f"material.name {material.name}"]
        named += [
            f"cut_planes.{number}.material {plane.material}"
            for number, plane in enumerate(scene.cut_planes)
            if plane.material is not None
        ]
        if not named:
            return []
        verb = "is" if len(named) == 1 else "are"
        return [f"{' and '.join(named)} {verb} for lighting.mode path; Phong's keys are shown"]
    unused = []
    keys: tuple[str, ...] = ("ambient", "reflection")
    if material.name is not None:
        keys = ("ambient", "diffuse", "specular", "shininess", "reflection")
    # Not by which keys were given: the scene in a picture's header has all of them.
    defaults = type(material).model_fields
    unused += [f"material.{key}" for key in keys if getattr(material, key) != defaults[key].default]
    if isinstance(scene.renderer, SurfaceRenderer) and scene.surface.ambient_occlusion is not None:
        unused.append("renderer.ambient_occlusion")
    lines = [f"lighting.mode path does not use {' and '.join(unused)}"] if unused else []
    if scene.lighting.clamp is not None:
        lines.append(
            "lighting.clamp takes light away where a sample is brighter: the picture is darker than it should be"
        )
    return lines


def _of_motion(seen: _Seen) -> list[str]:
    """What motion blur costs a volume."""
    view = seen.views[0]
    if not (view.changing and isinstance(view.scene.renderer, VolumeRenderer)):
        return []
    from clfractal.integrators.volume import grid_key

    count = view.plan.samples
    parts = (view.at_sample(sample) for sample in range(count))
    filled = len({grid_key(part.scene, part.plan) for part in parts})
    if filled == 1:
        return []
    return [
        f"motion blur fills {filled} grids for each picture, because what is in the volume moves; fewer"
        " renderer.samples, or animation.shutter 0, are faster"
    ]


def _why_no_surface(seen: _Seen) -> str:
    """Why no ray met the set; empty if that need not be a mistake."""
    center, radius = seen.scene.bounds
    misses = not any(_meets_ball(view.camera, np.array(center), radius).any() for view in seen.views)
    if not seen.scene.has_set:
        objects = seen.scene.objects.values()
        if not misses or not objects or not all(isinstance(each, (Solid, VolumeObject)) for each in objects):
            return ""
        return (
            f"no ray meets the objects, in a ball of radius {radius:g} around {_point(center)}: turn camera.target to"
            " them"
        )
    if misses:
        return (
            f"no ray meets the set; its bounds, a ball of radius {radius:g} around {_point(center)}, are not in the"
            " picture: turn camera.target to them"
        )
    if not seen.whole:
        return ""
    cut = any(plane.cut for plane in seen.scene.cut_planes)
    hint = (
        "cut_planes may have removed it" if cut else "fewer formula.iterations or other parameters show more"
    )
    return f"no ray meets the set, although rays go through its bounds; {hint}"


def _why_no_volume(seen: _Seen, renderer: VolumeRenderer) -> str:
    """Why nothing of a volume is seen; empty if that need not be a mistake."""
    scene, given = seen.scene, seen.scene.given
    if given is not None and not is_finite_somewhere(given.values):
        return _nothing_to_show(given.values)
    if given is None and (beyond := _beyond(scene, renderer)):
        return beyond
    shown = _shown_place(scene, renderer)
    if not any(_sees(view.camera, shown) for view in seen.views):
        middle = _point(shown.middle)
        return f"no ray meets the volume; its box is not in the picture: turn camera.target to {middle}"
    if not seen.whole:
        return ""
    stops = renderer.transfer.opacity
    if stops is not None and all(stop.opacity == 0 for stop in stops):
        return "nothing of the volume is visible; renderer.transfer.opacity is 0 for all values"
    if given is None and renderer.value != "iterations" and stops is None:
        return _EMPTY
    held = f": {in_words(given.values)}" if given is not None else ""
    return (
        f"nothing of the volume is visible; renderer.transfer.opacity is 0 for the values that it holds{held}"
    )


def remarks_of_grid(scene: Scene, values: npt.NDArray[Any]) -> tuple[str, ...]:
    """The remarks on a grid that a volume scene was made into, or that it shows from a file; mostly none.

    Args:
        values: of the grid, as they are stored.
    """
    renderer = scene.renderer
    assert isinstance(renderer, VolumeRenderer)
    if scene.given is not None:
        return () if is_finite_somewhere(values) else (_nothing_to_show(values),)
    if beyond := _beyond(scene, renderer):
        return (beyond,)
    if renderer.value == "iterations":
        return ()
    if not _holds(values, np.sign):
        return (_EMPTY,)
    full = 255 if values.dtype == np.uint8 else 1
    if not _holds(values, lambda plane: plane < full):
        return ("all of the volume is inside the set; a larger renderer.box shows its surface",)
    return ()


_EMPTY = "the volume holds nothing of the set; a finer renderer.resolution or another renderer.box shows more"


def _nothing_to_show(values: npt.NDArray[Any]) -> str:
    return f"the volume {lacking(values)}; renderer.file has no value to show"


def _holds(values: npt.NDArray[Any], wanted: Callable[[npt.NDArray[Any]], npt.NDArray[Any]]) -> bool:
    """Whether any value is as wanted; the planes after the first one with such a value are not looked at."""
    return any(bool(wanted(plane).any()) for plane in values)


def _beyond(scene: Scene, renderer: VolumeRenderer) -> str:
    """What to do if the box that is filled does not touch the set's bounds; else empty."""
    box = used_boxes(scene, renderer)[1]
    center, radius = scene.bounds
    beyond = np.maximum(np.abs(np.array(box.center) - center) - np.array(box.sides) / 2, 0)
    if float(np.linalg.norm(beyond)) < radius:
        return ""
    key = "renderer.zoom" if renderer.zoom else "renderer.box"
    return (
        f"the volume lies beyond the set; {key} must reach into its bounds, a ball of radius {radius:g} around"
        f" {_point(center)}"
    )


def _of_solid(seen: _Seen) -> list[str]:
    """What is wrong with the solid itself: an eye within it, or a formula that never escapes."""
    scene, renderer = seen.scene, seen.scene.renderer
    volume = renderer if isinstance(renderer, VolumeRenderer) else None
    if not scene.has_set:
        return []
    if volume is not None and (scene.given is not None or volume.value == "iterations"):
        return []
    if seen.counts.hits == 0:
        return []
    what = "ball" if volume is None else "box"
    if all(inside_solid(scene, _rim(scene, volume), most=_MOST_APPLICATIONS)):
        return [
            f"the formula never escapes within its bounds, so the set is a plain {what}; a smaller formula.bailout,"
            " a `shape` or larger bounds give it a form"
        ]
    # (Whoever is inside sees the set in every direction.)
    if seen.counts.hits < seen.counts.rays or (volume is not None and volume.transfer.opacity is not None):
        return []
    for view in seen.views:
        eye = view.camera.origin
        x, y, z = (float(each) for each in eye)
        if any(plane.cuts_set and plane.in_front((x, y, z)) for plane in scene.cut_planes):
            continue
        if volume is not None:
            x, y, z = (float(each) for each in _in_zoom(scene, volume, eye))
        if inside_solid(scene, [(x, y, z)])[0] and not (volume is None and eye_body(scene, (x, y, z))):
            return ["the camera is inside the set; move camera.position out of it"]
    return []


def _of_plane(seen: _Seen, renderer: CutPlaneRenderer) -> list[str]:
    """A plane by itself always shows something; but it may be one colour."""
    if not seen.whole or not all(_is_one_color(store) for store in seen.stores):
        return []
    placed = renderer.plane.placed
    if all(inside_solid(seen.scene, [placed.at(x, y) for x in (0, 0.5, 1) for y in (0, 0.5, 1)])):
        return [
            "all of the plane is inside the set, so the picture has one colour; move or enlarge renderer.plane"
        ]
    center, radius = seen.scene.bounds
    axes = np.array([placed.side, placed.up, placed.normal])
    from_middle = np.abs(axes @ (np.array(center) - np.array(placed.center)))
    beside = np.maximum(from_middle - np.array([placed.width, placed.height, 0]) / 2, 0)
    if float(np.linalg.norm(beside)) < radius:
        return [
            f"the plane of {placed.width:g} x {placed.height:g} is so large, or goes through so little of the set, that the"
            " picture has one colour; a smaller renderer.plane shows more"
        ]
    return ["the plane is so far from the set that the picture has one colour; move renderer.plane"]


def _rim(scene: Scene, volume: VolumeRenderer | None) -> list[tuple[float, float, float]]:
    """Points near the rim of what is searched: spread evenly on the ball, or the box, a little inside."""
    turn = np.arange(_POINTS) * np.pi * (3 - 5**0.5)
    height = 1 - (2 * np.arange(_POINTS) + 1) / _POINTS
    across = np.sqrt(1 - height**2)
    ball = np.stack([across * np.cos(turn), across * np.sin(turn), height], axis=1)
    if volume is None:
        center, radius = scene.bounds
        points = np.array(center) + 0.999 * radius * ball
    else:
        box = used_boxes(scene, volume)[1]
        cube = ball / np.abs(ball).max(axis=1, keepdims=True)
        points = np.array(box.center) + 0.999 * cube * np.array(box.sides) / 2
    return [(float(x), float(y), float(z)) for x, y, z in points]


def _in_zoom(scene: Scene, renderer: VolumeRenderer, point: Floats) -> Floats:
    """Where the formula is evaluated for a point of a volume's picture: the last zoom appears in the first box's place."""
    first, last = used_boxes(scene, renderer)
    return np.asarray(np.array(last.center) + (point - np.array(first.center)) / renderer.magnification)


def _shown_place(scene: Scene, renderer: VolumeRenderer) -> GridPlace:
    """The place of the box that is shown, in which a box is one voxel."""
    given = scene.given
    if given is not None:
        return given.place
    box = used_boxes(scene, renderer)[0]
    return GridPlace.along_axes((0.0, 0.0, 0.0), box.sides, (1, 1, 1)).moved(box.center)


def _rays(view: View, towards: Floats) -> tuple[Floats, Floats]:
    """Rays all over a picture, and the one that goes nearest to a point: where they begin, and directions of length 1."""
    steps = np.linspace(-0.5, 0.5, _RAYS)
    across, up = (each.ravel() for each in np.meshgrid(steps, steps))
    offset = towards - view.origin
    depth = float(offset @ view.axis)
    if view.eye is None or depth > 0:
        if view.eye is not None:
            offset = offset * float((view.center - view.eye) @ view.axis) / depth
        to_point = view.origin + offset - view.center
        across = np.append(across, np.clip(float(to_point @ view.side) / view.width, -0.5, 0.5))
        up = np.append(up, np.clip(float(to_point @ view.up) / view.height, -0.5, 0.5))
    places = view.center + across[:, None] * view.width * view.side + up[:, None] * view.height * view.up
    if view.eye is None:
        return places, np.broadcast_to(view.axis, places.shape)
    directions = places - view.eye
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    return np.broadcast_to(view.eye, places.shape), directions


def _meets_ball(view: View, center: Floats, radius: float) -> npt.NDArray[np.bool_]:
    """Which of some rays all over the picture go through a ball."""
    origins, directions = _rays(view, center)
    offset = center - origins
    along = np.einsum("ij,ij->i", offset, directions)
    beside = np.einsum("ij,ij->i", offset, offset) - along**2
    reach = np.sqrt(np.maximum(radius**2 - beside, 0))
    return np.asarray((beside < radius**2) & (along + reach > 0))


def _sees(view: View, place: GridPlace) -> bool:
    origins, directions = _rays(view, place.middle)
    origins, directions = place.own(origins), directions @ place.inverse.T
    with np.errstate(divide="ignore", invalid="ignore"):
        ends = np.stack([-origins / directions, (np.array(place.shape) - origins) / directions])
    enter, leave = np.fmin(*ends).max(axis=1), np.fmax(*ends).min(axis=1)
    return bool(((enter < leave) & (leave > 0)).any())


def _shows(store: Picture) -> bool | None:
    """Whether anything is seen in a picture; None if its channels do not tell."""
    if "A" not in store.channels and "Z" not in store.channels:
        return None
    return any(
        bool((band["A"] > 0).any() if "A" in band else np.isfinite(band["Z"]).any())
        for _, band in store.bands()
    )


def _is_one_color(store: Picture) -> bool:
    """Whether no two pixels can be told apart; False if there are no colours."""
    if not {"R", "G", "B"} <= set(store.channels):
        return False
    low, high = dict.fromkeys("RGB", np.inf), dict.fromkeys("RGB", -np.inf)
    for _, band in store.bands():
        for name in "RGB":
            low[name] = min(low[name], float(band[name].min()))
            high[name] = max(high[name], float(band[name].max()))
            if high[name] - low[name] > _ALIKE:
                return False
    return True


def _point(place: Sequence[float] | Floats) -> str:
    return "[" + ", ".join(f"{float(each) + 0.0:.6g}" for each in place) + "]"
