"""Files of grids in the shell: who reads a file follows from what it is, and grids that show nothing say what they hold."""

from __future__ import annotations

import io
import sys
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pytest

from clfractal.files.file_kinds import Kind, kind_of
from clfractal.files.volume_file import Volume, write_volume
from clfractal.scene.grid_values import finite_range, in_words, is_finite_somewhere, lacking
from tests.shell import InProcess, works

Floats = npt.NDArray[np.float32]

VOLUME = (
    "a volume, not a scene: a scene shows it by renderer.file, and `clfractal mesh` makes triangles of it"
)
NO_VOLUME = "is neither a NRRD nor a NPY file"


@pytest.fixture
def shell(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> InProcess:
    monkeypatch.chdir(tmp_path)
    return InProcess(capsys)


FILES: list[tuple[str, bytes, Kind | None]] = [
    ("empty.exr", b"", "exr"),
    ("bytes.exr", b"\x76\x2f\x31\x02", "exr"),
    ("latin.exr", b"\xe4\xf6", "exr"),
    # A scene may have any name.
    ("scene.png", b"version: 1\n", None),
    ("cut in a letter.exr", "# Schneeflöcke".encode()[:11], None),
    ("empty.png", b"", "png"),
    ("cut.png", b"\x89PN", "png"),
    ("empty.JPG", b"", "photo"),
    ("empty.nrrd", b"", "volume"),
    ("text.nrrd", b"no volume", "volume"),
    ("empty.nhdr", b"", "volume"),
    ("bytes.npy", b"\x80\x81", "volume"),
    # What a file holds counts more than its name.
    ("nrrd.yaml", b"NRRD0004\n", "volume"),
    ("nrrd.exr", b"NRRD0004\n", "volume"),
    ("npy", b"\x93NUMPY\1\0", "volume"),
    ("exr.yaml", b"\x76\x2f\x31\x01\2\0\0\0", "exr"),
    ("empty.yaml", b"", None),
    ("scene", b"version: 1", None),
]


@pytest.mark.parametrize(("name", "content", "kind"), FILES, ids=[name for name, _, _ in FILES])
def test_what_a_file_is(name: str, content: bytes, kind: Kind | None, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    assert kind_of(tmp_path / name) == kind


@pytest.mark.parametrize(
    ("name", "scene", "mesh"),
    [
        ("empty.exr", "is not an OpenEXR file", "is not an OpenEXR file"),
        ("empty.png", "is not a PNG file", "is not a PNG file"),
        ("cut.png", "is not a PNG file", "is not a PNG file"),
        ("empty.JPG", "is neither a JPEG nor a WebP file", "is neither a JPEG nor a WebP file"),
        ("text.nrrd", VOLUME, NO_VOLUME),
        ("empty.nrrd", VOLUME, NO_VOLUME),
        ("bytes.npy", VOLUME, NO_VOLUME),
        ("nrrd.yaml", VOLUME, "is damaged: its header has no field 'encoding'"),
        ("empty.yaml", "is empty", "is empty"),
    ],
)
def test_who_reads_a_file(name: str, scene: str, mesh: str, shell: InProcess) -> None:
    content = {name: content for name, content, _ in FILES}[name]
    Path(name).write_bytes(content)
    for words in (["render", name, "-o", "o.png"], ["check", name], ["voxelize", name, "-o", "o.nrrd"]):
        assert shell(*words).is_one_line(2, f"{name}:", scene)
    assert shell("mesh", name, "-o", "o.ply").is_one_line(2, f"{name}:", mesh)
    assert [path.name for path in Path().iterdir()] == [name]


def test_a_large_array_on_standard_input(shell: InProcess, monkeypatch: pytest.MonkeyPatch) -> None:
    """Text is limited to a megabyte, grids are not."""
    kept = io.BytesIO()
    np.save(kept, np.linspace(0, 1, 60**3).reshape(60, 60, 60))
    monkeypatch.setattr(sys, "stdin", io.TextIOWrapper(io.BytesIO(kept.getvalue())))
    assert shell("mesh", "-", "-o", "o.ply").status == 0
    assert Path("o.ply").stat().st_size > 1000


# --- what grids hold ---


def of(*values: float) -> Floats:
    """A grid of 40 planes that has all these values, the first most often."""
    found = np.full((40, 4, 4), values[0], np.float32)
    found.reshape(-1)[-len(values) :] = values
    return found


INF, NAN = np.inf, np.nan


@pytest.mark.parametrize(
    ("values", "told"),
    [
        (of(0, 63), "its values are from 0 to 63"),
        (of(3), "all its values are 3"),
        (of(3, NAN), "all its values are 3"),
        (of(2, INF), "all its finite values are 2, others are infinite"),
        (of(2, -INF, NAN, 7), "its finite values are from 2 to 7, others are infinite"),
        (of(NAN), "it holds nothing but NaN"),
        (of(INF), "it holds nothing but infinities"),
        (of(-INF, INF), "it holds nothing but infinities"),
        (of(INF, NAN), "it holds nothing but infinities and NaN"),
        (np.arange(48, dtype=np.uint8).reshape(3, 4, 4), "its values are from 0 to 47"),
    ],
)
def test_values_in_words(values: Floats, told: str) -> None:
    assert in_words(values) == told
    assert (finite_range(values) is None) == (not is_finite_somewhere(values)) == (lacking(values) in told)


def keep(name: str, values: Floats, more: str = "") -> None:
    """A grid, a scene that shows it, and one in which it is an object."""
    head = "version: 1\nformula: {name: mandelbulb}\nimage: {width: 8, height: 8}\ncamera: {position: [20, -90, 30]}\n"
    write_volume(f"{name}.nrrd", Volume(values))
    Path(f"{name}.yaml").write_text(f"{head}renderer: {{type: volume, file: {name}.nrrd{more}}}\n")
    Path(f"{name}_object.yaml").write_text(f"{head}objects: {{v: {{type: volume, file: {name}.nrrd}}}}\n")


@pytest.mark.parametrize(
    ("values", "what"),
    [(of(NAN), "NaN"), (of(INF), "infinities"), (of(-INF, NAN), "infinities and NaN")],
)
def test_grids_without_a_value(values: Floats, what: str, shell: InProcess) -> None:
    keep("v", values)
    told = f"v.yaml: the volume holds nothing but {what}; renderer.file has no value to show\n"
    ended = works(shell("render", "v.yaml", "-o", "o.png"))
    assert told in ended.err
    ended = shell("render", "v_object.yaml", "-o", "o.png")
    assert ended.is_one_line(
        2, f"objects.v.file: v.nrrd holds nothing but {what}, so there is no value to show"
    )
    assert shell("mesh", "v.nrrd", "-o", "o.ply").is_one_line(
        2, f"v.nrrd: has no surface: it holds nothing but {what}"
    )


def test_grids_without_a_surface_say_their_values(shell: InProcess) -> None:
    keep("v", of(1, 63), ", transfer: {opacity: [{at: 100, opacity: 0}, {at: 200, opacity: 1}]}")
    mesh = ("mesh", "v.nrrd", "-o", "o.ply")
    assert (
        "v.nrrd: has no surface at the level 400: its values are from 1 to 63"
        in shell(*mesh, "--level", "400").err
    )
    told = shell(*mesh, "--level", "-5", "--no-close").err
    assert (
        "has no surface: at the level -5 the whole box is inside, as its values are from 1 to 63; closed"
        in told
    )
    told = shell("render", "v.yaml", "-o", "o.png").err
    assert "opacity is 0 for the values that it holds: its values are from 1 to 63\n" in told
