"""The scene's `animation`: how long its film is, and which values move, by keys, an expression or a table."""

import re
from collections.abc import Mapping
from typing import Annotated, Any, Literal, TypeAlias

from pydantic import Discriminator, Field, Tag, WithJsonSchema

from clfractal.scene.deep import DECIMAL_SCHEMA, LARGEST_MAGNIFICATION, ExactPosition
from clfractal.schema.base import Number, Section, chosen_by_list, problem, rule
from clfractal.schema.hex_color import AlsoAs

MAX_FRAMES = 1_000_000
MAX_KEYS = 10_000
MAX_TRACKS = 1_000

Interpolation: TypeAlias = Literal["hold", "linear", "smooth", "ease", "ease_in", "ease_out", "bezier"]
Share = Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)]
Beyond = Annotated[float, Field(strict=True, ge=-10, le=10, allow_inf_nan=False)]
Moment = Annotated[float, Field(strict=True, ge=0, le=MAX_FRAMES, allow_inf_nan=False)]
Text = Annotated[str, Field(strict=True, min_length=1, max_length=10_000)]
# (A magnification may be as large.)
Magnitude = Annotated[
    float, Field(strict=True, ge=-LARGEST_MAGNIFICATION, le=LARGEST_MAGNIFICATION, allow_inf_nan=False)
]


# At least one of them is text.
_EXACT = {
    "type": "array",
    "prefixItems": [DECIMAL_SCHEMA] * 3,
    "minItems": 3,
    "maxItems": 3,
    "contains": {"type": "string"},
}


def _shape(value: Any) -> str:
    if not isinstance(value, (list, tuple)):
        return "one"
    return "exact" if any(isinstance(each, str) for each in value) else "several"


Value = Annotated[
    Annotated[Magnitude, Tag("one")]
    | Annotated[
        tuple[Magnitude, ...],
        Field(strict=False, min_length=2, max_length=16),
        Tag("several"),
    ]
    | Annotated[ExactPosition, Tag("exact"), WithJsonSchema(_EXACT)],
    Discriminator(_shape),
]
Texts = Annotated[
    Annotated[Text, Tag("one")]
    | Annotated[tuple[Text, ...], Field(strict=False, min_length=2, max_length=16), Tag("several")],
    Field(discriminator=chosen_by_list("several", "one")),
]
EASES: Mapping[str, tuple[float, float, float, float]] = {
    "linear": (0.0, 0.0, 1.0, 1.0),
    "ease": (0.42, 0.0, 0.58, 1.0),
    "ease_in": (0.42, 0.0, 1.0, 1.0),
    "ease_out": (0.0, 0.0, 0.58, 1.0),
}
"""Handles of the interpolations that are Bezier curves, as for `Key.handles`."""


class Key(Section):
    """A value at a time; exactly one of frame and time."""

    frame: Moment | None = Field(None, description="number of the frame, counted from 0")
    time: Moment | None = Field(None, description="seconds from the first frame")
    value: Value = Field(description="the value then")
    interpolation: Interpolation | None = Field(
        None, description="the way from this key to the next; null: the track's"
    )
    handles: Annotated[tuple[Share, Beyond, Share, Beyond], Field(strict=False)] | None = Field(
        None,
        description="for bezier: the inner points of a curve from (0, 0), this key, to (1, 1), the next: x1, y1, x2, y2",
    )

    @rule
    def _once(self) -> None:
        if (self.frame is None) == (self.time is None):
            raise problem("needs frame or time" if self.frame is None else "needs one of frame and time")
        if self.handles is not None and self.interpolation not in (None, "bezier"):
            raise problem(f"applies to bezier, not to {self.interpolation}", "handles")

    @property
    def values(self) -> tuple[float, ...]:
        """The value as a tuple; an exact place rounded."""
        return tuple(map(float, self.value)) if isinstance(self.value, tuple) else (self.value,)

    @property
    def texts(self) -> tuple[str, ...]:
        """The same with all digits."""
        parts = self.value if isinstance(self.value, tuple) else (self.value,)
        return tuple(part if isinstance(part, str) else repr(part) for part in parts)

    @property
    def is_exact(self) -> bool:
        """Whether it is told by text of any number of digits."""
        return isinstance(self.value, tuple) and isinstance(self.value[0], str)


