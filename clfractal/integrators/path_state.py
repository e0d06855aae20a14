"""Structs of reals, each declared here once: the state of paths between stages, and sums over samples."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from clfractal.files.channels import CRYPTOMATTE_RANKS

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
class StateStruct:
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


def _struct(name: str, meaning: str, *members: tuple[Kind, str, str]) -> StateStruct:
    return StateStruct(name, meaning, tuple(Member(*member) for member in members))


FILM_SAMPLE = _struct(
    "film_sample",
    "Where the sample goes to in the picture.",
    ("real", "wanted", "whether the pixel takes this sample"),
    ("real", "x", "pixels from the picture's left side ..."),
    ("real", "y", "... and from its top"),
    ("real", "offset", "distance squared from the pixel's middle, pixels"),
)
LENS_SAMPLE = _struct(
    "lens_sample",
    "Where the sample goes through the lens, and when.",
    ("real", "lens_x", "lens radii from its middle"),
    ("real", "lens_y", ""),
    ("real", "time", "while the shutter is open, 0 to 1"),
)
SIGHTING = _struct("sighting", "What was found first.", ("real", "coverage", ""), ("real", "steps", ""))
START = _struct(
    "start_of_rays",
    "Where the pixel's rays begin: so far its block's cone is free.",
    ("real", "t", "distance along its rays, scene units"),
)
TOUCH = _struct(
    "touch",
    "How far the pixel's whole cone is free.",
    ("real", "touched", "whether the set is there"),
    ("real", "t", "distance along its ray, scene units"),
)
COUNTERS = _struct(
    "counters",
    "What rays cost.",
    ("real", "steps", "distance evaluations; of a volume: places looked at"),
    ("real", "count", "applications of the formula"),
    ("real", "bad", "steps that ended inside"),
)
INTERACTION_SEEN = _struct(
    "interaction_seen",
    "A place on the surface, and how it looks.",
    ("real", "found", ""),
    ("vec", "point", "where it is shaded, and rays leave it"),
    ("vec", "seen", "where the ray has met it"),
    ("vec", "normal", "the one that stands for all: shadows, reflections, channel N"),
    ("real", "cone", "the pixel's footprint there"),
    ("real", "smooth", "escape count"),
    ("color", "tint", "of the surface"),
)
INTERACTION_THING = _struct(
    "interaction_thing",
    "Of what thing an interaction is, and what chooses its colour.",
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
FACET = _struct(
    "facet",
    "One of the normals over which shading is averaged.",
    ("vec", "normal", ""),
    ("real", "weight", ""),
)
RELIEF = _struct(
    "relief",
    "How an interaction's relief rises along the surface.",
    ("real", "rises", "whether its material has one"),
    ("vec", "slope", ""),
)
PATH = _struct(
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
SOUGHT = _struct(
    "sought",
    "Light that a ray seeks, of which is known what it brings once it is known what the ray meets.",
    ("real", "thing", "1 + the number of the thing that has to be met; 0: none"),
    ("color", "brings", "of a light of 1"),
    ("color", "extinction", "of what the ray goes through, per unit of the way"),
)
LIGHT_BEFORE = _struct(
    "light_before",
    "A light that is seen before an interaction.",
    ("real", "met", "whether there is one"),
    ("color", "shows", ""),
)
DIRECT_LIGHT = _struct(
    "direct_light",
    "What a path awaits of the lights at its last interaction.",
    ("color", "awaited", "what one brings, if nothing is in the way of its shadow ray"),
    (
        "real",
        "density",
        "per steradian, of the path's direction; below 0 where lights were not sampled at all",
    ),
    ("real", "total", "what all lights weighed at the interaction"),
)
WITHIN = _struct(
    "within",
    "The glass that a path is in.",
    ("real", "medium", "by the number of its body, see media.h; 0: the open"),
    ("real", "under", "the glass that this one stands in likewise"),
    ("real", "wave", "the path's place in the spectrum; below 0 while it has all colours"),
    ("color", "extinction", "what the medium absorbs and scatters, per unit of the way"),
)
FLIGHT = _struct(
    "flight",
    "The flight of a path through what scatters light.",
    ("color", "scatters", "the part of the extinction that is scattered"),
    ("real", "anisotropy", "of that, Henyey and Greenstein's g"),
    ("real", "flight", "how far the path goes until it is scattered, if nothing is nearer"),
    ("real", "seed_low", "32 random bits for a walk of its own, as two whole numbers ..."),
    ("real", "seed_high", "... of which this is the higher one"),
)

HALT = _struct(
    "halt",
    "Where a medium has scattered a path before what it had met.",
    ("real", "halted", "which kind of medium has, see state.h; or 0"),
    ("real", "anisotropy", "of a cloud, Henyey and Greenstein's g"),
    ("real", "far", "after interactions: how far the shadow ray goes; below 0: there is none"),
    ("real", "passed", "how far along the path's ray no cloud scatters it, as a walk has found out"),
    ("real", "turns", "how many bounces the path has had in walks, beside those of the stages"),
)
BENT = _struct(
    "bent",
    "How a path has come through one clear body, since it was scattered last by what is no glass; and what light awaits"
    " that comes so.",
    ("vec", "from", "where that was"),
    ("vec", "toward", "and in which direction it set out there ..."),
    ("real", "density", "... chosen with which density, per steradian ..."),
    ("real", "total", "... where all lights weighed so much"),
    ("real", "start", "what it was in there, as `medium` in path_state"),
    ("real", "medium", "and what it was in before the present interaction"),
    ("real", "crossed", "boundaries of the body since; below 0: it has come otherwise"),
    ("real", "body", "the number of the body at whose boundary it is, or 0"),
    ("real", "answered", "whether light that comes over that boundary was sampled where it set out"),
    ("color", "awaited", "what one light brings through a clear body, if nothing is in the way of its rays"),
)


def _whole(name: str, meaning: str, *slices: StateStruct) -> StateStruct:
    return StateStruct(name, meaning, tuple(member for each in slices for member in each.members))


# Things of slices, of which a scene may not need the last ones.
CAMERA_SAMPLE = _whole("camera_sample", "Where the sample goes to.", FILM_SAMPLE, LENS_SAMPLE)
INTERACTION = _whole("interaction", "A place on the surface.", INTERACTION_SEEN, INTERACTION_THING)
PATH_STATE = _whole(
    "path_state",
    "What a path of light carries from an interaction to the next.",
    DIRECT_LIGHT,
    WITHIN,
    FLIGHT,
)
SLICES = {
    CAMERA_SAMPLE: (FILM_SAMPLE, LENS_SAMPLE),
    INTERACTION: (INTERACTION_SEEN, INTERACTION_THING),
    PATH_STATE: (DIRECT_LIGHT, WITHIN, FLIGHT),
}
FACE = _struct(
    "plane_face",
    "Where a plane opens the set on the way to the next interaction.",
    ("real", "number", "as a thing, or 0"),
    ("real", "t", "distance along the ray, scene units"),
    ("real", "count", "escape count"),
    ("color", "tint", ""),
    ("vec", "normal", ""),
)
LAYERS = _struct(
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
MIST = _struct(
    "mist_seen",
    "What the fog around the set does to what the eye's ray shows.",
    ("color", "light", "that it adds"),
    ("real", "passes", "the part of what is behind that comes through"),
    ("real", "fogged", "the part of the other fog's colour that stands before what it hides"),
)
AOVS = _struct(
    "aovs",
    "What a sample knows of its layers before its end.",
    ("color", "albedo", "of the first surface"),
    ("color", "emission", "what the path had seen before any light was reflected ..."),
    ("color", "once", "... and before any was reflected twice"),
    ("vec", "normal", "by which the first surface has scattered light"),
)
PIXEL = _struct(
    "pixel",
    "Sums over the samples of a pixel, and what the one nearest to its middle found.",
    ("color", "radiance", ""),
    ("real", "coverage", ""),
    ("real", "samples", ""),
    ("real", "brightness", "of each sample, for its noise ..."),
    ("real", "brightness_square", ""),
    ("real", "coverage_square", ""),
    ("real", "nearest", "distance squared of the kept sample from the middle, pixels"),
    ("real", "depth", "along the view axis, scene units"),
    ("vec", "normal", ""),
    ("vec", "point", ""),
    ("real", "smooth", "escape count"),
    ("real", "steps", "evaluations"),
)
PARTS_OF_LIGHT = _struct(
    "parts",
    "What a sample knows of the first surface, and of its light by how often that was reflected; or sums over samples."
    " Normals count as much as they cover.",
    ("color", "albedo", ""),
    ("color", "emission", ""),
    ("color", "direct", ""),
    ("color", "indirect", ""),
    ("vec", "normal", ""),
)
CRYPTOMATTE = StateStruct(
    "cryptomatte",
    "Which things a pixel shows. Things that come when all ranks are taken are not noted.",
    (
        Member(
            "real",
            "pairs",
            "of each rank a number from 1, or 0: none; the sum of what it covers",
            2 * CRYPTOMATTE_RANKS,
        ),
        Member("real", "nearest", "the number nearest to the pixel's middle"),
    ),
)
TYPES = (
    COUNTERS,
    PIXEL,
    PARTS_OF_LIGHT,
    CRYPTOMATTE,
    CAMERA_SAMPLE,
    SIGHTING,
    START,
    TOUCH,
    INTERACTION,
    FACET,
    RELIEF,
    PATH,
    PATH_STATE,
    HALT,
    BENT,
    SOUGHT,
    LIGHT_BEFORE,
    FACE,
    LAYERS,
    MIST,
    AOVS,
)


def path_state_text() -> str:
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
