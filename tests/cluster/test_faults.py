"""Whatever is killed, stopped or lost: the same bits in the end, or one line and work that can be resumed."""

from __future__ import annotations

import os
import random
import signal
import sys
import time
from pathlib import Path

import pytest

import clfractal
from clfractal.cluster import dispatch, link
from clfractal.files.exr import read_exr
from tests.cluster.farm import FRAMES, HEAVY, HELD, LETS_GO, Client, Farm, free_port, journal_grows
from tests.cluster.kills import kill_at_random
from tests.interrupts import planes
from tests.long_renders import LIMIT_SECONDS, holding
from tests.shell import Running, has_tiles, process, wait_until, works

resource = pytest.importorskip("resource", reason="signals and limits of processes are those of POSIX")


def impatient(folder: Path, seconds: float, *order: str) -> Running:
    """The program, which waits no minute for what has gone: that is long for a test."""
    shorter = f"from clfractal.cluster import dispatch; dispatch.RETURN_SECONDS = {seconds}"
    program = f"{shorter}; from clfractal.cli import main; main()"
    return Running(folder, words=[sys.executable, "-P", "-c", program, *order])


def test_workers_killed_during_a_picture(folder: Path, farm: Farm, picture: dict[str, bytes]) -> None:
    order = ["render", "heavy.yaml", "-o", "out.exr", "--cluster", farm.address]
    with Client(folder, *order) as client:
        begun = has_tiles(folder / "out.exr.partial")
        kills = kill_at_random(farm, client, random.Random(1), most=4, begun=begun)
        status, told = client.ended()
    assert (status, kills > 0) == (0, True), told
    assert planes(folder / "out.exr") == picture


def test_workers_killed_during_a_film(folder: Path, farm: Farm, film: list[dict[str, bytes]]) -> None:
    order = ["animate", "film.yaml", "-o", "frame_##.exr", "--cluster", farm.address]
    with Client(folder, *order) as client:
        begun = (folder / "frame_00.exr").exists
        kills = kill_at_random(farm, client, random.Random(2), most=3, begun=begun)
        status, told = client.ended()
    assert (status, kills > 0) == (0, True), told
    assert [planes(folder / f"frame_{number:02d}.exr") for number in range(FRAMES)] == film


def test_the_scheduler_returns(folder: Path, farm: Farm, picture: dict[str, bytes]) -> None:
    with Client(folder, "render", "heavy.yaml", "-o", "out.exr", "--cluster", farm.address) as client:
        journal_grows(folder)
        farm.kill_scheduler()
        assert client.process.stderr is not None
        told = []
        for line in client.process.stderr:
            told.append(line.rstrip("\n"))
            if "the scheduler is gone" in line:
                farm.start_scheduler()
                farm.add()
        status, _ = client.ended()
    assert status == 0, told
    lines = [line for line in told if line.startswith(farm.address)]
    assert lines == [
        f"{farm.address}: the scheduler is gone; waiting 60 s for it",
        f"{farm.address}: the scheduler is back",
    ]
    assert planes(folder / "out.exr") == picture


def test_the_scheduler_does_not_return(folder: Path, farm: Farm, picture: dict[str, bytes]) -> None:
    """One line, status 3; the journal is kept, and one machine ends what a cluster began."""
    order = ("render", "heavy.yaml", "-o", "out.exr", "--quiet", "--cluster", farm.address)
    running = impatient(folder, 2.0, *order)
    journal_grows(folder)
    farm.kill_scheduler()
    status, told = running.ended_by()
    assert status == 3
    assert told == f"{farm.address}: the scheduler is gone, and did not return in time\n"
    works(process(["render", "heavy.yaml", "-o", "out.exr", "--resume", "--stats", "s.json"], folder))
    assert '"tiles_resumed": 0' not in (folder / "s.json").read_text()
    assert planes(folder / "out.exr") == picture


def test_a_worker_that_stops_answering(farm: Farm, monkeypatch: pytest.MonkeyPatch, alone: Path) -> None:
    monkeypatch.setattr(link, "SILENT_SECONDS", 8.0)  # of a busy machine, whose other worker is not that late
    told: list[str] = []
    stopped = farm.workers["w0"]
    with clfractal.Cluster(farm.address, tell=told.append) as cluster:

        def stop(state: clfractal.Progress) -> None:
            if state.tiles_done < state.tiles / 2:
                os.kill(stopped.pid, signal.SIGSTOP)

        found = clfractal.render(HEAVY, progress=stop, executor=cluster)
    whole, _ = read_exr(alone / "out.exr")
    assert all(found[name].tobytes() == whole[name].tobytes() for name in ("R", "Z", "N.X"))
    assert [line.partition(" (")[0] for line in told] == ["worker w0"]
    assert told[0].endswith("does not answer; its work goes to others")


