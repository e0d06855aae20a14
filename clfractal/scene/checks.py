"""Checks that concern several parts of a scene, made once the formula and its bounds are known."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from math import dist
from operator import and_, gt, or_
from typing import TYPE_CHECKING

from clfractal.elements.lights.set import SetLight
from clfractal.errors import SceneError, Where, unknown_name
from clfractal.files.channels import (
    CRYPTOMATTE_MATERIALS,
    CRYPTOMATTE_OBJECTS,
    ID_CHANNELS,
    LIGHT_LAYERS,
    NOISY,
    SURFACE_LAYERS,
)
from clfractal.scene.alone import check_alone
from clfractal.scene.coloring import Coloring
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.deep_checks import check_deep
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.lighting import MAX_ASKED
from clfractal.scene.model import Scene
from clfractal.scene.object_checks import check_material, check_objects, inside_of
from clfractal.scene.objects import FormulaObject
from clfractal.scene.parts import OrthographicCamera
from clfractal.scene.surface import SurfaceRenderer
from clfractal.scene.volume import Box, VolumeRenderer
from clfractal.schema.base import Vector
from clfractal.schema.light import SingleLight
from clfractal.schema.mapped import Map, maps_of
from clfractal.schema.quantity import colorings
from clfractal.schema.shape import Simple

if TYPE_CHECKING:
    from clfractal.formulas.language import Chain

MAX_STEPS_THROUGH = 1_000_000
MAX_PLANES = 64
# A point that has not escaped after so many applications is inside for every practical purpose: it bounds the time
# that a light deep in a set of a million iterations takes.
_MOST_APPLICATIONS = 2_000


def check_parts(scene: Scene, *, whole: bool = True) -> None:
    """Raises SceneError, with a dotted path, if values contradict each other; `whole` is false for a layout's view.

    What has passed is checked again only where a section changed that it reads: see `Scene.derived`.
    """
    for check in _PARTS:
        if whole or check is not _check_stereo:
            scene.derived(check)


def _check_places(scene: Scene) -> None:
    """Lights on the set need a surface, and places near their traps."""
    for number, light in enumerate(scene.lights):
        if not isinstance(light, SetLight):
            continue
        if not isinstance(scene.renderer, SurfaceRenderer):
            raise SceneError(
                f"set is for surface renderers, got a {scene.renderer.type}; remove this light",
                Where(path=f"lights.{number}.type"),
            )
        # Here, because NumPy takes long to import.
        from clfractal.scene.places import check_places

        check_places(scene, number)


def check_layers(scene: Scene, names: Sequence[str], where: str) -> None:
    """Raises SceneError, at `where`, for a channel that a view's renderer does not know."""
    surface = isinstance(scene.renderer, SurfaceRenderer)
    for name in names:
        if name in NOISY and not scene.output.denoise:
            raise SceneError(f"{name} is what was denoised; it needs output.denoise: true", Where(path=where))
        if name in NOISY and not {"R", "G", "B"} <= set(names):
            raise SceneError(f"{name} is what was denoised; it needs the channels R, G, B", Where(path=where))
        if name in {*SURFACE_LAYERS, *ID_CHANNELS} and not surface:
            raise SceneError(
                f"{name} is known of surfaces only, not with renderer.type {scene.renderer.type}",
                Where(path=where),
            )
        if name in LIGHT_LAYERS and not isinstance(scene.lighting, PathLighting):
            raise SceneError(f"{name} needs lighting: {{mode: path}}", Where(path=where))
    for layer, parts in (("CryptoObject", CRYPTOMATTE_OBJECTS), ("CryptoMaterial", CRYPTOMATTE_MATERIALS)):
        if 0 < len(set(parts) & set(names)) < len(parts):
            raise SceneError(
                f"{layer} is one thing: name {layer}, which brings all of its channels", Where(path=where)
            )


def _check_steps(scene: Scene) -> None:
    radius = scene.size
    _check_step(scene.coloring.step, radius, "coloring.step")
    if isinstance(scene.renderer, SurfaceRenderer):
        _check_step(scene.renderer.step, radius, "renderer.step")
        _check_residual(scene, scene.renderer)


