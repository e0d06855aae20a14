"""A scene's objects as kernels read them (`objects.h`), and their materials in Phong's light."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from clfractal.device.orbit import SHAPE_KINDS, Record
from clfractal.device.structs import Field, Precision, Struct
from clfractal.geometry.object_grids import NO_GRID, ObjectGrids, grid_defines
from clfractal.geometry.shining import luminance_of, shining_records
from clfractal.geometry.solids import own_axes
from clfractal.geometry.water import WAVES, wave_set
from clfractal.scene.blends import is_glass
from clfractal.scene.materials import PbrMaterial
from clfractal.scene.model import Scene
from clfractal.scene.object_grids import placed
from clfractal.scene.objects import FormulaObject, VolumeObject, WaterObject
from clfractal.schema.base import Vector
from clfractal.schema.mapped import Map
from clfractal.schema.material import WHITE
from clfractal.schema.shape import AXES, ObjectBase, Simple
from clfractal.shading.clear_bodies import clear_bodies, is_shot
from clfractal.shading.emitters import emitters_of, sampled_radiance
from clfractal.shading.maps import MappedMaterials, glass_bodies
from clfractal.shading.materials import used_materials
from clfractal.shading.set_bodies import set_bodies

_OTHER_KINDS = {"water": 0, "joined": -1, "volume": -2, "cloud": -3}
OBJECT_KINDS = SHAPE_KINDS | _OTHER_KINDS
# In footprints at `detail` 1: surfaces in grids are where a search has found them, and no equation tells how far off
# that is.
GRID_LIFT = 0.05
# Roughness up to which a material mirrors sharply in Phong's light, and from which on it does not.
MIRRORS, DULL = 0.1, 0.4
_LARGEST_EXPONENT = 1e5

OBJECT = Struct(
    "Object",
    [
        Field("kind", "int", 0, "one of OBJECT_KINDS"),
        Field("material", "int", 0, "the number of its material along paths"),
        Field(
            "body",
            "int",
            0,
            "the number of its body, which a part of the set may share; -1: that is opaque, or cuts",
        ),
        Field("glass", "int", 0, "along paths 1: light goes through it; 2: only below its boundary"),
        Field(
            "bends",
            "int",
            0,
            "over how many of its boundaries light is sampled: of a clear level 1, of a clear solid 2; else 0",
        ),
        Field("shot", "int", 0, "1: of a solid that is no round ball"),
        Field("middle", "real", 3, "of a solid; a point of a plane, scene units"),
        Field("own_x", "real", 3, "from scene units to its own ones: of the ball or cube of radius 1,"),
        Field("own_y", "real", 3, "or of a plane, whose own z is its normal"),
        Field("own_z", "real", 3, ""),
        Field("colored", "int", 0, "0: it has the set's colouring"),
        Field("color", "real", 3, "linear Rec. 709"),
        Field("ambient", "real", 0, "Eq. 5's coefficients"),
        Field("diffuse", "real", 0, ""),
        Field("surround", "real", 0, "the same as `diffuse`, of light from the environment"),
        Field("specular", "real", 3, "with a tint"),
        Field("shininess", "real", 0, ""),
        Field("sharp", "real", 0, "part of what it reflects that is mirrored sharply"),
        Field("mirror", "real", 3, "part that is mirrored sharply, straight on"),
        Field("mirror_edge", "real", 3, "what is mirrored more at grazing angles"),
        Field("emission", "real", 3, "radiance, linear Rec. 709"),
        Field(
            "sampled", "int", 0, "1: along paths it is sampled as lights are, and shines the same everywhere"
        ),
        Field("radiance", "real", 3, "of one that is sampled, linear Rec. 709; 1 of what is sought"),
        Field("luminance", "real", 0, "about that of what it shines with"),
        Field("thing", "int", 0, "of one that shines: its number, 0 is the set"),
        Field("sought", "int", 0, "of one that shines: 1: its light is looked up where a ray to it ends"),
        Field("convex", "int", 0, "of one that shines: 1: no place of it sees another"),
        Field("sides", "real", 3, "of a solid: how far its sides are from its middle, scene units"),
        Field("form", "real", 3, "of a shape: numbers of its own"),
        Field("spans", "int", 0, "in how many parts a line can be inside of it"),
        Field("lift", "real", 0, "how far over it rays leave it at least, in footprints"),
        Field("error_share", "real", 0, "of a place's largest coordinate, and ..."),
        Field(
            "error", "real", 0, "... with it the largest number by which places on it are told, scene units"
        ),
        Field("wave_x", "real", WAVES, "changes of phase, radians by scene unit"),
        Field("wave_y", "real", WAVES, ""),
        Field("wave_height", "real", WAVES, "scene units"),
        Field("wave_phase", "real", WAVES, "radians"),
        Field("wave_sharp", "real", 0, "part of the second harmonic"),
        Field("wave_reach", "real", 0, "no wave is higher or deeper, scene units"),
        Field("wave_slope", "real", 0, "no wave is steeper"),
        Field("grid_sides", "int", 3, "of a volume: voxels along its own axes"),
        Field("grid", "int", 0, "where its values begin among the tables"),
        Field("bricks", "int", 0, "likewise the least and the largest value of each brick"),
        Field("transfer", "int", 0, "likewise a cloud's transfer table"),
        Field("bounds", "int", 0, "likewise the most extinction in each brick"),
        Field("voxel", "real", 0, "the least side of a voxel, scene units"),
        Field("level", "real", 0, "the value at its surface"),
        Field("value_low", "real", 0, "the first value of the transfer table"),
        Field("value_range", "real", 0, "one over the width of its values"),
        Field("anisotropy", "real", 0, "Henyey and Greenstein's g"),
    ],
)


def object_defines(scene: Scene) -> dict[str, object]:
    """The defines of all programs that send rays, or read what is kept between stages."""
    return {
        "WAVES": WAVES,
        **grid_defines(),
        **{f"OBJECT_{kind.upper()}": number for kind, number in _OTHER_KINDS.items()},
    }


def object_records(scene: Scene, precision: Precision, grids_begin: int = 0) -> Record:
    """The objects in their order, and behind them what shines, in that of `shining_of`.

    One unused record where there are none, since no buffer is empty.

    Args:
        grids_begin: the number of the tables at which the volumes' grids begin.
    """
    if not scene.objects and not emitters_of(scene):
        return np.zeros(1, OBJECT.dtype(precision))
    grids = ObjectGrids(scene)
    numbers = MappedMaterials(scene).object_numbers
    glass, bodies = glass_bodies(scene)[1:], set_bodies(scene).parts
    through_all = [is_glass(each, scene.materials) for each in used_materials(scene)[1:]]
    rows: list[dict[str, object]] = [
        {
            "material": number,
            "body": index,
            "glass": int(through) and (1 if clear else 2),
            "bends": bends,
            "shot": int(is_shot(each, material)),
            **_place(scene, each),
            **_phong_material(scene, each),
            **_sampled(radiance),
            "colored": int(_has_color(scene, each)),
            **(grids.fields(name, grids_begin) if isinstance(each, VolumeObject) else NO_GRID),
        }
        for index, number, through, clear, bends, radiance, material, (name, each) in zip(
            range(1, 1 + len(scene.objects)),
            numbers,
            glass,
            through_all,
            clear_bodies(scene),
            sampled_radiance(scene),
            used_materials(scene)[1:],
            scene.objects.items(),
            strict=True,
        )
    ]
    for row, name in zip(rows, scene.objects, strict=True):
        if name in scene.joined:  # the march finds it, and where it is glass
            row |= {"kind": OBJECT_KINDS["joined"], "glass": 0, "body": bodies[name] or -1}
    found = OBJECT.array(precision, rows)
    return np.concatenate([found, shining_records(scene, found)])


def _sampled(radiance: Vector | None) -> dict[str, object]:
    """What a thing shines with, and nothing else of `emitters_of`."""
    shines = radiance or (0.0, 0.0, 0.0)
    known = int(radiance is not None)
    shining = {"sampled": known, "radiance": shines, "luminance": luminance_of(shines)}
    return {**shining, **dict.fromkeys(("thing", "sought", "convex"), 0)}


def mirrors(scene: Scene) -> bool:
    """Whether any object mirrors in Phong's light."""
    materials = [_phong_material(scene, each) for each in scene.objects.values()]
    return any(np.any(each["mirror"]) or np.any(each["mirror_edge"]) for each in materials)


