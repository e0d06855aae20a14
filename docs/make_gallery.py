"""Makes the gallery: docs/pictures/*.webp, docs/gallery.md and docs/figures.md, from the scenes.

    python docs/make_gallery.py             every picture (minutes), then the pages
    python docs/make_gallery.py mandelbox   one picture, then the pages
    python docs/make_gallery.py --page      only the pages

Each scene is rendered at its full size (and denoised, where light bounces or comes from lamps on the set), reduced in
linear light to WIDTH pixels, and written with the highest quality that leaves the file small enough. Pages that show the
picture of an earlier format get the new one. The gallery's words are the comment at the head of the scene's file, and the
formula's own title and reference.
"""

from __future__ import annotations

import io
import re
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from clfractal.api import load_scene, render
from clfractal.files import resources
from clfractal.files.srgb import encode
from clfractal.formulas import catalog
from clfractal.images.compose import APART
from clfractal.images.develop import Development, developed
from clfractal.images.framebuffer import Framebuffer
from clfractal.scene.model import Scene

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
WIDTH = 1280  # pixels
LARGEST_FILE = 200_000  # bytes
# Of WebP, 0 to 100. Below the least one artefacts show at first sight.
QUALITIES = range(25, 101)
# Codes of 8 bits that a triangle of noise reaches to either side. WebP keeps fewer levels than 8 bits have, and takes a
# finer dither away: without grain smooth skies show stripes. Below quality 95 it is taken away, too, and costs nothing.
GRAIN = 1.5

Floats = npt.NDArray[np.float32]

HEAD = """# Gallery

The scenes in [`scenes/`](../scenes), rendered by this program and reduced; [figures](figures.md) of the thesis and diagrams
have a page of their own. To make one at full size, and to see it from the other side:

```console
clfractal render scenes/mandelbulb.yaml -o bulb.png
clfractal render scenes/mandelbulb.yaml -o other_side.png --set 'camera.position=[-0.7, 0.84, 2.8]'
```

The words are those of the scene files; `python docs/make_gallery.py` makes the pictures and both pages anew.
Times are for that many pixels with the scene's own samples on two processor cores, without the seconds that
building its program takes when a formula is rendered for the first time. Pictures of scenes in which light bounces, and of
those with lamps on the set, are denoised here (`--denoise`).
"""

FIGURES_HEAD = """# Figures and diagrams

Scenes after figures of Rickard Englund's thesis *Rendering Methods for 3D Fractals* (2010), and pictures that explain more
than they please. The others are in the [gallery](gallery.md), which also tells how these are made.
"""
# Scenes of that page beside those that are called after a figure.
DIAGRAMS = ("cut_mandelbrot", "four_views", "hast_normals")


def is_figure(scene: Path) -> bool:
    """Whether a scene belongs to the figures and diagrams."""
    return scene.stem.startswith("figure") or scene.stem in DIAGRAMS


# The gallery begins with these: places that one would like to be in.
FIRST = (
    "lantern_bay",
    "fractal_tree",
    "golden_island",
    "clay_city",
    "jerusalem_cube",
    "sponge_harbour",
    "cistern",
    "dew",
    "sunken_temple",
    "lighthouse",
    "iceberg",
    "wet_street",
    "three_trees",
    "basalt_cave",
    "peaks",
    "lamp_room",
    "lamp_of_cells",
    "sculpture_court",
    "baths",
    "chapel",
    "stepwell",
    "museum",
    "menger_hall",
)


def scene_paths() -> list[Path]:
    """The scenes: those that the gallery begins with, those of the thesis's formulas, then by name."""
    first = (*FIRST, "mandelbulb", "hast")
    paths = sorted(resources.folder("scenes").glob("*.yaml"))
    return sorted(paths, key=lambda path: [not path.stem.startswith(name) for name in first])


def comment_of(scene: Path) -> list[str]:
    """The lines of the comment at the head of a scene: a title, then sentences."""
    lines = []
    for line in scene.read_text("utf-8").splitlines():
        if not line.startswith("# "):
            break
        lines.append(line[2:])
    return lines


def formula_line(scene: Path) -> str:
    """The formula's name, title and reference."""
    name = load_scene(scene).formula.name
    if name is None:
        return "Its formula is written in the scene file."
    about = catalog.description(name)
    link = f"[`{name}`](../clfractal/formulas/library/{name}.yaml)"
    return f"Formula {link}: {about['title']}. {about['reference']}."


def file_of(name: str) -> Path:
    """The picture of a scene: of the format that is written now, or of the earlier one if it was not made since."""
    now, earlier = PICTURES / f"{name}.webp", PICTURES / f"{name}.png"
    return earlier if earlier.exists() and not now.exists() else now


def pages() -> dict[str, str]:
    """The texts of the pages, by their names."""
    scenes = scene_paths()
    return {
        "gallery.md": page(HEAD, [scene for scene in scenes if not is_figure(scene)]),
        "figures.md": page(FIGURES_HEAD, [scene for scene in scenes if is_figure(scene)]),
    }


def page(head: str, scenes: Sequence[Path]) -> str:
    """The text of a page that shows some scenes."""
    parts = [head]
    for scene in scenes:
        title, *sentences = comment_of(scene)
        parts.append(f"## {title}\n")
        parts.append(f"![{title}](pictures/{file_of(scene.stem).name})\n")
        parts.append(f"[`{scene.name}`](../scenes/{scene.name}). " + "\n".join(sentences) + "\n")
        parts.append(f"{formula_line(scene)}\n")
    return "\n".join(parts)


