"""The order of the surface renderer's stages: which kernels a launch has, and what each marches or makes.

Rays of a purpose are sent by one stage, marched by another, which knows the formula, and read by a third. A launch is

    [send_cones  march]  and for each sample

    begin_samples  march  find_interactions (or send_points  march  join_points)  [color_interactions]  march
    light_interactions

with `[meet_objects]` before each march and `[look_at_objects]` after those that look for an interaction, with
`[send_to_lights]` after the interactions and `[meet_lights] [gather_light]` before `light_interactions` where direct
light comes from more than single directions, with `[find_planes]`, `[add_glow]` and `[find_mist]` after
`[color_interactions]`, and with `[find_faces]` before the march of rays that look for an interaction; each mirror adds
what follows `begin_samples` but for the points. With `lighting.mode: path` in the place of the last two

    [find_materials]  scatter_paths  march  gather_paths

ask for light and send the next ray of each path (`march_inside`, or `walk_inside` with glass that scatters light, takes
those within to where they leave the set), and after the last bounce `march  end_paths` finds out which rays leave the set.
`scatter_costly` takes the place of `scatter_paths` where materials have parts such as films, whose registers others need
not pay for. With media that scatter light `cross_media` stands before both and before `end_paths`, and with clouds
`walk_clouds` and `pass_clouds` after the former; with clear water or balls `bend_light` before the former, and
`end_bent_light` before the latter (`bend_shapes` and `end_bent_shapes` where clear bodies have other shapes, too).
Light that is sought has rays of its own, which are marched to what they meet, and
`find_sought  [color_interactions]  [find_materials]  gather_sought` before `gather_paths`; last rays look for what they
meet then, and `find_last  [color_interactions]  [find_materials]  end_sought` stand before `end_paths`. Where fog scatters
light, `send_air` stands behind the first interactions, and `gather_air` behind the march of the rays for light; of what the
fog seeks, the same stages as above stand before `[color_interactions]`, with `gather_sought_air`. See
docs/engineering/stages.md.
"""

from __future__ import annotations

from collections.abc import Iterator

from clfractal.elements.lights.set import SetLight
from clfractal.geometry.object_grids import clouds_of
from clfractal.geometry.planes import has_faces
from clfractal.integrators.kernel import MET_NUMBERS, Over, Stage
from clfractal.integrators.plan import Plan
from clfractal.integrators.records import bounces, hemisphere_rays
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.scene.parts import PerspectiveCamera
from clfractal.shading.air_lights import air_turns, seeks_in_air
from clfractal.shading.clear_bodies import clear_bodies, has_shot_bodies
from clfractal.shading.emitters import sampled_radiance, seeks_light
from clfractal.shading.light_records import light_rays
from clfractal.shading.light_tree import single_lights
from clfractal.shading.maps import (
    MappedMaterials,
    asked_maps,
    bump_numbers,
    has_costly,
    has_glass_set,
    has_participating_media,
)
from clfractal.shading.set_bodies import joins_smoothly, set_bodies

# What a march is after, as in `kernels/integrators/march/rays.h`.
GOALS = ("surface", "shadow", "touch", "point", "cone")
GOAL_SURFACE, GOAL_SHADOW, GOAL_TOUCH, GOAL_POINT, GOAL_CONE = range(len(GOALS))
# Rays that a work-item marches: a packet of lanes, which take them in turn, or one lane.
PACKET_RAYS, LANE_RAYS = 1024, 4
_LANE_GROUP = 64