def _kind(each: ObjectBase) -> str:
    """The kind of an object, among OBJECT_KINDS."""
    if isinstance(each, FormulaObject):
        return "joined"
    return "cloud" if isinstance(each, VolumeObject) and each.is_cloud else each.tag


def _place(scene: Scene, each: ObjectBase) -> dict[str, object]:
    """Where it is, and its waves."""
    nothing = (0.0,) * WAVES
    row: dict[str, object] = {
        "kind": OBJECT_KINDS[_kind(each)],
        "middle": each.position,
        **dict.fromkeys(("wave_x", "wave_y", "wave_height", "wave_phase"), nothing),
        "sides": (1.0, 1.0, 1.0),
        "form": each.form if isinstance(each, Simple) else (0.0, 0.0, 0.0),
        "spans": each.spans if isinstance(each, Simple) else 1,
        "lift": GRID_LIFT * scene.surface.detail if isinstance(each, VolumeObject) else 0.0,
        "error_share": 1.0,
        "error": max(map(abs, each.position)),
        **dict.fromkeys(("wave_sharp", "wave_reach", "wave_slope"), 0.0),
    }
    if isinstance(each, VolumeObject):
        # Those of a grid may be oblique. Its sides are as far from its middle as it is thick.
        place = placed(each, scene.grids[each.file]).place
        axes = list(2 * place.inverse / np.array(place.shape)[:, None])
        row["sides"] = tuple(1 / float(np.linalg.norm(axis)) for axis in axes)
    elif isinstance(each, FormulaObject):
        axes = [np.array(axis) for axis in AXES]
    else:
        axes, row["sides"] = own_axes(each)
    row.update(zip(("own_x", "own_y", "own_z"), axes, strict=True))
    if isinstance(each, WaterObject):
        waves = wave_set(each)
        row.update(
            wave_x=waves.x,
            wave_y=waves.y,
            wave_height=waves.height,
            wave_phase=waves.phase,
            wave_sharp=waves.sharp,
            wave_reach=waves.reach,
            wave_slope=waves.slope,
            error_share=1 + waves.slope,
            error=(1 + waves.slope) * max(map(abs, each.position)) + waves.reach,
        )
    return row


