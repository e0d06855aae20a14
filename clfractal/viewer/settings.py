"""The user's settings of the window: a YAML file, read with every mistake at its line."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from pathlib import Path
from typing import Any, Literal, TypeAlias

from clfractal.errors import ClfractalError, Where, unknown_name
from clfractal.errors.arguments import shown
from clfractal.files.atomic import atomic_writer, file_error
from clfractal.files.document import read_document, read_text_file, write_document
from clfractal.files.marks import Document
from clfractal.viewer.keys import KeyMap

ENVIRONMENT_VARIABLE = "CLFRACTAL_SETTINGS"
"""Names another settings file."""

Style: TypeAlias = Literal["turntable", "free"]
STYLES: tuple[Style, ...] = ("turntable", "free")


def _number(default: float, least: float, most: float, told: str) -> Any:
    return field(default=default, metadata={"least": least, "most": most, "told": told})


def _switch(default: bool, told: str) -> Any:
    return field(default=default, metadata={"told": told})


@dataclass(frozen=True, slots=True)
class Settings:
    """How the window behaves. Every value has a default; `told` in a field's metadata says what it is."""

    frame_rate: float = _number(30.0, 1, 240, "frames a second that are held while something moves")
    coarsest: int = _number(
        16, 1, 64, "a moving picture has a ray for at most so many pixels in each direction; 1: never coarse"
    )
    coarse: bool = _switch(True, "whether moving pictures may be coarse at all")
    mouse: float = _number(1.0, 0.05, 20, "factor on what a movement of the mouse does")
    orbit: Style = field(
        default="turntable",
        metadata={"words": STYLES, "told": "turntable keeps the horizon; free turns any way"},
    )
    fly_speed: float = _number(1.0, 0.01, 100, "factor on the speed of flying")
    panel_scale: float = _number(1.0, 0.5, 4, "size of panels and texts, times the screen's own scale")
    autosave: float = _number(20.0, 0, 3600, "seconds between two safety copies of unsaved changes; 0: none")
    watch: bool = _switch(True, "load the scene's file again when another program has changed it")
    keys: Mapping[str, tuple[str, ...]] = field(
        default_factory=dict, metadata={"told": "other keys: the name of an action, and its keys"}
    )

    @property
    def used_coarsest(self) -> int:
        """The largest divider of a moving picture's resolution: 1 if it may not be coarse."""
        return self.coarsest if self.coarse else 1

    @property
    def key_map(self) -> KeyMap:
        """The table of keys.

        Raises:
            ClfractalError: `keys` is wrong; it was checked if the settings were loaded.
        """
        return KeyMap.from_settings(self.keys)

    def save(self, path: Path | None = None) -> None:
        """Writes the values that differ from the defaults; the file appears complete or not at all.

        Raises:
            FileError: it cannot be written.
        """
        target = path or settings_path()
        text = write_document(self.changes())
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise file_error(target, "cannot be written", error) from error
        with atomic_writer(target) as beside:
            beside.write_text(_HEADING + ("" if text.strip() == "{}" else text), encoding="utf-8")

    def changes(self) -> dict[str, Any]:
        """The values that differ from the defaults, as plain data."""
        usual = Settings()
        found = {
            each.name: getattr(self, each.name)
            for each in fields(self)
            if getattr(self, each.name) != getattr(usual, each.name)
        }
        if "keys" in found:
            found["keys"] = {
                name: chords[0] if len(chords) == 1 else list(chords) for name, chords in self.keys.items()
            }
        return found


_HEADING = "# Settings of clfractal's window. What is not here has its default.\n"


def settings_path() -> Path:
    """Where the settings are: CLFRACTAL_SETTINGS, else a file in the user's configuration folder."""
    given = os.environ.get(ENVIRONMENT_VARIABLE)
    if given:
        return Path(given)
    import platformdirs  # as for the cache: only programs with a window pay for it

    return Path(platformdirs.user_config_dir("clfractal")) / "settings.yaml"


