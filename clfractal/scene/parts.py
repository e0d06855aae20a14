"""The parts of a scene around its formula: picture, camera, material, background and output.

Each kind of camera, renderer or light (chosen by `projection` or `type`) is a class and an entry in a union; to add a
kind, write its class and add it to the union.
"""

from math import radians, tan
from typing import Annotated, Any, Literal, Self, TypeAlias

from pydantic import AfterValidator, BeforeValidator, Field, Tag

from clfractal.files.channels import CHANNELS, DEFAULT_CHANNELS, ID_CHANNELS, LAYERS, unknown_channel
from clfractal.files.tone_names import Tone
from clfractal.scene.camera_base import CameraBase
from clfractal.schema.base import (
    Amount,
    ChosenBy,
    Color,
    Fraction,
    Reflectance,
    Section,
    chosen_by_word,
    length,
    minus,
    problem,
    rule,
)
from clfractal.schema.fields import SCALE, Usual
from clfractal.schema.hex_color import COLOR_SCHEMA, AlsoAs, is_hex, listed
from clfractal.schema.names import MaterialName

MAX_SIDE = 65_536
MAX_PIXELS = 2**30


class Image(Section):
    """Size of the picture in pixels, and the size that what it shows is made for."""

    width: int = Field(1024, ge=1, le=MAX_SIDE, description="pixels")
    height: int = Field(1024, ge=1, le=MAX_SIDE, description="pixels")
    reference_height: Annotated[float, Field(strict=True, gt=0, le=MAX_SIDE)] | None = Field(
        None,
        description="height of the picture in whose pixels the fineness of colours, normals and light is measured, whatever"
        " size is rendered; null: `height`",
    )

    @rule
    def _bounded(self) -> None:
        if self.width * self.height > MAX_PIXELS:
            raise problem(f"must be at most {MAX_PIXELS:,} pixels, got {self.width} x {self.height}")

    @property
    def reference(self) -> float:
        """The height in whose pixels the fineness of colours, normals and light is measured."""
        return float(self.height) if self.reference_height is None else self.reference_height

    def resized(self, width: int, height: int) -> Self:
        """The same picture with another number of pixels: what it shows stays as it is."""
        return self._with(width, height, self.reference)

    def part(self, width: int, height: int) -> Self:
        """A part of the picture with the size of this one's pixels, such as a view of a layout."""
        return self._with(width, height, self.reference * height / self.height)

    def _with(self, width: int, height: int, reference: float) -> Self:
        # (Sizes of windows and screens are not the user's mistakes.)
        own = None if reference == height else reference
        return self.model_copy(update={"width": width, "height": height, "reference_height": own})


class PerspectiveCamera(CameraBase):
    """All rays leave one point."""

    tag = "perspective"
    projection: Literal["perspective"] = "perspective"
    fov: Annotated[float, Usual(5, 120), SCALE] = Field(
        45.0, ge=1e-6, lt=180, description="vertical angle of view, degrees"
    )
    f_number: Annotated[float, Field(strict=True, ge=0.01, le=1e6), Usual(0.5, 64), SCALE] | None = Field(
        None, description="focal length divided by the lens's diameter; null: a pinhole, all is sharp"
    )
    # Its lower bound is checked below, to say what is wrong with a negative one.
    focus_distance: (
        Annotated[float, Field(strict=True, le=1e6, json_schema_extra={"exclusiveMinimum": 0}), SCALE] | None
    ) = Field(
        None, description="distance that is sharp, along the view axis, scene units; null: the target's"
    )
    focus: Literal["auto"] | None = Field(
        None, description="auto: what lies at focus_on is sharp; the distance is measured first"
    )
    focus_on: Annotated[tuple[Fraction, Fraction], Field(strict=False)] | None = Field(
        None,
        description="place in the picture that is to be sharp, as parts of its width and height from the top left;"
        " null: the middle, with `focus: auto`",
    )
    sensor_height: Annotated[float, Field(strict=True, gt=0, le=1e6)] = Field(
        0.024,
        description="height of the sensor behind the lens, scene units; by default 24 mm if they are metres",
    )

    @rule
    def _focus_in_front(self) -> None:
        if self.focus_distance is not None and self.focus_distance <= 0:
            raise problem(
                f"must be in front of the camera: above 0, got {self.focus_distance:g}", "focus_distance"
            )

    @rule
    def _focus_once(self) -> None:
        if self.measured_focus is not None and self.focus_distance is not None:
            key = "focus_on" if self.focus_on is not None else "focus"
            raise problem("measures the distance that is sharp; remove it, or focus_distance", key)

    @property
    def measured_focus(self) -> tuple[float, float] | None:
        """The place in the picture whose distance is to be measured, as of `focus_on`; None if none is."""
        if self.focus is None:
            return self.focus_on
        return self.focus_on if self.focus_on is not None else (0.5, 0.5)

    @property
    def used_focus_distance(self) -> float:
        """The distance that is sharp, along the view axis, scene units; by default the target's."""
        if self.focus_distance is not None:
            return self.focus_distance
        return length(minus(self.target, self.position))

    @property
    def lens_radius(self) -> float:
        """Half the lens's diameter, scene units; 0 for a pinhole."""
        if self.f_number is None:
            return 0.0
        focal_length = self.sensor_height / (2 * tan(radians(self.fov) / 2))
        return focal_length / self.f_number / 2


class OrthographicCamera(CameraBase):
    """All rays are parallel."""

    tag = "orthographic"
    projection: Literal["orthographic"] = "orthographic"
    height: Annotated[float, SCALE] = Field(
        3.0, ge=1e-12, le=1e6, description="height of the picture, scene units"
    )