def _check_carried(scene: Scene) -> None:
    """What colours follow of what formulas carry has to be there."""
    asking: list[tuple[str, Coloring | Map]] = [("coloring", scene.coloring)]
    for name, material in scene.materials.items():
        asking += ((f"materials.{name}.{key}", each) for key, each in maps_of(material))
    for path, each in asking:
        if each.by != "carried":
            continue
        known = scene.carried
        if not known:
            message = "carried needs a formula with numbers that are carried, and the scene's have no `state`"
            raise SceneError(message, Where(path=f"{path}.by"))
        if each.number is not None and each.number not in known:
            raise SceneError(unknown_name("carried number", each.number, known), Where(path=f"{path}.number"))


def _check_glow(scene: Scene) -> None:
    for key, given in (("glow", scene.glow), ("mist", scene.mist)):
        if given is not None and not isinstance(scene.renderer, SurfaceRenderer):
            raise SceneError(
                f"is for surface renderers, got a {scene.renderer.type}; remove it", Where(path=key)
            )


def _check_channels(scene: Scene) -> None:
    if scene.layout is None:
        check_layers(scene, scene.output.channels, "output.channels")


def _check_volume(scene: Scene) -> None:
    renderer = scene.renderer
    if not isinstance(renderer, VolumeRenderer):
        return
    used_boxes(scene, renderer)
    if renderer.file is not None and renderer.zoom:
        raise SceneError(
            "is not possible in a grid from a file; remove zoom or file", Where(path="renderer.zoom")
        )
    if renderer.level is not None:
        if renderer.transfer.opacity is not None:
            raise SceneError(
                "applies to a surface, but transfer.opacity shows all values; remove one of them",
                Where(path="renderer.level"),
            )
        if renderer.file is None:
            renderer.check_level(*renderer.value_range(scene.formula.iterations))
    if scene.coloring.uses_palette:
        plain = " or ".join(kind.tag for kind in colorings() if not kind.uses_palette)
        raise SceneError(
            f"must be {plain} for a volume, got {scene.coloring.by}; renderer.transfer.color colours values",
            Where(path="coloring.by"),
        )


def used_boxes(scene: Scene, renderer: VolumeRenderer) -> tuple[Box, Box]:
    """The box that a volume's picture shows, and the one that is filled after all zooms.

    Raises:
        SceneError: a zoom's box is not within the one before.
    """
    center, radius = scene.bounds if scene.deep is None else ((0.0, 0.0, 0.0), scene.size)
    first = renderer.box if renderer.box is not None else Box(center=center, size=2 * radius)
    last = first
    for index, zoom in enumerate(renderer.zoom):
        sides = last.sides
        smaller = (sides[0] / zoom.scale, sides[1] / zoom.scale, sides[2] / zoom.scale)
        for here, there, side, part in zip(zoom.center, last.center, sides, smaller, strict=True):
            if abs(here - there) > 0.5 * (side - part) * (1 + 1e-9) + 1e-14 * abs(there):
                raise SceneError(
                    f"the box must lie within the one before, {there - side / 2:.17g} to {there + side / 2:.17g},"
                    f" got {here - part / 2:.17g} to {here + part / 2:.17g}",
                    Where(path=f"renderer.zoom.{index}.center"),
                )
        last = Box(center=zoom.center, size=smaller)
    return first, last


def _check_eyes(scene: Scene) -> None:
    """A pair needs a perspective camera, except for the flat picture of a cut_plane renderer."""
    flat = isinstance(scene.renderer, CutPlaneRenderer)
    if scene.stereo is None or flat or scene.layout is not None:
        return
    if isinstance(scene.camera, OrthographicCamera):
        raise SceneError(
            "must be perspective with stereo: parallel rays look the same to both eyes; use"
            " {projection: perspective, position, target, fov}, or remove stereo",
            Where(path="camera.projection"),
        )


