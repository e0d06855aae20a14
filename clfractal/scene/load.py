"""Reads a scene from a file, a text, a picture or plain data, with every error at its line and column.

The data go one way: read, override, inline formula files, validate by the schema, check what the schema cannot see. The
document keeps the places of all values until the end, so that errors of every step have a line and column.
"""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from clfractal.device.activity import doing
from clfractal.elements.lights.set import SetLight
from clfractal.errors import ClfractalError, FileError, SceneError, Where, arguments
from clfractal.files.document import MAX_DEPTH, read_document, read_value, write_document
from clfractal.files.embedded import read_scene_text
from clfractal.files.file_kinds import OF_OTHERS, kind_of
from clfractal.files.inputs import noting
from clfractal.files.marks import Document, node_from_plain, option
from clfractal.files.regular import read_text_file
from clfractal.scene.checks import check_parts
from clfractal.scene.coloring import Coloring
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.inline import inlined
from clfractal.scene.model import Scene
from clfractal.scene.objects import VolumeObject
from clfractal.scene.parts import MAX_SIDE, Image
from clfractal.schema.mapped import ColorMap, maps_of


@dataclass(frozen=True, slots=True)
class SceneText:
    """A scene as it was read, before it is checked: its values with their places, and the folder it stands in.

    `files` are those that were read for it, absolute.
    """

    document: Document
    folder: Path
    files: tuple[Path, ...] = ()

    def value(self, *path: str) -> Any:
        """The plain value at a path; None if there is none."""
        node = self.document.root.under(path)
        return node.plain() if node is not None else None


def load_scene(
    source: str | Path | Mapping[str, Any] | SceneText,
    *,
    overrides: Sequence[str] = (),
    folder: str | Path | None = None,
    posed: bool = True,
) -> Scene:
    """Reads and checks a scene and its formula.

    Args:
        source: a path (of a scene file, or of a picture that holds one); YAML text (a str with a line break,
            or that begins with a brace); plain data; or what `read_scene` gave.
        overrides: `camera.fov=30`: a dotted key and a YAML value that replaces the file's.
        folder: where the files that the scene names are looked for; by default the scene file's folder,
            or the current one.
        posed: whether a scene with `animation.frame` gets the values of that frame; else it is as it was written.

    Raises:
        SceneError, FormulaError: something in the text is wrong.
        FileError: a file cannot be read, is no regular file, too large, or out of the scene's folder.
    """
    given = arguments.words("overrides", overrides)
    own = None if folder is None else arguments.path_of("folder", folder)
    text = source if isinstance(source, SceneText) else read_scene(source)
    with noting() as files:
        document, scene = _validated(text, given, text.folder if own is None else own)
        scene.note_files((*text.files, *files))
        with _located(document):
            check_scene(scene)
            scene = _at_own_frame(scene) if posed else scene
    scene.note_files(files)
    return scene


def sized(text: SceneText, overrides: Sequence[str], size: tuple[int, int]) -> dict[str, str]:
    """The overrides that render a scene at another size, by their keys: it stays the same picture, see `Image.resized`.

    Args:
        overrides: what else is replaced; `image.height` among them is the picture's own size, and so its reference.

    Raises:
        SceneError: one of the overrides is no KEY=VALUE, or its value no YAML.
    """
    width, height = size
    found = {"image.width": str(width), "image.height": str(height)}
    document = text.document
    for override in overrides:
        document = _overridden(document, override)
    image = SceneText(document, text.folder).value("image")
    given = image if isinstance(image, dict) else {}
    own = given.get("height", Image().height)
    if given.get("reference_height") is not None:  # which stays, and is checked at its own place
        if given["reference_height"] == height:
            found["image.reference_height"] = "null"
    elif type(own) is int and 1 <= own <= MAX_SIDE and own != height:
        found["image.reference_height"] = str(own)
    return found


def as_scene(source: Scene | str | Path | Mapping[str, Any]) -> Scene:
    """A scene as it is, or loaded: see `load_scene`."""
    return source if isinstance(source, Scene) else load_scene(source)


def load_coloring(text: SceneText, *, overrides: Sequence[str] = ()) -> Coloring:
    """The coloring of a scene, checked without reading the maps and grids that the scene names; errors as above."""
    document, scene = _validated(text, overrides, text.folder)
    with _located(document):
        check_parts(scene)
        _check_palettes(scene)
    return scene.coloring


def dump_scene(scene: Scene, *, only_ascii: bool = False) -> str:
    """The resolved scene as YAML text; it loads back to an equal scene. `only_ascii`: other characters as escapes."""
    if not isinstance(scene, Scene):
        arguments.refuse("scene", "must be a Scene", arguments.plain(scene))
    return write_document(scene.resolved(), only_ascii=only_ascii)


def schema() -> dict[str, Any]:
    """The JSON Schema of a scene file, for editors."""
    from clfractal.schema.json_schema import JsonSchema

    found = Scene.model_json_schema(schema_generator=JsonSchema)
    plain = _defaults()
    for key, entry in found["properties"].items():
        if key not in found["required"]:
            entry["default"] = plain[key]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found, "title": "clfractal scene"}


def read_scene(source: str | Path | Mapping[str, Any]) -> SceneText:
    """Reads a scene without checking more than that it is YAML; the source is as for `load_scene`."""
    if isinstance(source, Mapping):
        return SceneText(Document(node_from_plain(arguments.plain(source), None)), Path())
    if not isinstance(source, (str, Path)):
        arguments.refuse("scene", "must be a path, YAML text or a mapping", arguments.plain(source))
    if isinstance(source, str) and ("\n" in source or source.lstrip().startswith("{")):
        return SceneText(read_document(source, "scene"), Path())
    path = Path(source)
    if str(source) == "":
        raise FileError("a scene needs a file name")
    with noting() as files, doing(f"reading {path}"):
        text = read_text(path)
    return SceneText(read_document(text, str(source)), path.parent, tuple(files))


