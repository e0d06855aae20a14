"""Materials as paths read them, with what differs from place to place in them (`maps.h`)."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from clfractal.device.orbit import Record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.files.srgb import encode
from clfractal.scene.blends import Blends, blends_of, is_costly, is_glass, is_participating, is_subsurface
from clfractal.scene.light_paths import PathLighting
from clfractal.scene.materials import MAX_MATERIALS
from clfractal.scene.model import Scene
from clfractal.scene.objects import VolumeObject
from clfractal.schema.base import unit
from clfractal.schema.mapped import ColorMap, Map, NumberMap, maps_of
from clfractal.shading.kind_numbers import COLORINGS
from clfractal.shading.materials import (
    PBR,
    face_materials,
    material_values,
    parameter_numbers,
    used_materials,
)

MAP = Struct(
    "Map",
    [
        Field("number", "int", 0, "the first number of a lane's material that it sets"),
        Field("count", "int", 0, "how many it sets: 1, or 3 of a colour"),
        Field("by", "int", 0, "the quantity, COLORING_"),
        Field("asked", "int", 0, "which of the formula's answers that is; below 0: none"),
        Field("of_surface", "int", 0, "1: it follows what the surface itself is around a place"),
        Field("table", "int", 0, "where its PALETTE_SIZE colours begin"),
        Field("repeat", "int", 0, "1: the table begins again after its end; 0: its ends go on"),
        Field("scale", "real", 0, "tables per unit of the quantity"),
        Field("offset", "real", 0, "place in the table where the quantity is 0"),
        Field("vector", "real", 3, "a direction of length 1, or a place, scene units"),
        Field("picture", "int", 0, "where its pixels begin, those of narrower levels behind them"),
        Field("levels", "int", 0, "of a picture; 0: there is none"),
        Field("width", "int", 0, "of the picture, pixels"),
        Field("height", "int", 0, ""),
        Field("size", "real", 0, "its width, scene units"),
        Field("sharpness", "real", 0, "exponent of the normal's parts, which blend its three sides"),
    ],
)
MAP_DEFINES = {
    # Those with names, and what Phong's is along paths.
    "MOST_MATERIALS": MAX_MATERIALS + 1,
}
BUMP_PLACES = 3
"""Places around an interaction where heights are compared."""
TABLE = 256
"""Colours of a table, as of a palette."""

Floats = npt.NDArray[np.float32]
_HEIGHT = "bump_height"
_GREY = np.array([0.2126, 0.7152, 0.0722])  # ITU-R BT.709-6, item 3.2


@dataclass(frozen=True)
class MappedMaterials:
    """The materials of a scene's surface, and their maps."""

    scene: Scene

    @cached_property
    def blends(self) -> Blends:
        """All materials, in the order of their records."""
        roots = [*used_materials(self.scene), *face_materials(self.scene).values()]
        return blends_of(roots, self.scene.materials)

    @property
    def object_numbers(self) -> tuple[int, ...]:
        """The numbers of the objects' materials, in the order of the scene."""
        return self.blends.roots[1 : 1 + len(self.scene.objects)]

    @property
    def face_numbers(self) -> dict[str, int]:
        """The numbers of the materials of cuts' faces, by name."""
        return dict(
            zip(face_materials(self.scene), self.blends.roots[1 + len(self.scene.objects) :], strict=True)
        )

    @cached_property
    def _own(self) -> list[list[tuple[str, Map]]]:
        """Of each material its parameters that are maps; of a blend, its mask alone, which may be a number."""
        found: list[list[tuple[str, Map]]] = []
        for material, parts in zip(self.blends.materials, self.blends.parts, strict=True):
            if parts is None:
                own = [(path.replace(".", "_"), each) for path, each in maps_of(material)]
                own = [each for each in own if each[0] != _HEIGHT]
                if self.has_bump:
                    own.append((_HEIGHT, _map_of(material.bump.height)))
                found.append(own)
                continue
            found.append([("mask", _map_of(material.mask))])
        return found

    @cached_property
    def has_bump(self) -> bool:
        """Whether light sees a relief."""
        return any(self._rises(root) for root in self.blends.roots)

    def _rises(self, number: int) -> bool:
        """Whether a material's height differs from place to place: by a map, or because its parts have others."""
        heights = self._heights(number)
        return len(heights) > 1 or any(isinstance(each, NumberMap) for each in heights)

    def _heights(self, number: int) -> set[float | NumberMap]:
        """Heights of which that of a material is made."""
        parts, height = self.blends.parts[number], self.blends.materials[number].bump.height
        if parts is not None:
            return self._heights(parts[0]) | self._heights(parts[1])
        return {height.curve[0][1] if isinstance(height, NumberMap) and height.is_flat else height}

    @cached_property
    def relief(self) -> list[NumberMap]:
        """What heights follow: their own maps, and the masks of blends."""
        if not self.has_bump:
            return []
        found = [each for name, each in self.maps if name in (_HEIGHT, "mask")]
        return [each for each in found if isinstance(each, NumberMap) and not each.is_flat]

    @property
    def relief_asked(self) -> int:
        """How many of `asked`, from the first on, are asked around interactions too."""
        return len({_question(each) for each in self.relief if each.is_asked})

    @property
    def relief_of_surface(self) -> bool:
        """Whether heights follow what the surface itself is around interactions: its normals and escape counts."""
        return any(each.kind is not None and each.kind.of_surface for each in self.relief)

    def _width(self, number: int) -> float:
        """The least distance over which a material's slopes are measured, scene units.

        A picture's pixels are blended linearly: over less than one of them slopes would have edges.
        """
        material, parts = self.blends.materials[number], self.blends.parts[number]
        follows = material.bump.height if parts is None else material.mask
        widths = [material.bump.width or 0.0, *(self._width(part) for part in parts or ())]
        if isinstance(follows, Map) and follows.texture is not None:
            widths.append(follows.scale / self.scene.textures[follows.texture].pixels.shape[1])
        return max(widths)

    @property
    def maps(self) -> list[tuple[str, Map]]:
        """All maps, in the order of their records, with the parameters that they set."""
        return [each for own in self._own for each in own]

    @cached_property
    def asked(self) -> list[Map]:
        """One map of each quantity for which the formula is asked."""
        every = [*self.relief, *(each for _, each in self.maps)]
        return list({_question(each): each for each in every if each.is_asked}.values())

    def records(self, precision: Precision) -> Record:
        """The materials' records."""
        rows, first = [], 0
        for number, (material, own) in enumerate(zip(self.blends.materials, self._own, strict=True)):
            values, parts = material_values(material), self.blends.parts[number]
            if parts is not None:
                values |= {"blend": parts, "mask": first}
            elif own:
                count = len(own) - int(self.has_bump)
                values |= {"first_map": first, "map_count": count}
                if self.has_bump:
                    values["bump"] = first + count
            if self._rises(number):
                values["bump_width"] = self._width(number)
            rows.append(values)
            first += len(own)
        return PBR.array(precision, rows)

    def map_records(self, precision: Precision) -> Record:
        """The maps' records."""
        numbers = {**parameter_numbers(), "mask": (-1, 1), _HEIGHT: (-1, 1)}
        questions = [_question(each) for each in self.asked]
        pictures, place = {}, len(self.maps) * TABLE * 3
        for key in self._pictures():
            pictures[key] = place
            place += sum(width * height * 3 for width, height in self._sizes(key))
        rows = []
        for index, (name, each) in enumerate(self.maps):
            low, high = each.used_range
            key = (each.texture or "", isinstance(each, ColorMap))
            sizes = self._sizes(key) if each.texture is not None else [(0, 0)]
            rows.append(
                {
                    "number": numbers[name][0],
                    "count": numbers[name][1],
                    "by": COLORINGS[each.by] if each.by is not None else 0,
                    "asked": questions.index(_question(each)) if each.is_asked else -1,
                    "of_surface": int(each.kind is not None and each.kind.of_surface),
                    "table": index * TABLE * 3,
                    "repeat": int(each.repeat),
                    "scale": 1 / (high - low),
                    "offset": -low / (high - low),
                    "vector": each.center if "center" in each.own_keys else unit(each.direction),
                    "picture": pictures.get(key, 0),
                    "levels": len(sizes) if each.texture is not None else 0,
                    "width": sizes[0][0],
                    "height": sizes[0][1],
                    "size": each.scale,
                    "sharpness": each.sharpness,
                }
            )
        return MAP.array(precision, rows)

    def tables(self) -> Floats:
        """All tables, then all pictures; one-dimensional."""
        parts: list[Floats] = [_table(each) for _, each in self.maps]
        for file, in_color in self._pictures():
            texture = self.scene.textures[file]
            pixels = texture.pixels
            if not in_color:
                codes = encode(np.clip(pixels.astype(np.float64), 0, None)) if texture.has_codes else pixels
                pixels = np.repeat((codes @ _GREY)[..., None], 3, axis=-1).astype(np.float32)
            parts += levels_of(pixels)
        return np.concatenate([np.asarray(part, np.float32).reshape(-1) for part in parts])

    @property
    def key(self) -> str:
        """A text that differs for different tables."""
        told = [each.model_dump_json() for _, each in self.maps]
        return " ".join([*told, *(self.scene.textures[file].digest for file, _ in self._pictures())])

    def _pictures(self) -> list[tuple[str, bool]]:
        """Files, and whether their colours are wanted, or how grey they are."""
        found = [
            (each.texture, isinstance(each, ColorMap)) for _, each in self.maps if each.texture is not None
        ]
        return list(dict.fromkeys(found))

    def _sizes(self, key: tuple[str, bool]) -> list[tuple[int, int]]:
        height, width, _ = self.scene.textures[key[0]].pixels.shape
        return level_sizes(width, height)


