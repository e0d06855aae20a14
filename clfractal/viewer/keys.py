"""The table of keys: actions, the chords that call them, and which action an event of the keyboard means.

Flying is by position: where W, A, S and D are on a US keyboard, whatever is printed there. Letters, digits and signs of
other actions are by what is printed, so that Ctrl+Z is the key with a Z on it. What a layout prints on no key of its own
(digits of AZERTY, which want Shift; Latin letters of a Cyrillic one) is where a US keyboard has it. Keys with names have
one place everywhere.
"""

from __future__ import annotations

import string
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Literal, TypeAlias

from clfractal.errors import ClfractalError, Where, unknown_name
from clfractal.viewer.actions import ACTIONS, Action, Context

SHIFT, CTRL, ALT, SUPER = 1, 2, 4, 8
_MODIFIERS = {"Ctrl": CTRL, "Alt": ALT, "Shift": SHIFT, "Super": SUPER}
_USED_MODIFIERS = SHIFT | CTRL | ALT | SUPER  # not Caps Lock, not Num Lock

# GLFW 3.4, "Keyboard key tokens": printable keys have their ASCII codes, the others begin at 256.
_SIGNS = "',-./;=[\\]`"
_FROM_256 = ("Escape", "Enter", "Tab", "Backspace", "Insert", "Delete", "Right", "Left", "Down", "Up")
_FROM_266 = ("PageUp", "PageDown", "Home", "End")
_FROM_330 = ("NumPoint", "NumDivide", "NumTimes", "NumMinus", "NumPlus", "NumEnter")
KEYS: Mapping[str, int] = {
    **{sign: ord(sign) for sign in string.ascii_uppercase + string.digits + _SIGNS},
    **{name: 256 + place for place, name in enumerate(_FROM_256)},
    **{name: 266 + place for place, name in enumerate(_FROM_266)},
    **{f"F{number}": 289 + number for number in range(1, 26)},
    **{f"Num{digit}": 320 + digit for digit in range(10)},
    **{name: 330 + place for place, name in enumerate(_FROM_330)},
    "Space": 32,
    "Pause": 284,
    "Menu": 348,
}
"""Names of keys and GLFW's codes, which stand for positions on a US keyboard."""

_OTHER_NAMES = {
    "esc": "Escape",
    "return": "Enter",
    "del": "Delete",
    "ins": "Insert",
    "pgup": "PageUp",
    "pgdn": "PageDown",
    "page up": "PageUp",
    "page down": "PageDown",
    "comma": ",",
    "period": ".",
    "minus": "-",
    "equal": "=",
}
_OTHER_MODIFIERS = {"control": "Ctrl", "win": "Super", "cmd": "Super", "meta": "Super"}
_KEYS_BY_LOWER = {**{name.lower(): name for name in KEYS}, **_OTHER_NAMES}
_MODIFIERS_BY_LOWER = {**{name.lower(): name for name in _MODIFIERS}, **_OTHER_MODIFIERS}

By: TypeAlias = Literal["position", "label"]
Layout: TypeAlias = Mapping[int, str]
"""What a keyboard layout prints on the keys that have one character, by their codes."""
Found: TypeAlias = Literal["position", "label", "place"]
"""How an event was found to be a chord: by its position, its label, or the place of a label that is printed nowhere."""
PRINTABLE = tuple(code for name, code in KEYS.items() if len(name) == 1)
"""The codes of keys that have a character printed on them."""


@dataclass(frozen=True, slots=True)
class KeyEvent:
    """A key that went down.

    Attributes:
        key: GLFW's code, which stands for a position; -1 for keys that it does not know.
        scancode: the system's number of the key.
        mods: GLFW's bits of the modifiers.
        name: what the keyboard layout prints on the key (`get_key_name`), or None.
        printed: all that the layout prints on keys, in lower case.
    """

    key: int
    scancode: int = 0
    mods: int = 0
    name: str | None = None
    printed: frozenset[str] = frozenset()


