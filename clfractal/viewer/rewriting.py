"""The text of an edited scene: that of its source with what has changed, tried before it is used."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from clfractal.errors import ClfractalError, SceneError
from clfractal.files.document import read_document
from clfractal.files.fragments import same
from clfractal.files.roundtrip import updated, written
from clfractal.scene.inline import inlined
from clfractal.scene.load import dump_scene
from clfractal.scene.model import Scene
from clfractal.viewer.camera_words import with_words, written_words
from clfractal.viewer.formula_texts import FormulaTexts, with_formula_text
from clfractal.viewer.named import formula_files
from clfractal.viewer.sources import SceneSource
from clfractal.viewer.sparse import without_defaults


def rewritten(
    source: SceneSource,
    present: Scene,
    folder: Path,
    names: Mapping[str, str | None],
    texts: FormulaTexts | None = None,
) -> tuple[str, bool]:
    """The source's text with what has changed, and whether the content of formula files was written into it.

    Args:
        folder: where the text is to load from.
        names: new names of formula files; None for one whose content is written instead.
        texts: of formulas that were typed: comments are kept.

    Raises:
        SceneError: no text loads to this scene.
    """
    own = texts.named(folder) if texts is not None else []
    for inline, make in _candidates(source, present, names, own):
        text = make()
        if _stands_for(text, present, folder):
            return _as_typed(text, source, present, folder, texts), inline
    raise SceneError("the scene cannot be written so that it loads again")


def _as_typed(
    text: str, source: SceneSource, present: Scene, folder: Path, texts: FormulaTexts | None
) -> str:
    """The text with the formula as it was typed, if it was typed here and has changed since the source was read."""
    content = present.formula.inline
    typed = texts.text_of(content) if texts is not None and content is not None else None
    if typed is None or (source.formula_text is not None and source.formula_text[1] == typed):
        return text
    found = with_formula_text(text, typed)
    return found if _stands_for(found, present, folder) else text


def formula_as_written(source: SceneSource, present: Scene) -> Any:
    """The present formula section, with `file` where its source names one that still has the same content."""
    if source.loaded is None:
        return None
    after = present.resolved()
    return _with_files(source.formula, source.loaded.resolved(), after, after, {})[1]["formula"]


def _candidates(
    source: SceneSource, present: Scene, names: Mapping[str, str | None], own: Sequence[tuple[Any, str]]
) -> Iterator[tuple[bool, Callable[[], str]]]:
    """From the one that keeps most of the source to the one that keeps nothing; the bool: without formula files."""
    loaded = source.loaded
    after, sparse = present.resolved(), without_defaults(present)
    if loaded is not None:
        before = loaded.resolved()
        words = written_words(read_document(source.text).root.plain())
        # (What `frame` does follows from more than the camera.)
        fixed = {path: own for path, own in words.items() if "frame" not in own}
        nothing = dict.fromkeys(formula_files(source.formula, source.folder))
        named = [(False, names, own)] if own else []
        for inline, files, more in (*named, (False, names, ()), (True, nothing, ())):
            whole = _with_files(source.formula, before, after, sparse, files, more)
            # First with the words that cameras are written in, as far as these cameras are where they were.
            for kept in (words, fixed, {}) if words else ({},):
                data = with_words(words, *whole, kept=kept)
                yield inline, partial(updated, source.text, *data)
    yield True, lambda: written(sparse, source.text)
    yield True, lambda: dump_scene(present)


def _with_files(
    formula: Any,
    before: Any,
    after: Any,
    sparse: Any,
    names: Mapping[str, str | None],
    own: Sequence[tuple[Any, str]] = (),
) -> tuple[Any, Any, Any]:
    """The data with `file` where `formula` names one: in `before`, and elsewhere as long as its content is the same.

    Args:
        formula: the section as it was written.
        names: new names of files; None for one whose content is written instead.
        own: formulas that were saved as files, and the names of these.
    """
    if not isinstance(formula, Mapping):
        return before, after, sparse
    old, new, short = before["formula"], after["formula"], sparse["formula"]
    known: list[tuple[Any, str]] = []
    old = _named_file(formula, old, known)
    links = formula.get("chain")
    if isinstance(links, list) and isinstance(old.get("chain"), list) and len(links) == len(old["chain"]):
        old = {**old, "chain": [_named_file(*pair, known) for pair in zip(links, old["chain"], strict=True)]}
    known += own
    new, short = (_with_known(section, known, names) for section in (new, short))
    return {**before, "formula": old}, {**after, "formula": new}, {**sparse, "formula": short}


def _named_file(written_as: Any, section: dict[str, Any], known: list[tuple[Any, str]]) -> dict[str, Any]:
    """A formula or link with `file` in the place of `inline`, where it was written so; the pair is remembered."""
    file = written_as.get("file") if isinstance(written_as, Mapping) else None
    if not isinstance(file, str) or "inline" not in section:
        return section
    known.append((section["inline"], file))
    return _replaced(section, file)


def _with_known(
    section: dict[str, Any], known: list[tuple[Any, str]], names: Mapping[str, str | None]
) -> dict[str, Any]:
    if "chain" in section:
        section = {**section, "chain": [_with_known(link, known, names) for link in section["chain"]]}
    for content, file in known:
        name = names.get(file, file)
        if name is not None and "inline" in section and same(section["inline"], content):
            return _replaced(section, name)
    return section


def _replaced(section: dict[str, Any], file: str) -> dict[str, Any]:
    return {
        ("file" if key == "inline" else key): file if key == "inline" else value
        for key, value in section.items()
    }


def _stands_for(text: str, present: Scene, folder: Path) -> bool:
    """Whether a text loads to an equal scene; its maps and grids are not read again for this."""
    try:
        data = inlined(read_document(text), folder).plain()
        return same(Scene.model_validate(data).resolved(), present.resolved())
    except (ClfractalError, ValidationError):
        return False
