"""Makes the films of docs/films.md: docs/pictures/*.film.webp, small looping films, from the scenes that move.

    python docs/make_films.py              every film (minutes)
    python docs/make_films.py film_dive    one film

Every STEP-th frame is rendered small with the scene's own samples, and written with the highest quality that leaves the
file small enough. A film with so much detail that no quality does is reduced further.
"""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import numpy as np
from make_gallery import Floats, best_below, reduced, shown_light
from PIL import Image

from clfractal.api import load_scene
from clfractal.engine.frames import frames
from clfractal.files import resources
from clfractal.files.srgb import encode8
from clfractal.scene.model import Scene
from clfractal.scene.volume import VolumeRenderer

DOCS = Path(__file__).resolve().parent
PICTURES = DOCS / "pictures"
SIZE = (480, 270)  # pixels
EYE_SIZE = (320, 180)  # of each of two pictures beside each other
REDUCED = (1, 5 / 6, 2 / 3)  # parts of these sizes
STEP = 2  # frames of the scene for one of the film
LARGEST_FILE = 1_200_000  # bytes: eight films stay below 10 MB
QUALITIES = range(40, 91)  # of WebP
VOXELS = 383  # along the longest side of a volume, at most: more are for stills


def film_paths() -> list[Path]:
    """The scenes that move, by name."""
    return sorted(
        path for path in resources.folder("scenes").glob("*.yaml") if load_scene(path).animation is not None
    )


def film_of(name: str) -> Path:
    """Where the small film of a scene lies."""
    return PICTURES / f"{name}.film.webp"


def small_scene(path: Path) -> Scene:
    """The scene at the size of its small film."""
    scene = load_scene(path)
    width, height = EYE_SIZE if scene.stereo is not None else SIZE
    overrides = [f"image.width={width}", f"image.height={height}"]
    if isinstance(scene.renderer, VolumeRenderer) and isinstance(scene.renderer.resolution, int):
        overrides.append(f"renderer.resolution={min(scene.renderer.resolution, VOXELS)}")
    return load_scene(path, overrides=overrides)


def frames_of(scene: Scene) -> Iterator[Floats]:
    """The film's frames as a screen shows them, linear light, shape (rows, columns, 3)."""
    assert scene.animation is not None
    for _, film in frames(
        scene, numbers=range(0, scene.animation.count, STEP), channels=["R", "G", "B", "A"]
    ):
        yield shown_light(film)


def small_enough(shown: Sequence[Floats], fps: float) -> tuple[bytes, int]:
    """A film as large as can be of at most LARGEST_FILE bytes, and its quality.

    Raises:
        ValueError: the least size with the lowest quality makes a larger file.
    """
    *larger, least = REDUCED
    for part in larger:
        with suppress(ValueError):
            return best_of_size(shown, part, fps)
    return best_of_size(shown, least, fps)


def best_of_size(shown: Sequence[Floats], part: float, fps: float) -> tuple[bytes, int]:
    """The same for a part of the size.

    Raises:
        ValueError: the lowest quality makes a larger file.
    """
    width = width_of(shown[0].shape[1], part)
    pictures = [Image.fromarray(encode8(reduced(each, width))) for each in shown]
    return best_below(LARGEST_FILE, QUALITIES, lambda quality: webp(pictures, fps, quality))


def width_of(width: int, part: float) -> int:
    """A part of a width, that two eyes can share."""
    return 2 * round(width * part / 2)


def webp(pictures: Sequence[Image.Image], fps: float, quality: int) -> bytes:
    """A WebP film that begins again without end. Times of frames are whole milliseconds, whose sum is right."""
    ends = [round(1000 * number / fps) for number in range(len(pictures) + 1)]
    file = io.BytesIO()
    pictures[0].save(
        file,
        "WEBP",
        save_all=True,
        append_images=pictures[1:],
        duration=[int(length) for length in np.diff(ends)],
        loop=0,
        quality=quality,
        method=4,
    )
    return file.getvalue()


def make_film(path: Path) -> None:
    """Renders a scene's small film and writes it."""
    scene = small_scene(path)
    assert scene.animation is not None
    shown = list(frames_of(scene))
    content, quality = small_enough(shown, scene.animation.fps / STEP)
    film_of(path.stem).write_bytes(content)
    print(f"{path.stem}: {len(shown)} frames, {len(content) // 1000} kB, quality {quality}", flush=True)


def main(names: Sequence[str]) -> None:
    """Makes the named films, or all."""
    for path in film_paths():
        if path.stem in names or not names:
            make_film(path)


if __name__ == "__main__":
    main(sys.argv[1:])
