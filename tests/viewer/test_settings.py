"""Settings of the window: read with every mistake at its place, written back as they are, never fatal."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

import platformdirs
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import ClfractalError, FileError
from clfractal.viewer.keys import KEYS, KeyEvent
from clfractal.viewer.settings import (
    ENVIRONMENT_VARIABLE,
    STYLES,
    Settings,
    load_settings,
    read_settings,
    settings_path,
)

KEYS_CHANGED = st.dictionaries(
    st.sampled_from(["save", "help", "chart"]),
    st.sampled_from([(), ("F13",), ("Ctrl+Alt+J", "F14")]),
    max_size=1,
)


def values_of(name: str) -> st.SearchStrategy[Any]:
    each = {field.name: field for field in fields(Settings)}[name]
    if isinstance(each.default, bool):
        return st.booleans()
    if name == "orbit":
        return st.sampled_from(STYLES)
    least, most = each.metadata["least"], each.metadata["most"]
    return st.integers(least, most) if isinstance(each.default, int) else st.floats(least, most)


ANY = st.builds(
    Settings,
    keys=KEYS_CHANGED,
    **{field.name: values_of(field.name) for field in fields(Settings) if field.name != "keys"},
)


@given(settings=ANY)
def test_what_is_saved_is_read(settings: Settings, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("settings") / "new" / "settings.yaml"
    settings.save(path)
    assert read_settings(path) == settings
    assert load_settings(path) == (settings, "")


def test_only_what_differs_is_saved(tmp_path: Path) -> None:
    path = tmp_path / "settings.yaml"
    Settings().save(path)
    assert [line for line in path.read_text().splitlines() if not line.startswith("#")] == []
    assert read_settings(path) == Settings()
    Settings(frame_rate=60.0, keys={"save": ("F13",)}).save(path)
    assert [line for line in path.read_text().splitlines() if not line.startswith("#")] == [
        "frame_rate: 60",
        "keys: {save: F13}",
    ]
    assert list(tmp_path.iterdir()) == [path]


def test_where_they_are(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.setenv(ENVIRONMENT_VARIABLE, str(tmp_path / "mine.yaml"))
    assert settings_path() == tmp_path / "mine.yaml"
    Settings(mouse=2.0).save()
    assert load_settings() == (Settings(mouse=2.0), "")
    monkeypatch.delenv(ENVIRONMENT_VARIABLE)
    monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path))
    assert settings_path().parent == Path(platformdirs.user_config_dir("clfractal"))
    assert load_settings() == (Settings(), "")  # there is no file yet


@pytest.mark.parametrize("text", ["", "\n\n", "# frame_rate: 60\n", "   # nothing\n#\n"])
def test_a_file_without_settings(text: str, tmp_path: Path) -> None:
    (tmp_path / "a").write_text(text)
    assert read_settings(tmp_path / "a") == Settings()


def test_the_limit_on_coarseness() -> None:
    assert Settings(coarsest=8).used_coarsest == 8
    assert Settings(coarsest=8, coarse=False).used_coarsest == 1


def test_keys_of_the_file(tmp_path: Path) -> None:
    (tmp_path / "a").write_text("keys:\n  save: F13\n  chart: []\n  exposure_reset: [9, Ctrl+Home]\n")
    settings, remark = load_settings(tmp_path / "a")
    assert remark == ""
    action = settings.key_map.matches(KeyEvent(KEYS["F13"]))
    assert action is not None
    assert action.name == "save"
    assert settings.key_map.hint("exposure_reset") == "9"
    assert settings.key_map.hint("chart") == ""


WRONG = {
    "frame_rate: 60\nframe_rat: 30\n": "a:2:1: frame_rat: unknown setting 'frame_rat'; did you mean 'frame_rate'?",
    "frame_rate: fast\n": "a:1:13: frame_rate: must be a number, got 'fast'",
    "coarse: true\nframe_rate: 0\n": "a:2:13: frame_rate: must be from 1 to 240, got 0",
    "coarsest: 2.5\n": "a:1:11: coarsest: must be a whole number, got 2.5",
    "coarse: 1\n": "a:1:9: coarse: must be true or false, got 1",
    "mouse: true\n": "a:1:8: mouse: must be a number, got true",
    "orbit: fre\n": "a:1:8: orbit: must be turntable or free, got 'fre'",
    "keys:\n  sav: F13\n": "a:2:3: keys.sav: unknown action 'sav'; did you mean 'save'?",
    "keys:\n  save: Ctrl+Escpe\n": "a:2:9: keys.save: unknown key 'Escpe'; did you mean 'Escape'? in 'Ctrl+Escpe'",
    "keys: {save: F1}\n": "a:1:14: keys.save: F1 is already the key of help; give help another one",
    "keys: {save: true}\n": "a:1:14: keys.save: must be a key such as Ctrl+S, or a list of keys, got true",
    "keys: [save]\n": "a:1:7: keys: must be a mapping of actions to keys, got a list of 1",
    "- frame_rate\n": "a:1:1: must be a mapping of settings to values",
    "frame_rate: [1\n": "a:2:1: not valid YAML: did not find expected ',' or ']'",
    "mouse: 1\nmouse: 2\n": "a:2:1: duplicate key 'mouse', first on line 1",
}


@pytest.mark.parametrize("text", WRONG)
def test_mistakes_are_told_in_one_line_and_the_defaults_are_used(
    text: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("a").write_text(text)
    with pytest.raises(ClfractalError) as caught:
        read_settings(Path("a"))
    assert str(caught.value) == WRONG[text]
    assert load_settings(Path("a")) == (Settings(), f"{WRONG[text]}; the default settings are used")


def test_files_that_cannot_be(tmp_path: Path) -> None:
    settings, remark = load_settings(tmp_path)
    assert settings == Settings()
    assert remark == f"{tmp_path}: is a folder, not a file; the default settings are used"
    (tmp_path / "file").write_text("")
    with pytest.raises(FileError, match="cannot be written"):
        Settings().save(tmp_path / "file" / "settings.yaml")


def test_every_setting_says_what_it_is() -> None:
    assert all(field.metadata["told"] for field in fields(Settings))