AnyCamera: TypeAlias = PerspectiveCamera | OrthographicCamera
Camera = Annotated[
    Annotated[PerspectiveCamera, Tag("perspective")] | Annotated[OrthographicCamera, Tag("orthographic")],
    ChosenBy("projection", "perspective"),
]


class Material(Section):
    """How the surface reflects light: the thesis's Phong model (Eq. 5), or along paths one of the scene's `materials`."""

    name: MaterialName | None = Field(
        None, description="one of `materials`, for `lighting: {mode: path}`; null: the keys below"
    )
    color: Reflectance = Field(
        (0.8, 0.7, 0.6), description="linear Rec. 709; replaced by a coloring other than solid"
    )
    ambient: Annotated[Amount, Usual(0, 1)] = Field(
        0.1, description="part of each light that reaches everywhere, shadows too"
    )
    diffuse: Annotated[Amount, Usual(0, 1)] = Field(0.9, description="part of the light that is scattered")
    specular: Annotated[Amount, Usual(0, 1)] = Field(
        0.3, description="part of the light that is mirrored as a highlight"
    )
    shininess: Annotated[float, Usual(1, 1000)] = Field(
        30.0, ge=0.1, le=1e5, description="exponent of the highlight"
    )
    reflection: Fraction = Field(0.0, description="part of the surroundings that is mirrored sharply")


class Gradient(Section):
    """The background behind the set, from the top of the picture to its bottom."""

    tag = "gradient"
    top: Color = Field((0.25, 0.35, 0.5), description="linear Rec. 709")
    bottom: Color = Field((0.02, 0.02, 0.03), description="linear Rec. 709")


def _known_channel(name: str) -> str:
    if name not in CHANNELS:
        if name in LAYERS:
            raise problem(f"{name!r} is a layer; name its channels, {', '.join(LAYERS[name])}")
        raise problem(unknown_channel(name))
    return name


def _without_layers(names: Any) -> Any:
    """Channels in the place of the layers that they are parts of."""
    if not isinstance(names, (list, tuple)) or not any(str(name) in LAYERS for name in names):
        return names
    chosen: list[Any] = []
    for index, name in enumerate(names):
        for each in LAYERS.get(str(name), (name,)):
            if each in chosen:
                raise problem(f"channel {each!r} is given twice", str(index))
            chosen.append(each)
    return chosen


ChannelName = Annotated[
    str,
    Field(strict=True, max_length=100, json_schema_extra={"enum": list(CHANNELS)}),
    AfterValidator(_known_channel),
]


Stops = Annotated[float, Field(ge=-100, le=100)]
Exposure = Annotated[
    Annotated[Stops, Tag("stops")] | Annotated[Literal["auto"], Tag("auto")],
    Field(discriminator=chosen_by_word("auto", "stops")),
]


def _with_layers(schema: dict[str, Any]) -> None:
    schema["items"] = {**schema["items"], "enum": [*CHANNELS, *LAYERS]}


class Output(Section):
    """What the picture files contain."""

    exposure: Annotated[Exposure, Usual(-5, 5)] = Field(
        0.0,
        description="stops: colours on a screen are multiplied by 2**exposure; auto: chosen by a quick look at the scene",
    )
    tone: Tone = Field(
        "linear", description="the curve from light to what a screen shows: linear, reinhard or agx"
    )
    channels: Annotated[
        tuple[ChannelName, ...],
        Field(strict=False, min_length=1, max_length=64, json_schema_extra=_with_layers),
        BeforeValidator(_without_layers),
    ] = Field(DEFAULT_CHANNELS, description="names of the channels of an EXR, or of layers of them")
    precision: dict[ChannelName, Literal["half", "float"]] = Field(
        default_factory=dict,
        description="half or float for those channels of an EXR that are not stored as by default",
    )
    denoise: bool = Field(
        False, description="whether Open Image Denoise takes the noise out of the finished picture"
    )
    png_bits: Literal[8, 16] = Field(8, description="bits per channel of a PNG")

    quality: int = Field(
        90,
        ge=1,
        le=100,
        description="of a JPEG or WebP: the more, the finer and larger; 100: a lossless WebP",
    )

    @rule
    def _different(self) -> None:
        for index, channel in enumerate(self.channels):
            if channel in self.channels[:index]:
                raise problem(f"channel {channel!r} is given twice", f"channels.{index}")
        for name, stored in self.precision.items():
            if name in ID_CHANNELS and stored == "half":
                raise problem("must be float: numbers of things are exact", f"precision.{name}")

    @property
    def stops(self) -> float:
        """The exposure as a number; 0 as long as `auto` has not been measured."""
        return 0.0 if isinstance(self.exposure, str) else self.exposure

    @property
    def half_channels(self) -> frozenset[str]:
        """The channels that an EXR stores with 16 bits."""
        return frozenset(
            name
            for name, channel in CHANNELS.items()
            if self.precision.get(name, channel.precision) == "half"
        )


def _one_color(value: Any) -> Any:
    """A colour alone stands for a gradient that is the same everywhere."""
    if is_hex(value) or value is None:
        value = listed(value)
    return {"top": value, "bottom": value} if isinstance(value, (list, tuple)) else value


Background = Annotated[
    Annotated[
        Annotated[Gradient, Tag("gradient")] | Annotated[Literal["transparent"], Tag("transparent")],
        chosen_by_word("transparent", "gradient"),
    ],
    AlsoAs(_one_color, COLOR_SCHEMA),
]
