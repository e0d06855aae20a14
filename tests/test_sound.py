"""`clfractal sound` against sines, whose loudness and frequency are known, and files of every kind."""

from __future__ import annotations

import struct
import wave
from contextlib import suppress
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.io import wavfile

import clfractal
from clfractal.engine.loudness import Shaping, loudness, shaped
from clfractal.files.columns import read_columns
from clfractal.files.sound import Sound, read_sound
from tests.calls import failure
from tests.shell import InProcess

SCENE = None  # of these tests each writes its own

RATE = 44_100


def sine(hertz: float, seconds: float = 2.0, rate: int = RATE, scale: float = 1.0) -> npt.NDArray[np.float32]:
    times = np.arange(int(seconds * rate)) / rate
    return (scale * np.sin(2 * np.pi * hertz * times)).astype(np.float32)


@pytest.mark.parametrize("kind", [np.int16, np.int32, np.uint8, np.float32, np.float64])
def test_every_kind_of_number_is_read_as_scipy_reads_it(tmp_path: Path, kind: type[np.number]) -> None:
    tone = sine(440, 0.1, scale=0.5)
    if issubclass(kind, np.integer):
        largest = np.iinfo(kind).max
        numbers = np.round(tone * 0.5 * largest + (128 if kind is np.uint8 else 0)).astype(kind)
        expected = (numbers.astype(np.float64) - (128 if kind is np.uint8 else 0)) / (
            128 if kind is np.uint8 else largest + 1.0
        )
    else:
        numbers = tone.astype(kind)
        expected = numbers.astype(np.float64)
    stereo = np.stack([numbers, numbers], axis=1)
    wavfile.write(tmp_path / "a.wav", RATE, stereo)
    found = read_sound(tmp_path / "a.wav")
    assert found.rate == RATE
    np.testing.assert_allclose(found.samples, expected, atol=1e-7)


def test_24_bits_and_several_channels(tmp_path: Path) -> None:
    numbers = np.array([[0, 2**22], [-(2**23), 2**23 - 1], [1, -1]], np.int32)
    with wave.open(str(tmp_path / "a.wav"), "wb") as file:
        file.setnchannels(2)
        file.setsampwidth(3)
        file.setframerate(8000)
        file.writeframes(b"".join(int(n).to_bytes(3, "little", signed=True) for n in numbers.ravel()))
    found = read_sound(tmp_path / "a.wav")
    np.testing.assert_allclose(found.samples, numbers.mean(axis=1) / 2**23, atol=1e-7)
    assert found.seconds == 3 / 8000


@given(st.floats(50, 9_000), st.floats(0.01, 1))
def test_a_sine_is_as_loud_as_it_is_in_its_own_band_alone(hertz: float, scale: float) -> None:
    bands = [(0.0, np.inf), (hertz * 0.7, hertz * 1.4), (hertz * 2, 2e4), (0.0, hertz * 0.4)]
    found = loudness(Sound(sine(hertz, 1.0, scale=scale), RATE), 30, 30, bands)
    middle = found[5:25]
    np.testing.assert_allclose(middle[:, 0], scale, rtol=0.01)
    np.testing.assert_allclose(middle[:, 1], scale, rtol=0.05)
    assert middle[:, 2].max() < 0.02 * scale
    assert middle[:, 3].max() < 0.05 * scale


def test_bands_share_all_of_the_energy() -> None:
    noise = np.random.default_rng(1).uniform(-1, 1, RATE).astype(np.float32)
    bands = [(0.0, np.inf), (0.0, 300.0), (300.0, 3000.0), (3000.0, np.inf)]
    found = loudness(Sound(noise, RATE), 25, 25, bands)[3:20]
    np.testing.assert_allclose((found[:, 1:] ** 2).sum(axis=1), found[:, 0] ** 2, rtol=1e-9)
    np.testing.assert_allclose(found[:, 0], np.sqrt(2 / 3), rtol=0.05)


def test_a_beat_is_in_its_frame() -> None:
    sound = np.zeros(RATE, np.float32)
    at = int(0.5 * RATE)
    sound[at : at + 400] = sine(1000, 400 / RATE)
    found = loudness(Sound(sound, RATE), 30, 30, [(0.0, np.inf)])[:, 0]
    assert found.argmax() == 15
    assert found[:13].max() == 0 == found[18:].max()


def test_what_is_made_of_it() -> None:
    levels = np.array([[0.0], [0.4], [0.0], [0.2], [0.0]])
    plain = Shaping(fade=0)
    np.testing.assert_allclose(shaped(levels, 10, plain)[:, 0], [0, 1, 0, 0.5, 0])
    np.testing.assert_allclose(shaped(levels, 10, Shaping(normal=False, fade=0, gain=3)), 3 * levels)
    np.testing.assert_allclose(shaped(levels, 10, Shaping(threshold=0.6, fade=0))[:, 0], [0, 1, 0, 0, 0])
    faded = shaped(levels, 10, Shaping(fade=0.1))[:, 0]
    np.testing.assert_allclose(faded, [0, 1, np.exp(-1), 0.5, 0.5 * np.exp(-1)])
    assert (shaped(np.zeros((3, 2)), 10, Shaping()) == 0).all()


