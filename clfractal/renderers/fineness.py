"""How finely a picture shows the set: what belongs to the scene, and what to the number of pixels that is rendered."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.scene.model import Scene

# In cones of the reference's pixels: the distance at which light is computed. Nearer, rough surfaces are noise; farther
# off, the picture would no longer be that of the set.
NEAR = 0.6


@dataclass(frozen=True, slots=True)
class Fineness:
    """How finely rays look for the set, and how the light on it is computed, in footprints of the image's reference.

    A picture shows what its reference shows, however many pixels it has. Where these are smaller than the reference's,
    rays hit more exactly, and light stays as it is; where they are larger, rays hit as the reference's do, since light is
    computed near there.

    Attributes:
        pixel: width of a pixel of the picture; of a coarse one that of the block it stands for.
        level: what is told in cones where light is computed: `detail` of the scene, of which paths take a part.
        detail: the distance that counts as a hit.
        near: the distance at which light is computed, as a part of `detail`.
    """

    pixel: float
    level: float
    detail: float
    near: float

    @classmethod
    def of(cls, scene: Scene, divider: int = 1) -> Fineness:
        """That of a scene's picture; one of `divider` x `divider` of its pixels."""
        own, level = scene.image.reference / scene.image.height, scene.hit_detail
        exact = min(level, scene.surface.detail * own)
        return cls(own * divider, level, exact, NEAR * level / exact)