def rays_of_item(lanes: int, rays: int, compute_units: int) -> int:
    """Rays that a work-item marches: fewer where there are too few for all cores."""
    if lanes == 1:
        return LANE_RAYS
    share = rays // (3 * max(compute_units, 1))
    return min(max(share // lanes, 1) * lanes, PACKET_RAYS)


def rays_group(lanes: int) -> tuple[int, ...]:
    """Work-items of a group that marches rays."""
    return (_LANE_GROUP if lanes == 1 else 1,)


def asks_formula(scene: Scene) -> bool:
    """Whether a quantity that chooses colours, or a material's, is found by asking the formula."""
    return scene.coloring.kind.known == "by_formula" or bool(asked_maps(scene) or bump_numbers(scene))


def has_cones(scene: Scene, plan: Plan) -> bool:
    """Whether a cone for each block of pixels goes before the rays: those through a lens, or of a view that moves, have no
    common one."""
    return scene.has_set and scene.surface.search == "distance" and not has_lens(scene) and not plan.moving


def has_lens(scene: Scene) -> bool:
    """Whether rays leave a lens."""
    return isinstance(scene.camera, PerspectiveCamera) and scene.camera.lens_radius > 0


def meets_objects(scene: Scene) -> bool:
    """Whether rays meet objects beside the set."""
    clouds = clouds_of(scene)
    return any(name not in scene.joined and each not in clouds for name, each in scene.objects.items())


def has_media(scene: Scene) -> bool:
    """Whether anything scatters paths on their way: clouds, or glass."""
    along_paths = isinstance(scene.lighting, PathLighting)
    return has_participating_media(scene) or (along_paths and bool(clouds_of(scene)))


def has_bent_light(scene: Scene) -> bool:
    """Whether lights are sampled through smooth boundaries: those that paths may hardly meet by chance; a sky's sun, too.

    Clouds would dim such light on its way, which nothing asks for, and lights without shadows go through all things.
    """
    sun = scene.environment is not None and scene.environment.has_sun
    small = bool(scene.lights) or sun or any(each is not None for each in sampled_radiance(scene))
    shadows = all(light.shadow for light in scene.lights)
    return any(clear_bodies(scene)) and small and shadows and not clouds_of(scene)


def chain_rays(scene: Scene) -> int:
    """Rays of light that the boundaries of a clear body bend: one more than these (`kernels/integrators/chains.h`)."""
    return 1 + max(clear_bodies(scene), default=0)


def finds_materials(scene: Scene) -> bool:
    """Whether materials of interactions differ from place to place, or parts of several are mixed: else each thing has
    its own.
    """
    if not isinstance(scene.lighting, PathLighting):
        return False
    return bool(MappedMaterials(scene).maps) or has_faces(scene) or joins_smoothly(scene)


def met_numbers(scene: Scene) -> int:
    """Numbers that are kept of what a ray met (`kernels/integrators/march/queue.h`)."""
    return MET_NUMBERS + bool(scene.joined) + 2 * (joins_smoothly(scene) or set_bodies(scene).several)


def light_turns(scene: Scene) -> int:
    """Rays that leave an interaction for its light; along paths they are sent by a stage of their own."""
    if isinstance(scene.lighting, PathLighting):
        return 0
    rays = hemisphere_rays(scene)
    to_set = max((light.used_rays for light in scene.lights if isinstance(light, SetLight)), default=0)
    return rays.cosine + rays.map + len(single_lights(scene)) * light_rays(scene) + to_set


def meets_lights(scene: Scene) -> bool:
    """Whether paths of direct light may meet lights: those that have a place and a size."""
    if isinstance(scene.lighting, PathLighting):
        return False
    return any(light.is_seen for light in scene.lights)


def has_wide_lights(scene: Scene) -> bool:
    """Whether direct light comes from more than single directions: from lights with a size, or out of the hemisphere."""
    if isinstance(scene.lighting, PathLighting):
        return False
    rays = hemisphere_rays(scene)
    return rays.cosine + rays.map > 0 or any(light.has_size for light in scene.lights)


def most_turns(scene: Scene) -> int:
    """The most rays that a pixel sends for one purpose."""
    after = max(light_turns(scene), 1) + air_turns(scene)
    if has_bent_light(scene):
        after += chain_rays(scene)
    # (Those of the air are over before the others are sent.)
    after += seeks_light(scene) or seeks_in_air(scene)
    # A path that is within a set of glass has a ray of another kind.
    return max(scene.surface.used_points.count, after, 1 + int(has_glass_set(scene)))


# What work-items do of kernels that are not launched over pixels.
OVER: dict[str, Over] = {
    "scatter_paths": "shares of pixels",
    "scatter_costly": "shares of pixels",
    "walk_clouds": "shares of pixels",
    "march_rays": "rays",
    "march_points": "rays",
    "step_rays": "rays",
    "march_inside": "rays",
    "walk_inside": "rays",
    "send_cones": "packets of rays",
    "look_at_surfaces": "packets of rays",
    "look_at_points": "packets of rays",
    "look_where_steps_end": "packets of rays",
    "look_inside_set": "packets of rays",
    "look_where_walks_end": "packets of rays",
    "meet_objects": "shares of rays",
    "look_at_objects": "packets of rays",
}
# Packets look at surfaces where they march.
OF_SINGLE_LANES = (
    "look_at_surfaces",
    "look_at_points",
    "look_where_steps_end",
    "look_inside_set",
    "look_where_walks_end",
)


def stage_name(stage: Stage) -> str:
    """A stage's kernel; of a march also what it is after."""
    return f"{stage.kernel} {GOALS[stage.numbers['goal']]}" if "goal" in stage.numbers else stage.kernel


def march_kernels(scene: Scene, plan: Plan) -> tuple[str, ...]:
    """The kernels of `march.cl`, `march_points.cl` or `march_steps.cl`: packets look at surfaces where they march.

    Objects alone need none: no ray is sent to the set, whose bounds are empty (`march_record`).
    """
    if not scene.has_set:
        return ()
    if scene.surface.search == "steps":
        found = ("step_rays", "look_where_steps_end")
    elif scene.surface.used_points.count > 1:
        found = ("march_points", "look_at_points")
    else:
        found = ("march_rays", "look_at_surfaces")
    return found if plan.lanes == 1 else found[:1]


def inside_kernels(scene: Scene, plan: Plan) -> tuple[str, ...]:
    """The kernels of `glass.cl`, or of `random_walk.cl` where anything scatters light on the way."""
    participating = has_participating_media(scene)
    found = ("walk_inside", "look_where_walks_end") if participating else ("march_inside", "look_inside_set")
    return found if plan.lanes == 1 else found[:1]


def surface_stages(scene: Scene, plan: Plan, samples: tuple[int, int]) -> Iterator[Stage]:
    """The stages of a launch for samples from the first up to the second."""
    cones = has_cones(scene, plan)
    if cones and samples[0] < samples[1]:
        yield Stage("send_cones", OVER["send_cones"], 1, of="blocks")
        march = march_kernels(scene, plan)[0]
        yield Stage(march, OVER[march], 1, {"goal": GOAL_CONE}, of="blocks")
    # A launch without samples only writes what pixels have.
    for sample in range(*samples):
        yield from _sample(scene, sample, plan, cones=cones)


def _sample(scene: Scene, sample: int, plan: Plan, *, cones: bool) -> Iterator[Stage]:
    marching, last = march_kernels(scene, plan), bounces(scene)
    points, after = scene.surface.used_points.count, light_turns(scene)
    paths, faces, seeks = isinstance(scene.lighting, PathLighting), has_faces(scene), seeks_light(scene)

    def stage(kernel: str, turns: int = 0, **numbers: int) -> Stage:
        return Stage(kernel, OVER.get(kernel, "pixels"), turns, {"sample": sample, **numbers})

    def when(wanted: object, *stages: Stage) -> tuple[Stage, ...]:
        return stages if wanted else ()

    def objects(kernel: str, turns: int, first: int = 0) -> tuple[Stage, ...]:
        """What stands beside the set, where there is anything."""
        return when(meets_objects(scene), Stage(kernel, OVER[kernel], turns, {"next_turns": first}))

    def asked_formula(of: int, turn: int = 0) -> tuple[Stage, ...]:
        """What the formula is asked for an interaction, which rays of that turn have found."""
        return when(asks_formula(scene), stage("color_interactions", bounce=of, next_turns=turn))

    def asked_material(of: int, turn: int = 0) -> tuple[Stage, ...]:
        """What its material is, likewise."""
        return when(finds_materials(scene), stage("find_materials", bounce=of, next_turns=turn))

    def sought(gather: str, turn: int, bounce: int) -> Iterator[Stage]:
        """What rays of that turn meet in search of light, and what it shines with."""
        yield from objects("meet_objects", 1, turn)
        yield from _marched(marching, 1, GOAL_SURFACE, first=turn)
        yield from objects("look_at_objects", 1, turn)
        yield stage("find_sought", 1, bounce=bounce, next_turns=turn)
        # (It stands where interactions after the first one do.)
        yield from (*asked_formula(1, turn), *asked_material(1, turn))
        yield stage(gather, 1, bounce=bounce, next_turns=turn)

    yield stage("begin_samples", int(cones))
    for bounce in range(last + 1):
        within = has_glass_set(scene) and (bounce > 0 or plan.eye_body > 0)
        of_points = points > 1 and bounce == 0
        turns = points if of_points else 1
        # (Of a pixel with points only a face asks whether an object is before it.)
        yield from when(faces or not of_points, *objects("meet_objects", 1 + within))
        yield from when(faces, stage("find_faces", bounce=bounce))
        if of_points:
            yield from _marched(marching, 1, GOAL_TOUCH)
            yield stage("send_points", 1)
            yield from objects("meet_objects", turns)
            yield from _marched(
                marching, turns, GOAL_POINT if scene.surface.search == "steps" else GOAL_SURFACE
            )
        else:
            yield from _marched(marching, 1, GOAL_SURFACE)
            if within:
                yield from _marched(inside_kernels(scene, plan), 1, GOAL_SURFACE, bounce)
        yield from objects("look_at_objects", turns + within)
        kernel = "join_points" if of_points else "find_interactions"
        yield stage(kernel, turns, bounce=bounce, next_turns=after)
        yield from when(has_wide_lights(scene), stage("send_to_lights", bounce=bounce, next_turns=after))
        air = air_turns(scene) if bounce == 0 else 0
        # Behind the rays for light.
        yield from when(air, stage("send_air", next_turns=1 if paths else after))
        if air and seeks_in_air(scene):
            yield from sought("gather_sought_air", 1 + air, bounce)
        yield from asked_formula(bounce)
        yield from when(scene.cut_planes and bounce == 0 and not paths, stage("find_planes"))
        yield from when(scene.glow is not None, stage("add_glow", bounce=bounce))
        yield from when(scene.mist is not None and bounce == 0, stage("find_mist"))
        if paths:
            yield from when(has_media(scene), stage("cross_media", 1, bounce=bounce))
            yield from asked_material(bounce)
            bent = chain_rays(scene) if has_bent_light(scene) else 0
            last_turn = 1 + air + bent
            yield from when(
                bent,
                stage(
                    "bend_shapes" if has_shot_bodies(scene) else "bend_light",
                    bounce=bounce,
                    next_turns=1 + air,
                ),
            )
            scatter = "scatter_costly" if has_costly(scene) else "scatter_paths"
            yield stage(scatter, 1, bounce=bounce, next_turns=last_turn)
            yield from when(
                clouds_of(scene), stage("walk_clouds", 1, bounce=bounce), stage("pass_clouds", bounce=bounce)
            )
            yield from when(scene.cut_planes and bounce == 0, stage("find_planes"))
            yield from objects("meet_objects", last_turn)
            yield from _marched(marching, last_turn, GOAL_SHADOW)
            yield from when(air, stage("gather_air", 1 + air, next_turns=1))
            if seeks:
                yield from sought("gather_sought", last_turn, bounce)
            yield stage("gather_paths", 1 + air, bounce=bounce, next_turns=1 + air)
            continue
        if after + air > 0:
            yield from objects("meet_objects", after + air)
            yield from _marched(marching, after + air, GOAL_SHADOW)
        yield from when(air, stage("gather_air", after + air, next_turns=after))
        yield from when(meets_lights(scene), stage("meet_lights", bounce=bounce))
        yield from when(has_wide_lights(scene), stage("gather_light", after + air, bounce=bounce))
        yield stage("light_interactions", after + air, bounce=bounce)
    if paths:
        yield from objects("meet_objects", 1)
        yield from _marched(marching, 1, GOAL_SURFACE if seeks else GOAL_SHADOW)
        yield from when(has_media(scene), stage("cross_media", 1, bounce=last + 1))
        if seeks:
            yield from objects("look_at_objects", 1)
            yield stage("find_last", 1, bounce=last + 1)
            yield from (*asked_formula(last + 1), *asked_material(last + 1))
        ends = "end_bent_shapes" if has_shot_bodies(scene) else "end_bent_light"
        yield from when(has_bent_light(scene), stage(ends, 1, bounce=last + 1))
        yield from when(seeks, stage("end_sought", 1, bounce=last + 1))
        yield stage("end_paths", 1, bounce=last + 1)


def _marched(
    kernels: tuple[str, ...], turns: int, goal: int, bounce: int = 0, first: int = 0
) -> Iterator[Stage]:
    """The march of so many turns from the first one on."""
    if not kernels:
        return
    numbers = {"goal": goal, "bounce": bounce, "next_turns": first}
    yield Stage(kernels[0], OVER[kernels[0]], turns, numbers)
    if len(kernels) > 1 and goal in (GOAL_SURFACE, GOAL_POINT):
        yield Stage(kernels[1], OVER[kernels[1]], turns, {"next_turns": first})
