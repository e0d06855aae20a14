"""Multi-view files after OpenEXR's rules, read back with the library and with our own header reader."""

from __future__ import annotations

import struct
from pathlib import Path

import numpy as np
import OpenEXR
import pytest
from hypothesis import given
from hypothesis import strategies as st

from clfractal.files.channels import CHANNELS, VIEWS, in_view, without_view
from clfractal.files.exr import read_exr, write_exr
from clfractal.files.exr_header import Attribute, read_header


def view_of(name: str, views: tuple[str, ...] = VIEWS) -> str:
    """The view that a reader takes a channel for: "Storing Multi-View Images in OpenEXR Files", "Channel Naming"."""
    parts = name.split(".")
    if len(parts) == 1:
        return views[0]
    return parts[-2] if parts[-2] in views else ""


@pytest.mark.parametrize("name", CHANNELS)
def test_readers_find_every_channel_in_its_view(name: str) -> None:
    names = [in_view(name, view) for view in VIEWS]
    assert [view_of(found) for found in names] == ["left", "right"]
    assert [without_view(found) for found in names] == [name, name]
    assert without_view(name) == name
    assert max(map(len, names)) <= 31  # the longest that readers of the first version take


def test_names() -> None:
    assert [in_view(name, "left") for name in ("R", "N.X", "a.b.c")] == ["R", "N.left.X", "a.b.left.c"]
    assert [in_view(name, "right") for name in ("R", "N.X", "a.b.c")] == [
        "right.R",
        "N.right.X",
        "a.b.right.c",
    ]
    # A view is looked for before the last part of a name, and nowhere else.
    assert [without_view(name) for name in ("right", "right.N.X", "N.left")] == [
        "right",
        "right.N.X",
        "N.left",
    ]


def write(path: Path, **header: object) -> dict[str, np.ndarray]:
    names = [in_view(name, view) for view in VIEWS for name in ("R", "Z", "N.X")]
    source = np.random.default_rng(4)
    planes = {name: source.random((20, 30), dtype=np.float32) for name in names}
    planes["right.Z"][2, 3] = np.inf
    planes["right.R"][2, 3] = np.inf
    write_exr(
        path,
        [planes],
        display=(30, 20),
        region=(0, 0, 30, 20),
        channels=names,
        half={"R", "right.R", "right.Z"},
        header={"multiView": VIEWS, **header},
    )
    return planes


def test_the_library_reads_both_views(tmp_path: Path) -> None:
    camera = np.arange(16, dtype=np.float32).reshape(4, 4)
    planes = write(tmp_path / "a.exr", **{"clfractal": "version: 1\n", "right.worldToCamera": camera})
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        header = dict(file.header())
        found = {name: np.array(channel.pixels) for name, channel in file.channels().items()}
        assert len(file.parts) == 1
    assert header["multiView"] == ["left", "right"]
    assert header["clfractal"] == "version: 1\n"
    assert np.array_equal(header["right.worldToCamera"], camera)
    assert sorted(found) == ["N.left.X", "N.right.X", "R", "Z", "right.R", "right.Z"]
    for name in ("N.left.X", "N.right.X", "Z"):
        assert np.array_equal(found[name], planes[name])
    # Infinite depth stays infinite in every view, infinite light does not.
    assert found["right.Z"].dtype == np.float16
    assert found["right.Z"][2, 3] == np.inf
    assert found["right.R"][2, 3] == 65504


def test_our_reader_knows_lists_of_texts(tmp_path: Path) -> None:
    write(tmp_path / "a.exr", names=["", "Grüße"], none=[])
    values = read_header(tmp_path / "a.exr").values()
    assert values["multiView"] == ("left", "right")
    assert values["names"] == ("", "Grüße")
    assert values["none"] == ()
    assert sorted(read_exr(tmp_path / "a.exr")[0]) == sorted(read_header(tmp_path / "a.exr").channels)


def test_a_text_is_no_list_of_texts(tmp_path: Path) -> None:
    write(tmp_path / "a.exr", view="right")
    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert file.header()["view"] == "right"


@given(st.binary(max_size=60) | st.lists(st.binary(max_size=9)).map(b"\x02\0\0\0".join))
def test_damaged_lists_of_texts_do_no_harm(data: bytes) -> None:
    found = Attribute("stringvector", data, 0).value()
    assert isinstance(found, tuple)
    whole = b"".join(struct.pack("<i", len(text)) + text for text in (b"left", b"", b"right"))
    assert Attribute("stringvector", whole, 0).value() == ("left", "", "right")
    assert Attribute("stringvector", whole + struct.pack("<i", -1) + data, 0).value() == ("left", "", "right")
