"""Keys that every renderer has: the samples of a pixel, how they are combined, and the number type."""

from collections.abc import Mapping
from typing import Annotated, Any, ClassVar, Literal

from pydantic import Field

from clfractal.schema.base import problem, rule
from clfractal.schema.fields import Usual
from clfractal.schema.kinds import Element

# The default of `min_samples`: fewer samples do not show how much a pixel's samples scatter.
USUAL_MIN_SAMPLES = 16


class Sampled(Element):
    """Samples, their filter, and the number type: what every renderer has.

    A renderer's kernel is the `KERNEL` of the file in `clfractal/integrators` that has the name of its tag.

    Attributes:
        first: values that the window begins with.
        is_flat: whether all that it shows lies in one plane, which other planes cannot cut.
        has_own_colors: whether what it shows has colours of its own, in the place of the coloring's palette.
        shows_every_object: whether it shows those, too, that only rays can be sent for.
    """

    first: ClassVar[Mapping[str, Any]] = {}
    is_flat: ClassVar[bool] = False
    has_own_colors: ClassVar[bool] = False
    shows_every_object: ClassVar[bool] = False

    samples: Annotated[int, Usual(1, 1024)] = Field(
        1, ge=1, le=65_536, description="rays per pixel; with `noise` their maximum number"
    )
    noise: Annotated[float, Field(strict=True, gt=0, le=1), Usual(0.001, 0.1)] | None = Field(
        None,
        description="a pixel gets no more samples once its standard error is below this; null: it gets all",
    )
    min_samples: Annotated[int, Field(strict=True, ge=4, le=65_536), Usual(4, 256)] | None = Field(
        None, description="samples before the noise of a pixel is judged; null: 16, or all if fewer"
    )
    filter: Literal["box", "tent", "blackman_harris"] = Field(
        "box", description="how samples are spread around a pixel's middle"
    )
    filter_width: Annotated[float, Field(strict=True, ge=0.1, le=16), Usual(0.5, 6)] | None = Field(
        None, description="the filter's width, pixels; null: box 1, tent 2, blackman_harris 3"
    )
    seed: int = Field(
        0, ge=0, le=2**32 - 1, description="number that selects the random places of samples, points and rays"
    )
    precision: Literal["auto", "float32", "float64"] = Field(
        "auto", description="number type; auto: float64 where pixels are too fine for float32"
    )

    @rule
    def _enough_samples(self) -> None:
        if self.noise is not None and self.min_samples is not None and self.min_samples > self.samples:
            raise problem(f"must be at most samples ({self.samples}), got {self.min_samples}", "min_samples")

    @property
    def used_min_samples(self) -> int:
        """Samples before the noise of a pixel is judged, never more than `samples`."""
        wanted = USUAL_MIN_SAMPLES if self.min_samples is None else self.min_samples
        return min(wanted, self.samples)