class Track(Section):
    """One value that moves: by keys, by an expression of the time, or by a column of a table."""

    keys: Annotated[tuple[Key, ...], Field(strict=False, min_length=1, max_length=MAX_KEYS)] | None = Field(
        None, description="values in order of time"
    )
    expression: Texts | None = Field(
        None, description="of `frame` (from 0), `t` (seconds) and `u` (0 to 1); a list for several numbers"
    )
    file: Text | None = Field(
        None, description="a CSV table in the scene's folder or below, with a row for each frame"
    )
    column: Texts | None = Field(
        None, description="name of the table's column; a list of names for several numbers"
    )
    factor: Number = Field(1.0, description="of the table's numbers: the value is offset + factor * number")
    offset: Number = Field(0.0, description="of the table's numbers: the value where they are 0")
    interpolation: Interpolation = Field("smooth", description="the way from key to key")
    repeat: Literal["none", "loop", "ping_pong"] = Field(
        "none", description="what follows the last key: its value, the keys again, or the keys backwards"
    )
    around_target: bool | None = Field(
        None,
        description="of a camera's position: direction and distance from the target move, not the place; null: if smooth",
    )

    @rule
    def _one_source(self) -> None:
        given = [name for name in ("keys", "expression", "file") if getattr(self, name) is not None]
        if len(given) != 1:
            got = f", got {' and '.join(given)}" if given else ""
            raise problem(f"needs one of keys, expression and file{got}")
        if (self.file is None) != (self.column is None):
            raise problem("needs file and column together", "column" if self.file is None else "file")

    @rule
    def _in_one_shape(self) -> None:
        for index, key in enumerate(self.keys or ()):
            assert self.keys is not None
            if len(key.values) != len(self.keys[0].values):
                many = len(self.keys[0].values)
                what = "a number" if many == 1 else f"a list of {many} numbers"
                raise problem(f"must be {what}, as that of the first key", ("keys", index, "value"))
            last = index == len(self.keys) - 1
            if (key.interpolation or self.interpolation) == "bezier" and key.handles is None and not last:
                raise problem("needs handles: [x1, y1, x2, y2], as for bezier", ("keys", index))


def _with_unit(units: Mapping[str, tuple[float, float]], wanted: str) -> AlsoAs:
    """A number may have one of some units, each with its factor and divisor: `4 s`, `1.5 min`, `180 deg`."""
    form = re.compile(rf"\s*([0-9]+(?:\.[0-9]*)?|\.[0-9]+)\s*({'|'.join(units)})\s*")

    def read(value: Any) -> Any:
        if not isinstance(value, str):
            return value
        found = form.fullmatch(value)
        if found is None:
            raise problem(f"must be {wanted}, got {value[:40]!r}")
        factor, divisor = units[found[2]]
        return float(found[1]) * factor / divisor

    return AlsoAs(read, {"type": "string", "pattern": f"^{form.pattern}$"})


Duration = Annotated[
    Annotated[float, Field(strict=True, gt=0, le=1e6, allow_inf_nan=False)],
    _with_unit({"s": (1, 1), "min": (60, 1)}, "seconds, as 4 or '4 s', or '2 min'"),
]
Opening = Annotated[
    Annotated[float, Field(strict=True, ge=0, le=1, allow_inf_nan=False)],
    _with_unit({"deg": (1, 360), "degrees": (1, 360)}, "a part of a frame, as 0.5, or '180 deg'"),
]
Tracks = Annotated[dict[Text, Track], Field(max_length=MAX_TRACKS)]


class Animation(Section):
    """How a scene moves: its film's length, and the values that change from frame to frame."""

    fps: Annotated[float, Field(strict=True, ge=0.01, le=1000, allow_inf_nan=False)] = Field(
        30.0, description="frames per second"
    )
    frames: Annotated[int, Field(strict=True, ge=1, le=MAX_FRAMES)] | None = Field(
        None, description="number of frames; give this or duration"
    )
    duration: Duration | None = Field(None, description="seconds, such as 4 or '4 s'; give this or frames")
    loop: bool = Field(False, description="whether the film begins again after its end, without a seam")
    noise: Literal["new", "fixed"] = Field(
        "new", description="whether each frame has random places of its own, or all have the same"
    )
    shutter: Opening = Field(
        0.0,
        description="motion blur: how long each picture is exposed, as a part of a frame, or in degrees of a turning "
        "shutter, as '180 deg'; 0: one moment",
    )
    frame: Moment | None = Field(
        None, description="the frame that a still of the scene shows; null: the scene's own values"
    )
    tracks: Tracks = Field(
        {}, description="values that move, by their dotted keys, such as `camera.position`"
    )

    @rule
    def _has_a_length(self) -> None:
        if (self.frames is None) == (self.duration is None):
            raise problem("needs one of frames and duration")
        if self.duration is not None and self.duration * self.fps > MAX_FRAMES:
            raise problem(f"must be at most {MAX_FRAMES:,} frames", "duration")
        if self.frame is not None and self.frame > self.count - (not self.loop):
            raise problem(f"must be one of the frames 0 to {self.count - 1}, got {self.frame:g}", "frame")

    @rule
    def _in_order(self) -> None:
        for name, track in self.tracks.items():
            keys = track.keys or ()
            for index in range(1, len(keys)):
                before, after = (self.frame_of(key) for key in keys[index - 1 : index + 1])
                if after <= before:
                    word = "at the same time as" if after == before else "before"
                    raise problem(
                        f"must come after the key before it: frame {after:g} is {word} frame {before:g}",
                        ("tracks", name, "keys", index),
                    )

    @property
    def count(self) -> int:
        """The number of frames."""
        if self.frames is not None:
            return self.frames
        assert self.duration is not None
        return max(round(self.duration * self.fps), 1)

    def frame_of(self, key: Key) -> float:
        """The place of a key, in frames."""
        if key.frame is not None:
            return key.frame
        assert key.time is not None
        found = key.time * self.fps
        # Seconds are rounded: a cut at 0.28 s is at frame 7 of 25 a second.
        return float(round(found)) if abs(found - round(found)) < 1e-6 else found
