"""Reads a scene from a file, a text, a picture or plain data, with every error at its line and column."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from clfractal.errors import ClfractalError, FileError, FormulaError, SceneError, Where
from clfractal.files.document import MAX_DEPTH, read_document, read_value, write_document
from clfractal.files.marks import Document, Node, node_from_plain, option
from clfractal.files.regular import read_bytes, read_text_file
from clfractal.scene.checks import check_parts
from clfractal.scene.cut_plane import CutPlaneRenderer
from clfractal.scene.messages import first_error
from clfractal.scene.model import Scene

_EXR = b"\x76\x2f\x31\x01"
_PNG = b"\x89PNG\r\n\x1a\n"


def load_scene(
    source: str | Path | Mapping[str, Any], *, overrides: Sequence[str] = (), folder: Path | None = None
) -> Scene:
    """Reads and checks a scene and its formula.

    Args:
        source: a path (of a scene file, or of a picture that holds one); YAML text (a str with a line break,
            or that begins with a brace); or plain data.
        overrides: `camera.fov=30`: a dotted key and a YAML value that replaces the file's.
        folder: where the files that it names are looked for, formulas and an environment's map; the scene
            file's folder, or the current one, if not given.

    Raises:
        SceneError, FormulaError: the first thing in the text that is wrong.
        FileError: a file cannot be read, is no regular file, too large, or out of the scene's folder.
    """
    document, beside = _document(source)
    for override in overrides:
        document = _overridden(document, override)
    return _checked(document, folder or beside)


def with_overrides(scene: Scene, overrides: Sequence[str]) -> Scene:
    """The scene with values replaced (`camera.fov=30`); errors as for load_scene."""
    return load_scene(scene.resolved(), overrides=overrides, folder=scene.folder) if overrides else scene


def dump_scene(scene: Scene) -> str:
    """The resolved scene as YAML text; it loads back to an equal scene."""
    return write_document(scene.resolved())


def schema() -> dict[str, Any]:
    """The JSON Schema of a scene file, for editors."""
    found = Scene.model_json_schema()
    plain = _defaults()
    for key, entry in found["properties"].items():
        if key not in found["required"]:
            entry["default"] = plain[key]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **found, "title": "clfractal scene"}


def _document(source: str | Path | Mapping[str, Any]) -> tuple[Document, Path]:
    """The source's values with their places, and the folder it stands in."""
    if isinstance(source, Mapping):
        return Document(node_from_plain(source, None)), Path()
    if isinstance(source, str) and ("\n" in source or source.lstrip().startswith("{")):
        return read_document(source, "scene"), Path()
    path = Path(source)
    if str(source) == "":
        raise FileError("a scene needs a file name")
    return read_document(_text(path), str(source)), path.parent


def _text(path: Path) -> str:
    start = read_bytes(path, prefix=len(_PNG))
    found: str | None
    if start.startswith(_EXR):
        from clfractal.files import exr_header

        found = exr_header.read_scene_text(path)
    elif start == _PNG:
        from clfractal.files import png

        found = png.read_scene_text(path)
    else:
        return read_text_file(path)
    if found is None:
        raise FileError("holds no scene: it was not written by clfractal", Where(str(path)))
    return found


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
        # An entry of a list that the file leaves to its default.
        default = _default(parts[:index])
        if isinstance(default, list):
            document = document.replaced(parts[:index], node_from_plain(default, label))
    return document.replaced(parts, value)


def _default(path: Sequence[str]) -> Any:
    """The default at a path, or None."""
    value: Any = _defaults()
    for part in path:
        value = value.get(part) if isinstance(value, dict) else None
    return value


def _defaults() -> dict[str, Any]:
    least = {"version": 1, "formula": {"name": "mandelbulb"}, "camera": {}}
    return Scene.model_validate(least).model_dump(mode="json")