def test_a_table_from_the_shell_moves_a_scene(clf: InProcess) -> None:
    both = np.concatenate([sine(60, 1.0), sine(5000, 1.0)])
    wavfile.write("a.wav", RATE, (both * 32767).astype(np.int16))
    ended = clf(
        "sound",
        "a.wav",
        "-o",
        "a.csv",
        "--fps",
        "10",
        "--fade",
        "0",
        "--band",
        "low=20-200",
        "--band",
        "high=2000-8000",
    )
    assert ended.err == "a.csv: 20 frames, level, low, high\n"
    table = read_columns(Path("a.csv"), dict.fromkeys(["frame", "time", "level", "low", "high"]), "a.csv", 10)
    assert table["frame"] == list(range(20))
    np.testing.assert_allclose(table["time"], np.arange(20) / 10)
    assert min(table["low"][2:8]) > 0.95 > 0.01 > max(table["low"][12:18])
    assert min(table["high"][12:18]) > 0.95 > 0.01 > max(table["high"][2:8])
    scene = {"version": 1, "formula": {"name": "hast"}, "camera": {}}
    tracks = {"material.ambient": {"file": "a.csv", "column": "low"}}
    moving = clfractal.load_scene({**scene, "animation": {"fps": 10, "frames": 20, "tracks": tracks}})
    assert clfractal.at_frame(moving, 5).material.ambient > 0.95
    assert clfractal.at_frame(moving, 15).material.ambient < 0.01
    assert clf("sound", "a.wav", "--fps", "10", "--frames", "30", "--quiet").err == ""
    longer = read_columns(Path("tracks.csv"), dict.fromkeys(["bass"]), "tracks.csv", 10)["bass"]
    assert len(longer) == 30
    assert longer[29] < 1e-3


def _wave(form: bytes, data: bytes = b"\0" * 8) -> bytes:
    body = b"WAVEfmt " + struct.pack("<I", len(form)) + form + b"data" + struct.pack("<I", len(data)) + data
    return b"RIFF" + struct.pack("<I", len(body)) + body


FORM = struct.pack("<HHIIHH", 1, 1, 8000, 16000, 2, 16)
DAMAGED = {
    b"": "is no WAV file",
    b"RIFF1234AVI ": "is no WAV file",
    b"RIFF1234WAVE": "holds no sound",
    _wave(FORM[:10]): "is damaged: its form is cut short",
    _wave(
        struct.pack("<HHIIHH", 2, 1, 8000, 8000, 1, 4)
    ): "must hold whole numbers of 8 to 32 bits, or floats",
    _wave(struct.pack("<HHIIHH", 1, 0, 8000, 16000, 2, 16)): "is damaged: its form makes no sense",
    _wave(struct.pack("<HHIIHH", 1, 1, 1, 2, 2, 16)): "is damaged: its form makes no sense",
    _wave(FORM, b"\0"): "holds no sound",
    _wave(struct.pack("<HHIIHH", 3, 1, 8000, 32000, 4, 32), struct.pack("<f", np.inf)): "not finite",
    b"RIFF1234WAVEdata" + struct.pack("<I", 4) + b"\0\0\0\0": "is damaged: its sound comes before its form",
}


@pytest.mark.parametrize("content", DAMAGED)
def test_damaged_files(tmp_path: Path, content: bytes) -> None:
    (tmp_path / "a.wav").write_bytes(content)
    assert DAMAGED[content] in failure(clfractal.FileError, read_sound, tmp_path / "a.wav").message


@given(st.binary(max_size=200))
def test_any_bytes_are_read_or_refused(tmp_path_factory: pytest.TempPathFactory, content: bytes) -> None:
    path = tmp_path_factory.mktemp("sound") / "a.wav"
    path.write_bytes(_wave(FORM)[:12] + content)
    with suppress(clfractal.FileError):
        assert np.isfinite(read_sound(path).samples).all()


REFUSED = {
    ("--fps", "0"): "--fps: must be from 0.01 to 1000, got 0",
    ("--frames", "0"): "--frames: must be from 1 to 1e+06, got 0",
    ("--threshold", "1"): "--threshold: must be from 0 to 0.99, got 1",
    ("--band", "kick"): "--band: must be NAME=LOW-HIGH in Hz, such as kick=40-120; got 'kick'",
    ("--band", "a=9-5"): "--band: must be NAME=LOW-HIGH",
    (
        "--band",
        "sub=42-49",
    ): "--band: 42-49 Hz holds no frequency that is told apart: they are 10 Hz apart, up to 4000 Hz",
    ("--band", "level=1-2"): "--band: must have a name of its own, got 'level'",
    ("-o", "a.txt"): "a.txt: unknown extension '.txt'",
    ("-o", "-"): "give the table a name",
}


def test_bands_have_names_of_their_own(clf: InProcess) -> None:
    wavfile.write("a.wav", 8000, np.zeros(800, np.int16))
    ended = clf("sound", "a.wav", "--band", "kick=20-60", "--band", "kick=1000-2000")
    assert ended.is_one_line(2, "--band: must have a name of its own, got 'kick' twice")


@pytest.mark.parametrize("options", REFUSED)
def test_mistakes(clf: InProcess, options: tuple[str, str]) -> None:
    wavfile.write("a.wav", 8000, np.zeros(800, np.int16))
    assert clf("sound", "a.wav", *options).is_one_line(2, REFUSED[options])
    assert [path.name for path in Path().iterdir()] == ["a.wav"]
