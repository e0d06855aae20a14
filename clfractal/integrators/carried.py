"""What is carried from stage to stage, and summed over shots: structs of reals, each declared here once."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from clfractal.files.channels import MATTE_RANKS

Kind = Literal["real", "vec", "color"]
_NUMBERS: dict[Kind, int] = {"real": 1, "vec": 3, "color": 3}


@dataclass(frozen=True, slots=True)
class Member:
    """A number, a vector or a colour (linear Rec. 709) of a thing that is carried, or `count` of them.

    Masks are kept as 1 or 0.
    """

    kind: Kind
    name: str
    meaning: str = ""
    count: int = 0


@dataclass(frozen=True, slots=True)
class Carried:
    """Something that is carried, as a struct in C."""

    name: str
    meaning: str
    members: tuple[Member, ...]

    @property
    def numbers(self) -> int:
        """How many numbers it has."""
        return sum(_NUMBERS[member.kind] * max(member.count, 1) for member in self.members)

    def c_text(self) -> str:
        """Its declaration."""
        lines = [f"// {self.meaning}", "typedef struct {"]
        for member in self.members:
            many = f"[{member.count}]" if member.count else ""
            told = f"  // {member.meaning}" if member.meaning else ""
            lines.append(f"    {member.kind} {member.name}{many};{told}")
        return "\n".join([*lines, f"}} {self.name};", ""])


def _carried(name: str, meaning: str, *members: tuple[Kind, str, str]) -> Carried:
    return Carried(name, meaning, tuple(Member(*member) for member in members))


FILM_SAMPLE = _carried(
    "film_sample",
    "Where the shot goes to in the picture.",
    ("real", "wanted", "whether the pixel takes this sample"),
    ("real", "x", "pixels from the picture's left side ..."),
    ("real", "y", "... and from its top"),
    ("real", "offset", "distance squared from the pixel's middle, pixels"),
)
LENS_SAMPLE = _carried(
    "lens_sample",
    "Where the shot goes through the lens, and when.",
    ("real", "lens_x", "lens radii from its middle"),
    ("real", "lens_y", ""),
    ("real", "time", "while the shutter is open, 0 to 1"),
)
SIGHTING = _carried("sighting", "What was found first.", ("real", "coverage", ""), ("real", "steps", ""))
START = _carried(
    "start_of_rays",
    "Where the pixel's rays begin: so far its block's cone is free.",
    ("real", "t", "distance along its rays, scene units"),
)
TOUCH = _carried(
    "touch",
    "How far the pixel's whole cone is free.",
    ("real", "touched", "whether the set is there"),
    ("real", "t", "distance along its ray, scene units"),
)
COUNTERS = _carried(
    "counters",
    "What rays cost.",
    ("real", "steps", "distance evaluations; of a volume: places looked at"),
    ("real", "count", "applications of the formula"),
    ("real", "bad", "steps that ended inside"),
)
SPOT_SEEN = _carried(
    "spot_seen",
    "A place on the surface, and how it looks.",
    ("real", "found", ""),
    ("vec", "point", "where it is shaded, and rays leave it"),
    ("vec", "seen", "where the ray has met it"),
    ("vec", "normal", "the one that stands for all: shadows, reflections, channel N"),
    ("real", "cone", "the pixel's footprint there"),
    ("real", "smooth", "escape count"),
    ("color", "tint", "of the surface"),
)
SPOT_THING = _carried(
    "spot_thing",
    "Of what thing a spot is, and what chooses its colour.",
    (
        "real",
        "object",
        "its number, from 1; 0: the set; -1: a light that is seen first; or a face's, see planes.h",
    ),
    ("real", "other", "where two solids flow together: the number of the other object ..."),
    ("real", "share", "... and its part of the colour"),
    ("real", "quantity", "what chooses the colour"),
    ("real", "residual", "distance of the pixel's points from their plane, in footprints"),
)
FACET = _carried(
    "facet",
    "One of the normals over which shading is averaged.",
    ("vec", "normal", ""),
    ("real", "weight", ""),
)
RELIEF = _carried(
    "relief",
    "How a spot's relief rises along the surface.",
    ("real", "rises", "whether its material has one"),
    ("vec", "slope", ""),
)
PATH = _carried(
    "path",
    "A path after a bounce.",
    ("vec", "origin", ""),
    ("vec", "direction", ""),
    ("real", "footprint", ""),
    ("real", "spread", ""),
    ("real", "on_path", "whether it goes on"),
    ("color", "through", "part of what comes next that reaches the eye"),
    ("color", "seen", "light so far"),
)
LAMP_BEFORE = _carried(
    "lamp_before",
    "A light that is seen before a spot.",
    ("real", "met", "whether there is one"),
    ("color", "shows", ""),
)
ASKED_LIGHT = _carried(
    "asked_light",
    "What a path awaits of the lights at its last spot.",
    ("color", "awaited", "what one brings, if nothing is in the way of the ray that asks for it"),
    (
        "real",
        "density",
        "per steradian, of the path's direction; below 0 where lights were not asked for at all",
    ),
    ("real", "total", "what all lights weighed at the spot"),
)
WITHIN = _carried(
    "within",
    "The glass that a path is in.",
    ("real", "medium", "by the number of its body, see media.h; 0: the open"),
    ("real", "under", "the glass that this one stands in likewise"),
    ("real", "wave", "the path's place in the spectrum; below 0 while it has all colours"),
    ("color", "extinction", "what the medium absorbs and scatters, per unit of the way"),
)
FLIGHT = _carried(
    "flight",
    "The flight of a path through what scatters light.",
    ("color", "scatters", "the part of the extinction that is scattered"),
    ("real", "anisotropy", "of that, Henyey and Greenstein's g"),
    ("real", "flight", "how far the path goes until it is scattered, if nothing is nearer"),
    ("real", "seed_low", "32 random bits for a walk of its own, as two whole numbers ..."),
    ("real", "seed_high", "... of which this is the higher one"),
)

HALT = _carried(
    "halt",
    "Where a medium has scattered a path before what it had met.",
    ("real", "halted", "which kind of medium has, see state.h; or 0"),
    ("real", "anisotropy", "of a cloud, Henyey and Greenstein's g"),
    ("real", "far", "after spots: how far the ray goes that asks for light; below 0: there is none"),
)


def _whole(name: str, meaning: str, *slices: Carried) -> Carried:
    return Carried(name, meaning, tuple(member for each in slices for member in each.members))


# Things of slices, of which a scene may not need the last ones.
CAMERA_SAMPLE = _whole("camera_sample", "Where the shot goes to.", FILM_SAMPLE, LENS_SAMPLE)
SPOT = _whole("spot", "A place on the surface.", SPOT_SEEN, SPOT_THING)
CARRIED = _whole(
    "carried", "What a path of light carries from a spot to the next.", ASKED_LIGHT, WITHIN, FLIGHT
)
SLICES = {
    CAMERA_SAMPLE: (FILM_SAMPLE, LENS_SAMPLE),
    SPOT: (SPOT_SEEN, SPOT_THING),
    CARRIED: (ASKED_LIGHT, WITHIN, FLIGHT),
}
FACE = _carried(
    "plane_face",
    "Where a plane opens the set on the way to the next spot.",
    ("real", "number", "as a thing, or 0"),
    ("real", "t", "distance along the ray, scene units"),
    ("real", "count", "escape count"),
    ("color", "tint", ""),
    ("vec", "normal", ""),
)
LAYERS = _carried(
    "plane_layers",
    "What planes add to a picture. In front of the object: light, and the part that comes through; behind it the same.",
    ("color", "front", ""),
    ("color", "behind", ""),
    ("real", "front_through", ""),
    ("real", "behind_through", ""),
    (
        "real",
        "nearest",
        "the nearest plane that is seen well, along the ray; the largest number if there is none",
    ),
    ("vec", "normal", ""),
    ("vec", "point", ""),
    ("real", "count", "escape count"),
)
AOVS = _carried(
    "aovs",
    "What a shot knows of its layers before its end.",
    ("color", "albedo", "of the first surface"),
    ("color", "emission", "what the path had seen before any light was reflected ..."),
    ("color", "once", "... and before any was reflected twice"),
    ("vec", "normal", "by which the first surface has scattered light"),
)
# Sums over a pixel's shots.
PIXEL = _carried(
    "pixel",
    "Sums over the shots of a pixel, and what the one nearest to its middle found.",
    ("color", "radiance", ""),
    ("real", "coverage", ""),
    ("real", "shots", ""),
    ("real", "brightness", "of each shot, for its noise ..."),
    ("real", "brightness_square", ""),
    ("real", "coverage_square", ""),
    ("real", "nearest", "distance squared of the kept shot from the middle, pixels"),
    ("real", "depth", "along the view axis, scene units"),
    ("vec", "normal", ""),
    ("vec", "point", ""),
    ("real", "smooth", "escape count"),
    ("real", "steps", "evaluations"),
)
PARTS_OF_LIGHT = _carried(
    "parts",
    "What a shot knows of the first surface, and of its light by how often that was reflected; or sums over shots."
    " Normals count as much as they cover.",
    ("color", "albedo", ""),
    ("color", "emission", ""),
    ("color", "direct", ""),
    ("color", "indirect", ""),
    ("vec", "normal", ""),
)
MATTES = Carried(
    "mattes",
    "Which things a pixel shows. Things that come when all ranks are taken are not noted.",
    (
        Member(
            "real",
            "pairs",
            "of each rank a number from 1, or 0: none; the sum of what it covers",
            2 * MATTE_RANKS,
        ),
        Member("real", "nearest", "the number nearest to the pixel's middle"),
    ),
)
TYPES = (
    COUNTERS,
    PIXEL,
    PARTS_OF_LIGHT,
    MATTES,
    CAMERA_SAMPLE,
    SIGHTING,
    START,
    TOUCH,
    SPOT,
    FACET,
    RELIEF,
    PATH,
    CARRIED,
    HALT,
    LAMP_BEFORE,
    FACE,
    LAYERS,
    AOVS,
)


def carried_text() -> str:
    """The declarations of TYPES in C, for inclusion after `vectors.h`."""
    slices: list[str] = []
    for whole, each in SLICES.items():
        begin = 0
        for part in each:
            slices += [
                f"#define {part.name.upper()}_FIRST {begin}",
                f"#define {part.name.upper()}_NUMBERS {part.numbers}",
            ]
            begin += part.numbers
        first, *others = (part.name.upper() for part in each)
        listed = " ".join([f"ALWAYS({first})", *(f"NEEDED({name})" for name in others)])
        slices.append(f"#define {whole.name.upper()}_SLICES(ALWAYS, NEEDED) {listed}")
    return "\n".join([*slices, *(each.c_text() for each in TYPES)])
