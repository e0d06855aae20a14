"""What of the cluster needs no processes: addresses, messages, sizes of bundles."""

from __future__ import annotations

import math
import multiprocessing
import subprocess
import sys
from pathlib import Path, PureWindowsPath

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import clfractal
from clfractal.cluster.fingerprint import fingerprint
from clfractal.cluster.guard import check_main
from clfractal.cluster.local_cluster import Place
from clfractal.cluster.message import Array, Digests, pack, unpack
from clfractal.cluster.sizes import SECONDS, Pace
from tests.shell import InProcess, environment


@pytest.mark.parametrize(
    ("text", "address", "workers"),
    [
        ("local:1", "", 1),
        (" local:256 ", "", 256),
        ("host:8786", "tcp://host:8786", 0),
        ("tls://render-1.example.org:8786", "tls://render-1.example.org:8786", 0),
        ("tcp://[::1]:8786", "tcp://[::1]:8786", 0),
    ],
)
def test_places(text: str, address: str, workers: int) -> None:
    assert Place.of(text) == Place(address, workers)


@pytest.mark.parametrize(
    "text",
    [
        *("", "local", "local:", "local:0", "local:257", "local:-1", "local:two", "local:\u0663"),
        *("host", "host:", "host:0", "host:80", "host:65536", "tcp://host:0", "locale:4"),
        *("http://host:8786", "tcp://host:8786/x", "a b:8786", "tcp://:8786"),
    ],
)
def test_what_is_no_place(text: str) -> None:
    with pytest.raises(clfractal.SceneError, match=r"^cluster: must be "):
        Place.of(text)


@given(st.text(max_size=40))
def test_any_text_is_a_place_or_refused(text: str) -> None:
    try:
        place = Place.of(text)
    except clfractal.SceneError:
        return
    assert Place.of(str(place)) == place


def test_the_option_is_named(clf: InProcess, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    ended = clf("render", "scene.yaml", "-o", "out.png", "--cluster", "locale:4")
    assert ended.is_one_line(2, "--cluster: must be a scheduler such as tcp://HOST:8786, or local:N")
    monkeypatch.setitem(sys.modules, "distributed", None)
    ended = clf("render", "scene.yaml", "-o", "out.png", "--cluster", "local:1")
    assert ended.is_one_line(2, "--cluster: needs the package distributed: pip install 'clfractal[cluster]'")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["scene.yaml"]


def test_a_job_travels_without_its_large_arrays(tmp_path: Path) -> None:
    values = np.random.default_rng(1).random((40, 40, 40), np.float32)
    np.save(tmp_path / "grid.npy", values)
    text = (
        "version: 1\nformula: {name: hast}\ncamera: {}\nimage: {width: 64, height: 48}\n"
        "renderer: {type: volume, file: grid.npy}\n"
    )
    (tmp_path / "scene.yaml").write_text(text)
    with clfractal.Engine() as engine:
        job = engine.prepare(tmp_path / "scene.yaml")
        digests = Digests()
        message = pack(job, digests)
        assert len(message.data) < 50_000 < values.nbytes
        (array,) = message.arrays.values()
        assert array.shape == values.shape
        again = unpack(message.data, message.arrays)
        assert again.identity(0) == job.identity(0)
        assert again.scene.files == job.scene.files
        assert pack(again, digests).arrays.keys() == message.arrays.keys()
        with pytest.raises(KeyError):
            unpack(message.data, {})


def test_arrays_are_told_apart() -> None:
    digests = Digests()
    one = np.zeros((128, 256), np.float32)
    others: list[Array] = [
        one.reshape(256, 128),
        one.view(np.int32),
        one + 1,
        np.zeros((128, 256), np.float64),
    ]
    assert len({digests.of(each) for each in [one, *others]}) == 5
    assert digests.of(one.copy()) == digests.of(one)
    # Small ones stay in the message.
    assert pack([np.zeros(8)]).arrays == {}


def test_paths_of_another_system_arrive() -> None:
    assert unpack(pack(PureWindowsPath("a/b.yaml")).data, {}) == Path("a\\b.yaml")


def test_the_fingerprint_is_of_this_program() -> None:
    assert len(fingerprint()) == 12
    assert int(fingerprint(), 16) >= 0


@given(
    each=st.floats(1e-6, 100),
    samples=st.integers(1, 1000),
    left=st.integers(1, 300_000),
    workers=st.integers(1, 2000),
    tile_bytes=st.integers(4096, 200_000),
)
def test_bundles_take_about_a_second(
    each: float, samples: int, left: int, workers: int, tile_bytes: int
) -> None:
    pace = Pace()
    assert 1 <= pace.bundle(samples, left, workers, tile_bytes) <= 8  # as long as nothing is known
    pace.learn(10, samples, 10 * each)
    size = pace.bundle(samples, left, workers, tile_bytes)
    assert 1 <= size <= left
    assert size == 1 or size * each <= SECONDS * 1.001
    assert size == 1 or size * tile_bytes <= 1 << 25
    # Enough is left for the others, but for scraps of a tenth of a second.
    assert size == 1 or size <= max(math.ceil(left / (2 * workers)), math.ceil(0.1 / each) + 1)


def test_the_pace_follows_what_is_measured() -> None:
    pace = Pace()
    pace.learn(100, 4, 1.0)
    for _ in range(20):
        pace.learn(10, 4, 1.0)  # what comes now is ten times as heavy
    assert pace.bundle(4, 100_000, 2, 4096) in (9, 10)
    assert pace.bundle(8, 100_000, 2, 4096) in (4, 5)


PROGRAM = """import clfractal
{line}
{indent}with clfractal.Cluster("local:2") as cluster:
{indent}    print("made")
"""


def run(*words: str, folder: Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-P", *words], cwd=folder, env=environment(), capture_output=True, text=True
    )


@pytest.mark.parametrize("line", ["", "if True:", "if cluster := 3:"])
def test_a_program_without_its_guard_is_told_in_a_line(line: str, tmp_path: Path) -> None:
    """Nothing is started: neither processes, nor what they would write."""
    (tmp_path / "program.py").write_text(PROGRAM.format(line=line, indent="    " if line else ""))
    ended = run("program.py", folder=tmp_path)
    assert ended.returncode == 1
    assert ended.stderr.count("\n") < 12
    assert "distributed" not in ended.stderr
    last = ended.stderr.splitlines()[-1]
    assert last.startswith("clfractal.errors.SceneError: cluster: local:2 starts processes")
    assert last.endswith('below `if __name__ == "__main__":`')


@pytest.mark.parametrize(
    "text",
    [
        "if __name__ == '__main__':\n    check_main('local:2')\n",
        "def work():\n    check_main('local:2')\nif '__main__' == __name__:\n    work()\n",
        "if __name__ != '__main__':\n    raise SystemExit\ncheck_main('local:2')\n",
        "try:\n    if __name__ == '__main__':\n        check_main('local:2')\nfinally:\n    pass\n",
    ],
)
def test_a_program_with_a_guard_may_start_processes(text: str, tmp_path: Path) -> None:
    (tmp_path / "program.py").write_text("from clfractal.cluster.guard import check_main\n" + text)
    for how in (
        ["program.py"],
        ["-c", "from clfractal.cluster.guard import check_main; check_main('local:1')"],
    ):
        ended = run(*how, folder=tmp_path)
        assert (ended.returncode, ended.stderr) == (0, "")


def test_a_process_that_runs_the_program_again_starts_none(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(multiprocessing.current_process(), "_inheriting", True, raising=False)
    with pytest.raises(clfractal.SceneError, match="below `if __name__"):
        check_main("local:2")
