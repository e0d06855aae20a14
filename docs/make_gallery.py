"""Makes the gallery: docs/pictures/*.png and docs/gallery.md, from the scenes.

    python docs/make_gallery.py             every picture (minutes), then the page
    python docs/make_gallery.py mandelbox   one picture, then the page
    python docs/make_gallery.py --page      only the page

Each scene is rendered at its full size, and reduced in linear light. The page's words are the comment at the
head of the scene's file, and the formula's own title and reference.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

from clfractal import resources
from clfractal.api import load_scene, render
from clfractal.files.srgb import encode8
from clfractal.formulas import catalog
from clfractal.pictures.compose import APART
from clfractal.scene.model import Scene

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
# 1920 x 1080 becomes 640 x 360, 2048 x 2048 becomes 512 x 512, or less where that makes too large a file.
REDUCTIONS = (3, 4, 6, 8)
LARGEST_FILE = 300_000  # bytes

Floats = npt.NDArray[np.float32]

HEAD = """# Gallery

Every scene in [`scenes/`](../scenes), rendered by this program and reduced to a third of its size or less. To make
one at full size, and to see it from the other side:

```console
clfractal render scenes/mandelbulb.yaml -o bulb.png
clfractal render scenes/mandelbulb.yaml -o other_side.png --set 'camera.position=[-1.25, 2.05, 0.85]'
```

The words are those of the scene files; `python docs/make_gallery.py` makes the pictures and this page anew.
Times are for that many pixels with the scene's own samples on two processor cores, without the seconds that
building its program takes when a formula is rendered for the first time.
"""


def scene_paths() -> list[Path]:
    """The scenes, those of the thesis's formulas first, then by name."""
    first = ("mandelbulb", "hast")
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


def page() -> str:
    """The text of docs/gallery.md."""
    parts = [HEAD]
    for scene in scene_paths():
        title, *sentences = comment_of(scene)
        parts.append(f"## {title}\n")
        parts.append(f"![{title}](pictures/{scene.stem}.png)\n")
        parts.append(f"[`{scene.name}`](../scenes/{scene.name}). " + "\n".join(sentences) + "\n")
        parts.append(f"{formula_line(scene)}\n")
    return "\n".join(parts)


def make_picture(path: Path) -> None:
    """Renders a scene and writes its reduced picture."""
    scene = load_scene(path)
    film = render(beside(scene), channels=["R", "G", "B", "A"])
    linear = np.stack([film["R"], film["G"], film["B"]], axis=-1)
    # What is brighter than the screen can show is cut before it is averaged, as in the full picture.
    linear = np.clip(linear * np.float32(2.0**scene.output.exposure), 0, 1)
    coverage = film["A"][..., None] if scene.background == "transparent" else np.ones_like(linear[..., :1])
    target = PICTURES / f"{path.stem}.png"
    for reduction in REDUCTIONS:
        if film.width % reduction or film.height % reduction:
            continue
        shown = picture(reduced(linear, reduction), reduced(coverage, reduction))
        shown.save(target, optimize=True)
        size = target.stat().st_size
        if size <= LARGEST_FILE:
            break
    print(f"{target}: {size // 1000} kB, {film.header['seconds']:.1f} s", flush=True)


def beside(scene: Scene) -> Scene:
    """The scene, with two eyes' pictures that would go to two files, or to one as two views, beside each other."""
    if scene.stereo is None or scene.stereo.mode not in APART:
        return scene
    return scene.model_copy(update={"stereo": scene.stereo.model_copy(update={"mode": "split"})})


def picture(linear: Floats, coverage: Floats) -> Image.Image:
    """What a file holds of premultiplied light and its coverage; the latter only where it is not 1 everywhere."""
    if (coverage == 1).all():
        return Image.fromarray(encode8(linear))
    straight = np.divide(linear, coverage, out=np.zeros_like(linear), where=coverage > 0)
    colors = encode8(np.clip(straight, 0, 1))
    opacity = np.rint(coverage * 255).astype(np.uint8)
    return Image.fromarray(np.concatenate([colors, opacity], axis=-1))


def reduced(linear: Floats, reduction: int) -> Floats:
    """Means over squares of `reduction` pixels; shape (rows, columns, components), both divisible by it."""
    rows, columns, components = linear.shape
    blocks = linear.reshape(rows // reduction, reduction, columns // reduction, reduction, components)
    means: Floats = blocks.mean(axis=(1, 3), dtype=np.float32)
    return means


def main(arguments: Sequence[str]) -> None:
    """Makes the named pictures, or all, and the page."""
    PICTURES.mkdir(exist_ok=True)
    names = [argument for argument in arguments if argument != "--page"]
    for scene in scene_paths():
        if scene.stem in names or not arguments:
            make_picture(scene)
    (DOCS / "gallery.md").write_text(page(), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