def _has_color(scene: Scene, each: ObjectBase) -> bool:
    """Whether it has a colour of its own; formulas have the set's colouring where their material has none."""
    if not isinstance(each, FormulaObject):
        return True
    return each.material is not None and scene.materials[each.material].base.color is not None


def own_color(scene: Scene, each: ObjectBase) -> Vector | None:
    """The colour of an object's body, linear Rec. 709; None: it has the set's colouring."""
    if not _has_color(scene, each):
        return None
    x, y, z = _phong_material(scene, each)["color"]
    return (float(x), float(y), float(z))


def _phong_material(scene: Scene, each: ObjectBase) -> dict[str, Any]:
    """How it looks in Phong's light."""
    phong = scene.material
    if each.material is None:
        return {
            "color": phong.color,
            "ambient": phong.ambient,
            "diffuse": phong.diffuse,
            "surround": phong.diffuse,
            "specular": (phong.specular,) * 3,
            "shininess": phong.shininess,
            "sharp": 0.0,
            "mirror": (phong.reflection,) * 3,
            "mirror_edge": (0.0,) * 3,
            "emission": (0.0,) * 3,
        }
    return {"ambient": phong.ambient, **phong_of(scene.materials[each.material], phong.color)}


def phong_of(material: PbrMaterial, color: Vector) -> dict[str, Any]:
    """A layered material in Phong's light: its body, and one boundary, by their values straight on.

    GGX with alpha is about as wide in R.V as cos^n with n = 1/(2 alpha^2) - 2, since R turns twice as far as the half
    vector; and a lobe that reflects f in all is f (n + 2)/2 high beside a white body (Walter and others 2007, equation 30).
    What is smoother than DULL is mirrored instead, by Schlick's approximation of Fresnel's equations.

    Args:
        color: of the body where the material has none of its own. Where a value differs from place to place, which
            this light cannot show, it is what materials have by themselves.
    """
    base, specular, shine = material.base, material.specular, material.emission
    body = _color(base.color, color)
    weight, metal = _number(base.weight, 1), _number(base.metalness, 0)
    rough, strength = _number(specular.roughness, 0.3), _number(specular.weight, 1)
    ior, tint = _number(specular.ior, 1.5), _color(specular.color, WHITE)
    glass = strength * ((ior - 1) / (ior + 1)) ** 2 * tint
    mirrored = metal * weight * body + (1 - metal) * glass
    edge = metal * (tint * strength - weight * body).clip(0)
    edge = edge + (1 - metal) * (strength * tint - glass).clip(0)
    sharp = min(max((DULL - rough) / (DULL - MIRRORS), 0.0), 1.0)
    alpha = max(rough**2, 1e-3)
    shininess = min(max(1 / (2 * alpha**2) - 2, 1.0), _LARGEST_EXPONENT)
    highlight = mirrored * (shininess + 2) / 2 if rough > 0 else np.zeros(3)
    shown, matt = body, weight
    below = _number(material.subsurface.weight, 0)
    if below > 0:
        # What comes out of a medium below the boundary is as bright as a body of its colour.
        inner = material.subsurface.color
        beneath = body if isinstance(inner, Map) else np.array(inner, np.float64)
        shown = (1 - below) * weight * body + below * beneath
        matt = 1.0
    return {
        "color": shown,
        "diffuse": matt * (1 - metal),
        # Rough metals mirror all that is around: about as a white body of their colour does.
        "surround": matt * (1 - metal * sharp),
        "specular": highlight,
        "shininess": shininess,
        "sharp": sharp,
        "mirror": mirrored * sharp,
        "mirror_edge": edge * sharp,
        "emission": _number(shine.luminance, 0) * _color(shine.color, WHITE),
    }


def _number(value: float | Map, otherwise: float) -> float:
    return otherwise if isinstance(value, Map) else value


def _color(value: Vector | Map | None, otherwise: Vector) -> npt.NDArray[np.float64]:
    return np.array(otherwise if value is None or isinstance(value, Map) else value)
