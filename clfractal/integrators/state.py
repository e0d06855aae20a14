"""Where the pixels of a wave keep what they carry from stage to stage: what is kept, and who needs it.

`state.h` keeps and recalls it by the names of PARTS. Where it is kept is data of a launch, so that programs know
nothing of what a scene has, and what that does not need takes no memory.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from itertools import accumulate

from clfractal.geometry.planes import has_faces
from clfractal.integrators.passes import has_cryptomatte, has_parts
from clfractal.integrators.path_state import (
    AOVS,
    BENT,
    COUNTERS,
    CRYPTOMATTE,
    DIRECT_LIGHT,
    FACE,
    FACET,
    FILM_SAMPLE,
    FLIGHT,
    HALT,
    INTERACTION_SEEN,
    INTERACTION_THING,
    LAYERS,
    LENS_SAMPLE,
    LIGHT_BEFORE,
    MIST,
    PARTS_OF_LIGHT,
    PATH,
    PIXEL,
    RELIEF,
    SIGHTING,
    SOUGHT,
    START,
    TOUCH,
    WITHIN,
)
from clfractal.integrators.plan import Plan
from clfractal.integrators.records import bounces
from clfractal.integrators.waves import (
    finds_materials,
    has_bent_light,
    has_cones,
    has_lens,
    has_media,
    has_wide_lights,
    meets_lights,
)
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.model import Scene
from clfractal.shading.air_lights import air_turns, seeks_in_air, wide_air_turns
from clfractal.shading.emitters import seeks_light
from clfractal.shading.maps import asked_maps, bump_numbers, has_bump, has_glass, has_participating_media
from clfractal.shading.materials import matter_numbers


@dataclass(frozen=True, slots=True)
class Part:
    """Something of the state: numbers of one, and how many a scene needs."""

    name: str
    numbers: int
    many: Callable[[Scene, Plan], int]


def along_paths(scene: Scene) -> bool:
    """Whether light is followed along paths."""
    return isinstance(scene.lighting, PathLighting)


def _goes_on(scene: Scene) -> bool:
    return along_paths(scene) or bounces(scene) > 0


def _tells_things(scene: Scene, plan: Plan) -> bool:
    """Whether interactions know more than how they look."""
    by_quantity = scene.coloring.kind.known != "at_hit"
    return by_quantity or bool(scene.objects) or has_cryptomatte(plan) or has_faces(scene)


def normal_count(scene: Scene) -> int:
    """Normals over which a pixel's shading is averaged."""
    renderer = scene.surface
    if not renderer.normal_of_points:
        return renderer.used_points.count
    return 8 if renderer.normal == "eight_triangles_shading" else 1


PARTS = (
    Part("FILM_SAMPLE", FILM_SAMPLE.numbers, lambda scene, plan: 1),
    Part("LENS_SAMPLE", LENS_SAMPLE.numbers, lambda scene, plan: int(has_lens(scene) or plan.moving)),
    Part("SIGHTING", SIGHTING.numbers, lambda scene, plan: 1),
    Part("COUNTERS", COUNTERS.numbers, lambda scene, plan: 1),
    Part("SUMS", PIXEL.numbers, lambda scene, plan: 1),
    Part("START", START.numbers, lambda scene, plan: int(has_cones(scene, plan))),
    Part("TOUCH", TOUCH.numbers, lambda scene, plan: int(scene.surface.used_points.count > 1)),
    # The first interaction, and the one after the last bounce.
    Part("INTERACTION_SEEN", INTERACTION_SEEN.numbers, lambda scene, plan: 1 + _goes_on(scene)),
    Part(
        "INTERACTION_THING",
        INTERACTION_THING.numbers,
        lambda scene, plan: (1 + _goes_on(scene)) * _tells_things(scene, plan),
    ),
    Part("FACET", FACET.numbers, lambda scene, plan: normal_count(scene) if normal_count(scene) > 1 else 0),
    Part("PATH", PATH.numbers, lambda scene, plan: int(_goes_on(scene))),
    Part("DIRECT_LIGHT", DIRECT_LIGHT.numbers, lambda scene, plan: int(along_paths(scene))),
    Part("WITHIN", WITHIN.numbers, lambda scene, plan: int(has_glass(scene))),
    Part("FLIGHT", FLIGHT.numbers, lambda scene, plan: int(has_participating_media(scene))),
    Part("HALT", HALT.numbers, lambda scene, plan: int(has_media(scene))),
    Part("BENT", BENT.numbers, lambda scene, plan: int(has_bent_light(scene))),
    Part("SOUGHT", SOUGHT.numbers, lambda scene, plan: int(seeks_light(scene) or seeks_in_air(scene))),
    # What rays to wide lights have brought, and lights that are before the interaction.
    Part("GATHERED", 3, lambda scene, plan: int(has_wide_lights(scene))),
    Part("LIGHT_BEFORE", LIGHT_BEFORE.numbers, lambda scene, plan: int(meets_lights(scene))),
    # The sum, and what is awaited of turns whose light has a colour of its own.
    Part("AIR", 3, lambda scene, plan: int(air_turns(scene) > 0) + wide_air_turns(scene)),
    Part("GLOW", 3, lambda scene, plan: int(scene.glow is not None)),
    Part("MIST", MIST.numbers, lambda scene, plan: int(scene.mist is not None)),
    # What the formula was asked for the present interaction's material; and the same around it, with the normal and escape
    # count there, for the slopes of its material's relief (`kernels/shading/bump_places.h`).
    Part("ASKED", 1, lambda scene, plan: len(asked_maps(scene))),
    Part("BESIDE", 1, lambda scene, plan: bump_numbers(scene)),
    # The present interaction's material, where one has to be found.
    Part("MATTER", matter_numbers(), lambda scene, plan: int(finds_materials(scene))),
    Part("RELIEF", RELIEF.numbers, lambda scene, plan: int(has_bump(scene))),
    Part("FACE", FACE.numbers, lambda scene, plan: int(has_faces(scene))),
    Part("LAYERS", LAYERS.numbers, lambda scene, plan: int(bool(scene.cut_planes))),
    Part("AOVS", AOVS.numbers, lambda scene, plan: int(has_parts(plan))),
    Part("PARTS", PARTS_OF_LIGHT.numbers, lambda scene, plan: int(has_parts(plan))),
    Part("CRYPTOMATTE", CRYPTOMATTE.numbers, lambda scene, plan: int(has_cryptomatte(plan))),
)


def state_places(scene: Scene, plan: Plan) -> list[int]:
    """For each of PARTS the first of its numbers among those of a pixel; -1 where the scene needs none."""
    counts = [part.many(scene, plan) * part.numbers for part in PARTS]
    return [
        first if count else -1 for first, count in zip(accumulate(counts, initial=0), counts, strict=False)
    ]


def state_numbers(scene: Scene, plan: Plan) -> int:
    """Numbers of a pixel that are kept between stages."""
    return sum(part.many(scene, plan) * part.numbers for part in PARTS)


def state_text() -> str:
    """The numbers of PARTS, for C."""
    return "".join(f"#define STATE_{part.name} {number}\n" for number, part in enumerate(PARTS))
