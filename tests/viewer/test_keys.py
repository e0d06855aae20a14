"""The table of keys: complete, without clashes, the same on every layout where it flies."""

from __future__ import annotations

import string

import glfw
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.errors import ClfractalError
from clfractal.viewer.actions import ACTIONS
from clfractal.viewer.keys import ALT, CTRL, KEYS, SHIFT, SUPER, Chord, KeyEvent, KeyMap

US = {KEYS[sign]: sign.lower() for sign in KEYS if len(sign) == 1}
# What other layouts print where a US keyboard has these keys.
AZERTY = {
    **US,
    **{
        ord(a): b
        for a, b in zip(
            "AQWZM;,./'[]-=1234567890", "qazw,m;:!\u00f9^$)=&\u00e9\"'(-\u00e8_\u00e7\u00e0", strict=True
        )
    },
}
QWERTZ = {**US, **{ord(a): b for a, b in zip("YZ-=[/", "zyß\u00b4ü-", strict=True)}}
CYRILLIC = {**US, **{ord(a): b for a, b in zip("QWEASDZXCN", "йцуфывячст", strict=True)}}

# GLFW's names of keys that are called otherwise here.
NAMES = {
    "'": "APOSTROPHE",
    ",": "COMMA",
    "-": "MINUS",
    ".": "PERIOD",
    "/": "SLASH",
    ";": "SEMICOLON",
    "=": "EQUAL",
    "[": "LEFT_BRACKET",
    "\\": "BACKSLASH",
    "]": "RIGHT_BRACKET",
    "`": "GRAVE_ACCENT",
    "PageUp": "PAGE_UP",
    "PageDown": "PAGE_DOWN",
    "NumPoint": "KP_DECIMAL",
    "NumDivide": "KP_DIVIDE",
    "NumTimes": "KP_MULTIPLY",
    "NumMinus": "KP_SUBTRACT",
    "NumPlus": "KP_ADD",
    "NumEnter": "KP_ENTER",
    **{f"Num{digit}": f"KP_{digit}" for digit in range(10)},
}


def pressed(key: str, mods: int = 0, layout: dict[int, str] = US) -> KeyEvent:
    code = KEYS[key]
    return event(code, mods, layout)


def event(code: int, mods: int, layout: dict[int, str]) -> KeyEvent:
    return KeyEvent(code, code + 1000, mods, layout.get(code), frozenset(layout.values()))


def meant(key: str, mods: int = 0, layout: dict[int, str] = US, context: str = "picture") -> str | None:
    action = KeyMap.defaults().matches(pressed(key, mods, layout), context)  # type: ignore[arg-type]
    return action.name if action is not None else None


@pytest.mark.parametrize("name", KEYS)
def test_codes_are_those_of_glfw(name: str) -> None:
    assert KEYS[name] == getattr(glfw, f"KEY_{NAMES.get(name, name.upper())}")


def test_modifiers_are_those_of_glfw() -> None:
    assert (SHIFT, CTRL, ALT, SUPER) == (glfw.MOD_SHIFT, glfw.MOD_CONTROL, glfw.MOD_ALT, glfw.MOD_SUPER)


CONTRACT = {
    ("F1", 0): "help",
    ("F2", 0): "panels",
    ("F11", 0): "full_screen",
    ("S", CTRL): "save",
    ("S", CTRL | SHIFT): "save_as",
    ("Z", CTRL): "undo",
    ("Z", CTRL | SHIFT): "redo",
    ("Z", ALT): "undo_camera",
    ("Z", ALT | SHIFT): "redo_camera",
    ("Escape", 0): "cancel",
    ("W", 0): "fly_forward",
    ("A", 0): "fly_left",
    ("S", 0): "fly_back",
    ("D", 0): "fly_right",
    ("D", SHIFT): "fly_right",
    ("Num1", CTRL): "view_back",
    ("Num7", 0): "view_top",
    ("5", 0): "projection",
    ("9", CTRL): "bookmark_9",
    ("Home", 0): "frame_all",
    ("W", CTRL): None,
    ("F24", 0): None,
}


@pytest.mark.parametrize(("key", "mods"), CONTRACT)
def test_the_keys_that_are_promised(key: str, mods: int) -> None:
    assert meant(key, mods) == CONTRACT[key, mods]
    # Caps Lock and Num Lock change nothing.
    assert meant(key, mods | glfw.MOD_CAPS_LOCK | glfw.MOD_NUM_LOCK) == CONTRACT[key, mods]


