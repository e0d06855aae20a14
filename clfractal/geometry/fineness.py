"""How finely a picture shows the set: what belongs to the scene, and what to the number of pixels."""

from __future__ import annotations

from dataclasses import dataclass

from clfractal.scene.model import Scene

# In cones of the reference's pixels: the distance at which light is computed. Nearer, rough surfaces are noise; farther
# off, the picture would no longer be that of the set.
NEAR = 0.6
# Of `detail`: paths whose rays find the surface to this part and less have light so near to it that this place is the hit,
# and its gradient the normal; there light is computed nearer.
FINE, FINE_NEAR = 0.05, 0.3


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
        fine: whether `level` is so much finer than the reference's pixels that they show nothing nearer.
    """

    pixel: float
    level: float
    detail: float
    near: float
    fine: bool

    @classmethod
    def of(cls, scene: Scene, divider: int = 1) -> Fineness:
        """That of a scene's picture; one of `divider` x `divider` of its pixels."""
        own, level = scene.image.reference / scene.image.height, scene.hit_detail
        exact = min(level, scene.surface.detail * own)
        fine = level <= FINE * scene.surface.detail
        return cls(own * divider, level, exact, (FINE_NEAR if fine else NEAR) * level / exact, fine)

    @property
    def lands(self) -> bool:
        """Whether rays go on from where light is computed to the solid: for very large prints they do."""
        return not self.fine or self.detail < self.level