def test_a_worker_that_stops_while_it_is_read(
    farm: Farm, monkeypatch: pytest.MonkeyPatch, alone: Path
) -> None:
    """Its connection stays open, and nothing comes any more: what it had is done again by the other one."""
    worker = pytest.importorskip("distributed.worker")
    monkeypatch.setattr(link, "SILENT_SECONDS", 8.0)
    told, left = list[str](), ["w0"]

    async def read(rpc: object, keys: object, address: str, *more: object, **settings: object) -> object:
        # (It has given an answer before, so its connection is there, and the time limit of connecting does not count.)
        if any(share.address == address and share.name in left for share in cluster.shares()):
            os.kill(farm.workers[left.pop()].pid, signal.SIGSTOP)
        return await usual(rpc, keys, address, *more, **settings)

    usual = worker.get_data_from_worker
    monkeypatch.setattr(worker, "get_data_from_worker", read)
    with clfractal.Cluster(farm.address, tell=told.append) as cluster:
        found = clfractal.render(HEAVY, executor=cluster)
    whole, _ = read_exr(alone / "out.exr")
    assert not left
    assert all(found[name].tobytes() == whole[name].tobytes() for name in ("R", "Z", "N.X"))
    assert [line.partition(" (")[0] for line in told] == ["worker w0"]


def test_late_workers_join_and_early_ones_go(folder: Path, picture: dict[str, bytes]) -> None:
    with Farm(folder, workers=0) as farm:
        order = ["render", "heavy.yaml", "-o", "out.exr", "--stats", "s.json", "--cluster", farm.address]
        with Client(folder, *order) as client:
            first = farm.add(preload=HELD)
            journal_grows(folder)
            farm.add(preload=LETS_GO)
            wait_until((folder / "go").exists)
            farm.kill(first)
            status, told = client.ended()
        assert status == 0, told
    assert planes(folder / "out.exr") == picture
    assert '"w0"' in (folder / "s.json").read_text()
    assert '"w1"' in (folder / "s.json").read_text()


def test_interrupts_end_the_work_of_the_workers(folder: Path, farm: Farm) -> None:
    """A tile of minutes: its worker ends it as soon as nobody wants it."""
    order = ["render", "heavy.yaml", "--set", "renderer.samples=65536", "-o", "out.exr"]
    with Client(folder, *order, "--cluster", farm.address) as client:
        wait_until(lambda: _at_work(farm))
        time.sleep(2)
        assert _at_work(farm)
        start = time.monotonic()
        client.process.send_signal(signal.SIGINT)
        lines = iter(client.process.stderr or [])
        assert any(line.endswith("out.exr: interrupted before a tile was done\n") for line in lines)
        assert time.monotonic() - start < LIMIT_SECONDS  # the answer; to end the process may take longer
        assert client.ended()[0] == 130
    # The same workers are free at once.
    with clfractal.Cluster(farm.address) as cluster:
        start = time.monotonic()
        clfractal.render(HEAVY, executor=cluster, samples=1)
        assert time.monotonic() - start < 60  # the tile would take longer
    assert set(farm.workers) == {"w0", "w1"}


def _at_work(farm: Farm) -> bool:
    from distributed import Client as DaskClient

    with DaskClient(farm.address, set_as_default=False) as client:
        return any("clfractal-tiles" in str(keys) for keys in client.processing().values())


def test_a_killed_client_is_resumed(folder: Path, farm: Farm, picture: dict[str, bytes]) -> None:
    order = ["render", "heavy.yaml", "-o", "out.exr", "--quiet", "--cluster", farm.address]
    with Client(folder, words=holding(1, *order)):
        journal_grows(folder)
    works(process([*order, "--resume", "--stats", "s.json"], folder))
    assert '"tiles_resumed": 0' not in (folder / "s.json").read_text()
    assert planes(folder / "out.exr") == picture


