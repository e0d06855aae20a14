"""Things that shine, which paths sample as they sample lights (`kernels/shading/emitters.h`)."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.scene.object_grids import placed
from clfractal.scene.objects import FormulaObject, VolumeObject
from clfractal.scene.surface import SurfaceRenderer
from clfractal.schema.base import Vector
from clfractal.schema.shape import Ball, Joined, ObjectBase, Simple, Solid
from clfractal.shading.emission import even_radiance, mean_radiance
from clfractal.shading.maps import glass_bodies
from clfractal.shading.materials import used_materials


@dataclass(frozen=True, slots=True)
class Emitter:
    """A thing that shines.

    Attributes:
        thing: its number, as interactions tell it: 0 is the set, and objects begin with 1.
        radiance: linear Rec. 709; of one that is sought about the mean of it.
        sought: whether a ray to it has to find out what it shines with there: it is not the same everywhere, or its
            shape is not known.
        ball: in which directions are chosen to one whose shape is not known, scene units; None: by its own shape.
    """

    thing: int
    radiance: Vector
    sought: bool
    ball: Ball | None


def emitters_of(scene: Scene) -> tuple[Emitter, ...]:
    """The things that paths sample as lights.

    Not these, which are found by chance alone: glass, which shines inside too; water; things of which nothing shines; and,
    of what is sought, all beside clouds, in which light is sampled without a ray that is marched, and the set with all that
    is joined to it where planes cut it.
    """
    return scene.derived(_emitters)


def seeks_light(scene: Scene) -> bool:
    """Whether any of them is sought."""
    return any(each.sought for each in emitters_of(scene))


def sampled_radiance(scene: Scene) -> list[Vector | None]:
    """Of each object the radiance, linear Rec. 709, with which paths sample it; None where they do not, or seek it."""
    known = {each.thing: each.radiance for each in emitters_of(scene) if not each.sought}
    return [known.get(number) for number in range(1, len(scene.objects) + 1)]


def may_seek(scene: Scene) -> bool:
    """Whether light can be sought in a scene."""
    return not any(isinstance(each, VolumeObject) and each.is_cloud for each in scene.objects.values())


def _emitters(scene: Scene) -> tuple[Emitter, ...]:
    if not isinstance(scene.lighting, PathLighting) or not isinstance(scene.renderer, SurfaceRenderer):
        return ()
    opened = any(plane.cuts_set or scene.joined.keys() & plane.cut_objects for plane in scene.cut_planes)
    seeks = may_seek(scene)
    cut = {name for plane in scene.cut_planes for name in plane.cut_objects}
    things: list[tuple[str | None, ObjectBase | None]] = [(None, None), *scene.objects.items()]
    found = []
    rows = zip(things, used_materials(scene), glass_bodies(scene), strict=True)
    for thing, ((name, each), material, through) in enumerate(rows):
        even = even_radiance(material)
        of_set = each is None or name in scene.joined
        known = isinstance(each, Simple) and not of_set and name not in cut
        if through:
            continue
        if known and even is not None:
            found.append(Emitter(thing, even, sought=False, ball=None))
            continue
        by_shape = known and isinstance(each, Simple) and each.spans == 1
        ball = _ball(scene, name, each)
        if not seeks or (of_set and (opened or not scene.has_set)) or (ball is None and not by_shape):
            continue
        radiance = even or mean_radiance(scene, material, ball)
        if max(radiance) > 0:
            found.append(Emitter(thing, radiance, sought=True, ball=None if by_shape else ball))
    return tuple(found)


def _ball(scene: Scene, name: str | None, each: ObjectBase | None) -> Ball | None:
    """A ball around a thing, scene units; None if it has no end."""
    if name is None or each is None:
        own = scene.renderer.bounds if isinstance(scene.renderer, SurfaceRenderer) else None
        center, radius = (
            (own.center, own.radius) if own is not None else (scene.chain.center, scene.chain.radius)
        )
    elif isinstance(each, FormulaObject):
        chain = scene.joined_chains[name]
        center, radius = each.ball(chain.center, chain.radius)
    elif isinstance(each, Solid):
        center, radius = each.position, each.reach
    elif isinstance(each, VolumeObject):
        extent = placed(each, scene.grids[each.file]).place.extent
        center, radius = extent.center, extent.radius
    else:
        return None
    # Where solids flow together each is lifted by a quarter of the width.
    flows = [part.smoothness for part in scene.joined.values() if part.join == "smooth_union"]
    of_set = each is None or (isinstance(each, Joined) and name in scene.joined)
    return center, radius + (max(flows, default=0.0) / 4 if of_set else 0.0)
