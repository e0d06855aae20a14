"""Makes the portraits of the library's formulas, docs/pictures/portraits/*.webp, and their page, docs/portraits.md.

    python docs/make_portraits.py               every portrait (minutes), then the page
    python docs/make_portraits.py mandelbox     one of them, then the page
    python docs/make_portraits.py --page        only the page

A portrait shows a formula with its usual values in the same light as all others, from the same side, as large as the
picture allows: the camera goes along its line of sight until the set fills the picture. docs/portraits.yaml says what
differs: how many iterations, another camera (for sets that are seen from within), other parameters, `trap`, the scale
of the colours.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from make_gallery import best_below, grained, shown_light, webp
from PIL import Image

from clfractal.api import load_scene, render
from clfractal.formulas import catalog
from clfractal.scene.model import Scene

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures" / "portraits"
TABLE = DOCS / "portraits.yaml"
PAGE = DOCS / "portraits.md"
SIZE = (256, 192)  # pixels
LARGEST_FILE = 9_000  # bytes
QUALITIES = range(5, 101)  # of WebP; foam takes many bytes
COLUMNS = 4
FILLED = 0.9  # of the picture's height or width
SIDE = (0.46, -0.78, 0.42)  # of the camera, from the set's middle
FOV = 30.0  # degrees

HEAD = """# Portraits of the formulas

Every formula of the [library](formulas.md#the-library) with its usual values, in the same light. `clfractal formulas NAME`
tells what one is, and the [gallery](gallery.md) shows what they become in a scene. `python docs/make_portraits.py` makes
these pictures and this page anew.
"""


def names() -> tuple[str, ...]:
    """The formulas that have something to show."""
    return tuple(name for name in catalog.names() if not catalog.description(name).get("alone"))


def table() -> dict[str, dict[str, Any]]:
    """What is said of single formulas in docs/portraits.yaml."""
    found: dict[str, dict[str, Any]] = yaml.safe_load(TABLE.read_text("utf-8"))
    return found


def portrait(name: str, said: Mapping[str, Any]) -> Scene:
    """The scene of a portrait; its camera looks at the whole bounds unless one is given."""
    formula = {
        "name": name,
        "iterations": 10,
        **{k: v for k, v in said.items() if k in ("iterations", "parameters", "julia")},
    }
    scene = load_scene({"version": 1, "formula": formula, "camera": {}})
    center, radius = np.array(scene.chain.center), scene.chain.radius
    away = np.array(SIDE) / np.linalg.norm(SIDE) * radius / np.sin(np.radians(FOV / 2))
    camera = {"position": (center + away).tolist(), "target": center.tolist(), "fov": FOV}
    return load_scene(
        {
            "version": 1,
            "formula": formula,
            "image": {"width": SIZE[0], "height": SIZE[1]},
            "camera": said.get("camera", camera),
            "renderer": {"samples": 24, "ambient_occlusion": {"rays": 3, "distance": 0.3}},
            "lights": [
                {
                    "direction": [-0.5, 1.0, -0.8],
                    "color": [1.0, 0.93, 0.82],
                    "intensity": 1.0,
                    "angular_size": 6,
                },
                {"direction": [-0.9, 0.2, 0.15], "color": [0.5, 0.62, 0.8], "intensity": 0.35},
            ],
            "material": {"ambient": 0.3, "diffuse": 0.85, "specular": 0.12, "shininess": 30},
            "coloring": {
                "by": "trap",
                "trap": {"shape": "point"},
                "palette": ["#8c3f25", "#cf8a4e", "#efdfba", "#9db4ad", "#3f5f73"],
                "scale": said.get("trap", 1.0),
            },
            "background": {"top": [0.50, 0.56, 0.64], "bottom": [0.86, 0.86, 0.84]},
        }
    )


def framed(scene: Scene) -> Scene:
    """The scene with its camera moved so that the set fills the picture, as small pictures show it."""
    for _ in range(3):
        small = scene.model_copy(
            update={
                "image": scene.image.model_copy(update={"width": SIZE[0] // 2, "height": SIZE[1] // 2}),
                "renderer": scene.renderer.model_copy(update={"samples": 1}),
            }
        )
        seen = render(small, channels=["A"])["A"] > 0
        rows, columns = np.nonzero(seen.any(axis=1))[0], np.nonzero(seen.any(axis=0))[0]
        if not len(rows):
            raise ValueError("shows nothing")
        height, width = seen.shape
        pixel = 2 * np.tan(np.radians(FOV / 2)) / height  # at a distance of 1
        place, target = np.array(scene.camera.position), np.array(scene.camera.target)
        ahead = target - place
        far = np.linalg.norm(ahead)
        ahead /= far
        right = np.cross(ahead, [0, 0, 1])
        right /= np.linalg.norm(right)
        aside = (columns[0] + columns[-1] + 1 - width) / 2 * pixel * far
        above = (height - rows[0] - rows[-1] - 1) / 2 * pixel * far
        target = target + aside * right + above * np.cross(right, ahead)
        part = max((rows[-1] - rows[0] + 1) / height, (columns[-1] - columns[0] + 1) / width)
        place = target - far * part / FILLED * ahead
        camera = scene.camera.model_copy(update={"position": tuple(place), "target": tuple(target)})
        scene = scene.model_copy(update={"camera": camera})
    return scene


def make_portrait(name: str, said: Mapping[str, Any]) -> None:
    """Renders a portrait and writes its file."""
    scene = portrait(name, said)
    if "camera" not in said:
        scene = framed(scene)
    shown = Image.fromarray(grained(shown_light(render(scene, channels=["R", "G", "B", "A"]))))
    content, quality = best_below(LARGEST_FILE, QUALITIES, lambda each: webp(shown, each))
    (PICTURES / f"{name}.webp").write_bytes(content)
    print(f"{name}: {len(content) / 1000:.1f} kB, quality {quality}", flush=True)


def page() -> str:
    """The text of the page: rows of portraits, and below each its name and title."""
    parts = [HEAD]
    cells = [
        f"![{catalog.description(name)['title']}](pictures/portraits/{name}.webp)<br>"
        f"[`{name}`](../clfractal/formulas/library/{name}.yaml)<br>{catalog.description(name)['title']}"
        for name in names()
    ]
    parts.append("| | | | |\n|---|---|---|---|")
    for first in range(0, len(cells), COLUMNS):
        row = cells[first : first + COLUMNS]
        parts.append("| " + " | ".join([*row, *[""] * (COLUMNS - len(row))]) + " |")
    return parts[0] + "\n" + "\n".join(parts[1:]) + "\n"


def main(arguments: Sequence[str]) -> None:
    """Makes the named portraits, or all, and the page."""
    PICTURES.mkdir(parents=True, exist_ok=True)
    said = table()
    for name in names():
        if name in arguments or not arguments:
            make_portrait(name, said.get(name, {}))
    PAGE.write_text(page(), "utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