def test_no_two_actions_share_a_chord() -> None:
    assert list(KeyMap.defaults().conflicts()) == []


@pytest.mark.parametrize("layout", [US, AZERTY, QWERTZ, CYRILLIC], ids=["us", "azerty", "qwertz", "cyrillic"])
@pytest.mark.parametrize("context", ["picture", "fly", "text"])
def test_on_every_layout_a_key_means_one_action_and_each_action_has_a_key(
    layout: dict[int, str], context: str
) -> None:
    keys = KeyMap.defaults()
    reached = set()
    for code in KEYS.values():
        for mods in range(16):
            found = keys.matches(event(code, mods, layout), context)  # type: ignore[arg-type]
            reached |= {found.name} if found is not None else set()
    assert reached == {name for name, action in ACTIONS.items() if context in action.contexts}


def test_flying_is_by_position_and_letters_are_by_print() -> None:
    for layout in (AZERTY, QWERTZ, CYRILLIC):
        flown = [meant(key, 0, layout) for key in "WASD"]
        assert flown == ["fly_forward", "fly_left", "fly_back", "fly_right"]
    assert meant("W", CTRL, AZERTY) == "undo"  # where Z is printed
    assert meant("Z", CTRL, AZERTY) is None
    assert meant("Y", CTRL, QWERTZ) == "undo"
    # Without Latin letters: as on a US keyboard.
    assert meant("Z", CTRL, CYRILLIC) == "undo"
    assert meant("N", 0, CYRILLIC) == "next_stereo"


def test_signs_and_digits_are_by_print_where_they_are_printed() -> None:
    """Separation and brightness: the comma of AZERTY is where M was, its equals sign right of a parenthesis."""
    assert meant("M", 0, AZERTY) == "eyes_nearer"
    assert meant(",", 0, AZERTY) is None  # a semicolon
    assert meant(";", 0, AZERTY) == "fit_stereo"  # the M
    assert meant("6", 0, AZERTY) == "exposure_down"  # the minus
    assert meant("-", 0, AZERTY) is None  # a parenthesis
    assert meant("/", 0, QWERTZ) == "exposure_down"
    # What is printed on no key without Shift is where a US keyboard has it.
    assert meant(".", 0, AZERTY) == "eyes_farther"
    assert meant("1", 0, AZERTY) == "view_front"
    assert meant("6", CTRL, AZERTY) == "bookmark_6"
    assert meant("[", 0, QWERTZ) == "roll_left"


def test_while_a_text_is_typed_only_keys_that_type_nothing_act() -> None:
    for key in (*string.ascii_uppercase, *string.digits, "Space", "Enter", "Left", "Home", "Backspace", "-"):
        assert meant(key, context="text") is None
        assert meant(key, SHIFT, context="text") is None
    assert meant("Z", CTRL, context="text") is None  # the field's own undo
    assert meant("C", CTRL, context="text") is None
    assert meant("S", CTRL, context="text") == "save"
    assert meant("Escape", context="text") == "cancel"


def test_a_key_that_glfw_does_not_know_means_nothing() -> None:
    assert KeyMap.defaults().matches(KeyEvent(-1, 240)) is None


CHORDS = st.builds(Chord, st.sampled_from(sorted(KEYS)), st.integers(0, 15), st.just("position")) | st.builds(
    Chord,
    st.sampled_from([key for key in KEYS if len(key) == 1] + ["ß", "Ö", "#"]),
    st.integers(0, 15),
    st.just("label"),
)


@given(CHORDS)
def test_chords_are_read_as_they_are_written(chord: Chord) -> None:
    assert Chord.parse(chord.text) == chord
    assert Chord.parse(chord.text.lower().replace("+", " + ")) in (
        chord,
        Chord(chord.key.lower(), chord.mods, chord.by),
    )


