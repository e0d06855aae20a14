"""Why a file's picture is not as theirs: what of it was dropped, and what it has that our pictures do in another way."""

from __future__ import annotations

import re
from collections.abc import Sequence

from clfractal.exchange.mandelbulber import Imported
from clfractal.exchange.settings import Settings

UNION, MIDDLE, NINTH = 0.98, 0.01, 0.05
"""What is alike: intersection over union of silhouettes, depth in the middle and at nine tenths."""

_SHAPES = re.compile(
    r"(?:line \d+: )?(perspective_type|formula_(?:weight|position|rotation|repeat|scale)_?\w*|repeat|check_for_bailout"
    r"|fractal_position|fractal_rotation|limits?_\w+|primitive_\w+|all_primitives_\w+|mat\d_displacement\w*|sweet_spot"
    r"|\S+ formula|formula \d+|stereo|c_add|boolean_operator_\w+|target|camera_top|box_folding\w*|spherical_folding\w*)\b"
)
"""Remarks on what changes the silhouette, by what they begin with."""
_HARMLESS = re.compile(
    r"_(material_id|rounding|texture\w*|reflection|color|iterations|position)\b.* is not taken over"
)


def dropped(found: Imported) -> list[str]:
    """What of a file's shapes is not taken over, by key."""
    keys = []
    for remark in found.remarks:
        match = _SHAPES.match(remark)
        if match and not (remark.startswith("line") and "primitive" in remark and _HARMLESS.search(remark)):
            keys.append(match[1])
    return keys


def habits(settings: Settings) -> list[str]:
    """Ways of theirs to find a surface that is not the set's: of a file with a difference one of them may be the cause."""
    main = settings.main
    found = []
    if main.flag("interior_mode", False):
        found.append("interior mode")
    if main.flag("constant_DE_threshold", False):
        found.append("constant threshold")
    if main.flag("iteration_threshold_mode", False):
        found.append("iteration threshold")
    if not main.flag("use_default_bailout", True):
        found.append("bailout")
    if main.flag("hybrid_fractal_enable", False):
        found.append("hybrid")
    if main.flag("boolean_operators", False):
        found.append("booleans")
    if main.flag("limits_enabled", False):
        found.append("limits")
    if any(main.beginning("primitive_")):
        found.append("primitives")
    if main.flag("julia_mode", False):
        found.append("julia")
    method, function = main.text("delta_DE_method"), main.text("delta_DE_function")
    if method:
        found.append(f"DE method {method}")
    if function:
        found.append(f"DE function {function}")
    return found


def verdict(record: dict[str, object]) -> str:
    """In a word: `alike`, or what is wrong."""
    if record.get("error"):
        return "not opened" if record["stage"] == "open" else str(record["stage"])
    if record["dropped"]:
        return "dropped"
    bad = []
    covered, union = _number(record["covered"]), _number(record["union"])
    if 0.05 <= covered <= 0.9 and union < UNION:
        bad.append("silhouette")
    middle, ninth = _number(record["middle"]), _number(record["ninth"])
    if middle > MIDDLE or ninth > NINTH:
        bad.append("depth")
    # Of the deepest views theirs cannot be told.
    if middle != middle and record.get("spread") is not None:
        bad.append("no depth")
    return ", ".join(bad) or "alike"


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else float("nan")


def summary(records: Sequence[dict[str, object]]) -> list[str]:
    """The figures over all files."""
    import numpy as np

    opened = [each for each in records if each.get("stage") != "open" and not each.get("dropped")]
    lines = [f"{len(records)} files, {len(opened)} open ({_share(len(opened), len(records))})"]
    measured = [each for each in opened if not each.get("error")]
    outlined = [each for each in measured if 0.05 <= _number(each["covered"]) <= 0.9]
    alike = [each for each in outlined if _number(each["union"]) >= UNION]
    lines.append(
        f"silhouettes: {len(alike)} of {len(outlined)} that cover 5 to 90 % are alike ({_share(len(alike), len(outlined))})"
    )
    middles = [m for each in measured if (m := _number(each["middle"])) == m]
    ninths = [m for each in measured if (m := _number(each["ninth"])) == m]
    if middles:
        lines.append(
            f"depth: of {len(middles)} files {_share(sum(m <= MIDDLE for m in middles), len(middles))} within 1 % in the"
            f" middle, {_share(sum(m <= NINTH for m in ninths), len(ninths))} within 5 % at nine tenths;"
            f" median file {100 * float(np.median(middles)):.2f} % and {100 * float(np.median(ninths)):.2f} %"
        )
    calm = sum(bool(each.get("calm")) for each in measured)
    if calm:
        lines.append(f"~ {calm} with water, which is compared without its waves")
    counts: dict[str, int] = {}
    for each in records:
        word = verdict(each)
        counts[word] = counts.get(word, 0) + 1
    lines.append(
        ", ".join(f"{word} {count}" for word, count in sorted(counts.items(), key=lambda one: -one[1]))
    )
    return lines


def _share(part: int, whole: int) -> str:
    return f"{100 * part / whole:.1f} %" if whole else "none"