def mapped_materials(scene: Scene) -> MappedMaterials | None:
    """The materials of a scene where anything differs from place to place; else None."""
    if not isinstance(scene.lighting, PathLighting):
        return None
    found = MappedMaterials(scene)
    return found if found.maps else None


def has_glass(scene: Scene) -> bool:
    """Whether paths go through anything."""
    return any(glass_bodies(scene))


def has_glass_set(scene: Scene) -> bool:
    """Whether paths go through the set, or into a part that is joined to it."""
    bodies = glass_bodies(scene)
    joined = [
        through for name, through in zip(scene.objects, bodies[1:], strict=True) if name in scene.joined
    ]
    return bodies[0] or any(joined)


def has_participating_media(scene: Scene) -> bool:
    """Whether anything that paths go through scatters light on the way."""
    return has_subsurface(scene) or (
        has_glass(scene) and any(is_participating(each, scene.materials) for each in used_materials(scene))
    )


def has_costly(scene: Scene) -> bool:
    """Whether any material has a part that a stage of its own evaluates."""
    return isinstance(scene.lighting, PathLighting) and any(
        is_costly(each, scene.materials) for each in (*used_materials(scene), *face_materials(scene).values())
    )


def has_subsurface(scene: Scene) -> bool:
    """Whether paths go below boundaries and come out elsewhere."""
    return isinstance(scene.lighting, PathLighting) and any(
        is_subsurface(each, scene.materials) for each in used_materials(scene)
    )