def make_picture(path: Path) -> None:
    """Renders a scene and writes its reduced picture."""
    scene = load_scene(path)
    if scene.lighting.mode == "path" or any(light.type == "set" for light in scene.lights):
        scene = load_scene(path, overrides=["output.denoise=true"])
    framebuffer = render(beside(scene), channels=["R", "G", "B", "A"])
    linear = shown_light(framebuffer)
    coverage = (
        framebuffer["A"][..., None] if scene.background == "transparent" else np.ones_like(linear[..., :1])
    )
    shown = picture(reduced(linear, WIDTH), reduced(coverage, WIDTH))
    content, quality = small_enough(shown)
    target = PICTURES / f"{path.stem}.webp"
    target.write_bytes(content)
    (PICTURES / f"{path.stem}.png").unlink(missing_ok=True)
    size = len(content) // 1000
    print(f"{target.name}: {size} kB, quality {quality}, {framebuffer.header['seconds']:.1f} s", flush=True)


def shown_light(framebuffer: Framebuffer) -> Floats:
    """What a screen shows of a framebuffer, with its exposure and tone: linear light, shape (rows, columns, 3).

    What is brighter than the screen can show is cut here, before it is averaged, as in the full picture.
    """
    bands = [band for _, band in developed(framebuffer, Development.of(framebuffer.header)).bands()]
    linear = np.stack([np.concatenate([band[name] for band in bands]) for name in "RGB"], axis=-1)
    return np.clip(linear, 0, 1)


def small_enough(shown: Image.Image) -> tuple[bytes, int]:
    """A WebP file of at most LARGEST_FILE bytes, and its quality: the highest of QUALITIES that is so small.

    Raises:
        ValueError: the lowest quality makes a larger file.
    """
    return best_below(LARGEST_FILE, QUALITIES, lambda quality: webp(shown, quality))


def best_below(most: int, qualities: range, write: Callable[[int], bytes]) -> tuple[bytes, int]:
    """What `write` makes of the highest quality that takes at most so many bytes, and that quality.

    Raises:
        ValueError: the lowest quality takes more.
    """
    best: tuple[bytes, int] | None = None
    low, high = qualities.start, qualities.stop
    while low < high:  # sizes grow with quality: halve what is left
        quality = (low + high) // 2
        content = write(quality)
        if len(content) <= most:
            best, low = (content, quality), quality + 1
        else:
            high = quality
    if best is None:
        raise ValueError(f"is larger than {most // 1000} kB even at quality {qualities.start}")
    return best


def webp(shown: Image.Image, quality: int) -> bytes:
    """A WebP file, as small as the library makes one of that quality."""
    file = io.BytesIO()
    shown.save(file, "WEBP", quality=quality, method=6)
    return file.getvalue()


def beside(scene: Scene) -> Scene:
    """The scene, with two eyes' pictures that would go to two files, or to one as two views, beside each other."""
    if scene.stereo is None or scene.stereo.mode not in APART:
        return scene
    return scene.model_copy(update={"stereo": scene.stereo.model_copy(update={"mode": "split"})})


def picture(linear: Floats, coverage: Floats) -> Image.Image:
    """What a file holds of premultiplied light and its coverage; the latter only where it is not 1 everywhere."""
    if (coverage == 1).all():
        return Image.fromarray(grained(linear))
    straight = np.divide(linear, coverage, out=np.zeros_like(linear), where=coverage > 0)
    colors = grained(np.clip(straight, 0, 1))
    opacity = np.rint(coverage * 255).astype(np.uint8)
    return Image.fromarray(np.concatenate([colors, opacity], axis=-1))


def grained(linear: Floats) -> npt.NDArray[np.uint8]:
    """Linear light, 0 to 1, shape (rows, columns, 3), as codes of 8 bits with GRAIN, which is grey."""
    random = np.random.default_rng(0)
    shape = (*linear.shape[:2], 1)
    noise = random.random(shape) - random.random(shape)
    return np.rint(np.clip(255 * encode(linear.astype(np.float64)) + GRAIN * noise, 0, 255)).astype(np.uint8)


def reduced(linear: Floats, width: int) -> Floats:
    """An array of shape (rows, columns, components), in linear light, made `width` columns wide; never wider than it was.

    The filter's weights are none below 0, so edges get no rims.
    """
    rows, columns, components = linear.shape
    if columns <= width:
        return linear
    size = (width, max(round(rows * width / columns), 1))
    planes = [
        np.asarray(Image.fromarray(linear[..., i]).resize(size, Image.Resampling.HAMMING))
        for i in range(components)
    ]
    return np.clip(np.stack(planes, axis=-1), 0, 1)


def relinked(text: str) -> str:
    """A page's text, with pictures of the earlier format replaced by those that were made since."""
    return re.sub(r"(?<=pictures/)(\w+)\.png(?=\))", lambda found: file_of(found[1]).name, text)


def main(arguments: Sequence[str]) -> None:
    """Makes the named pictures, or all, and the pages."""
    PICTURES.mkdir(exist_ok=True)
    names = [argument for argument in arguments if argument != "--page"]
    for scene in scene_paths():
        if scene.stem in names or not arguments:
            make_picture(scene)
    for name, text in pages().items():
        (DOCS / name).write_text(text, "utf-8")
    for other in (DOCS.parent / "README.md", *DOCS.glob("*.md")):
        other.write_text(relinked(other.read_text("utf-8")), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