@pytest.mark.parametrize(
    ("text", "written"),
    [
        ("1", "1"),
        ("Pos:-", "Pos:-"),
        ("ctrl+shift+z", "Ctrl+Shift+Z"),
        ("Shift+Control+Z", "Ctrl+Shift+Z"),
        ("Alt+F", "Alt+F"),
        ("pos:w", "Pos:W"),
        ("Ctrl+Pos:Y", "Ctrl+Pos:Y"),
        ("Label:Z", "Z"),
        ("Pos:1", "Pos:1"),
        ("esc", "Escape"),
        ("Page Up", "PageUp"),
        ("Ctrl+,", "Ctrl+,"),
        ("label:-", "-"),
        ("ö", "Ö"),
    ],
)
def test_writing_of_chords(text: str, written: str) -> None:
    assert Chord.parse(text).text == written


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("Ctlr+Z", "unknown modifier 'Ctlr'; did you mean 'Ctrl'? in 'Ctlr+Z'"),
        ("Ctrl+Escpe", "unknown key 'Escpe'; did you mean 'Escape'? in 'Ctrl+Escpe'"),
        ("Ctrl+", "names no key: 'Ctrl+'"),
        ("", "names no key: ''"),
        ("Ctrl+Ctrl+Z", "Ctrl is given twice in 'Ctrl+Ctrl+Z'"),
        ("Label:F1", "F1 has no label; write it without Label: in 'Label:F1'"),
    ],
)
def test_chords_that_are_none(text: str, message: str) -> None:
    with pytest.raises(ClfractalError) as caught:
        Chord.parse(text)
    assert str(caught.value) == message


def test_other_keys_for_actions() -> None:
    keys = KeyMap.from_settings(
        {"save": ["F13", "Ctrl+W"], "help": [], "fly_forward": "Up", "orbit_up": "Pos:W", "pan_up": []}
    )
    assert keys.changes()["save"] == ["F13", "Ctrl+W"]
    assert keys.matches(pressed("F1")) is None
    assert keys.matches(pressed("S", CTRL)) is None
    found = [keys.matches(pressed(key)) for key in ("F13", "Up", "W")]
    assert [action.name for action in found if action] == ["save", "fly_forward", "orbit_up"]
    assert keys.hint("save") == "F13"
    assert keys.hint("help") == ""
    assert KeyMap.from_settings(keys.changes()).changes() == keys.changes()
    assert KeyMap.defaults().changes() == {}


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"sav": "F13"}, "sav: unknown action 'sav'; did you mean 'save'?"),
        ({"save": "Ctrl+"}, "save: names no key: 'Ctrl+'"),
        ({"save": "Ctrl+O"}, "save: Ctrl+O is already the key of open; give open another one"),
        ({"next_stereo": "Shift+Pos:W"}, "next_stereo: Shift+W is already the key of fly_forward"),
        ({"help": "F2"}, "help: F2 is already the key of panels; give panels another one"),
    ],
)
def test_keys_that_are_refused(changes: dict[str, str], message: str) -> None:
    with pytest.raises(ClfractalError) as caught:
        KeyMap.from_settings(changes)
    assert str(caught.value).startswith(message)


def test_the_help_has_every_action_once() -> None:
    rows = KeyMap.defaults().help_rows()
    assert len({(group, told) for group, _, told in rows}) == len(rows)
    assert {(group, told) for group, _, told in rows} == {(a.group, a.help) for a in ACTIONS.values()}
    assert ("Camera", "Ctrl+1 to Ctrl+9", "go to a bookmark") in rows
    assert ("Fly", "W / S", "forward, back") in rows
    assert ("Camera", "1 / Shift+1, Num 1 / Ctrl+Num 1", "from the front, the back") in rows


def test_the_help_shows_what_is_printed_on_the_keys() -> None:
    keys = KeyMap.defaults()
    keys.layout = AZERTY
    rows = keys.help_rows()
    assert ("Fly", "Z / S", "forward, back") in rows
    assert ("Stereo", ", / :", "distance between the eyes, smaller, larger") in rows
    assert ("Picture", "- / =", "darker, lighter") in rows
    assert ("Camera", "^ / $", "roll") in rows
    assert keys.hint("fly_left") == "Q"
    assert ("Undo", "Ctrl+Z / Ctrl+Shift+Z, Ctrl+Y", "undo and redo a change of the scene") in rows


def test_an_action_without_keys_is_not_in_the_help() -> None:
    rows = KeyMap.from_settings({"chart": []}).help_rows()
    assert "alignment chart for projectors" not in [told for _, _, told in rows]