def glass_bodies(scene: Scene) -> list[bool]:
    """Whether paths go through the set, or below its boundary; then the same of each object."""
    if not isinstance(scene.lighting, PathLighting):
        return [False] * (1 + len(scene.objects))
    known = scene.materials
    own, *others = [is_glass(each, known) or is_subsurface(each, known) for each in used_materials(scene)]
    # (A cloud has no material of its own, and not the set's either.)
    named = scene.objects.values()
    return [
        own and scene.has_set,
        *(inside and not isinstance(each, VolumeObject) for inside, each in zip(others, named, strict=True)),
    ]


def material_counts(scene: Scene) -> dict[str, object]:
    """How many materials and questions about them there are, as fields of a March."""
    if not isinstance(scene.lighting, PathLighting):
        none = dict.fromkeys(("asked_count", "bump_asked", "bump_surface", "set_material"), 0)
        return {**none, "material_count": 1}
    found = MappedMaterials(scene)
    return {
        "asked_count": len(found.asked),
        "bump_asked": found.relief_asked,
        "bump_surface": int(found.relief_of_surface),
        "material_count": len(found.blends.materials),
        "set_material": found.blends.roots[0],
    }


def asked_maps(scene: Scene) -> list[Map]:
    """See `MappedMaterials.asked`."""
    found = mapped_materials(scene)
    return found.asked if found is not None else []


def bump_numbers(scene: Scene) -> int:
    """Numbers of a pixel that are kept of the places around its interaction; see `bump_places.h`."""
    if not isinstance(scene.lighting, PathLighting):
        return 0
    found = MappedMaterials(scene)
    return BUMP_PLACES * (found.relief_asked + 4 * found.relief_of_surface)


def has_bump(scene: Scene) -> bool:
    """Whether paths see a relief."""
    return isinstance(scene.lighting, PathLighting) and MappedMaterials(scene).has_bump


def level_sizes(width: int, height: int) -> list[tuple[int, int]]:
    """Widths and heights of a picture and its narrower levels, down to one pixel."""
    found = [(width, height)]
    while found[-1] != (1, 1):
        found.append((max(found[-1][0] // 2, 1), max(found[-1][1] // 2, 1)))
    return found


def levels_of(pixels: Floats) -> list[Floats]:
    """A picture, shape (height, width, 3), and its narrower levels, each the mean of the one before."""
    found = [pixels]
    for width, height in level_sizes(pixels.shape[1], pixels.shape[0])[1:]:
        found.append(_narrowed(_narrowed(found[-1], height).swapaxes(0, 1), width).swapaxes(0, 1))
    return found


def _narrowed(pixels: Floats, count: int) -> Floats:
    """Rows of equal height, each the mean of what it covers."""
    given = pixels.shape[0]
    if given == count:
        return pixels
    if given == 2 * count:
        return np.asarray(0.5 * (pixels[::2] + pixels[1::2]), np.float32)
    # An odd number of rows 2 n + 1 becomes n: each covers its two, and parts of the one between.
    rows = np.arange(count)[:, None, None]
    first, second, third = pixels[:-2:2], pixels[1:-1:2], pixels[2::2]
    mixed = (count - rows) * first + count * second + (rows + 1) * third
    return np.asarray(mixed / (2 * count + 1), np.float32)


def _map_of(value: float | NumberMap) -> NumberMap:
    """A number as a map."""
    if isinstance(value, NumberMap):
        return value
    return NumberMap(by="iterations", curve=((0.0, value), (1.0, value)))


def _table(each: Map) -> Floats:
    if isinstance(each, ColorMap):
        from clfractal.scene.palette import named_table

        return named_table(each.palette)
    assert isinstance(each, NumberMap)
    at, values = zip(*each.curve, strict=True)
    curve = np.interp(np.linspace(0.0, 1.0, TABLE), at, values)
    return np.repeat(curve[:, None], 3, axis=1).astype(np.float32)


def _question(each: Map) -> tuple[object, ...]:
    """What the formula is asked for a map."""
    return (each.by, *(getattr(each, key) for key in each.own_keys))