def _check_stereo(scene: Scene) -> None:
    """Squeezed pictures need an even side, anaglyphs need colours, and `fit` needs one view with depth."""
    stereo = scene.stereo
    if stereo is None:
        return
    squeezed = {"split_half": "width", "over_under_half": "height"}.get(stereo.mode)
    if squeezed is not None:
        side = getattr(scene.image, squeezed)
        if side % 2:
            raise SceneError(
                f"must be even for stereo.mode {stereo.mode}, where each eye gets half of it, got {side}",
                Where(path=f"image.{squeezed}"),
            )
    stereo.check_channels(scene.output.channels)
    if stereo.fit is None:
        return
    problem = ""
    if scene.layout is not None:
        problem = "cannot fit several views at once; give plane and separation instead, or remove layout"
    elif isinstance(scene.renderer, CutPlaneRenderer):
        problem = "needs depth, but the picture of a cut_plane renderer is flat; remove fit"
    elif stereo.convergence != "off_axis":
        problem = (
            f"needs convergence off_axis, where parallax follows from depth alone, got {stereo.convergence}"
        )
    if problem:
        raise SceneError(f"auto {problem}", Where(path="stereo.fit"))


def _check_step(step: float | None, radius: float, path: str) -> None:
    """A step must not jump over the whole object, and must not be so small that a ray takes forever."""
    if step is None:
        return
    diameter = 2 * radius
    if step > diameter:
        raise SceneError(
            f"must be at most the diameter of the bounds, {diameter:.4g}, got {step:g}", Where(path=path)
        )
    if step * MAX_STEPS_THROUGH < diameter:
        raise SceneError(
            f"must be at least {diameter / MAX_STEPS_THROUGH:.4g}, {MAX_STEPS_THROUGH:,} steps through the bounds,"
            f" got {step:g}",
            Where(path=path),
        )


def _check_views(scene: Scene) -> None:
    """Checks every view as a scene of its own."""
    if scene.layout is None:
        return
    for number, (view, _) in enumerate(scene.views):
        try:
            check_parts(view, whole=False)
        except SceneError as error:
            raise scene.layout.views[number].own_error(error, number) from error


def _check_planes(scene: Scene) -> None:
    """Limits the number of planes, because every plane is evaluated for every pixel."""
    count = sum(plane.count for plane in scene.cut_planes)
    if count > MAX_PLANES:
        raise SceneError(
            f"must be at most {MAX_PLANES} planes in total, got {count}", Where(path="cut_planes")
        )
    if count and scene.renderer.is_flat:
        raise SceneError("are for surface and volume renderers; remove them", Where(path="cut_planes"))


def _check_residual(scene: Scene, renderer: SurfaceRenderer) -> None:
    """Residuals need four points: a plane fits three points exactly."""
    count = renderer.used_points.count
    kind = scene.coloring.kind
    if count < kind.least_points:
        raise SceneError(
            f"{kind.tag} needs at least {kind.least_points} points per pixel (renderer.points), got {count}",
            Where(path="coloring.by"),
        )


def check_lighting(scene: Scene) -> None:
    """Raises SceneError for a material that is not there, and for what paths cannot show yet."""
    check_material(scene, scene.material.name, "material.name")
    if any(material.blend is not None for material in scene.materials.values()):
        from clfractal.scene.blends import check_blends

        check_blends(scene.materials)
    if not isinstance(scene.lighting, PathLighting):
        return
    renderer = scene.renderer
    if isinstance(renderer, VolumeRenderer):
        _check_medium(scene, renderer)
    if isinstance(renderer, SurfaceRenderer):
        _check_paths(scene, renderer)


def _check_paths(scene: Scene, renderer: SurfaceRenderer) -> None:
    if renderer.used_points.count > 1:
        key = "points" if renderer.points is not None else "normal"
        raise SceneError(
            "cannot be combined with lighting.mode path, whose samples find spots of their own; use renderer.samples",
            Where(path=f"renderer.{key}"),
        )


def _check_medium(scene: Scene, renderer: VolumeRenderer) -> None:
    """Paths go through media; what they would have to know besides is refused."""
    if renderer.transfer.opacity is None:
        raise SceneError(
            "must be direct for a volume's surface, got path; give renderer.transfer.opacity for a medium, or use the"
            " surface renderer",
            Where(path="lighting.mode"),
        )
    for key, given in (("cut_planes", bool(scene.cut_planes)), ("fog", scene.fog is not None)):
        if given:
            raise SceneError(
                "cannot be combined with lighting.mode path in a volume; remove it, or use lighting.mode direct",
                Where(path=key),
            )


