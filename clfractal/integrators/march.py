"""The settings of the march and of a sample's rays, as kernels read them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from clfractal.device.orbit import Record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.geometry.fineness import Fineness
from clfractal.geometry.object_grids import clouds_of
from clfractal.geometry.planes import plane_count
from clfractal.geometry.solids import has_hollows
from clfractal.integrators.records import bounces, environment_weight, firefly_limit, hemisphere_rays
from clfractal.integrators.state import PARTS, along_paths, normal_count
from clfractal.integrators.waves import chain_rays, meets_objects, met_numbers
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.shading.air_lights import air_fields
from clfractal.shading.emitter_tree import emitter_fields
from clfractal.shading.emitters import emitters_of, seeks_light
from clfractal.shading.environment import PackedEnvironment
from clfractal.shading.kind_numbers import FEATURES, NORMALS
from clfractal.shading.light_records import (
    ball_tree_begins,
    emitter_tree_begins,
    light_rays,
    tree_begins,
)
from clfractal.shading.light_tree import single_lights, tree_fields
from clfractal.shading.maps import has_bump, has_glass, has_glass_set, has_subsurface, material_counts
from clfractal.shading.set_bodies import set_bodies
from clfractal.shading.set_lights import SetLights, march_fields

MARCH = Struct(
    "March",
    [
        Field("bounds_center", "real", 3, "centre of the sphere that holds the set, scene units"),
        Field("bounds_radius", "real", 0, "its radius, scene units"),
        Field("set_radius", "real", 0, "of the ball that holds the set, if that is smaller, scene units"),
        Field("ball_center", "real", 3, "centre of the ball of the scene's own formula, scene units"),
        Field("ball_radius", "real", 0, "its radius, scene units"),
        Field("step_scale", "real", 0, "part of a distance that is safe to step"),
        Field("relaxation", "real", 0, "factor on steps, taken back where spheres do not touch"),
        Field("detail", "real", 0, "distance that counts as a hit, in footprints of the reference"),
        Field("near", "real", 0, "scaled distance at which light is computed, in cones"),
        Field("lands", "int", 0, "whether rays go on from where light is computed to the solid itself"),
        Field("shadow_lift", "real", 0, "where shadow rays start, in footprints above the surface"),
        Field("shadow_detail", "real", 0, "hit distance of shadow rays, in footprints over detail"),
        Field(
            "cone_margin", "real", 0, "what a block's cone is wider than its rays, in footprints over detail"
        ),
        Field("cone_share", "real", 0, "part of a scaled distance that is free for all of a block"),
        Field(
            "goes_far",
            "int",
            0,
            "1: rays look for the set beyond that ball, where estimates may be too large",
        ),
        Field(
            "polish",
            "int",
            0,
            "distances that bring a place to a fixed part of its footprint from the set; 0: it stays",
        ),
        Field("max_steps", "int", 0, "most distance evaluations along a ray"),
        Field("hollows", "int", 0, "1: what is cut out leaves hollows, in which no distance is known"),
        Field(
            "first_slope", "real", 0, "of a scaled distance along its gradient, where none has been measured"
        ),
        Field("step", "real", 0, "step of the search by steps, scene units"),
        Field("touch_share", "real", 0, "hit distance of a pixel's shared march, in footprints over detail"),
        Field(
            "point_start",
            "real",
            0,
            "how far before that march's end the points' marches begin, in footprints",
        ),
        Field("known_reach", "real", 0, "how far a proved hit proves its neighbours', in a point's cones"),
        Field("seed", "uint", 0, "chooses the places of points and rays"),
        Field("bounces", "int", 0, "most mirror reflections, or bounces of a path"),
        Field("roulette", "int", 0, "bounces after which Russian roulette ends paths"),
        Field("environment_weight", "real", 0, "about the irradiance that the environment brings"),
        Field("light_count", "int", 0, "number of lights"),
        Field("single_lights", "int", 0, "of these, beside the tree of lamps"),
        Field("tree_nodes", "int", 0, "nodes of that tree"),
        Field("light_tree", "int", 0, "where it begins among the tables"),
        Field("air_sun", "int", 0, "1: the sun of a sky shines into fog"),
        Field("air_others", "int", 0, "1: so do others than single lights"),
        Field("ball_nodes", "int", 0, "nodes of a tree of the balls on the set"),
        Field("ball_tree", "int", 0, "where it begins among the tables"),
        Field("object_count", "int", 0, "number of objects"),
        Field("set_body", "int", 0, "the number of the body of the scene's own formula; -1: it is opaque"),
        Field("eye_body", "int", 0, "the number of the body of the set that the eye is in; 0: none"),
        Field(
            "first_skin",
            "int",
            0,
            "of several bodies of the set the first that light only goes below; else 0",
        ),
        Field("emitter_count", "int", 0, "of things that shine; they stand behind the objects"),
        Field("single_emitters", "int", 0, "of these, beside their tree"),
        Field("emitter_nodes", "int", 0, "nodes of that tree"),
        Field("emitter_tree", "int", 0, "where it begins among the tables"),
        Field("meets_objects", "int", 0, "1: rays meet objects beside the set"),
        Field("chain_rays", "int", 0, "rays of light that boundaries of clear bodies bend"),
        Field("met_numbers", "int", 0, "numbers that are kept of what a ray met"),
        Field("plane_count", "int", 0, "number of cut planes in the picture"),
        Field("light_rays", "int", 0, "most shadow rays that a light has"),
        Field("set_count", "int", 0, "number of balls of lights on the set"),
        Field("set_cells", "int", 0, "cells of their probabilities along an edge of their cube"),
        Field("set_lists", "int", 0, "cells of their lists likewise"),
        Field("set_rays", "int", 0, "shadow rays of a sample to them"),
        Field("set_corner", "real", 3, "of their cube, scene units"),
        Field("set_edge", "real", 0, "its length"),
        Field("cosine_rays", "int", 0, "rays into the hemisphere, spread like the cosine"),
        Field("map_rays", "int", 0, "rays into the hemisphere, spread like the environment's light"),
        Field("ambient_far", "real", 0, "how long these rays are, scene units"),
        Field("occlusion_distance", "real", 0, "how far an obstacle counts as occlusion, scene units"),
        Field("occlusion_share", "real", 0, "what one ray adds to the open part; 0: no ambient occlusion"),
        Field("asked_count", "int", 0, "quantities of materials for which the formula is asked"),
        Field("bump_asked", "int", 0, "of those, from the first on: around interactions too"),
        Field("bump_surface", "int", 0, "1: so are normals and escape counts"),
        Field("material_count", "int", 0, "materials, and blends of them"),
        Field("set_material", "int", 0, "the set's"),
        Field("features", "int", 0, "bits FEATURE_"),
        Field("point_count", "int", 0, "points of a pixel"),
        Field("point_rows", "int", 0, "rows of their grid; 0: they are stochastic"),
        Field("normal", "int", 0, "what normals are made of, NORMAL_"),
        Field("normal_count", "int", 0, "normals over which a pixel's shading is averaged"),
        Field("geometric", "int", 0, "1: places of a pixel's points matter"),
        Field("soft_lights", "int", 0, "1: lights have sizes, and shadow rays go to places of them"),
        Field("state_at", "int", len(PARTS), "where what a pixel carries is kept, STATE_; below 0: not"),
        Field("firefly_limit", "real", 0, "brightest that mirrored light or the environment's may be"),
        Field("counts_waits", "int", 0, "1: applications that lanes wait in orbits of others are counted"),
    ],
)

# In footprints, tuned on spheres (no acne at any angle) and fractals (no light leaking into pores).
SHADOW_LIFT, SHADOW_DETAIL = 3.0, 0.5
# Of paths that do not land: light from just above their places counts. These lie where the scaled distance is a part of the
# scale, so rays that hit at a part of it have no acne.
FINE_LIFT, FINE_SHADOW = 1.0, 0.3
# A block's cone is so much wider than its rays, in heights at which light is computed: no ray may begin behind these.
# And the part of a scaled distance that the cone takes for free.
CONE_MARGIN, CONE_SHARE = 1.5, 0.8
# In footprints: a pixel's shared march ends where the set may be this near, half a pixel's diagonal.
TOUCH = 0.7
# In footprints: how far behind a proved touch the points of its pixel need no proof. The set is up to four estimates away.
KNOWN_REACH = 4.0
# Of a scaled distance along its gradient: where a surface is smooth, it is half of the true one.
FIRST_SLOPE = 0.5
# Distances that bring a point to a fixed part of its footprint from the set.
POLISH = 5
# In footprints: how far before the end of their pixel's march the points begin.
POINT_START = 0.5


def step_scale(scene: Scene) -> float:
    """How much of a distance is safe to step."""
    given = scene.surface.step_scale
    return given if given is not None else scene.chain.step_scale


def features_of(scene: Scene) -> int:
    """What a scene has, as bits of FEATURES."""
    has = {
        "fog": scene.fog is not None,
        "bump": has_bump(scene),
        "paths": along_paths(scene),
        "emitters": bool(emitters_of(scene)),
        "sought": seeks_light(scene),
        "shining_clouds": any(each.transfer.emission is not None for each in clouds_of(scene)),
        "glass": has_glass(scene),
        "glass_set": has_glass_set(scene),
        "subsurface": has_subsurface(scene),
        "clouds": along_paths(scene) and bool(clouds_of(scene)),
    }
    return sum(FEATURES[name] for name, there in has.items() if there)


def searches_far(scene: Scene) -> bool:
    """Whether rays look for the set farther out than its formula says that it is, and estimates are made for."""
    center, radius = scene.bounds
    apart = math.dist(center, scene.chain.center)
    return scene.surface.bounds is not None and apart + radius > scene.chain.radius


def uses_positions(scene: Scene) -> bool:
    """Whether normals or colours are made from the places of a pixel's points."""
    renderer = scene.surface
    return renderer.used_points.count > 1 and (
        renderer.normal_of_points or scene.coloring.kind.known == "with_points"
    )


