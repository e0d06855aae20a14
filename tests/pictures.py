"""Small pictures of the scenes, and the golden ones that tests compare them with.

    python -m tests.pictures            writes tests/golden/*.png anew
    python -m tests.pictures mandelbox  only this one

Golden pictures belong to a checkout: run it there, look at what changed, commit.
"""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import cache
from pathlib import Path

import numpy as np
import numpy.typing as npt
from PIL import Image

import clfractal
from clfractal.files import resources
from clfractal.images.compose import APART, Composed
from clfractal.images.framebuffer import in_memory
from clfractal.scene.renderer import Renderer
from clfractal.scene.volume import VolumeRenderer

WIDTH, HEIGHT = 96, 54
SAMPLES, PATHS = 4, 16
RESOLUTION = 96  # voxels along the longest side of a volume
GOLDEN = Path(__file__).parent / "golden"
FAILURES = Path(__file__).resolve().parents[1] / "test-failures"

Picture = npt.NDArray[np.uint8]


def scene_paths() -> list[Path]:
    """Every scene that travels with the program, by name."""
    return sorted(resources.folder("scenes").glob("*.yaml"))


def small_scene(path: Path) -> clfractal.Scene:
    """The scene at the size of the golden pictures, which is their reference too, with few samples and small grids.

    One sample alone is noise, and along paths SAMPLES are.
    """
    scene = clfractal.load_scene(path)
    renderers: dict[str, Renderer] = {"renderer": scene.renderer}
    for number, view in enumerate(scene.layout.views if scene.layout else ()):
        if view.renderer is not None:
            renderers[f"layout.views.{number}.renderer"] = view.renderer
    sizes = [f"image.width={WIDTH}", f"image.height={HEIGHT}"]
    for key, renderer in renderers.items():
        sizes.append(f"{key}.samples={PATHS if scene.lighting.mode == 'path' else SAMPLES}")
        if isinstance(renderer, VolumeRenderer):
            sizes.append(f"{key}.resolution={RESOLUTION}")
    return clfractal.load_scene(path, overrides=sizes)


@cache
def small_framebuffers(path: Path) -> tuple[clfractal.Framebuffer, ...]:
    """The scene rendered small, for each eye; once for all tests, because building its program takes seconds."""
    scene = small_scene(path)
    channels = ["R", "G", "B", "A", "Z", "N.X", "N.Y", "N.Z", "iterations"]
    if scene.stereo is not None:
        return clfractal.render_pair(scene, channels=channels)
    return (clfractal.render(scene, channels=channels),)


def small_framebuffer(path: Path) -> clfractal.Framebuffer:
    """The scene rendered small; of a stereo scene what the left eye sees."""
    return small_framebuffers(path)[0]


def small_picture(path: Path) -> Picture:
    """What a screen would show of `small_framebuffers`: sRGB, shape (HEIGHT, WIDTH, 3); twice as wide for two eyes
    apart.
    """
    scene, framebuffers = small_scene(path), small_framebuffers(path)
    if scene.stereo is None:
        return framebuffers[0].to_rgb8(scene.output.stops)
    apart = scene.stereo.mode in APART
    stereo = scene.stereo.model_copy(update={"mode": "split"}) if apart else scene.stereo
    left, right = framebuffers
    return in_memory(Composed(stereo, (WIDTH, HEIGHT), left, right)).to_rgb8(scene.output.stops)


def golden_path(path: Path) -> Path:
    """Where the golden picture of a scene lies."""
    return GOLDEN / f"{path.stem}.png"


def read_picture(path: Path) -> Picture:
    """An 8-bit picture of three channels."""
    with Image.open(path) as picture:
        return np.asarray(picture.convert("RGB"))


def keep_failure(name: str, picture: Picture, golden: Picture) -> Path:
    """Saves a picture, the golden one and their difference side by side (four times as large) to look at.

    The difference is grey where both agree.
    """
    FAILURES.mkdir(exist_ok=True)
    difference = np.clip(128 + picture.astype(np.int16) - golden, 0, 255).astype(np.uint8)
    for kind, pixels in (("picture", picture), ("golden", golden), ("difference", difference)):
        Image.fromarray(pixels).save(FAILURES / f"{name}.{kind}.png")
    side_by_side = np.concatenate([picture, golden, difference], axis=1)
    target = FAILURES / f"{name}.png"
    Image.fromarray(side_by_side.repeat(4, axis=0).repeat(4, axis=1)).save(target)
    return target


def main(names: Sequence[str]) -> None:
    """Writes the golden pictures of the named scenes, or of all."""
    GOLDEN.mkdir(exist_ok=True)
    for path in scene_paths():
        if names and path.stem not in names:
            continue
        Image.fromarray(small_picture(path)).save(golden_path(path), optimize=True)
        print(golden_path(path))


if __name__ == "__main__":
    main(sys.argv[1:])
