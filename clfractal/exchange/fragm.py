"""A fragment of Fragmentarium or FragM as a scene, with a line for all in it that was not taken over."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from clfractal.errors import FileError, Where, unknown_name
from clfractal.exchange.frag_file import Fragment, parse_fragment, read_fragment
from clfractal.exchange.frag_follow import follow
from clfractal.exchange.frag_formula import Writer
from clfractal.exchange.frag_look import DEFAULTS, METHOD, Look, look_of, view_of
from clfractal.exchange.frag_measure import measure
from clfractal.exchange.glsl_text import read_code
from clfractal.exchange.glsl_tree import SIZES, Code
from clfractal.exchange.mandelbulber import Imported

MAX_NUMBER = 1e9


def import_fragment(path: Path, preset: str | None = None) -> Imported:
    """Reads a fragment with a distance as a scene.

    Args:
        preset: the name of the preset that gives parameters their values; None: `Default`, else the first one.

    Raises:
        FileError: the file cannot be read, is outside of the part of GLSL that is read, with its line and column, or has
            no preset of that name.
    """
    return imported_fragment(read_fragment(path), preset)


def import_fragment_text(
    text: str, file: str = "fragment", preset: str | None = None, folder: Path | None = None
) -> Imported:
    """As `import_fragment`, of a text; `folder`: where included files are; None: nowhere."""
    return imported_fragment(parse_fragment(text, file, folder), preset)


def imported_fragment(fragment: Fragment, preset: str | None = None) -> Imported:
    """A fragment that was read as a scene."""
    file, remarks = fragment.file, list(fragment.remarks)
    code = read_code(fragment.words, file)
    values = _values(fragment, code, preset, remarks)
    followed = follow(code, file, values)
    writer = Writer(followed, values, file)
    formula: dict[str, Any] = {
        "title": (fragment.info or Path(file).stem)[:60] or "Fragment",
        "reference": f"made of {Path(file).name}, a fragment of FragM",
        **writer.write(),
    }
    look = Look(values, remarks)
    scene: dict[str, Any] = {"version": 1}
    iterations = followed.orbit.count if followed.orbit is not None else 1
    view = view_of(look)
    measure(formula, max(iterations, 1), view["camera"]["position"], file)
    fudge = look.number("FudgeFactor")
    formula["step_scale"] = round(min(max(fudge, 0.01), 1.0), 6) if fudge > 0 else 1
    scene["formula"] = {"inline": formula, "iterations": max(iterations, 1)}
    scene |= view
    has_z = followed.orbit is not None and any(
        name not in formula.get("state", {}) for name in _given(formula)
    )
    traps = has_z and any(word.text == "orbitTrap" for word in fragment.words)
    scene |= look_of(look, view["camera"], traps)
    _tell(fragment, code, values, followed.fixed, look, remarks)
    return Imported(scene, tuple(dict.fromkeys(remarks)), _origins(fragment), "a fragment of FragM")


def _origins(fragment: Fragment) -> tuple[str, ...]:
    return tuple(f"includes {name}" for name in fragment.files)


def _given(formula: Mapping[str, Any]) -> set[str]:
    """What a turn gives values to."""
    found: set[str] = set()
    pending = list(formula.get("do", ()))
    while pending:
        each = pending.pop()
        if "when" in each:
            pending += each["do"]
        else:
            found |= each.keys() & {"x", "y", "z"}
    return found


def _values(
    fragment: Fragment, code: Code, preset: str | None, remarks: list[str]
) -> dict[str, tuple[float, ...]]:
    """The numbers of uniforms, and of what files that render have, in a preset."""
    name = _chosen(fragment, preset)
    settings = fragment.presets[name] if name is not None else {}
    others = [each for each in fragment.presets if each != name]
    if others:
        shown = ", ".join(others[:8]) + (", ..." if len(others) > 8 else "")
        remarks.append(f"the preset {name} is taken; there are others: {shown}")
    if name is None:
        remarks.append("there is no preset; parameters have the first values of their sliders")
    found: dict[str, tuple[float, ...]] = {}
    for key, setting in settings.items():
        numbers = _numbers(setting.text)
        uniform = code.uniforms.get(key)
        wanted = SIZES.get(uniform.type, 0) if uniform is not None else 0
        if numbers is None or (wanted and len(numbers) != wanted):
            if wanted or key in DEFAULTS:
                wanted = wanted or len(DEFAULTS[key])
                raise FileError(
                    f"must be {wanted} number{'s' if wanted > 1 else ''}, got {setting.text[:40]!r}",
                    setting.where,
                )
            continue
        found[key] = numbers
    for key, uniform in code.uniforms.items():
        if uniform.values is not None:
            found.setdefault(key, uniform.values)
    return found


def _chosen(fragment: Fragment, preset: str | None) -> str | None:
    if preset is not None:
        if preset not in fragment.presets:
            raise FileError(unknown_name("preset", preset, fragment.presets), Where(fragment.file))
        return preset
    for name in fragment.presets:
        if name.lower() == "default":
            return name
    return next(iter(fragment.presets), None)


def _numbers(text: str) -> tuple[float, ...] | None:
    """The numbers of a preset's line; what stands behind them, as `Locked`, has no meaning here."""
    words = text.split()
    while words and words[-1].lower() in ("locked", "notlocked", "notlockable"):
        words.pop()
    found = []
    for word in "".join(words).split(","):
        if word in ("true", "false"):
            found.append(float(word == "true"))
            continue
        try:
            number = float(word) if len(word) <= 40 and "_" not in word else MAX_NUMBER * 2
        except ValueError:
            return None
        if not abs(number) <= MAX_NUMBER:
            return None
        found.append(number)
    return tuple(found) if len(found) <= 4 else None


def _tell(
    fragment: Fragment,
    code: Code,
    values: Mapping[str, tuple[float, ...]],
    fixed: frozenset[str],
    look: Look,
    remarks: list[str],
) -> None:
    """Lines for what was not taken over."""
    if fixed:
        names = ", ".join(sorted(fixed))
        remarks.append(f"{names}: numbers of the formula or its `iterations`, not parameters")
    if "baseColor" in code.functions:
        remarks.append("baseColor: its colours are not taken over")
    known = {*look.seen, *code.uniforms}
    method = [key for key in values if key in METHOD and key not in known]
    if method:
        remarks.append(f"{len(method)} keys of how their rays find the surface: ours find it by themselves")
    for key, numbers in values.items():
        if key not in known and key not in METHOD:
            shown = ", ".join(f"{each:g}" for each in numbers)
            remarks.append(f"{key} = {shown[:60]} is not taken over")
