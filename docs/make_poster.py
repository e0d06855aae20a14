"""Makes the film that the README shows: docs/pictures/poster.mp4, from the shots that docs/poster.yaml lists.

    python docs/make_poster.py              every frame that is not there yet (half an hour of a core), then the film
    python docs/make_poster.py pagoda       only the frames of that shot
    python docs/make_poster.py --film       only the film, of the frames that are there

Frames lie in out/poster/SHOT/, PNG files of 16 bits; one that is there is not rendered again, so after a change delete
what it concerns. Between shots there are cross-fades, in linear light. Beside the film a small one is written, which
pages can show by itself: docs/pictures/poster.webp. Films need the package av: pip install 'clfractal[film]'.

Keys of the table:

    size     width and height, pixels
    fps      frames per second
    fade     frames of a cross-fade, which belong to both its shots
    quality  of the film, x264's number: smaller is better, and larger
    shots    name: a shot, in the order of the film
      scene    a name of scenes/
      frames   how many, fades included
      set      dotted key: value, replaced in the scene
      tracks   what moves, as `animation.tracks` of a scene
"""

from __future__ import annotations

import json
import sys
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from make_films import webp
from make_gallery import DOCS, PICTURES, Floats, best_below, reduced, shown_light
from PIL import Image

from clfractal.api import load_scene
from clfractal.engine.frames import frames
from clfractal.errors import ClfractalError
from clfractal.files import resources, srgb
from clfractal.files.film_kinds import Recipe
from clfractal.files.moving import plan_film, write_film
from clfractal.files.png import write_png
from clfractal.scene.model import Scene

TABLE = DOCS / "poster.yaml"
FRAMES = DOCS.parent / "out" / "poster"
FILM, SMALL = PICTURES / "poster.mp4", PICTURES / "poster.webp"
LARGEST_FILM, LARGEST_SMALL = 6_000_000, 1_000_000  # bytes
SMALL_WIDTH, STEP = 384, 3  # pixels; frames of the film for one of the small film
QUALITIES = range(20, 91)  # of WebP


@dataclass(frozen=True, slots=True)
class Shot:
    """A part of the film from one scene, which moves."""

    name: str
    scene: Scene
    frames: int

    def file(self, number: int) -> Path:
        """Where one of its frames lies."""
        return FRAMES / self.name / f"{number:03}.png"

    @property
    def missing(self) -> list[int]:
        """The frames that are not there yet."""
        return [number for number in range(self.frames) if not self.file(number).exists()]


@dataclass(frozen=True, slots=True)
class Poster:
    """The whole table."""

    size: tuple[int, int]
    fps: float
    fade: int
    quality: int
    shots: tuple[Shot, ...]

    def parts(self) -> list[tuple[tuple[Path, float], ...]]:
        """The film's frames: for each the files that it is mixed of, with their weights, whose sum is 1."""
        parts: list[tuple[tuple[Path, float], ...]] = []
        for shot in self.shots:
            own = [shot.file(number) for number in range(shot.frames)]
            shared = self.fade if parts else 0
            for index in range(shared):
                weight = (index + 1) / (shared + 1)
                ((before, _),) = parts[index - shared]
                parts[index - shared] = ((before, 1 - weight), (own[index], weight))
            parts += [((file, 1.0),) for file in own[shared:]]
        return parts


def table() -> Poster:
    """The table, its scenes loaded and checked.

    Raises:
        ValueError: a shot is shorter than its fades.
    """
    data = yaml.safe_load(TABLE.read_text("utf-8"))
    width, height = data["size"]
    fps = data["fps"]
    shots = tuple(_shot(name, row, (width, height), fps) for name, row in data["shots"].items())
    for one, other in pairwise(shots):
        if min(one.frames, other.frames) < 2 * data["fade"]:
            raise ValueError(f"{TABLE.name}: {one.name} or {other.name} is shorter than two fades")
    return Poster((width, height), fps, data["fade"], data["quality"], shots)


