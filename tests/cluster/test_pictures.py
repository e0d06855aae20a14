"""A cluster gives the bits of one machine, for pictures and films, from the shell and from Python."""

from __future__ import annotations

import json
import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

import clfractal
from clfractal.files.exr import read_exr
from clfractal.scene import environment
from tests.cluster.farm import FRAMES, HEAVY, Client, Farm, journal_grows
from tests.interrupts import planes
from tests.long_renders import holding
from tests.shell import process, works

TILES = 8 * 6
PREFIX = "DASK_DISTRIBUTED__COMM__TLS__"


def test_a_picture_of_workers_here(folder: Path, picture: dict[str, bytes]) -> None:
    options = ["--cluster", "local:2", "--stats", "stats.json", "--quiet"]
    ended = process(["render", "heavy.yaml", "-o", "out.exr", *options], folder)
    assert (ended.status, ended.err) == (0, "")
    assert planes(folder / "out.exr") == picture
    stats = json.loads((folder / "stats.json").read_text())
    workers = stats["workers"]
    assert [worker["name"] for worker in workers] == ["0", "1"]
    assert sum(worker["tiles"] for worker in workers) == TILES
    assert all(worker["tiles"] > 0 and worker["bundles"] > 1 for worker in workers)
    assert sum(worker["kernel_ms"] for worker in workers) == pytest.approx(stats["kernel_ms"], abs=1)
    assert {worker["device"] for worker in workers} == {stats["device"]}


def test_a_film(folder: Path, farm: Farm, film: list[dict[str, bytes]]) -> None:
    works(process(["animate", "film.yaml", "-o", "frame_##.exr", "--cluster", farm.address], folder))
    found = [folder / f"frame_{number:02d}.exr" for number in range(FRAMES)]
    assert [planes(path) for path in found] == film
    times = [path.stat().st_mtime_ns for path in found]
    assert times == sorted(times)  # in order of need
    assert list(folder.glob("*.partial")) == []


def test_two_films_at_once(folder: Path, farm: Farm, film: list[dict[str, bytes]]) -> None:
    order = ["animate", "film.yaml", "--cluster", farm.address]
    with (
        Client(folder, *order, "-o", "a_##.exr") as first,
        Client(folder, *order, "-o", "b_##.exr") as second,
    ):
        assert (first.ended()[0], second.ended()[0]) == (0, 0)
    for name in "ab":
        assert [planes(folder / f"{name}_{number:02d}.exr") for number in range(FRAMES)] == film


def test_python(farm: Farm, alone: Path) -> None:
    with clfractal.Cluster(farm.address) as cluster:
        whole = clfractal.render(HEAVY, executor=cluster, samples=2)
        numbers = [5, 2]
        shown = list(clfractal.frames(alone / "film.yaml", numbers=numbers, executor=cluster, samples=1))
        assert sum(share.tiles for share in cluster.shares()) == TILES + 2 * 4 * 3
    own = clfractal.render(HEAVY, samples=2)
    assert all(np.array_equal(whole[name], own[name], equal_nan=True) for name in own.channels)
    expected = list(clfractal.frames(alone / "film.yaml", numbers=numbers, samples=1))
    assert [number for number, _ in shown] == numbers
    for (_, found), (_, wanted) in zip(shown, expected, strict=True):
        assert all(np.array_equal(found[name], wanted[name], equal_nan=True) for name in wanted.channels)
    with pytest.raises(clfractal.ClfractalError, match="closed"):
        clfractal.render(HEAVY, executor=cluster)


def test_what_is_measured_first(farm: Farm) -> None:
    """Exposure, focus and a stereo pair's screen are measured by a worker; a map and its pixels travel along."""
    scene = {
        "version": 1,
        "formula": {"name": "mandelbulb", "iterations": 8},
        "image": {"width": 96, "height": 64},
        "camera": {"position": [0, -3, 0.4], "f_number": 4, "focus": "auto"},
        "environment": {"name": environment.names()[0]},
        "stereo": {"mode": "split", "fit": "auto"},
        "output": {"exposure": "auto"},
    }
    with clfractal.Cluster(farm.address) as cluster:
        found = clfractal.render(scene, executor=cluster)
    own = clfractal.render(scene)
    assert found.header["scene"] == own.header["scene"]
    assert all(np.array_equal(found[name], own[name], equal_nan=True) for name in own.channels)


