"""The files that parts of a scene name, and these parts with other names of them."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from typing import Any, TypeAlias, TypeVar

from clfractal.scene.materials import PbrMaterial
from clfractal.scene.objects import VolumeObject
from clfractal.schema.light import LightBase
from clfractal.schema.mapped import maps_of
from clfractal.schema.shape import ObjectBase

T = TypeVar("T")
Key: TypeAlias = tuple[str, str]
"""The word of a kind of lights, and the name of a file that lights of this kind read."""


def _first(named: Iterable[tuple[T, str]]) -> dict[T, str]:
    """Of each thing that is named the first path."""
    found: dict[T, str] = {}
    for each, path in named:
        found.setdefault(each, path)
    return found


def texture_files(materials: Mapping[str, PbrMaterial]) -> dict[str, str]:
    """The files that materials name, and of each the path of the key that names it first."""
    return _first(
        (each.texture, f"materials.{name}.{key}.texture")
        for name, material in materials.items()
        for key, each in maps_of(material)
        if each.texture is not None
    )


def with_textures(materials: Mapping[str, PbrMaterial], names: Mapping[str, str]) -> dict[str, PbrMaterial]:
    """The materials with other names of their files; those without any are the same objects."""
    result = dict(materials)
    for name, material in materials.items():
        if any(each.texture in names for _, each in maps_of(material)):
            given = material.model_dump(exclude_unset=True)
            rename_files(given, lambda file: names.get(file, file))
            result[name] = PbrMaterial.checked(given)
    return result


def rename_files(data: Any, new: Callable[[str], str]) -> None:
    """Gives the files in plain data of a part of a scene other names, but those of formulas."""
    if isinstance(data, list):
        for each in data:
            rename_files(each, new)
    if isinstance(data, dict):
        data.update({key: new(data[key]) for key in ("file", "texture") if isinstance(data.get(key), str)})
        rename_files([each for key, each in data.items() if key != "formula"], new)


def light_files(lights: Iterable[LightBase]) -> dict[Key, str]:
    """The files that lights read, and of each the path of the key that names it first."""
    return _first(
        ((light.tag, light.reads), f"lights.{number}.file")
        for number, light in enumerate(lights)
        if light.reads is not None
    )


def with_light_files(lights: tuple[LightBase, ...], names: Mapping[str, str]) -> tuple[LightBase, ...]:
    """The lights with other names of their files; those without any are the same objects."""
    return tuple(
        light.model_copy(update={"file": names[light.reads]})
        if light.reads and light.reads in names
        else light
        for light in lights
    )


def volumes_of(objects: Mapping[str, ObjectBase]) -> dict[str, VolumeObject]:
    """Those that are volumes, by name."""
    return {name: each for name, each in objects.items() if isinstance(each, VolumeObject)}


def grid_files(objects: Mapping[str, ObjectBase]) -> dict[str, str]:
    """The files that volumes name, and of each the path of the key that names it first."""
    return _first((each.file, f"objects.{name}.file") for name, each in volumes_of(objects).items())


def with_grids(objects: Mapping[str, ObjectBase], names: Mapping[str, str]) -> dict[str, ObjectBase]:
    """The objects with other names of their files; those without any are the same."""
    result = dict(objects)
    for name, each in volumes_of(objects).items():
        if names.get(each.file, each.file) != each.file:
            result[name] = each.model_copy(update={"file": names[each.file]})
    return result
