"""Kills workers at random, a few times in the tests, and many times by hand:

python -m tests.cluster.kills --kills 200
"""

from __future__ import annotations

import argparse
import random
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.cluster.farm import FILM, FRAMES, HEAVY, Client, Farm
from tests.interrupts import planes
from tests.shell import has_tiles, process, wait_until


def kill_at_random(
    farm: Farm, client: Client, chance: random.Random, most: int, begun: Callable[[], bool]
) -> int:
    """Kills workers while a client runs, and starts another one for each; gives how many were killed.

    Args:
        begun: whether some of the work is done, and not all of it: that is when the first is killed.
    """
    wait_until(begun, client.process)
    kills, pause = 0, 0.0
    while kills < most:
        until = time.monotonic() + chance.uniform(0.3, 1.0) * pause
        while time.monotonic() < until:
            if not client.running:
                return kills
            time.sleep(0.02)
        farm.kill(chance.choice(sorted(farm.workers)))
        farm.add()
        kills, pause = kills + 1, 1.5
    return kills


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--kills", type=int, default=200)
    parser.add_argument("--seed", type=int, default=0)
    wanted = parser.parse_args()
    chance = random.Random(wanted.seed)
    kills = rounds = 0
    start = time.monotonic()
    with tempfile.TemporaryDirectory() as name, Farm(Path(name)) as farm:
        folder = Path(name)
        (folder / "heavy.yaml").write_text(HEAVY)
        (folder / "film.yaml").write_text(FILM)
        assert process(["render", "heavy.yaml", "-o", "own.exr", "--quiet"], folder).status == 0
        assert process(["animate", "film.yaml", "-o", "own_##.exr", "--quiet"], folder).status == 0
        picture = planes(folder / "own.exr")
        film = [planes(folder / f"own_{number:02d}.exr") for number in range(FRAMES)]
        while kills < wanted.kills:
            rounds += 1
            is_film = rounds % 2 == 0
            order = (
                ["animate", "film.yaml", "-o", "f_##.exr"]
                if is_film
                else ["render", "heavy.yaml", "-o", "p.exr"]
            )
            with Client(folder, *order, "--cluster", farm.address) as client:
                begun = (folder / "f_00.exr").exists if is_film else has_tiles(folder / "p.exr.partial")
                kills += kill_at_random(farm, client, chance, wanted.kills - kills, begun)
                status, told = client.ended(600)
            assert status == 0, told
            if is_film:
                assert [planes(folder / f"f_{number:02d}.exr") for number in range(FRAMES)] == film
            else:
                assert planes(folder / "p.exr") == picture
            for path in (*folder.glob("f_*.exr"), *folder.glob("p.exr")):
                path.unlink()
            print(
                f"{kills} kills, {rounds} renders, {time.monotonic() - start:.0f} s: 0 pixels differ",
                flush=True,
            )


if __name__ == "__main__":
    main()