def _checked(document: Document, folder: Path) -> Scene:
    scene = _validated(document)
    if _has_file(scene):
        document = document.replaced(("formula",), _inlined(document, folder))
        scene = _validated(document)
    try:
        # Kept in the scene, so that the formula is resolved once.
        _ = scene.chain
    except ClfractalError as error:
        raise document.locate(error) from error
    try:
        check_parts(scene)
        scene = scene.placed(folder)
        _check_names(scene)
        if scene.layout is not None:
            _check_views(scene)
    except (SceneError, FileError) as error:
        raise document.locate(error) from error
    return scene


def _check_names(scene: Scene) -> None:
    """Raises SceneError or FileError for what a scene names and nobody has: palettes, environments, files.

    What is read is kept in the scene, so that what is rendered is what was checked.
    """
    _check_palettes(scene)
    if scene.environment is not None:
        from clfractal.scene.environment import check_name

        check_name(scene.environment)
        if scene.environment.file is not None:
            _ = scene.surroundings
    _ = scene.given


def _check_views(scene: Scene) -> None:
    """The same of each view of its layout."""
    for number, (view, _) in enumerate(scene.views):
        try:
            _check_names(view)
        except (SceneError, FileError) as error:
            where = replace(error.where, path=f"layout.views.{number}.{error.where.path}")
            raise type(error)(error.message, where, details=error.details) from error


def _check_palettes(scene: Scene) -> None:
    """Raises SceneError for a palette that is used and that nobody knows."""
    used: list[tuple[str, Any]] = []
    if scene.coloring.uses_palette:
        used.append(("coloring.palette", scene.coloring.palette))
    if isinstance(scene.renderer, CutPlaneRenderer):
        used.append(("renderer.colors.palette", scene.renderer.colors.palette))
    for index, plane in enumerate(scene.cut_planes):
        used.append((f"cut_planes.{index}.colors.palette", plane.colors.palette))
    if used:
        from clfractal.scene.palette import check_palette

        for path, palette in used:
            check_palette(palette, path)


def _validated(document: Document) -> Scene:
    plain = document.plain()
    if not isinstance(plain, dict):
        raise SceneError("must be a mapping with version, formula and camera", document.where(()))
    try:
        return Scene.model_validate(plain)
    except ValidationError as error:
        raise first_error(error, document) from error


def _has_file(scene: Scene) -> bool:
    spec = scene.formula
    return spec.file is not None or any(link.file is not None for link in spec.chain or ())


def _inlined(document: Document, folder: Path) -> Node:
    """The scene's formula with the files it names put in their place, so that one text tells all of it."""
    return _Inliner(folder).spec(document.root.value["formula"], ("formula",))


class _Inliner:
    """Replaces `file` by `inline`, in a formula and in the links of its chain."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def spec(self, node: Node, path: tuple[str, ...]) -> Node:
        """A mapping that may have `file` or `chain`."""
        if not isinstance(node.value, dict):
            return node
        inner, keys = dict(node.value), dict(node.keys)
        file, links = inner.get("file"), inner.get("chain")
        if isinstance(file, Node) and isinstance(file.value, str):
            del inner["file"]
            inner["inline"] = self.read(file, path)
            if "file" in keys:
                keys["inline"] = keys.pop("file")
        elif isinstance(links, Node) and isinstance(links.value, list):
            entries = [self.spec(link, (*path, "chain", str(i))) for i, link in enumerate(links.value)]
            inner["chain"] = replace(links, value=entries)
        return replace(node, value=inner, keys=keys)

    def read(self, file: Node, path: tuple[str, ...]) -> Node:
        from clfractal.formulas.catalog import safe_path

        where = Where(file.file, file.line, file.column, ".".join((*path, "file")))
        found = safe_path(file.value, self.folder, where)
        shown = str(self.folder / file.value)
        try:
            text = read_text_file(found, name=shown)
        except FileError as error:
            raise FileError(f"{error.where.file} {error.message}", where) from error
        root = read_document(text, shown, error=FormulaError).root
        # A file may hold a chain whose links are files again; deeper ones the formulas' own rules refuse.
        return self.spec(root, (*path, "inline")) if len(path) < 3 else root