def _shot(name: str, row: Mapping[str, Any], size: tuple[int, int], fps: float) -> Shot:
    unknown = set(row) - {"scene", "frames", "set", "tracks"}
    if unknown:
        raise ValueError(f"{TABLE.name}: {name}: unknown keys {sorted(unknown)}")
    path = resources.folder("scenes") / f"{row['scene']}.yaml"
    still = load_scene(path)
    reference = still.image.reference_height or still.image.height
    values = {
        "image": {"width": size[0], "height": size[1], "reference_height": reference},
        # What moves in the scene itself is another film; the same noise in all frames does not flicker.
        "animation": {"fps": fps, "frames": row["frames"], "noise": "fixed", "tracks": row["tracks"]},
        **row.get("set", {}),
    }
    # JSON is YAML, and has no line breaks or bare words that the shell form of a value could trip over.
    scene = load_scene(path, overrides=[f"{key}={json.dumps(value)}" for key, value in values.items()])
    return Shot(name, scene, row["frames"])


def render_shot(shot: Shot) -> None:
    """Renders those of a shot's frames that are not there."""
    missing = shot.missing
    if not missing:
        return
    shot.file(0).parent.mkdir(parents=True, exist_ok=True)
    for number, framebuffer in frames(shot.scene, numbers=missing, channels=["R", "G", "B", "A"]):
        linear = shown_light(framebuffer)
        rows, columns, _ = linear.shape
        write_png(shot.file(number), [linear], width=columns, height=rows, bits=16)
        print(f"{shot.name}: frame {number}, {framebuffer.header['seconds']:.1f} s", flush=True)


def light_of(file: Path) -> Floats:
    """Linear light of a frame, shape (rows, columns, 3)."""
    import av

    with av.open(str(file)) as picture:
        codes = next(picture.decode(video=0)).to_ndarray(format="rgb48le")
    return srgb.decode(codes / 65535).astype(np.float32)


def mixed(parts: Sequence[tuple[Path, float]]) -> Floats:
    """Linear light of a frame of the film, shape (rows, columns, 3)."""
    return np.sum([np.float32(weight) * light_of(file) for file, weight in parts], axis=0)


def files(poster: Poster) -> Iterator[Path]:
    """The film's frames, each as a file. Those of a fade are made, and lie beside the shots."""
    for number, parts in enumerate(poster.parts()):
        if len(parts) == 1:
            yield parts[0][0]
            continue
        file = FRAMES / "fades" / f"{number:03}.png"
        file.parent.mkdir(parents=True, exist_ok=True)
        width, height = poster.size
        write_png(file, [mixed(parts)], width=width, height=height, bits=16)
        yield file


def planned(poster: Poster) -> Any:
    """How the film is written. Raises FileError: the package av is missing."""
    return plan_film(FILM, Recipe(quality=poster.quality), poster.size, poster.fps)


def make_film(poster: Poster) -> None:
    """Writes the film and the small one.

    Raises:
        FileError: the package av is missing.
        ValueError: a frame is missing, or a film would be too large.
    """
    for shot in poster.shots:
        if shot.missing:
            raise ValueError(
                f"{shot.name}: frame {shot.missing[0]} is missing; {Path(__file__).name} renders it"
            )
    write_film(planned(poster), files(poster))
    if FILM.stat().st_size > LARGEST_FILM:
        raise ValueError(
            f"{FILM.name} is larger than {LARGEST_FILM // 1_000_000} MB: raise its quality's number"
        )
    shown = [
        Image.fromarray(srgb.encode8(reduced(mixed(parts), SMALL_WIDTH))) for parts in poster.parts()[::STEP]
    ]
    content, quality = best_below(
        LARGEST_SMALL, QUALITIES, lambda number: webp(shown, poster.fps / STEP, number)
    )
    SMALL.write_bytes(content)
    print(
        f"{FILM.name}: {FILM.stat().st_size // 1000} kB; {SMALL.name}: {len(content) // 1000} kB, quality {quality}"
    )


def main(arguments: Sequence[str]) -> None:
    """Renders the named shots, or all and then the film. Raises SystemExit: one line about what is wrong."""
    try:
        poster = table()
        shots = {shot.name: shot for shot in poster.shots}
        if list(arguments) == ["--film"]:
            make_film(poster)
            return
        if unknown := [argument for argument in arguments if argument not in shots]:
            sys.exit(f"{unknown[0]!r} is none of the shots: {', '.join(shots)}; or --film alone")
        if not arguments:
            planned(poster)  # before half an hour of work
        for name in arguments or shots:
            render_shot(shots[name])
        if not arguments:
            make_film(poster)
    except (ClfractalError, ValueError) as error:
        sys.exit(str(error))


if __name__ == "__main__":
    main(sys.argv[1:])