def load_settings(path: Path | None = None) -> tuple[Settings, str]:
    """The settings, and a remark: empty, or the one line that says why the defaults are used instead of the file."""
    source = path or settings_path()
    try:
        return read_settings(source), ""
    except ClfractalError as error:
        return Settings(), f"{error}; the default settings are used"


def read_settings(path: Path) -> Settings:
    """The settings of a file; the defaults if there is none.

    Raises:
        ClfractalError: not YAML, an unknown setting, a wrong value, or keys that clash, at its line and column.
        FileError: the file cannot be read.
    """
    if not path.exists():
        return Settings()
    text = read_text_file(path)
    if not _without_comments(text):
        return Settings()
    document = read_document(text, str(path), error=ClfractalError)
    try:
        return _checked(document.plain())
    except ClfractalError as error:
        raise _located(document, error) from None


def _without_comments(text: str) -> str:
    return "".join(line.partition("#")[0].strip() for line in text.splitlines())


def _located(document: Document, error: ClfractalError) -> ClfractalError:
    """The error at its place: that of the key for an unknown setting or action, else that of the value."""
    parts = tuple((error.where.path or "").split(".")) if error.where.path else ()
    of_key = parts and error.message.startswith(("unknown setting", "unknown action"))
    where = document.where(parts[:-1], key=parts[-1]) if of_key else document.where(parts)
    return ClfractalError(error.message, Where(where.file, where.line, where.column, error.where.path))


def _checked(data: Any) -> Settings:
    if not isinstance(data, Mapping):
        raise ClfractalError("must be a mapping of settings to values")
    known = {each.name: each for each in fields(Settings)}
    values: dict[str, Any] = {}
    for name, value in data.items():
        if name not in known:
            raise ClfractalError(unknown_name("setting", name, known), Where(path=name))
        if name == "keys":
            values[name] = _keys(value)
        else:
            values[name] = _value(name, value, known[name].default, known[name].metadata)
    return Settings(**values)


def _value(name: str, value: Any, default: Any, rules: Mapping[str, Any]) -> Any:
    where = Where(path=name)
    if isinstance(default, bool):
        if not isinstance(value, bool):
            raise ClfractalError(f"must be true or false, got {shown(value)}", where)
        return value
    if isinstance(default, str):
        if value not in rules["words"]:
            words = " or ".join(rules["words"])
            raise ClfractalError(f"must be {words}, got {shown(value)}", where)
        return value
    whole = isinstance(default, int)
    if isinstance(value, bool) or not isinstance(value, int if whole else (int, float)):
        kind = "whole number" if whole else "number"
        raise ClfractalError(f"must be a {kind}, got {shown(value)}", where)
    least, most = rules["least"], rules["most"]
    if not least <= value <= most:
        raise ClfractalError(f"must be from {least:g} to {most:g}, got {value:g}", where)
    return type(default)(value)


def _keys(value: Any) -> dict[str, tuple[str, ...]]:
    if not isinstance(value, Mapping):
        raise ClfractalError(f"must be a mapping of actions to keys, got {shown(value)}", Where(path="keys"))
    found: dict[str, tuple[str, ...]] = {}
    for name, given in value.items():
        chords = [given] if not isinstance(given, list) else given
        # A digit alone is read as a number.
        texts = tuple(
            str(each) if isinstance(each, int) and not isinstance(each, bool) else each for each in chords
        )
        if not all(isinstance(text, str) for text in texts):
            raise ClfractalError(
                f"must be a key such as Ctrl+S, or a list of keys, got {shown(given)}",
                Where(path=f"keys.{name}"),
            )
        found[str(name)] = texts
    try:
        KeyMap.from_settings(found)
    except ClfractalError as error:
        raise ClfractalError(error.message, Where(path=f"keys.{error.where.path}")) from None
    return found