def test_a_full_disk(folder: Path, farm: Farm, picture: dict[str, bytes]) -> None:
    """The system lets the client write no more than a part of its journal."""
    order = ["render", "heavy.yaml", "-o", "out.exr", "--cluster", farm.address, "--quiet"]
    limited = Running(
        folder, *order, before=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (600_000, 600_000))
    )
    status, told = limited.ended_by(seconds=120)
    assert (status, told.count("\n")) == (2, 1), told
    assert told.startswith("out.exr.partial: ")
    assert not (folder / "out.exr").exists()
    works(process([*order, "--resume"], folder))
    assert planes(folder / "out.exr") == picture


def test_workers_of_another_version_or_without_a_device(folder: Path, farm: Farm) -> None:
    for name in list(farm.workers):
        farm.kill(name)
    _other_program(folder / "other")
    farm.add({"PYTHONPATH": str(folder / "other")})
    farm.add({"CLFRACTAL_DEVICE": "abacus"})
    order = ["render", "heavy.yaml", "-o", "out.exr", "--cluster", farm.address]
    with Client(folder, *order) as client:
        status, told = client.ended()
    assert status == 3
    lines = {line.partition(" (")[0]: line for line in told.splitlines() if line.startswith("worker")}
    assert set(lines) == {"worker w2", "worker w3"}
    assert "is left out: it has clfractal 9.9.9 (" in lines["worker w2"]
    assert f"and this is clfractal {clfractal.__version__} (" in lines["worker w2"]
    assert "is left out: unknown device 'abacus'" in lines["worker w3"]
    assert f"{farm.address}: no worker is fit: " in told.splitlines()[-1]
    assert not list(folder.glob("out.exr*"))
    # One that is fit is enough.
    farm.add()
    works(process([*order, "--size", "64x48", "--quiet"], folder))


def _other_program(where: Path) -> None:
    """A copy of the program with another version."""
    import shutil

    home = Path(clfractal.__file__).resolve().parents[1]
    for name in ("clfractal", "kernels", "scenes"):
        if (home / name).exists():
            shutil.copytree(home / name, where / name, ignore=shutil.ignore_patterns("__pycache__", "*.exr"))
    home = where / "clfractal/files/resources.py"
    home.write_text(home.read_text().replace(f'"{clfractal.__version__}"', '"9.9.9"'))


WITHOUT_FLOAT64 = """
from dataclasses import replace
from clfractal.cluster import tasks

def choose(wanted, *, usual=tasks.choose):
    device = usual(wanted)
    device.info = replace(device.info, has_float64=False, driver="without float64")
    return device

tasks.choose = choose
"""


def test_the_last_worker_with_float64_is_lost(folder: Path, farm: Farm) -> None:
    """One line while another one is waited for, and one at the end, status 3; the journal is kept. Or it goes on."""
    farm.add(preload=WITHOUT_FLOAT64)
    order = ["render", "heavy.yaml", "--precision", "float64", "--samples", "100", "-o", "out.exr"]
    order += ["--cluster", farm.address]
    running = impatient(folder, 3.0, *order)
    journal_grows(folder)
    for name in ("w0", "w1"):
        farm.kill(name)
    status, told = running.ended_by()
    assert status == 3
    lines = [line for line in told.splitlines() if line.startswith(farm.address)]
    assert lines == [
        f"{farm.address}: no worker with float64 is left; waiting 3 s for one",
        f"{farm.address}: there has been no worker with float64 for 3 s",
    ]
    assert (folder / "out.exr.partial").exists()
    first = farm.add()
    with Client(folder, *order, "--resume", "--stats", "s.json") as client:
        journal_grows(folder, least=10)
        farm.kill(first)
        farm.add()
        status, told = client.ended()
    assert status == 0, told
    assert '"tiles_resumed": 0' not in (folder / "s.json").read_text()
    own = ["render", "heavy.yaml", "--precision", "float64", "--samples", "100", "-o", "own.exr"]
    works(process(own, folder))
    assert planes(folder / "out.exr") == planes(folder / "own.exr")


def test_nobody_answers(folder: Path) -> None:
    start = time.monotonic()
    address = f"127.0.0.1:{free_port()}"
    ended = process(["render", "heavy.yaml", "-o", "out.exr", "--quiet", "--cluster", address], folder)
    assert ended.is_one_line(3, f"tcp://{address}: the scheduler does not answer within 10 s")
    assert time.monotonic() - start < 10 + 10  # it waits once
    assert not list(folder.glob("out.exr*"))


def test_the_limits_are_those_that_are_told() -> None:
    assert (dispatch.RETURN_SECONDS, link.ANSWER_SECONDS) == (60, 10)
