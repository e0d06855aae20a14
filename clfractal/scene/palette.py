"""Palettes: 256 linear colours for a scene's coloring, from a name or from stops."""

from __future__ import annotations

from collections.abc import Sequence
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from clfractal.errors import SceneError, Where, nearest
from clfractal.files.srgb import decode
from clfractal.scene.palettes import PALETTES, table

if TYPE_CHECKING:
    from cmap import Colormap

    from clfractal.scene.coloring import Coloring
    from clfractal.schema.stops import Stop

SIZE = 256


def palette_table(coloring: Coloring) -> NDArray[np.float32]:
    """The palette as an array of shape (256, 3): linear Rec. 709, entry i for place i / 255.

    Raises:
        SceneError: no palette has this name.
    """
    return named_table(coloring.palette)


def named_table(palette: str | Sequence[Stop]) -> NDArray[np.float32]:
    """As `palette_table`, of a palette by its name or stops."""
    return _named(palette).copy() if isinstance(palette, str) else _from_stops(palette)


def check_palette(palette: str | Sequence[Stop], path: str = "coloring.palette") -> None:
    """Raises SceneError, at the key that it stands under, for a name that no palette has."""
    if isinstance(palette, str) and palette.removesuffix("_r") not in PALETTES:
        _colormap(palette, path)


def _from_stops(stops: Sequence[Stop]) -> NDArray[np.float32]:
    """Mixed linearly between stops; constant before the first and after the last."""
    places = np.linspace(0.0, 1.0, SIZE)
    at = [stop.at for stop in stops]
    columns = [np.interp(places, at, [stop.color[i] for stop in stops]) for i in range(3)]
    return np.stack(columns, axis=1).astype(np.float32)


@lru_cache(maxsize=16)
def _named(name: str) -> NDArray[np.float32]:
    own = PALETTES.get(name.removesuffix("_r"))
    if own is not None:
        # As cmap writes it: backwards.
        return table(own, SIZE)[:: -1 if name.endswith("_r") else 1]
    colors = np.asarray(_colormap(name)(np.linspace(0.0, 1.0, SIZE)), dtype=np.float64)
    return decode(colors[:, :3]).astype(np.float32)


def _colormap(name: str, path: str = "coloring.palette") -> Colormap:
    # Here, since it takes longer to import than a small picture to render.
    from cmap import Colormap

    try:
        return Colormap(name)
    except Exception as error:  # cmap raises many kinds for a name it does not know
        guess = nearest(name, names())
        hint = (
            f"; did you mean {guess!r}?"
            if guess
            else f"; known: {', '.join(PALETTES)}, and the names of cmap's catalog"
        )
        raise SceneError(f"unknown palette {name[:60]!r}{hint}", Where(path=path)) from error


def names() -> list[str]:
    """All names of palettes: our own first, then those of cmap's catalog, in full and short."""
    from cmap import Catalog

    return [*PALETTES, *{key for full in Catalog() for key in (full, full.split(":")[-1])}]
