"""How long the other program and ours take for the same settings, by command, each file's pictures one after the other.

    python -m benchmarks.peers.speed [FILE ...] [--sample N --seed S] [--size WxH] [--runs N]

Both write a PNG of the whole picture, with the file's own lights and shadows, one ray for each pixel (theirs knows no other
number without its Monte Carlo effects, which are switched off with all else that ours does not take over: `NOT_OURS`). How
fine its surface is stays as the file says; ours is found to a part of a pixel. The first picture of ours compiles the
formula's program, and is told apart; then each makes one in turn, whose middle time counts. What does not end in the time
given counts as that long.
"""

from __future__ import annotations

import argparse
import random
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from benchmarks.peers import theirs
from benchmarks.peers.causes import dropped
from benchmarks.peers.ours import read
from clfractal.errors import ClfractalError

NOT_OURS = (
    "volumetric_fog_enabled",
    "iteration_fog_enable",
    "fake_lights_enabled",
    "random_lights_group",
    "stereo_enabled",
    "textured_background",
    "env_mapping_enable",
    "main_light_volumetric_enabled",
    "DOF_enabled",
    "MC_soft_shadows_enable",
    "hdr_blur_enabled",
    *(f"aux_light_volumetric_enabled_{number}" for number in range(1, 5)),
)
HEAD = f"{'file':58} {'theirs':>9} {'ours':>9} {'ratio':>6} {'first':>8}"


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(prog="speed", description=__doc__.split("\n", 1)[0] if __doc__ else None)
    parser.add_argument(
        "files", nargs="*", type=Path, metavar="FILE", help="settings; without: examples that open"
    )
    parser.add_argument("--sample", type=int, default=12, metavar="N", help="so many of them, at random")
    parser.add_argument("--seed", type=int, default=1, metavar="S", help="which ones")
    parser.add_argument("--size", default="1280x720", metavar="WxH")
    parser.add_argument("--runs", type=int, default=3, metavar="N", help="pictures of each")
    parser.add_argument("--seconds", type=float, default=300, metavar="S", help="what a picture may take")
    options = parser.parse_args(arguments)
    if not theirs.is_there():
        print(
            "Mandelbulber 2 is not installed (apt-get install mandelbulber2): there is nothing to compare with"
        )
        return 2
    width, height = (int(each) for each in options.size.split("x"))
    print(HEAD)
    ratios, firsts = [], []
    for path in options.files or _examples(options.sample, options.seed):
        name = path.stem if len(path.stem) <= 58 else "..." + path.stem[-55:]
        try:
            their, own, first = measured(path, (width, height), options.runs, options.seconds)
        except (theirs.TheirsError, subprocess.SubprocessError) as error:
            print(f"{name:58} {error}")
            continue
        ratios.append(their / own)
        firsts.append(their / first)
        more, less = (">" if each >= options.seconds else " " for each in (their, own))
        print(
            f"{name:58} {more}{their:6.1f} s {less}{own:6.1f} s {ratios[-1]:6.2f} {first:6.1f} s", flush=True
        )
    if ratios:
        print(
            f"\nin the middle of {len(ratios)} files theirs takes {statistics.median(ratios):.2f} times as long as ours,"
            f" {statistics.median(firsts):.2f} times as ours with compiling"
        )
    return 0


def _examples(count: int, seed: int) -> list[Path]:
    """Some that open with all their shapes."""
    found: list[Path] = []
    files = theirs.examples()
    random.Random(seed).shuffle(files)
    for path in files:
        try:
            scene, _ = read(path)
        except ClfractalError:
            continue
        if not dropped(scene):
            found.append(path)
        if len(found) == count:
            break
    return found


def measured(path: Path, size: tuple[int, int], runs: int, seconds: float) -> tuple[float, float, float]:
    """Seconds of theirs and ours in the middle, and of our first picture.

    Raises:
        theirs.TheirsError: it made no picture.
        subprocess.SubprocessError: ours made none.
    """
    off: dict[str, object] = dict.fromkeys(NOT_OURS, 0)
    with tempfile.TemporaryDirectory(prefix="speed-") as folder:
        picture = Path(folder, "picture.png")
        command = [sys.executable, "-P", "-m", "clfractal", "render", str(path)]
        command += ["--size", f"{size[0]}x{size[1]}", "--samples", "1", "-o", str(picture)]

        def ours() -> float:
            start = time.perf_counter()
            try:
                subprocess.run(command, check=True, capture_output=True, timeout=seconds)
            except subprocess.TimeoutExpired:
                return seconds
            return time.perf_counter() - start

        def other() -> float:
            start = time.perf_counter()
            try:
                theirs.picture(path, picture, size, off, seconds)
            except theirs.TooLongError:
                return seconds
            return time.perf_counter() - start

        first, their, own = ours(), [], []
        for _ in range(runs):
            own.append(ours())
            picture.unlink(missing_ok=True)
            their.append(other())
    return statistics.median(their), statistics.median(own), first


if __name__ == "__main__":
    sys.exit(main())