def read_text(path: Path) -> str:
    """The text of a scene file, of the scene that a picture holds, or of one that was made of another program's file.

    Raises:
        FileError: it cannot be read, or holds no scene.
    """
    kind = kind_of(path)
    if kind is None:
        return read_text_file(path)
    if kind == "volume":
        raise FileError(
            "is a volume, not a scene: a scene shows it by renderer.file, and `clfractal mesh` makes triangles of it",
            Where(str(path)),
        )
    if kind in OF_OTHERS:
        # Imported only now: scenes of our own need nothing of it.
        from clfractal.exchange.kinds import import_file

        return import_file(path).text(path.name)
    found = read_scene_text(path)
    if found is None:
        raise FileError("holds no scene: it was not written by clfractal", Where(str(path)))
    return found


def _validated(text: SceneText, overrides: Sequence[str], folder: Path) -> tuple[Document, Scene]:
    """The text after overriding and inlining, and the scene that the schema makes of it."""
    document = text.document
    for override in overrides:
        document = _overridden(document, override)
    document = inlined(document, folder)
    plain = document.plain()
    if not isinstance(plain, dict):
        raise SceneError("must be a mapping with version, formula and camera", document.where(()))
    try:
        return document, Scene.model_validate(plain, context={"folder": folder})
    except ValidationError as error:
        from clfractal.schema.error_texts import first_error

        raise first_error(error, document, Scene) from error


@contextmanager
def _located(document: Document) -> Iterator[None]:
    """Adds the place in the text to errors that have only a path."""
    try:
        yield
    except ClfractalError as error:
        raise document.locate(error) from error


def _overridden(document: Document, override: str) -> Document:
    key, equals, text = override.partition("=")
    key = key.strip()
    label = option(key[:200])
    parts = key.split(".")
    if not equals or not all(parts) or len(parts) > MAX_DEPTH:
        raise SceneError("must be KEY=VALUE, such as camera.fov=30", Where(option(override[:200])))
    value = read_value(text, label)
    if not isinstance(document.root.value, dict):
        return document
    index = next((i for i, part in enumerate(parts) if part.isdecimal()), 0)
    if index and not document.has(parts[:index]):
        # An entry of a list that is not in the file but in its default.
        default = node_from_plain(_defaults(), label).under(parts[:index])
        if default is not None and isinstance(default.value, list):
            document = document.replaced(parts[:index], default)
    return document.replaced(parts, value)


def _defaults() -> dict[str, Any]:
    least = {"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}}
    return Scene.model_validate(least).model_dump(mode="json")


def check_scene(scene: Scene) -> None:
    """Raises ClfractalError, at a dotted path, for mistakes that the schema cannot find; files are kept with the scene."""
    scene.derived(_check_formulas)
    check_parts(scene)
    for check in (*_NAMES, _check_views, _check_movement):
        scene.derived(check)


def _check_formulas(scene: Scene) -> None:
    _ = scene.chain, scene.joined_chains


def _check_movement(scene: Scene) -> None:
    if scene.animation is not None:
        from clfractal.scene.movement import movement_of

        movement_of(scene.whole()).check(check_parts)


def _at_own_frame(scene: Scene) -> Scene:
    """The scene with the values of the frame that it says a still shows."""
    if scene.animation is None or scene.animation.frame is None:
        return scene
    from clfractal.scene.movement import movement_of

    return movement_of(scene).still(scene.animation.frame)


def _check_environment(scene: Scene) -> None:
    if scene.environment is not None:
        from clfractal.scene.environment import check_name

        check_name(scene.environment)
        if scene.environment.file is not None:
            _ = scene.surroundings


def _check_files(scene: Scene) -> None:
    _ = scene.given
    _ = scene.textures
    _ = scene.light_tables
    if any(isinstance(each, VolumeObject) for each in scene.objects.values()):
        from clfractal.scene.grid_checks import check_grids

        check_grids(scene)


def _check_views(scene: Scene) -> None:
    """What each view of its layout names."""
    if scene.layout is None:
        return
    for number, (view, _) in enumerate(scene.views):
        try:
            for check in _NAMES:
                view.derived(check)
        except (SceneError, FileError) as error:
            raise scene.layout.views[number].own_error(error, number) from error


def _check_palettes(scene: Scene) -> None:
    """Raises SceneError if a palette that is used does not exist."""
    flat = scene.renderer if isinstance(scene.renderer, CutPlaneRenderer) else None
    used: list[tuple[str, Any]] = [
        *([("coloring.palette", scene.coloring.palette)] if scene.coloring.uses_palette else []),
        *([("renderer.colors.palette", flat.colors.palette)] if flat is not None else []),
        *(
            (f"cut_planes.{index}.colors.palette", p.colors.palette)
            for index, p in enumerate(scene.cut_planes)
        ),
        *(
            (f"materials.{name}.{key}.palette", each.palette)
            for name, material in scene.materials.items()
            for key, each in maps_of(material)
            if isinstance(each, ColorMap)
        ),
        *(
            (f"lights.{index}.palette", light.palette)
            for index, light in enumerate(scene.lights)
            if isinstance(light, SetLight) and light.palette is not None
        ),
    ]
    if used:
        from clfractal.scene.palette import check_palette

        for path, palette in used:
            check_palette(palette, path)


# Palettes, environments and files that the scene names exist; their data are kept in the scene, so that exactly the checked
# data are rendered.
_NAMES = (_check_palettes, _check_environment, _check_files)