@dataclass(frozen=True, slots=True)
class Chord:
    """A key with modifiers, found by its position or by what is printed on it.

    Attributes:
        key: a name of `KEYS`; for `label` also another single character, such as `ß`.
        mods: GLFW's bits of the modifiers that must be held, and no others.
    """

    key: str
    mods: int = 0
    by: By = "position"

    @classmethod
    def parse(cls, text: str) -> Chord:
        """Reads `F1`, `Ctrl+Shift+Z`, `Alt+,`; `Pos:W` is where a US keyboard has a W.

        Raises:
            ClfractalError: unknown key or modifier, or none.
        """
        *words, last = (word.strip() for word in text.split("+"))
        mods = 0
        for word in words:
            name = _MODIFIERS_BY_LOWER.get(word.lower())
            if name is None:
                raise ClfractalError(f"{unknown_name('modifier', word, _MODIFIERS)} in {text[:40]!r}")
            if mods & _MODIFIERS[name]:
                raise ClfractalError(f"{name} is given twice in {text[:40]!r}")
            mods |= _MODIFIERS[name]
        how, colon, rest = last.partition(":")
        way: By | None = {"pos": "position", "label": "label"}.get(how.lower()) if colon and rest else None  # type: ignore[assignment]
        wanted = rest.strip() if way is not None else last
        found = _KEYS_BY_LOWER.get(wanted.lower())
        if found is None and len(wanted) == 1 and wanted.isprintable() and way != "position":
            return cls(wanted.upper() if len(wanted.upper()) == 1 else wanted, mods, "label")
        if found is None:
            if not wanted:
                raise ClfractalError(f"names no key: {text[:40]!r}")
            raise ClfractalError(f"{unknown_name('key', wanted, KEYS)} in {text[:40]!r}")
        if way == "label" and len(found) > 1:
            raise ClfractalError(f"{found} has no label; write it without Label: in {text[:40]!r}")
        return cls(found, mods, way or ("label" if len(found) == 1 else "position"))

    @property
    def text(self) -> str:
        """As `parse` reads it."""
        return self._with_modifiers(f"{self._prefix}{self.key}")

    def shown(self, layout: Layout | None = None) -> str:
        """As people read it; on a `layout` positions, and signs that it prints nowhere, have what is printed there."""
        if layout is not None and len(self.key) == 1 and self.key in KEYS:
            nowhere = self.key in _SIGNS and self.key not in layout.values()
            printed = layout.get(KEYS[self.key], "") if self.by == "position" or nowhere else ""
            if len(printed) == 1:
                return self._with_modifiers(printed.upper() if len(printed.upper()) == 1 else printed)
        words = {"PageUp": "Page Up", "PageDown": "Page Down"}
        key = words.get(self.key, f"Num {self.key[3:]}" if self.key.startswith("Num") else self.key)
        return self._with_modifiers(key)

    def means(self, event: KeyEvent, *, any_shift: bool = False) -> Found | None:
        """How an event is this chord; None if it is not. `any_shift`: with or without Shift."""
        ignored = SHIFT if any_shift else 0
        if (event.mods & _USED_MODIFIERS & ~ignored) != (self.mods & ~ignored):
            return None
        at_its_place = self.key in KEYS and event.key == KEYS[self.key]
        if self.by == "position":
            return "position" if at_its_place else None
        name = event.name or ""
        if self.key in (name, name.upper()):
            return "label"
        return "place" if at_its_place and self.key.lower() not in event.printed else None

    def _with_modifiers(self, key: str) -> str:
        return "+".join([*(name for name, bit in _MODIFIERS.items() if self.mods & bit), key])

    @property
    def _prefix(self) -> str:
        usual: By = "label" if len(self.key) == 1 else "position"
        return "" if self.by == usual else {"position": "Pos:", "label": "Label:"}[self.by]