def _check_light_count(scene: Scene) -> None:
    """Paths choose one of many lights at each place; elsewhere each is asked, and each on the set is searched for."""
    count = sum(isinstance(light, SingleLight) for light in scene.lights)
    searched = len(scene.lights) - count
    far = sum(isinstance(light, SingleLight) and light.stands_at is None for light in scene.lights)
    if far > MAX_ASKED and isinstance(scene.lighting, PathLighting):
        raise SceneError(
            f"must have at most {MAX_ASKED} entries without a position, all of which are asked everywhere, got {far}",
            Where(path="lights"),
        )
    if searched > MAX_ASKED:
        raise SceneError(
            f"must have at most {MAX_ASKED} entries of type set, each of which has many balls, got {searched}",
            Where(path="lights"),
        )
    if count > MAX_ASKED and not isinstance(scene.lighting, PathLighting) and not scene.renderer.is_flat:
        raise SceneError(
            f"must have at most {MAX_ASKED} entries with lighting.mode direct, where every place asks all of them,"
            f" got {count}; use lighting: {{mode: path}}",
            Where(path="lights"),
        )


def _check_lights(scene: Scene) -> None:
    """A grid from a file is not the formula's solid, so there lights may be anywhere."""
    if not scene.has_set or (isinstance(scene.renderer, VolumeRenderer) and scene.renderer.file is not None):
        return
    center, radius = scene.bounds
    candidates = [
        (index, place)
        for index, light in enumerate(scene.lights)
        if (place := light.stands_at) is not None
        and dist(place, center) <= radius
        and not any(plane.cuts_set and plane.in_front(place) for plane in scene.cut_planes)
    ]
    if not candidates:
        return
    found = inside_solid(scene, [position for _, position in candidates])
    for (index, position), inside in zip(candidates, found, strict=True):
        if inside:
            raise inside_of("the object", index, position)


# Whether a point is in what is joined, by whether it is in the first and in the second.
_JOINED: Mapping[str, Callable[[bool, bool], bool]] = {
    "cut": gt,
    "intersection": and_,
    "union": or_,
    "smooth_union": or_,
}


def inside_solid(scene: Scene, points: Sequence[Vector], *, most: int = _MOST_APPLICATIONS) -> Sequence[bool]:
    """Which points belong to the solid that is drawn; after `most` applications without escape they count as inside."""
    (_, found), *more = parts_holding(scene, points, most=most)
    for name, held in more:
        found = [_JOINED[scene.joined[name].join](a, b) for a, b in zip(found, held, strict=True)]
    return found


def parts_holding(
    scene: Scene, points: Sequence[Vector], *, most: int = _MOST_APPLICATIONS
) -> Iterator[tuple[str, list[bool]]]:
    """Which points are in each part of the solid, by itself: in the scene's own formula, whose name is "", and in all that
    is joined to it.
    """
    yield "", _inside_formula(scene.chain, min(scene.formula.iterations, most), points)
    for name, each in scene.joined.items():
        if isinstance(each, FormulaObject):
            own = [each.own_place(point) for point in points]
            yield name, _inside_formula(scene.joined_chains[name], min(each.formula.iterations, most), own)
        else:
            assert isinstance(each, Simple)
            yield name, [each.holds(point) for point in points]


def _inside_formula(chain: "Chain", iterations: int, points: Sequence[Vector]) -> list[bool]:
    import numpy as np

    from clfractal.formulas import reference

    array = np.array(points, dtype=float)
    inside = reference.escape(chain, array, iterations)[1]
    if chain.shape_index is not None:
        # The last solid is the shape, which is smaller than the ball of the bailout.
        inside &= reference.distance(chain, array, iterations)[0] == 0
    return [bool(each) for each in inside]


# In this order: of several mistakes the first one is told.
_PARTS = (
    check_alone,
    check_deep,
    _check_steps,
    _check_carried,
    _check_volume,
    _check_planes,
    _check_glow,
    check_lighting,
    check_objects,
    _check_channels,
    _check_eyes,
    _check_stereo,
    _check_views,
    _check_light_count,
    _check_lights,
    _check_places,
)
