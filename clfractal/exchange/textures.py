"""Pictures on surfaces of a settings file, as maps of a material: colours, reliefs and light of one's own.

Of the ways in which theirs lay pictures on a surface ours have the one from three sides (cubic), and only along paths.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from clfractal.exchange.settings import Section
from clfractal.exchange.surroundings import SHARED_DIR, TEXTURES, picture_named

_MAPPINGS = ("spherical", "cubic", "cylindrical", "planar")
_CUBIC = 1
_SHARP = 16
"""How narrow the seams are between sides: theirs have none."""
_KINDS = ("color", "luminosity", "displacement")
_USES = ("use_{}_texture", "file_{}_texture", "{}_texture_intensity", "{}_texture_height")


def textures_of(main: Section, before: str, along_paths: bool, remarks: list[str]) -> dict[str, Any]:
    """Parts of a material that follow pictures; none that are switched off, not found, or laid on in another way.

    Args:
        before: what the material's keys begin with, such as `mat1_`.
        along_paths: whether the scene has light along paths.

    Raises:
        FileError: a value is none of its kind.
    """
    found: dict[str, Any] = {}
    for kind in _KINDS:
        use = f"{before}use_{kind}_texture"
        wanted = main.flag(use, False)
        file = main.text(f"{before}file_{kind}_texture", f"{SHARED_DIR}{TEXTURES}/{kind}_texture.jpg").strip()
        main.without(before + each.format(kind) for each in _USES)
        if not wanted:
            continue
        mapping = main.whole(f"{before}texture_mapping_type", 0)
        name = picture_named(file, Path(main.file).parent)
        if not along_paths:
            remarks.append(f"{use}: pictures on surfaces are for light along paths (--look ours)")
        elif mapping != _CUBIC:
            word = _MAPPINGS[mapping] if 0 <= mapping < len(_MAPPINGS) else str(mapping)
            remarks.append(f"{use}: pictures that are laid on surfaces in a {word} way are not taken over")
        elif name is None:
            remarks.append(
                f"{use}: {file[:500]!r} was not found beside the file, nor among the program's pictures"
            )
        else:
            found |= _part(main, before, kind, _map(main, before, name))
    return found


def _map(main: Section, before: str, name: str) -> dict[str, Any]:
    """A picture repeats after so many scene units, in all directions in theirs."""
    main.without(f"{before}texture_{key}" for key in ("scale", "mapping_type"))
    scale = main.vector(f"{before}texture_scale", (1.0, 1.0, 1.0))[0]
    return {"texture": name, "scale": min(max(abs(scale), 1e-6), 1e6), "sharpness": _SHARP}


def _part(main: Section, before: str, kind: str, shown: dict[str, Any]) -> dict[str, Any]:
    if kind == "color":
        return {"base": {"color": shown}}
    if kind == "luminosity":
        strength = max(main.number(f"{before}luminosity_texture_intensity", 1.0), 0.0)
        return {"emission": {"luminance": min(strength, 1e6), "color": shown}}
    height = main.number(f"{before}displacement_texture_height", 0.1)
    return {"bump": {"height": {**shown, "curve": [[0, 0], [1, height]]}}}
