"""Makes the small pictures of docs/*.md that show what a setting does, from the table docs/pictures.yaml.

    python docs/make_pictures.py                every picture (minutes)
    python docs/make_pictures.py light_rays     one of them

A picture is a row of panels (or several rows of them). Each panel is one scene of the table with some values replaced,
rendered at the panel's size; between panels the picture is transparent. Nothing is random: the same program on the
same device makes the same files. They are lossless where that is small enough, else as good as LARGEST_FILE of the
gallery allows.

Keys of the table:

    scenes      name: a whole scene
    pictures    name: a picture, which becomes docs/pictures/NAME.webp
      page      the page of docs/ that shows it
      scene     a name of `scenes`
      set       dotted key: value, replaced in every panel
      panels    one mapping of dotted keys to values for each panel. With `show: samples` a panel shows that channel
                instead of the colours: from none, dark, to `renderer.samples`, light. With `show: left` or `right`
                it shows what that eye sees of an anaglyph through its filter; with `albedo`, `direct` or
                `indirect` that layer. With `coarser: 4` its pixels are four times as wide, and as many fewer
      columns   panels in a row; all of them if not given
      size      width and height of a panel, pixels
      zoom      each pixel of a panel is shown as a square of so many; 1 if not given
"""

from __future__ import annotations

import io
import json
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt
import yaml
from make_gallery import LARGEST_FILE, PICTURES, small_enough
from PIL import Image

from clfractal.api import load_scene, render
from clfractal.files.srgb import encode8
from clfractal.images.anaglyph import IDEAL
from clfractal.images.outputs import png_bytes
from clfractal.scene.model import Scene
from clfractal.scene.palettes import PALETTES
from clfractal.scene.palettes import table as table_of

DOCS = Path(__file__).resolve().parent
TABLE = DOCS / "pictures.yaml"
GAP = 6  # pixels between panels
Show = Literal["samples", "left", "right", "albedo", "direct", "indirect"]
LAYERS = ("albedo", "direct", "indirect")


@dataclass(frozen=True, slots=True)
class Panel:
    """A scene, and what of it is shown."""

    scene: Scene
    # `samples`: how many each pixel took, instead of its colour; `left`, `right`: through that eye's filter;
    # or a layer of its light.
    show: Show | None


@dataclass(frozen=True, slots=True)
class Picture:
    """One row of the table: its scenes, from left to right and from top to bottom, all of one size."""

    name: str
    page: str
    panels: tuple[Panel, ...]
    columns: int
    panel_size: tuple[int, int]
    """Width and height of a panel, pixels of the picture."""

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the picture, pixels."""
        width, height = self.panel_size
        rows = -(-len(self.panels) // self.columns)
        return self.columns * (width + GAP) - GAP, rows * (height + GAP) - GAP

    @property
    def path(self) -> Path:
        """Where the picture lies."""
        return PICTURES / f"{self.name}.webp"


def table() -> tuple[Picture, ...]:
    """Every picture of the table, its scenes loaded and checked."""
    data = yaml.safe_load(TABLE.read_text("utf-8"))
    return tuple(_picture(name, row, data["scenes"]) for name, row in data["pictures"].items())


def _picture(name: str, row: Mapping[str, Any], scenes: Mapping[str, Any]) -> Picture:
    unknown = set(row) - {"page", "scene", "set", "panels", "columns", "size", "zoom"}
    if unknown:
        raise ValueError(f"{TABLE.name}: {name}: unknown keys {sorted(unknown)}")
    zoom = row.get("zoom", 1)
    width, height = row["size"]
    if width % zoom or height % zoom:
        raise ValueError(f"{TABLE.name}: {name}: size {width} x {height} is no multiple of zoom {zoom}")
    panels = []
    for values in row["panels"]:
        own = {**row.get("set", {}), **values}
        wide = zoom * own.pop("coarser", 1)
        size = {"image.width": width // wide, "image.height": height // wide}
        panels.append(_panel(scenes[row["scene"]], {**size, **own}))
    return Picture(name, row["page"], tuple(panels), row.get("columns", len(panels)), (width, height))


def _panel(base: Mapping[str, Any], values: dict[str, Any]) -> Panel:
    show = values.pop("show", None)
    if show not in (None, "samples", "left", "right", *LAYERS):
        raise ValueError(f"{TABLE.name}: a panel cannot show {show!r}")
    # JSON is YAML, and has no line breaks or bare words that the shell form of a value could trip over.
    scene = load_scene(
        base, folder=DOCS, overrides=[f"{key}={json.dumps(value)}" for key, value in values.items()]
    )
    return Panel(scene, show)


def make_picture(picture: Picture) -> None:
    """Renders the panels of a picture and writes it.

    Raises:
        ValueError: the file would be too large at the lowest quality; make its panels smaller.
    """
    width, height = picture.panel_size
    whole = Image.new("RGBA", picture.size)
    seconds = 0.0
    for index, panel in enumerate(picture.panels):
        layer = [f"{panel.show}.{part}" for part in "RGB"] if panel.show in LAYERS else []
        framebuffer = render(panel.scene, channels=["R", "G", "B", "A", "samples", *layer])
        seconds += framebuffer.header["seconds"]
        if panel.show == "samples":
            shown = Image.fromarray(_heat(framebuffer["samples"] / np.float32(panel.scene.renderer.samples)))
        elif layer:
            shown = Image.fromarray(encode8(np.stack([framebuffer[name] for name in layer], axis=-1)))
        elif panel.show == "left" or panel.show == "right":
            colors = np.stack([framebuffer[name] for name in "RGB"], axis=-1)
            assert panel.scene.stereo is not None
            behind = IDEAL[panel.scene.stereo.glasses][panel.show == "right"]  # the filter before this eye
            shown = Image.fromarray(encode8(colors * np.asarray(behind, np.float32)))
        else:
            with Image.open(io.BytesIO(png_bytes(framebuffer))) as shown:
                shown.load()
        shown = shown.convert("RGBA").resize((width, height), Image.Resampling.NEAREST)
        row, column = divmod(index, picture.columns)
        whole.paste(shown, (column * (width + GAP), row * (height + GAP)))
    content = small_file(whole)
    picture.path.write_bytes(content)
    print(f"{picture.path.name}: {len(content) // 1000} kB, {seconds:.1f} s", flush=True)


def small_file(whole: Image.Image) -> bytes:
    """A WebP file, lossless if it can be as small as the gallery's pictures, else as good as that allows."""
    file = io.BytesIO()
    whole.save(file, "WEBP", lossless=True, quality=50, method=4)
    content = file.getvalue()
    if len(content) > LARGEST_FILE:
        content, _ = small_enough(whole)
    return content


def _heat(values: npt.NDArray[np.float32]) -> npt.NDArray[np.uint8]:
    """Values in 0..1, shape (rows, columns), as colours from dark to light; shape (rows, columns, 3)."""
    palette = encode8(table_of(PALETTES["hearth"], 256)[None])[0]
    colors: npt.NDArray[np.uint8] = palette[np.rint(values * 255).astype(np.intp)]
    return colors


def main(names: Sequence[str]) -> None:
    """Makes the named pictures, or all."""
    PICTURES.mkdir(exist_ok=True)
    pictures = table()
    unknown = set(names) - {picture.name for picture in pictures}
    if unknown:
        raise SystemExit(f"{TABLE.name} has no {', '.join(sorted(unknown))}")
    for picture in pictures:
        if picture.name in names or not names:
            make_picture(picture)


if __name__ == "__main__":
    main(sys.argv[1:])