def march_record(
    scene: Scene,
    precision: Precision,
    divider: int = 1,
    environment: PackedEnvironment | None = None,
    on_set: SetLights | None = None,
    places: Sequence[int] | None = None,
    tables: int = 0,
    *,
    eye_body: int = 0,
    counts_waits: bool = False,
) -> Record:
    """The settings of the march, and of the rays that a sample sends.

    A pixel stands for `divider` x `divider` of the picture's.

    Args:
        places: where what a pixel carries is kept, see `state_places`.
        tables: the number of the tables at which those of lights begin.
        eye_body: the number of the body of the set that the eye is in, or 0.
        counts_waits: whether the statistic `orbit_waits` is counted; else it is 0.
    """
    renderer, bodies = scene.surface, set_bodies(scene)
    center, radius = scene.bounds
    occlusion, rays = renderer.ambient_occlusion, hemisphere_rays(scene)
    half = scene.size / 2
    distance = half if occlusion is None or occlusion.distance is None else occlusion.distance
    largest = float(np.finfo(np.float32).max) / 16
    limit = firefly_limit(scene)
    points = renderer.used_points.count
    fineness = Fineness.of(scene, divider)
    # Points lie all over their pixel, and the march that they share has to be as wide.
    spread = fineness.pixel if points > 1 else 1.0
    touch = max(TOUCH * spread / fineness.detail, 1 / math.sqrt(points)) if points > 1 else 1.0
    near = step_scale(scene) * fineness.near
    # Points of a pixel stand for each other by their hits; the search by steps has no places before the solid.
    lands = fineness.lands or points > 1 or renderer.search != "distance"
    lift, shadow = (SHADOW_LIFT, SHADOW_DETAIL) if lands else (FINE_LIFT, FINE_SHADOW * step_scale(scene))
    values = {
        "bounds_center": center,
        # No ray comes nearer to a place than this.
        "bounds_radius": radius if scene.has_set else 0.0,
        "set_radius": min(radius, scene.formula_bounds[1]),
        "ball_center": scene.chain.center,
        "ball_radius": scene.chain.radius,
        "step_scale": step_scale(scene),
        "relaxation": renderer.over_relaxation,
        "detail": fineness.detail,
        "near": near,
        "lands": int(lands),
        "shadow_lift": lift * fineness.level,
        "shadow_detail": shadow * fineness.level / fineness.detail,
        "cone_margin": max(CONE_MARGIN * fineness.near, 1.5 * touch),
        "cone_share": CONE_SHARE,
        "goes_far": int(searches_far(scene)),
        # A binary search ends where the surface is; a march, somewhere within the point's footprint.
        "polish": POLISH if uses_positions(scene) and renderer.search == "distance" else 0,
        "max_steps": renderer.max_steps,
        "hollows": int(has_hollows(scene)),
        # A distance of degree 1 is the true one.
        "first_slope": FIRST_SLOPE if scene.joined or scene.chain.degree > 1 else 1.0,
        "step": renderer.step if renderer.step is not None else scene.size / 100,
        "touch_share": touch,
        # The search by steps begins at the eye, and goes both ways from the touch.
        "point_start": POINT_START * spread if renderer.search == "distance" else largest,
        "known_reach": KNOWN_REACH * spread / fineness.detail,
        "seed": renderer.seed,
        "bounces": bounces(scene),
        "roulette": scene.lighting.roulette if isinstance(scene.lighting, PathLighting) else 0,
        "environment_weight": environment_weight(scene, environment),
        **tree_fields(scene, tables + tree_begins(scene)),
        **air_fields(scene, tables + ball_tree_begins(scene)),
        **march_fields(on_set),
        "object_count": len(scene.objects),
        "set_body": bodies.own or -1,
        "first_skin": bodies.first_skin,
        "eye_body": eye_body,
        **emitter_fields(scene, tables + emitter_tree_begins(scene)),
        "meets_objects": int(meets_objects(scene)),
        "chain_rays": chain_rays(scene),
        "met_numbers": met_numbers(scene),
        "plane_count": plane_count(scene),
        "light_rays": light_rays(scene),
        "cosine_rays": rays.cosine,
        "map_rays": rays.map,
        "ambient_far": distance if not rays.lit else largest,
        "occlusion_distance": distance,
        "occlusion_share": 1 / rays.cosine if occlusion is not None and rays.cosine else 0.0,
        **material_counts(scene),
        "features": features_of(scene),
        "point_count": points,
        "point_rows": math.isqrt(points) if renderer.used_points.pattern == "grid" else 0,
        "normal": NORMALS[renderer.normal if renderer.normal_of_points else "gradient"],
        "normal_count": normal_count(scene),
        "geometric": int(uses_positions(scene)),
        "soft_lights": int(not along_paths(scene) and any(light.has_size for light in single_lights(scene))),
        "state_at": [-1] * len(PARTS) if places is None else places,
        "firefly_limit": largest if limit is None else min(limit, largest),
        "counts_waits": int(counts_waits),
    }
    return MARCH.value(precision, values)