# A worker whose device tells another name and driver, by which kinds are told apart. (Dask may run this twice.)
ANOTHER_KIND = """
from dataclasses import replace
from types import SimpleNamespace
from clfractal.cluster import tasks

def renamed(info):
    return replace(info, name="another", driver="another")

tasks.choose = lambda wanted, usual=tasks.choose: SimpleNamespace(info=renamed(usual(wanted).info))
tasks.render_device_of = lambda info, usual=tasks.render_device_of: usual(renamed(info))
"""


def test_render_devices_are_those_that_made_the_tiles(folder: Path) -> None:
    """Of workers of two kinds; in the header, the journal of what was left by a kill, and the statistics."""
    with Farm(folder, workers=1) as farm:
        farm.add(preload=ANOTHER_KIND)
        order = ["render", "heavy.yaml", "--samples", "200", "-o", "out.exr", "--cluster", farm.address]
        with Client(folder, words=holding(TILES // 2, *order, "--quiet")):
            journal_grows(folder, least=TILES // 2)
        ended = process([*order, "--resume", "--stats", "stats.json"], folder)
        film = process(["animate", "film.yaml", "-o", "f_##.exr", "--cluster", farm.address], folder)
    assert ended.status == 0, ended
    _, header = read_exr(folder / "out.exr")
    stats = json.loads((folder / "stats.json").read_text())
    names = [line.split(": ")[1] for line in header["clfractalDevices"].splitlines()]
    assert sorted(names) == sorted({worker["device"] for worker in stats["workers"]})
    assert len(names) == 2
    assert "another" in names
    runs = [run.split("*") for run in header["clfractalTileDevices"].split()]
    counts = {
        name: sum(int(length) for length, number in runs if int(number) == place)
        for place, name in enumerate(names, 1)
    }
    assert sum(counts.values()) == TILES
    assert all(f"{name}: {count} tile" in header["clfractalDevices"] for name, count in counts.items())
    # What was resumed is in the header, and not in the statistics of the second run.
    made = {worker["device"]: worker["tiles"] for worker in stats["workers"]}
    assert all(0 < made[name] <= counts[name] for name in names)
    assert sum(made.values()) == TILES - stats["tiles_resumed"] < TILES
    assert {each["device"]: each["tiles"] for each in stats["devices"]} == made
    told = "devices of 2 kinds, which differ where last digits decide"
    assert (ended.err.count(told), film.status, film.err.count(told)) == (1, 0, 1)


def test_mistakes_keep_their_places(farm: Farm) -> None:
    with clfractal.Cluster(farm.address) as cluster:
        with pytest.raises(clfractal.SceneError, match=r"^region: must lie inside the picture"):
            clfractal.render(HEAVY, executor=cluster, region=(0, 0, 9999, 10))
        with pytest.raises(clfractal.SceneError, match=r"^device: belongs to the cluster"):
            clfractal.render(HEAVY, "cpu", executor=cluster)
    with pytest.raises(clfractal.SceneError, match=r"^executor: must be a clfractal.Cluster, got 'local:2'"):
        clfractal.render(HEAVY, executor="local:2")  # type: ignore[arg-type]


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl makes the certificates")
def test_tls(folder: Path) -> None:
    """As docs/cluster.md says; without a certificate nobody is let in."""
    for line in (
        "req -x509 -newkey rsa:2048 -nodes -days 2 -subj /CN=authority -keyout ca.key -out ca.pem",
        "req -newkey rsa:2048 -nodes -subj /CN=farm -keyout farm.key -out farm.csr",
        "x509 -req -in farm.csr -CA ca.pem -CAkey ca.key -CAcreateserial -days 2 -out farm.pem",
    ):
        subprocess.run(["openssl", *line.split()], cwd=folder, check=True, capture_output=True)
    files = ["--tls-ca-file", "ca.pem", "--tls-cert", "farm.pem", "--tls-key", "farm.key"]
    order = [
        "render",
        "heavy.yaml",
        "--size",
        "64x48",
        "--samples",
        "2",
        "--quiet",
        "-o",
        "out.exr",
        "--cluster",
    ]
    names = {"CA_FILE": "ca.pem", "CLIENT__CERT": "farm.pem", "CLIENT__KEY": "farm.key"}
    known = {f"{PREFIX}{name}": str(folder / file) for name, file in names.items()}
    with Farm(folder, workers=1, protocol="tls", options=files) as farm:
        ended = process([*order, farm.address], folder, known)
        assert (ended.status, ended.err) == (0, "")
        stranger = process([*order, farm.address], folder)
        assert stranger.is_one_line(2, f"--cluster: {farm.address} needs certificates")
        for name, option in (
            ("CA_FILE", "ca-file"),
            ("CLIENT__CERT", "client.cert"),
            ("CLIENT__KEY", "client.key"),
        ):
            other = process([*order, farm.address], folder, {**known, f"{PREFIX}{name}": "nowhere.pem"})
            assert other.is_one_line(2, f"nowhere.pem: is not there; it is distributed.comm.tls.{option}")
        swapped = process([*order, farm.address], folder, {**known, f"{PREFIX}CLIENT__KEY": "ca.key"})
        assert swapped.is_one_line(2, "farm.pem: does not go with its key")
        scene = process([*order, farm.address], folder, {**known, f"{PREFIX}CA_FILE": "heavy.yaml"})
        assert scene.is_one_line(2, "heavy.yaml: holds no certificate of an authority")
        lone = {name: file for name, file in known.items() if not name.endswith("KEY")}
        assert process([*order, farm.address], folder, lone).is_one_line(2, "farm.pem: has no key")
        unsafe = process([*order, farm.address.replace("tls", "tcp")], folder)
        assert unsafe.is_one_line(3, "does not answer within 10 s")
    works(process([*order[:8], "own.exr"], folder))
    assert planes(folder / "out.exr") == planes(folder / "own.exr")


def test_a_grid_travels_along(folder: Path, farm: Farm) -> None:
    """Two frames that show one grid from a file, which no worker has."""
    x = np.linspace(-1, 1, 48, dtype=np.float32)
    z, y, x = np.meshgrid(x, x, x, indexing="ij")
    np.save(folder / "ball.npy", 1 - np.sqrt(x * x + y * y + z * z))
    (folder / "ball.yaml").write_text(
        "version: 1\nformula: {name: hast}\nimage: {width: 64, height: 48}\n"
        "camera: {position: [30, -110, 45], target: [24, 24, 24]}\nrenderer: {type: volume, file: ball.npy}\n"
        "animation: {frames: 2, tracks: {camera.fov: {keys: [{frame: 0, value: 40}, {frame: 1, value: 30}]}}}\n"
    )
    with clfractal.Cluster(farm.address) as cluster:
        found = [film for _, film in clfractal.frames(folder / "ball.yaml", executor=cluster)]
    own = [film for _, film in clfractal.frames(folder / "ball.yaml")]
    for each, wanted in zip(found, own, strict=True):
        assert wanted["A"].max() == 1
        assert all(np.array_equal(each[name], wanted[name], equal_nan=True) for name in wanted.channels)


MOVING = """version: 1
formula: {name: mandelbulb, iterations: 5}
image: {width: 80, height: 48}
camera: {position: [0, -3, 0.5], fov: 45}
renderer: {samples: 4}
animation:
  frames: 3
  shutter: 0.5
  tracks:
    camera.position: {keys: [{frame: 0, value: [-0.6, -3, 0.5]}, {frame: 2, value: [0.6, -2, 0.8]}]}
    lights.0.intensity: {file: table.csv, column: loud}
"""


def test_motion_blur_and_a_table_travel_along(folder: Path, farm: Farm) -> None:
    """Frames whose samples have scenes of their own; and a still of a scene that moves. No worker has the table."""
    (folder / "moving.yaml").write_text(MOVING)
    (folder / "table.csv").write_text("loud\n1\n2\n0.5\n")
    own = [film for _, film in clfractal.frames(folder / "moving.yaml")]
    scene = clfractal.load_scene(folder / "moving.yaml")
    still = clfractal.render(scene)
    (folder / "table.csv").unlink()
    with clfractal.Cluster(farm.address) as cluster:
        found = [film for _, film in clfractal.frames(scene, executor=cluster)]
        far = clfractal.render(scene, executor=cluster)
    for each, wanted in zip([*found, far], [*own, still], strict=True):
        for name in wanted:
            np.testing.assert_array_equal(each[name], wanted[name], name)