class KeyMap:
    """Which chords call which actions.

    Args:
        chords: action name to its chords; an action that is not named has none.

    Attributes:
        layout: of the keyboard, for what people read; None: as on a US keyboard.
    """

    def __init__(self, chords: Mapping[str, Sequence[Chord]]) -> None:
        self.layout: Layout | None = None
        self._chords = {action.name: tuple(chords.get(action.name, ())) for action in ACTIONS.values()}

    @classmethod
    def defaults(cls) -> KeyMap:
        """The keys that the program comes with."""
        return cls({name: [Chord.parse(text) for text in action.keys] for name, action in ACTIONS.items()})

    @classmethod
    def from_settings(cls, changes: Mapping[str, str | Sequence[str]]) -> KeyMap:
        """The defaults with other chords for some actions: action name to a chord or a list of them; [] for none.

        Raises:
            ClfractalError: an unknown action or key, or one chord for two actions; its path is the action's name.
        """
        chords = {name: list(found) for name, found in cls.defaults()._chords.items()}
        for name, given in changes.items():
            if name not in ACTIONS:
                raise ClfractalError(unknown_name("action", str(name), ACTIONS), Where(path=str(name)[:60]))
            texts = [given] if isinstance(given, str) else given
            try:
                chords[name] = [Chord.parse(text) for text in texts]
            except ClfractalError as error:
                raise ClfractalError(error.message, Where(path=name)) from None
        found = cls(chords)
        for first, second, chord in found.conflicts():
            changed, other = (second, first) if second in changes else (first, second)
            raise ClfractalError(
                f"{chord.shown()} is already the key of {other}; give {other} another one",
                Where(path=changed),
            )
        return found

    def changes(self) -> dict[str, list[str]]:
        """What differs from the defaults, as `from_settings` reads it."""
        usual = KeyMap.defaults()
        return {
            name: [chord.text for chord in chords]
            for name, chords in self._chords.items()
            if chords != usual._chords[name]
        }

    def matches(self, event: KeyEvent, context: Context = "picture") -> Action | None:
        """The action that a key means in a context, or None; a position wins over a letter that is printed there."""
        found = {
            chord.means(event, any_shift=action.held): action
            for action, chord in reversed([*self._all(context)])
        }
        ways: tuple[Found, ...] = ("position", "label", "place")
        return next((found[way] for way in ways if way in found), None)

    def conflicts(self) -> Iterator[tuple[str, str, Chord]]:
        """Pairs of actions with the same chord in a context that they share, on a US keyboard."""
        taken: dict[tuple[Context, int | str, int], str] = {}
        for context in ("picture", "fly", "text"):
            for action, chord in self._all(context):
                for mods in {chord.mods, *({chord.mods | SHIFT} if action.held else ())}:
                    other = taken.setdefault((context, KEYS.get(chord.key, chord.key), mods), action.name)
                    if other != action.name:
                        yield other, action.name, chord

    def help_rows(self) -> list[tuple[str, str, str]]:
        """(group, keys, help) for the overlay of keys, in the table's order; actions with the same help are one row."""
        rows = []
        for (group, told), actions in groupby(ACTIONS.values(), lambda action: (action.group, action.help)):
            each = [[chord.shown(self.layout) for chord in self._chords[action.name]] for action in actions]
            if any(each):
                rows.append((group, _keys_text([texts for texts in each if texts]), told))
        return rows

    def hint(self, name: str) -> str:
        """The first chord of an action, for menus and buttons; empty if it has none."""
        return next((chord.shown(self.layout) for chord in self._chords[name]), "")

    def _all(self, context: Context) -> Iterator[tuple[Action, Chord]]:
        for name, chords in self._chords.items():
            if context in ACTIONS[name].contexts:
                yield from ((ACTIONS[name], chord) for chord in chords)


def _keys_text(actions: Sequence[Sequence[str]]) -> str:
    """`W` for one action, `W, Num 1` with two chords, `A / D` for two, `Ctrl+1 to Ctrl+9` for many."""
    if len(actions) > 4:
        return f"{actions[0][0]} to {actions[-1][0]}"
    if len({len(texts) for texts in actions}) == 1:
        return ", ".join(" / ".join(texts[place] for texts in actions) for place in range(len(actions[0])))
    return " / ".join(", ".join(texts) for texts in actions)


__all__ = ["ACTIONS", "KEYS", "Action", "Chord", "Context", "KeyEvent", "KeyMap", "Layout"]
